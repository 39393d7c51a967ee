"""Mesh with rings at singular corners, how singular they are, and its boundary as a stream function sees it.

At a corner u grows as r^lambda, and lambda below 1 means an infinite field.

No flux crosses a mirror: the function has one value along each. Around an island of electrode it grows by all the flux
that ends there: along a cut from each island to another boundary it jumps by an unknown value.
"""

from collections import defaultdict, deque
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from itertools import pairwise
from math import ceil, log

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Whole
from sensorgen.scene.connections import groups
from sensorgen.solvers.electrostatics.elimination import HELD, Numbers
from sensorgen.solvers.electrostatics.triangles import Edge, Fan, Triangle, Triangles, edges_of, fans, filled

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
        self.points: list[list[float]] = mesh.points.tolist()
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
                    self.points.append((here + (there - here) * (radius / length)).tolist())

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
            new = [*tips, *filled(hub, self.points)]
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


@dataclass(frozen=True)
class Flow:
    """The boundary as a flux sees it; unknown 0 is the value 0.

    Attributes
    ----------
    held : dict of int to int
        Points where the function has one value with others: the unknown that this is.
    walls : set of edge
        Edges that no flux crosses.
    lifts : dict of int to list of (int, int)
        Of the triangles beside a cut: a corner on it, and the unknown that adds to the function there.
    top : list of (int, int)
        Edges of the electrode at 1 V, counter-clockwise around the dielectric.
    rise : dict of int to int
        How often each jump adds to what flows into that electrode.
    count : int
        Unknowns so far.
    """

    held: dict[int, int]
    walls: set[Edge]
    lifts: dict[int, list[tuple[int, int]]]
    top: list[tuple[int, int]]
    rise: dict[int, int]
    count: int


@dataclass(frozen=True)
class _Rim:
    """Boundary of a mesh whose every corner has one fan, counter-clockwise.

    Attributes
    ----------
    around : dict of int to Fan
        Triangles at each corner.
    walls, top : list of edge
        Mirrors, and the electrode at 1 V.
    loops : dict of int to int
        Of each point on it, the least of those that its edges join it to.
    starts : set of int
        Points where an edge on an electrode begins.
    """

    around: dict[int, Fan]
    walls: list[Edge]
    top: list[Edge]
    loops: dict[int, int]
    starts: set[int]

    @classmethod
    def of(cls, mesh: Triangles) -> "_Rim":
        """Boundary of a mesh."""
        around = {corner: one[0] for corner, one in fans(mesh.triangles).items()}
        edges = [(corner, fan.spokes[0]) for corner, fan in around.items() if not fan.closed]
        walls = [e for e in edges if _named(e) not in mesh.terminals]
        top = [e for e in edges if mesh.terminals.get(_named(e)) == "top"]
        starts = {a for a, b in edges if _named((a, b)) in mesh.terminals}
        return cls(around, walls, top, _groups(edges), starts)


def flow(mesh: Triangles, cones: Collection[int]) -> Flow:
    """Mirrors, cuts and electrode of a mesh whose every corner has one fan; cuts keep away from cones."""
    rim = _Rim.of(mesh)
    mirrors, count = _groups(rim.walls), HELD
    unknown_of: dict[int, int] = {}
    lifts: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for piece in _connected(rim.around):
        values, count = _on_mirrors(piece, mirrors, (piece & rim.loops.keys()) - set(cones), count)
        unknown_of |= values
        start = rim.loops[min(point for point, value in values.items() if value == 0)]
        for path in _cuts(rim, {k: rim.loops[k] for k in piece if k in rim.loops}, start, cones):
            for number, corner in _beside(rim.around, path):
                lifts[number].append((corner, count))
            count += 1
    rise = _rise(rim.top, lifts, rim.around)
    return Flow(unknown_of, {_named(e) for e in rim.walls}, dict(lifts), rim.top, rise, count)


def _connected(around: Mapping[int, Fan]) -> list[set[int]]:
    """Points of each connected piece of dielectric, by their least."""
    pieces: dict[int, set[int]] = defaultdict(set)
    for point, least in _groups((corner, spoke) for corner, one in around.items() for spoke in one.spokes).items():
        pieces[least].add(point)
    return [pieces[least] for least in sorted(pieces)]


def _on_mirrors(
    piece: set[int], mirrors: Mapping[int, int], rim: set[int], first: int
) -> tuple[dict[int, int], int]:  # fmt: skip
    """Unknown of each point on a mirror of a piece, and the next one; 0 on one mirror, else at one point of the rim."""
    names = sorted({mirrors[k] for k in piece if k in mirrors})
    values: dict[int, int] = {}
    for unknown, name in enumerate(names[1:], first):
        values |= dict.fromkeys((k for k in piece if mirrors.get(k) == name), unknown)
    zero = {k for k in piece if mirrors.get(k) == names[0]} if names else {min(rim)}
    return values | dict.fromkeys(zero, 0), first + max(len(names) - 1, 0)


def _rise(
    top: Iterable[Edge], lifts: Mapping[int, list[tuple[int, int]]], around: Mapping[int, Fan]
) -> dict[int, int]:  # fmt: skip
    """Number of times that each jump adds to what flows into the electrode at 1 V."""
    rise: dict[int, int] = defaultdict(int)
    for a, b in top:
        for corner, jump in lifts.get(around[a].members[0], ()):
            rise[jump] += (corner == b) - (corner == a)
    return rise


