"""Verify a log: the chain of its records, SQLite's integrity, references between rows, raw files, and anchors.

An anchor is the head of the log in a file outside, for git, a notebook or mail: proof that its records were there then.
"""

import re
import uuid
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from sensorgen.core.document import Part
from sensorgen.core.errors import BadInput
from sensorgen.core.files import reading, writing
from sensorgen.measure.log import chain, files
from sensorgen.measure.log.entries import KINDS, REFERENCES, ROWS, Anchor, Entry, RawFile, Value, indexed, word
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
    last = head(log)
    if not last.head:
        raise BadInput(f"the log {str(log.path)!r} is empty: nothing to anchor")
    now = datetime.now(UTC).isoformat(timespec="seconds")
    with writing(file), file.open("a", encoding="utf-8") as text:
        text.write(f"{now} record {last.records} {last.head} {log.path.name}\n")
    log.add([Anchor(uid=uuid.uuid4().hex, head=last.head, file=file.name)])
    return last


MOST_FAULTS = 40  # that are shown to people; JSON has all
_ANCHORED = re.compile(r"\b[0-9a-f]{64}\b")


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
    head : str
        Identity of the last record.
    notes : tuple of str
        What is no fault, but worth knowing.
    """

    log: str
    rows: int
    faults: tuple[str, ...]
    head: str = ""
    notes: tuple[str, ...] = ()

    def document(self) -> Iterator[Part]:
        """The faults, or that there are none; the head and the notes."""
        yield from self.faults[:MOST_FAULTS]
        if len(self.faults) > MOST_FAULTS:
            yield f"... and {len(self.faults) - MOST_FAULTS} more faults"
        if not self.faults:
            yield f"the log is sound: {self.rows} rows, head {self.head or 'none'}"
        yield self.log
        yield from self.notes


def verified(log: Log, anchors: Path | None = None) -> Verified:
    """Verify an open log.

    Parameters
    ----------
    log : Log
        An open log.
    anchors : Path, optional
        A text file with heads of the log, as ``sensorgen log anchor`` writes it, or a mail that has them.
    """
    notes: list[str] = []
    wrong = (*faults(log, notes), *(_anchor_faults(log, anchors, notes) if anchors else ()))
    rows = 0 if wrong else sum(log.count(kind, superseded=True) for kind in ROWS)
    return Verified(str(log.path), rows, wrong, "" if wrong else log.head()[1], tuple(notes))


def faults(log: Log, notes: list[str] | None = None) -> Iterator[str]:
    """Faults of a log, as messages; none where it is sound.

    Parameters
    ----------
    log : Log
        An open log.
    notes : list of str, optional
        Grows by what is no fault.
    """
    try:
        for message in log.pragma("integrity_check"):
            if message != "ok":
                yield f"database: {' '.join(message.split()):.200}"
        yield from _chain_faults(log, [] if notes is None else notes)
        for kind, references in REFERENCES.items():
            for name, other in references.items():
                yield from _missing(log, kind, name, other)
        yield from files.faults(log.files, log.entries(RawFile, superseded=True))
    except BadInput as error:
        yield str(error)


def _chain_faults(log: Log, notes: list[str]) -> Iterator[str]:
    """Records that are changed, missing or out of order."""
    counts: Counter[str] = Counter()
    before, clock, place, late = "", "", 0, list[int]()
    for place, stored in enumerate(log.stored(), 1):
        record = stored[0]
        yield from _record_faults(log, place, before, counts, *stored)
        if record.parents == (before,) and record.logged_at < clock:
            late.append(place)
        before, clock = record.id, record.logged_at
    count, head = log.head()
    if (count, head) != (place, before):
        yield f"the last record is number {place}, {before[:12]}; expected number {count}, {head[:12]}"
    if late:
        back = "the clock was set back; the order of the records holds"
        notes.append(f"{len(late)} records are dated before the one that they follow, the first is {late[0]}: {back}")


def _record_faults(
    log: Log, place: int, before: str, counts: Counter[str], record: chain.Record, sequence: int, number: int | None,
    index: tuple[Value, ...],
) -> Iterator[str]:  # fmt: skip
    """Faults of one record, by its place and the record before; the counts by kind rise with it."""
    if not chain.sound(record) or record.kind not in KINDS:
        yield f"record {place}, a {record.kind!r:.40}, is not what was logged"
    if index != indexed(record.content):
        yield f"record {place}: the index does not have what the record holds"
    if sequence != place or not _follows(log, record, sequence, before):
        yield f"record {place} follows one that is missing or was moved"
    counts[record.kind] += number is not None
    if number != counts[record.kind] and not (number is None and log.is_copy(sequence)):
        yield f"record {place} has number {number} among its kind; expected {counts[record.kind]}"


def _follows(log: Log, record: chain.Record, sequence: int, before: str) -> bool:
    """Test whether all that a record follows is there; another machine's log may begin anywhere before a merge."""
    if not record.parents:
        return not before or log.merged_after(sequence)
    return all(parent == before or 0 < log.sequence(parent) < sequence for parent in record.parents)


def _missing(log: Log, kind: type[Entry], name: str, other: type[Entry]) -> Iterator[str]:
    known = {row.uid for row in log.entries(other, superseded=True)}
    for row in log.entries(kind, superseded=True):
        uid = getattr(row, name)
        if uid and uid not in known:
            yield f"{word(kind)} {row.number} refers to {word(other)} {uid!r:.40}, which is not there"


def _anchor_faults(log: Log, path: Path, notes: list[str]) -> Iterator[str]:
    with reading(path):
        heads = _ANCHORED.findall(path.read_text("utf-8", "replace"))
    if not heads:
        raise BadInput(f"{str(path)!r} has no head of a log; expected a text as sensorgen log anchor writes it")
    missing = [head for head in heads if not log.sequence(head)]
    if missing:
        yield f"{len(missing)} of {len(heads)} heads in {str(path)!r} are not in the log: {missing[0][:12]}..."
    else:
        notes.append(f"all {len(heads)} heads in {str(path)!r} are in the log")
