"""Two resistor networks on voxels, one on each side of the capacitance, written apart from sensorgen's solvers.

Nodes at the corners, a resistor along every edge: each voxel gives a quarter of its conductance to each of its four
edges along an axis. That is the energy of trilinear potentials with the trapezoid rule across, which is never below the
exact one: an upper bound. Nodes in the middle, resistors through the faces: the energy of fluxes that are straight in
each voxel, with the trapezoid rule along, never below the exact one: a lower bound. Voxels that a conductor touches are
taken for conductor above, those that it fills below.
"""

import numpy as np
from resistors import potentials, sides


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
    edges = []
    for axis in range(3):
        first, second = (a for a in range(3) if a != axis)
        total = sum(np.roll(np.roll(weight, i, first), j, second) for i in (0, -1) for j in (0, -1))
        cut = [slice(0, -1)] * 3
        cut[axis] = slice(1, -1)
        edges.append((*sides(number, axis), total[tuple(cut)].ravel()))
    return energy(edges, held)


def lower(eps, metal, h):
    """Over eps0 [mm]; as :func:`upper`."""
    number = np.arange(eps.size).reshape(eps.shape)
    held = np.where(metal < 0, np.nan, metal)
    half = np.where(metal < 0, 0.5 / eps, 0.0)  # from the middle of a voxel to its face
    edges = []
    for axis in range(3):
        resistance = sum(sides(half, axis))
        real = resistance > 0
        edges.append((*(end[real] for end in sides(number, axis)), h / resistance[real]))
    return energy(edges, held)


def energy(edges, held):
    """Of nodes joined by resistors, some held at a voltage."""
    u, current = potentials(*map(np.concatenate, zip(*edges, strict=True)), held.ravel())
    return float(u @ current)


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
