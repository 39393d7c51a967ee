"""The scene as a slicer sees it: cut once per layer, at mid-height."""

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.design.printer import Quality
from sensorgen.scene.scene import Body, Prism, Scene

TOUCH_MM = 1e-9  # below this a distance is rounding


Indices = NDArray[np.intp]


class Rectangle(NamedTuple):
    """What a layer shows of one prism [mm]."""

    x0: float
    x1: float
    y0: float
    y1: float

    def narrow_mm(self) -> float:
        """Length of the shorter side [mm]."""
        return min(self.x1 - self.x0, self.y1 - self.y0)


class Run(NamedTuple):
    """A straight stretch through a slice, along one axis [mm]."""

    axis: str
    start: float
    end: float
    across: float  # a place on the other axis where it shows

    @property
    def width(self) -> float:
        """Length of the stretch [mm]."""
        return round(self.end - self.start, 9)


@dataclass(frozen=True)
class Layers:
    """Boundaries of the printed layers, from the bed up [mm]."""

    boundaries_mm: tuple[float, ...]

    def __len__(self) -> int:
        """Number of layers [-]."""
        return len(self.boundaries_mm) - 1

    @cached_property
    def mids_mm(self) -> tuple[float, ...]:
        """Heights at which a slicer samples [mm]."""
        return tuple(round((a + b) / 2, 12) for a, b in pairwise(self.boundaries_mm))

    def printed_mm(self, z_mm: float) -> float:
        """Height at which a face drawn at ``z_mm`` comes out: the boundary after the last sample below it [mm]."""
        return self.boundaries_mm[min(bisect_left(self.mids_mm, z_mm - TOUCH_MM), len(self))]

    def off_grid_mm(self, z_mm: float) -> float:
        """Distance of a height from the nearest boundary [mm]."""
        return min(abs(z_mm - b) for b in self.boundaries_mm)


class Slice:
    """Filled places at one height, on the grid of their own coordinates."""

    def __init__(self, rectangles: frozenset[Rectangle], *others: frozenset[Rectangle]) -> None:
        """Fill the grid of all given rectangles' sides with the first set of them."""
        every = rectangles.union(*others)
        self.lines = (np.unique([x for r in every for x in r[:2]]), np.unique([y for r in every for y in r[2:]]))
        lines = self.lines
        self.filled = np.zeros((len(lines[0]) - 1, len(lines[1]) - 1), bool)
        for r in rectangles:
            i0, i1 = np.searchsorted(lines[0], (r.x0, r.x1))
            j0, j1 = np.searchsorted(lines[1], (r.y0, r.y1))
            self.filled[i0:i1, j0:j1] = True

    def runs(self, mask: NDArray[np.bool_]) -> set[Run]:
        """Unbroken stretches of a mask over the grid, along x and along y; the same one counts once."""
        found: set[Run] = set()
        for axis, name in enumerate("xy"):
            starts, ends, rows = stretches(mask if axis == 0 else mask.T)
            along, across = self.lines[axis], self.lines[1 - axis]
            _, first = np.unique(starts * len(along) + ends, return_index=True)
            middle = (across[rows] + across[rows + 1]) / 2
            columns = (along[starts], along[ends], middle)
            found.update(Run(name, *place) for place in zip(*(c[first].tolist() for c in columns), strict=True))
        return found

    def enclosed(self) -> set[Run]:
        """Empty stretches between two filled places in one line."""
        return {run for run in self.runs(~self.filled) if not self._open(run)}

    def _open(self, run: Run) -> bool:
        line = self.lines["xy".index(run.axis)]
        return bool(run.start == line[0] or run.end == line[-1])


def stretches(mask: NDArray[np.bool_]) -> tuple[Indices, Indices, Indices]:
    """Unbroken runs of True along the first axis: first index, behind-last index, index on the second axis."""
    edges = np.diff(np.pad(mask, ((1, 1), (0, 0))).astype(np.int8), axis=0).T
    rows, starts = np.nonzero(edges == 1)
    _, ends = np.nonzero(edges == -1)
    return starts, ends, rows


def shown(prism: Prism, z_mm: float) -> Iterator[Rectangle]:
    """What a prism shows at a height."""
    for outline in prism.cut("z", z_mm):
        xs, ys = zip(*outline, strict=True)
        yield Rectangle(min(xs), max(xs), min(ys), max(ys))


def slanted(prism: Prism) -> bool:
    """Whether its outline in plan is more than a rectangle."""
    return prism.axis == "z" and not prism.is_box()


class Slices:
    """Every body in every layer: cut once, asked by all rules."""

    def __init__(self, scene: Scene, quality: Quality) -> None:
        """Cut ``scene``, as it lies on the bed, into the layers of ``quality``."""
        self.scene = scene
        self.layers = Layers(tuple(quality.boundaries_mm(scene.size_mm[2])))
        self._shown = {body.name: [_rectangles(body, mid) for mid in self.layers.mids_mm] for body in scene.bodies}

    def body(self, body: Body, layer: int) -> frozenset[Rectangle]:
        """What a body shows in a layer (counted from 0), slanted outlines in plan left out."""
        return self._shown[body.name][layer]

    def printed(self, body: Body, layer: int, least_mm: float) -> frozenset[Rectangle]:
        """What of a body is wider than ``least_mm`` in a layer (counted from 0)."""
        return frozenset(r for r in self._shown[body.name][layer] if r.narrow_mm() > least_mm + TOUCH_MM)

    def printed_layers(self, body: Body, least_mm: float) -> list[int]:
        """Layers (counted from 0) in which some stretch of a body is wider than ``least_mm``."""
        return [k for k in range(len(self.layers)) if self.printed(body, k, least_mm)]


def _rectangles(body: Body, z_mm: float) -> frozenset[Rectangle]:
    return frozenset(r for prism in body.prisms if not slanted(prism) for r in shown(prism, z_mm))
