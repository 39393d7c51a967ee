"""Rows of a table that was edited after it was logged: each corrects the reading that it came from, or is refused."""

import dataclasses
from collections.abc import Iterable, Iterator
from hashlib import sha256

from sensorgen.core.errors import BadInput
from sensorgen.measure.log.entries import SPECIMEN_COLUMNS, Reading
from sensorgen.measure.log.fields import columns
from sensorgen.measure.log.logbook import Log

_WORDS = {
    "remark",
    "baked",
    "doubts",
    "measured_at",
    "written",
    *SPECIMEN_COLUMNS,
}  # edits that are no other measurement
_ORIGIN = {
    "uid",
    "number",
    "logged_at",
    "claimed_at",
    "source",
    "source_row",
    "supersedes",
    "batch",
    "design_id",
    "design",
}
_MEASURED = [name for name in columns(Reading) if name not in _WORDS | _ORIGIN]


def corrections(log: Log, rows: Iterable[Reading], table: str) -> Iterator[Reading]:
    """Rows of a table; those that were edited correct the readings that they came from.

    A row was edited where the log has a reading of a table of this name that the table does not have any more: with
    the same values, for the same specimen or in the same row; or, in a table with other rows that the log has, of the
    same specimen in the same row.

    Parameters
    ----------
    log : Log
        An open log.
    rows : iterable of Reading
        All rows of the table; given on as they come where the log has none of a table of this name.
    table : str
        Its name.

    Raises
    ------
    BadInput
        A row that may be another measurement, or an edit.
    """
    current = {reading.uid: reading for reading in log.entries(Reading, source=table)}
    rows = list(rows) if current else rows
    kept = {row.uid for row in rows} & current.keys() if current else set()
    gone = {reading.uid: reading for reading in current.values() if reading.uid not in kept}
    for row in rows:
        if row.uid in kept or not gone or next(log.entries(Reading, uid=row.uid), None):
            yield row
            continue
        replaced = next(
            log.entries(Reading, replaced=True, uid=row.uid), None
        )  # by an edit that was taken back, perhaps
        same = [old for old in gone.values() if _measured(old) == _measured(row) and old.specimen == row.specimen]
        here = [old for old in gone.values() if old.source_row == row.source_row
                and (_measured(old) == _measured(row) or (kept and old.specimen == row.specimen))]  # fmt: skip
        old = next(iter(here if replaced else (*here, *same)), None)
        other = next((old for old in gone.values() if old.specimen == row.specimen), None)
        if old:
            del gone[old.uid]
            uid = sha256(f"{row.uid} {old.uid}".encode()).hexdigest()[:32] if replaced else row.uid
            yield dataclasses.replace(row, uid=uid, supersedes=old.uid)
        elif other and not replaced:
            raise BadInput(
                f"{table}, row {(row.source_row or 0) + 1}: not what reading {other.number} of {other.specimen} was in "
                f"a table of this name. If it corrects that one: sensorgen log withdraw reading {other.number} "
                "--reason corrected, and import again. If it is another table: give the file another name"
            )
        else:
            yield row


def _measured(reading: Reading) -> list[object]:
    return [getattr(reading, name) for name in _MEASURED]
