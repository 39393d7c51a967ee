"""The log: readings, recordings, prints and predictions of specimens in one append-only SQLite file."""

import dataclasses
import itertools
import uuid
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from sensorgen.core import files as store
from sensorgen.core.errors import BadInput, MissingValue, SensorgenError, UnknownName, within
from sensorgen.measure.log import chain, database, files
from sensorgen.measure.log.chain import Record
from sensorgen.measure.log.database import Appender
from sensorgen.measure.log.entries import (
    COLUMNS,
    INDEXED,
    KINDS,
    NAMES,
    REFERENCES,
    SPECIMEN_COLUMNS,
    VERSIONS,
    Anchor,
    Batch,
    BenchRun,
    Entry,
    Merge,
    Migration,
    Prediction,
    Print,
    RawFile,
    Reading,
    Specimen,
    Value,
    Withdrawal,
    decode,
    indexed,
    word,
)

PLACE = "SENSORGEN_LOG"  # environment variable with another file
_FROM_PRINT = ("batch", "design_id", "design")
# what may differ between copies of one row that several machines have imported
_LOCAL = ("number", "logged_at", "claimed_at", *_FROM_PRINT)
_FIELDS = "id, parents, kind, version, logged_at, content"
# of the kind that is the first value: withdrawn rows; a correction that counts in place of another one of the same row,
# as two machines may make them, by an order that all machines share; and all that is corrected, withdrawn or lost so
_WITHDRAWN = "SELECT supersedes FROM record WHERE kind = 'withdrawal' AND json_extract(content, '$.of') = ?1"
_TIME = "ifnull(nullif(json_extract({0}.content, '$.claimed_at'), ''), {0}.logged_at)"  # also of imported rows
_PREFERRED = (
    "other.supersedes = row.supersedes AND +other.kind = ?1 AND other.number IS NOT NULL AND "
    f"({_TIME.format('other')}, other.id) > ({_TIME.format('row')}, row.id) AND other.uid NOT IN ({_WITHDRAWN})"
)
_SUPERSEDED = (
    "SELECT supersedes FROM record WHERE supersedes IS NOT NULL AND (+kind = ?1 "  # noqa: S608
    "OR +kind = 'withdrawal' AND json_extract(content, '$.of') = ?1) "
    "UNION SELECT uid FROM (WITH RECURSIVE lost(uid) AS (SELECT row.uid FROM record row WHERE +row.kind = ?1 AND "
    f"row.supersedes IS NOT NULL AND row.number IS NOT NULL AND EXISTS (SELECT 1 FROM record other WHERE {_PREFERRED}) "
    "UNION SELECT record.uid FROM record JOIN lost ON record.supersedes = lost.uid AND +record.kind = ?1) "
    "SELECT uid FROM lost)"
)
_Kind = TypeVar("_Kind", bound=Entry)


def place() -> Path:
    """Default file of the log: that of ``SENSORGEN_LOG``, else in the system's folder for a user's data.

    One log for all working folders, and never below ``out/``, which may be deleted.
    """
    return store.data(PLACE, "log.db")


