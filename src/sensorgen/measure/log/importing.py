"""Import files into the log: tables of readings, print beds, and exported logs; each file as a whole or not at all."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import count
from pathlib import Path

from sensorgen.core.document import Part
from sensorgen.core.errors import BadInput
from sensorgen.measure import accuracy, lcr
from sensorgen.measure.log import batches, edited, exchange, files, notes, tables
from sensorgen.measure.log.entries import Entry, RawFile, Reading
from sensorgen.measure.log.logbook import Log

_MOST_DOUBTS = 5  # of implausible values in one file


@dataclass(frozen=True)
class ImportedRecording:
    """Result of an import.

    Attributes
    ----------
    rows : int
        Rows in the file.
    new : int
        Rows that the log did not have.
    doubtful : int
        New readings with doubts.
    corrections : int
        New rows that correct one that was logged before the table was edited.
    left_out : tuple of str
        Columns that were ignored.
    """

    rows: int
    new: int
    doubtful: int
    corrections: int = 0
    left_out: tuple[str, ...] = ()

    def document(self) -> Iterator[Part]:
        """Rows, and the columns that were ignored."""
        known = f"{self.rows - self.new} were there" if self.new < self.rows else ""
        doubtful = f"{self.doubtful} with doubts" if self.doubtful else ""
        edited = f"{self.corrections} correct what was logged before the table was edited" if self.corrections else ""
        rows = ", ".join(filter(None, (f"{self.new} of {self.rows} rows logged", known, doubtful, edited)))
        yield rows
        if self.left_out:
            yield f"columns left out: {', '.join(self.left_out)}"


def thesis(log: Log) -> ImportedRecording:
    """Log Table D.1 of the thesis."""
    return _add(log, tables.thesis())


def lcr_export(
    log: Log, path: Path, specimen: str, *, instrument: str = "", baked: bool | None = None, remark: str = ""
) -> ImportedRecording:
    """Log the export of an LCR meter as one reading of a specimen, and keep the file.

    Parameters
    ----------
    log : Log
        An open log.
    path : Path
        Export, as :func:`sensorgen.measure.lcr.read` reads it.
    specimen : str
        Name of the specimen.
    instrument : str
        The meter; what the file says of it if not given.
    baked : bool or None
        Whether the specimen had been baked.
    remark : str
        Any text.

    Raises
    ------
    BadInput
        A name that stands for nothing, or a file that cannot be read. Nothing is logged then.
    """
    table = lcr.read(path)
    of = notes.reading(specimen, remark=remark, baked=baked, source=path.name, log=log)
    kept = files.keep(log.files, path)
    found = next((name for name in accuracy.names() if accuracy.is_named(name, table.preamble)), "")
    row = replace(
        notes.with_readings(replace(of, doubts=(*of.doubts, *table.doubts)), table.readings, _MOST_DOUBTS),
        uid=sha256(f"{of.specimen} {kept.uid}".encode()).hexdigest()[:32], file=kept.uid,
        instrument=instrument or found,
    )  # fmt: skip
    new = [row for row in log.add([kept, row]) if isinstance(row, Reading)]
    return ImportedRecording(
        table.rows, table.rows * len(new), sum(bool(row.doubts) for row in new), left_out=table.left_out
    )


def import_file(log: Log, path: Path, columns: Mapping[str, str]) -> ImportedRecording:
    """Log a file; its format is recognised.

    Parameters
    ----------
    log : Log
        An open log.
    path : Path
        A table as CSV, ``batch.json``, an exported ``.csv`` or ``.parquet``, or the folder of an exported log.
    columns : mapping
        From sensorgen's columns to the table's, as in :func:`sensorgen.measure.log.tables.readings`.

    Raises
    ------
    BadInput
        A file that cannot be read; with its name, row and column. Nothing is logged then.
    """
    if path.suffix.lower() == ".json":
        return _add(log, list(batches.rows(path, files.keep(log.files, path))))
    if not path.is_dir():
        with _table(log, path, columns) as (rows, left_out):
            return _add(log, rows, left_out)
    exported: list[Entry] = []
    for kind, name in exchange.FILES.items():
        file = next((p for suffix in exchange.FORMATS if (p := path / f"{name}.{suffix}").is_file()), None)
        if file is None and kind in exchange.LATER:
            continue
        if file is None:
            raise BadInput(f"{str(path)!r} has no {name}.csv; expected the folder of an exported log")
        with _table(log, file, {}) as (found, _):
            rows = list(found)
        if not all(isinstance(row, kind) for row in rows):
            raise BadInput(f"{file}: columns of another table; expected those of {name}")
        exported += rows
    for row in exported:
        if isinstance(row, RawFile):
            files.keep(log.files, path / "files" / row.uid, row)
    return _add(log, exported)


@contextmanager
def _table(log: Log, path: Path, columns: Mapping[str, str]) -> Iterator[tuple[Iterable[Entry], Sequence[str]]]:
    """Rows of a table as it is read, and the columns that are ignored."""
    if path.suffix.lower() == ".parquet":
        yield exchange.from_parquet(path)[1], ()
        return
    if not columns and lcr.looks_like(path) and not _is_log_table(path):
        raise BadInput(f"{path}: the export of an LCR meter; say of which specimen, as --specimen S1")
    with tables.opened(path) as table:
        if kind := exchange.kind_of(table.names):
            yield exchange.from_csv(kind, table), ()
        else:
            rows, left_out = tables.readings(table, columns, path.name)
            yield edited.corrections(log, rows, path.name), left_out


def _is_log_table(path: Path) -> bool:
    """Test whether a file is an exported table of a log, or has a column of specimens."""
    with suppress(BadInput), tables.opened(path) as table:
        return exchange.kind_of(table.names) is not None or bool(
            {name.casefold() for name in table.names} & {*tables.NAMES["specimen"]}
        )
    return False


def _add(log: Log, rows: Iterable[Entry], left_out: Iterable[str] = ()) -> ImportedRecording:
    numbers, new, doubtful, corrections = count(), 0, 0, 0
    for row in log.adding(row for row, _ in zip(rows, numbers, strict=False)):
        new += 1
        doubtful += isinstance(row, Reading) and bool(row.doubts)
        corrections += bool(getattr(row, "supersedes", "")) and not row.claimed_at  # of no export
    return ImportedRecording(next(numbers), new, doubtful, corrections, tuple(left_out))
