"""Export the log as CSV or Parquet, and read an export back exactly.

Spreadsheets run text that begins with ``=``, ``+``, ``-`` or ``@``. Such text gets a leading apostrophe, and so does
text that begins with an apostrophe: the import removes one, so that every text comes back unchanged. Text that a
terminal would obey is JSON behind an apostrophe.
"""

import csv
import io
import json
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from sensorgen.core import files as store
from sensorgen.core.display import escaped, harmless
from sensorgen.core.document import spreadsheet
from sensorgen.core.errors import BadInput, MissingValue, Unwritable
from sensorgen.core.records import shown
from sensorgen.measure.csv_table import CsvTable
from sensorgen.measure.log import entries, files
from sensorgen.measure.log.entries import ROWS, Entry, Print, RawFile, Reading, Value
from sensorgen.measure.log.logbook import Log

FORMATS = ("csv", "parquet")
FILES = {kind: f"{entries.NAMES[kind].replace('_', '-')}s".replace("batchs", "batches") for kind in ROWS}
LATER = (entries.Calibration, entries.DesignRow, entries.Withdrawal)  # kinds that exports of version 0.1.0 do not have
_LATER_COLUMNS: dict[type[Entry], tuple[str, ...]] = {  # that exports of earlier versions do not have
    Print: ("printed",),
    Reading: ("quantity", "value", "frequency_hz", "uncertainty", "wires", "temperature_c", "humidity_percent",
              "photo", "file", "defects"),
}  # fmt: skip
COLUMNS = {kind: {k: v for k, v in entries.COLUMNS[kind].items() if k != "number"} for kind in ROWS}
"""Columns of each exported table with their types: all fields but the row's number in its own log."""


def kind_of(names: Iterable[str]) -> type[Entry] | None:
    """Kind of row with exactly these columns, or None; those of later versions may be missing."""
    present = {*names, "claimed_at"}
    for kind in ROWS:
        needed = COLUMNS[kind].keys() - _LATER_COLUMNS.get(kind, ())
        if needed <= present <= COLUMNS[kind].keys():
            return kind
    return None


def export(log: Log, place: Path) -> int:
    """Write readings to a ``.csv`` or ``.parquet`` file, or the whole log to a new folder.

    Parameters
    ----------
    log : Log
        An open log.
    place : Path
        File or folder.

    Returns
    -------
    int
        Number of rows written.

    Raises
    ------
    BadInput
        The folder exists; or a raw file of the log is missing.
    Unwritable
        The file or folder cannot be written.
    """
    file_format = place.suffix.lower().removeprefix(".")
    if file_format in FORMATS:
        return _write_table(log, Reading, place, file_format)
    if place.suffix or os.path.lexists(place):
        raise BadInput(
            f"cannot export to {str(place)!r}; expected a .csv or .parquet file, or a folder that is not there"
        )
    part = store.part_of(place)
    try:
        (part / "files").mkdir(parents=True)
        rows = sum(_write_table(log, kind, part / f"{name}.csv", "csv") for kind, name in FILES.items())
        for file in log.entries(RawFile):
            shutil.copyfile(files.place(log.files, file), part / "files" / file.uid)
        part.rename(place)
        return rows
    except OSError as error:
        raise Unwritable(f"cannot export to {str(place)!r}: {error.strerror or error}") from None
    finally:
        with suppress(OSError):
            shutil.rmtree(part)


def _write_table(log: Log, kind: type[Entry], path: Path, file_format: str) -> int:
    rows = log.entries(kind, superseded=True)
    if file_format == "parquet":
        table = list(rows)
        store.replace(path, parquet(kind, table))
        return len(table)
    count = -1  # the header
    with store.replacing(path) as file:
        for line in csv_lines(kind, rows):
            file.write(line.encode())
            count += 1
    return count


