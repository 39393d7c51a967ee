"""The one way from a body to numbers: what a sensor should measure, each quantity with its range."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import asdict, replace
from functools import partial
from typing import Any

from sensorgen.core import cache, parallel
from sensorgen.core.errors import SensorgenError
from sensorgen.design.body import Body
from sensorgen.prediction import bodies
from sensorgen.prediction.query import DEFAULT, Query
from sensorgen.prediction.results import SCHEMA, Prediction

_AHEAD: ContextVar[Callable[[], object]] = ContextVar("_AHEAD", default=lambda: None)


def evaluate(body: Body, query: Query = DEFAULT, *, keep: bool = True, beside: bool = True) -> Prediction:
    """Prediction of a body.

    Parameters
    ----------
    body : Body
        Drawn or printed; a print's prediction has the drawing's beside it.
    query : Query
        Frequencies, reference load, tip, accuracy.
    keep : bool
        Read the stored prediction of this body and query where there is one, and store a new one.
    beside : bool
        Predict the drawing of a print, too.

    Returns
    -------
    Prediction
        Its ``status`` and ``reason`` say where nothing can be predicted, as of a short.

    Raises
    ------
    OutOfRange, BadInput, UnknownName
        A query that no sensor can answer: an accuracy or a noise that is not above 0, a tip that does not fit.
    """
    query = query.of(body.design)
    prediction = _stored(body, query) if keep else _computed(body, query)
    if body.is_drawn or not beside:
        return prediction
    _AHEAD.get()()
    return replace(prediction, drawn=evaluate(bodies.drawn(body.design), query, keep=keep))


@contextmanager
def ahead(of: Callable[[], Body], query: Query = DEFAULT, *, wanted: bool = True) -> Iterator[Callable[[], object]]:
    """Another process that predicts a body beside what is done within, such as slicing; a call waits for it.

    :func:`evaluate` waits before it reads a drawing's prediction. On one core, and where the prediction is stored, no
    process starts.

    Parameters
    ----------
    of : callable
        Gives the body, in either process: a function of a module, or a part of one.
    query : Query
        As of :func:`evaluate`.
    wanted : bool
        False starts none.
    """
    running = list[Future[Any]]()
    with ExitStack() as stack:
        if wanted and parallel.cores() > 1 and not is_stored(of, query):
            (lane,) = stack.enter_context(parallel.open_lanes(1))
            running.append(lane.submit(_predict, [(of, query)]))
            stack.callback(_end, lane, running[0])
        stack.callback(_AHEAD.reset, _AHEAD.set(partial(wait, running)))
        yield partial(wait, running)


def _end(lane: parallel.Lane, running: Future[Any]) -> None:
    """End a process that was not waited for: what it predicts is of no use."""
    if not running.done():
        lane.end()


def is_stored(of: Callable[[], Body], query: Query = DEFAULT) -> bool:
    """Test whether the prediction of a body, and whatever is asked to know the body, is stored."""
    try:
        with cache.only_known():
            _predict(of, query)
    except cache.Unknown:
        return False
    return True


def _predict(of: Callable[[], Body], query: Query) -> None:
    """Predict a body, for the stored prediction alone."""
    with suppress(SensorgenError):  # which whoever asks for it meets and reports
        evaluate(of(), query)


def _stored(body: Body, query: Query) -> Prediction:
    question = {"what": "prediction", "body": body.identity, "query": asdict(query), "schema": SCHEMA}
    prediction = cache.record(question, Prediction, partial(_computed, body, query))
    return replace(prediction, design=body.design.name, body=body.provenance)


def _computed(body: Body, query: Query) -> Prediction:
    from sensorgen.prediction import quantities  # the models: a stored prediction does without

    return quantities.prediction(body, query)
