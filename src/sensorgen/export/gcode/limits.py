"""Limits of a printer: commands that its firmware takes, and its axes, each rule for all moves at once."""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import inf

import numpy as np

from sensorgen.core import yamlfile
from sensorgen.core.arrays import Mask
from sensorgen.core.errors import BadInput
from sensorgen.design import packs
from sensorgen.design.materials import Material
from sensorgen.design.printer import Printer
from sensorgen.export.gcode import words
from sensorgen.export.gcode.moves import NO_TOOL, Event, Motion
from sensorgen.export.gcode.results import Findings, GcodeFinding
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
    data = yamlfile.read(packs.profiles() / "commands" / f"{flavour}.yaml")
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


def check_commands(events: Iterable[Event], machine: Printer, printed: tuple[int, int], findings: Findings) -> None:
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


HAIR_MM = 1e-6  # what rounding may make of a limit
STEP_MM = 1e-3  # heights closer than this are one height
MM_MIN = 60.0
MOST_TOLD = 20  # lines that cannot be read; more of them say no more


def check(motion: Motion, machine: Printer) -> Iterator[GcodeFinding]:
    """Findings of all rules on moves.

    Parameters
    ----------
    motion : Motion
        The file.
    machine : Printer
        Who is to print it.
    """
    for rule in RULES:
        yield from rule(motion, machine)


def check_loaded(
    motion: Motion, machine: Printer, loaded: Mapping[int, Material], *, others_empty: bool
) -> Iterator[GcodeFinding]:
    """Lines that suit no material of their tool: melted faster than it can be, or of a tool on which there is nothing.

    Parameters
    ----------
    motion : Motion
        The file.
    machine : Printer
        Who is to print it.
    loaded : mapping of int to Material
        Of each tool that has one.
    others_empty : bool
        Whether nothing is on the other tools.
    """
    tools = motion.tools.column(len(motion.rows), NO_TOOL)
    if others_empty:
        known = ", ".join(f"{material.name} on {one}" for one, material in loaded.items())
        for tool in np.setdiff1d(tools[motion.extruded_mm > 0], [NO_TOOL, *loaded]).astype(int).tolist():
            message = f"tool {tool} prints, and nothing is on it; loaded are {known}"
            rows = (tools == tool) & (motion.extruded_mm > 0)
            yield GcodeFinding("tool", "error", int(motion.number[rows][0]), message, "use another tool")
    area_mm2 = motion.extruded_mm * (math.pi / 4 * machine.filament_mm**2)
    area_mm2 /= np.where(motion.prints, motion.length_mm, 1.0)
    flow_mm3_s = np.where(motion.prints, area_mm2 * motion.feed_mm_min / MM_MIN, 0.0)
    for tool, material in loaded.items():
        most = material.print_range("max_flow_mm3_s", 0.0)[1]
        wrong = (tools == tool) & (flow_mm3_s > most * (1 + 1e-6))
        fastest = float(flow_mm3_s[wrong].max(initial=0.0))
        yield from _found(
            motion, wrong, "melt", "error",
            f"tool {tool} prints {fastest:.3g} mm3/s of {material.name}; it melts {most:g} mm3/s",
            "print slower or thinner lines",
        )  # fmt: skip


def _found(motion: Motion, wrong: Mask, rule: str, severity: str, message: str, advice: str) -> Iterator[GcodeFinding]:
    """A finding if any move is wrong."""
    if wrong.any():
        yield GcodeFinding.of(rule, motion.number[wrong], message, advice, severity)


def _reach(motion: Motion, machine: Printer) -> Iterator[GcodeFinding]:
    """No axis leaves its limits."""
    reach = machine.reach_mm()
    lowest, highest = motion.box_mm()
    for k, (name, (low, high)) in enumerate(zip("XYZ", (reach.x, reach.y, reach.z), strict=True)):
        below, above = lowest[:, k], highest[:, k]
        for wrong, column, worst in ((below < low - HAIR_MM, below, np.min), (above > high + HAIR_MM, above, np.max)):
            value = float(worst(column[wrong])) if wrong.any() else 0.0
            yield from _found(
                motion, wrong, "reach", "error",
                f"a move goes to {name} {value:g}; the axis reaches {low:g} to {high:g} mm",
                "place the print inside, and check the origin of the bed",
            )  # fmt: skip


def _bed(motion: Motion, machine: Printer) -> Iterator[GcodeFinding]:
    """Nothing is printed beside the bed or above the print volume."""
    middle = np.array(machine.bed_centre_mm())
    low, high = (box[:, :2] for box in motion.box_mm())
    beside = np.maximum(high - middle, middle - low) - np.array(machine.bed_mm) / 2
    wrong = motion.prints & (beside > HAIR_MM).any(axis=1)
    far = float(beside[wrong].max()) if wrong.any() else 0.0
    wide, deep = machine.bed_mm
    yield from _found(
        motion, wrong, "bed", "error", f"lines are printed up to {far:.3g} mm beside the bed of {wide:g} x {deep:g} mm",
        "place the print on the bed",
    )  # fmt: skip
    above = motion.prints & (motion.end_mm[:, 2] > machine.height_mm + HAIR_MM)
    yield from _found(
        motion, above, "bed", "error", f"lines are printed above {machine.height_mm:g} mm",
        "print a lower piece",
    )  # fmt: skip


