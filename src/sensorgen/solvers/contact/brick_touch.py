"""What bricks stand on and run into: their top, and the faces on both sides of each gap."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, vstack

from sensorgen.solvers.contact.brick_meet import Met, facing_points
from sensorgen.solvers.contact.bricks import BrickMesh
from sensorgen.solvers.contact.contact import Pairs
from sensorgen.solvers.contact.element import line_values

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(3)
_SHAPE = np.einsum("ai,bj->abij", line_values(_POINTS), line_values(_POINTS)).reshape(9, 9)  # (points, nodes) of a face
_SHUT, _OPEN = 0.25, 0.5  # of a gap's width: below and above, its faces' nodes are opposite each other, or as they are
_THIN = 0.1  # of a gap's width: its air is squeezed evenly
_WEIGHT = np.outer(_WEIGHTS, _WEIGHTS).ravel() / 4
_FACE = {
    (axis, side): np.array([n for n, at in enumerate(product(range(3), repeat=3)) if at[axis] == 2 * side])
    for axis, side in product(range(3), range(2))
}


def top_load(mesh: BrickMesh) -> Real:
    """Forces of a unit pressure on the top, downwards, in its first direction and area [m2]."""
    edges = mesh.edges_m
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


def _spread(slide: Real, faces: Whole) -> Real:
    """Slides of nodes (n, 3), those amid edges and faces (k, 9) that do not slide by the mean of their ends.

    Where the corner of a face slides alone, its parabola would turn back.
    """
    found, lattice = slide.copy(), faces.reshape(-1, 3, 3)
    ends = [0, 2]
    corners = lattice[:, ends][:, :, ends]
    between = (
        (lattice[:, 1, ends], lattice[:, ends].transpose(1, 0, 2)[..., ends]),
        (lattice[:, ends, 1], lattice[..., ends].transpose(2, 0, 1)[..., ends]),
        (lattice[:, 1, 1], corners.reshape(-1, 4).T),
    )
    for middle, around in between:
        still = (slide[middle] == 0).all(axis=-1)
        found[middle[still]] = slide[around].mean(axis=0)[still]
    return found


def _rows(weights: Real, nodes: Whole, axis: int, size: int) -> csr_matrix:
    """Rows (k, size) of weights of one component of nodes."""
    starts = np.arange(len(nodes) + 1) * nodes.shape[1]
    return csr_matrix((weights.ravel(), (3 * nodes + axis).ravel(), starts), (len(nodes), size))


def joined(parts: list[Pairs], size: int) -> Pairs:
    """Pairs of several kinds as one."""
    gap, slip = (vstack([csr_matrix((0, size)), *(getattr(p, k) for p in parts)]).tocsr() for k in ("gap", "slip"))
    stiff, long, which, held, slid = (
        np.concatenate([np.empty(0), *(getattr(p, k) for p in parts)])
        for k in ("stiffness_pa", "length_m", "point", "sticks", "slid_m")
    )
    return Pairs(gap, slip, stiff, long, which.astype(np.int64), held.astype(bool), slid)


@dataclass(frozen=True)
class BrickFaces:
    """Faces on both sides of gaps along each axis; ``sticks`` where what touches may hold fast."""

    mesh: BrickMesh
    sticks: bool = False

    def project(self, places_m: Real, penalty_pa: float, kept: Pairs | None = None) -> Pairs:
        """Find the partner of every point at given places of the nodes (n, 3); those of ``kept`` stay as they are."""
        nodes, axes, edges = self._sides
        known = kept.point if kept else np.empty(0, np.int64)
        made = [kept] if kept else []
        for axis in np.unique(axes).tolist():
            rows = np.flatnonzero(axes == axis)
            points = np.setdiff1d((9 * rows[:, None] + np.arange(9)).ravel(), known)
            met = facing_points(places_m, nodes[points // 9, 9:], _SHAPE[points % 9], nodes[rows, :9], axis)
            side = edges[points // 9].min(axis=1)
            area = edges[points // 9].prod(axis=1) * _WEIGHT[points % 9]
            made.append(self._made(met, points, penalty_pa * area / side, side))
        return joined(made, 3 * len(self.mesh.points_m))

    def _made(self, met: Met, points: Whole, stiffness: Real, side: Real) -> Pairs:
        """One row for each point that has met something; two where it may stick, one for each way that it may slip."""
        here = np.flatnonzero(met.found & (met.gap_m > -side))
        near = met.gap_m[here] < side[here]
        weights, nodes = met.weights[here], met.nodes[here]
        ways = [k for k in range(3) if k != met.axis]
        level = [np.where(near, met.slopes[here, k], 0.0) for k in range(2)]
        size = 3 * len(self.mesh.points_m)
        gap = _rows(weights, nodes, met.axis, size) - sum(
            (_rows(weights * m[:, None], nodes, way, size) for m, way in zip(level, ways, strict=True)),
            csr_matrix((len(here), size)),
        )
        gap.eliminate_zeros()
        slips = [_rows(weights * np.sqrt(2), nodes, way, size) for way in ways] if self.sticks else [0 * gap]
        n = len(slips)
        stiff, long, which = np.tile(stiffness[here] / n, n), np.tile(side[here], n), np.tile(points[here], n)
        both = vstack([gap] * n).tocsr(), vstack(slips).tocsr()
        return Pairs(*both, stiff, long, which, np.zeros(n * len(here), bool), np.zeros(n * len(here)))

    @cached_property
    def _sides(self) -> tuple[Whole, Whole, Real]:
        """Nodes of each pair of faces (k, 18), the far ones first; along which axis; and their edges (k, 2) [m]."""
        mesh = self.mesh
        number = np.full(mesh.bricks.fill.shape, -1)
        number[tuple(mesh.boxes.T)] = np.arange(len(mesh.boxes))
        edges, nodes, axes, sides = mesh.edges_m, [], [], []
        for axis, below, above in facing(mesh.bricks.fill):
            one, other = (number[tuple(boxes.T)] for boxes in (below, above))
            nodes.append(np.concatenate([mesh.nodes[other][:, _FACE[axis, 0]], mesh.nodes[one][:, _FACE[axis, 1]]], 1))
            axes.append(np.full(len(one), axis))
            sides.append(np.delete(edges[one], axis, axis=1))
        return np.concatenate(nodes), np.concatenate(axes), np.concatenate(sides)

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
            slide = np.clip((_OPEN - drawn) / (_OPEN - _SHUT), 0.0, 1.0)[..., None] * (moved[far] - moved[near])
            slide[..., axis] = 0.0
            last = np.argsort(-(drawn * width), axis=None)  # a node at a corner has two gaps: the thinner one counts
            found[far.ravel()[last], axis] += ((gap - drawn) * width).ravel()[last]
            slid = np.zeros_like(moved)
            slid[near.ravel()[last]] = slide.reshape(-1, 3)[last]
            found += _spread(slid, near)
            thin = (gap < _THIN).any(axis=1)
            columns.append((axis, near[thin].ravel(), far[thin].ravel()))
        return found, columns
