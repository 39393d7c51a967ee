"""Verify a log: SQLite's integrity, references between rows, raw files, and hashes of predictions."""

import json
from collections.abc import Iterator
from hashlib import sha256

from sensorgen.core.errors import BadInput
from sensorgen.measure.log import files
from sensorgen.measure.log.entries import Prediction, RawFile
from sensorgen.measure.log.logbook import TABLES, Log


def faults(log: Log) -> Iterator[str]:
    """Faults of a log, as messages; none where it is sound.

    Parameters
    ----------
    log : Log
        An open log.
    """
    try:
        for message in log.pragma("integrity_check"):
            if message != "ok":
                yield f"database: {' '.join(message.split()):.200}"
        for table in log.pragma("foreign_key_check"):
            yield f"{table!r:.60}: a row refers to one that is not there"
        for kind in TABLES:
            for _ in log.entries(kind, superseded=True):
                pass  # reading a damaged row raises
        yield from files.faults(log.files, log.entries(RawFile))
        for prediction in log.predictions():
            if prediction.uid != prediction_uid(prediction):
                yield f"prediction {prediction.number} is not what was logged"
    except BadInput as error:
        yield str(error)


def prediction_uid(prediction: Prediction) -> str:
    """Identity of a prediction: a hash of its content."""
    text = json.dumps([prediction.design_id, prediction.design, prediction.version, prediction.data])
    return sha256(text.encode()).hexdigest()
