"""Point-to-face contact along normals: between bodies, within one body, and with the mirrors at the ends of a cell.

A ray along the normal of each quadrature point of a face finds its partner: a place on a face that looks against it,
or a mirror. Both of two faces look, and each carries half of the penalty. Partner and normal are *frozen* while
Newton's method runs: the gap is then linear in the displacements. With partners that follow and the exact Hessian it
stalls. Faces are quadratic lines in two dimensions, biquadratic quadrilaterals in three.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.sparse import csr_matrix, vstack
from shapely import STRtree, box

from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.solvers.contact.bricks import BrickMesh
from sensorgen.solvers.contact.element import line_slopes, line_values
from sensorgen.solvers.contact.mesh import TriangleMesh, at_border

_STEEP = 0.3  # cosine of a face's slope, below which nothing rests on it [-]
_PASS = 0.5  # share of the penalty that each of two faces brings [-]
_IMAGE = 2.0  # a mirror's penalty over that of two faces: half the gap, and one of two bodies [-]
_THIN = 0.5  # of a body's thickness: deeper than this is rather its other side [-]
_OPPOSED = 0.1  # cosine between a ray and the face that it hits, below which it grazes [-]
_REACH = 2e-9  # how far past its ends, at -1 and 1, a face is still hit [-]
_BULGE = 0.1  # of its extent, by which a face may bulge beyond its corners [-]
_TURNS = 6  # of Newton's method for a place on a face, which is nearly flat

_LINE, _LINE_WEIGHTS = np.polynomial.legendre.leggauss(3)
_EACH = ("stiffness_pa", "length_m", "point", "sticks", "slid_m")


@dataclass(frozen=True)
class FacePairs:
    """Quadrature points of faces with a partner, frozen.

    Attributes
    ----------
    gap : sparse (k, n)
        Gap along the partner's normal, from the places of all nodes [m per m].
    slips : tuple of sparse (k, n)
        Displacement of the partner along each tangent of the point's face [m per m].
    stiffness_pa : (k,) array
        Contact force per penetration, in two dimensions per depth.
    length_m : (k,) array
        Shortest side of the face [m].
    point : (k,) array
        Number of the quadrature point.
    sticks : (k,) array
        Whether it touched before and sticks.
    slid_m : (k, d - 1) array
        Place of the partner along the tangents when they touched [m].
    """

    gap: csr_matrix
    slips: tuple[csr_matrix, ...]
    stiffness_pa: Real
    length_m: Real
    point: Whole
    sticks: Mask
    slid_m: Real

    def some(self, which: Mask) -> "FacePairs":
        """A part of them."""
        return FacePairs(
            self.gap[which], tuple(s[which] for s in self.slips), *(getattr(self, k)[which] for k in _EACH)
        )


def _joined(parts: Sequence[FacePairs]) -> FacePairs:
    slips = zip(*(p.slips for p in parts), strict=True)
    return FacePairs(
        vstack([p.gap for p in parts]).tocsr(),
        tuple(vstack(rows).tocsr() for rows in slips),
        *(np.concatenate([getattr(p, key) for p in parts]) for key in _EACH),
    )


@dataclass(frozen=True)
class Rays:
    """Lines along unit normals (k, d) from places (k, d), each with the unit tangents of its face (k, d - 1, d)."""

    here_m: Real
    normal: Real
    tangents: Real


@dataclass(frozen=True)
class Faces:
    """Faces of a mesh that may touch.

    Attributes
    ----------
    points_m : (n, d) array
        Places of all nodes as drawn [m].
    nodes : (k, 3^(d - 1)) array
        Of each face, from line to line; its normal points out of the body.
    mirrors : tuple of (int, int, int)
        Axis, direction and a node of each mirror.
    turned : bool
        Whether lines are sections of rings about the axis x = 0.
    """

    points_m: Real
    nodes: Whole
    mirrors: tuple[tuple[int, int, int], ...]
    turned: bool = False

    @property
    def _ways(self) -> int:
        """Directions along a face."""
        return len(self.points_m[0]) - 1

    @cached_property
    def _at(self) -> Real:
        """Quadrature points on a face (q, d - 1)."""
        return np.array(list(product(_LINE, repeat=self._ways)))

    @cached_property
    def shapes(self) -> Real:
        """Functions of a face at its quadrature points (q, f)."""
        return face_values(self._at)

    @cached_property
    def _edges_m(self) -> Real:
        """Lengths of each face along its directions (k, d - 1) [m]."""
        lattice = self.points_m[self.nodes].reshape(-1, *(3,) * self._ways, self._ways + 1)
        edges = [lattice[:, 2] - lattice[:, 0]] if self._ways == 1 else []
        edges = edges or [lattice[:, 2, 0] - lattice[:, 0, 0], lattice[:, 0, 2] - lattice[:, 0, 0]]
        return np.stack([np.sqrt((e**2).sum(axis=-1)) for e in edges], axis=1)

    @cached_property
    def _depth_m(self) -> Real:
        """Largest depth of each point in another body: a side's length, or less where its own is thin [m]."""
        depth = np.repeat(self._edges_m.min(axis=1), len(self._at))
        rays = self.rays(self.points_m)
        back, _, _, distance = hit(rays, self.points_m[self.nodes], np.zeros(len(depth)), inwards=True)
        depth[back] = np.minimum(depth[back], _THIN * distance)
        return depth

    @cached_property
    def depth_m(self) -> Real:
        """Largest depth of another body's points in each face's [m]."""
        return np.asarray(self._depth_m.reshape(len(self.nodes), len(self._at)).min(axis=1))

    def rays(self, places_m: Real) -> Rays:
        """From all quadrature points, face by face, at given places of the nodes (n, d)."""
        faces = places_m[self.nodes]
        tangents = np.matmul(face_slopes(self._at), faces[:, None]).reshape(-1, self._ways, self._ways + 1)
        normal = _normals(tangents)
        first = tangents[:, 0] / np.sqrt((tangents[:, :1] ** 2).sum(axis=-1))
        frame = [first] if self._ways == 1 else [first, np.cross(normal, first)]
        return Rays((self.shapes @ faces).reshape(-1, self._ways + 1), normal, np.stack(frame, axis=1))

    def project(self, places_m: Real, penalty_pa: float, stuck: FacePairs | None = None) -> FacePairs:
        """Find the partner of every point at given places of the nodes (n, d); those of ``kept`` stay as they are."""
        rays = self.rays(places_m)
        # Points whose partner is on another face
        faces = places_m[self.nodes]
        point, face, s, _ = hit(rays, faces, self._depth_m)
        own, at = np.divmod(point, len(self._at))
        weights = np.concatenate([face_values(s), -self.shapes[at]], axis=1)
        nodes = np.concatenate([self.nodes[face], self.nodes[own]], axis=1)
        _, looks = on_faces(s, faces[face])
        slips = tuple(self._rows(weights, nodes, rays.tangents[point, k]) for k in range(self._ways))
        met = self._pairs(self._rows(weights, nodes, -looks), slips, point, 0, _PASS * penalty_pa)
        parts = [met, *self._mirrored(places_m, rays, penalty_pa)]
        if stuck is None:
            return _joined(parts)
        return _joined([*(p.some(~np.isin(p.point, stuck.point)) for p in parts), stuck])

    def _mirrored(self, places_m: Real, rays: Rays, penalty_pa: float) -> Iterator[FacePairs]:
        """Points that look at a mirror; its image slips as they do."""
        for axis, direction, node in self.mirrors:
            looks = direction * rays.normal[:, axis]
            ahead = direction * (places_m[node, axis] - rays.here_m[:, axis])
            point = np.flatnonzero((looks > _OPPOSED) & (ahead > -self._depth_m))
            own, at = np.divmod(point, len(self._at))
            weights = np.concatenate([np.ones((len(point), 1)), -self.shapes[at]], axis=1)
            nodes = np.concatenate([np.full((len(point), 1), node), self.nodes[own]], axis=1)
            level = np.zeros((len(point), self._ways + 1))
            level[:, axis] = direction
            gap = self._rows(weights, nodes, level)
            still = (csr_matrix(gap.shape),) * self._ways
            yield self._pairs(gap, still, point, (1 + axis) * len(rays.here_m), _IMAGE * penalty_pa)

    def _rows(self, weights: Real, nodes: Whole, ways: Real) -> csr_matrix:
        """Weighted places of nodes (k, m) along a direction each (k, d), as sparse rows."""
        d = ways.shape[1]
        values, columns = weights[..., None] * ways[:, None], d * nodes[..., None] + np.arange(d)
        starts = np.arange(len(nodes) + 1) * (d * nodes.shape[1])
        weighted = csr_matrix((values.ravel(), columns.ravel(), starts), (len(nodes), self.points_m.size))
        weighted.eliminate_zeros()
        return weighted

    def _pairs(
        self, gap: csr_matrix, slips: tuple[csr_matrix, ...], point: Whole, first: int, penalty_pa: float
    ) -> FacePairs:
        own, at = np.divmod(point, len(self._at))
        edges, length = self._edges_m[own], self._edges_m[own].min(axis=1)
        weights = np.array([np.prod(w) for w in product(_LINE_WEIGHTS / 2, repeat=self._ways)])
        stiffness = penalty_pa * weights[at] * edges.prod(axis=1) / length
        if self.turned:
            stiffness *= 2 * np.pi * (self.shapes @ self.points_m[self.nodes, 0][..., None])[own, at, 0]
        still = np.zeros((len(point), self._ways))
        return FacePairs(gap, slips, stiffness, length, first + point, np.zeros(len(point), bool), still)

    def crossed(self, places_m: Real, outline: Whole, share: float) -> bool:
        """Test whether a face is inside two bodies, or beyond a mirror, deeper than a share of its side; in a plane.

        ``outline`` (k, 2) are the straight pieces of all bodies' outlines, anticlockwise.
        """
        rays = self.rays(places_m)
        inside = rays.here_m - (share * self._depth_m)[:, None] * rays.normal
        beyond = [
            (looks * rays.normal[:, a] > 0) & (looks * (places_m[n, a] - inside[:, a]) < 0)
            for a, looks, n in self.mirrors
        ]
        around = winding_number(inside, *places_m[outline].transpose(1, 0, 2))
        return bool(np.any(beyond) or (around > 1).any())


