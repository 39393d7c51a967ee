"""Gaps between the faces that look up and those that look down, along the height, at equal deformed places.

Each quadrature point of a lower face has a partner on an upper face. Partner and slope are *frozen* while Newton's
method runs: the gap is then linear in the displacements. Following them live, with the exact Hessian, stalls.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from sensorgen.models._press.mesh import Mesh, at_border

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_S, _W = np.polynomial.legendre.leggauss(3)
_S, _W = (_S + 1) / 2, _W / 2
_REACH = 1e-9  # how far past its ends a face still carries [-]
_HALF = 0.5  # of the weights of the upper nodes, which add up to 1 where all are loose [-]
_UPRIGHT = 1e-6  # faces whose normal is nearer to level than this neither look up nor down [-]


def _shapes(s: Real) -> Real:
    """The three functions of a side, (..., 3): start, end, middle."""
    return np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=-1)


def _slopes(s: Real) -> Real:
    return np.stack([4 * s - 3, 4 * s - 1, 4 - 8 * s], axis=-1)


@dataclass(frozen=True)
class Faces:
    """Sides of a mesh that may touch: those that look up, and those that look down, (k, 3) nodes each."""

    mesh: Mesh
    lower: Whole
    upper: Whole

    def project(self, places_m: Real, penalty_pa: float, kept: "Pairs | None" = None) -> "Pairs":
        """Find the partner of every point at given places of the nodes (n, 2); those of ``kept`` stay as they are."""
        return project(self.mesh, self, places_m, penalty_pa, kept)


def faces_of(mesh: Mesh) -> Faces:
    """The faces of a mesh, its lowest and highest level and its left and right side left out."""
    a, b = (mesh.points_m[mesh.rim[:, k]] for k in range(2))
    outside = at_border(mesh)
    across = (a[:, 0] - b[:, 0]) / mesh.lengths_m()  # the solid lies left of a side: one that runs back looks up
    return Faces(mesh, mesh.rim[(across > _UPRIGHT) & ~outside], mesh.rim[(across < -_UPRIGHT) & ~outside])


@dataclass(frozen=True)
class Pairs:
    """Quadrature points of the lower faces that have a partner, frozen.

    Attributes
    ----------
    gap, slip : sparse (k, n)
        Gap along the height, and how far the partner has moved sideways, from the places of all nodes [m per m].
    stiffness_pa : (k,) array
        Penalty times the length that each point stands for [Pa].
    length_m : (k,) array
        Length of the lower side that it is on [m].
    point : (k,) array
        Which quadrature point it is.
    sticks : (k,) array
        Whether it touched before, and holds fast.
    """

    gap: csr_matrix
    slip: csr_matrix
    stiffness_pa: Real
    length_m: Real
    point: Whole
    sticks: NDArray[np.bool_]


def project(mesh: Mesh, faces: Faces, places_m: Real, penalty_pa: float, kept: Pairs | None = None) -> Pairs:
    """Find the partner of every point at given places of the nodes (n, 2); those of ``kept`` stay as they are."""
    sides = np.repeat(np.arange(len(faces.lower)), len(_S))
    shape = np.tile(_shapes(_S), (len(faces.lower), 1))
    here = np.einsum("kn,knd->kd", shape, places_m[faces.lower[sides]])
    ends = mesh.points_m[faces.lower[:, 1]] - mesh.points_m[faces.lower[:, 0]]
    length = np.hypot(*ends.T)[sides]
    partner, s = _partners(here, places_m[faces.upper], length)
    known = kept.point if kept else np.empty(0, int)
    found = np.setdiff1d(np.flatnonzero(partner >= 0), known)
    lower, upper = faces.lower[sides[found]], faces.upper[partner[found]]
    along = np.einsum("kn,knd->kd", _slopes(s[found]), places_m[upper])
    gap, slip = _rows(lower, upper, shape[found], _shapes(s[found]), along[:, 1] / along[:, 0], 2 * len(mesh.points_m))
    weight = np.tile(_W, len(faces.lower))[found]
    made = Pairs(gap, slip, penalty_pa * weight, length[found], found, np.zeros(len(found), bool))
    return _joined(made, kept) if kept else made


def _rows(
    lower: Whole, upper: Whole, below: Real, above: Real, slope: Real, freedoms: int
) -> tuple[csr_matrix, csr_matrix]:
    """Gap and slip as sparse rows: (upper - lower) in height, less the slope times (upper - lower) in place."""
    weights = np.concatenate([above, -below], axis=1)
    nodes = np.concatenate([upper, lower], axis=1)
    rows = np.repeat(np.arange(len(nodes)), 6)
    size = (len(nodes), freedoms)
    slip = csr_matrix((weights.ravel(), (rows, 2 * nodes.ravel())), size)
    height = csr_matrix((weights.ravel(), (rows, 2 * nodes.ravel() + 1)), size)
    tilted = csr_matrix(((weights * slope[:, None]).ravel(), (rows, 2 * nodes.ravel())), size)
    return (height - tilted).tocsr(), slip


def _joined(a: Pairs, b: Pairs) -> Pairs:
    from scipy.sparse import vstack

    both = [np.concatenate([getattr(a, k), getattr(b, k)]) for k in ("stiffness_pa", "length_m", "point", "sticks")]
    return Pairs(vstack([a.gap, b.gap]).tocsr(), vstack([a.slip, b.slip]).tocsr(), *both)


def _some(pairs: Pairs, which: NDArray[np.bool_], sticks: NDArray[np.bool_]) -> Pairs:
    rest = (pairs.stiffness_pa[which], pairs.length_m[which], pairs.point[which], sticks[which])
    return Pairs(pairs.gap[which], pairs.slip[which], *rest)


def carrying(pairs: Pairs, loose: NDArray[np.bool_], dimension: int) -> Pairs:
    """The pairs between a loose piece above and one below that is held; ``loose`` says it of each node."""
    share = np.asarray(pairs.gap[:, dimension - 1 :: dimension] @ loose.astype(float))
    return _some(pairs, share > _HALF, pairs.sticks)


def stuck(pairs: Pairs, which: NDArray[np.bool_]) -> Pairs:
    """Some of the pairs, which hold fast from now on."""
    return _some(pairs, which, np.ones_like(which))


def _partners(here: Real, upper: Real, depth: Real) -> tuple[Whole, Real]:
    """For each point the first upper side above it, or less than ``depth`` below it, or -1; and where on it."""
    at, inside = _meet(here[:, :1], upper[None, :, :, 0])
    height = np.einsum("ken,en->ke", _shapes(at), upper[:, :, 1])
    above = height - here[:, 1:]
    distance = np.where(inside & (above > -depth[:, None]), np.abs(above), np.inf)
    if not distance.size:
        return np.full(len(here), -1), np.zeros(len(here))
    best = distance.argmin(axis=1)
    rows = np.arange(len(here))
    return np.where(np.isfinite(distance[rows, best]), best, -1), at[rows, best]


def _meet(x: Real, nodes: Real) -> tuple[Real, NDArray[np.bool_]]:
    """Where on a side (0 to 1) its place is x: a root of a quadratic, in the form that bears nearly straight sides."""
    a, b, m = nodes[..., 0], nodes[..., 1], nodes[..., 2]
    c2, c1, c0 = 2 * (a + b - 2 * m), 4 * m - 3 * a - b, a - x
    root = np.sqrt(np.maximum(c1**2 - 4 * c2 * c0, 0.0))
    below = c1 + np.copysign(root, c1)
    s = -2 * c0 / np.where(below == 0, np.inf, below)
    return np.clip(s, 0.0, 1.0), (s >= -_REACH) & (s <= 1 + _REACH)
