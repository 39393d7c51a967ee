"""What bricks stand on and run into: their top, and the faces on both sides of each gap."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from sensorgen.models._press.brick_element import BrickMesh, values
from sensorgen.models._press.contact import Pairs

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_SHAPE = np.einsum("ai,bj->abij", values(_POINTS), values(_POINTS)).reshape(9, 9)  # (points, nodes) of a face
_SHUT, _OPEN = 0.25, 0.5  # of a gap's width: below and above, its faces' nodes are opposite each other, or as they are
_THIN = 0.1  # of a gap's width: its air is squeezed evenly
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


def _bulged(gap: Real, nodes: Whole, least: float) -> Real:
    """Gaps at the nine nodes of faces (k, 9), raised where the parabolas through them would dip below a least one.

    Coefficients of Bernstein's polynomials bound a parabola: all are held above. Faces share nodes.
    """

    def shared(values: Real) -> Real:
        highest = np.zeros(nodes.max() + 1)
        np.maximum.at(highest, nodes, values.reshape(nodes.shape))
        return np.asarray(highest[nodes].reshape(-1, 3, 3))

    found = gap.reshape(-1, 3, 3).copy()
    ends = [0, 2]
    found[:, 1, ends] = np.maximum(found[:, 1, ends], found[:, ends][:, :, ends].sum(axis=1) / 4 + least / 2)
    found[:, ends, 1] = np.maximum(found[:, ends, 1], found[:, ends][:, :, ends].sum(axis=2) / 4 + least / 2)
    found = shared(found)
    edges, corners = (
        found[:, 1, ends].sum(axis=1) + found[:, ends, 1].sum(axis=1),
        found[:, ends][:, :, ends].sum((1, 2)),
    )
    found[:, 1, 1] = np.maximum(found[:, 1, 1], (least + edges - corners / 4) / 4)
    return found.reshape(-1, 9)


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

    def opened(self, moved: Real, share: float) -> tuple[Real, list[tuple[int, Whole, Whole]]]:
        """Displacements of all nodes (n, 3) with gaps held open, and the nodes on both sides of nearly shut ones.

        A gap that is thinner than a share of its width is opened so far, and those beside it until its parabola stays
        above. Where it is nearly shut, the lower face's nodes slide along it to those that they face, or the air
        between would be sheared until it folds.
        """
        found = moved.copy()
        nodes, axes, _ = self._sides
        columns = []
        for axis in np.unique(axes).tolist():
            far, near = nodes[axes == axis, :9], nodes[axes == axis, 9:]
            width = self.mesh.points_m[far, axis] - self.mesh.points_m[near, axis]
            drawn = 1 + (moved[far, axis] - moved[near, axis]) / width
            gap = _bulged(np.maximum(drawn, share), far, share)
            found[far, axis] += (gap - drawn) * width
            slide = np.clip((_OPEN - drawn) / (_OPEN - _SHUT), 0.0, 1.0)[..., None] * (moved[far] - moved[near])
            slide[..., axis] = 0.0
            found[near] = moved[near] + slide
            thin = (gap < _THIN).any(axis=1)
            columns.append((axis, near[thin].ravel(), far[thin].ravel()))
        return found, columns

    def slid_m(self, u_m: Real, which: NDArray[np.bool_]) -> Real:
        """How far each of some points has slid along its partner [m]."""
        nodes, axes, _ = self._sides
        moved = u_m.reshape(-1, 3)[nodes]
        along = np.einsum("qn,knd->kqd", np.concatenate([_SHAPE, -_SHAPE], axis=1), moved)
        along[np.arange(len(axes)), :, axes] = 0.0
        return np.asarray(np.linalg.norm(along, axis=2).ravel()[which])
