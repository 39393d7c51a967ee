"""Sets of intervals on a line, as sorted pairs that do not touch [mm]."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from sensorgen.scene.scene import SLIVER_MM, Point

Intervals = tuple[Point, ...]


def united(runs: Iterable[Point], near_mm: float = SLIVER_MM) -> Intervals:
    """All that any of some runs covers; runs no further apart than ``near_mm`` become one [mm].

    >>> united([(2, 3), (0, 1), (0.5, 2)])
    ((0, 3),)
    """
    found: list[Point] = []
    for start, end in sorted(runs):
        if found and start <= found[-1][1] + near_mm:
            found[-1] = (found[-1][0], max(found[-1][1], end))
        else:
            found.append((start, end))
    return tuple(found)


def without(runs: Intervals, taken: Intervals) -> Intervals:
    """What some runs cover and others do not; slivers are dropped [mm].

    >>> without(((0, 4),), ((1, 2), (3, 9)))
    ((0, 1), (2, 3))
    """
    found = []
    for start, end in runs:
        for low, high in (t for t in taken if t[1] > start and t[0] < end):
            found.append((start, low))
            start = high
        found.append((start, end))
    return tuple(run for run in found if run[1] - run[0] > SLIVER_MM)


def within(runs: Intervals, low_mm: float, high_mm: float) -> Intervals:
    """The part of some runs between two places [mm].

    >>> within(((0, 4), (5, 6)), 3, 5.5)
    ((3, 4), (5, 5.5))
    """
    cut = ((max(a, low_mm), min(b, high_mm)) for a, b in runs)
    return tuple(run for run in cut if run[1] - run[0] > SLIVER_MM)


def length_mm(runs: Intervals) -> float:
    """Total length [mm]."""
    return sum(b - a for a, b in runs)


def distances_mm(runs: Intervals, places_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far each place is from the nearest of some runs, 0 within it [mm].

    >>> distances_mm(((0, 2), (5, 6)), np.array([-1.0, 1.0, 3.0, 4.0])).tolist()
    [1.0, 0.0, 1.0, 1.0]
    """
    low, high = np.array(runs, dtype=np.float64).T
    after = np.searchsorted(low, places_mm)  # the nearest run is the last that starts before a place, or the next
    near = np.column_stack([np.maximum(after - 1, 0), np.minimum(after, len(low) - 1)])
    places = places_mm[:, None]
    away: NDArray[np.float64] = np.maximum(low[near] - places, places - high[near]).clip(0.0).min(axis=1)
    return away
