"""Mesh of quadratic triangles of a cell's solid parts, refined at notches and where two of them meet in a point."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from math import atan2, cos, dist, pi

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.units import M_PER_MM
from sensorgen.scene.scene import Point
from sensorgen.solvers.contact import mesher
from sensorgen.solvers.contact.cell import OUTSIDE, ContactCell, Edge, joined
from sensorgen.solvers.contact.element import TRIANGLE, ElementMesh

Run = tuple[int, int]

_SAME = 1e-9  # of the cell's size: places nearer than this are one
_RINGS = 4  # around a notch
_BLUNT_RINGS = 1  # the same where no solids meet in a point: triangles at all corners are small there
_BLUNT_SIZE, _BLUNT_CORNER = 2 / 3, 1 / 3  # sizes of triangles there, and at corners, over those of other cells [-]
_LEVEL = 0.1  # slope of the first chord of a dome, at most [-]
_SIDES = ((0, 1), (1, 2), (2, 0))
_BLOCK = 0.5  # largest triangle of a block on the top, over growth and the cell's width [-]
_SHARP = 0.3  # an outline that turns by less is no corner [rad]
_RATIO = 0.5  # of a ring to the one around it [-]


@dataclass(frozen=True)
class TriangleMesh(ElementMesh):
    """A mesh of straight-sided triangles: corners counter-clockwise, then the middles of the sides 01, 12, 20.

    Attributes
    ----------
    rim : (k, 3) array
        Sides with nothing behind them: the solid lies to the left from the first to the second corner; then the middle.
    """

    rim: Whole

    @property
    def outline(self) -> Whole:
        """Straight pieces of the rim, anticlockwise (2k, 2)."""
        return np.concatenate([self.rim[:, [0, 2]], self.rim[:, [2, 1]]])

    def top(self) -> tuple[Whole, Real]:
        """Sides on the top, start, middle and end (k, 3), and what each node has of the length [m], or area [m2]."""
        on_top = (self.points_m[self.rim, 1] == self.points_m[:, 1].max()).all(axis=1)
        nodes, lengths = self.rim[on_top][:, [0, 2, 1]], self.lengths_m()[on_top, None]
        return nodes, 2 * np.pi * self.points_m[nodes, 0] * lengths if self.turned else lengths

    def lengths_m(self) -> Real:
        """Length of each side of the rim [m]."""
        ends = self.points_m[self.rim[:, 1]] - self.points_m[self.rim[:, 0]]
        return np.asarray(np.hypot(*ends.T))


@dataclass(frozen=True)
class Net:
    """Output of the mesher: places [m], corners and regions of triangles, and sides along negative regions."""

    points_m: Real
    corners: Whole
    region: Whole
    marked: Mapping[int, list[Run]]


def of_triangles(points_m: Real, corners: Whole, region: Whole, *, turned: bool = False) -> TriangleMesh:
    """A mesh with middles on the sides of given triangles, which are counter-clockwise."""
    sides = np.concatenate([corners[:, side] for side in _SIDES])
    low, high = np.sort(sides, axis=1).T
    one, back, count = np.unique(low * len(points_m) + high, return_inverse=True, return_counts=True)
    middles = points_m[np.column_stack(np.divmod(one, len(points_m)))].mean(axis=1)
    numbers = len(points_m) + back
    rim = np.column_stack([sides, numbers])[count[back] == 1]
    triangles = np.concatenate([corners, numbers.reshape(3, -1).T], axis=1)
    return TriangleMesh(TRIANGLE, np.concatenate([points_m, middles]), triangles, region, rim, turned=turned)


def at_border(mesh: TriangleMesh) -> Mask:
    """Mask of the rim's sides on the straight border of the cell."""
    a, b = (mesh.points_m[mesh.rim[:, k]] for k in range(2))
    ends = np.array([mesh.points_m.min(axis=0), mesh.points_m.max(axis=0)])
    near = _SAME * (ends[1] - ends[0]).max()
    return np.asarray(((abs(a - ends[:, None]) < near) & (abs(b - ends[:, None]) < near)).any(axis=(0, 2)))


def pinches(cell: ContactCell) -> set[Point]:
    """Points in which solids touch: four edges of solids meet there, mirrors among them."""
    count = Counter(point for edge in cell.faces() for point in edge)
    return {point for point, edges in count.items() if edges >= 4}


@dataclass(frozen=True)
class Fineness:
    """Sizes of triangles: where solids meet in one point, at the other ends of gaps, and far from both [mm].

    ``growth`` is by how much the size grows per distance [-].
    """

    apex_mm: float = 1e-3
    corner_mm: float = 0.05
    coarse_mm: float = 0.15
    growth: float = 0.5

    def scaled(self, factor: float) -> "Fineness":
        """Every length and the growth times a factor."""
        names = "apex_mm", "corner_mm", "coarse_mm", "growth"
        return replace(self, **{name: factor * getattr(self, name) for name in names})

    def finer(self) -> "Fineness":
        """The next level."""
        return self.scaled(1 / 2)


