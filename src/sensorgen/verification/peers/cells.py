"""Geometry of a cell for other programs: triangles of a cross-section, or a grid of boxes, between mirrors."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sensorgen.core.arrays import Real, Whole
from sensorgen.scene.repetition import Slice, cell
from sensorgen.scene.scene import Scene
from sensorgen.scene.sections import ROUNDING_MM, Section, sections
from sensorgen.scene.slabs import is_open
from sensorgen.solvers.electrostatics.bounds import unmirrored
from sensorgen.solvers.electrostatics.boxes import Grid, grid

Vertex = tuple[float, float]
Edge = tuple[Vertex, Vertex]
ENDS, MIRRORS = ("bottom", "top"), ("left", "right")
_STRAIGHT = 1e-12  # 1 less the cosine of an angle that is none
RATIO = 0.15  # of a layer's distance from an edge to the next one's


@dataclass(frozen=True)
class PlaneSection:
    """A cross-section between two mirrors.

    Attributes
    ----------
    points_mm : (n, 2) array
        Corners of triangles, across and up [mm].
    triangles : (m, 3) array
        Their corners, counter-clockwise; of dielectrics alone.
    materials : tuple of str
        Of each triangle.
    shares : (m,) array
        How often each, or its mirror image, occurs in the sensor [-].
    faces : mapping of ((u, v), (u, v)) to (str, str)
        Edges of what lies in the cell, with the material or the end ("bottom", "top") to the left and to the right of
        them; "" at a mirror.
    depth_mm : float
        Of the sensor, square to the section [mm].
    """

    points_mm: Real
    triangles: Whole
    materials: tuple[str, ...]
    shares: Real
    faces: dict[Edge, tuple[str, str]]
    depth_mm: float

    def _number(self) -> dict[Vertex, int]:
        return {(u, v): k for k, (u, v) in enumerate(self.points_mm.tolist())}

    def border(self) -> dict[str, list[tuple[int, int]]]:
        """Edges of the triangles, by the points' numbers, on each electrode and on each mirror: "left" and "right"."""
        number, first = self._number(), self.points_mm[:, 0].min()
        edges: dict[str, list[tuple[int, int]]] = {name: [] for name in (*ENDS, *MIRRORS)}
        for (a, b), sides in self.faces.items():
            ends = [s for s in sides if s in ENDS]
            if a in number and b in number and len(ends) + sides.count("") == 1:
                name = ends[0] if ends else MIRRORS[int(max(a[0], b[0]) - first > ROUNDING_MM)]
                edges[name].append((number[a], number[b]))
        return edges

    def corners(self) -> list[int]:
        """Numbers of the points at which materials, electrodes and mirrors meet other than in a straight line."""
        number = self._number()
        around: dict[Vertex, list[tuple[frozenset[str], float]]] = defaultdict(list)
        for (a, b), sides in self.faces.items():
            if sides[0] != sides[1]:
                angle = float(np.arctan2(b[1] - a[1], b[0] - a[0]))
                around[a].append((frozenset(sides), angle))
                around[b].append((frozenset(sides), angle + np.pi))
        return [number[p] for p, lines in around.items() if p in number and not _is_straight(lines)]


def _is_straight(lines: list[tuple[frozenset[str], float]]) -> bool:
    """Test whether the lines at a point are one straight line between the same two sides."""
    (one, at), *others = lines
    return [side for side, _ in others] == [one] and abs(np.cos(at - others[0][1]) + 1) < _STRAIGHT


def geometry(scene: Scene) -> PlaneSection | Grid:
    """The cell of a scene.

    Raises
    ------
    ValueError
        It has no mirrors or other electrodes than two, or is neither a constant cross-section nor made of boxes.
    """
    if reason := unmirrored(scene):
        raise ValueError(reason)
    if is_open(scene):
        raise ValueError("its field runs in the air around it, not between mirrors alone")
    cuts = sections(scene)
    if len(cuts) > 1:
        return grid(scene)
    return _plane(cuts[0], scene.size_mm[2])


