"""Singularity of the field at each corner: u grows as r^lambda, and lambda below 1 means an infinite field."""

from collections import defaultdict
from collections.abc import Collection, Mapping
from functools import cache, lru_cache
from itertools import pairwise
from math import ceil, log

import numpy as np
from numpy.typing import NDArray

from sensorgen.solvers.electrostatics.triangles import Edge, Triangle, Triangles, edges_of, fan, fans

_DEGREE = 8  # of the polynomials in a sector
_WIDEST = np.pi / 3  # of a sector
_NO_FIELD = 1e-9  # lambda^2 of a constant
_SMOOTH = 1e-6  # how near to a whole number lambda counts as one
_HIGHEST = 3.5  # lambda above which polynomials serve without refinement


def exponents(mesh: Triangles, permittivity: Mapping[str, float]) -> dict[int, float]:
    r"""Lowest exponent that is no whole number, for each corner that has one below 3.5.

    Around a corner u = r^lambda w(theta), :math:`(\varepsilon w')' + \lambda^2 \varepsilon w = 0`, w = 0 on electrodes,
    w' = 0 on mirrors: an eigenvalue problem in one dimension, solved with polynomials per sector.

    Parameters
    ----------
    mesh : Triangles
        The cell's few triangles; one fan at each corner.
    permittivity : dict of str to float
        Relative, of each material; its modulus where it is complex [-].

    Returns
    -------
    dict of int to float
        Corner's number to lambda [-].
    """
    lowest: dict[int, float] = {}
    for corner, (around,) in fans(mesh.triangles).items():
        edges = [tuple(sorted((corner, around.spokes[k]))) for k in (0, -1)]
        ends = None if around.closed else tuple(edge in mesh.terminals for edge in edges)
        away = mesh.points[[*around.spokes, *around.spokes[:1]]] - mesh.points[corner]
        sines = away[:-1, 0] * away[1:, 1] - away[:-1, 1] * away[1:, 0]
        angles = np.arctan2(sines, (away[:-1] * away[1:]).sum(axis=1)).tolist()
        sectors: list[tuple[float, float]] = []  # angle and permittivity in turn, neighbours of one material as one
        for angle, n in zip(angles, around.members, strict=False):
            eps = permittivity[mesh.regions[n][0]]
            before = sectors.pop()[0] if sectors and sectors[-1][1] == eps else 0.0
            sectors.append((round(angle + before, 12), eps))
        value = exponent(tuple(sectors), ends)
        if value < _HIGHEST:
            lowest[corner] = value
    return lowest


_Sectors = tuple[tuple[float, float], ...]


@cache
def _reference() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and mass of polynomials on 0..1, given by their values at Chebyshev's points."""
    nodes = (1 - np.cos(np.pi * np.arange(_DEGREE + 1) / _DEGREE)) / 2
    at, weight = np.polynomial.legendre.leggauss(_DEGREE + 1)
    at, weight = (at + 1) / 2, weight / 2
    powers = np.linalg.inv(np.vander(nodes, increasing=True))
    value = np.vander(at, _DEGREE + 1, increasing=True) @ powers
    slope = np.vander(at, _DEGREE, increasing=True) @ (powers[1:] * np.arange(1, _DEGREE + 1)[:, None])
    return (slope.T * weight) @ slope, (value.T * weight) @ value


@lru_cache(maxsize=1000)
def exponent(sectors: _Sectors, fixed: tuple[bool, ...] | None) -> float:
    """The lowest exponent that is no whole number, or infinity.

    ``sectors`` holds angle [rad] and permittivity [-] in turn; ``fixed`` says whether an electrode bounds
    the first and the last, and is None where they close to a ring.
    """
    parts = [(angle / n, eps) for angle, eps in sectors for n in [int(np.ceil(angle / _WIDEST))] for _ in range(n)]
    size = _DEGREE * len(parts) + 1
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for k, (angle, eps) in enumerate(parts):
        here = slice(_DEGREE * k, _DEGREE * (k + 1) + 1)
        stiffness[here, here] += eps / angle * _reference()[0]
        mass[here, here] += eps * angle * _reference()[1]
    keep = np.eye(size)  # from free values to all: 0 on electrodes, the same at both ends of a ring
    if fixed is None:
        keep[-1, 0] = 1.0
        keep = keep[:, :-1]
    else:
        keep = keep[:, int(fixed[0]) : size - int(fixed[1])]
    stiffness, mass = (keep.T @ m @ keep for m in (stiffness, mass))
    root = np.linalg.inv(np.linalg.cholesky(mass))
    squares = np.linalg.eigvalsh(root @ stiffness @ root.T)
    values = np.sqrt(squares[squares > _NO_FIELD])
    odd = values[np.abs(values - np.round(values)) > _SMOOTH]
    return float(odd.min()) if len(odd) else np.inf


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
        edges = dict.fromkeys(edge for corners in mesh.triangles for edge in edges_of(corners))
        lengths = {(a, b): float(np.hypot(*(mesh.points[b] - mesh.points[a]))) for a, b in edges}
        self.radius: dict[int, float] = defaultdict(lambda: np.inf)
        for edge, length in lengths.items():
            for corner in edge:
                self.radius[corner] = min(self.radius[corner], _REACH * length)
        # Numbers of the points on each edge around its first corner and around its second, the outermost first.
        self.on_edge: dict[Edge, tuple[list[int], list[int]]] = {}
        for edge, length in lengths.items():
            self.on_edge[edge] = ([], [])
            for made, corner, other in zip(self.on_edge[edge], edge, edge[::-1], strict=True):
                here, there = mesh.points[corner], mesh.points[other]
                for radius in self._radii(corner, length):
                    made.append(len(self.points))
                    self.points.append(here + (there - here) * (radius / length))

    def split(self) -> Triangles:
        """The finer mesh."""
        triangles: list[Triangle] = []
        regions: list[tuple[str, float]] = []
        for corners, region in zip(self.mesh.triangles, self.mesh.regions, strict=True):
            tips: list[Triangle] = []
            hub: list[int] = []
            for k, corner in enumerate(corners):
                before, after = corners[k - 1], corners[k - 2]
                left, right = self._around(corner, before), self._around(corner, after)
                hub += [*left, *([] if corner in self.tipped else [corner]), *right[::-1]]
                if corner in self.tipped:
                    tips.append((corner, right[-1], left[-1]))
            new = [*tips, *fan(np.array([self.points[n] for n in hub]), hub)]
            triangles += new
            regions += [region] * len(new)
        terminals: dict[Edge, str] = {}
        for (a, b), name in self.mesh.terminals.items():
            chain = [a, *self._around(a, b)[::-1], *self._around(b, a), b]
            terminals |= {(min(e), max(e)): name for e in pairwise(chain)}
        return Triangles(np.array(self.points), triangles, regions, terminals)

    def _radii(self, corner: int, length: float) -> list[float]:
        """Of the rings that cross an edge of some length at a corner, the largest first [mm]."""
        start = self.radius[corner]
        outer = []
        if length > _LONG * start / _REACH:
            outer = [start * _RATIO**-k for k in range(ceil(log(_REACH * length / start) / -log(_RATIO)))][::-1]
        return outer or ([start] if corner in self.tipped else [])

    def _around(self, corner: int, other: int) -> list[int]:
        """Points around a corner on its edge to another one, the outermost first."""
        edge = (min(corner, other), max(corner, other))
        return self.on_edge[edge][edge.index(corner)]
