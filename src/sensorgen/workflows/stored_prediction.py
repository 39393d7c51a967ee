"""Predict a specimen's design and log the prediction before the specimen is measured."""

import json

from sensorgen.core.errors import MissingValue
from sensorgen.design.design import Design
from sensorgen.measure.log import notes
from sensorgen.measure.log.batches import design_row, prediction
from sensorgen.measure.log.entries import Entry, Prediction
from sensorgen.measure.log.logbook import Log


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
        The name stands for no design, or the specimen was printed from another design, whose file must be predicted.
    """
    design = notes.design_of(specimen)
    printed = [row.design_id for row in log.prints(specimen=notes.specimen(specimen).specimen)][-1:]
    design_ids = printed or ([design.id()] if design else [])
    if design_ids and log.predictions(design_id=design_ids[0]):
        return []
    if design is None or design.id() != design_ids[0]:
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
