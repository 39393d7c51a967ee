"""Bounds of the capacitance of a cell's outlines by quadratic triangles.

Any admissible potential bounds it from above (Dirichlet); any divergence-free flux from below
(Thomson). In the plane such a flux is the curl of a stream function, which turns the lower bound into the same problem
with 1/eps, its values given on the sides of the cell in place of the electrodes. Around an axis (Stokes) the stream
function psi = r phi has the energy (phi / r e_r + grad phi)^2 r / (2 pi eps), and phi is the unknown.

Wedges of air that end in a point, thinner than their sides are long, are cut off and triangulated here: a mesher would
make triangles as small as the air is thin, and quadratic ones across it are as accurate.

While no gap closes, the deformation carries the mesh along: one serves for all loads. Where a gap closes from its tip,
faces slide along each other, and triangles of the air between them turn over by as much as their own area. With their
volumes held above 0, as a pulled-back permittivity needs them, the rise of tri with a film of 0.1 mm was 8.5 % off at
100 kPa and half of it at 1.1 MPa: such cells are meshed anew at each load.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from math import atan2, dist, pi

import numpy as np
import shapely
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.scene.scene import Point
from sensorgen.solvers.contact.cell import OUTSIDE, ContactCell, Edge
from sensorgen.solvers.contact.element import determinant, triangle_gradients, triangle_points, triangle_values
from sensorgen.solvers.contact.factors import solved_by_lu
from sensorgen.solvers.contact.mesh import Net, TriangleMesh, nearest, of_triangles, ringed, sharp_corners, triangulated
from sensorgen.solvers.contact.mesher import Unmeshed
from sensorgen.solvers.electrostatics.triangles import filled

Edges = Mapping[Edge, tuple[int, int]]

_ROUNDING = 1e-9
_HOLE = 1e-6  # area that a mesh may miss, as a share
_SHARP = 0.7  # a point of air with a smaller angle is a wedge [rad]
_THIN = 0.2  # of its area as drawn: a triangle that is pressed further is no good any more [-]
_THICK = 0.4  # a wedge ends where it is thicker than this share of the next pieces of its sides [-]


@dataclass(frozen=True)
class Wedge:
    """The sides of a wedge of air, both from its tip: air lies left of the first and right of the second."""

    first: tuple[Point, ...]
    second: tuple[Point, ...]


def capacitance(cell: ContactCell, mesh: TriangleMesh, permittivity: Mapping[str, float]) -> Interval:
    """Bounds of the capacitance of a cell per area of the cell as drawn [F/m2].

    Parameters
    ----------
    cell : ContactCell
        Mirrored, as drawn.
    mesh : TriangleMesh
        From :func:`meshed`, pressed or not.
    permittivity : mapping of str to float
        Relative permittivity by material, with "air" [-].

    Raises
    ------
    OutOfRange
        The electrodes touch.
    Unmeshed
        The bounds are in the wrong order, which no sound mesh can do.
    """
    terminal = np.array([r.terminal for r in cell.regions])[mesh.region - 1]
    ends = [np.isin(np.arange(len(mesh.points_m)), mesh.outer[terminal == end]) for end in ("bottom", "top")]
    if (ends[0] & ends[1]).any():
        raise OutOfRange("the electrodes touch: the capacitance grows without bound")
    # Dielectric carries field in a piece that touches both electrodes
    dielectric = terminal == ""
    middles = mesh.outer[dielectric, 3:]
    beside = coo_matrix((np.ones(middles.size), (middles.ravel(), middles[:, [1, 2, 0]].ravel())), (len(ends[0]),) * 2)
    _, piece = connected_components(beside)
    touched = [np.unique(piece[middles[end[middles].any(axis=1), 0]]) for end in ends]
    inside = np.flatnonzero(dielectric)[np.isin(piece[middles[:, 0]], np.intersect1d(touched[0], touched[1]))]
    eps = np.array([permittivity.get(r.material, np.nan) for r in cell.regions])[mesh.region[inside] - 1]
    x = mesh.points_m[:, 0]
    width = float(np.ptp(x))
    drawn_m = cell.width_mm() * M_PER_MM
    area = np.pi * drawn_m**2 if cell.turned else drawn_m
    sides = [abs(x - end) < _ROUNDING * width for end in (x.min(), x.max())]
    potentials, streams = _energies(mesh, inside)
    upper = _energy(mesh.outer[inside], potentials * eps[:, None, None], *ends) / area
    flux = width if cell.turned else 1.0  # psi of a phi that is 1 at the outer side
    lower = flux**2 / (_energy(mesh.outer[inside], streams / eps[:, None, None], *sides) * area)
    if not lower <= upper * (1 + _ROUNDING):
        raise Unmeshed(f"bounds in the wrong order, {lower} above {upper}")
    return Interval(lower, upper).times(EPS0_F_PER_M)


def _energies(mesh: TriangleMesh, inside: Whole) -> tuple[Real, Real]:
    """Quadratic forms (m, 6, 6) of some triangles: of potentials, and of stream functions."""
    at, weights = triangle_points()
    slopes, jacobians = triangle_gradients(at)[:, :6], mesh.jacobians_m[inside]
    inverse, volume = np.linalg.inv(jacobians), np.linalg.det(jacobians)
    if not mesh.turned:
        table = np.einsum("q,qna,qmb->abnm", weights, slopes, slopes).reshape(4, 36)
        metric = volume[:, None, None] * (inverse @ inverse.transpose(0, 2, 1))
        found = (metric.reshape(-1, 4) @ table).reshape(-1, 6, 6)
        return found, found
    gradients, weight = np.einsum("qnk,mki->mqin", slopes, inverse), volume[:, None] * weights
    values = triangle_values(at)[:, :6]
    r = mesh.points_m[mesh.outer[inside], 0] @ values.T
    streams = gradients.copy()
    streams[:, :, 0] += values / r[..., None]
    return _squares(gradients, 2 * np.pi * r * weight), _squares(streams, r / (2 * np.pi) * weight)


def _squares(fields: Real, weight: Real) -> Real:
    """Integrals (m, n, n) of products of fields (m, q, d, n)."""
    flat = fields.reshape(*fields.shape[:1], -1, fields.shape[-1])
    return np.asarray(
        np.matmul((flat * np.repeat(weight, fields.shape[2], axis=1)[..., None]).transpose(0, 2, 1), flat)
    )


def meshed(cell: ContactCell, coarse_mm: float, growth: float, count: int = 6) -> TriangleMesh:
    """Mesh everything but thin wedges of air, which are filled with triangles of their own.

    Parameters
    ----------
    cell : ContactCell
        Its outlines, pressed or not.
    coarse_mm, growth : float
        Largest triangle [mm], and by how much triangles grow per distance [-].
    count : int
        Of rings around corners.

    Raises
    ------
    Unmeshed
        The mesher gave up, or left a hole.
    """
    edges, room = cell.edges, _ROUNDING * cell.width_mm()
    thin = wedges(edges, cell.air) if cell.air != OUTSIDE else []
    cut = _without(thin, edges, cell.air)
    if any(not cell.left_mm - room <= x <= cell.right_mm + room for edge in edges for x, _ in edge):
        raise Unmeshed("the deformed outlines run through the mirrors")
    _refuse_crossings(np.array(list(cut)).reshape(-1, 2, 2))
    net = triangulated(cut, coarse_mm, growth, quick=True)
    new = [triangle for number, wedge in enumerate(thin, 1) for triangle in _filling(net, number, wedge)]
    corners = np.concatenate([net.corners, np.array(new, int).reshape(-1, 3)])
    _refuse_holes(net.points_m[corners], edges)
    region = np.concatenate([net.region, np.full(len(new), cell.air)])
    tips = [nearest(net.points_m, place) for place in sharp_corners(edges, cell.left_mm, cell.right_mm)]
    return of_triangles(*ringed(net.points_m, corners, region, tips, count), turned=cell.turned)


def _without(wedges: Sequence[Wedge], edges: Edges, air: int) -> dict[Edge, tuple[int, int]]:
    """Edges of a cell from which wedges are cut off: wedge k is region -k, and an edge parts it from other air."""
    cut = dict(edges)
    for number, wedge in enumerate(wedges, 1):
        for p, q in (*pairwise(wedge.first), *pairwise(wedge.second[::-1])):
            key, place = ((p, q), 0) if (p, q) in cut else ((q, p), 1)
            cut[key] = (-number, cut[key][1]) if place == 0 else (cut[key][0], -number)
        if wedge.first[-1] != wedge.second[-1]:
            cut[wedge.first[-1], wedge.second[-1]] = (-number, air)
    return cut


def _refuse_holes(placed_m: Real, edges: Edges) -> None:
    """Refuse triangles (m, 3, 2) of another area than the edges enclose, or one that is turned over."""
    drawn = sum(
        0.5 * (a[0] * b[1] - a[1] * b[0]) * ((left > 0) - (right > 0)) for (a, b), (left, right) in edges.items()
    )
    u, v = placed_m[:, 1] - placed_m[:, 0], placed_m[:, 2] - placed_m[:, 0]
    parts = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / M_PER_MM**2
    if parts.min() <= 0 or abs(parts.sum() / drawn - 1) > _HOLE:
        raise Unmeshed("the mesh has holes or folds")


def _refuse_crossings(edges: Real) -> None:
    """Edges (k, 2, 2) that cross each other would keep the mesher busy for ever, or end the process."""
    lines = shapely.linestrings(edges)
    near = edges[shapely.STRtree(lines).query(lines)]  # (2, pairs, 2, 2)
    (a, b), (c, d) = near.swapaxes(1, 2)
    if ((_side(a, b, c) * _side(a, b, d) < 0) & (_side(c, d, a) * _side(c, d, b) < 0)).any():
        raise Unmeshed("the deformed outlines run into each other")


def _side(a: Real, b: Real, p: Real) -> Real:
    """On which side of the lines through a and b the points p lie: their sign."""
    u, v = b - a, p - a
    turn = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    size = np.abs(u[..., 0] * v[..., 1]) + np.abs(u[..., 1] * v[..., 0])
    return np.asarray(np.where(np.abs(turn) > _ROUNDING * size, np.sign(turn), 0.0))


def _filling(net: Net, number: int, wedge: Wedge) -> list[tuple[int, int, int]]:
    """Triangles for a wedge, whose sides the mesher may have cut."""
    points, beside = net.points_m, defaultdict(list)
    for a, b in net.marked[-number]:
        beside[a].append(b)
        beside[b].append(a)
    tip, ahead = (nearest(points, p) for p in wedge.first[:2])
    if len(beside[tip]) != 2:
        raise Unmeshed("the mesh has lost the tip of a gap")
    ways = points[beside[tip]] - points[tip]
    ring = [tip, beside[tip][int((ways @ (points[ahead] - points[tip]) / np.hypot(*ways.T)).argmax())]]
    while ring[-1] != tip:
        ring.append(next(k for k in beside[ring[-1]] if k != ring[-2]))
    return filled(ring[:-1], points.tolist())


def _energy(triangles: Whole, local: Real, zero: Mask, one: Mask) -> float:
    """Least of the sum of quadratic forms (m, 6, 6) of functions that are 0 and 1 at given nodes [-]."""
    n = len(zero)
    rows, columns = np.repeat(triangles, 6, axis=1).ravel(), np.tile(triangles, (1, 6)).ravel()
    matrix = coo_matrix((local.ravel(), (rows, columns)), (n, n)).tocsr()
    v = one.astype(float)
    free = np.isin(np.arange(n), triangles) & ~zero & ~one
    v[free] = solved_by_lu(matrix[free][:, free], -(matrix @ v)[free])
    return float(v @ (matrix @ v))


def wedges(edges: Mapping[Edge, tuple[int, int]], air: int) -> list[Wedge]:
    """All wedges of a region of air."""
    ahead: dict[Point, list[Point]] = defaultdict(list)
    back: dict[Point, list[Point]] = defaultdict(list)
    for (p, q), (left, right) in edges.items():
        for a, b in ((p, q),) * (left == air) + ((q, p),) * (right == air):
            ahead[a].append(b)
            back[b].append(a)
    found: list[Wedge] = []
    used: set[Point] = set()
    points = np.array([*{p for edge in edges for p in edge}]).reshape(-1, 2)
    for tip in list(ahead):
        for out, into in product(ahead[tip], back[tip]):
            if _is_tip(tip, out, into, ahead) and not {out, into} & used and _is_free(tip, out, into, points):
                found.append(_walked([tip, out], [tip, into], ahead, back, points))
                used |= {*found[-1].first[1:], *found[-1].second[1:]}
    return found


def _walked(
    first: list[Point], second: list[Point], ahead: Mapping[Point, list[Point]], back: Mapping[Point, list[Point]],
    points: Real,
) -> Wedge:  # fmt: skip
    """Walk along both sides, where the way across is shorter, until the air is thick or both sides meet."""
    while first[-1] != second[-1] and ahead[first[-1]] and back[second[-1]]:
        on_first, on_second = ahead[first[-1]][0], back[second[-1]][0]
        if on_first == second[-1]:
            first.append(on_first)
            break
        thick = min(_off(first[-1], second[-1], on_second), _off(second[-1], first[-1], on_first))
        if thick > _THICK * min(dist(first[-1], on_first), dist(second[-1], on_second)):
            break
        shorter = dist(on_first, second[-1]) < dist(first[-1], on_second)
        side, ahead_on = (first, on_first) if shorter else (second, on_second)
        if not _is_free(first[-1], ahead_on, second[-1], points):  # the way across would cut a side
            break
        side.append(ahead_on)
    return Wedge(tuple(first), tuple(second))


def _is_tip(tip: Point, out: Point, into: Point, ahead: Mapping[Point, list[Point]]) -> bool:
    """Test whether air lies, sharp and undivided, between the edges to ``out`` and from ``into``."""
    angle = _turn(tip, out, into)
    return 0 < angle < _SHARP and not any(0 < _turn(tip, out, other) < angle for other in ahead[tip] if other != out)


def _is_free(a: Point, b: Point, c: Point, points: Real) -> bool:
    """Test whether a, b and c turn left, and no other of the points (n, 2) lies in their triangle or on its sides."""
    x, y = points.T
    inside = np.ones(len(points), bool)
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) >= 0
    return _area(a, b, c) > 0 and {a, b, c}.issuperset(map(tuple, points[inside].tolist()))


def _turn(tip: Point, a: Point, b: Point) -> float:
    """Angle from a to b around the tip, anticlockwise, from 0 to 2 pi."""
    angle = atan2(b[1] - tip[1], b[0] - tip[0]) - atan2(a[1] - tip[1], a[0] - tip[0])
    return angle % (2 * pi)


def _off(p: Point, a: Point, b: Point) -> float:
    """Distance of p from the line through a and b."""
    return abs((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / dist(a, b)


def _area(a: Point, b: Point, c: Point) -> float:
    """Twice that of a triangle, above 0 where it turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@dataclass(frozen=True)