def _below(motion: Motion, _: Printer) -> Iterator[GcodeFinding]:
    """No move across goes lower than what is already printed: the nozzle would plough through it."""
    across = motion.across_mm > 0
    lowest = np.minimum(motion.start_mm[:, 2], motion.end_mm[:, 2])
    printed = np.where(motion.prints, lowest, -np.inf)
    named = ((e.row, e.command) for e in motion.events if e.command.code == "G92")
    anew = {row for row, command in named if command.has("Z") or not command.has("XYE")}  # heights count anew
    edges = [0, *sorted(anew), len(lowest)]
    wrong = np.zeros(len(lowest), dtype=bool)
    for start, end in pairwise(edges):
        top = np.maximum.accumulate(printed[start:end])
        wrong[start:end] = across[start:end] & (motion.end_mm[start:end, 2] < top - STEP_MM)
    yield from _found(
        motion, wrong, "below", "error", "a move goes across lower than a layer that is already printed",
        "raise the nozzle first; pieces printed one after the other are not for this printer",
    )  # fmt: skip


def _speed(motion: Motion, machine: Printer) -> Iterator[GcodeFinding]:
    """A feed is above 0, and no axis is asked for more than its limit."""
    message, advice = "a move has a feed of 0 or less", "give a feed (F)"
    yield from _found(motion, motion.feed_mm_min <= 0, "speed", "error", message, advice)
    feed = motion.feed_mm_min / MM_MIN
    across, filament = motion.across_mm, np.abs(motion.filament_mm)
    up = np.abs(motion.rows[:, 5] - motion.rows[:, 2])
    way = np.hypot(across, up)
    rate = feed / np.where(way > 0, way, np.maximum(filament, 1e-12))
    limits = machine.max_speed_mm_s
    down = motion.z_stated & ~np.append(True, motion.z_stated[:-1])  # from where macros have left the nozzle
    down |= motion.start_mm[:, 2] != np.append(0.0, motion.end_mm[:-1, 2])
    axes = (("X and Y", across, limits.xy), ("Z", up, limits.z), ("E", filament, limits.extruder))
    for name, length, limit in axes:
        fast = rate * length
        over = (fast > limit * (1 + 1e-6)) & ~((name == "Z") & down)
        for rows, severity, what, then in (
            (over & motion.prints, "error", "a line is printed", "it was sliced for another speed"),
            (over & ~motion.prints, "warning", "a move without printing goes", "the firmware slows it down"),
        ):
            most = float(fast[rows].max()) * MM_MIN if rows.any() else 0.0
            yield from _found(
                motion, rows, "speed", severity,
                f"{what} with {name} at {most:.0f} mm/min; the limit is {limit * MM_MIN:.0f}: {then}",
                "lower the feed (F)",
            )  # fmt: skip


def _purge(motion: Motion, machine: Printer) -> Iterator[GcodeFinding]:
    """Filament that is pushed at one place, or drawn back in all, stays within what was seen to work."""
    control, count = machine.control, len(motion.rows)
    tools = motion.tools.column(count, NO_TOOL)
    rests = motion.across_mm == 0
    rests[1:] &= tools[1:] == tools[:-1]  # each tool counts by itself
    pushed = np.cumsum(np.where(rests, motion.filament_mm, 0.0))
    last = np.maximum.accumulate(np.where(rests, -1, np.arange(count)))
    at_once = pushed - np.where(last >= 0, pushed[last], 0.0)
    back = np.zeros(count)
    for tool in np.unique(tools):
        rows = tools == tool
        given = np.cumsum(motion.filament_mm[rows])
        back[rows] = np.maximum.accumulate(np.maximum(given, 0.0)) - given
    shorter = "purge in shorter pieces; left-over absolute E looks like this too"
    forward = "push it forward before it is drawn back again: beyond this it leaves the hot end"
    for mm, most, what, advice in (
        (at_once, control.longest_purge_mm, "pushed at one place", shorter),
        (back, control.longest_retraction_mm, "drawn back", forward),
    ):
        wrong = mm > most + HAIR_MM
        value = float(mm.max(initial=0.0))
        message = f"{value:g} mm of filament are {what}; the limit is {most:g} mm"
        yield from _found(motion, wrong, "purge", "error", message, advice)


def _z_stated(motion: Motion, machine: Printer) -> Iterator[GcodeFinding]:
    """Z is stated after a change of tool before a line is printed, where the printer's macros leave it elsewhere."""
    change = words.of_change(machine)
    if change is None or (change.offset_mm[2] == 0 and math.isnan(change.place_mm[2])):
        return
    where = f"{change.offset_mm[2]:g} mm above" if math.isnan(change.place_mm[2]) else f"at {change.place_mm[2]:g} mm"
    yield from _found(
        motion, motion.prints & ~motion.z_stated, "z", "error",
        f"lines are printed after a tool change before Z is stated; the macros of {machine.name} leave the nozzle "
        f"{where}", "state Z (G1 Z) after each T",
    )  # fmt: skip


def _read(motion: Motion, _: Printer) -> Iterator[GcodeFinding]:
    """Every line can be read."""
    for severe, advice in ((True, "correct the line"), (False, "keep to plain ASCII and plain commands")):
        faults = [fault for fault in motion.faults if fault.severe == severe]
        severity = "error" if severe else "warning"
        for fault in faults[:MOST_TOLD]:
            yield GcodeFinding("read", severity, fault.number, fault.what, advice)
        if rest := faults[MOST_TOLD:]:
            message = "further lines cannot be read: is this G-code?"
            yield GcodeFinding("read", severity, rest[0].number, message, advice, len(rest))


RULES: tuple[Callable[[Motion, Printer], Iterator[GcodeFinding]], ...] = (
    _reach, _bed, _below, _speed, _purge, _z_stated, _read,
)  # fmt: skip
