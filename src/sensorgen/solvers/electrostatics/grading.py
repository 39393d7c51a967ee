"""Room for rings around corners: a tip of each triangle cut off, and what is left in few triangles."""

from collections import defaultdict
from collections.abc import Collection, Iterator
from itertools import pairwise
from math import ceil, log

import numpy as np
from numpy.typing import NDArray

from sensorgen.solvers.electrostatics.triangles import Edge, Triangle, Triangles, edges_of, fan

_RATIO = 0.25  # of one ring's radius to the next
_REACH = 0.45  # of a corner's shortest edge: radius of its tips
_LONG = 3.0  # times a corner's shortest edge: an edge so long gets rings further out


def graded(mesh: Triangles, corners: Collection[int]) -> Triangles:
    """Split triangles so that each of some corners has a small one of its own in every triangle that it had.

    Corners near each other, as over a thin film, get rings outwards too, up to the length of their long edges.

    Parameters
    ----------
    mesh : Triangles
        A cell's few triangles.
    corners : collection of int
        That get tips.

    Returns
    -------
    Triangles
        Finer, of the same regions and terminals; corners keep their numbers.
    """
    return _Splitter(mesh, corners).split()


class _Splitter:
    """Points on edges, shared by the triangles at both sides, and the triangles between them."""

    def __init__(self, mesh: Triangles, corners: Collection[int]) -> None:
        self.mesh = mesh
        self.tipped = corners
        self.points: list[NDArray[np.float64]] = list(mesh.points)
        lengths = {e: self._length(e) for corners in mesh.triangles for e in edges_of(corners)}
        self.radius: dict[int, float] = defaultdict(lambda: np.inf)
        for edge, length in lengths.items():
            for corner in edge:
                self.radius[corner] = min(self.radius[corner], _REACH * length)
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

    def _radii(self, corner: int, length: float) -> list[float]:
        """Of the rings that cross an edge of some length at a corner, the largest first [mm]."""
        start = self.radius[corner]
        outer = []
        if length > _LONG * start / _REACH:
            outer = [start * _RATIO**-k for k in range(ceil(log(_REACH * length / start) / -log(_RATIO)))][::-1]
        return outer or ([start] if corner in self.tipped else [])

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
            left, right = self._around(corner, before), self._around(corner, after)
            hub += [*left, *([] if corner in self.tipped else [corner]), *right[::-1]]
            if corner in self.tipped:
                yield corner, right[-1], left[-1]
        yield from fan(np.array([self.points[n] for n in hub]), hub)
