"""Travel of the nozzle over what other tools have printed, summed up; and lifts that take it out of a file.

A nozzle that travels in contact with another material can draw its own over it: a conductor over a dielectric. The
printed lines of a lifted file are those of the file, byte by byte and in order; where a travel passes over another
material, the nozzle first rises by ``LIFT_MM``. Nothing here shows that such strands conduct, or that lifts raise the
share of good prints.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.errors import BadInput
from sensorgen.design.printer import Printer
from sensorgen.export.gcode.crossings import CONTACT_MM, Crossings, crossings
from sensorgen.export.gcode.motion import Numbering, follow
from sensorgen.export.gcode.moves import Motion, seconds
from sensorgen.export.gcode.reading import Source, text_of
from sensorgen.export.gcode.results import COUNTED_MM, LIFT_MM, Drags, Lifting, OfLayer, ToolTravel

_DRAWN_MM = 2.0  # of a lifted travel over other materials, before which filament is drawn back: as profiles do [mm]
_RETRACTED = 0.5  # of a tool's usual retraction
_PLAIN = re.compile(rb"\s*G0*[01] [^;(]*", re.IGNORECASE)  # without a second command in brackets or behind
_Z = re.compile(rb"\s*Z\s*[-+.0-9]+", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Lifted:
    """A file with its lifts.

    Attributes
    ----------
    text : bytes
        The file.
    motion : Motion
        The same, followed.
    before, after : Crossings
        What its moves pass over, without the lifts and with them.
    lifting : Lifting
        Both summed up.
    """

    text: bytes
    motion: Motion
    before: Crossings
    after: Crossings
    lifting: Lifting


def drags(source: Source, machine: Printer) -> Drags:
    """Measure the travel over foreign material in a file, whoever has sliced it.

    Parameters
    ----------
    source : Path, bytes or iterable of str
        The G-code, with the printer's own tool numbers.
    machine : Printer
        Who is to print it.

    Raises
    ------
    BadInput
        The file cannot be read, or is no G-code.

    Examples
    --------
    >>> from sensorgen.design.printer import load_printer
    >>> lines = ["M83", "T3", "G1 Z0.1", "G1 X10 E0.2", "G1 Y-5", "T4", "G1 X5", "G1 Y5", "G1 X9 E.1"]
    >>> [(t.tool, round(t.contact_mm, 2)) for t in drags(lines, load_printer("diabase-h5")).tools]
    [(4, 0.5)]
    """
    motion = follow(source, machine.control.prime_macro)
    return summed(motion, crossings(motion, machine), machine)


def lift(source: Source, machine: Printer, numbering: Numbering = "printer") -> Lifted:
    """Lift the nozzle wherever it travels over foreign material.

    Parameters
    ----------
    source : Path, bytes or iterable of str
        The G-code.
    machine : Printer
        Who is to print it.
    numbering : "printer" or "slicer"
        Whether T counts as the printer does, or from 0.

    Raises
    ------
    BadInput
        The file cannot be read, is no G-code, or has crossings and places that are relative or in inches.
    """
    text = text_of(source)
    motion = follow(text, machine.control.prime_macro)
    passed, drawn = crossings(motion, machine, numbering), retracted(motion, machine)
    before = summed(motion, passed, machine)
    if not len(passed.travel.row):
        return Lifted(text, motion, passed, passed, Lifting(before, before, 0, 0, 0.0))
    odd = next((e for e in motion.events if e.command.code in ("G91", "G20")), None)
    if odd:
        raise BadInput(
            f"line {odd.number}: {odd.command.code}; travel is lifted in files with absolute places in mm alone: slice "
            "with G90 and G21"
        )
    writer = _Lifts(text, motion, machine, passed, drawn)
    lifted = writer.text()
    again = follow(lifted, machine.control.prime_macro)
    rubbing_mm = passed.rubbing_mm[motion.extruded_mm > 0]  # its lines are the same, and in the same order
    left = crossings(again, machine, numbering, rubbing_mm)
    took = [float(seconds(m, machine.max_speed_mm_s).sum()) for m in (motion, again)]
    after = summed(again, left, machine)
    lifting = Lifting(before, after, writer.lifts, writer.retractions, took[1] - took[0])
    return Lifted(lifted, again, passed, left, lifting)


def summed(motion: Motion, passed: Crossings, machine: Printer) -> Drags:
    """Sums by tool, and by tool and layer."""
    points, count, drawn = passed.travel, len(motion.rows), retracted(motion, machine)
    touches = points.gap_mm <= CONTACT_MM
    contact, near = (
        np.bincount(points.row[rows], points.length_mm[rows], minlength=count) for rows in (touches, ~touches)
    )
    # a crossing is all travel between two printed lines
    stretch = np.cumsum(motion.extruded_mm > 0)
    tools = []
    for tool in np.unique(passed.tool[(contact + near + passed.rubbing_mm) > 0]).tolist():
        mine = passed.tool == tool
        whole = np.bincount(stretch[mine], (contact + near)[mine]) > COUNTED_MM
        bare = np.bincount(stretch[mine], ((contact + near) * ~drawn)[mine]) > COUNTED_MM
        sums = [float(v[mine].sum()) for v in (contact, near, passed.rubbing_mm)]
        tools.append(ToolTravel(tool, sums[0], sums[1], int(whole.sum()), int(bare.sum()), sums[2]))
    keys = np.column_stack([np.round(points.place_mm[:, 2], 2), passed.tool[points.row]])
    found_keys, place = np.unique(keys, axis=0, return_inverse=True)
    lengths = [
        np.bincount(place.ravel()[rows], points.length_mm[rows], len(found_keys)).tolist()
        for rows in (touches, ~touches)
    ]
    layers = [OfLayer(z, int(tool), *sums) for (z, tool), *sums in zip(found_keys.tolist(), *lengths, strict=True)]
    return Drags(tuple(tools), tuple(layers))


def habits(motion: Motion) -> dict[float, tuple[float, float]]:
    """Length of the usual retraction of each tool of the file [mm], and its feed [mm/min]."""
    tools, retractions = motion.tools.column(len(motion.rows), -1.0), {}
    drawn = (motion.filament_mm < 0) & (motion.across_mm == 0)
    for tool in np.unique(tools[drawn]).tolist():
        rows = np.flatnonzero(drawn & (tools == tool))
        lengths, first, counts = np.unique(
            np.round(-motion.filament_mm[rows], 4), return_index=True, return_counts=True
        )
        most = counts.argmax()
        retractions[tool] = float(lengths[most]), float(motion.feed_mm_min[rows[first[most]]])
    return retractions


def retracted(motion: Motion, machine: Printer) -> Mask:
    """Moves during which the filament is drawn back."""
    count = len(motion.rows)
    tools, back = motion.tools.column(count, -1.0), np.zeros(count, bool)
    owed = motion.extruded_mm - motion.filament_mm
    usual = habits(motion)
    for tool in np.unique(tools).tolist():
        mine = tools == tool
        back[mine] = np.cumsum(owed[mine]) > _RETRACTED * usual.get(tool, (np.inf, 0.0))[0]
    if machine.control.firmware_retraction:  # G10 without temperatures or places, until G11
        for event in motion.events:
            if event.command.code == "G11" or (event.command.code == "G10" and not event.command.has("PSRLXYZ")):
                back[event.row :] = event.command.code == "G10"
    return back


class _Lifts:
    """A file in lines, and what is written between them."""

    def __init__(self, text: bytes, motion: Motion, machine: Printer, passed: Crossings, drawn: Mask) -> None:
        self.lines, self.motion, self.machine, self.passed = text.split(b"\n"), motion, machine, passed
        self.retracted, self.number = drawn, motion.number
        self.habits, self.tools = habits(motion), motion.tools.column(len(motion.rows), -1.0)
        self.relative_e = motion.absolute_e.column(len(motion.rows), 1.0) == 0
        self.lifts = self.retractions = 0

    def text(self) -> bytes:
        """The file with all lifts."""
        before: dict[int, list[str]] = {}
        after: dict[int, list[str]] = {}
        top = np.full(len(self.number), -np.inf)
        points = self.passed.travel
        np.maximum.at(top, points.row, points.place_mm[:, 2] - points.gap_mm)
        self.over_mm = np.bincount(points.row, points.length_mm, minlength=len(self.number))
        for first, last in self._groups(np.unique(points.row)):
            self._lift(first, last, top, before, after)
        lines, done = list[bytes](), 0
        for number in sorted({*before, *after}):
            lines += self.lines[done : number - 1]
            lines += [text.encode() for text in before.get(number, ())]
            lines.append(self.lines[number - 1])
            lines += [text.encode() for text in after.get(number, ())]
            done = number
        return b"\n".join([*lines, *self.lines[done:]])

    def _groups(self, rows: Whole) -> Iterator[tuple[int, int]]:
        """First and last of the moves that are made in one lift: nothing but travel lies between them."""
        motion = self.motion
        plain = (motion.across_mm > 0) & (motion.extruded_mm <= 0) & (motion.filament_mm <= 0)
        broken = np.zeros(len(self.number) + 1, np.int64)  # by a command between two moves
        broken[[*(e.row for e in motion.events), *(c.row for c in motion.changes)]] = 1
        blocks = np.cumsum(broken[:-1] + ~plain + np.append(0, ~plain[:-1]))
        for these in np.split(rows, np.flatnonzero(np.diff(blocks[rows])) + 1):
            yield int(these[0]), int(these[-1])

    def _lift(
        self, first: int, last: int, top: Real, before: dict[int, list[str]], after: dict[int, list[str]]
    ) -> None:
        """Write a lift before the first of some moves, and the way down after the last; their own Z words go."""
        numbers = self.number[first : last + 1].tolist()
        if len(set(numbers)) < len(numbers) or not all(_PLAIN.match(self.lines[n - 1]) for n in numbers):
            return  # more than one move in a line: reported as left
        heights = self.motion.rows[first : last + 1, [2, 5]]
        high = min(max(heights.max(), top[first : last + 1].max()) + LIFT_MM, self.machine.reach_mm().z[1])
        z_feed, feed = 60 * self.machine.max_speed_mm_s.z, self.motion.feed_mm_min
        length, speed = self.habits.get(self.tools[first], (0.0, 0.0))
        draws = self._draws(first, last)
        up = [f"G1 E-{_short(length)} F{_short(speed)}"] if draws else []
        up.append(f"G1 Z{_short(high)} F{_short(z_feed)}")
        if not self._has_feed(numbers[0]):
            up.append(f"G1 F{_short(feed[first])}")
        down = [f"G1 Z{_short(self.motion.rows[last, 5])} F{_short(z_feed)}"]
        down += [f"G1 E{_short(length)} F{_short(speed)}"] if draws else []
        if last + 1 < len(self.number) and not self._has_feed(int(self.number[last + 1])):
            down.append(f"G1 F{_short(feed[last])}")
        for number in numbers:
            code, semicolon, remark = self.lines[number - 1].partition(b";")
            self.lines[number - 1] = _Z.sub(b"", code) + semicolon + remark
        before[numbers[0]], after[numbers[-1]] = up, down
        self.lifts, self.retractions = self.lifts + 1, self.retractions + draws

    def _draws(self, first: int, last: int) -> bool:
        """Test whether filament is to be drawn back for some moves, and the file does not do so."""
        length, _ = self.habits.get(self.tools[first], (0.0, 0.0))
        far = self.over_mm[first : last + 1].sum() > _DRAWN_MM
        return bool(far and length and not self.retracted[first] and self.relative_e[first])

    def _has_feed(self, number: int) -> bool:
        return b"F" in self.lines[number - 1].partition(b";")[0].upper()


def _short(value: float) -> str:
    """A number of G-code, with what it needs of four decimals."""
    return f"{value:.4f}".rstrip("0").rstrip(".")
