"""Outlines of a deformed cell, contacting boundaries merged so that it can be meshed without slivers of air.

Each of two faces in contact runs over the points of the other, so that both become one line. Mirrors at the cell's ends
are faces as well; points that touch one are put onto it.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from shapely import STRtree, box

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.units import M_PER_MM
from sensorgen.solvers.contact.cell import OUTSIDE, ContactCell, add, borders
from sensorgen.solvers.contact.contact import Faces
from sensorgen.solvers.contact.mesh import TriangleMesh, at_border

Run = tuple[int, int]
Sides = dict[Run, tuple[int, int]]

_CLOSED = 5e-3  # gaps less than this share of a side are none [-]
_BETWEEN = 0.3  # and less than this share where both ends of the side touch [-]
_ONE = 0.25  # points that touch and are nearer than this share of a side become one [-]
_PAST = 0.1  # how far past its ends a side is still touched [-]
_CORNER = 0.1  # sine of the angle by which a face turns at a corner, at least [-]
_AGAINST = -0.3  # faces whose normals' product is above this do not look at each other [-]
_ROUND = [0, 3, 1, 4, 2, 5]  # the nodes of a triangle, in turn


@dataclass(frozen=True)
class _Air:
    """The border of the air.

    Attributes
    ----------
    runs : (k, 2) array
        Points, the air to the right from the first to the second.
    mirror : (k,) array
        Whether it is one of the cell's ends.
    behind : (k,) array
        How deep a point that touches may lie behind [mm].
    places : (n, 2) array
        Of all points [mm].
    """

    runs: Whole
    mirror: Mask
    behind: Real
    places: Real

    @cached_property
    def points(self) -> Whole:
        return np.unique(self.runs)

    @cached_property
    def length(self) -> Real:
        return np.asarray(np.hypot(*(self.places[self.runs[:, 1]] - self.places[self.runs[:, 0]]).T))

    @cached_property
    def way(self) -> Real:
        """Unit vector along each run (k, 2)."""
        along = self.places[self.runs[:, 1]] - self.places[self.runs[:, 0]]
        return np.asarray(along / np.maximum(self.length, 1e-300)[:, None])

    @cached_property
    def own(self) -> Real:
        """Length of each run, infinite of a mirror (k,)."""
        return np.where(self.mirror, np.inf, self.length)

    @cached_property
    def at(self) -> Whole:
        """Runs that begin or end at each point, the last one again where another has more (n, most)."""
        point = np.searchsorted(self.points, self.runs.T.ravel())
        order = np.argsort(point, kind="stable")
        count = np.bincount(point)
        each = np.minimum(np.arange(count.max()), count[:, None] - 1) + (np.cumsum(count) - count)[:, None]
        return np.asarray((order % len(self.runs))[each])

    @cached_property
    def reach(self) -> Real:
        """Shortest run at each point (n,)."""
        return np.asarray(self.own[self.at].min(axis=1))

    def seen(self, instead: Whole) -> "_Seen":
        """Where points lie beside runs, points replaced by others."""
        a, b = self.places[instead[self.runs]].transpose(1, 0, 2)
        here, room = self.places[instead[self.points]], _PAST * np.hypot(*(b - a).T)[:, None]
        spans = np.column_stack([np.minimum(a, b) - room, np.maximum(a, b) + room])
        around = np.flatnonzero(np.isfinite(self.reach))
        reach = self.reach[around, None]
        row, run = STRtree(box(*spans.T)).query(box(*(here[around] - reach).T, *(here[around] + reach).T))
        row = around[row]
        against = (self.way[self.at[row]] * self.way[run, None]).sum(axis=2).min(axis=1) < _AGAINST
        ends = (self.points[row, None] == self.runs[run]).any(axis=1)
        row, run = row[against & ~ends], run[against & ~ends]
        order = np.lexsort((run, row))
        row, run = row[order], run[order]
        u, away = (b - a)[run], here[row] - a[run]
        square = np.maximum((u**2).sum(axis=1), 1e-300)
        share = (away * u).sum(axis=1) / square
        ahead = (away[:, 0] * u[:, 1] - away[:, 1] * u[:, 0]) / np.sqrt(square)
        scale = np.minimum(self.reach[row], self.own[run])
        return _Seen(row, run, share, ahead, scale, np.minimum(self.behind[run], scale))


@dataclass(frozen=True)
class _Seen:
    """Points beside faces that look against those at the point, by point and run.

    Attributes
    ----------
    row, run : (k,) array
        Number of the point among those of the air's border, and of the run.
    share : (k,) array
        Where on the run (0 to 1).
    ahead, scale, behind : (k,) array
        How far before it; the shorter of the run and those at the point, which makes a gap large or small; and how deep
        the point may lie behind [mm].
    """

    row: Whole
    run: Whole
    share: Real
    ahead: Real
    scale: Real
    behind: Real

    def near(self, limit: Real | float) -> Mask:
        """Mask of gaps that are none: less than a share of the scale, and not so deep that it is another side."""
        return np.asarray((self.ahead < limit * self.scale) & (self.ahead > -self.behind))


def closed(edges: Sides, air: int, places: Real, faces: Faces) -> Sides:
    """Edges (node, node), with the regions to their left and right, whose gaps of air are closed where faces touch.

    Points that touch a mirror are moved onto it in ``places`` [mm].
    """
    depth = dict(zip(map(tuple, _halves(faces).tolist()), np.tile(faces.depth_m, 2) / M_PER_MM, strict=True))
    known = {run if sides[1] == air else run[::-1]: OUTSIDE in sides for run, sides in edges.items() if air in sides}
    if not known:
        return edges
    behind = np.array([depth.get(run, np.inf) for run in known])
    border = _Air(np.array([*known], int), np.array([*known.values()], bool), behind, places)
    instead, touched = _joined(border, _fixed(edges, air, faces))
    ways = dict(zip(map(tuple, border.runs.tolist()), _ways(border, instead, touched), strict=True))
    merged: Sides = {}
    for run, sides in edges.items():
        way = ways.get(run) or ways.get(run[::-1], [])[::-1] or instead[list(run)].tolist()
        for a, b in pairwise(way):
            add(merged, a, b, sides, air)
    return merged


def _halves(faces: Faces) -> Whole:
    """From end to middle of each face, and on to its other end, (2k, 2)."""
    return np.concatenate([faces.nodes[:, :2], faces.nodes[:, 1:]])


def _fixed(edges: Sides, air: int, faces: Faces) -> Mask:
    """Points that stay where they are: where a face turns by more than a tenth or ends, and ends of other edges."""
    drawn = faces.points_m
    is_fixed = np.zeros(len(drawn), bool)
    is_fixed[[k for run, sides in edges.items() if air not in sides or OUTSIDE in sides for k in run]] = True
    after = dict(_halves(faces).tolist())
    before = {b: a for a, b in after.items()}
    is_fixed[list(set(after) ^ set(before))] = True
    both = np.array([(before[k], k, after[k]) for k in after if k in before], int).reshape(-1, 3)
    u, v = drawn[both[:, 1]] - drawn[both[:, 0]], drawn[both[:, 2]] - drawn[both[:, 1]]
    is_fixed[both[:, 1]] |= abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) > _CORNER * np.hypot(*u.T) * np.hypot(*v.T)
    return is_fixed


def _joined(border: _Air, fixed: Mask) -> tuple[Whole, Mask]:
    """Point that stands for each, where two that touch are near each other, and mask of all that touch."""
    instead, touched = np.arange(len(border.places)), np.zeros(len(border.places), bool)
    seen = border.seen(instead)
    touches, share = seen.near(_CLOSED), seen.share
    touched[border.points[seen.row[touches & (share >= 0) & (share <= 1)]]] = True
    beside = np.flatnonzero(touches & (share > -_PAST) & (share < 1 + _PAST))
    ends = border.runs[seen.run[beside], (share[beside] > 0.5).astype(int)]
    pairs = np.column_stack([border.points[seen.row[beside]], ends])
    apart = np.hypot(*(border.places[pairs[:, 1]] - border.places[pairs[:, 0]]).T)
    one = np.flatnonzero(apart < _ONE * seen.scale[beside])
    used: set[int] = set()
    for pair in pairs[one[np.argsort(apart[one], kind="stable")]].tolist():
        if used.isdisjoint(pair):
            used.update(pair)
            stays, gone = sorted(pair, key=lambda p: (not fixed[p], p))
            instead[gone] = stays
            touched[pair] = True
    return instead, touched


def _ways(border: _Air, instead: Whole, touched: Mask) -> list[list[int]]:
    """Of each run, over the points that touch it; those that touch a mirror are put onto it."""
    seen = border.seen(instead)
    limit = np.where(touched[border.runs].all(axis=1) & ~border.mirror, _BETWEEN, _CLOSED)
    near = np.flatnonzero(seen.near(limit[seen.run]) & (seen.share > 0) & (seen.share < 1))
    near = near[np.lexsort((seen.share[near], seen.run[near]))]
    points = instead[border.points[seen.row[near]]]
    last = np.cumsum(np.bincount(seen.run[near], minlength=len(border.runs)))
    chains = []
    ends = instead[border.runs].tolist()
    for (a, b), mirror, over in zip(ends, border.mirror, np.split(points, last[:-1]), strict=True):
        if mirror:
            border.places[over, 0] = border.places[a, 0]
        chains.append([a, *(p for p in over.tolist() if p not in (a, b)), b])
    return chains


def deformed(cell: ContactCell, mesh: TriangleMesh, faces: Faces, u_m: Real) -> ContactCell:
    """The cell at given displacements (2n) [m]; the sides of gaps become two straight pieces each."""
    places = (mesh.points_m + u_m.reshape(-1, 2)) / M_PER_MM
    sides_of = _edges(cell, mesh)
    if u_m.any():
        sides_of = closed(sides_of, cell.air, places, faces)
    edges, rounded = {}, [*map(tuple, np.round(places, 9).tolist())]
    for (a, b), sides in sides_of.items():
        p, q = rounded[a], rounded[b]
        if sides[0] != sides[1] and p != q:
            edges[(p, q) if p < q else (q, p)] = sides if p < q else sides[::-1]
    return replace(cell, edges=edges, right_mm=float(np.round(places[mesh.points_m[:, 0].argmax(), 0], 9)))


def misfit(cell: ContactCell, mesh: TriangleMesh, u_m: Real) -> float:
    """Largest change of a solid's area by what was closed, over that area [-]; ``cell`` has the closed outlines."""
    places = (mesh.points_m + u_m.reshape(-1, 2)) / M_PER_MM
    x, y = places[mesh.outer[:, _ROUND]].transpose(2, 0, 1)
    areas = (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1) / 2
    pressed = np.bincount(mesh.region, areas, len(cell.regions) + 1)
    outlined = np.zeros(len(pressed))
    for (a, b), sides in cell.edges.items():
        half = (a[0] * b[1] - a[1] * b[0]) / 2
        outlined[sides[0]] += half
        outlined[sides[1]] -= half
    solid = pressed > 0
    return float(np.abs(outlined[solid] / pressed[solid] - 1).max())


