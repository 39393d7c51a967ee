"""Predict a specimen's design and log the prediction before the specimen is measured."""

import json

from sensorgen.core.errors import MissingValue
from sensorgen.design.design import Design
from sensorgen.measure.log import notes
from sensorgen.measure.log.entries import Entry, Prediction
from sensorgen.measure.log.logbook import Log
from sensorgen.measure.log.prints import design_row, designs, prediction


def predict(log: Log, specimen: str) -> list[Entry]:
    """Log a prediction of a specimen's design, unless the log has one.

    Parameters
    ----------
    log : Log
        An open log.
    specimen : str
        Name of the specimen.

    Returns
    -------
    list of Entry
        The new prediction, if there is one.

    Raises
    ------
    BadInput
        A name that cannot be parsed.
    MissingValue
        The name stands for no design, or the log lacks the design that it is bound to.
    """
    bound = log.bound(notes.specimen(specimen, log).specimen)
    design = designs(log).get(bound.design_id) if bound else notes.design_of(specimen)
    design_id = bound.design_id if bound else design.id() if design else ""
    if design_id and log.predictions(design_id=design_id):
        return []
    if design is None:
        raise MissingValue(f"{specimen!r} names no design; log a prediction of its file: sensorgen log predict FILE")
    return [row for row in log.add(predicted_rows(design)) if isinstance(row, Prediction)]


def predicted_rows(design: Design) -> list[Entry]:
    """A design and the prediction of its print, as rows of the log."""
    from sensorgen.prediction import bodies
    from sensorgen.prediction.evaluate import evaluate
    from sensorgen.prediction.results import to_json

    predicted = evaluate(bodies.default_body(design))
    return [
        design_row(design.id(), design.name, design.resolved()),
        prediction(design.id(), design.name, json.loads(to_json(predicted))),
    ]