def _plane(section: Section, height_mm: float) -> PlaneSection:
    """The cell of a cross-section, its bands cut into triangles around their middles."""
    piece = cell(section, height_mm)
    heights = _heights(piece.slices)
    points: dict[Vertex, int] = {}
    triangles, materials, shares = [], [], []
    faces: dict[Edge, tuple[str, str]] = {}
    for part, often in zip(piece.slices, piece.shares, strict=True):
        for name, outline in _between(list(_polygons(part, heights))):
            middle = (sum(u for u, _ in outline) / len(outline), sum(v for _, v in outline) / len(outline))
            for a, b in pairwise([*outline, outline[0]]):
                edge = (a, b) if a < b else (b, a)
                left, right = faces.get(edge, ("", ""))
                faces[edge] = (name, right) if a < b else (left, name)
                if name not in ENDS:
                    triangles.append([points.setdefault(p, len(points)) for p in (middle, a, b)])
                    materials.append(name)
                    shares.append(often)
    return PlaneSection(
        np.array(list(points)), np.array(triangles), tuple(materials), np.array(shares), faces, section.depth_mm
    )


def _between(column: list[tuple[str, list[Vertex]]]) -> list[tuple[str, list[Vertex]]]:
    """Bands of a column, from the bottom up, without covers under the bottom electrode and on the top one."""
    low = [k for k, (name, _) in enumerate(column) if name == "bottom"]
    high = [k for k, (name, _) in enumerate(column) if name == "top"]
    return column[min(low, default=0) : max(high, default=len(column)) + 1]


def _heights(slices: Iterable[Slice]) -> dict[float, set[float]]:
    """Heights of corners on each vertical line."""
    heights: dict[float, set[float]] = defaultdict(set)
    for part in slices:
        for band in part.bands:
            for at, k in ((part.left_mm, 0), (part.right_mm, 1)):
                heights[round(at, 9)] |= {round(band.bottom_mm[k], 9), round(band.top_mm[k], 9)}
    return heights


def _polygons(part: Slice, heights: dict[float, set[float]]) -> Iterator[tuple[str, list[Vertex]]]:
    """Bands of a slice, counter-clockwise, with every corner that their neighbours have on their sides."""
    left, right = round(part.left_mm, 9), round(part.right_mm, 9)
    for band in part.bands:
        (low_l, low_r), (top_l, top_r) = ((round(v, 9) for v in line) for line in (band.bottom_mm, band.top_mm))
        up = [(right, v) for v in sorted(heights[right]) if low_r <= v <= top_r]
        down = [(left, v) for v in sorted(heights[left], reverse=True) if low_l <= v <= top_l]
        if max(top_l - low_l, top_r - low_r) > ROUNDING_MM:
            yield band.terminal or band.material, [*up, *down]


def share(cell: PlaneSection | Grid) -> float:
    """Number of cells in the sensor [-]; raises ValueError where the sensor's end cuts the cell."""
    if np.ptp(cell.shares) > ROUNDING_MM:
        raise ValueError("the sensor's end cuts its repeating cell")
    return float(np.ravel(cell.shares)[0])


def permittivities(section: PlaneSection, permittivity: Mapping[str, float]) -> Real:
    """Of each triangle, times how often it occurs [-]."""
    return np.array([permittivity[name] for name in section.materials]) * section.shares


def fillings(grid: Grid, permittivity: Mapping[str, float]) -> Real:
    """Permittivity by number of a box's filling, 0 of both electrodes [-]."""
    return np.array([0.0, 0.0, *(permittivity[name] for name in grid.names[2:])])


def nodes(planes_mm: Real, layers: int) -> Real:
    """Planes of a finer grid, with layers that shrink towards both ends of each distance [mm]."""
    near = RATIO ** np.arange(layers, 0, -1)
    steps = np.concatenate([[0.0], near, 1 - near[::-1]]) if layers else np.zeros(1)
    inner = planes_mm[:-1, None] + np.diff(planes_mm)[:, None] * steps
    return np.append(inner.ravel(), planes_mm[-1])
