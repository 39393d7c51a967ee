"""Blunter triangles from slender ones: edges flipped until no corner lies in its neighbour's circle (Lawson)."""

from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

Edge = tuple[int, int]
Triangle = tuple[int, int, int]

_GAIN = 1e-9  # by which the sum of two opposite angles must exceed half a turn [rad]
_FLAT = 1e-9  # sine of the angle of three corners on a line


def flipped(points: NDArray[np.float64], triangles: Sequence[Triangle], regions: Sequence[Hashable]) -> list[Triangle]:
    """The same regions in triangles of the same number and corners, no two of which would be blunter if turned.

    Parameters
    ----------
    points : (n, 2) array
        Corners.
    triangles : list of (int, int, int)
        Counter-clockwise.
    regions : list
        Of each triangle; edges between different ones stay.
    """
    made = list(triangles)
    owner = {edge: n for n, corners in enumerate(made) for edge in _turns(corners)}
    todo = [edge for edge in owner if edge[0] < edge[1]]
    places: list[tuple[float, float]] = [(float(x), float(y)) for x, y in points]
    while todo:
        a, b = todo.pop()
        one, other = owner.get((a, b)), owner.get((b, a))
        if one is None or other is None or regions[one] != regions[other]:
            continue
        c, d = _third(made[one], a, b), _third(made[other], a, b)
        if not _is_better(*(places[k] for k in (a, b, c, d))):
            continue
        del owner[a, b], owner[b, a]
        made[one], made[other] = (a, d, c), (d, b, c)
        for n in (one, other):
            owner.update(dict.fromkeys(_turns(made[n]), n))
        todo += [(a, d), (d, b), (b, c), (c, a)]
    return made


def _turns(corners: Triangle) -> list[Edge]:
    a, b, c = corners
    return [(a, b), (b, c), (c, a)]


def _third(corners: Triangle, a: int, b: int) -> int:
    return next(k for k in corners if k not in (a, b))


_Point = tuple[float, float]


def _is_better(a: _Point, b: _Point, c: _Point, d: _Point) -> bool:
    """Whether d-c is the better diagonal of a, d, b, c than a-b: the angles at c and d are more than half a turn."""
    if min(_sine(a, d, c), _sine(d, b, c)) < _FLAT:
        return False
    return _angle(a, c, b) + _angle(a, d, b) > np.pi + _GAIN


def _sine(a: _Point, b: _Point, c: _Point) -> float:
    """Of the angle at b, from a to c, above 0 where the three turn left."""
    (ux, uy), (vx, vy) = (b[0] - a[0], b[1] - a[1]), (c[0] - b[0], c[1] - b[1])
    return float((ux * vy - uy * vx) / (np.hypot(ux, uy) * np.hypot(vx, vy)))


def _angle(a: _Point, b: _Point, c: _Point) -> float:
    """At b, between a and c [rad]."""
    (ux, uy), (vx, vy) = (a[0] - b[0], a[1] - b[1]), (c[0] - b[0], c[1] - b[1])
    return float(np.arctan2(abs(ux * vy - uy * vx), ux * vx + uy * vy))
