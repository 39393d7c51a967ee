"""What bricks stand on and run into: their top, the faces on both sides of each gap, and the linear systems' solver."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from sensorgen.models._press.brick_element import BrickMesh, values
from sensorgen.models._press.contact import Pairs
from sensorgen.models._press.load import Solver, by_lu

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_SHAPE = np.einsum("ai,bj->abij", values(_POINTS), values(_POINTS)).reshape(9, 9)  # (points, nodes) of a face
_MOST_TURNS = 30  # of conjugate gradients, before new factors are made
_ENOUGH = 1e-7  # residual over right side
_WEIGHT = np.outer(_WEIGHTS, _WEIGHTS).ravel() / 4
_FACE = {
    (axis, side): np.array([n for n, at in enumerate(product(range(3), repeat=3)) if at[axis] == 2 * side])
    for axis, side in product(range(3), range(2))
}


def top_load(mesh: BrickMesh) -> Real:
    """Forces of a unit pressure on the top, downwards, in its first direction and area [m2]."""
    edges = mesh.edges_m()
    on_top = mesh.boxes[:, 2] == mesh.bricks.fill.shape[2] - 1
    share = edges[on_top, 0, None] * edges[on_top, 1, None] * (_WEIGHT @ _SHAPE)
    force = np.zeros(3 * len(mesh.points_m))
    np.add.at(force, 3 * mesh.nodes[on_top][:, _FACE[2, 1]] + 2, -share)
    return force


def facing(fill: Whole) -> list[tuple[int, Whole, Whole]]:
    """Boxes on both sides of each gap: along which axis, and which boxes (k, 3) lie below and above it."""
    found = []
    for axis in range(3):
        runs = np.moveaxis(fill, axis, -1)
        pairs = []
        for place in np.ndindex(*runs.shape[:2]):
            solid = np.flatnonzero(runs[place])
            pairs += [(*place, a, b) for a, b in pairwise(solid.tolist()) if b - a > 1]
        rows = np.array(pairs, np.int64).reshape(-1, 4)
        lower, upper = (np.insert(rows[:, :2], axis, rows[:, k], axis=1) for k in (2, 3))
        found.append((axis, lower, upper))
    return found


@dataclass(frozen=True)
class BrickFaces:
    """Faces on both sides of gaps, each opposite its partner as drawn: they may slide by less than their own size."""

    mesh: BrickMesh

    def project(self, places_m: Real, penalty_pa: float, kept: Pairs | None = None) -> Pairs:  # noqa: ARG002 - as in 2D
        """The same partners at all places."""
        k = penalty_pa * self._pairs.stiffness_pa
        p = self._pairs
        return Pairs(p.gap, p.slip, k, p.length_m, p.point, p.sticks)

    @cached_property
    def _sides(self) -> tuple[Whole, Whole, Real]:
        """Nodes of each pair of faces (k, 18), the far ones first; along which axis; and their edges (k, 2) [m]."""
        mesh = self.mesh
        number = np.full(mesh.bricks.fill.shape, -1)
        number[tuple(mesh.boxes.T)] = np.arange(len(mesh.boxes))
        edges, nodes, axes, sides = mesh.edges_m(), [], [], []
        for axis, below, above in facing(mesh.bricks.fill):
            one, other = (number[tuple(boxes.T)] for boxes in (below, above))
            nodes.append(np.concatenate([mesh.nodes[other][:, _FACE[axis, 0]], mesh.nodes[one][:, _FACE[axis, 1]]], 1))
            axes.append(np.full(len(one), axis))
            sides.append(np.delete(edges[one], axis, axis=1))
        return np.concatenate(nodes), np.concatenate(axes), np.concatenate(sides)

    @cached_property
    def _pairs(self) -> Pairs:
        """Of unit penalty; the gap runs along an axis."""
        nodes, axes, edges = self._sides
        count, shape = 9 * len(nodes), (9 * len(nodes), 3 * len(self.mesh.points_m))
        weight = np.tile(np.concatenate([_SHAPE, -_SHAPE], axis=1), (len(nodes), 1))
        columns = np.repeat(3 * nodes + axes[:, None], 9, axis=0)
        gap = csr_matrix((weight.ravel(), (np.repeat(np.arange(count), 18), columns.ravel())), shape)
        side = np.repeat(edges.min(axis=1), 9)
        stiffness = np.repeat(edges.prod(axis=1), 9) / side * np.tile(_WEIGHT, len(nodes))
        return Pairs(gap, csr_matrix(shape), stiffness, side, np.arange(count), np.zeros(count, bool))

    def opened(self, moved: Real, share: float) -> Real:
        """Displacements of all nodes (n, 3), gaps that are thinner than a share of their width held open so far [m].

        There the lower face's nodes slide along it to those that they face, or the air beside would fold.
        """
        found = moved.copy()
        nodes, axes, _ = self._sides
        for far, near, axis in zip(nodes[:, :9], nodes[:, 9:], axes.tolist(), strict=True):
            width = self.mesh.points_m[far, axis] - self.mesh.points_m[near, axis]
            gap = width + found[far, axis] - found[near, axis]
            shut = gap < share * width
            found[far[shut], axis] += (share * width - gap)[shut]
            for across in {0, 1, 2} - {axis}:
                found[near[shut], across] = found[far[shut], across]
        return found

    def slid_m(self, u_m: Real, which: NDArray[np.bool_]) -> Real:
        """How far each of some points has slid along its partner [m]."""
        nodes, axes, _ = self._sides
        moved = u_m.reshape(-1, 3)[nodes]
        along = np.einsum("qn,knd->kqd", np.concatenate([_SHAPE, -_SHAPE], axis=1), moved)
        along[np.arange(len(axes)), :, axes] = 0.0
        return np.asarray(np.linalg.norm(along, axis=2).ravel()[which])


def cholesky() -> Solver:
    """A solver that keeps the order of elimination while the pattern stays; by LU where NGSolve is not installed."""
    try:
        import ngsolve as ng
    except ImportError:
        return by_lu
    return _Cholesky(ng)


@dataclass
class _Cholesky:
    """Conjugate gradients, preconditioned by the factors of an earlier system while these serve."""

    ng: Any
    factors: Any = None

    def __call__(self, stiffness: csr_matrix, right: Real) -> Real | None:
        """The step that a force makes, or None where a piece has nothing that holds it."""
        found = self._iterated(stiffness, right) if self.factors else None
        if found is None:
            self.factors = self._factored(stiffness)
            found = self._iterated(stiffness, right)
        return found

    def _factored(self, stiffness: csr_matrix) -> Any:
        rows = np.repeat(np.arange(stiffness.shape[0], dtype=np.int32), np.diff(stiffness.indptr))
        matrix = self.ng.la.SparseMatrixd.CreateFromCOO(
            rows, stiffness.indices.astype(np.int32), stiffness.data, *stiffness.shape
        )
        return matrix.Inverse(inverse="sparsecholesky")

    def _preconditioned(self, residual: Real) -> Real:
        force, step = (self.factors.CreateColVector() for _ in range(2))
        force.FV().NumPy()[:] = residual
        step.data = self.factors * force
        return np.array(step.FV().NumPy(), float)

    def _iterated(self, stiffness: csr_matrix, right: Real) -> Real | None:
        found, residual = np.zeros_like(right), right.copy()
        way = direction = self._preconditioned(residual)
        power = residual @ way
        for _ in range(_MOST_TURNS):
            if not (np.isfinite(power) and power > 0):
                return None
            pushed = stiffness @ direction
            bearing = direction @ pushed
            if not bearing > 0:
                return None
            share = power / bearing
            found, residual = found + share * direction, residual - share * pushed
            if np.abs(residual).max() < _ENOUGH * np.abs(right).max():
                return np.asarray(found)
            way = self._preconditioned(residual)
            before, power = power, residual @ way
            direction = way + power / before * direction
        return None
