"""How a cell is held and loaded: which displacements are fixed or equal, and the pressure on its top."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from sensorgen.models._press.mesh import Mesh

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_SAME = 1e-9  # of the cell's width: places nearer than this are one


@dataclass(frozen=True)
class Held:
    """Choices of the boundary.

    Attributes
    ----------
    base : str
        "bonded", or "sliding" without friction.
    period : str
        "fixed", or "free" to widen until nothing pulls sideways.
    top : str
        "even" pressure, or a "rigid" plate without friction.
    contact : str
        "frictionless", or "stick" once touched.
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


def free_of(mesh: Mesh, held: Held, *, mirrored: bool, tied: Whole) -> csr_matrix:
    """Displacements (x, y of each node) from the free ones, as a sparse matrix of ones.

    Parameters
    ----------
    mesh : Mesh
        Of the cell.
    held : Held
        Choices of the boundary.
    mirrored : bool
        Both sides are mirrors; else the right side repeats the left one.
    tied : (k, 2) array
        Pairs of nodes that move as one, where solids touch in a point.
    """
    x, y = mesh.points_m.T
    near = _SAME * (x.max() - x.min())
    left, right = (np.flatnonzero(abs(x - end) < near) for end in (x.min(), x.max()))
    floor, roof = (np.flatnonzero(abs(y - end) < near) for end in (y.min(), y.max()))
    leader = np.arange(2 * len(x) + 1)  # the last number stands for the widening of the period
    wide = 2 * len(x)
    fixed = np.zeros(len(leader), bool)
    for one, other in tied:
        leader[2 * other], leader[2 * other + 1] = 2 * one, 2 * one + 1
    widened = np.zeros(2 * len(x), bool)
    if mirrored:
        fixed[2 * left] = True
        leader[2 * right] = wide
    else:
        partner = left[np.argmin(abs(y[right][:, None] - y[left]), axis=1)]
        leader[2 * right], leader[2 * right + 1] = 2 * partner, 2 * partner + 1
        widened[2 * right] = True
        fixed[2 * left[y[left].argmin()]] |= held.base == "sliding"
    fixed[2 * floor + 1] = True
    fixed[2 * floor] |= held.base == "bonded"
    fixed[wide] = held.period == "fixed" or held.base == "bonded"
    if held.top == "rigid":
        leader[2 * roof + 1] = 2 * roof[0] + 1
    while (leader[leader] != leader).any():
        leader = leader[leader]
    held_too = np.zeros(len(leader), bool)
    held_too[leader[fixed]] = True
    number = np.where(held_too[leader], -1, leader)[:-1]
    kept, column = np.unique(number[number >= 0], return_inverse=True)
    rows, columns = np.flatnonzero(number >= 0), column
    if widened.any() and wide not in leader[:-1] and not fixed[wide]:
        rows, columns = np.append(rows, np.flatnonzero(widened)), np.append(columns, np.full(widened.sum(), len(kept)))
        kept = np.append(kept, wide)
    return csr_matrix((np.ones(len(rows)), (rows, columns)), (2 * len(x), len(kept)))


def top_load(mesh: Mesh) -> Real:
    """Forces of a unit pressure on the top, downwards, in its first direction and area [m]."""
    top = mesh.points_m[:, 1].max()
    on_top = (mesh.points_m[mesh.rim, 1] == top).all(axis=1)
    force = np.zeros(2 * len(mesh.points_m))
    for node, share in zip(mesh.rim[on_top].T, (1 / 6, 1 / 6, 2 / 3), strict=True):
        np.add.at(force, 2 * node + 1, -share * mesh.lengths_m()[on_top])
    return force


def tied_nodes(mesh: Mesh) -> Whole:
    """Nodes of the first sides on both faces of a gap that begins where solids touch in a point, in pairs.

    A point contact has no stiffness to begin with; tied over one side it has, and the sides are short.
    """
    ends = mesh.rim[:, :2].ravel()
    nodes, count = np.unique(ends, return_counts=True)
    pairs = []
    for node in nodes[count >= 4]:
        here = mesh.rim[(mesh.rim[:, :2] == node).any(axis=1)]
        far = np.where(here[:, 0] == node, here[:, 1], here[:, 0])
        way = mesh.points_m[far] - mesh.points_m[node]
        level = abs(way[:, 0]) > 1e-6 * np.hypot(*way.T)
        for sign in (-1, 1):
            faces = np.flatnonzero(level & (sign * way[:, 0] > 0))
            if len(faces) == 2:
                pairs += [far[faces], here[faces, 2]]
    return np.array(pairs, int).reshape(-1, 2)
