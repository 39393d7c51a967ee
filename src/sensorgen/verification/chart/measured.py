"""Answers of models with their times; those that no other beats; models without an answer."""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.errors import OutOfRange
from sensorgen.core.parallel import used_s

_QUICK_S = 0.3  # runs shorter than this are repeated, and the median counts
_REPEATS = 5
_AGAIN_S = 1.0  # a first run shorter than this is repeated, in case it had to import

_DEARER = 10.0  # how many times longer the next level may take than the last one

DIGITS = 2.0**-53  # no error is less than this

Level = tuple[str, Callable[[], Any]]  # words, and work that gives a value, or None where there is none
Ladder = tuple[str, Iterable[Level]]  # a model, and its levels from coarse to fine
Judge = Callable[[Any], tuple[float, str]]  # from a value to its error and words


@dataclass(frozen=True)
class ChartPoint:
    """Answer of one model on one scene.

    Attributes
    ----------
    scene, model : str
        Names; a model's begins with its own, and goes on after a colon where it has several ways.
    error : float
        Relative distance from the reference, of the worse bound; no less than the reference's own [-].
    seconds : float
        Time of the processor [s].
    result : str
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
    result: str
    bounded: bool = False
    wanted: float | None = None
    lower_f_per_m2: float | None = None
    upper_f_per_m2: float | None = None
    front: bool = False


@dataclass(frozen=True)
class SilentModel:
    """A model that gave nothing on a scene, and why."""

    scene: str
    model: str
    why: str


@dataclass(frozen=True)
class SceneKind:
    """Standard scenes with the same question.

    Attributes
    ----------
    asked : str
        The question.
    scenes : collection of str
        Names.
    points : callable
        Measures every model on one of them. A finer level is not tried where that would take longer than a budget [s],
        estimated as ten times the last one.
    why_not_applicable : callable
        Why models do not apply to one of them, by model.
    """

    asked: str
    scenes: Collection[str]
    points: Callable[[str, float], list[ChartPoint]]
    why_not_applicable: Callable[[str], dict[str, str]]


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Result of some work, and the processor's time for it: the median of several runs of quick work [s]."""
    taken: list[float] = []
    while len(taken) < _REPEATS and sum(taken) < (_AGAIN_S if len(taken) == 1 else _QUICK_S):
        start = used_s()
        result = work()
        taken.append(used_s() - start)
    return result, sorted(taken)[(len(taken) - 1) // 2]


def climb(levels: Iterable[tuple[Any, Callable[[], Any]]], budget_s: float) -> Iterator[tuple[Any, Any, float]]:
    """Label, value and seconds of each level of a model, until the next one would take too long.

    Parameters
    ----------
    levels : iterable of (label, callable)
        From coarse to fine; the first that raises OutOfRange ends them, one that gives None is left out.
    budget_s : float
        A finer level is not tried where that would take longer, estimated as ten times the last one [s].
    """
    for level, work in levels:
        try:
            value, seconds = timed(work)
        except OutOfRange:
            return
        if value is not None:
            yield level, value, seconds
        if _DEARER * seconds > budget_s:
            return


def climbed(scene: str, ladders: Iterable[Ladder], judge: Judge, budget_s: float) -> Iterator[ChartPoint]:
    """Points of models on a scene, each from coarse to fine as in :func:`climb`, compared with its reference."""
    for model, levels in ladders:
        for level, value, seconds in climb(levels, budget_s):
            error, words = judge(value)
            yield ChartPoint(scene, model, error, seconds, level + words)


def relative(known: ArrayLike, known_to: float, words: str = "off by {:+.3g} at most") -> Judge:
    """Judge by the relative difference that is largest; no error is less than that of the reference."""

    def judge(value: Any) -> tuple[float, str]:
        off = np.atleast_1d(np.asarray(value) / np.asarray(known) - 1)
        worst = float(off[np.argmax(np.abs(off))])
        return max(abs(worst), known_to), words.format(worst)

    return judge


def with_front(points: Sequence[ChartPoint]) -> list[ChartPoint]:
    """Points by time, those marked than which none is quicker and at least as near."""
    ordered, best = [], math.inf
    for point in sorted(points, key=lambda p: (p.seconds, p.error)):
        ordered.append(replace(point, front=point.error < best))
        best = min(best, point.error)
    return ordered
