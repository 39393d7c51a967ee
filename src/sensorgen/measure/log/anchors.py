"""Write the head of the log to a file outside, for git, a notebook or mail: proof that its records were there then."""

import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from sensorgen.core.document import Part
from sensorgen.core.errors import BadInput, Unwritable
from sensorgen.measure.log.entries import Anchor
from sensorgen.measure.log.logbook import Log


@dataclass(frozen=True)
class Head:
    """The last record of a log.

    Attributes
    ----------
    records : int
        Number of records.
    head : str
        Identity of the last one, which depends on all before it.
    log : str
        The log's file.
    """

    records: int
    head: str
    log: str

    def document(self) -> Iterator[Part]:
        """The identity first."""
        yield self.head or "the log is empty"
        yield f"record {self.records} of {self.log}"


def head(log: Log) -> Head:
    """The last record of an open log."""
    return Head(*log.head(), str(log.path))


def anchor(log: Log, file: Path) -> Head:
    """Append the head to a text file, and log that it was done.

    Parameters
    ----------
    log : Log
        An open log.
    file : Path
        A text file, which is made if it is missing.

    Raises
    ------
    BadInput
        The log is empty.
    Unwritable
        The file cannot be written.
    """
    found = head(log)
    if not found.head:
        raise BadInput(f"the log {str(log.path)!r} is empty: nothing to anchor")
    now = datetime.now(UTC).isoformat(timespec="seconds")
    try:
        with file.open("a", encoding="utf-8") as text:
            text.write(f"{now} record {found.records} {found.head} {log.path.name}\n")
    except OSError as error:
        raise Unwritable(f"cannot write to {str(file)!r}: {error.strerror or error}") from None
    log.add([Anchor(uid=uuid.uuid4().hex, head=found.head, file=file.name)])
    return found
