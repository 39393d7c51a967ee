"""Rows of a table that was edited after it was logged: each corrects the reading that it came from, or is refused."""

import dataclasses
from collections.abc import Iterable, Iterator
from hashlib import sha256
from operator import attrgetter

from sensorgen.core.errors import BadInput
from sensorgen.measure.log.entries import Reading
from sensorgen.measure.log.logbook import Log

_measured = attrgetter(  # what makes a row another measurement; edits of all else correct it
    "y_words", "z_words", "y_ohm", "z_ohm", "instrument", "quantity", "value", "frequency_hz", "uncertainty", "wires",
    "temperature_c", "humidity_percent", "photo", "file", "defects",
)  # fmt: skip


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
        taken_back = next(log.entries(Reading, replaced=True, uid=row.uid), None) is not None  # an edit, perhaps
        old = _in_place(row, gone.values(), alike=bool(kept)) or (None if taken_back else _same(row, gone.values()))
        other = next((old for old in gone.values() if old.specimen == row.specimen), None)
        if old:
            del gone[old.uid]
            uid = sha256(f"{row.uid} {old.uid}".encode()).hexdigest()[:32] if taken_back else row.uid
            yield dataclasses.replace(row, uid=uid, supersedes=old.uid)
        elif other and not taken_back:
            raise BadInput(
                f"{table}, row {(row.source_row or 0) + 1}: not what reading {other.number} of {other.specimen} was in "
                f"a table of this name. If it corrects that one: sensorgen log withdraw reading {other.number} "
                "--reason corrected, and import again. If it is another table: give the file another name"
            )
        else:
            yield row


def _in_place(row: Reading, gone: Iterable[Reading], *, alike: bool) -> Reading | None:
    """Reading in a row's place with its values, or, of a table that is ``alike`` otherwise, of its specimen."""
    here = (old for old in gone if old.source_row == row.source_row)
    return next((o for o in here if _measured(o) == _measured(row) or (alike and o.specimen == row.specimen)), None)


def _same(row: Reading, gone: Iterable[Reading]) -> Reading | None:
    """Reading of a row's specimen with its values."""
    return next((o for o in gone if o.specimen == row.specimen and _measured(o) == _measured(row)), None)