def faces_of(mesh: TriangleMesh) -> Faces:
    """Sides of triangles with nothing behind them, those on the straight border of the cell left out."""
    x = mesh.points_m[:, 0]
    mirrors = ((0, -1, int(x.argmin())), (0, 1, int(x.argmax())))
    return Faces(mesh.points_m, mesh.rim[~at_border(mesh)][:, [0, 2, 1]], mirrors, mesh.turned)


def brick_faces_of(mesh: BrickMesh) -> Faces:
    """Faces of solid boxes towards air, and the mirrors that the solid reaches."""
    solid, found = np.pad(mesh.bricks.fill > 0, 1, constant_values=True), []
    lattice = mesh.nodes.reshape(-1, 3, 3, 3)
    for axis, side in product(range(3), range(2)):
        beside = mesh.boxes + 1
        beside[:, axis] += 2 * side - 1
        faces = lattice[~solid[tuple(beside.T)]].take(2 * side, axis + 1)
        outwards = (axis == 1) != (side == 1)  # along the second and third of x, y, z but the axis: x, -y and z
        found.append((faces if outwards else faces.transpose(0, 2, 1)).reshape(-1, 9))
    mirrors = [
        (axis, direction, int((direction * mesh.points_m[:, axis]).argmax()))
        for axis, direction in product(range(2), (-1, 1))
    ]
    spans = mesh.bricks.spans_m()
    reached = [(a, s, n) for a, s, n in mirrors if mesh.points_m[n, a] in spans[a]]
    return Faces(mesh.points_m, np.concatenate(found), tuple(reached))


