"""What points of bricks' faces meet on other faces, along an axis, at deformed places."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensorgen.solvers.contact.element import line_slopes as slopes
from sensorgen.solvers.contact.element import line_values as values

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

_REACH = 1e-9  # how far past its ends a face still carries [-]
_TURNS = 5  # of Newton's method that finds a place on a face, which is nearly flat


@dataclass(frozen=True)
class Met:
    """What each of some points faces along an axis.

    Attributes
    ----------
    axis : int
        Along which.
    found : (k,) array
        Whether there is anything.
    gap_m : (k,) array
        How far away, below 0 where they have run into each other [m].
    slopes : (k, 2) array
        Of the face that is met, to the two other axes [-].
    nodes, weights : (k, 18) array
        Difference of the two places from those of nodes: the face that is met, less the point.
    """

    axis: int
    found: NDArray[np.bool_]
    gap_m: Real
    slopes: Real
    nodes: Whole
    weights: Real


def facing_points(places_m: Real, own: Whole, shape: Real, faces: Whole, axis: int) -> Met:
    """The nearest of some faces (f, 9) that points, of nodes ``own`` (k, 9) by ``shape``, meet along an axis."""
    ways = [k for k in range(3) if k != axis]
    here = np.einsum("kn,knd->kd", shape, places_m[own])
    there = places_m[faces]
    low, high = there[..., ways].min(axis=1), there[..., ways].max(axis=1)
    reach = _REACH * (high - low)
    level = here[:, None, ways]
    point, face = np.nonzero(((level >= low - reach) & (level <= high + reach)).all(axis=2))
    at, ok = _inverse(there[face][..., ways], here[point][:, ways])
    both = _on_face(values(at[:, 0]), values(at[:, 1]))
    gap = np.einsum("kn,kn->k", both, there[face][..., axis]) - here[point, axis]
    point, face, at, both, gap = point[ok], face[ok], at[ok], both[ok], gap[ok]
    order = np.lexsort((np.abs(gap), point))
    first = order[np.unique(point[order], return_index=True)[1]]
    count = len(own)
    weights, nodes = np.concatenate([np.zeros((count, 9)), -shape], axis=1), np.concatenate([own, own], axis=1)
    weights[point[first], :9], nodes[point[first], :9] = both[first], faces[face[first]]
    found, far, slopes = np.zeros(count, bool), np.full(count, np.inf), np.zeros((count, 2))
    found[point[first]], far[point[first]] = True, gap[first]
    slopes[point[first]] = _slopes_at(there[face[first]], at[first], ways, axis)
    return Met(axis, found, far, slopes, nodes, weights)


def _on_face(one: Real, other: Real) -> Real:
    """Products of three functions each at k places: those of a face (k, 9)."""
    return np.asarray(np.einsum("ki,kj->kij", one, other).reshape(len(one), 9))


def _moves(at: Real) -> Real:
    """Derivatives of the nine functions to both ways along the face (k, 2, 9)."""
    one, other = at.T
    return np.stack([_on_face(slopes(one), values(other)), _on_face(values(one), slopes(other))], axis=1)


def _inverse(faces: Real, wanted: Real) -> tuple[Real, NDArray[np.bool_]]:
    """Where on faces (k, 9, 2), from -1 to 1, given places (k, 2) are; and whether they are there at all."""
    at = np.zeros_like(wanted)
    for _ in range(_TURNS):
        place = np.einsum("kn,knd->kd", _on_face(values(at[:, 0]), values(at[:, 1])), faces)
        jacobian = np.einsum("kwn,knd->kdw", _moves(at), faces)
        at = np.clip(at + np.linalg.solve(jacobian, (wanted - place)[..., None])[..., 0], -2.0, 2.0)
    return at, np.asarray((np.abs(at) <= 1 + _REACH).all(axis=1))


def _slopes_at(faces: Real, at: Real, ways: list[int], axis: int) -> Real:
    """Slope of the height along the axis to the two others, at places on faces (k, 9, 3)."""
    moves = np.einsum("kwn,knd->kwd", _moves(at), faces)
    return np.asarray(np.linalg.solve(moves[..., ways], moves[..., axis, None])[..., 0])
