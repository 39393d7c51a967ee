"""How the air of a cell goes along with its boxes: harmonically, so that the field has a map without folds."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from sensorgen.models._press.brick_element import BrickMesh, slopes, values

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_ROUNDING = 1e-9
_ALONG = 300.0  # weight of a displacement's derivative along itself: air between two faces is squeezed evenly [-]


def extended(mesh: BrickMesh, solid: BrickMesh, moved: Real) -> Real:
    """Displacements of all nodes of a cell (3n,) from those of its solid boxes, harmonic in the air.

    What the air does between the faces does not matter to the capacitance, as long as it does not fold.
    """
    u = np.full((len(mesh.points_m), 3), np.nan)
    u[mesh.nodes[mesh.region > 0]] = moved[solid.nodes]
    air = mesh.nodes[mesh.region == 0]
    if not len(air):
        return u.ravel()
    for axis in range(3):
        u[:, axis] = _harmonic(mesh, air, u[:, axis], axis)
    return u.ravel()


def _harmonic(mesh: BrickMesh, air: Whole, given: Real, axis: int) -> Real:
    """One component; at the mirrors across its axis it is as elsewhere on them."""
    found = given.copy()
    place = mesh.points_m[:, axis]
    for end in (place.min(), place.max()):
        at = np.abs(place - end) < _ROUNDING * np.ptp(place)
        known = found[at & ~np.isnan(found)]
        found[at & np.isnan(found)] = known.mean() if axis < 2 and len(known) else 0.0
    free = np.zeros(len(found), bool)
    free[air] = np.isnan(found[air])
    if not free.any():
        return found
    found[np.isnan(found)] = 0.0
    local = _laplace(mesh.edges_m()[mesh.region == 0], np.where(np.arange(3) == axis, _ALONG, 1.0))
    rows, columns = np.repeat(air, 27, axis=1).ravel(), np.tile(air, (1, 27)).ravel()
    matrix = coo_matrix((local.ravel(), (rows, columns)), (len(found),) * 2).tocsr()
    inner = matrix[free][:, free].tocsc()
    solver = splu(inner, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    found[free] = solver.solve(-(matrix @ found)[free])
    return found


def _laplace(edges: Real, weight_of: Real) -> Real:
    """Integrals of grad . grad of the 27 functions of boxes (m, 27, 27), each direction by its weight."""
    at, weight = np.polynomial.legendre.leggauss(3)
    value, slope = values(at), slopes(at)
    stiffness, mass = (v.T @ (weight[:, None] * v) for v in (slope, value))
    scale = weight_of * edges.prod(axis=1)[:, None] / (2 * edges**2)
    parts = [_product([stiffness if a == axis else mass for a in range(3)]) for axis in range(3)]
    return np.asarray(np.einsum("ma,aij->mij", scale, np.array(parts)))


def _product(factors: list[Real]) -> Real:
    return np.asarray(np.kron(np.kron(factors[0], factors[1]), factors[2]))
