"""What is expected of a specimen, logged before anybody measures it."""

from sensorgen.core.errors import MissingValue
from sensorgen.measure.log.batches import prediction
from sensorgen.measure.log.entries import Entry
from sensorgen.measure.log.logbook import Log
from sensorgen.measure.log.words import design_like, named


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
    from sensorgen.prediction.prediction import prediction as predicted

    told, name = named(specimen)
    design = design_like(name)
    printed = [row.design_id for row in log.prints(specimen=str(told["specimen"]))][-1:]
    wanted = printed or ([design.id()] if design else [])
    if wanted and log.predictions(design_id=wanted[0]):
        return []
    if design is None or design.id() != wanted[0]:
        raise MissingValue(f"{specimen!r} does not tell its design: sensorgen log predict takes the design's file")
    return log.add([prediction(design.id(), design.name, predicted(design))])
