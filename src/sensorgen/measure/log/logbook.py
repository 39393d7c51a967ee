"""The log: readings, recordings, prints and predictions of specimens in one append-only SQLite file."""

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

from sensorgen.core import paths
from sensorgen.core.errors import BadInput, MissingValue, UnknownName
from sensorgen.measure.log import database, files
from sensorgen.measure.log.entries import (
    SPECIMEN_COLUMNS,
    Batch,
    BenchRun,
    Entry,
    Prediction,
    Print,
    RawFile,
    Reading,
    Specimen,
    columns,
)
from sensorgen.measure.log.fields import Value, from_sql, to_sql

PLACE = "SENSORGEN_LOG"  # environment variable with another file
TABLES: dict[type[Any], str] = {
    RawFile: "raw_file", Batch: "batch", Print: "print", Reading: "reading", BenchRun: "bench_run",
    Prediction: "prediction",
}  # fmt: skip
_NULL_IF_EMPTY = ("supersedes", "rig_file")  # foreign keys, which may be NULL but not ""
_FROM_PRINT = ("batch", "design_id", "design")
_LATEST_PRINT = (
    "SELECT batch.batch, print.design_id, print.design FROM print JOIN batch ON batch.uid = print.batch_uid "
    "WHERE print.specimen = ? ORDER BY print.number DESC LIMIT 1"
)
_Kind = TypeVar("_Kind", bound=Entry)


def place() -> Path:
    """Default file of the log: that of ``SENSORGEN_LOG``, else in the system's folder for a user's data.

    One log for all working folders, and never below ``out/``, which may be deleted.
    """
    return paths.data(PLACE, "log.db")


class _Statements:
    """SQL for one kind of record; every name in it is a field's or a table's, never a user's text."""

    def __init__(self, kind: type[Any], table: str) -> None:
        self.columns = columns(kind)
        joined = issubclass(kind, Specimen) and table != "specimen"  # columns of the name are stored once, by specimen
        self.home = {name: "specimen" if joined and name in SPECIMEN_COLUMNS[1:] else table for name in self.columns}
        self.stored = [name for name, home in self.home.items() if home == table and name != "number"]
        names, marks = ", ".join(self.stored), ", ".join("?" * len(self.stored))
        self.insert = f"INTO {table} ({names}) VALUES ({marks})"
        selected = ", ".join(f"{home}.{name}" for name, home in self.home.items())
        join = f"JOIN specimen ON specimen.specimen = {table}.specimen" if joined else ""
        self.select = f"SELECT {selected} FROM {table} {join}"  # noqa: S608
        self.known = f"SELECT 1 FROM {table} WHERE uid = ?"  # noqa: S608
        self.order = f"ORDER BY {table}.number"
        later = f"NOT EXISTS (SELECT 1 FROM {table} later WHERE later.supersedes = {table}.uid)"  # noqa: S608
        self.uncorrected = [later] if "supersedes" in self.columns else []


_SQL = {kind: _Statements(kind, table) for kind, table in TABLES.items()}
_SPECIMEN = _SQL[Specimen] = _Statements(Specimen, "specimen")


