"""Two resistor networks on voxels, one on each side of the capacitance, written apart from sensorgen's solvers.

Nodes at the corners, a resistor along every edge: each voxel gives a quarter of its conductance to each of its four
edges along an axis. That is the energy of trilinear potentials with the trapezoid rule across, which is never below the
exact one: an upper bound. Nodes in the middle, resistors through the faces: the energy of fluxes that are straight in
each voxel, with the trapezoid rule along, never below the exact one: a lower bound. Voxels that a conductor touches are
taken for conductor above, those that it fills below.
"""

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import cg


def solved(count, edges, conductance, held):
    """Energy of nodes joined by resistors, some held at a voltage."""
    one, other = edges
    joined = coo_matrix(
        (np.concatenate([-conductance, -conductance]), (np.append(one, other), np.append(other, one))), (count, count)
    ).tocsr()
    matrix = joined - diags(np.asarray(joined.sum(1)).ravel())
    u = np.where(np.isnan(held), 0.0, held)
    free = np.isnan(held) & (matrix.diagonal() > 0)
    inner = matrix[free][:, free]
    found, info = cg(inner, -(matrix @ u)[free], rtol=1e-8, M=diags(1 / inner.diagonal()), maxiter=5000)
    assert info == 0
    u[free] = found
    return float(u @ (matrix @ u))


def upper(eps, metal, h):
    """Over eps0 [mm]; ``eps`` (i, j, k), ``metal`` (i, j, k): 0 and 1 at the electrodes, else -1."""
    shape = np.array(eps.shape) + 1
    number = np.arange(shape.prod()).reshape(shape)
    held = np.full(shape, np.nan)
    for end in (0, 1):
        here = np.argwhere(metal == end)
        for corner in np.ndindex(2, 2, 2):
            held[tuple((here + corner).T)] = end
    weight = np.pad(np.where(metal < 0, eps, 0.0), 1) * h / 4
    ones, others, conductances = [], [], []
    for axis in range(3):
        first, second = (a for a in range(3) if a != axis)
        total = sum(np.roll(np.roll(weight, i, first), j, second) for i in (0, -1) for j in (0, -1))
        low = np.delete(number, -1, axis)
        cut = [slice(0, -1)] * 3
        cut[axis] = slice(1, -1)
        ones.append(low.ravel())
        others.append(np.delete(number, 0, axis).ravel())
        conductances.append(total[tuple(cut)].ravel())
    return solved(
        number.size, (np.concatenate(ones), np.concatenate(others)), np.concatenate(conductances), held.ravel()
    )


def lower(eps, metal, h):
    """Over eps0 [mm]; as :func:`upper`."""
    number = np.arange(eps.size).reshape(eps.shape)
    held = np.where(metal < 0, np.nan, metal).ravel().astype(float)
    half = np.where(metal < 0, 0.5 / eps, 0.0)  # from the middle of a voxel to its face
    ones, others, resistances = [], [], []
    for axis in range(3):
        ones.append(np.delete(number, -1, axis).ravel())
        others.append(np.delete(number, 0, axis).ravel())
        resistances.append((np.delete(half, -1, axis) + np.delete(half, 0, axis)).ravel())
    one, other, resistance = map(np.concatenate, (ones, others, resistances))
    real = resistance > 0
    return solved(eps.size, (one[real], other[real]), h / resistance[real], held)


def voxels(size, h, part, film_mm):
    """Permittivity and conductors of a post between plates; ``part(x, y)``: places in plan within the post."""
    n = np.rint(np.array(size) / h).astype(int)
    x, y, z = ((np.arange(k) + 0.5) * h for k in n)
    corners = [part(*np.meshgrid(x + i * h / 2, y + j * h / 2, indexing="ij")) for i in (-1, 1) for j in (-1, 1)]
    found = []
    for touched in (np.any(corners, axis=0), np.all(corners, axis=0)):
        metal = np.full(n, -1)
        metal[..., 0], metal[..., -1] = 0, 1
        metal[touched[..., None] & (z > h + film_mm)] = 1
        found.append(metal)
    film = (z > h) & (z < h + film_mm)
    return np.where(film, 4.68, 1.00059) * np.ones(n), found[0], found[1]