def mesh_of(cell: ContactCell, fineness: Fineness) -> TriangleMesh:
    """Mesh the solid parts of a cell.

    The edges are cut here, because a mesher that smooths its sizes forgets the small ones at an apex. Where there is
    none, edges that continue each other are one: a cell is cut wherever an outline turns, and pieces of the others
    there would make a mesh fine far from corners.
    """
    sharp = pinches(cell)
    if not sharp:
        cell = replace(cell, edges=joined(cell.edges))
        fineness = replace(fineness.scaled(_BLUNT_SIZE), corner_mm=_BLUNT_CORNER * fineness.corner_mm)
    exposed = {p for edge, sides in cell.faces().items() if OUTSIDE not in sides for p in edge}
    sizes = dict.fromkeys(exposed, fineness.corner_mm) | dict.fromkeys(sharp, fineness.apex_mm)
    wide = replace(fineness, coarse_mm=max(fineness.coarse_mm, _BLOCK * fineness.growth * cell.width_mm()))
    pieces = _cut(cell, sizes, fineness, wide)
    net = triangulated(pieces, fineness.coarse_mm, fineness.growth, dict.fromkeys(cell.blocks(), wide.coarse_mm))
    for place in sharp:
        if _is_flat(cell, place):
            net = _parted(net, nearest(net.points_m, place))
    tips, count = [nearest(net.points_m, place) for place in notches(cell)], _RINGS if sharp else _BLUNT_RINGS
    return of_triangles(*ringed(net.points_m, net.corners, net.region, tips, count), turned=cell.turned)


def _cut(
    cell: ContactCell, sizes: Mapping[Point, float], fineness: Fineness, wide: Fineness
) -> dict[Edge, tuple[int, int]]:
    """Pieces of the edges of solids, with their regions; of a block on the top they grow to ``wide``."""
    pieces: dict[Edge, tuple[int, int]] = {}
    of_blocks = {OUTSIDE, *cell.blocks()}
    top_mm = max(z for edge in cell.edges for _, z in edge)
    for (a, b), sides in cell.edges.items():
        of_block = of_blocks.issuperset(sides)
        ends = [sizes.get(p, wide.coarse_mm if of_block and p[1] == top_mm else fineness.coarse_mm) for p in (a, b)]
        length = float(np.hypot(b[0] - a[0], b[1] - a[1]))
        shares = cuts(length, ends[0], ends[1], wide if of_block else fineness)
        places = [a, *((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])) for share in shares), b]
        open_sides = (sides[0] * cell.solid(sides[0]), sides[1] * cell.solid(sides[1]))
        if open_sides != (OUTSIDE, OUTSIDE):
            pieces |= dict.fromkeys(pairwise(places), open_sides)
    return pieces


def _is_flat(cell: ContactCell, place: Point) -> bool:
    """Test whether a dome and a level face meet at a point of the axis of a cell that is turned."""
    ends = [p if q == place else q for (p, q), sides in cell.edges.items() if place in (p, q) and cell.air in sides]
    return cell.turned and place[0] == 0 and all(abs(z - place[1]) < _LEVEL * r for r, z in ends)


def _parted(net: Net, node: int) -> Net:
    """Net in which the triangles above a node have one of their own."""
    corners = net.corners.copy()
    above = net.points_m[corners].mean(axis=1)[:, 1] > net.points_m[node, 1]
    corners[(corners == node) & above[:, None]] = len(net.points_m)
    return replace(net, points_m=np.vstack([net.points_m, net.points_m[node]]), corners=corners)


def triangulated(
    edges: Mapping[Edge, tuple[int, int]], coarse_mm: float, growth: float,
    coarser_mm: Mapping[int, float] | None = None, *, quick: bool = False,
) -> Net:  # fmt: skip
    """Mesh what edges with a region to their left and right enclose; regions from 0 down are left open.

    ``coarser_mm`` is the largest triangle of regions that may have larger ones than ``coarse_mm``.
    ``quick`` makes Delaunay triangles with one optimisation step; for potentials they are as good as a front.
    """
    output = mesher.mesh([*edges.items()], coarse_mm, growth, coarser_mm or {}, quick=quick)
    behind = [min(pair) for pair in edges.values()]
    marked: dict[int, list[Run]] = {}
    for (a, b), number in zip(output.sides.tolist(), output.edge.tolist(), strict=True):
        if behind[number - 1] < 0:
            marked.setdefault(behind[number - 1], []).append((a, b))
    return Net(output.points * M_PER_MM, output.corners, output.region, marked)


def nearest(points_m: Real, place_mm: Point) -> int:
    """The point that is nearest to a place."""
    return int(np.hypot(*(points_m - np.array(place_mm) * M_PER_MM).T).argmin())


def cuts(length_mm: float, first_mm: float, last_mm: float, fineness: Fineness) -> list[float]:
    """Where to cut an edge so that its pieces grow from both ends, as shares of its length.

    >>> [round(t, 3) for t in cuts(1.0, 0.1, 0.1, Fineness(coarse_mm=0.3, growth=1.0))]
    [0.186, 0.5, 0.814]
    """
    half = length_mm / 2
    ahead, behind = (grown(half, size, fineness) / length_mm for size in (first_mm, last_mm))
    places = [*ahead[:-1], 0.5, *(1 - behind[-2::-1])] if len(ahead) + len(behind) > 2 else []
    return [float(t) for t in places]