def csv_lines(kind: type[Entry], rows: Iterable[Entry]) -> Iterator[str]:
    """Rows as CSV, the header first."""
    wanted, target = COLUMNS[kind], io.StringIO(newline="")
    writer = csv.writer(target, lineterminator="\r\n")  # \n alone leaves a bare \r unquoted
    writer.writerow(wanted)
    yield target.getvalue()
    for entry in rows:
        target.seek(0)
        target.truncate()
        cells = ((getattr(entry, name), annotation) for name, annotation in wanted.items())
        writer.writerow([_cell(value, annotation) for value, annotation in cells])
        yield target.getvalue()


def _cell(value: Any, annotation: Any) -> str:
    """A cell; text as JSON behind an apostrophe where it has characters that a terminal obeys."""
    if annotation is not str:
        return escaped(entries.to_cell(value))
    return spreadsheet(value) if harmless(value) == value else f"'{escaped(json.dumps(value, ensure_ascii=False))}"


def from_csv(kind: type[Entry], table: CsvTable) -> Iterator[Entry]:
    """Rows of an exported CSV table.

    Raises
    ------
    BadInput
        A cell that the export did not write; with file, row and column.
    """

    def convert(annotation: Any, cell: str) -> Value:
        if annotation is str:
            cell = json.loads(cell[1:]) if cell.startswith("'\"") else cell.removeprefix("'")
        return entries.from_cell(annotation, cell)

    for number, cells in table.text_rows():
        values = dict(zip(table.names, cells, strict=True))
        yield _entry(kind, values, f"{table.name}, row {number}", convert)


def _entry(kind: type[Entry], values: Mapping[str, Any], where: str, convert: Callable[[Any, Any], Value]) -> Entry:
    wanted, row = COLUMNS[kind], dict[str, Any]()
    for name, value in values.items():
        try:
            row[name] = convert(wanted[name], value)
        except (TypeError, ValueError, KeyError, OverflowError, RecursionError):
            raise BadInput(f"{where}, column {name}: {value!r:.60} is not what the log writes there") from None
    return kind(**row)


def parquet(kind: type[Entry], rows: list[Entry]) -> bytes:
    """Rows as Parquet.

    Raises
    ------
    MissingValue
        pyarrow is not installed.
    """
    pyarrow = _pyarrow()
    text, integer, number = pyarrow.string(), pyarrow.int64(), pyarrow.float64()
    types = {
        str: text, int: integer, int | None: integer, float | None: number, bool | None: pyarrow.bool_(),
        tuple[float, ...]: pyarrow.list_(number), tuple[str, ...]: pyarrow.list_(text),
    }  # fmt: skip
    arrays = {
        name: pyarrow.array([getattr(row, name) for row in rows], types[annotation])
        for name, annotation in COLUMNS[kind].items()
    }
    sink = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(arrays), sink)
    return sink.getvalue()


def from_parquet(path: Path) -> tuple[type[Entry], list[Entry]]:
    """Kind and rows of an exported Parquet file.

    Raises
    ------
    BadInput
        Not a file that the export wrote.
    """
    pyarrow = _pyarrow()
    try:
        table = pyarrow.parquet.read_table(path)
        rows = table.to_pylist()
    except (OSError, ValueError, pyarrow.ArrowException) as error:
        reason = " ".join(str(error).split())
        raise BadInput(f"{str(path)!r} is no Parquet file that can be read: {reason:.200}") from None
    kind = kind_of(table.column_names)
    if kind is None:
        raise BadInput(f"{str(path)!r}: columns {shown(table.column_names)}; expected those of the export of a log")

    return kind, [_entry(kind, row, f"{path}, row {k}", entries.from_json) for k, row in enumerate(rows, 1)]


def _pyarrow() -> Any:
    try:
        import pyarrow.parquet
    except ImportError:
        raise MissingValue("Parquet needs pyarrow: pip install 'sensorgen[parquet]', or export CSV") from None
    return pyarrow