def carrying(pairs: FacePairs, loose: Mask) -> tuple[FacePairs, Real]:
    """The pairs between a loose piece above and a supported one below, and the gap's change per fall [-].

    ``loose`` says it of each node.
    """
    d = pairs.gap.shape[1] // len(loose)
    share = np.asarray(pairs.gap[:, d - 1 :: d] @ loose.astype(float))
    return pairs.some(share > _STEEP), share[share > _STEEP]


def face_values(s: Real) -> Real:
    """Functions of a face at places (..., d - 1), each from -1 to 1: (..., f)."""
    return _products([line_values(c) for c in np.moveaxis(s, -1, 0)])


def face_slopes(s: Real) -> Real:
    """Their derivatives (..., d - 1, f)."""
    lines = np.moveaxis(s, -1, 0)
    slopes = [[(line_values, line_slopes)[int(a == b)](c) for b, c in enumerate(lines)] for a in range(len(lines))]
    return np.stack([_products(factors) for factors in slopes], axis=-2)


def _products(factors: list[Real]) -> Real:
    product = factors[0]
    for other in factors[1:]:
        product = (product[..., :, None] * other[..., None, :]).reshape(
            *product.shape[:-1], product.shape[-1] * other.shape[-1]
        )
    return product


def _normals(tangents: Real) -> Real:
    """Unit normals from tangents (k, d - 1, d)."""
    normals = tangents[:, 0, ::-1] * [1.0, -1.0] if tangents.shape[1] == 1 else np.cross(tangents[:, 0], tangents[:, 1])
    return np.asarray(normals / np.sqrt((normals**2).sum(axis=1))[:, None])


