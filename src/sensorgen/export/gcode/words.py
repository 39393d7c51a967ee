"""One line of G-code, after RepRapFirmware's own reading: commands, the effect of macros, slicers' remarks.

A line may carry a number (``N12``), a checksum (``*57``), remarks in brackets or after a semicolon, strings in
double quotes, and more than one command. Nothing here knows what a command means.
"""

import math
import re
from dataclasses import dataclass
from functools import lru_cache, reduce
from math import nan

from sensorgen.core.errors import BadInput
from sensorgen.design.printer import Printer

NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)"

_TOKEN = re.compile(
    r"""\s*(?:
        ;(?P<remark>.*)
      | \((?P<bracket>[^)]*)\)?
      | \*(?P<checksum>[0-9]+)
      | (?P<letter>[A-Za-z])[ \t]*(?P<value>
            "(?:[^"]|"")*"? | \{[^}]*\}? | [-+]?(?:nan|inf)[a-z]* | [-+0-9.:]* )
      | (?P<junk>[^\s])
    )""",
    re.VERBOSE | re.IGNORECASE | re.DOTALL,
)
_LONGEST = 4096  # characters before a comment; firmwares take a few hundred
_MOST_FAULTS = 5  # of one line: a line of noise needs no more
_META = re.compile(r"\s*(?:if|elif|else|while|break|continue|var|global|set|echo|abort|skip)\b", re.IGNORECASE)
_FREE_TEXT = re.compile(r"\s*(?:N[0-9]+\s*)?(M(?:23|28|30|32|36|38|117))(?![0-9])\s*(.*)", re.IGNORECASE | re.DOTALL)
_NUMBER = re.compile(NUMBER)


@dataclass(frozen=True, slots=True)
class Command:
    """A command and its words: ``G10`` with ``(("P", "3"), ("S", "210"))``.

    Attributes
    ----------
    code : str
        Letter and number, in capitals and without leading zeros.
    words : tuple of (str, str)
        Letter of each word, in capitals, and its text as it stands; a string without its quotes.
    """

    code: str
    words: tuple[tuple[str, str], ...] = ()

    def __str__(self) -> str:
        return " ".join([self.code, *(letter + text for letter, text in self.words)])

    def text(self, letter: str) -> str | None:
        """Text of a word, or None where the command has no such word."""
        return next((text for name, text in self.words if name == letter), None)

    def number(self, letter: str) -> float | None:
        """Number of a word, the first of a list as ``210:205``; nan where it is none, None without the word."""
        text = self.text(letter)
        if text is None:
            return None
        first = text.partition(":")[0]
        return float(first) if _NUMBER.fullmatch(first) else math.nan

    def has(self, letters: str) -> bool:
        """Test whether it has a word with any of these letters."""
        return any(name in letters for name, _ in self.words)

    def without(self, letters: str) -> "Command":
        """The command without the words with these letters."""
        return Command(self.code, tuple(word for word in self.words if word[0] not in letters))


def word(letter: str, value: float) -> str:
    """A word of a command, with what its number needs of four decimals.

    >>> word("Z", 0.30004)
    'Z0.3'
    """
    return letter + f"{value:.4f}".rstrip("0").rstrip(".")


@dataclass(frozen=True, slots=True)
class GcodeLine:
    """Content of a line: its commands, its remarks, and what could not be read."""

    commands: tuple[Command, ...]
    remark: str = ""
    faults: tuple[str, ...] = ()


def parse(text: str) -> GcodeLine:
    """Read one line.

    Parameters
    ----------
    text : str
        The line, with or without its end.

    Returns
    -------
    Line
        Its commands in order; ``faults`` has what is no G-code, in words.

    Examples
    --------
    >>> line = parse('N3 g01 X-1.5 (left) E.2 ; wall')
    >>> line.commands, line.remark
    ((Command(code='G1', words=(('X', '-1.5'), ('E', '.2'))),), ' wall')
    >>> parse('M291 P"say ""hi""; go" S3').commands[0].text("P")
    'say "hi"; go'
    """
    if len(text) > _LONGEST and len(text.partition(";")[0]) > _LONGEST:
        return GcodeLine((), "", (f"a line of {len(text)} characters; no firmware takes it",))
    if free := _FREE_TEXT.match(text):
        code, rest = free.groups()
        return GcodeLine((Command(code.upper(), (("", rest.partition(";")[0].strip()),)),))
    if is_meta(text):
        return GcodeLine(
            (), "", (f"a line of the firmware's own language, which is not followed: {text.strip()[:60]!r}",)
        )
    return _read(text)