def _named(edge: Edge) -> Edge:
    return min(edge), max(edge)


def _groups(edges: Iterable[Edge]) -> dict[int, int]:
    """Points that edges join, each with the least of those that it is joined to."""
    points, at = np.unique(np.array([*edges], np.int64).reshape(-1, 2), return_inverse=True)
    group = groups(len(points), *at.reshape(-1, 2).T)
    least = points[np.unique(group, return_index=True)[1]]
    return dict(zip(points.tolist(), least[group].tolist(), strict=True))


def _cuts(rim: _Rim, loops: dict[int, int], start: int, cones: Collection[int]) -> Iterator[list[int]]:
    """For each loop that carries flux but the first, points from it to another one, all inside but for both ends."""
    ends = rim.starts - set(cones)  # a cut ends with an electrode to its left, lest it part a mirror's value
    carrying = set(loops.values()).intersection(map(rim.loops.get, rim.starts)) | {start}  # not where all is mirror
    reached, before = {start}, {k: k for k in _ends_of(start, loops, ends)}
    todo = deque(before)
    while todo and reached < carrying:
        here = todo.popleft()
        for spoke in rim.around[here].inside:
            if spoke in before or spoke in cones:
                continue
            if spoke not in loops:
                before[spoke] = here
                todo.append(spoke)
            elif loops[spoke] in carrying - reached:
                yield [spoke, *_back(before, here)]
                reached.add(loops[spoke])
                new = _ends_of(loops[spoke], loops, ends)
                before |= {k: k for k in new}
                todo += new


def _back(before: Mapping[int, int], point: int) -> Iterator[int]:
    """Points from one to the one that is its own predecessor."""
    yield point
    while before[point] != point:
        point = before[point]
        yield point


def _ends_of(loop: int, loops: Mapping[int, int], ends: Collection[int]) -> list[int]:
    """Points of a loop at which a cut may end."""
    return [k for k, own in loops.items() if own == loop and k in ends]


def _beside(around: dict[int, Fan], path: list[int]) -> Iterator[tuple[int, int]]:
    """Triangles to the left of a path, each with its corner there."""
    for k, corner in enumerate(path):
        fan = around[corner]
        start = fan.spokes.index(path[k + 1]) if k + 1 < len(path) else 0
        end = fan.spokes.index(path[k - 1]) if k else len(fan.members)
        for number in fan.members[start:end] if start <= end else fan.members[start:] + fan.members[:end]:
            yield number, corner


@dataclass(frozen=True)
class Cones:
    """Triangles of which those at singular corners stand for rings without end.

    Attributes
    ----------
    triangles : Triangles
        Each corner has one fan.
    doublings : dict of int to int
        Of singular corners: logarithm of the number of their rings.
    """

    triangles: Triangles
    doublings: Mapping[int, int]

    @cached_property
    def corners(self) -> Whole:
        """Of all triangles (n, 3)."""
        return np.array(self.triangles.triangles)

    @cached_property
    def fans(self) -> dict[int, Fan]:
        """Triangles at each singular corner."""
        return {c: found[0] for c, found in fans(self.triangles.triangles).items() if c in self.doublings}

    @cached_property
    def plain(self) -> Whole:
        """Numbers of the triangles that are no tips."""
        is_plain = np.ones(len(self.corners), bool)
        is_plain[[n for fan in self.fans.values() for n in fan.members]] = False
        return np.flatnonzero(is_plain)

    @cached_property
    def sides(self) -> tuple[Whole, Whole]:
        """Distinct sides of the plain triangles (:meth:`names`), and which of them each of these has (k, 3)."""
        corners = self.corners[self.plain]
        found, at = np.unique(self.names(corners, np.roll(corners, -1, axis=1)), return_inverse=True)
        return found, at.reshape(corners.shape)

    @cached_property
    def flow(self) -> Flow:
        """The boundary as a flux sees it."""
        return flow(self.triangles, self.fans)

    def names(self, a: Whole, b: Whole) -> Whole:
        """One number for each side, by its ends."""
        return np.minimum(a, b) * len(self.triangles.points) + np.maximum(a, b)

    def areas(self) -> Numbers:
        """Of all triangles, twice; 0 or less where double precision does not resolve it [mm2]."""
        a, b, c = self.triangles.points[self.corners].transpose(1, 2, 0)
        return np.asarray((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])

    def thinness(self) -> Numbers:
        """Ratio of each triangle's relative error of area to that of its corners' coordinates [-].

        A micrometre of height, a metre up or along a slope that is a metre long, makes it a million.
        """
        corners = self.triangles.points[self.corners]
        farthest, along = abs(corners).max(axis=1), np.ptp(corners, axis=1)
        return np.asarray((farthest * along[:, ::-1]).sum(axis=1) / self.areas())

    def elements(self) -> int:
        """Triangles, those in rings each for itself."""
        in_rings = [len(fan.members) * (1 + (2 << self.doublings[c])) for c, fan in self.fans.items()]
        return len(self.plain) + sum(in_rings)
