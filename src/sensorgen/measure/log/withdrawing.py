"""Take a row of any kind out of use, without removing it."""

import uuid

from sensorgen.core.errors import BadInput
from sensorgen.measure.log.entries import KINDS, Entry, Withdrawal
from sensorgen.measure.log.logbook import Log


def withdraw(log: Log, kind: str, number: int, reason: str) -> Entry:
    """Log that a row is withdrawn.

    Parameters
    ----------
    log : Log
        An open log.
    kind : str
        Kind of the row: reading, recording, prediction, calibration, print, batch, design or raw-file.
    number : int
        Its number among its kind.
    reason : str
        Why; must not be empty.

    Raises
    ------
    BadInput
        No reason, no such row, or one that is out of use already.
    """
    if not reason.strip():
        raise BadInput("an empty reason; expected why the row is withdrawn")
    name = {"recording": "bench_run"}.get(kind, kind.replace("-", "_"))
    row = next(log.entries(KINDS[name], superseded=True, number=number), None)
    if row is None:
        raise BadInput(
            f"no {kind} {number} in the log {str(log.path)!r}; sensorgen log list and log show have the numbers"
        )
    return log.add([Withdrawal(uid=uuid.uuid4().hex, of=name, supersedes=row.uid, reason=reason)])[0]
