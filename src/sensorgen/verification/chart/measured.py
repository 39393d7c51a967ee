"""What a model gave, and how long it took; which of them nothing beats; and which had nothing to say."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

_QUICK_S = 0.3  # runs shorter than this are repeated, and the median counts
_REPEATS = 5
_AGAIN_S = 1.0  # a first run shorter than this is repeated, in case it had to import

DIGITS = 2.0**-53  # no error is less than this


@dataclass(frozen=True)
class Point:
    """What one model gave on one scene.

    Attributes
    ----------
    scene, model : str
        Names; a model's begins with its own, and goes on after a colon where it has several ways.
    error : float
        Relative distance from the reference, of the worse bound; no less than the reference's own [-].
    seconds : float
        Time of the processor [s].
    said : str
        What it gave, in words.
    bounded : bool
        Whether the truth must lie between its bounds.
    wanted : float or None
        Width of the bounds that was asked for [-]; None where the model cannot be asked.
    lower_f_per_m2, upper_f_per_m2 : float or None
        Bounds of a capacitance; equal for a formula that gives none [F/m2].
    front : bool
        Whether nothing is quicker and at least as near.
    """

    scene: str
    model: str
    error: float
    seconds: float
    said: str
    bounded: bool = False
    wanted: float | None = None
    lower_f_per_m2: float | None = None
    upper_f_per_m2: float | None = None
    front: bool = False


@dataclass(frozen=True)
class Silent:
    """A model that gave nothing on a scene, and why."""

    scene: str
    model: str
    why: str


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """What some work gives, and the processor's time for it: the median of several runs of quick work [s]."""
    taken: list[float] = []
    while len(taken) < _REPEATS and sum(taken) < (_AGAIN_S if len(taken) == 1 else _QUICK_S):
        start = time.process_time()
        found = work()
        taken.append(time.process_time() - start)
    return found, sorted(taken)[(len(taken) - 1) // 2]


def with_front(found: Sequence[Point]) -> list[Point]:
    """Points by time, those marked than which none is quicker and at least as near."""
    ordered, best = [], math.inf
    for point in sorted(found, key=lambda p: (p.seconds, p.error)):
        ordered.append(replace(point, front=point.error < best))
        best = min(best, point.error)
    return ordered
