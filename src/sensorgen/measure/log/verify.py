"""Verify a log: SQLite's integrity, references between rows, raw files, and hashes of predictions."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256

from sensorgen.core.document import Part
from sensorgen.core.errors import BadInput
from sensorgen.measure.log import files
from sensorgen.measure.log.entries import Prediction, RawFile
from sensorgen.measure.log.logbook import TABLES, Log


@dataclass(frozen=True)
class Verified:
    """Result of a verification.

    Attributes
    ----------
    log : str
        The log's file.
    rows : int
        Number of its rows, if it is sound; else 0.
    faults : tuple of str
        What is wrong.
    """

    log: str
    rows: int
    faults: tuple[str, ...]

    def document(self) -> Iterator[Part]:
        """The faults, or that there are none."""
        yield from self.faults or (f"the log is sound: {self.rows} rows", self.log)


def verified(log: Log) -> Verified:
    """Verify an open log."""
    found = tuple(faults(log))
    rows = 0 if found else sum(log.count(kind, superseded=True) for kind in TABLES)
    return Verified(str(log.path), rows, found)


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
