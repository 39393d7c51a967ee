"""Actions of a printer by a file, as plain data: moves in columns, arcs among them, everything else as events.

Arcs lie in the plane of the bed: their middles, lengths, what they reach, and chords for who needs lines.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sensorgen.core.arrays import ColumnRecord, Mask, Real, Whole, parts_of
from sensorgen.design.printer import MaxSpeed
from sensorgen.export.gcode.words import Command

SAG_MM = 0.005  # how far a chord may be from its arc: a tenth of what the printer can place
MOST_CHORDS = 720
_FULL = 1e-9  # a turn below this is a full circle [rad]


@dataclass(frozen=True, eq=False)
class Arcs(ColumnRecord):
    """Moves that are arcs.

    Attributes
    ----------
    row : (n,) int64 array
        The move of each.
    start_mm, end_mm : (n, 3) float64 array
        Where each begins and ends [mm]; Z rises evenly.
    centre_mm : (n, 2) float64 array
        Middle of its circle [mm].
    turn : (n,) float64 array
        Angle that it turns, to the left positive [rad]; never 0.

    Examples
    --------
    >>> start, end = np.array([[1.0, 0, 0]]), np.array([[-1.0, 0, 0]])
    >>> half = Arcs.between(np.array([4]), start, end, np.zeros((1, 2)), np.array([False]))
    >>> [m.round(3).tolist() for m in (half.across_mm(), *half.box_mm())]
    [[3.142], [[-1.0, 0.0, 0.0]], [[1.0, 1.0, 0.0]]]
    """

    row: Whole
    start_mm: Real
    end_mm: Real
    centre_mm: Real
    turn: Real

    @classmethod
    def between(cls, row: Whole, start_mm: Real, end_mm: Real, centre_mm: Real, clockwise: Mask) -> "Arcs":
        """Arcs between two places; the same place twice means a full circle. Clockwise is as seen from above: G2."""
        first, last = (_angle(place[:, :2] - centre_mm) for place in (start_mm, end_mm))
        left = (last - first) % math.tau
        right = (first - last) % math.tau
        turn = np.where(clockwise, right, left)
        turn = np.where(turn < _FULL, math.tau, turn)
        return cls(row, start_mm, end_mm, centre_mm, np.where(clockwise, -turn, turn))

    def __len__(self) -> int:
        """Number of arcs [-]."""
        return len(self.row)

    def radius_mm(self) -> Real:
        """Radius at the start of each [mm]."""
        off = self.start_mm[:, :2] - self.centre_mm
        return np.asarray(np.hypot(off[:, 0], off[:, 1]))

    def across_mm(self) -> Real:
        """Length of each in plan [mm]."""
        return np.asarray(self.radius_mm() * np.abs(self.turn))

    def box_mm(self) -> tuple[Real, Real]:
        """Lowest and highest place of each on every axis, (n, 3) [mm]."""
        low, high = np.minimum(self.start_mm, self.end_mm), np.maximum(self.start_mm, self.end_mm)
        first = _angle(self.start_mm[:, :2] - self.centre_mm)
        for quarter in range(4):
            way = (np.sign(self.turn) * (quarter * math.tau / 4 - first)) % math.tau
            axis, side = quarter % 2, 1 if quarter < 2 else -1
            edge = self.centre_mm[:, axis] + side * self.radius_mm()
            bound, worse = (high, np.maximum) if side > 0 else (low, np.minimum)
            bound[:, axis] = np.where(way < np.abs(self.turn), worse(bound[:, axis], edge), bound[:, axis])
        return low, high

    def chords(self) -> tuple[Whole, Real, Real]:
        """Chords of all arcs in order: which arc each belongs to, and where it starts and ends, (m, 3) [mm]."""
        sag = np.minimum(SAG_MM / (2 * np.maximum(self.radius_mm(), SAG_MM)), 0.5)
        angle = 4 * np.arcsin(np.sqrt(sag))  # acos(1 - sag / radius) would be 0 for a large one
        count = np.asarray(np.clip(np.ceil(np.abs(self.turn) / angle), 1, MOST_CHORDS), np.int64)
        which, step = parts_of(count)
        ends = []
        for share in (step / count[which], (step + 1) / count[which]):
            at = _angle(self.start_mm[:, :2] - self.centre_mm)[which] + self.turn[which] * share
            radius, (x, y) = self.radius_mm()[which], self.centre_mm[which].T
            bottom, top = self.start_mm[which, 2], self.end_mm[which, 2]
            z = bottom + (top - bottom) * share
            ends.append(np.column_stack([x + radius * np.cos(at), y + radius * np.sin(at), z]))
        ends[0][step == 0], ends[1][step == count[which] - 1] = self.start_mm, self.end_mm
        return which, ends[0], ends[1]


def _angle(off: Real) -> Real:
    return np.asarray(np.arctan2(off[:, 1], off[:, 0]))


def centres_of_radius(start: Real, end: Real, radius: Real, clockwise: Mask) -> Real:
    """Middles of arcs of given radii, (n, 2) [mm]; nan where none leads from start to end.

    Parameters
    ----------
    start, end : (n, 2) array
        Their ends [mm].
    radius : (n,) array
        Their radii [mm]; negative for the longer way round.
    clockwise : (n,) array of bool
        As seen from above: G2.
    """
    step = end - start
    chord = np.hypot(step[:, 0], step[:, 1])
    there = (chord > 0) & (chord <= 2 * np.abs(radius) * (1 + 1e-6))
    off = np.sqrt(np.maximum(0.0, radius**2 - chord**2 / 4)) / np.where(there, chord, np.nan)
    side = np.where((radius > 0) != clockwise, off, -off)[:, None]
    return np.asarray((start + end) / 2 + side * np.column_stack([-step[:, 1], step[:, 0]]))


NO_TOOL = -1


@dataclass(frozen=True, slots=True)
class Event:
    """A command that is no move: the moves before it, its line, and what it says."""

    row: int
    number: int
    command: Command


@dataclass(frozen=True, slots=True)
class FileFault:
    """Part of a file that could not be read or followed, with its place."""

    number: int
    what: str
    severe: bool = True


@dataclass(frozen=True, slots=True)
class ToolChange:
    """A tool is taken, by ``T`` or by a macro: the moves before it, its line, the tool, and how."""

    row: int
    number: int
    tool: int
    macro: bool


@dataclass(frozen=True, slots=True)
class ModalValues:
    """Something that holds from one place in the file to the next: its values, and the moves before each."""

    rows: list[int]
    values: list[float]

    def column(self, count: int, before: float = math.nan) -> Real:
        """Value that applies to each of ``count`` moves."""
        edges = np.array([0, *self.rows, count], dtype=np.int64)
        spans: Whole = edges[1:] - edges[:-1]
        return np.repeat(np.array([before, *self.values]), spans)


@dataclass(frozen=True, eq=False)
class Motion:
    """A file as moves in columns, and everything else as events between them.

    Attributes
    ----------
    rows : (n, 10) float64 array
        Start and end [mm], filament that is extruded and filament that is moved [mm], feed [mm/min], and
        the line. Filament that only makes good for a retraction is moved, not extruded.
    arcs : Arcs
        Moves that do not go straight.
    events : sequence of Event
        All other commands.
    odd : sequence of Event
        Moves that have words of their own, as those of further axes; they are among the moves too.
    changes : sequence of ToolChange
        Tools in the order in which they are taken, also the same again; ``NO_TOOL`` where one is put down.
    tools : ModalValues
        The tool in hand, ``NO_TOOL`` before the first.
    kinds : tuple of str
        Kinds of line that comments name, in lower case; the first is "".
    kind, width_mm, height_mm, layer : ModalValues
        Index into ``kinds``, and what comments say of the lines: width and height [mm], and layer from 1.
    absolute_e : ModalValues
        1 where E is absolute, 0 where it is relative.
    faults : sequence of FileFault
        What could not be read or followed.
    lines : int
        How many lines the file has.
    maker : str
        Slicer that names itself at the top, where that tells something; else "".
    z_stated : (n,) bool array
        Z has been stated since the last change of tool, by the move itself or before it.
    """

    rows: Real
    arcs: Arcs
    events: Sequence[Event]
    odd: Sequence[Event]
    changes: Sequence[ToolChange]
    tools: ModalValues
    kinds: tuple[str, ...]
    kind: ModalValues
    width_mm: ModalValues
    height_mm: ModalValues
    layer: ModalValues
    absolute_e: ModalValues
    faults: Sequence[FileFault]
    lines: int
    maker: str
    z_stated: Mask

    @property
    def start_mm(self) -> Real:
        """Where each move starts, (n, 3) [mm]."""
        return self.rows[:, 0:3]

    @property
    def end_mm(self) -> Real:
        """Where each move ends, (n, 3) [mm]."""
        return self.rows[:, 3:6]

    @property
    def extruded_mm(self) -> Real:
        """Filament that each move extrudes, without what makes good for a retraction [mm]."""
        return self.rows[:, 6]

    @property
    def filament_mm(self) -> Real:
        """Filament that each move pushes, or draws back if negative [mm]."""
        return self.rows[:, 7]

    @property
    def feed_mm_min(self) -> Real:
        """Feed that the file asks for [mm/min]."""
        return self.rows[:, 8]

    @property
    def number(self) -> Whole:
        """Line of each move, from 1 [-]."""
        return self.rows[:, 9].astype(np.int64)

    @cached_property
    def across_mm(self) -> Real:
        """Way of the nozzle in plan, in each move [mm]."""
        step = self.rows[:, 3:5] - self.rows[:, 0:2]
        way: Real = np.hypot(step[:, 0], step[:, 1])
        way[self.arcs.row] = self.arcs.across_mm()
        return way

    @cached_property
    def length_mm(self) -> Real:
        """Way of the nozzle in each move [mm]."""
        way: Real = np.hypot(self.across_mm, self.rows[:, 5] - self.rows[:, 2])
        return way

    @cached_property
    def prints(self) -> Mask:
        """Moves that print a line; filament that is pushed with Z alone makes good for a retraction."""
        return np.asarray((self.extruded_mm > 0) & (self.across_mm > 0))

    def box_mm(self) -> tuple[Real, Real]:
        """Lowest and highest place of each move, (n, 3) twice [mm]; a straight one counts by its end."""
        if not len(self.arcs):
            return self.end_mm, self.end_mm
        low, high = self.end_mm.copy(), self.end_mm.copy()
        low[self.arcs.row], high[self.arcs.row] = self.arcs.box_mm()
        return low, high


def seconds(motion: Motion, fastest: MaxSpeed) -> Real:
    """Duration of each move, (n,) [s].

    The feed is that of the nozzle, or of the filament where the nozzle rests; an axis that could not follow
    slows the whole move, as the firmware does. Accelerations are the printer's own and unknown here, so a
    print takes longer than the sum.

    Parameters
    ----------
    motion : Motion
        The moves.
    fastest : MaxSpeed
        The axes' limits [mm/s].
    """
    filament = np.abs(motion.filament_mm)
    across, up = motion.across_mm, np.abs(motion.rows[:, 5] - motion.rows[:, 2])
    way = np.hypot(across, up)
    longest: Real = np.where(way > 0, way, filament) / np.maximum(motion.feed_mm_min / 60, 1e-3)
    for length, limit in ((across, fastest.xy), (up, fastest.z), (filament, fastest.extruder)):
        np.maximum(longest, length / limit, out=longest)
    return longest