def on_faces(s: Real, faces: Real) -> tuple[Real, Real]:
    """Places (k, d) and unit normals at coordinates (k, d - 1) of faces (k, f, d)."""
    return np.matmul(face_values(s)[:, None], faces)[:, 0], _normals(np.matmul(face_slopes(s), faces))


def hit(rays: Rays, faces: Real, depth_m: Real, *, inwards: bool = False) -> tuple[Whole, Whole, Real, Real]:
    """For each ray the nearest face that looks against it, ahead or less than a depth behind.

    Parameters
    ----------
    rays : Rays
        k of them.
    faces : (m, f, d) array
        Places of their nodes [m].
    depth_m : (k,) array
        Of each ray [m].
    inwards : bool
        Rays run against their normal, to faces from behind.

    Returns
    -------
    (rays, faces, (h, d - 1) array, (h,) array)
        Which rays hit, what, where on it, and how far away [m].
    """
    point, face = _candidates(rays, faces)
    relative = faces[face] - rays.here_m[point, None]
    level = np.matmul(rays.tangents[point], relative.transpose(0, 2, 1))  # of the nodes, along the tangents
    s = np.zeros(level.shape[:2])
    for _ in range(_TURNS):
        off, slope = (level * face_values(s)[:, None]).sum(axis=-1), np.matmul(level, face_slopes(s).transpose(0, 2, 1))
        s = np.clip(s - _divided(off, slope), -2.0, 2.0)
    inside = (np.abs(s) <= 1 + _REACH).all(axis=1)
    s = np.clip(s, -1.0, 1.0)
    place, looks = on_faces(s, relative)
    normal = rays.normal[point]
    distance = (-1 if inwards else 1) * (place * normal).sum(axis=1)
    good = np.flatnonzero(inside & (distance > -depth_m[point]) & ((looks * normal).sum(axis=1) < -_OPPOSED))
    good = good[np.lexsort((face[good], np.abs(distance[good])))]
    found, first = np.unique(point[good], return_index=True)
    good = good[first]
    return found, face[good], s[good], distance[good]


