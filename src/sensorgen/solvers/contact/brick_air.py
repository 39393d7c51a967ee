"""How the air of a cell goes along with its boxes, so that the field has a map without folds.

In the columns of a gap that is nearly shut, evenly between the two faces; elsewhere harmonically, by differences
between neighbouring nodes: no displacement there is beyond those around it.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import splu

from sensorgen.solvers.contact.bricks import BrickMesh

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_ROUNDING = 1e-9
_PLACES = np.array(list(product(range(3), repeat=3)))  # of a brick's 27 nodes
_SHARES = np.array([0.25, 0.5, 0.25])  # of a brick's width that belong to its three nodes


def extended(mesh: BrickMesh, solid: BrickMesh, moved: Real, columns: list[tuple[int, Whole, Whole]]) -> Real:
    """Displacements of all nodes of a cell (3n,) from those of its solid boxes.

    What the air does between the faces does not matter to the capacitance, as long as it does not fold.

    Parameters
    ----------
    mesh, solid : BrickMesh
        All boxes of the cell, and the solid ones.
    moved : (n, 3) array
        Displacements of the solid nodes [m].
    columns : list
        Gaps that are nearly shut: along which axis, and the solid nodes on both sides, the near ones first.
    """
    size = mesh.lattice.max(axis=0) + 1
    number = np.ravel_multi_index(tuple(solid.lattice.T), tuple(size))
    u = np.full((len(mesh.points_m), 3), np.nan)
    u[number] = moved
    for axis, near, far in columns:
        stride = int(np.prod(size[axis + 1 :]))
        for start, stop in zip(number[near].tolist(), number[far].tolist(), strict=True):
            nodes = np.arange(start, stop + 1, stride)
            share = (mesh.points_m[nodes, axis] - mesh.points_m[start, axis])[:, None]
            u[nodes] = u[start] + share / share[-1] * (u[stop] - u[start])
    air = mesh.nodes[mesh.region == 0]
    if np.isnan(u).any():
        matrix = _differences(mesh, air)
        for axis in range(3):
            u[:, axis] = _harmonic(mesh, matrix, u[:, axis], axis)
    return u.ravel()


def _harmonic(mesh: BrickMesh, matrix: csr_matrix, given: Real, axis: int) -> Real:
    """One component; at the mirrors across its axis it is as elsewhere on them."""
    found = given.copy()
    place = mesh.points_m[:, axis]
    for end in (place.min(), place.max()):
        at = np.abs(place - end) < _ROUNDING * np.ptp(place)
        known = found[at & ~np.isnan(found)]
        found[at & np.isnan(found)] = known.mean() if axis < 2 and len(known) else 0.0
    free = np.isnan(found)
    if not free.any():
        return found
    found[free] = 0.0
    inner = matrix[free][:, free].tocsc()
    solver = splu(inner, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    found[free] = solver.solve(-(matrix @ found)[free])
    return found


def _differences(mesh: BrickMesh, air: Whole) -> csr_matrix:
    """Sum over neighbours of (area between them over their distance) times difference."""
    edges = mesh.edges_m[mesh.region == 0]
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
