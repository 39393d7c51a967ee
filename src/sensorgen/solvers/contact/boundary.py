"""Boundary conditions of a cell: fixed and equal displacements, and the pressure on its top."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.core.arrays import Mask, Real, Whole

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


_SAME = 1e-9  # of the cell's width: places nearer than this are one


@dataclass(frozen=True)
class BoundaryConditions:
    """Boundary and contact conditions of a cell.

    Attributes
    ----------
    base : str
        "bonded", or "sliding" without friction.
    period : str
        "fixed", or "free" to widen until there is no lateral force.
    top : str
        "even" pressure, or a "rigid" plate without friction.
    contact : str
        "frictionless", or "stick" from first contact on.
    """

    base: str = "bonded"
    period: str = "fixed"
    top: str = "even"
    contact: str = "frictionless"


CHOICES = {
    "base": ("bonded", "sliding"),
    "period": ("fixed", "free"),
    "top": ("even", "rigid"),
    "contact": ("frictionless", "stick"),
}


def free_of(
    points_m: Real, boundary: BoundaryConditions, spans_m: Real | None = None, used: Mask | None = None
) -> "csr_matrix":
    """Displacements (x, y of each node, or x, y, z) from the free ones, as a sparse matrix of ones.

    Parameters
    ----------
    points_m : (n, d) array
        Places of the nodes, the height last; all sides of the cell are mirrors [m].
    boundary : BoundaryConditions
        Boundary conditions.
    spans_m : (d, 2) array, optional
        Where the cell begins and ends; as far as its nodes reach where not given [m].
    used : (n,) array, optional
        Nodes that elements share; others do not move. All where not given.
    """
    from scipy.sparse import csr_matrix

    nodes, d = points_m.shape
    spans = np.column_stack([points_m.min(axis=0), points_m.max(axis=0)]) if spans_m is None else spans_m
    near = _SAME * np.ptp(spans[0])
    ends = [[np.flatnonzero(abs(x - end) < near) for end in span] for x, span in zip(points_m.T, spans, strict=True)]
    wide = d * nodes + np.arange(d - 1)  # these numbers stand for how the cell widens
    leader = np.arange(d * nodes + d - 1)
    fixed = np.zeros(len(leader), bool)
    for axis, (start, stop) in enumerate(ends[:-1]):
        fixed[d * start + axis] = True
        leader[d * stop + axis] = wide[axis]
    floor, roof = ends[-1]
    fixed[d * floor + d - 1] = True
    for axis in range(d - 1):
        fixed[d * floor + axis] |= boundary.base == "bonded"
    fixed[wide] = boundary.period == "fixed" or boundary.base == "bonded"
    if used is not None:
        fixed[: d * nodes] |= ~np.repeat(used, d)
    if boundary.top == "rigid":
        leader[d * roof + d - 1] = d * roof[0] + d - 1
    while (leader[leader] != leader).any():
        leader = leader[leader]
    held_too = np.zeros(len(leader), bool)
    held_too[leader[fixed]] = True
    number = np.where(held_too[leader], -1, leader)[: d * nodes]
    kept, column = np.unique(number[number >= 0], return_inverse=True)
    return csr_matrix((np.ones(len(column)), (np.flatnonzero(number >= 0), column)), (d * nodes, len(kept)))


def top_load(points_m: Real, faces: Whole, measure: Real) -> Real:
    """Forces of a unit pressure on the top, downwards, in its first direction and area (d n,) [m^(d - 1)].

    ``faces`` (k, 3^(d - 1)) are the nodes of each face of the top, from line to line, ``measure`` its area (k, 1), or
    of a ring 2 pi r times its width at each node (k, 3).
    """
    d = points_m.shape[1]
    shares, force = np.array([1.0]), np.zeros(points_m.size)
    for _ in range(d - 1):
        shares = np.outer(shares, [1 / 6, 2 / 3, 1 / 6]).ravel()
    np.add.at(force, d * faces + d - 1, -shares * measure)
    return force
