"""The log: readings, recordings and predictions of printed specimens, in one SQLite file that only grows."""

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

from sensorgen.core import paths as places
from sensorgen.core.errors import BadInput, MissingValue, UnknownName
from sensorgen.measure.log import database, files
from sensorgen.measure.log.codec import CODECS
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

PLACE = "SENSORGEN_LOG"  # environment variable with another file
TABLES: dict[type[Any], str] = {
    RawFile: "raw_file", Batch: "batch", Print: "print", Reading: "reading", BenchRun: "bench_run",
    Prediction: "prediction",
}  # fmt: skip
_NULL_FOR_NONE = ("supersedes", "rig_file")  # text that is NULL where it is "", so that it may be a key
_KINDS: tuple[type[Any], ...] = (Specimen, *TABLES)
_CODECS = {kind: {name: CODECS[hint] for name, hint in columns(kind).items()} for kind in _KINDS}
_TIES = ("batch", "design_id", "design")
_PRINTED = (
    "SELECT batch.batch, print.design_id, print.design FROM print JOIN batch ON batch.uid = print.batch_uid "
    "WHERE print.specimen = ? ORDER BY print.number DESC LIMIT 1"
)


def _insert_into(table: str, names: Sequence[str], otherwise: str = "") -> str:
    marks = ", ".join("?" * len(names))
    return f"INSERT {otherwise} INTO {table} ({', '.join(names)}) VALUES ({marks})"  # noqa: S608 - our own names


_OF_NAME = _insert_into("specimen", SPECIMEN_COLUMNS, "OR IGNORE")
_Kind = TypeVar("_Kind", bound=Entry)


def place() -> Path:
    """Where the log is unless told otherwise: what SENSORGEN_LOG says, or the system's place for a user's data.

    One for all folders that one works in, and never below ``out/``, which may be deleted.
    """
    return places.data(PLACE, "log.db")


class Log:
    """A log, open from ``with`` to its end.

    Parameters
    ----------
    path : Path
        Its file.
    create : bool
        Whether to make it where there is none.

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
        """The folder of raw files, beside the log."""
        return self.path.with_name(f"{self.path.name}.files")

    def raw(self, sha256: str) -> Path:
        """Where the raw file of that SHA-256 is.

        Raises
        ------
        MissingValue
            The log has none such.
        """
        found = next(self.entries(RawFile, uid=sha256), None)
        if found is None:
            raise MissingValue(f"no raw file {sha256!r:.80} in the log {str(self.path)!r}")
        return files.place(self.files, found)

    def specimens(self, *, iteration: int | None = None) -> tuple[Specimen, ...]:
        """Every specimen that something was logged of, by iteration and name."""
        where, values = ("WHERE iteration = ?", [iteration]) if iteration is not None else ("", [])
        sql = f"SELECT {', '.join(SPECIMEN_COLUMNS)} FROM specimen {where} ORDER BY iteration, specimen"  # noqa: S608 - our own names
        with self._reading():
            return tuple(_record(Specimen, row, str(self.path)) for row in self._connection.execute(sql, values))

    def readings(self, **wanted: Any) -> tuple[Reading, ...]:
        """Readings of the multimeter, the earliest first.

        Parameters
        ----------
        **wanted
            Of :meth:`entries`: ``iteration``, ``specimen``, ``last``, ``superseded``.
        """
        return tuple(self.entries(Reading, **wanted))

    def recordings(self, **wanted: Any) -> tuple[BenchRun, ...]:
        """Recordings of the bench, the earliest first; as :meth:`readings`."""
        return tuple(self.entries(BenchRun, **wanted))

    def predictions(self, *, design_id: str = "") -> tuple[Prediction, ...]:
        """Predictions, the earliest first; of one design if ``design_id`` names it."""
        wanted: dict[str, Any] = {"design_id": design_id} if design_id else {}
        return tuple(self.entries(Prediction, **wanted))

    def batches(self) -> tuple[Batch, ...]:
        """Print beds, the earliest first."""
        return tuple(self.entries(Batch))

    def prints(self, *, specimen: str | None = None) -> tuple[Print, ...]:
        """Which specimens are known from which batch, and their designs, the earliest first."""
        wanted: dict[str, Any] = {} if specimen is None else {"specimen": specimen}
        return tuple(self.entries(Print, **wanted))

    def entries(
        self, kind: type[_Kind], *, last: int | None = None, superseded: bool = False, **equal: Any
    ) -> Iterator[_Kind]:
        """Rows of one kind, the earliest first.

        Parameters
        ----------
        kind : type
            Of the rows.
        last : int or None
            Give no more than the latest so many.
        superseded : bool
            Give rows, too, that a later one corrects.
        **equal
            Columns, and what they have to be.

        Raises
        ------
        UnknownName
            There is no such column.
        BadInput
            The log is damaged; what was given until then is sound.
        """
        sql, values = _selection(kind, equal, last, superseded)
        with self._reading():
            rows = self._connection.execute(sql, values)
            yield from (_record(kind, row, str(self.path)) for row in (reversed(rows.fetchall()) if last else rows))

    def count(self, kind: type[Entry], *, superseded: bool = False) -> int:
        """How many rows of a kind there are."""
        sql, values = _selection(kind, {}, None, superseded)
        with self._reading():
            return int(self._connection.execute(f"SELECT count(*) FROM ({sql})", values).fetchone()[0])  # noqa: S608

    def pragma(self, name: str) -> tuple[str, ...]:
        """What SQLite answers to a pragma, first column."""
        with self._reading():
            return tuple(str(row[0]) for row in self._connection.execute(f"PRAGMA {name}"))

    def add(self, entries: Iterable[Entry]) -> list[Entry]:
        """Log rows, all or none of them; when this returns, they are on the disk.

        Parameters
        ----------
        entries : iterable of Entry
            New rows, in the order in which they refer to each other. Those whose ``uid`` is known are passed over.

        Returns
        -------
        list of Entry
            Those that are new, as they now stand in the log.

        Raises
        ------
        BadInput
            A row with the name of another that says something else, or that corrects one which was corrected before,
            or is not there; nothing is logged then.
        Unwritable
            The disk is full, or the log cannot be written to.
        """
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        with database.transaction(self._connection, self.path):
            return [new for entry in entries if (new := self._add(entry, now))]

    def _add(self, entry: Entry, now: str) -> Entry | None:
        if self._connection.execute(_KNOWN[type(entry)], [entry.uid]).fetchone():
            _check_same(next(self.entries(type(entry), superseded=True, uid=entry.uid)), entry)
            return None
        if isinstance(entry, Specimen):
            self._insert(_OF_NAME, SPECIMEN_COLUMNS, entry)
        if isinstance(entry, Reading | BenchRun):
            self._check_correction(entry)
            entry = self._tied(entry)
        entry = dataclasses.replace(entry, logged_at=entry.logged_at or now, number=0)
        sql, names = _INSERTIONS[type(entry)]
        return dataclasses.replace(entry, number=self._insert(sql, names, entry))

    def _check_correction(self, entry: Reading | BenchRun) -> None:
        if not entry.supersedes:
            return
        kind = type(entry)
        old = next(self.entries(kind, superseded=True, uid=entry.supersedes), None)
        if old is None:
            raise BadInput(f"nothing to correct: no row {entry.supersedes!r} in the log")
        later = next(self.entries(kind, superseded=True, supersedes=entry.supersedes), None)
        if later:
            raise BadInput(f"row {old.number} was corrected before, by row {later.number}; correct that one")

    def _tied(self, entry: Reading | BenchRun) -> Reading | BenchRun:
        """The entry with design and batch of the print bed that its specimen came from, if that is known."""
        if entry.batch or entry.logged_at:
            return entry
        printed = self._connection.execute(_PRINTED, [entry.specimen]).fetchone()
        return dataclasses.replace(entry, **dict(zip(_TIES, printed, strict=True))) if printed else entry

    def _insert(self, sql: str, names: Sequence[str], entry: Entry) -> int:
        values = [_to_sql(type(entry), name, getattr(entry, name)) for name in names]
        return int(self._connection.execute(sql, values).lastrowid or 0)

    def _reading(self) -> Any:
        return database.told(self.path)


def _check_same(known: Entry, entry: Entry) -> None:
    """Refuse an exported row that says something else than the log's own of that name."""
    if entry.logged_at and dataclasses.replace(known, number=0) != dataclasses.replace(entry, number=0):
        raise BadInput(f"row {entry.uid} is in the log and says something else there; expected the same")


