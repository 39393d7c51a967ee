"""What is expected of a specimen, logged before anybody measures it."""

import json
from pathlib import Path

from sensorgen.core.errors import MissingValue
from sensorgen.design.design import Design
from sensorgen.measure.log.batches import prediction
from sensorgen.measure.log.entries import Entry
from sensorgen.measure.log.logbook import Log
from sensorgen.measure.log.words import design_like, named

OUT = Path("out")  # folder of the designs' folders, where build and slice write


def predict(log: Log, specimen: str) -> list[Entry]:
    """Log a prediction of a specimen's design, if the log has none yet.

    Parameters
    ----------
    log : Log
        An open one.
    specimen : str
        The specimen's name.

    Returns
    -------
    list of Entry
        The prediction, if it is new.

    Raises
    ------
    BadInput
        A name that cannot be read.
    MissingValue
        The name does not tell the design, or its print bed had another one, whose file alone can be predicted.
    """
    told, name = named(specimen)
    design = design_like(name)
    printed = [row.design_id for row in log.prints(specimen=str(told["specimen"]))][-1:]
    wanted = printed or ([design.id()] if design else [])
    if wanted and log.predictions(design_id=wanted[0]):
        return []
    if design is None or design.id() != wanted[0]:
        raise MissingValue(f"{specimen!r} does not tell its design: sensorgen log predict takes the design's file")
    return log.add([predicted_row(design)])


def predicted_row(design: Design) -> Entry:
    """The prediction of a design's print as a row of the log."""
    from sensorgen.prediction import bodies
    from sensorgen.prediction.evaluate import evaluate
    from sensorgen.prediction.results import to_json

    found = evaluate(bodies.default_body(design, OUT / design.name))
    return prediction(design.id(), design.name, json.loads(to_json(found)))