def _candidates(rays: Rays, faces: Real) -> tuple[Whole, Whole]:
    """Pairs of a ray and a face that looks against it and has it between its corners."""
    ways = rays.tangents.shape[1]
    corners = faces.reshape(-1, *(3,) * ways, ways + 1)[(slice(None), *(slice(None, None, 2),) * ways)]
    corners = corners.reshape(len(faces), 2**ways, ways + 1)
    ray, face = _boxed(rays, corners)
    _, looks = on_faces(np.zeros((len(faces), ways)), faces)
    against = np.einsum("kd,kd->k", rays.normal[ray], looks[face]) < 0
    ray, face = ray[against], face[against]
    for k in range(ways):
        way = rays.tangents[:, k]
        across = np.einsum("kcd,kd->ck", corners[face], way[ray]) - np.einsum("kd,kd->k", way, rays.here_m)[ray]
        low, high = across.min(axis=0), across.max(axis=0)
        room = _BULGE * (high - low)
        between = (low <= room) & (high >= -room)
        ray, face = ray[between], face[between]
    return ray, face


def _boxed(rays: Rays, corners: Real) -> tuple[Whole, Whole]:
    """Pairs of a ray and a face (m, c, d) whose boxes along the first two axes meet.

    A ray's box is that of its line, to both sides, within the box of all faces.
    """
    low, high = corners.min(axis=1), corners.max(axis=1)
    room = _BULGE * (high - low).max(axis=1, keepdims=True)
    low, high = low - room, high + room
    way = np.where(rays.normal == 0, 1e-300, rays.normal)
    with np.errstate(over="ignore"):
        ends = (
            np.array([low.min(axis=0, initial=0), high.max(axis=0, initial=0)])[:, None] - rays.here_m
        ) / way  # (2, k, d)
    begin, end = ends.min(axis=0).max(axis=1, keepdims=True), ends.max(axis=0).min(axis=1, keepdims=True)
    crosses = np.flatnonzero(begin[:, 0] <= end[:, 0])
    line = rays.here_m[crosses] + np.array([begin[crosses], end[crosses]]) * rays.normal[crosses]
    spans = np.concatenate([line.min(axis=0)[:, :2], line.max(axis=0)[:, :2]], axis=1)
    ray, face = STRtree(box(*low[:, :2].T, *high[:, :2].T)).query(box(*spans.T))
    return crosses[ray], face


def _divided(right: Real, matrix: Real) -> Real:
    """Solutions of one or two equations (k, n) by Cramer's rule."""
    if right.shape[1] == 1:
        return right / np.where(matrix[..., 0] == 0, np.inf, matrix[..., 0])
    (a, b), (c, d) = matrix.transpose(1, 2, 0)
    x, y = right.T
    whole = np.where(a * d == b * c, np.inf, a * d - b * c)
    return np.column_stack([(x * d - b * y) / whole, (a * y - x * c) / whole])


def winding_number(here: Real, starts: Real, ends: Real) -> Whole:
    """Number of times that closed outlines of straight pieces (m, 2) run anticlockwise around points (k, 2)."""
    order = np.argsort(here[:, 0], kind="stable")
    low, high = np.sort([starts[:, 0], ends[:, 0]], axis=0)
    first, last = (np.searchsorted(here[order, 0], edge) for edge in (low, high))
    piece = np.repeat(np.arange(len(starts)), last - first)  # with each point that is level with it along x
    point = order[np.arange(len(piece)) + np.repeat(last - np.cumsum(last - first), last - first)]
    (x, y), (x0, y0), (x1, y1) = here[point].T, starts[piece].T, ends[piece].T
    above = y0 + (x - x0) * (y1 - y0) / (x1 - x0) > y
    return np.bincount(point, np.where(x1 < x0, 1, -1) * above, len(here)).astype(int)
