"""The log as tables for other programs, CSV or Parquet, and back, exactly.

Text that a spreadsheet would take for a formula gets an apostrophe ahead of it, and so does text that begins with one:
what has lost its first apostrophe on the way back is what it was.
"""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from sensorgen.core.errors import BadInput, MissingValue
from sensorgen.core.records import shown
from sensorgen.measure.log import entries, files
from sensorgen.measure.log.codec import CODECS
from sensorgen.measure.log.entries import Entry, RawFile
from sensorgen.measure.log.logbook import TABLES, Log
from sensorgen.measure.log.tables import Sheet

FORMATS = ("csv", "parquet")
FILES = {kind: f"{table.replace('_', '-')}s" if table != "batch" else "batches" for kind, table in TABLES.items()}
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "'", "＝", "＋", "－", "＠")


def columns(kind: type[Entry]) -> dict[str, Any]:
    """Columns of a kind's table, with their types; numbers are this log's own, and no part of it."""
    return {name: hint for name, hint in entries.columns(kind).items() if name != "number"}


def kind_of(names: Iterable[str]) -> type[Entry] | None:
    """The kind of row that a header is of, or None."""
    return next((kind for kind in TABLES if set(columns(kind)) == set(names)), None)


def csv_pieces(kind: type[Entry], rows: Iterable[Entry]) -> Iterator[str]:
    """Rows as CSV, the header first."""
    wanted = columns(kind)
    yield _line(list(wanted))
    for entry in rows:
        yield _line([_cell(annotation, getattr(entry, name)) for name, annotation in wanted.items()])


def _line(cells: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\r\n").writerow(cells)  # \n alone leaves a bare \r unquoted
    return text.getvalue()


def _cell(annotation: Any, value: Any) -> str:
    text = CODECS[annotation].text(value)
    return f"'{text}" if annotation is str and text.startswith(_FORMULA) else text


def from_sheet(kind: type[Entry], table: Sheet) -> Iterator[Entry]:
    """Rows back from CSV.

    Raises
    ------
    BadInput
        A cell that the log did not write; with file, row and column.
    """
    wanted = columns(kind)
    for row, number in zip(table.rows, table.numbers, strict=True):
        yield kind(**{
            name: _value(wanted[name], cell, f"{table.name}, row {number}, column {name}")
            for name, cell in zip(table.columns, row, strict=True)
        })  # fmt: skip


def _value(annotation: Any, cell: str, where: str) -> Any:
    try:
        return CODECS[annotation].from_text(cell.removeprefix("'") if annotation is str else cell)
    except (TypeError, ValueError, OverflowError, RecursionError):
        raise BadInput(f"{where}: {cell!r:.60} is not what the log writes there") from None


def parquet(kind: type[Entry], rows: Iterable[Entry]) -> bytes:
    """Rows as Parquet.

    Raises
    ------
    MissingValue
        pyarrow is not installed.
    """
    pyarrow = _pyarrow()
    rows = list(rows)
    arrays = {
        name: pyarrow.array([_plain(getattr(row, name)) for row in rows], _arrow_type(annotation))
        for name, annotation in columns(kind).items()
    }
    sink = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(arrays), sink)
    return sink.getvalue()


def from_parquet(path: Path) -> tuple[type[Entry], list[Entry]]:
    """Kind and rows back from Parquet.

    Raises
    ------
    BadInput
        Not a file that the log wrote.
    """
    pyarrow = _pyarrow()
    try:
        table = pyarrow.parquet.read_table(path)
        rows = table.to_pylist()
    except (OSError, ValueError, pyarrow.ArrowException) as error:
        said = " ".join(str(error).split())
        raise BadInput(f"{str(path)!r} is no Parquet file that can be read: {said:.200}") from None
    kind = kind_of(table.column_names)
    if kind is None:
        raise BadInput(f"{str(path)!r}: columns {shown(table.column_names)}; expected those of the export of a log")
    wanted = columns(kind)
    return kind, [
        kind(**{name: _checked(wanted[name], value, f"{path}, row {k}, column {name}") for name, value in row.items()})
        for k, row in enumerate(rows, 1)
    ]


def _checked(annotation: Any, value: Any, where: str) -> Any:
    """A value from Parquet, held against its type by way of SQLite's."""
    codec = CODECS[annotation]
    try:
        held = tuple(value) if isinstance(value, list) else value
        return codec.from_sql(codec.sql(int(held) if isinstance(held, bool) else held))
    except (TypeError, ValueError, KeyError):
        raise BadInput(f"{where}: {value!r:.60} is not what the log writes there") from None


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _arrow_type(annotation: Any) -> Any:
    pyarrow = _pyarrow()
    text, integer, number = pyarrow.string(), pyarrow.int64(), pyarrow.float64()
    return {
        str: text, int: integer, int | None: integer, float | None: number, bool | None: pyarrow.bool_(),
        tuple[float, ...]: pyarrow.list_(number), tuple[str, ...]: pyarrow.list_(text),
    }[annotation]  # fmt: skip


def keep_raw_files(log: Log, folder: Path, found: Iterable[Entry]) -> None:
    """Keep the raw files of an exported log, each as it was called before.

    Raises
    ------
    BadInput
        One is missing, or is not what its name says.
    """
    for row in found:
        if isinstance(row, RawFile):
            files.keep(log.files, folder / "files" / row.uid, row)


def _pyarrow() -> Any:
    try:
        import pyarrow.parquet
    except ImportError:
        raise MissingValue("Parquet needs pyarrow: pip install 'sensorgen[parquet]', or export CSV") from None
    return pyarrow
