"""Lines of a solid plate without a slicer: walls around, infill to and fro within them, turned from layer to layer."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.units import M_PER_MM
from sensorgen.solvers.network import StraightLines

WALLS = 2
OVERLAP = 0.25  # of a line's width, by which infill reaches into the walls (PrusaSlicer's own)

Path = list[NDArray[np.float64]]


def plate(
    length_mm: float, width_mm: float, line_mm: float, layer_mm: float, degrees: Sequence[float], walls: int = WALLS
) -> StraightLines:
    """All lines of a plate around the origin.

    Parameters
    ----------
    length_mm, width_mm : float
        Along x and y [mm].
    line_mm, layer_mm : float
        Width of a line and height of a layer [mm].
    degrees : sequence of float
        Direction of each layer's infill, from x, from below [deg].
    walls : int
        How many lines run around it [-].
    """
    pieces = []
    for layer, angle in enumerate(degrees):
        for path in _paths(np.array([length_mm, width_mm]), line_mm, angle, walls):
            steps = ((a, b, k > 0) for k, (a, b) in enumerate(pairwise(path)))
            pieces += [(*a, *b, layer, joined) for a, b, joined in steps]
    ends = np.array(pieces)
    full = np.full(len(ends), M_PER_MM)
    return StraightLines(
        ends[:, :2] * M_PER_MM, ends[:, 2:4] * M_PER_MM, full * line_mm, full * layer_mm,
        ends[:, 4].astype(np.int64), ends[:, 5].astype(bool),
    )  # fmt: skip


def _paths(size: NDArray[np.float64], line: float, degrees: float, walls: int) -> Iterator[Path]:
    """Walls, and lines a width apart within them, joined along a side where two ends lie on the same one."""
    for k in range(walls):
        x, y = size / 2 - (k + 0.5) * line
        yield [np.array(p) for p in ((x, y), (-x, y), (-x, -y), (x, -y), (x, y))]
    half = size / 2 - ((walls + 0.5 - OVERLAP) * line if walls else line / 2)
    angle = radians(degrees)
    way, across = np.array([cos(angle), sin(angle)]), np.array([-sin(angle), cos(angle)])
    reach = float(np.abs(across) @ half)
    count = int(2 * reach / line + 1 + 1e-9)
    path: Path = []
    for k in range(count):
        at = across * ((k - (count - 1) / 2) * line)
        with np.errstate(divide="ignore"):  # along a side
            ends = np.sort([(-half - at) / way, (half - at) / way], axis=0)[:, np.abs(way) > 1e-12]
        low, high = ends[0].max(), ends[1].min()
        if high - low <= 1e-6:  # it only touches a corner
            continue
        first, last = (at + low * way, at + high * way) if k % 2 == 0 else (at + high * way, at + low * way)
        if path and not (np.isclose(np.abs(first), half, atol=1e-9) & np.isclose(path[-1], first, atol=1e-9)).any():
            yield path
            path = []
        path += [first, last]
    if path:
        yield path
