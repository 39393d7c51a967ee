"""Files into the log: tables of readings, print beds, and exports of a log; the whole file or nothing of it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from sensorgen.core.errors import BadInput
from sensorgen.measure.log import batches, exchange, files, tables
from sensorgen.measure.log.entries import Entry, Reading
from sensorgen.measure.log.logbook import Log


@dataclass(frozen=True)
class Done:
    """What came of an import.

    Attributes
    ----------
    rows : int
        In the file.
    new : int
        Of them; the others were in the log.
    doubtful : int
        Of the new ones, readings with something to doubt.
    left_out : tuple of str
        Columns that the log has no place for.
    """

    rows: int
    new: int
    doubtful: int
    left_out: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """The same for people."""
        known = f"{self.rows - self.new} were there" if self.new < self.rows else ""
        doubtful = f"{self.doubtful} with doubts" if self.doubtful else ""
        said = [", ".join(filter(None, (f"{self.new} of {self.rows} rows logged", known, doubtful)))]
        return said + ([f"columns left out: {', '.join(self.left_out)}"] if self.left_out else [])


def thesis(log: Log) -> Done:
    """Log Table D.1 of the thesis."""
    return _added(log, tables.thesis())


def take(log: Log, path: Path, columns: Mapping[str, str]) -> Done:
    """Log a file, whatever it is.

    Parameters
    ----------
    log : Log
        An open one.
    path : Path
        A table as CSV, ``batch.json``, an exported ``.csv`` or ``.parquet``, or the folder of an exported log.
    columns : mapping
        Columns of ours to those of a table, as of :func:`sensorgen.measure.log.tables.readings`.

    Raises
    ------
    BadInput
        A file that cannot be read; with its name, row and column. Nothing is logged then.
    """
    if path.is_dir():
        return _folder(log, path)
    if path.suffix.lower() == ".json":
        return _added(log, list(batches.rows(path, files.keep(log.files, path))))
    rows, left_out = _rows(path, columns)
    return _added(log, rows, left_out)


def _rows(path: Path, columns: Mapping[str, str]) -> tuple[Sequence[Entry], Sequence[str]]:
    if path.suffix.lower() == ".parquet":
        return exchange.from_parquet(path)[1], ()
    table = tables.sheet(path)
    kind = exchange.kind_of(table.columns)
    if kind:
        return list(exchange.from_sheet(kind, table)), ()
    return tables.readings(table, columns, path.name)


def _folder(log: Log, folder: Path) -> Done:
    found: list[Entry] = []
    for kind, name in exchange.FILES.items():
        path = next((p for form in exchange.FORMATS if (p := folder / f"{name}.{form}").is_file()), None)
        if path is None:
            raise BadInput(f"{str(folder)!r} has no {name}.csv; expected the folder of an exported log")
        rows = _rows(path, {})[0]
        if not all(isinstance(row, kind) for row in rows):
            raise BadInput(f"{path}: columns of another table; expected those of {name}")
        found += rows
    exchange.keep_raw_files(log, folder, found)
    return _added(log, found)


def _added(log: Log, rows: Sequence[Entry], left_out: Iterable[str] = ()) -> Done:
    new = log.add(rows)
    doubtful = sum(isinstance(row, Reading) and bool(row.doubts) for row in new)
    return Done(len(rows), len(new), doubtful, tuple(left_out))
