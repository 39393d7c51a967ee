"""Compression along a sweep: cached designs first, the others in parallel processes."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from sensorgen.core import cache as cached
from sensorgen.core.errors import BadInput, MissingValue, OutOfRange
from sensorgen.core.parallel import in_parallel, said
from sensorgen.design.body import Body
from sensorgen.prediction.capacitance import Unpredictable
from sensorgen.prediction.compression import Asked, Data, answer

Kept = list[tuple[Any, Any]]


def answers(points: Sequence[Body], asked: Asked, jobs: int, done: Callable[[], None]) -> list[Data | str]:
    """Compression of designs, those that are not cached in several processes; a reason where one fails.

    Parameters
    ----------
    points : sequence of Body
        In the order of the answers.
    asked : Asked
        As of :func:`sensorgen.prediction.compression.answer`.
    jobs : int
        How many processes at once, 1 or more.
    done : callable
        Called after each.

    Raises
    ------
    NotInstalled
        A model that was asked for by name needs a library.
    SensorgenError
        Bounds that cross; a process that ended before its answer, as when the memory is full.
    """
    found = {k: known for k, point in enumerate(points) if (known := _known(point, asked)) is not None}
    for _ in found:
        done()
    missing = [k for k in range(len(points)) if k not in found]
    for n, (result, entries) in in_parallel(_apart, [(points[k], asked) for k in missing], jobs):
        for entry in entries:  # this process alone writes: the others may be ended at any moment
            cached.keep(*entry)
        found[missing[n]] = result
        done()
    return [found[k] for k in range(len(points))]


def _known(body: Body, asked: Asked) -> Data | str | None:
    """The answer of a point, or why there is none, if nothing has to be solved for it."""
    if not asked.keep:
        return None
    try:
        with cached.only_known():
            return _said(body, asked)
    except cached.Unknown:
        return None


def _apart(body: Body, asked: Asked) -> tuple[Data | str, Kept]:
    """The answer of a point, or why there is none; and what is to be kept of it."""
    with cached.held_back() as entries:
        return _said(body, asked), entries


def _said(body: Body, asked: Asked) -> Data | str:
    work = partial(answer, body, asked)
    return said(work, refused=(BadInput, MissingValue, OutOfRange, Unpredictable))