class Log:
    """A log; use it in a ``with`` statement.

    Parameters
    ----------
    path : Path
        SQLite file.
    create : bool
        Whether to create a missing file.

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
        self.path = path
        self._connection = database.connect(path, create=create)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
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
        where, values = ("WHERE iteration = ?", [iteration]) if iteration is not None else ("", [])
        rows = self._rows(f"{_SPECIMEN.select} {where} ORDER BY iteration, specimen", values)
        return tuple(self._record(Specimen, row) for row in rows)

    def readings(
        self, *, last: int | None = None, superseded: bool = False, **equal: Value
    ) -> tuple[Reading, ...]:  # fmt: skip
        """Readings of the multimeter, the earliest first; parameters as :meth:`entries`."""
        return tuple(self.entries(Reading, last=last, superseded=superseded, **equal))

    def recordings(
        self, *, last: int | None = None, superseded: bool = False, **equal: Value
    ) -> tuple[BenchRun, ...]:  # fmt: skip
        """Recordings of the bench, the earliest first; parameters as :meth:`entries`."""
        return tuple(self.entries(BenchRun, last=last, superseded=superseded, **equal))

    def predictions(self, *, design_id: str = "") -> tuple[Prediction, ...]:
        """Predictions, the earliest first; of one design if ``design_id`` is given."""
        return tuple(self.entries(Prediction, design_id=design_id) if design_id else self.entries(Prediction))

    def batches(self) -> tuple[Batch, ...]:
        """Print beds, the earliest first."""
        return tuple(self.entries(Batch))

    def prints(self, *, specimen: str = "") -> tuple[Print, ...]:
        """Specimens on print beds with their designs, the earliest first; one specimen's if ``specimen`` is given."""
        return tuple(self.entries(Print, specimen=specimen) if specimen else self.entries(Print))

    def entries(
        self, kind: type[_Kind], *, last: int | None = None, superseded: bool = False, **equal: Value
    ) -> Iterator[_Kind]:
        """Rows of one kind, the earliest first.

        Parameters
        ----------
        kind : type
            Kind of the rows.
        last : int or None
            Only the latest rows, at most this many.
        superseded : bool
            Also rows that a later row corrects.
        **equal
            Required values by column.

        Raises
        ------
        UnknownName
            No such column.
        BadInput
            The log is damaged; rows given before are sound.
        """
        rows = self._rows(*_selection(kind, equal, last, superseded=superseded))
        yield from (self._record(kind, row) for row in (reversed(list(rows)) if last else rows))

    def count(self, kind: type[Entry], *, superseded: bool = False) -> int:
        """Number of rows of a kind."""
        sql, values = _selection(kind, {}, None, superseded=superseded)
        return int(next(self._rows(f"SELECT count(*) FROM ({sql})", values))[0])  # noqa: S608

    def pragma(self, name: str) -> tuple[str, ...]:
        """SQLite's result of a pragma, first column."""
        return tuple(str(row[0]) for row in self._rows(f"PRAGMA {name}"))

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
            A row with a known ``uid`` and other content; a correction of a row that is missing or corrected already.
        Unwritable
            The disk is full, or the log cannot be written to.
        """
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        with database.transaction(self._connection, self.path):
            return [new for entry in entries if (new := self._add(entry, now))]

    def _add(self, entry: Entry, now: str) -> Entry | None:
        kind = type(entry)
        if self._connection.execute(_SQL[kind].known, [entry.uid]).fetchone():
            known = next(self.entries(kind, superseded=True, uid=entry.uid))
            if entry.logged_at and dataclasses.replace(known, number=0) != dataclasses.replace(entry, number=0):
                raise BadInput(f"row {entry.uid} has other content in the log; expected the same")
            return None
        if isinstance(entry, Specimen):
            self._insert("INSERT OR IGNORE", _SPECIMEN, entry)
        if isinstance(entry, Reading | BenchRun):
            entry = self._checked(entry)
        entry = dataclasses.replace(entry, logged_at=entry.logged_at or now, number=0)
        return dataclasses.replace(entry, number=self._insert("INSERT", _SQL[kind], entry))

    def _checked(self, entry: Reading | BenchRun) -> Reading | BenchRun:
        """Entry whose correction is sound; a new one with batch and design of the specimen's latest print."""
        if entry.supersedes:
            kind = type(entry)
            old = next(self.entries(kind, superseded=True, uid=entry.supersedes), None)
            later = next(self.entries(kind, superseded=True, supersedes=entry.supersedes), None)
            if old is None:
                raise BadInput(f"nothing to correct: no row {entry.supersedes!r} in the log")
            if later:
                raise BadInput(f"row {old.number} was corrected before, by row {later.number}; correct that one")
        if entry.batch or entry.logged_at:
            return entry
        printed = self._connection.execute(_LATEST_PRINT, [entry.specimen]).fetchone()
        return dataclasses.replace(entry, **dict(zip(_FROM_PRINT, printed, strict=True))) if printed else entry

    def _insert(self, verb: str, sql: _Statements, entry: Any) -> int:
        given = ((name, to_sql(getattr(entry, name))) for name in sql.stored)
        values = [None if name in _NULL_IF_EMPTY and value == "" else value for name, value in given]
        return int(self._connection.execute(f"{verb} {sql.insert}", values).lastrowid or 0)

    def _rows(self, sql: str, values: Sequence[Value] = ()) -> Iterator[tuple[Any, ...]]:
        with database.translate_errors(self.path):
            for row in self._connection.execute(sql, values):  # noqa: UP028 - closes the cursor late
                yield row

    def _record(self, kind: type[Any], row: Sequence[Any]) -> Any:
        """Record of a row; a value that no field can have is reported as damage."""
        values = {}
        for (name, annotation), value in zip(_SQL[kind].columns.items(), row, strict=True):
            try:
                values[name] = "" if value is None and name in _NULL_IF_EMPTY else from_sql(annotation, value)
            except (TypeError, ValueError, KeyError, OverflowError, RecursionError):
                held = f"column {name} of a {kind.__name__} holds {value!r:.60}"
                raise BadInput(f"the log {str(self.path)!r} is damaged: {held}") from None
        return kind(**values)


def _selection(
    kind: type[Entry], equal: dict[str, Value], last: int | None, *, superseded: bool
) -> tuple[str, list[Value]]:
    """SQL for some rows, and its values."""
    sql = _SQL[kind]
    for name in equal:
        if name not in sql.columns:
            raise UnknownName(f"column of a {kind.__name__}", name, sql.columns)
    conditions = [f"{sql.home[name]}.{name} IS ?" for name in equal] + ([] if superseded else sql.uncorrected)
    where = f"WHERE {' AND '.join(conditions)}" if conditions else ""
    limit = f"DESC LIMIT {int(last)}" if last else ""
    return f"{sql.select} {where} {sql.order} {limit}", list(equal.values())
