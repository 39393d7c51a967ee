"""Extension of the displacement of boxes into the air between them, without folds, so that the field has a map.

Air gaps that are nearly shut are kept open by a little and deform evenly between their two faces; elsewhere the air's
displacement is harmonic, by finite differences between neighbouring nodes, and bounded by that of its surroundings.
What the air does between the faces does not change the capacitance, as long as it does not fold.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from sensorgen.core.arrays import Real, Whole
from sensorgen.solvers.contact.bricks import BrickMesh
from sensorgen.solvers.contact.factors import solved_by_lu

_SHUT, _OPEN = 0.25, 0.5  # of a gap's width: below and above, its faces' nodes are opposite each other, or as they are
_THIN = 0.1  # of a gap's width: its air deforms evenly
_ROUNDING = 1e-9
_PLACES = np.array(list(product(range(3), repeat=3)))  # of a brick's 27 nodes
_SHARES = np.array([0.25, 0.5, 0.25])  # of a brick's width that belong to its three nodes
_ENDS = [0, 2]  # of three places along a line


@dataclass(frozen=True)
class AirMap:
    """All boxes of a cell, and the solid ones among them."""

    whole: BrickMesh
    solid: BrickMesh

    @cached_property
    def _gaps(self) -> list[tuple[int, Whole, Whole]]:
        """Along each axis with gaps, the nodes of the faces below and above each of them (k, 9)."""
        mesh, gaps = self.solid, []
        number = np.full(mesh.bricks.fill.shape, -1)
        number[tuple(mesh.boxes.T)] = np.arange(len(mesh.boxes))
        lattice = mesh.nodes.reshape(-1, 3, 3, 3)
        for axis, below, above in facing(mesh.bricks.fill):
            near, far = (
                lattice[number[tuple(boxes.T)]].take(end, axis + 1).reshape(-1, 9)
                for boxes, end in ((below, 2), (above, 0))
            )
            gaps += [(axis, near, far)] if len(near) else []
        return gaps

    def displacements_m(self, moved_m: Real, share: float) -> Real:
        """Displacements of all nodes (3n,) from those of the solid ones (n, 3) [m].

        A gap thinner than a share of its width is opened to it, and those beside it until its parabola stays above.
        Where it is nearly shut, the lower face's nodes slide along it to those that they face, or the air between
        would be sheared until it folds.
        """
        mesh, opened = self.whole, moved_m.copy()
        size = mesh.lattice.max(axis=0) + 1
        number = np.ravel_multi_index(tuple(self.solid.lattice.T), tuple(size))
        thin = []
        for axis, near, far in self._gaps:
            width = self.solid.points_m[far, axis] - self.solid.points_m[near, axis]
            drawn = 1 + (moved_m[far, axis] - moved_m[near, axis]) / width
            gap = _bulged(np.maximum(drawn, share), far, share)
            slide = np.clip((_OPEN - drawn) / (_OPEN - _SHUT), 0.0, 1.0)[..., None] * (moved_m[far] - moved_m[near])
            slide[..., axis] = 0.0
            last = np.argsort(-(drawn * width), axis=None)  # a node at a corner has two gaps: the thinner one counts
            opened[far.ravel()[last], axis] += ((gap - drawn) * width).ravel()[last]
            slid = np.zeros_like(moved_m)
            slid[near.ravel()[last]] = slide.reshape(-1, 3)[last]
            opened += _spread(slid, near)
            here = (gap < _THIN).any(axis=1)
            thin.append((axis, near[here].ravel(), far[here].ravel()))
        u = np.full((len(mesh.points_m), 3), np.nan)
        u[number] = opened
        for axis, near, far in thin:
            stride = int(np.prod(size[axis + 1 :]))
            for start, stop in zip(number[near].tolist(), number[far].tolist(), strict=True):
                nodes = np.arange(start, stop + 1, stride)
                at = (mesh.points_m[nodes, axis] - mesh.points_m[start, axis])[:, None]
                u[nodes] = u[start] + at / at[-1] * (u[stop] - u[start])
        if np.isnan(u).any():
            matrix = _differences(mesh)
            u = np.column_stack([_harmonic(mesh, matrix, u[:, axis], axis) for axis in range(3)])
        return u.ravel()


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
        below, above = (np.insert(rows[:, :2], axis, rows[:, k], axis=1) for k in (2, 3))
        found.append((axis, below, above))
    return found


def _bulged(gap: Real, nodes: Whole, least: float) -> Real:
    """Gaps at the nine nodes of faces (k, 9), raised where the parabolas through them would dip below a least one.

    Coefficients of Bernstein's polynomials bound a parabola: all are held above. Faces share nodes.
    """
    raised = gap.reshape(-1, 3, 3).copy()
    raised[:, 1, _ENDS] = np.maximum(raised[:, 1, _ENDS], raised[:, _ENDS][:, :, _ENDS].sum(axis=1) / 4 + least / 2)
    raised[:, _ENDS, 1] = np.maximum(raised[:, _ENDS, 1], raised[:, _ENDS][:, :, _ENDS].sum(axis=2) / 4 + least / 2)
    highest = np.zeros(nodes.max() + 1)
    np.maximum.at(highest, nodes, raised.reshape(nodes.shape))
    raised = highest[nodes].reshape(-1, 3, 3)
    edges = raised[:, 1, _ENDS].sum(axis=1) + raised[:, _ENDS, 1].sum(axis=1)
    corners = raised[:, _ENDS][:, :, _ENDS].sum((1, 2))
    raised[:, 1, 1] = np.maximum(raised[:, 1, 1], (least + edges - corners / 4) / 4)
    return raised.reshape(-1, 9)


def _spread(slide: Real, faces: Whole) -> Real:
    """Slides of nodes (n, 3), those amid edges and faces (k, 9) that do not slide by the mean of their ends.

    Where the corner of a face slides alone, its parabola would turn back.
    """
    slides, lattice = slide.copy(), faces.reshape(-1, 3, 3)
    corners = lattice[:, _ENDS][:, :, _ENDS]
    between = (
        (lattice[:, 1, _ENDS], lattice[:, _ENDS].transpose(1, 0, 2)[..., _ENDS]),
        (lattice[:, _ENDS, 1], lattice[..., _ENDS].transpose(2, 0, 1)[..., _ENDS]),
        (lattice[:, 1, 1], corners.reshape(-1, 4).T),
    )
    for middle, around in between:
        still = (slide[middle] == 0).all(axis=-1)
        slides[middle[still]] = slide[around].mean(axis=0)[still]
    return slides


def _harmonic(mesh: BrickMesh, matrix: csr_matrix, given: Real, axis: int) -> Real:
    """One component, NaN where unknown; at the mirrors across its axis it is as elsewhere on them."""
    values, place = given.copy(), mesh.points_m[:, axis]
    for end in (place.min(), place.max()):
        at = np.abs(place - end) < _ROUNDING * np.ptp(place)
        known = values[at & ~np.isnan(values)]
        values[at & np.isnan(values)] = known.mean() if axis < 2 and len(known) else 0.0
    free = np.isnan(values)
    if free.any():
        values[free] = 0.0
        values[free] = solved_by_lu(matrix[free][:, free], -(matrix @ values)[free])
    return values


def _differences(mesh: BrickMesh) -> csr_matrix:
    """Sum over neighbouring nodes of air of (area between them over their distance) times difference."""
    air, edges = mesh.nodes[mesh.region == 0], mesh.edges_m[mesh.region == 0]
    rows, columns, weights = [], [], []
    for axis in range(3):
        start = np.flatnonzero(_PLACES[:, axis] < 2)
        a, b = (k for k in range(3) if k != axis)
        share = _SHARES[_PLACES[start, a]] * _SHARES[_PLACES[start, b]]
        weight = ((2 * edges[:, a] * edges[:, b] / edges[:, axis])[:, None] * share).ravel()
        one, other = air[:, start].ravel(), air[:, start + 3 ** (2 - axis)].ravel()
        rows += [one, other, one, other]
        columns += [one, other, other, one]
        weights += [weight, weight, -weight, -weight]
    places = np.concatenate(rows), np.concatenate(columns)
    return coo_matrix((np.concatenate(weights), places), (len(mesh.points_m),) * 2).tocsr()