def _edges(cell: ContactCell, mesh: TriangleMesh) -> Sides:
    """Sides between different regions: (node, node) to the regions on their left and right; halved but at walls."""
    sides_of: Sides = {}
    air, x, middles = cell.air, mesh.points_m[:, 0], mesh.rim[:, 2]
    walls = set(middles[np.isin(x[middles], (x.min(), x.max()))].tolist())  # middles of sides at the cell's ends
    of_side, region = mesh.outer[:, 3:], mesh.region
    count, total = np.bincount(of_side.ravel()), np.bincount(of_side.ravel(), np.repeat(region, 3))
    differ = (count[of_side] == 1) | (total[of_side] != 2 * region[:, None])
    for k in range(3):
        ends = mesh.outer[differ[:, k]][:, [k, k + 3, (k + 1) % 3]].tolist()
        for (a, m, b), own in zip(ends, region[differ[:, k]].tolist(), strict=True):
            for p, q in ((a, b),) if m in walls else ((a, m), (m, b)):
                add(sides_of, p, q, (own, OUTSIDE))
    for p, q in mesh.outline[np.tile(~at_border(mesh), 2)].tolist():
        add(sides_of, p, q, (OUTSIDE, air))
    nodes = {tuple(place): k for k, place in enumerate(np.round(mesh.points_m / M_PER_MM, 9).tolist())}
    for (a, b), sides in cell.edges.items():
        if air != OUTSIDE and set(sides) == {air, OUTSIDE}:
            add(sides_of, nodes[a], nodes[b], sides)
    return borders(sides_of)
