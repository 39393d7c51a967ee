"""The one way from a body to numbers: what a sensor should measure, each quantity with its range."""

from dataclasses import asdict, replace

from sensorgen.core import cache
from sensorgen.core.records import adapter
from sensorgen.design.body import Body
from sensorgen.prediction import bodies
from sensorgen.prediction.query import DEFAULT, Query
from sensorgen.prediction.results import SCHEMA, Prediction, from_json


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
    return replace(prediction, drawn=evaluate(bodies.drawn(body.design), query, keep=keep))


def _stored(body: Body, query: Query) -> Prediction:
    question = {"what": "prediction", "body": body.identity, "query": asdict(query), "schema": SCHEMA}
    text = cache.answer(question, lambda: adapter(Prediction).dump_json(_computed(body, query)).decode())
    return replace(from_json(text), design=body.design.name, body=body.provenance)


def _computed(body: Body, query: Query) -> Prediction:
    from sensorgen.prediction import quantities  # the models: a stored prediction does without

    return quantities.prediction(body, query)
