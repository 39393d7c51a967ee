"""Where the nozzle passes over what other tools have printed before, summed up; and lifts that take it out of a file.

Every move is clipped against every earlier line that it may meet, as rectangles in plan whose width follows from the
filament (Liang and Barsky, 1984, in the line's own directions); no raster of the bed.

A nozzle that travels in contact with another material can draw its own over it: a conductor over a dielectric. The
printed lines of a lifted file are those of the file, byte by byte and in order; where a travel passes over another
material, the nozzle first rises by ``LIFT_MM``. Nothing here shows that such strands conduct, or that lifts raise the
share of good prints.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import shapely

from sensorgen.core.arrays import ColumnRecord, Mask, Real, Whole, parts_of
from sensorgen.core.errors import BadInput
from sensorgen.design.printer import Printer
from sensorgen.export.gcode.motion import Numbering, follow, paths_of, tools_of
from sensorgen.export.gcode.moves import Motion, seconds
from sensorgen.export.gcode.reading import Source, text_of
from sensorgen.export.gcode.results import COUNTED_MM, FACE_MM, LIFT_MM, NEAR_MM, Drags, Lifting, OfLayer, ToolTravel
from sensorgen.export.gcode.words import word

CONTACT_MM = 0.03  # a nozzle within this above a line touches it: less than the thinnest layer
PITCH_MM = 0.05  # between the points of a travel that are looked at
_RUB_PITCH_MM = 0.1  # as above, of a printed line
_PIECE_MM = 2.5  # moves are cut to this for the search of what they meet
_LEVEL_MM = 1e-3  # tops closer than this are one level
_ROUNDING_MM = 1e-6
_BLOCK = 10_000  # pieces that are looked at together
_TREES = 5  # that are held at once

_Met = tuple[Whole, Whole, Real, Real]
_Trees = Callable[["_Level"], shapely.STRtree]


@dataclass(frozen=True, eq=False)
class PrintedLines(ColumnRecord):
    """Printed lines of the bodies as rectangles in plan, half a width longer at both ends.

    Attributes
    ----------
    start_mm, end_mm : (n, 2) array
        In plan.
    top_mm, width_mm : (n,) array
        Height of the nozzle, and width that keeps the volume.
    tool, number : (n,) array of int
        The printer's own number of the tool, and the line of the file [-].
    """

    start_mm: Real
    end_mm: Real
    top_mm: Real
    width_mm: Real
    tool: Whole
    number: Whole


@dataclass(frozen=True, eq=False)
class MovePieces(ColumnRecord):
    """Straight pieces of moves.

    Attributes
    ----------
    row : (n,) array of int
        Move of each piece [-].
    start_mm, end_mm : (n, 3) array
        Its ends.
    tool, number : (n,) array of int
        The printer's own number of the tool, and the line of the file [-].
    """

    row: Whole
    start_mm: Real
    end_mm: Real
    tool: Whole
    number: Whole


@dataclass(frozen=True, eq=False)
class Points:
    """Points of moves that lie over lines of another tool, within ``NEAR_MM``.

    Attributes
    ----------
    row : (n,) array of int
        Move of each point [-].
    place_mm : (n, 3) array
        Where the nozzle is.
    gap_mm : (n,) array
        From the highest line there up to the nozzle; 0 in contact.
    length_mm : (n,) array
        Length of the move that the point stands for.
    """

    row: Whole
    place_mm: Real
    gap_mm: Real
    length_mm: Real


@dataclass(frozen=True, eq=False)
class Stretches:
    """Straight stretches of travel over lines of another tool.

    Attributes
    ----------
    start_mm, end_mm : (n, 3) array
        First and last point of each.
    length_mm : (n,) array
        Length that its points stand for.
    touches : (n,) array of bool
        Whether the nozzle is in contact.
    tool : (n,) array of int
        The printer's own number of the tool [-].
    """

    start_mm: Real
    end_mm: Real
    length_mm: Real
    touches: Mask
    tool: Whole


@dataclass(frozen=True, eq=False)
class Crossings:
    """Crossings of other tools' material by the moves of a file.

    Attributes
    ----------
    travel : Points
        Of moves that print nothing.
    rubbing_mm : (m,) array
        Length of every move that prints a line while the nozzle's face touches what another tool has printed.
    tool : (m,) array of int
        The printer's own number of the tool of every move [-].
    """

    travel: Points
    rubbing_mm: Real
    tool: Whole

    def stretches(self) -> Stretches:
        """The travel as straight stretches, in contact or near."""
        points = self.travel
        touches, place = points.gap_mm <= CONTACT_MM, points.place_mm
        joined = (np.diff(points.row) == 0) & (touches[1:] == touches[:-1])
        joined &= np.hypot(*np.diff(place[:, :2], axis=0).T) < 1.5 * PITCH_MM
        first = np.flatnonzero(np.append(True, ~joined)[: len(place)])
        last = np.append(first[1:], len(place))[: len(first)] - 1
        length = np.diff(np.append(0.0, np.cumsum(points.length_mm)[last]))
        return Stretches(place[first], place[last], length, touches[first], self.tool[points.row[first]])


def crossings(
    motion: Motion, machine: Printer, numbering: Numbering = "printer", rubbing_mm: Real | None = None
) -> Crossings:
    """Find where the nozzle passes over what another tool has printed before.

    Parameters
    ----------
    motion : Motion
        The file. Skirt, tower and support count for nothing where its comments name them.
    machine : Printer
        Whose G-code it is.
    numbering : "printer" or "slicer"
        Whether T counts as the printer does, or from 0.
    rubbing_mm : (k,) array, optional
        Of every move that extrudes, where it is known; measured if not given.
    """
    lines, tool = printed_lines(motion, machine, numbering), tools_of(motion, machine, numbering)
    moves = (motion.across_mm > 0) & (motion.rows[:, 5] < lines.top_mm.max(initial=0.0) + NEAR_MM)
    travels = np.flatnonzero(moves & (motion.extruded_mm <= 0))
    rubs = np.flatnonzero(moves & (motion.extruded_mm > 0) & np.isin(motion.number, lines.number))
    rubbing = np.zeros(len(tool))
    if rubbing_mm is None:
        for points in _over(_blocks(motion, tool, rubs), lines, CONTACT_MM, FACE_MM):
            np.add.at(rubbing, points.row, points.length_mm)
    else:
        rubbing[motion.extruded_mm > 0] = rubbing_mm
    nothing = Points(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0), np.zeros(0))
    over = [nothing, *_over(_blocks(motion, tool, travels), lines, NEAR_MM, 0.0)]
    travel = (np.concatenate([getattr(p, name) for p in over]) for name in Points.__dataclass_fields__)
    return Crossings(Points(*travel), rubbing, tool)


def printed_lines(motion: Motion, machine: Printer, numbering: Numbering) -> PrintedLines:
    """The lines of the bodies with their widths by volume."""
    paths = paths_of(motion, machine, numbering).model()
    level = np.round(paths.end_mm[:, 2] / _LEVEL_MM).astype(np.int64)
    tops = np.unique(level)
    rise = np.diff(tops, prepend=0)[np.searchsorted(tops, level)] * _LEVEL_MM
    height = np.where(
        np.isfinite(paths.height_mm) & (paths.height_mm > 0), paths.height_mm, np.maximum(rise, _LEVEL_MM)
    )
    width = paths.volume_mm3(machine.filament_mm) / (paths.length_mm() * height)
    top, ends = np.asarray(level * _LEVEL_MM, float), (paths.start_mm[:, :2], paths.end_mm[:, :2])
    return PrintedLines(*ends, top, width, paths.tool, paths.number)


def _cut(motion: Motion, tool: Whole, rows: Whole) -> MovePieces:
    """Moves as pieces of at most ``_PIECE_MM``; an arc as its chord."""
    start, way = motion.start_mm[rows], motion.end_mm[rows] - motion.start_mm[rows]
    which, low, high = _shares(_counts(way[:, :2]))
    start, way = start[which], way[which]
    first, last = (start + share[:, None] * way for share in (low, high))
    return MovePieces(rows[which], first, last, tool[rows][which], motion.number[rows][which])


def _blocks(motion: Motion, tool: Whole, rows: Whole) -> Iterator[MovePieces]:
    """Moves as pieces, some at a time: all at once would take more memory than the file."""
    for first in range(0, len(rows), _BLOCK):
        pieces = _cut(motion, tool, rows[first : first + _BLOCK])
        for start in range(0, len(pieces.row), _BLOCK):
            yield pieces.of(slice(start, start + _BLOCK))


def _counts(way_mm: Real) -> Whole:
    """Number of pieces that each way in plan is cut to."""
    counts: Whole = np.maximum(np.ceil(np.hypot(*way_mm.T) / _PIECE_MM), 1).astype(np.int64)
    return counts


def _shares(count: Whole) -> tuple[Whole, Real, Real]:
    """Of each piece, of some things cut to so many: the thing, and from which share of it to which."""
    which, step = parts_of(count)
    return which, step / count[which], (step + 1) / count[which]


def _over(blocks: Iterator[MovePieces], lines: PrintedLines, within_mm: float, grown_mm: float) -> Iterator[Points]:
    """Points of pieces over earlier lines of other tools, where no own line lies higher; many at once."""
    levels, pitch_mm = _levels(lines), _RUB_PITCH_MM if grown_mm else PITCH_MM
    tree = lru_cache(_TREES)(_Level.tree)  # a file goes up: those far below are never needed again
    for block in blocks:
        met = [*_meetings(block, levels, tree, within_mm, grown_mm)]
        if met:
            yield _points(block, lines, within_mm, pitch_mm, *(np.concatenate(c) for c in zip(*met, strict=True)))


def _points(
    pieces: MovePieces, lines: PrintedLines, within_mm: float, pitch_mm: float, piece: Whole, line: Whole, low: Real,
    high: Real,
) -> Points:  # fmt: skip
    """Points of pieces at which the highest of the lines met is of another tool."""
    foreign = lines.tool[line] != pieces.tool[piece]
    mine = np.unique(piece[foreign])  # pieces that need points
    needed = np.isin(piece, mine)
    piece, line, low, high, foreign = piece[needed], line[needed], low[needed], high[needed], foreign[needed]
    start, way = pieces.start_mm[mine], (pieces.end_mm - pieces.start_mm)[mine]
    length = np.hypot(*way[:, :2].T)
    count = np.maximum(np.ceil(length / pitch_mm), 1).astype(np.int64)
    first = np.cumsum(count) - count
    place = np.searchsorted(mine, piece)
    # the points whose middle lies in [low, high]
    begin, end = (np.ceil(np.clip(s, 0, 1) * count[place] - 0.5).astype(np.int64) for s in (low, high))
    key = np.round(lines.top_mm[line] / _LEVEL_MM).astype(np.int64) * 2 + foreign
    order = np.argsort(key, kind="stable")  # the highest is written last, of equals that of another tool
    span = (end - begin)[order]
    point = np.repeat((first[place] + begin)[order] - (np.cumsum(span) - span), span) + np.arange(span.sum())
    top = np.full(count.sum(), -2, np.int64)
    top[point] = np.repeat(key[order], span)
    which, step = parts_of(count)
    share = (step + 0.5) / count[which]
    at = start[which] + share[:, None] * way[which]
    gap = at[:, 2] - (top // 2) * _LEVEL_MM
    here = (top % 2 == 1) & (gap <= within_mm + _ROUNDING_MM)
    which = which[here]
    return Points(pieces.row[mine][which], at[here], gap[here], (length / count)[which])


@dataclass(frozen=True, eq=False)
class _Level:
    """Lines of one height and tool, cut to pieces; ``row`` of each in the lines of the file."""

    row: Whole
    lines: PrintedLines

    @classmethod
    def of(cls, lines: PrintedLines, rows: Whole) -> "_Level":
        """Some lines, of one height and tool."""
        whole = lines.of(rows)
        which, low, high = _shares(_counts(whole.end_mm - whole.start_mm))
        cut, way = whole.of(which), (whole.end_mm - whole.start_mm)[which]
        start = cut.start_mm
        return cls(rows[which], replace(cut, start_mm=start + low[:, None] * way, end_mm=start + high[:, None] * way))

    def tree(self) -> shapely.STRtree:
        """All pieces by their places."""
        return shapely.STRtree(shapely.linestrings(np.stack([self.lines.start_mm, self.lines.end_mm], axis=1)))

    def met(self, tree: _Trees, pieces: MovePieces, by: Whole, within_mm: float, grown_mm: float) -> _Met:
        """Of some pieces those that meet a line that is printed before, that line, and from which share to which."""
        lowest = np.minimum(pieces.start_mm[by, 2], pieces.end_mm[by, 2])
        lowest -= self.lines.top_mm[0] + within_mm + _ROUNDING_MM
        by = by[(lowest <= 0) & (pieces.number[by] > self.lines.number[0])]
        if not len(by):
            return by, by, by.astype(float), by.astype(float)
        margin = self.lines.width_mm.max() + grown_mm
        ends = np.stack([pieces.start_mm[by, :2], pieces.end_mm[by, :2]])
        near, hit = tree(self).query(shapely.box(*(ends.min(0) - margin).T, *(ends.max(0) + margin).T))
        piece = by[near]
        before = self.lines.number[hit] < pieces.number[piece]
        piece, hit = piece[before], hit[before]
        low, high = _clipped(pieces, self.lines, piece, hit, grown_mm)
        meets = high > low
        return piece[meets], self.row[hit[meets]], low[meets], high[meets]


def _levels(lines: PrintedLines) -> dict[int, list[_Level]]:
    """Lines by tool and height."""
    levels = {}
    for tool in np.unique(lines.tool).tolist():
        mine = np.flatnonzero(lines.tool == tool)
        mine = mine[np.argsort(lines.top_mm[mine], kind="stable")]
        first = np.flatnonzero(np.diff(lines.top_mm[mine])) + 1
        levels[tool] = [_Level.of(lines, rows) for rows in np.split(mine, first)]
    return levels


def _meetings(
    pieces: MovePieces, levels: dict[int, list[_Level]], tree: _Trees, within_mm: float, grown_mm: float
) -> Iterator[_Met]:
    """Pairs of pieces and lines of other tools that they meet, and of own lines where these may lie higher."""
    for tool in np.unique(pieces.tool).tolist():
        by = np.flatnonzero(pieces.tool == tool)
        foreign = [level for other, those in levels.items() if other != tool for level in those]
        met = [level.met(tree, pieces, by, within_mm, grown_mm) for level in foreign]
        yield from met
        over = np.unique(np.concatenate([piece for piece, _, _, _ in met])) if met else by[:0]
        if not grown_mm:
            yield from (level.met(tree, pieces, over, within_mm, grown_mm) for level in levels.get(tool, []))


def _clipped(pieces: MovePieces, lines: PrintedLines, piece: Whole, line: Whole, grown_mm: float) -> tuple[Real, Real]:
    """Shares of pieces, from and to, that lie within lines."""
    way = lines.end_mm[line] - lines.start_mm[line]
    length, half = np.hypot(*way.T), lines.width_mm[line] / 2 + grown_mm
    along = way / length[:, None]
    aside = along[:, ::-1] * [-1, 1]
    start = pieces.start_mm[piece, :2] - lines.start_mm[line]
    step = (pieces.end_mm - pieces.start_mm)[piece, :2]
    low, high = np.zeros(len(piece)), np.ones(len(piece))
    for axis, least, most in ((along, -half, length + half), (aside, -half, half)):
        at, speed = (start * axis).sum(1), (step * axis).sum(1)
        still = np.abs(speed) < 1e-12
        with np.errstate(divide="ignore", invalid="ignore"):
            one, other = (least - at) / speed, (most - at) / speed
        outside = still & ((at < least) | (at > most))
        low = np.maximum(low, np.where(still, np.where(outside, 2.0, 0.0), np.minimum(one, other)))
        high = np.minimum(high, np.where(still, 1.0, np.maximum(one, other)))
    return low, high


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
        up = [f"G1 {word('E', -length)} {word('F', speed)}"] if draws else []
        up.append(f"G1 {word('Z', high)} {word('F', z_feed)}")
        if not self._has_feed(numbers[0]):
            up.append(f"G1 {word('F', feed[first])}")
        down = [f"G1 {word('Z', self.motion.rows[last, 5])} {word('F', z_feed)}"]
        down += [f"G1 {word('E', length)} {word('F', speed)}"] if draws else []
        if last + 1 < len(self.number) and not self._has_feed(int(self.number[last + 1])):
            down.append(f"G1 {word('F', feed[last])}")
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
