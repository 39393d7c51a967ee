"""Whether a log is what was logged: the database, what refers to what, and the raw files."""

import json
from collections.abc import Iterator
from hashlib import sha256

from sensorgen.core.errors import BadInput
from sensorgen.measure.log import files
from sensorgen.measure.log.entries import Prediction, RawFile
from sensorgen.measure.log.logbook import TABLES, Log


def faults(log: Log) -> Iterator[str]:
    """What is wrong with a log, in words; nothing where all is well.

    Parameters
    ----------
    log : Log
        An open one.
    """
    try:
        unsound = (said for said in log.pragma("integrity_check") if said != "ok")
        yield from (f"database: {' '.join(said.split()):.200}" for said in unsound)
        lost = log.pragma("foreign_key_check")
        yield from (f"{table!r:.60}: a row refers to one that is not there" for table in lost)
        for kind in TABLES:
            for _ in log.entries(kind, superseded=True):
                pass  # reading it says what is wrong
        yield from files.faults(log.files, log.entries(RawFile))
        yield from (
            f"prediction {p.number} is not what was made then" for p in log.predictions() if p.uid != prediction_uid(p)
        )
    except BadInput as error:
        yield str(error)


def prediction_uid(prediction: Prediction) -> str:
    """What a prediction has to be called: a hash of what it says."""
    text = json.dumps([prediction.design_id, prediction.design, prediction.version, prediction.data])
    return sha256(text.encode()).hexdigest()
