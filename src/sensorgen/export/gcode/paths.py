"""The lines that a file prints, in columns: what every model of the printed piece reads."""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sensorgen.design.printer import Printer
from sensorgen.export.gcode.motion import follow
from sensorgen.export.gcode.moves import NO_TOOL, Motion
from sensorgen.export.gcode.reading import Source

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Numbering = Literal["printer", "slicer"]

# What the slicers' ";TYPE:" comments call lines that are not part of a body, in lower case.
NOT_MODEL = frozenset(
    {
        "skirt", "brim", "skirt/brim", "prime-tower", "prime tower", "prime pillar", "wipe tower", "custom",
        "support", "support-interface", "support material", "support material interface",
    }
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Paths:
    """One row per move that extrudes; arcs stand as chords, retractions and their return count for nothing.

    Attributes
    ----------
    start_mm, end_mm : (n, 3) float64 array
        Where the line begins and ends [mm].
    filament_mm : (n,) float64 array
        Filament that it takes [mm].
    tool : (n,) int64 array
        The printer's own number of its tool [-].
    kind : (n,) int64 array
        Index into ``kinds`` [-].
    height_mm, width_mm : (n,) float64 array
        Height and width that the file declares [mm]; nan where it does not.
    layer : (n,) int64 array
        Layer from 1 at the bed, as the comments count; by heights where no comment does [-].
    number : (n,) int64 array
        Line of the file, from 1 [-].
    kinds : tuple of str
        What the file's comments call its lines, in lower case; the first is "".
    """

    start_mm: Floats
    end_mm: Floats
    filament_mm: Floats
    tool: Integers
    kind: Integers
    height_mm: Floats
    width_mm: Floats
    layer: Integers
    number: Integers
    kinds: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.number)

    def length_mm(self) -> Floats:
        """Length of each line [mm]; 0 where filament is pushed on the spot."""
        way: Floats = np.sqrt(((self.end_mm - self.start_mm) ** 2).sum(axis=1))
        return way

    def volume_mm3(self, filament_diameter_mm: float) -> Floats:
        """Volume of each line [mm3].

        Parameters
        ----------
        filament_diameter_mm : float
            Diameter of the filament [mm].
        """
        return self.filament_mm * (math.pi / 4 * filament_diameter_mm**2)

    def chosen(self, rows: NDArray[np.bool_]) -> "Paths":
        """The rows of a mask, (n,)."""
        columns = ("start_mm", "end_mm", "filament_mm", "tool", "kind", "height_mm", "width_mm", "layer", "number")
        return replace(self, **{name: getattr(self, name)[rows] for name in columns})

    def model(self) -> "Paths":
        """The lines of the bodies: neither skirt, tower nor support, and nothing pushed on the spot."""
        bodies = np.array([name not in NOT_MODEL for name in self.kinds])
        return self.chosen(bodies[self.kind] & (self.length_mm() > 0))


def read(source: Source, machine: Printer, numbering: Numbering = "printer") -> Paths:
    """Read the lines that a file prints.

    Parameters
    ----------
    source : Path, bytes or iterable of str
        The file, its content, or its lines.
    machine : Printer
        Whose G-code it is.
    numbering : "printer" or "slicer"
        Whether T counts as the printer does, or from 0 as a slicer's own file does.

    Raises
    ------
    BadInput
        The file is not there, or no G-code.

    Examples
    --------
    >>> from sensorgen.design.printer import load_printer
    >>> paths = read(["M83", "T3", "G1 Z0.1", ";WIDTH:0.44", "G1 X10 E0.2"], load_printer("diabase-h5"))
    >>> paths.tool.tolist(), paths.length_mm().tolist(), paths.width_mm.tolist(), paths.layer.tolist()
    ([3], [10.0], [0.44], [1])
    """
    return paths_of(follow(source, machine.control.prime_macro), machine, numbering)


def paths_of(motion: Motion, machine: Printer, numbering: Numbering = "printer") -> Paths:
    """The lines that a followed file prints; see :func:`read`."""
    rows, start, end, share = _straight(motion, np.flatnonzero(motion.extruded_mm > 0))
    count, tools = len(motion.rows), tools_of(motion, machine, numbering)[rows]
    if motion.layer.rows:
        layer = motion.layer.column(count, 0)[rows].astype(np.int64)
    else:
        heights = np.round(motion.end_mm[rows, 2], 4)
        layer = np.unique(heights, return_inverse=True)[1].astype(np.int64).ravel() + 1
    return Paths(
        start, end, motion.extruded_mm[rows] * share, tools, motion.kind.column(count, 0)[rows].astype(np.int64),
        motion.height_mm.column(count)[rows], motion.width_mm.column(count)[rows], layer, motion.number[rows],
        motion.kinds,
    )  # fmt: skip


def tools_of(motion: Motion, machine: Printer, numbering: Numbering = "printer") -> Integers:
    """The printer's own number of the tool in each move; one that the printer lacks stays negative."""
    own = np.array([*machine.tool_numbers, NO_TOOL])
    tools = motion.tools.column(len(motion.rows), NO_TOOL).astype(np.int64)
    if numbering == "slicer":
        return own[np.where(tools < len(own) - 1, np.maximum(tools, 0), len(own) - 1)]
    return np.where(tools == NO_TOOL, own[0], tools)  # a file without any tool means the printer's first


def _straight(motion: Motion, rows: Integers) -> tuple[Integers, Floats, Floats, Floats]:
    """Some moves as straight lines: the move of each, its start and end [mm], and its share of the move's filament."""
    bent = np.isin(motion.arcs.row, rows)
    which, start, end = motion.arcs.chosen(bent).chords()
    row = motion.arcs.row[bent]
    straight = rows[~np.isin(rows, row)]
    every = np.concatenate([straight, row[which]])
    order = np.argsort(every, kind="stable")
    starts, ends = np.concatenate([motion.start_mm[straight], start]), np.concatenate([motion.end_mm[straight], end])
    share = np.concatenate([np.ones(len(straight)), 1.0 / np.bincount(which, minlength=1)[which]])
    return every[order], starts[order], ends[order], share[order]
