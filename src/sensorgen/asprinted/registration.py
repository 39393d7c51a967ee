"""Where a file of G-code prints a design: by its tools and its size, wherever it stands on the bed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensorgen.core.arrays import Real, Whole
from sensorgen.core.errors import BadInput
from sensorgen.design.design import Design
from sensorgen.export.gcode.motion import Paths, follow, paths_of
from sensorgen.export.gcode.moves import Motion
from sensorgen.export.gcode.reading import Source
from sensorgen.scene.scene import Point

APART_MM = 1.5  # pieces on a plate are further apart; lines of one piece are nearer
_CELL_MM, _FAR_MM = APART_MM / 2, 1000.0
WITHIN_MM = 0.8  # by which a piece may be larger or smaller than the design: walls and seams


@dataclass(frozen=True, eq=False)
class PlacedPiece:
    """A piece of a design in a file, whose lines are turned to the design's own directions.

    Attributes
    ----------
    paths : Paths
        All lines of the file, with the printer's own tool numbers.
    centre_mm : (float, float)
        Middle of the piece among these lines [mm].
    bed_mm : (float, float)
        The same on the bed, as the file has it [mm].
    copies : int
        Pieces of the design's size in the file.
    """

    paths: Paths
    centre_mm: Point
    bed_mm: Point
    copies: int


def placed(design: Design, source: Source) -> PlacedPiece:
    """The first piece of a design in a file of G-code.

    Parameters
    ----------
    design : Design
        That was sliced, by whatever slicer.
    source : Path, bytes or iterable of str
        The file, alone or with others on a plate, as it is or turned by 90 degrees.

    Raises
    ------
    BadInput
        No G-code, or none of this design; see :func:`pieces`.
    """
    return pieces(design, follow(source, design.machine.control.prime_macro))[0]


def pieces(design: Design, motion: Motion) -> list[PlacedPiece]:
    """All pieces of a design in a file of G-code, straight and turned by 90 degrees.

    Parameters
    ----------
    design : Design
        That was sliced, by whatever slicer.
    motion : Motion
        The file.

    Raises
    ------
    BadInput
        Other tools than the design's, or no piece of its size; with the sizes that there are.
    """
    paths = _of_tools(design, motion)
    model = paths.model()
    mine = np.isin(model.tool, _tools(design))
    low, high = (of(model.start_mm[mine, :2], model.end_mm[mine, :2]) for of in (np.minimum, np.maximum))
    group = connected(model.start_mm[mine, :2], model.end_mm[mine, :2])
    boxes = [np.array([low[group == k].min(0), high[group == k].max(0)]) for k in np.unique(group).tolist()]
    size = np.array(design.printed.size_mm[:2]) - design.machine.line_mm()  # lines run half a line inside
    off = np.array([[abs(box[1] - box[0] - wanted).max() for wanted in (size, size[::-1])] for box in boxes])
    fits = (off < WITHIN_MM).any(1) if len(boxes) else np.zeros(0, bool)
    if not fits.any():
        raise _other_sizes(design, boxes, off.min(initial=np.inf))
    straight, count, found = off[:, 0] < WITHIN_MM, int(fits.sum()), []  # a square one counts as straight
    turned = paths if straight[fits].all() else _turned(paths)
    for k in np.flatnonzero(fits).tolist():
        x, y = boxes[k].mean(0).tolist()
        found.append(
            PlacedPiece(paths, (x, y), (x, y), count) if straight[k] else PlacedPiece(turned, (y, -x), (x, y), count)
        )
    return found


def _other_sizes(design: Design, boxes: Sequence[Real], off_mm: float) -> BadInput:
    """Error of a file whose pieces (2, 2) are none of a design's size."""
    line = design.machine.line_mm()
    there = "; ".join(
        f"{w + line:.4g} x {h + line:.4g} mm at x {x:.4g}, y {y:.4g} on the bed"
        for (w, h), (x, y) in sorted({(tuple(b[1] - b[0]), tuple(b.mean(0))) for b in boxes})[:3]
    )
    length, width, _ = design.printed.size_mm
    return BadInput(
        f"no piece of {length:g} x {width:g} mm, as {design.name}, in this G-code; it prints {there}, off by "
        f"{off_mm:.3g} mm at least: was it sliced from this design, straight or turned by 90 degrees?"
    )


def _tools(design: Design) -> list[int]:
    return sorted({design.tool(body.material) for body in design.printed.bodies})


def _of_tools(design: Design, motion: Motion) -> Paths:
    """The file's lines, its tools counted as the printer does, or from 0 as a slicer's own file does."""
    wanted = set(_tools(design))
    used: list[set[int]] = []
    for numbering in ("printer", "slicer"):
        paths = paths_of(motion, design.machine, numbering)
        used.append(set(paths.model().tool.tolist()))
        if wanted <= used[-1]:
            return paths
    raise BadInput(
        f"tools {sorted(used[0])} print in this G-code; expected {sorted(wanted)}, those of {design.name}: --tool "
        "MATERIAL=NUMBER says which tool has a material"
    )


def connected(start_mm: Real, end_mm: Real) -> Whole:
    """Number of the connected group of each line in plan: lines of a group have no gap of ``APART_MM`` between them."""
    from scipy import ndimage

    start_mm, end_mm = (np.clip(place, -_FAR_MM, _FAR_MM) for place in (start_mm, end_mm))
    way = end_mm - start_mm
    count = np.maximum(np.ceil(np.abs(way).max(1) / _CELL_MM), 1).astype(np.int64) + 1
    which = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)) / (count[which] - 1)
    cell = np.floor((start_mm[which] + share[:, None] * way[which]) / _CELL_MM).astype(np.int64)
    cell -= cell.min(0, initial=0)
    filled = np.zeros(cell.max(0, initial=0) + 1, bool)
    filled[cell[:, 0], cell[:, 1]] = True
    label, _ = ndimage.label(filled, np.ones((3, 3)))
    first = cell[np.cumsum(count) - count]
    return np.asarray(label[first[:, 0], first[:, 1]])


def _turned(paths: Paths) -> Paths:
    """The lines turned by -90 degrees about the origin: x becomes -y."""
    turn: Sequence[Real] = [
        np.column_stack([p[:, 1], -p[:, 0], p[:, 2]]) for p in (paths.start_mm, paths.end_mm)
    ]  # fmt: skip
    return replace(paths, start_mm=turn[0], end_mm=turn[1])
