"""Rays from the faces of solids to the faces that they look at: a quadratic to be solved for each curved side."""

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(3)
POINTS, WEIGHTS = (POINTS + 1) / 2, WEIGHTS / 2
_REACH = 1e-9  # how far past its ends a side is still hit [-]
OPPOSED = 0.1  # cosine between a ray and the face that it hits, below which it grazes [-]


def shapes(s: Real) -> Real:
    """The three functions of a side, (..., 3): start, end, middle."""
    return np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=-1)


def slopes(s: Real) -> Real:
    """Their derivatives."""
    return np.stack([4 * s - 3, 4 * s - 1, 4 - 8 * s], axis=-1)


def at(s: Real, sides: Real) -> tuple[Real, Real]:
    """Places (k, 2) on sides (k, 3, 2), and the directions there that the outside lies to the right of."""
    along = np.einsum("kn,knd->kd", slopes(s), sides)
    return np.einsum("kn,knd->kd", shapes(s), sides), along / np.hypot(*along.T)[:, None]


def outwards(along: Real) -> Real:
    """Normals to the right of directions (k, 2)."""
    return np.stack([along[:, 1], -along[:, 0]], axis=1)


def hit(here: Real, along: Real, sides: Real, depth: Real) -> tuple[Whole, Whole, Real]:
    """For each ray the nearest side that looks against it, ahead or less than ``depth`` behind.

    Rays start ``here`` and go to the right of ``along`` (k, 2); sides are (m, 3, 2). Returns the rays that hit
    something, which side, and where on it (0 to 1).
    """
    ends = sides[:, :2].reshape(-1, 2)
    across = (along @ ends.T - (along * here).sum(axis=1)[:, None]).reshape(len(here), len(sides), 2)
    ray, side = np.nonzero((across[..., 0] >= -_tolerance(sides)) & (across[..., 1] <= _tolerance(sides)))
    reached = sides[side] - here[ray, None]
    across, ahead = (np.einsum("knd,kd->kn", reached, v[ray]) for v in (along, outwards(along)))
    s, inside = _meet(across)
    distance, (_, way) = (shapes(s) * ahead).sum(axis=1), at(s, sides[side])
    good = inside & (distance > -depth[ray]) & ((way * along[ray]).sum(axis=1) < -OPPOSED)
    order = np.flatnonzero(good)[np.argsort(np.abs(distance[good]), kind="stable")]
    found, first = np.unique(ray[order], return_index=True)
    return found, side[order][first], s[order][first]


def _tolerance(sides: Real) -> Real:
    return np.asarray(_REACH * np.hypot(*(sides[:, 1] - sides[:, 0]).T))


def _meet(across: Real) -> tuple[Real, NDArray[np.bool_]]:
    """Where on a side (0 to 1) its distance from a ray is 0: a root of a quadratic, in the form for straight sides."""
    a, b, m = across.T
    c2, c1, c0 = 2 * (a + b - 2 * m), 4 * m - 3 * a - b, a
    root = np.sqrt(np.maximum(c1**2 - 4 * c2 * c0, 0.0))
    below = c1 + np.copysign(root, c1)
    s = -2 * c0 / np.where(below == 0, np.inf, below)
    return np.clip(s, 0.0, 1.0), (s >= -_REACH) & (s <= 1 + _REACH)


def turns(here: Real, starts: Real, ends: Real) -> Whole:
    """How often closed outlines of straight pieces (m, 2) run anticlockwise around points (k, 2)."""
    x = here[:, :1]
    (x0, y0), (x1, y1) = starts.T, ends.T
    sign = np.where(x1 < x0, 1, -1) * ((np.minimum(x0, x1) <= x) & (x < np.maximum(x0, x1)))
    with np.errstate(divide="ignore", invalid="ignore"):
        above = y0 + (x - x0) * (y1 - y0) / (x1 - x0) > here[:, 1:]
    return np.asarray((sign * above).sum(axis=1))