class Log(AbstractContextManager["Log", None]):
    """A log; use it in a ``with`` statement.

    Parameters
    ----------
    path : Path
        SQLite file.
    create : bool
        Whether to create a missing file.

    Attributes
    ----------
    passed_over : Counter
        Number of rows of the latest :meth:`add` that were there, by the source there and their own.

    Examples
    --------
    >>> import tempfile
    >>> from sensorgen.measure.log.entries import Reading
    >>> with tempfile.TemporaryDirectory() as folder, Log(Path(folder) / "log.db", create=True) as log:
    ...     new = log.add([Reading(uid="1", specimen="23 triX", iteration=23, written="23 triX", y_ohm=(680.0,))])
    ...     [(r.number, r.specimen, r.y_ohm) for r in log.readings(iteration=23)]
    [(1, '23 triX', (680.0,))]
    """

    def __init__(self, path: Path, *, create: bool = False) -> None:
        self.path = path = Path(path)
        self._connection = database.connect(path, create=create)
        self.passed_over: Counter[tuple[str, str]] = Counter()
        self._printed: dict[str, dict[str, Any]] = {}  # batch and design of the latest print, while rows are added

    def __exit__(self, *_: object) -> None:
        self._connection.close()

    @property
    def files(self) -> Path:
        """Folder of raw files, beside the log."""
        return self.path.with_name(f"{self.path.name}.files")

    def raw(self, sha256: str) -> Path:
        """Path of the raw file with that SHA-256.

        Raises
        ------
        MissingValue
            The log has no such raw file.
        """
        file = next(self.entries(RawFile, uid=sha256), None)
        if file is None:
            raise MissingValue(f"no raw file {sha256!r:.80} in the log {str(self.path)!r}")
        return files.place(self.files, file)

    def specimens(self, *, iteration: int | None = None) -> tuple[Specimen, ...]:
        """Specimens with rows in the log, by iteration and name."""
        where, values = ("AND iteration = ?", [iteration]) if iteration is not None else ("", [])
        first = f"SELECT min(sequence) FROM record WHERE specimen IS NOT NULL {where} GROUP BY specimen"  # noqa: S608
        sql = f"SELECT kind, content FROM record WHERE sequence IN ({first}) ORDER BY iteration, specimen"  # noqa: S608
        rows = [self._row(kind, content, 0, "") for kind, content in self._rows(sql, values)]
        return tuple(Specimen(**{name: getattr(row, name) for name in SPECIMEN_COLUMNS}) for row in rows)

    def readings(self, *, last: int | None = None, superseded: bool = False, **equal: Value) -> tuple[Reading, ...]:
        """Readings of the multimeter, the earliest first; parameters as :meth:`entries`."""
        return tuple(self.entries(Reading, last=last, superseded=superseded, replaced=False, **equal))

    def recordings(self, *, last: int | None = None, superseded: bool = False, **equal: Value) -> tuple[BenchRun, ...]:
        """Recordings of the bench, the earliest first; parameters as :meth:`entries`."""
        return tuple(self.entries(BenchRun, last=last, superseded=superseded, replaced=False, **equal))

    def predictions(self, *, design_id: str = "") -> tuple[Prediction, ...]:
        """Predictions, the earliest first; of one design if ``design_id`` is given."""
        return tuple(self.entries(Prediction, design_id=design_id) if design_id else self.entries(Prediction))

    def batches(self) -> tuple[Batch, ...]:
        """Print beds, the earliest first."""
        return tuple(self.entries(Batch))

    def entries(
        self,
        kind: type[_Kind],
        *,
        last: int | None = None,
        superseded: bool = False,
        replaced: bool = False,
        **equal: Value,
    ) -> Iterator[_Kind]:
        """Rows of one kind, the earliest first.

        Parameters
        ----------
        kind : type
            Kind of the rows.
        last : int or None
            Only the latest rows, at most this many.
        superseded : bool
            Also rows that a later row corrects or withdraws.
        replaced : bool
            These alone.
        **equal
            Required values by column.

        Raises
        ------
        UnknownName
            No such column.
        BadInput
            The log is damaged; rows given before are sound.
        """
        if strange := equal.keys() - COLUMNS[kind].keys():
            raise UnknownName(f"column of a {kind.__name__}", min(strange), COLUMNS[kind])
        asked = {name: equal[name] for name in (*INDEXED, "number") if equal.get(name) not in ("", None)}
        where = " AND ".join((*(f"{name} = ?" for name in asked), _current(superseded=superseded, replaced=replaced)))
        sql = (
            "SELECT kind, content, number, logged_at FROM record "  # noqa: S608
            f"WHERE kind = ?1 AND number IS NOT NULL AND {where} ORDER BY number {'DESC' if last else ''}"
        )
        rows = itertools.starmap(self._row, self._rows(sql, [NAMES[kind], *asked.values()]))
        wanted = (row for row in rows if all(getattr(row, name) == value for name, value in equal.items()))
        yield from reversed(list(itertools.islice(wanted, last))) if last else wanted

    def about(
        self,
        kind: type[_Kind],
        iteration: int | None,
        specimens: Sequence[str] = (),
        *,
        superseded: bool = False,
        replaced: bool = False,
    ) -> Iterator[_Kind]:
        """Rows of one kind about some specimens, else about an iteration, else all.

        Parameters
        ----------
        kind : type
            Kind of the rows.
        iteration : int or None
            Iteration, if no specimens are given.
        specimens : sequence of str
            Names of specimens; their rows come one specimen after the other.
        superseded : bool
            Also rows that a later row corrects or withdraws.
        replaced : bool
            These alone.
        """
        for specimen in specimens:
            yield from self.entries(kind, superseded=superseded, replaced=replaced, specimen=specimen)
        if not specimens:
            which = {} if iteration is None else {"iteration": iteration}
            yield from self.entries(kind, superseded=superseded, replaced=replaced, **which)

    def count(self, kind: type[Entry], *, superseded: bool = False) -> int:
        """Number of rows of a kind."""
        where = _current(superseded=superseded)
        sql = f"SELECT count(*) FROM record WHERE kind = ?1 AND number IS NOT NULL AND {where}"  # noqa: S608
        return int(next(self._rows(sql, [NAMES[kind]]))[0])

    def pragma(self, name: str) -> tuple[str, ...]:
        """SQLite's result of a pragma, first column."""
        return tuple(str(row[0]) for row in self._rows(f"PRAGMA {name}"))

    def head(self) -> tuple[int, str]:
        """Number of records and identity of the last one: who knows it can tell any later change of the log."""
        sequence, head = next(self._rows("SELECT sequence, id FROM head"), (0, ""))
        return sequence if type(sequence) is int else -1, str(head)

    def records(self) -> Iterator[Record]:
        """Records of all kinds in their order."""
        return (_record(row) for row in self._rows(f"SELECT {_FIELDS} FROM record ORDER BY sequence"))  # noqa: S608

    def stored(self) -> Iterator[tuple[Record, int, int | None, tuple[Value, ...]]]:
        """Records as they lie in the file: each with its numbers among all and its kind, and the index's fields."""
        sql = f"SELECT {_FIELDS}, sequence, number, {', '.join(INDEXED)} FROM record ORDER BY sequence"  # noqa: S608
        return ((_record(row[:6]), row[6], row[7], row[8:]) for row in self._rows(sql))

    def merged_after(self, sequence: int) -> bool:
        """Test whether a merge follows a record, as it does where another machine's log begins."""
        sql = "SELECT 1 FROM record WHERE sequence > ? AND instr(parents, ',') > 0 LIMIT 1"
        return next(self._rows(sql, [sequence]), None) is not None

    def is_copy(self, sequence: int) -> bool:
        """Test whether a row of the same kind and ``uid`` stands before a record."""
        sql = ("SELECT 1 FROM record copy JOIN record row ON row.kind = copy.kind AND row.uid = copy.uid "
               "WHERE copy.sequence = ? AND row.sequence < copy.sequence")  # fmt: skip
        return next(self._rows(sql, [sequence]), None) is not None

    def record_of(self, entry: Entry) -> tuple[int, str]:
        """Number of the record that holds a row among all records, and its identity."""
        sql = "SELECT sequence, id FROM record WHERE kind = ? AND number = ?"
        sequence, key = next(self._rows(sql, [NAMES[type(entry)], entry.number]))
        return int(sequence), str(key)

    def before(self, first: Entry, others: Sequence[Entry]) -> bool | None:
        """Test whether a row was logged before all of some others by the order of the records, which no clock decides.

        Returns
        -------
        bool or None
            None where the order proves nothing: rows of two machines that had not synced between, or of a log of an
            older sensorgen, whose order is that of a clock.
        """
        if self._ancestry is None:  # the first of each kind stands for all
            others = list({type(row): row for row in sorted(others, key=lambda row: -row.number)}.values())
        orders = {self._before(first, other) for other in others}
        return False if False in orders else None if None in orders else True

    def _before(self, first: Entry, second: Entry) -> bool | None:
        (one, key), (other, its_key) = self.record_of(first), self.record_of(second)
        if max(one, other) <= self._migrated:
            return None
        if self._ancestry is None:
            return one < other
        return True if self._ancestry.before(key, its_key) else False if self._ancestry.before(its_key, key) else None

    def anchored(self, entry: Entry) -> tuple[Anchor, int] | None:
        """The first anchor that proves a row, and the number of records from the row to what was anchored."""
        place, key = self.record_of(entry)
        for anchor in self.entries(Anchor):
            head = self.sequence(anchor.head)
            if head == place or (head > place and (not self._ancestry or self._ancestry.before(key, anchor.head))):
                return anchor, head - place
        return None

    @property
    def merged(self) -> bool:
        """True if several machines have written the log."""
        return self._ancestry is not None

    @cached_property
    def _migrated(self) -> int:
        """Number of the record of a migration: rows before it are in the order of a clock."""
        migrations = [self.record_of(entry)[0] for entry in self.entries(Migration)]
        return max(migrations, default=0)

    @cached_property
    def _ancestry(self) -> chain.Ancestry | None:
        """Ancestry of the records; None in a log of one machine, where the sequence tells."""
        merged = self._rows("SELECT 1 FROM record WHERE instr(parents, ',') > 0 OR parents = '' LIMIT 2")
        if len(list(merged)) < 2:
            return None
        rows = self._rows("SELECT id, parents FROM record ORDER BY sequence")
        return chain.Ancestry((key, _parents(text)) for key, text in rows)

    def add(self, entries: Iterable[Entry]) -> list[Entry]:
        """Log all rows or none; when this returns, they are on the disk.

        Parameters
        ----------
        entries : iterable of Entry
            New rows, each after the rows that it refers to. Rows with a known ``uid`` are skipped.

        Returns
        -------
        list of Entry
            The new rows, as logged.

        Raises
        ------
        BadInput
            A row with a value that its column cannot have; one with a known ``uid`` and other content; a correction of
            a row that is missing or corrected already; a reference to a row that is missing.
        Unwritable
            The disk is full, or the log cannot be written to.
        """
        return list(self.adding(entries))

    def adding(self, entries: Iterable[Entry]) -> Iterator[Entry]:
        """The new rows one after the other, in little memory; none is logged unless the last one is asked for.

        Parameters and errors as of :meth:`add`.
        """
        with database.transaction(self._connection, self.path):
            writer = Appender(self._connection, *self.head())
            self._printed.clear()
            self.passed_over.clear()
            for entry in entries:
                if added := self._add(entry, writer):
                    yield added
            writer.finish()

    @contextmanager
    def merging(self) -> Iterator["Merging"]:
        """Add records of another log inside, all or none; a merge is logged at the end where both have grown.

        Raises
        ------
        BadInput
            A record that is not what its identity says, or of a kind or schema that this version does not read; then
            nothing is added.
        """
        with database.transaction(self._connection, self.path):
            writer = Appender(self._connection, *self.head())
            merging = Merging(self, writer)
            yield merging
            if merging.added:
                if len(merging.heads) > 1:
                    writer.add(Merge(uid=""), list(merging.heads))
                writer.finish()

    def sequence(self, key: str) -> int:
        """Number of the record with that identity; 0 if the log does not have it."""
        return int(next(self._rows("SELECT sequence FROM record WHERE id = ?", [key]), (0,))[0])

    def received(self, record: Record) -> Entry:
        """Row of another machine's record; parameters and errors as :meth:`merging`."""
        if record.kind not in KINDS or record.version > VERSIONS.get(record.kind, 1):
            raise BadInput(f"record {record.id[:12]} is a {record.kind!r:.40} of version {record.version}, "
                           "which this sensorgen does not read: take a newer one")  # fmt: skip
        if not chain.sound(record):
            raise BadInput(f"record {record.id[:12]} is not what its identity says; nothing was added")
        return decode(KINDS[record.kind], record.content, 0, record.logged_at)

    def has(self, entry: Entry) -> bool:
        """Test whether the log has a row already, apart from what each machine adds to it."""
        kind, uid = type(entry), entry.uid
        rows = self.entries(kind, superseded=True, uid=uid) if self._exists(kind, uid) else ()
        return any(_same(entry, row, but=_LOCAL) for row in rows)

    def _exists(self, kind: type[Entry], uid: str) -> bool:
        sql = "SELECT 1 FROM record WHERE kind = ? AND uid = ? AND number IS NOT NULL"
        return bool(uid) and self._connection.execute(sql, [NAMES[kind], uid]).fetchone() is not None

    def _add(self, entry: Entry, writer: Appender) -> Entry | None:
        kind = type(entry)
        if self._exists(kind, entry.uid):
            known = next(self.entries(kind, superseded=True, uid=entry.uid))
            if entry.logged_at and not _same(known, entry, but=("number", "logged_at", "claimed_at")):
                raise BadInput(f"row {entry.uid} has other content in the log; expected the same")
            self.passed_over[getattr(known, "source", ""), getattr(entry, "source", "")] += 1
            return None
        self._check(entry)
        if isinstance(entry, Reading | BenchRun) and not (entry.batch or entry.logged_at):
            entry = self._with_print(entry)
        if isinstance(entry, Batch | Print | Withdrawal):
            self._printed.clear()
        if entry.logged_at and not entry.claimed_at:
            entry = dataclasses.replace(entry, claimed_at=entry.logged_at)
        return writer.add(entry)

    def _check(self, entry: Entry) -> None:
        """Refuse a row that refers to none, corrects none, cannot be read later, or gives a name a second design."""
        for name, kind in REFERENCES.get(type(entry), {}).items():
            uid = getattr(entry, name)
            if uid and not self._exists(kind, uid):
                raise BadInput(f"a {word(type(entry))} refers to {word(kind)} {uid!r:.80}, which the log does not have")
        self._check_correction(entry)
        if isinstance(entry, Prediction):  # which a report has to read later
            from sensorgen.prediction.results import from_json

            with within(f"prediction of {entry.design!r:.60}"):
                from_json(entry.data)
        if isinstance(entry, Print) and not entry.logged_at:
            before = self.bound(entry.specimen)
            if before and before.design_id != entry.design_id:
                raise BadInput(_two_designs(before, entry))

    def _check_correction(self, entry: Entry) -> None:
        """Refuse a correction or withdrawal of a row that is missing or has one."""
        uid = getattr(entry, "supersedes", "")
        if not uid:
            return
        kind = KINDS.get(entry.of, type(entry)) if isinstance(entry, Withdrawal) else type(entry)
        old = next(self.entries(kind, superseded=True, uid=uid), None)
        if old is None:
            raise BadInput(f"nothing to correct: no row {uid!r} in the log")
        if entry.logged_at:  # of an export, with what two machines corrected
            return
        later = next(iter(self.superseding(old)), None)
        if later:
            how = "withdrawn" if isinstance(later, Withdrawal) else "corrected"
            raise BadInput(f"row {old.number} was {how} before, by row {later.number}; correct that one")
        rival = self.rival(old)
        if rival and not isinstance(entry, Withdrawal):
            raise BadInput(f"row {old.number} is out of use: {conflict(rival)}")

    def superseding(self, entry: Entry) -> tuple[Entry, ...]:
        """Corrections and withdrawals of a row: more than one where two machines have made them."""
        corrections = self.entries(type(entry), superseded=True, supersedes=entry.uid) if entry.uid and hasattr(
            entry, "supersedes") else ()  # fmt: skip
        withdrawals = self.entries(Withdrawal, superseded=True, supersedes=entry.uid)
        return (*corrections, *(row for row in withdrawals if row.of == NAMES[type(entry)]))

    def rival(self, entry: Entry) -> Entry | None:
        """Correction by another machine of the row that this row corrects, which counts in its place."""
        sql = (
            "SELECT other.kind, other.content, other.number, other.logged_at FROM record row, record other "  # noqa: S608
            f"WHERE row.kind = ?1 AND row.number = ?2 AND {_PREFERRED} "
            f"ORDER BY {_TIME.format('other')} DESC, other.id DESC"
        )
        row = next(self._rows(sql, [NAMES[type(entry)], entry.number]), None)
        return self._row(*row) if row else None

    def conflicts(self) -> list[str]:
        """Corrections that two machines have made of one row, until the one that does not count is withdrawn."""
        sql = (
            "SELECT row.kind, row.content, row.number, row.logged_at, other.number "  # noqa: S608
            "FROM record row, record other WHERE row.kind = ?1 AND row.number IS NOT NULL "
            f"AND row.supersedes IS NOT NULL AND {_PREFERRED}"
        )
        return [
            f"conflict: {word(kind)}s {row[2]} and {other} correct the same row; {other} counts: withdraw one of them"
            for kind in (Reading, BenchRun)
            for *row, other in self._rows(sql, [NAMES[kind]])
            if not self.withdrawn(self._row(*row))
        ]

    def withdrawn(self, entry: Entry) -> bool:
        """Test whether a row is withdrawn, or every correction of it."""
        later = self.superseding(entry)
        corrections = [self.withdrawn(row) for row in later if not isinstance(row, Withdrawal)]
        return len(corrections) < len(later) or (bool(corrections) and all(corrections))

    def _with_print(self, entry: Reading | BenchRun) -> Reading | BenchRun:
        """Entry with batch and design of the specimen's latest print."""
        if entry.specimen not in self._printed:
            printed, changes = self.bound(entry.specimen), dict[str, Any]()
            if printed:
                batches = self.entries(Batch, superseded=True, uid=printed.batch_uid) if printed.batch_uid else ()
                batch = next((row.batch for row in batches), "")
                changes = {"batch": batch, "design_id": printed.design_id, "design": printed.design}
            self._printed[entry.specimen] = changes
        return dataclasses.replace(entry, **changes) if (changes := self._printed[entry.specimen]) else entry

    def bound(self, specimen: str) -> Print | None:
        """The latest print of a specimen, which binds its name to a design; None of a name that is not bound.

        Raises
        ------
        BadInput
            Two machines have bound the name to different designs.
        """
        *others, printed = (None, *self.entries(Print, specimen=specimen)) if specimen else (None,)
        for other in others:
            if printed and other and other.design_id != printed.design_id:
                raise BadInput(_two_designs(other, printed))
        return printed

    def _rows(self, sql: str, values: Sequence[Value] = ()) -> Iterator[tuple[Any, ...]]:
        with database.translate_errors(self.path):
            for row in self._connection.execute(sql, values):  # noqa: UP028 - closes the cursor late
                yield row

    def _row(self, kind: str, content: str, number: int, logged_at: str) -> Any:
        """Row of a record; a value that no field can have is reported as damage."""
        try:
            return decode(KINDS[kind], content, number, logged_at)
        except (SensorgenError, KeyError) as error:
            raise BadInput(f"the log {str(self.path)!r} is damaged: {error}") from None


