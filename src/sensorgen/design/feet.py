"""Outline of a foot by its EU size: stated points at shares of its length, through which a smooth curve runs.

Length: ISO/TS 19407, Paris points of 2/3 cm along the last, which is 15 mm longer than the foot. Breadths and the ball:
means of 6068 persons, 2012 Anthropometric Survey of U.S. Army Personnel (Natick/TR-15/007): foot length 263.0 mm,
breadth 98.9 mm, heel breadth 70.8 mm, ball of foot length 194.8 mm. Points between are drawn by eye, at a normal arch.

A left foot seen from above, heel at x = 0::

    y   lateral  ___________________
    |      __---                    --_
    |     (                            )
    |      --__     ______------____--
    |  medial  -----            ball
    +------------------------------------ x
"""

import re

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput, OutOfRange

PARIS_MM = 20 / 3
ALLOWANCE_MM = 15.0
SIZES = (15.0, 52.0)  # from a child's first shoe
LENGTH_MM, BREADTH_MM, HEEL_MM, BALL_MM = 263.03, 98.87, 70.76, 194.75
_HEEL_AT, _FIFTH_AT = 0.16, 0.63  # shares of the length: the widest of the heel, and the fifth toe's joint
_HEEL_ENDS, _METATARSALS, _HALLUX_ENDS = 0.31, (0.51, 0.81), 0.13  # shares of the length; the hallux across
_WORDS = re.compile(r"foot\s+(\S+)\s+(left|right)\s*")


def length_mm(size: float) -> float:
    """Length of a foot by EU size [mm].

    >>> round(length_mm(42), 1)
    265.0
    """
    return PARIS_MM * size - ALLOWANCE_MM


def outline(text: str) -> Real | None:
    """Corners of the outline that words as ``foot 42 left`` name, its lowest corner at the origin (n, 2) [mm].

    Heel at x = 0, toes at its length; chords within 0.05 mm. None of other words.

    Raises
    ------
    BadInput, OutOfRange
        No size, or no side.
    """
    if text.split()[:1] != ["foot"]:
        return None
    words = _WORDS.fullmatch(text)
    try:
        size = float(words[1]) if words else np.nan
    except ValueError:
        size = np.nan
    if words is None or not np.isfinite(size):
        raise BadInput(f"border {text!r}; expected an EU size and a side, as: foot 42 left")
    if not SIZES[0] <= size <= SIZES[1]:
        raise OutOfRange(f"border: EU size {size:g}; expected {SIZES[0]:g} to {SIZES[1]:g}")
    corners = _left() * length_mm(size)
    if words[2] == "right":
        corners = corners * [1, -1] + [0, corners[:, 1].max()]
    return corners.round(4)


def regions(text: str) -> dict[str, list[list[float]]]:
    """Rectangles of the outline's regions, two corners each [mm].

    Metatarsals from 51 to 81 % of the length, toes beyond, as pressures in shoes are usually divided (Forghany et al.,
    Journal of Foot and Ankle Research 11, 2018); the ends of heel and hallux are assumed.
    """
    corners = outline(text)
    if corners is None:
        return {}
    length, breadth = corners.max(0).tolist()
    heel, middle, toes = (share * length for share in (_HEEL_ENDS, *_METATARSALS))
    hallux = _HALLUX_ENDS * length
    hallux, least, most = (breadth - hallux, breadth, 0.0) if text.split()[-1] == "right" else (hallux, 0.0, breadth)
    return {
        "heel": [[0.0, 0.0], [heel, breadth]],
        "midfoot": [[heel, 0.0], [middle, breadth]],
        "metatarsals": [[middle, 0.0], [toes, breadth]],
        "hallux": [[toes, least], [length, hallux]],
        "toes": [[toes, hallux], [length, most]],
    }


def _left() -> Real:
    """Outline of a left foot of length 1, lateral side up (n, 2) [-]."""
    from scipy.interpolate import CubicSpline

    breadth, heel, ball = (size / LENGTH_MM for size in (BREADTH_MM, HEEL_MM, BALL_MM))
    middle = 0.45 * breadth  # of the heel
    low, high = middle - heel / 2, middle + heel / 2
    points = np.array([
        (0.0, middle), (0.045, low + 0.045), (_HEEL_AT, low), (0.42, 0.075), (ball, 0.0), (0.88, 0.02), (0.97, 0.06),
        (1.0, 0.125), (0.965, 0.20), (0.88, 0.285), (0.78, 0.345), (_FIFTH_AT, breadth), (0.42, 0.985 * high),
        (_HEEL_AT, high), (0.045, high - 0.045), (0.0, middle),
    ])  # fmt: skip
    along = np.cumsum(np.append(0.0, np.hypot(*np.diff(points, axis=0).T)))
    curve = np.asarray(CubicSpline(along, points, bc_type="periodic")(np.linspace(0.0, along[-1], 400)[:-1]))
    curve -= curve.min(0)
    return np.asarray(curve * [1.0, breadth] / curve.max(0))
