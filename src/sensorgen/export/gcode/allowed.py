"""Commands that a print may send to a printer: a list for its firmware, which the printer's own file may change."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from math import inf

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput
from sensorgen.design.printer import Printer, folder
from sensorgen.export.gcode.found import Findings
from sensorgen.export.gcode.moves import Event
from sensorgen.export.gcode.words import Command

ANY = "*"
_NUMBER = "-?[0-9]+(?:[.][0-9]+)?"
_WORD = re.compile(f"([A-Z])(?:({_NUMBER})(?:[.][.]({_NUMBER}))?)?")


@dataclass(frozen=True)
class Allowed:
    """Words that a command may have.

    Attributes
    ----------
    text : str
        Its words as the list has them.
    words : mapping of str to (float, float), or None
        Range of each word; None for any words.
    outside : bool
        Whether it belongs before the first printed line or after the last.
    """

    text: str
    words: Mapping[str, tuple[float, float]] | None
    outside: bool

    def faults(self, command: Command, code: str, printer: str) -> Iterator[tuple[str, str]]:
        """Message and advice for each word that a command may not have, or not with its value."""
        shown = str(command)[:60]
        for letter, _ in command.words:
            value = command.number(letter)
            low, high = self.words.get(letter, (inf, -inf)) if self.words is not None else (-inf, inf)
            if letter and low > high:
                takes = f"takes {self.text}" if self.text else "takes no words"
                yield f"{letter} in {shown}: {code} {takes} on {printer}", "leave it out"
            elif (low, high) != (-inf, inf) and not (value is not None and low <= value <= high):
                expected = f"{letter}{low:g}" if low == high else f"{letter}{low:g} to {high:g}"
                yield f"{shown}: expected {expected}", "keep to this range"


@dataclass(frozen=True)
class Commands:
    """Commands that a printer takes in a print, and why others are refused, by their code; ``T`` for all tools."""

    allowed: Mapping[str, Allowed]
    refused: Mapping[str, str]


def commands(machine: Printer) -> Commands:
    """The list of a printer: that of its firmware, changed by its own file.

    Raises
    ------
    BadInput
        The printer's file has words that cannot be read.
    """
    entries = dict(_of_firmware(machine.gcode_flavour).allowed)
    for code, text in machine.control.commands.items():
        if text is None:
            entries.pop(code, None)
        else:
            entries[code] = _allowed(code, text, outside=code in entries and entries[code].outside)
    return Commands(entries, _of_firmware(machine.gcode_flavour).refused)


@cache
def _of_firmware(flavour: str) -> Commands:
    data = yamlfile.read(folder() / "commands" / f"{flavour}.yaml")
    return Commands(
        {
            code: _allowed(code, text, outside=place == "outside")
            for place in ("anywhere", "outside")
            for code, text in data[place].items()
        },
        data["refused"],
    )


def _allowed(code: str, text: str, *, outside: bool) -> Allowed:
    """An entry of the list.

    >>> _allowed("G4", "S0..60 P", outside=False).words
    {'S': (0.0, 60.0), 'P': (-inf, inf)}
    """
    words = {}
    for word in text.replace(ANY, "").split():
        match = _WORD.fullmatch(word)
        if match is None:
            raise BadInput(f"control.commands.{code}: {word!r}; expected a letter with a number or a range, as S0..255")
        letter, low, high = match.groups()
        words[letter] = (float(low), float(high or low)) if low else (-inf, inf)
    return Allowed(text, None if ANY in text else words, outside)


def check(events: Iterable[Event], machine: Printer, printed: tuple[int, int], findings: Findings) -> None:
    """Refuse commands, words and values that are not on a printer's list, each with its line.

    Parameters
    ----------
    events : iterable of Event
        Commands, and moves with other words than those of places, filament, feed and arcs.
    machine : Printer
        Who is to print.
    printed : (int, int)
        Moves before the first printed line, and before the last [-].
    findings : Findings
        Grows.
    """
    known, name = commands(machine), machine.name
    first, last = printed
    for event in events:
        code = "T" if event.command.code[0] == "T" else event.command.code
        entry = known.allowed.get(code)
        if entry is None:
            why = known.refused.get(code)
            message = f"{code} {why}" if why else f"{name} has no {code} in its list of commands"
            advice = "leave it out, or add it to the printer's file (control: commands)"
            findings.error("command", event.number, message, advice)
            continue
        if entry.outside and first < event.row <= last:
            message = f"{str(event.command)[:60]} stands between printed lines"
            findings.error("command", event.number, message, "move it before the first printed line or after the last")
        for message, advice in entry.faults(event.command, code, name):
            findings.error("command", event.number, message, advice)