def is_meta(text: str) -> bool:
    """Test whether a line is of the firmware's own language, as ``if`` and ``while``."""
    return _META.match(text) is not None


def _read(text: str) -> GcodeLine:
    commands: list[tuple[str, list[tuple[str, str]]]] = []
    faults: list[str] = []
    remark = ""
    for token in _TOKEN.finditer(text.strip()):
        kind = token.lastgroup
        if kind == "value":
            faults += _take(commands, token["letter"].upper(), token["value"])
        elif kind == "remark":
            remark = token["remark"].rstrip("\r\n")
        elif kind == "bracket":
            remark = remark or token["bracket"]
        elif kind == "checksum":
            given, line = int(token["checksum"]), text[: token.start("checksum") - 1].encode("utf-8", "surrogateescape")
            if (checksum := reduce(lambda a, b: a ^ b, line, 0)) != given:
                faults.append(f"checksum {given} is wrong: the line makes {checksum}")
        else:
            faults.append(f"{token['junk']!r} means nothing here")
    parsed = tuple(Command(code, tuple(words)) for code, words in commands)
    return GcodeLine(parsed, remark, tuple(faults[:_MOST_FAULTS]))


def _begin(commands: list[tuple[str, list[tuple[str, str]]]], letter: str, value: str) -> list[str]:
    """Add a command without words."""
    number = float(value) if _NUMBER.fullmatch(value) else math.inf
    if math.isinf(number):
        return [f"{letter}{value[:20]} is no command"]
    commands.append((f"{letter}{int(number)}" if number == int(number) else f"{letter}{value}", []))
    return []


def _take(commands: list[tuple[str, list[tuple[str, str]]]], letter: str, value: str) -> list[str]:
    """Add a word to the last command, or start the next one."""
    if letter == "N" and not commands:
        return []
    if letter in "GM" or (letter == "T" and not commands):
        return _begin(commands, letter, value)
    if not commands:
        return [f"{letter}{value} stands before any command"]
    quoted = value.startswith('"')
    text = value[1:].removesuffix('"').replace('""', '"') if quoted else value
    commands[-1][1].append((letter, text))
    return [f"the string after {letter} does not end"] if value.count('"') % 2 else []


_RESTORE = 2.0  # point at which RepRapFirmware stores where a tool was taken


@dataclass(frozen=True)
class Effect:
    """State of the machine after macros.

    Attributes
    ----------
    offset_mm : tuple of float
        From where the nozzle was, along X, Y and Z [mm].
    place_mm : tuple of float
        Absolute position instead; nan for none [mm].
    relative : bool or None
        Mode of places left behind; None if unchanged.
    waits : bool
        Wait for the temperature of the tool (M116).
    """

    offset_mm: tuple[float, ...]
    place_mm: tuple[float, ...]
    relative: bool | None
    waits: bool


def of_change(machine: Printer) -> Effect | None:
    """Effect of a change of tool; None where the printer's file states no macro of it."""
    text = machine.macro("tfree", "tpre", "tpost")  # run in this order
    return None if text is None else effect(text)


