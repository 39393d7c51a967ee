"""Gaps between faces, along their normals: between solids, within one, and to the mirrors at both ends of the cell.

From each quadrature point of a face a ray along its normal finds a partner: a place on a face that looks against it,
or a mirror. Both of two faces look, and each carries half. Partner and normal are *frozen* while Newton's method runs:
the gap is then linear in the displacements. Following them live, with the exact Hessian, stalls.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, vstack

from sensorgen.solvers.contact import rays
from sensorgen.solvers.contact.mesh import Mesh, at_border

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
Mask = NDArray[np.bool_]

_STEEP = 0.3  # cosine of a face's slope, below which nothing rests on it [-]
_PASS = 0.5  # share of the penalty that each of two faces brings [-]
_IMAGE = 2.0  # a mirror's penalty over that of two faces: half the gap, and one of two bodies [-]
_THIN = 0.5  # of a body's thickness: deeper than this is rather its other side [-]
_EACH = ("stiffness_pa", "length_m", "point", "sticks", "slid_m")


@dataclass(frozen=True)
class Pairs:
    """Quadrature points of faces that have a partner, frozen.

    Attributes
    ----------
    gap, slip : sparse (k, n)
        Gap along the partner's normal, and how far the partner has moved sideways, from the places of all nodes
        [m per m].
    stiffness_pa : (k,) array
        Penalty times the length that each point stands for [Pa].
    length_m : (k,) array
        Length of the side that it is on [m].
    point : (k,) array
        Which quadrature point it is.
    sticks : (k,) array
        Whether it touched before, and holds fast.
    slid_m : (k,) array
        How far the partner had moved sideways when they touched [m].
    """

    gap: csr_matrix
    slip: csr_matrix
    stiffness_pa: Real
    length_m: Real
    point: Whole
    sticks: Mask
    slid_m: Real


@dataclass(frozen=True)
class Faces:
    """Sides of a mesh that may touch, (k, 3) nodes each."""

    mesh: Mesh
    sides: Whole

    @property
    def halves(self) -> Whole:
        """From end to middle and on to the other end, (2k, 2)."""
        return np.concatenate([self.sides[:, [0, 2]], self.sides[:, [2, 1]]])

    @cached_property
    def _length(self) -> Real:
        ends = self.mesh.points_m[self.sides[:, 1]] - self.mesh.points_m[self.sides[:, 0]]
        return np.asarray(np.hypot(*ends.T))

    @cached_property
    def _depth(self) -> Real:
        """How deep each point may be in another solid: a side's length, or less where its own is thin [m]."""
        found = np.repeat(self._length, len(rays.POINTS))
        here, along = self._rays(self.mesh.points_m)
        back, side, s = rays.hit(here, -along, self.mesh.points_m[self.sides][:, [1, 0, 2]], np.zeros(len(here)))
        place, _ = rays.at(1 - s, self.mesh.points_m[self.sides[side]])
        found[back] = np.minimum(found[back], _THIN * np.hypot(*(place - here[back]).T))
        return found

    @cached_property
    def depth_m(self) -> Real:
        """How deep another solid's points may be in each side's [m]."""
        return np.asarray(self._depth.reshape(-1, len(rays.POINTS)).min(axis=1))

    def _rays(self, places_m: Real) -> tuple[Real, Real]:
        sides = np.repeat(places_m[self.sides], len(rays.POINTS), axis=0)
        return rays.at(np.tile(rays.POINTS, len(self.sides)), sides)

    def project(self, places_m: Real, penalty_pa: float, kept: Pairs | None = None) -> Pairs:
        """Find the partner of every point at given places of the nodes (n, 2); those of ``kept`` stay as they are."""
        here, along = self._rays(places_m)
        made = [self._met(places_m, here, along, penalty_pa), self._mirrored(places_m, here, along, penalty_pa)]
        if kept is None:
            return _joined(made)
        return _joined([*(some(p, ~np.isin(p.point, kept.point)) for p in made), kept])

    def crossed(self, places_m: Real, share: float) -> bool:
        """Whether a face is in two solids at once, or beyond a mirror, deeper than a share of its side."""
        here, along = self._rays(places_m)
        looks = rays.outwards(along)
        inside = here - (share * self._depth)[:, None] * looks
        x = self.mesh.points_m[:, 0]
        ends = places_m[np.where(looks[:, 0] > 0, x.argmax(), x.argmin()), 0]
        beyond = (ends - inside[:, 0]) * looks[:, 0] < 0
        a, b, middle = places_m[self.mesh.rim].transpose(1, 0, 2)
        found = rays.turns(inside, np.concatenate([a, middle]), np.concatenate([middle, b]))
        return bool((beyond | (found > 1)).any())

    def _met(self, places_m: Real, here: Real, along: Real, penalty_pa: float) -> Pairs:
        """Points whose partner is on another side."""
        point, side, s = rays.hit(here, along, places_m[self.sides], self._depth)
        _, way = rays.at(s, places_m[self.sides[side]])
        own = point // len(rays.POINTS)
        below = rays.shapes(rays.POINTS)[point % len(rays.POINTS)]
        weights = np.concatenate([rays.shapes(s), -below], axis=1)
        nodes = np.concatenate([self.sides[side], self.sides[own]], axis=1)
        gap, slip = (self._rows(weights, nodes, v) for v in (-rays.outwards(way), along[point]))
        return self._pairs(gap, slip, point, _PASS * penalty_pa)

    def _mirrored(self, places_m: Real, here: Real, along: Real, penalty_pa: float) -> Pairs:
        """Points that look at a mirror at one of the cell's ends; its image slips as they do."""
        x = self.mesh.points_m[:, 0]
        ends = np.array([x.argmin(), x.argmax()])
        looks = rays.outwards(along)[:, 0]
        end = ends[(looks > 0).astype(int)]
        ahead = (places_m[end, 0] - here[:, 0]) * np.sign(looks)
        point = np.flatnonzero((abs(looks) > rays.OPPOSED) & (ahead > -self._depth))
        own = point // len(rays.POINTS)
        below = rays.shapes(rays.POINTS)[point % len(rays.POINTS)]
        weights = np.concatenate([np.ones((len(point), 1)), -below], axis=1)
        nodes = np.concatenate([end[point, None], self.sides[own]], axis=1)
        level = np.stack([np.sign(looks[point]), np.zeros(len(point))], axis=1)
        gap = self._rows(weights, nodes, level)
        return self._pairs(gap, 0 * gap, point, _IMAGE * penalty_pa, len(here))

    def _rows(self, weights: Real, nodes: Whole, ways: Real) -> csr_matrix:
        """Weighted places of nodes (k, m) along a direction each (k, 2), as sparse rows."""
        values = weights[..., None] * ways[:, None]
        columns = 2 * nodes[..., None] + np.arange(2)
        starts = np.arange(len(nodes) + 1) * (2 * nodes.shape[1])
        return csr_matrix((values.ravel(), columns.ravel(), starts), (len(nodes), 2 * len(self.mesh.points_m)))

    def _pairs(self, gap: csr_matrix, slip: csr_matrix, point: Whole, penalty_pa: float, first: int = 0) -> Pairs:
        weight = penalty_pa * rays.WEIGHTS[point % len(rays.POINTS)]
        length = self._length[point // len(rays.POINTS)]
        return Pairs(gap, slip, weight, length, first + point, np.zeros(len(point), bool), np.zeros(len(point)))


def faces_of(mesh: Mesh) -> Faces:
    """The faces of a mesh, its lowest and highest level and its left and right side left out."""
    return Faces(mesh, mesh.rim[~at_border(mesh)])


def _joined(parts: list[Pairs]) -> Pairs:
    gap, slip = (vstack([getattr(p, key) for p in parts]).tocsr() for key in ("gap", "slip"))
    return Pairs(gap, slip, *(np.concatenate([getattr(p, key) for p in parts]) for key in _EACH))


def some(pairs: Pairs, which: Mask) -> Pairs:
    """A part of them."""
    return Pairs(pairs.gap[which], pairs.slip[which], *(getattr(pairs, key)[which] for key in _EACH))


def carrying(pairs: Pairs, loose: Mask, dimension: int) -> tuple[Pairs, Real]:
    """The pairs between a loose piece above and one below that is held, and by how much a gap shuts as it falls [-].

    ``loose`` says it of each node.
    """
    share = np.asarray(pairs.gap[:, dimension - 1 :: dimension] @ loose.astype(float))
    return some(pairs, share > _STEEP), share[share > _STEEP]
