"""Actions of a printer by a file, as plain data: moves in columns, and everything else as events between them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.design.printer import MaxSpeed
from sensorgen.export.gcode.arcs import Arcs
from sensorgen.export.gcode.words import Command

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