class Merging:
    """Records of another log that join a log; see :meth:`Log.merging`.

    Attributes
    ----------
    added : int
        Number of records that are new.
    heads : dict of str to None
        Identities of records that no other one follows.
    offered : bytearray
        At the number of each record that was offered and that the log has now: 1.
    """

    def __init__(self, log: Log, writer: Appender) -> None:
        self._log, self._writer = log, writer
        self.added, self.heads = 0, dict.fromkeys(writer.heads)
        self.offered = bytearray(writer.sequence + 1)

    def take(self, record: Record) -> str:
        """Add a record unless the log has it.

        Returns
        -------
        str
            Identity of a record that it follows and that the log does not have: offer it again later; else "".
        """
        sequence = self._log.sequence(record.id)
        if sequence:
            self.offered[sequence] = 1
            return ""
        for parent in record.parents:
            if parent != self._writer.head and not self._log.sequence(parent):
                return parent
        copy = self._log.has(self._log.received(record))
        self._writer.append(record, indexed(record.content), copy=copy)
        self.offered.append(1)
        self.added += 1
        for parent in record.parents:
            self.heads.pop(parent, None)
        self.heads[record.id] = None
        return ""


def _current(*, superseded: bool, replaced: bool = False) -> str:
    """Condition on rows: those that no later row corrects or withdraws, all, or those that one does alone."""
    if replaced:
        return f"uid IN ({_SUPERSEDED})"
    return "TRUE" if superseded else f"uid NOT IN ({_SUPERSEDED})"


