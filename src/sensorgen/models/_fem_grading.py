"""Rings of triangles around corners, each ring a fixed share of the last: what makes polynomials converge there."""

from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise
from math import ceil, log

import numpy as np
from numpy.typing import NDArray

from sensorgen.models._fem_triangles import Edge, Triangle, Triangles, edges_of, fan

RATIO = 0.15  # of one ring's radius to the last: near the best for exponential convergence (Gui and Babuska, 1986)
_REACH = 0.4  # of a corner's shortest edge: radius of its outermost ring
_LONG = 5.0  # times a corner's shortest edge: an edge so long gets rings further out
_SMALLEST = 1e-13  # of the cell's size: no ring is smaller, for doubles end there


def graded(mesh: Triangles, exponents: dict[int, float], error: float) -> Triangles:
    """Split triangles towards corners until what is left there holds less than a share of the energy.

    The energy within radius r goes as r^(2 lambda): each corner gets as many rings as its own exponent asks for.
    Corners near each other, as over a thin film, get rings outwards too, up to the length of their long edges.

    Parameters
    ----------
    mesh : Triangles
        A cell's few triangles.
    exponents : dict of int to float
        Of the corners that need rings [-].
    error : float
        Share of the energy that may stay unresolved at a corner [-].

    Returns
    -------
    Triangles
        Finer, of the same regions and terminals.
    """
    return _Splitter(mesh, exponents, error).split()


class _Splitter:
    """Points on edges, shared by the triangles at both sides, and the triangles between them."""

    def __init__(self, mesh: Triangles, exponents: dict[int, float], error: float) -> None:
        self.mesh = mesh
        self.points: list[NDArray[np.float64]] = list(mesh.points)
        lengths = {e: self._length(e) for corners in mesh.triangles for e in edges_of(corners)}
        self.radius: dict[int, float] = defaultdict(lambda: np.inf)
        for edge, length in lengths.items():
            for corner in edge:
                self.radius[corner] = min(self.radius[corner], _REACH * length)
        size = max(lengths.values())
        self.rings = {c: self._ring_count(c, value, error, size) for c, value in exponents.items()}
        self.on_edge = {edge: self._edge_points(edge, length) for edge, length in lengths.items()}

    def split(self) -> Triangles:
        """The finer mesh."""
        triangles: list[Triangle] = []
        regions: list[tuple[str, float]] = []
        for corners, region in zip(self.mesh.triangles, self.mesh.regions, strict=True):
            new = list(self._parts(corners))
            triangles += new
            regions += [region] * len(new)
        terminals: dict[Edge, str] = {}
        for (a, b), name in self.mesh.terminals.items():
            chain = [a, *self._chain(a, b), b]
            terminals |= {(min(e), max(e)): name for e in pairwise(chain)}
        return Triangles(np.array(self.points), triangles, regions, terminals)

    def _length(self, edge: Edge) -> float:
        a, b = (self.mesh.points[k] for k in edge)
        return float(np.hypot(*(b - a)))

    def _ring_count(self, corner: int, exponent: float, error: float, size: float) -> int:
        wanted = ceil(log(error) / (2 * exponent * log(RATIO)))
        possible = int(log(_SMALLEST * size / self.radius[corner]) / log(RATIO))
        return max(1, min(wanted, possible))

    def _radii(self, corner: int, length: float) -> list[float]:
        """Of the rings that cross an edge of some length at a corner, the largest first [mm]."""
        start = self.radius[corner]
        outer = []
        if length > _LONG * start / _REACH:
            outer = [start * RATIO**-k for k in range(ceil(log(_REACH * length / start) / -log(RATIO)))][::-1]
        inner = [start * RATIO**k for k in range(self.rings[corner] + 1)] if corner in self.rings else []
        return outer[: len(outer) - 1 if inner else None] + inner

    def _edge_points(self, edge: Edge, length: float) -> tuple[list[int], list[int]]:
        """Numbers of the points on an edge around its first corner and around its second, the outermost first."""
        made: tuple[list[int], list[int]] = ([], [])
        for side, corner in enumerate(edge):
            here, there = self.mesh.points[corner], self.mesh.points[edge[1 - side]]
            for radius in self._radii(corner, length):
                made[side].append(len(self.points))
                self.points.append(here + (there - here) * (radius / length))
        return made

    def _around(self, corner: int, other: int) -> list[int]:
        """Points around a corner on its edge to another one, the outermost first."""
        edge = (min(corner, other), max(corner, other))
        return self.on_edge[edge][edge.index(corner)]

    def _chain(self, a: int, b: int) -> list[int]:
        """All points on an edge from one corner to the other, ends left out."""
        return [*self._around(a, b)[::-1], *self._around(b, a)]

    def _parts(self, corners: Triangle) -> Iterator[Triangle]:
        hub: list[int] = []
        for k, corner in enumerate(corners):
            before, after = corners[k - 1], corners[k - 2]
            count = self.rings.get(corner, -1) + 1
            left, right = self._around(corner, before), self._around(corner, after)
            if count:
                yield from _tip(corner, left[-count:], right[-count:])
            inwards, outwards = left[: len(left) - count + 1], right[: len(right) - count + 1][::-1]
            hub += [*inwards, *outwards] if count else [*left, corner, *right[::-1]]
        yield from fan(np.array([self.points[n] for n in hub]), hub)


def _tip(corner: int, left: list[int], right: list[int]) -> Iterator[Triangle]:
    """Rings around one corner of a triangle: ``left`` on the edge that comes before it in turn, ``right`` after."""
    for k in range(len(left) - 1):
        yield left[k], left[k + 1], right[k]
        yield left[k + 1], right[k + 1], right[k]
    yield left[-1], corner, right[-1]