def _selection(kind: type[Entry], equal: dict[str, Any], last: int | None, superseded: bool) -> tuple[str, list[Any]]:
    """The SQL for some rows; all names in it are our own."""
    for name in equal:
        if name not in columns(kind):
            raise UnknownName(f"column of a {kind.__name__}", name, columns(kind))
    table = TABLES[kind]
    names = ", ".join(f"{_home(kind, name)}.{name}" for name in columns(kind))
    joined = f"JOIN specimen ON specimen.specimen = {table}.specimen" if issubclass(kind, Specimen) else ""
    conditions = [f"{_home(kind, name)}.{name} IS ?" for name in equal]
    if not superseded and "supersedes" in _CODECS[kind]:
        conditions.append(f"NOT EXISTS (SELECT 1 FROM {table} later WHERE later.supersedes = {table}.uid)")  # noqa: S608
    where = f"WHERE {' AND '.join(conditions)}" if conditions else ""
    limit = f"DESC LIMIT {int(last)}" if last else ""
    return f"SELECT {names} FROM {table} {joined} {where} ORDER BY {table}.number {limit}", list(equal.values())  # noqa: S608


def _home(kind: type[Entry], name: str) -> str:
    """The table of a column: what a name tells stands with the specimens."""
    return "specimen" if issubclass(kind, Specimen) and name in SPECIMEN_COLUMNS[1:] else TABLES[kind]


def _to_sql(kind: type[Any], name: str, value: Any) -> Any:
    if name in _NULL_FOR_NONE and value == "":
        return None
    return _CODECS[kind][name].sql(value)


def _record(kind: type[Any], row: Sequence[Any], path: str) -> Any:
    """A row as a record; what no record can be is told as damage."""
    found = {}
    for (name, codec), value in zip(_CODECS[kind].items(), row, strict=True):
        try:
            found[name] = "" if value is None and name in _NULL_FOR_NONE else codec.from_sql(value)
        except (TypeError, ValueError, KeyError, RecursionError):
            raise BadInput(
                f"the log {path!r} is damaged: column {name} of a {kind.__name__} holds {value!r:.60}"
            ) from None
    return kind(**found)


def _insertion(kind: type[Any]) -> tuple[str, tuple[str, ...]]:
    """The SQL that inserts a row, and the columns that it takes."""
    own = tuple(name for name in columns(kind) if name != "number" and _home(kind, name) == TABLES[kind])
    return _insert_into(TABLES[kind], own), own


_INSERTIONS = {kind: _insertion(kind) for kind in TABLES}
_KNOWN = {kind: f"SELECT 1 FROM {table} WHERE uid = ?" for kind, table in TABLES.items()}  # noqa: S608 - our own names