def conflict(rival: Entry) -> str:
    """Reason why a correction does not count, and how a person settles it."""
    return f"row {rival.number}, from another machine, corrects the same row and counts; withdraw one of the two"


def _two_designs(one: Print, other: Print) -> str:
    return (
        f"specimen {one.specimen!r:.80} is {one.design or 'a design'} ({one.design_id}, print {one.number}) and cannot "
        f"be {other.design or 'a design'} ({other.design_id}) as well: take another name for one of them, or, if print "
        f"{one.number} is wrong: sensorgen log withdraw print {one.number} --reason TEXT"
    )


def _same(one: Entry, other: Entry, but: tuple[str, ...]) -> bool:
    """Test whether two rows of a kind have the same content, apart from some fields."""
    return type(one) is type(other) and all(
        getattr(one, name) == getattr(other, name) for name in COLUMNS[type(one)] if name not in but
    )


def _record(row: Sequence[Any]) -> Record:
    key, parents, kind, version, logged_at, content = row
    if type(version) is not int or not all(type(text) is str for text in (key, parents, kind, logged_at, content)):
        raise BadInput(f"a record is damaged: it holds {row!r:.80}")
    return Record(key, _parents(parents), kind, version, logged_at, content)


def _parents(text: str) -> tuple[str, ...]:
    return tuple(text.split(",")) if text else ()


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