@lru_cache(maxsize=64)
def effect(text: str) -> Effect:
    r"""Execute lines of macros.

    Raises
    ------
    BadInput
        A line that cannot be followed, as a condition.

    Examples
    --------
    >>> effect("G91\nG1 Z40\nG90\nG1 R2 X0 Y0\nG1 R2 Z2")
    Effect(offset_mm=(0.0, 0.0, 2.0), place_mm=(nan, nan, nan), relative=False, waits=False)
    """
    offset, place, relative, waits = [0.0] * 3, [nan] * 3, None, False
    for line in text.splitlines():
        parsed = parse(line)
        if parsed.faults:
            raise BadInput(f"macros: {line.strip()[:60]!r} cannot be followed; state its effect: lift_mm, return_mm")
        for command in parsed.commands:
            waits |= command.code == "M116"
            relative = {"G90": False, "G91": True}.get(command.code, relative)
            if command.code in ("G0", "G1"):
                _move(command, offset, place, relative=bool(relative))
    return Effect(tuple(offset), tuple(place), relative, waits)


def _move(command: Command, offset: list[float], place: list[float], *, relative: bool) -> None:
    for k, axis in enumerate("XYZ"):
        value = command.number(axis)
        if value is None:
            continue
        if command.number("R") == _RESTORE:
            offset[k], place[k] = value, nan
        elif relative:
            offset[k], place[k] = offset[k] + value, place[k] + value
        else:
            place[k] = value


# Quantities that hold until the next comment of their sort.
KIND, WIDTH, HEIGHT, LAYER, NEXT_LAYER = "kind", "width", "height", "layer", "next layer"
MAKER, PRUSA = "maker", "PrusaSlicer"  # who has written the file, once at its top

_LENGTH = re.compile(r"\s*([0-9]+\.?[0-9]*|\.[0-9]+)\s*(?:mm)?\s*")
_LAYER_AND_Z = re.compile(r"layer ([0-9]+), Z = ")
_TOOL_LINE = re.compile(r"tool H([0-9.]+) W([0-9.]+)")

_KINDS = ("TYPE", "FEATURE")
_LENGTHS = {
    "WIDTH": WIDTH, "LINE_WIDTH": WIDTH, "HEIGHT": HEIGHT, "LAYER_HEIGHT": HEIGHT, "Layer height": HEIGHT,
}  # fmt: skip

Note = tuple[str, str | float]


def notes(remark: str) -> list[Note]:
    """Quantities and values of one comment, without its semicolon.

    Parameters
    ----------
    remark : str
        The comment of PrusaSlicer, Cura, Orca, Bambu Studio or Simplify3D.

    Returns
    -------
    list of (str, str or float)
        Kind of line in lower case; width and height [mm]; layer from 1 at the bed [-]. Empty for any
        other comment.

    Examples
    --------
    >>> notes("TYPE:External perimeter"), notes("HEIGHT:0.1"), notes("LAYER:0"), notes(" thumbnail begin 16x16")
    ([('kind', 'external perimeter')], [('height', 0.1)], [('layer', 1.0)], [])
    """
    key, _, value = remark.partition(":")
    key = key.strip()
    if key in _KINDS:
        return [(KIND, value.strip().lower())]
    if key in _LENGTHS:
        length = _LENGTH.fullmatch(value)
        return [(_LENGTHS[key], float(length[1]))] if length else []
    if key in ("LAYER_CHANGE", "CHANGE_LAYER"):
        return [(NEXT_LAYER, 1.0)]
    if key == "LAYER":
        return [(LAYER, float(int(value) + 1))] if re.fullmatch(r"\s*-?[0-9]{1,9}\s*", value) else []
    if key.startswith(f"generated by {PRUSA}"):
        return [(MAKER, PRUSA)]
    return _simplify3d(remark.strip()) if key[:4] in ("feat", "laye", "tool") else []


def _simplify3d(remark: str) -> list[Note]:
    if remark.startswith("feature "):
        return [(KIND, remark.removeprefix("feature ").strip().lower())]
    if match := _LAYER_AND_Z.match(remark):
        return [(LAYER, float(match[1]))]
    match = _TOOL_LINE.fullmatch(remark)
    pairs = ((HEIGHT, match[1]), (WIDTH, match[2])) if match else ()
    return [(quantity, float(value)) for quantity, value in pairs if _LENGTH.fullmatch(value)]