def grown(reach: float, size: float, fineness: Fineness) -> Real:
    """Ends of pieces that begin with ``size`` and grow up to the coarse size, the last at ``reach`` [mm]."""
    growth = fineness.growth
    size = min(size, fineness.coarse_mm)
    bend = (fineness.coarse_mm - size) / growth  # from here on all are coarse
    turns = np.log(fineness.coarse_mm / size) / growth
    whole = np.log1p(growth * reach / size) / growth if reach < bend else turns + (reach - bend) / fineness.coarse_mm
    t = whole * np.arange(1, max(1, round(whole)) + 1) / max(1, round(whole))
    grown = np.where(t < turns, size / growth * np.expm1(growth * t), bend + (t - turns) * fineness.coarse_mm)
    return np.asarray(grown)


def sharp_corners(edges: Mapping[Edge, tuple[int, int]], left_mm: float, right_mm: float) -> list[Point]:
    """Where the border between two regions turns, ends or branches; the walls of the cell are mirrors."""
    ways: dict[Point, list[complex]] = {}
    for (p, q), sides in edges.items():
        if min(sides) > 0:
            way = complex(q[0] - p[0], q[1] - p[1]) / dist(p, q)
            for place, out in ((p, way), (q, -way)):
                ways.setdefault(place, []).append(out)
                if place[0] in (left_mm, right_mm) and out.real:
                    ways[place].append(-out.conjugate())
    straight = -cos(_SHARP)
    return [place for place, out in ways.items() if len(out) != 2 or (out[0] * out[1].conjugate()).real >= straight]


def notches(cell: ContactCell) -> list[Point]:
    """Where the solids fill more than half a turn around a corner; the walls of the cell are mirrors."""
    ways: dict[Point, list[tuple[float, bool]]] = {}
    for edge, sides in cell.faces().items():
        for (p, q), side in zip((edge, edge[::-1]), sides, strict=True):
            ways.setdefault(p, []).append((atan2(q[1] - p[1], q[0] - p[0]), cell.solid(side)))
    sharp = []
    for place, out_of in ways.items():
        if len(out_of) == 2:
            half, angle = pi / 2 if place[0] in (cell.left_mm, cell.right_mm) else pi, _filled(out_of)
            if angle > half and abs(angle - pi) > _SHARP:
                sharp.append(place)
    return sharp


def _filled(ways: list[tuple[float, bool]]) -> float:
    """Solid angle between two directions [rad]; each with whether the solid is on its left."""
    (one, solid), (other, _) = ways
    return (other - one if solid else one - other) % (2 * pi)


def ringed(points: Real, triangles: Whole, region: Whole, tips: list[int], count: int) -> tuple[Real, Whole, Whole]:
    """Points (n, 2), corners of triangles (m, 3) and their regions, with so many rings around some of the points."""
    is_tip = np.zeros(len(points) + 1, bool)
    is_tip[tips] = True
    at: dict[int, dict[int, list[int]]] = {tip: {} for tip in tips}  # triangles there: corners and region, by number
    triangle_sets, gone, total = [], set[int](), 0

    def add(new: Whole, regions: Whole) -> None:
        beside = is_tip[np.minimum(new, len(is_tip) - 1)]
        for k in np.flatnonzero(beside.any(axis=1)).tolist():
            for corner in new[k, beside[k]].tolist():
                at[corner][total + k] = [*new[k].tolist(), int(regions[k])]
        triangle_sets.append(np.column_stack([new, regions]))

    add(triangles, region)
    for tip in tips:
        # Cut all sides that start at a point at the same shares, and so each triangle there into a small one and pairs
        total = sum(map(len, triangle_sets))
        whole = {k: own for k, own in at[tip].items() if k not in gone}
        gone.update(whole)
        rows = np.array(list(whole.values()))
        here, fill = rows[:, :3], rows[:, 3]
        first = (here == tip).argmax(axis=1)
        _, *ends = np.take_along_axis(here, (first[:, None] + np.arange(3)) % 3, axis=1).T
        beside = np.unique(ends)
        levels = np.arange(count)[:, None] * len(beside)
        a, b = (np.vstack([k, len(points) + levels + np.searchsorted(beside, k)]) for k in ends)
        sides = [(a[1:], a[:-1], b[:-1]), (a[1:], b[:-1], b[1:]), (np.full_like(a[-1], tip), a[-1], b[-1])]
        new = np.concatenate([np.stack(side, axis=-1).reshape(-1, 3) for side in sides])
        near = points[tip] + _RATIO ** np.arange(1, count + 1)[:, None, None] * (points[beside] - points[tip])
        points = np.concatenate([points, near.reshape(-1, 2)])
        add(new, np.tile(fill, 2 * count + 1))
    left = np.concatenate(triangle_sets)[~np.isin(np.arange(sum(map(len, triangle_sets))), list(gone))]
    return points, left[:, :3], left[:, 3]