class Carried:
    """Mesh of a field, of which the solids move as their own mesh does, and the air between them by Laplace's equation.

    Attributes
    ----------
    field : TriangleMesh
        Of solids and air, as drawn.
    solids : TriangleMesh
        That is pressed.
    cell : ContactCell
        Whose regions both have.
    """

    field: TriangleMesh
    solids: TriangleMesh
    cell: ContactCell

    def at(self, u_m: Real) -> TriangleMesh | None:
        """The mesh at displacements of the solids' nodes (2n) [m]; None where a triangle folds or is flattened."""
        moved = np.zeros((len(self.field.points_m), 2))
        moved[self._inside] = self._values @ u_m.reshape(-1, 2)
        if self._air.any():
            for axis in range(2):
                free = self._free[axis]
                known = np.where(free, 0.0, moved[:, axis])
                if axis == 0:  # air at a wall moves as the wall does
                    for wall in self._walls:
                        known[wall & ~self._inside] = moved[wall & self._inside, 0].mean()
                known[free] = solved_by_lu(self._laplace[free][:, free], -(self._laplace @ known)[free])
                moved[:, axis] = known
        corners, sides = self.field.outer[:, :3], self.field.outer[:, 3:]
        places = self.field.points_m + moved
        places[sides] = (places[corners] + places[np.roll(corners, -1, axis=1)]) / 2
        found = replace(self.field, points_m=places)
        kept = determinant(found.jacobians_m) > _THIN * determinant(self.field.jacobians_m)
        return found if kept.all() else None

    @cached_property
    def _air(self) -> Mask:
        """Mask of the triangles of air."""
        return np.asarray(self.field.region == self.cell.air)

    @cached_property
    def _inside(self) -> Mask:
        """Mask of the nodes that move with a solid: its corners."""
        found = np.zeros(len(self.field.points_m), bool)
        found[self.field.outer[~self._air, :3]] = True
        return found

    @cached_property
    def _values(self) -> csr_matrix:
        """Displacements of those nodes from those of the solids' nodes."""
        places, corners = self.field.points_m[self._inside], self.solids.points_m[self.solids.outer[:, :3]]
        _, triangle = shapely.STRtree(shapely.polygons(corners)).query_nearest(
            shapely.points(places), all_matches=False
        )
        first, *ends = corners[triangle].swapaxes(0, 1)
        at = np.linalg.solve(np.stack([end - first for end in ends], axis=-1), (places - first)[..., None])[..., 0]
        shares = triangle_values(at)[:, :6]
        rows = np.repeat(np.arange(len(places)), 6)
        columns = self.solids.outer[triangle].ravel()
        return coo_matrix((shares.ravel(), (rows, columns)), (len(places), len(self.solids.points_m))).tocsr()

    @cached_property
    def _walls(self) -> list[Mask]:
        x = self.field.points_m[:, 0]
        return [np.asarray(abs(x - end) < _ROUNDING * np.ptp(x)) for end in (x.min(), x.max())]

    @cached_property
    def _free(self) -> list[Mask]:
        """Corners of the air that no solid moves along x, where walls hold them too, and along the height."""
        air = np.zeros(len(self.field.points_m), bool)
        air[self.field.outer[self._air, :3]] = True
        air &= ~self._inside
        return [air & ~np.any(self._walls, axis=0), air]

    @cached_property
    def _laplace(self) -> csr_matrix:
        """Of linear triangles of the air, each as stiff as it is small."""
        corners: Whole = self.field.outer[self._air, :3]
        places, n = self.field.points_m[corners], len(self.field.points_m)
        edges = places[:, [2, 0, 1]] - places[:, [1, 2, 0]]  # against each corner
        local = edges @ edges.transpose(0, 2, 1) / determinant(self.field.jacobians_m[self._air])[:, None, None] ** 2
        rows, columns = np.repeat(corners, 3, axis=1).ravel(), np.tile(corners, (1, 3)).ravel()
        return coo_matrix((local.ravel(), (rows, columns)), (n, n)).tocsr()
