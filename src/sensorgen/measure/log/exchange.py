"""Files into the log: readings, print beds, exported logs; and the log as CSV or Parquet, exact both ways.

Each file is imported as a whole or not at all.

Spreadsheets run text that begins with ``=``, ``+``, ``-`` or ``@``. Such text gets a leading apostrophe, and so does
text that begins with an apostrophe: the import removes one, so that every text comes back unchanged. Text that a
terminal would obey is JSON behind an apostrophe.
"""

import csv
import io
import json
import os
import re
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from hashlib import sha256
from itertools import count
from operator import attrgetter
from pathlib import Path
from typing import Any

from sensorgen.core import files as store
from sensorgen.core import yamlfile
from sensorgen.core.display import escaped, harmless
from sensorgen.core.document import Part, spreadsheet
from sensorgen.core.errors import BadInput, SensorgenError, UnknownName, library
from sensorgen.core.records import shown
from sensorgen.measure import accuracy, csv_table, lcr
from sensorgen.measure.csv_table import CsvTable
from sensorgen.measure.input_file import checked_head
from sensorgen.measure.log import entries, files, notes, prints
from sensorgen.measure.log.entries import ROWS, Entry, Print, RawFile, Reading, Value
from sensorgen.measure.log.logbook import Log
from sensorgen.measure.log.notes import reading

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
    """Write readings that are not withdrawn to a ``.csv`` or ``.parquet`` file, or the whole log to a new folder.

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
        newest = {row.uid for row in log.entries(Reading)}  # of which none is withdrawn
        every = log.entries(Reading, superseded=True)
        used = (row for row in every if row.uid in newest or not log.withdrawn(row))
        return _write_table(used, Reading, place, file_format)
    if place.suffix or os.path.lexists(place):
        raise BadInput(
            f"cannot export to {str(place)!r}; expected a .csv or .parquet file, or a folder that is not there"
        )
    part = store.part_of(place)
    try:
        with store.writing(place, "cannot export to"):
            (part / "files").mkdir(parents=True)
            rows = sum(
                _write_table(log.entries(kind, superseded=True), kind, part / f"{name}.csv", "csv")
                for kind, name in FILES.items()
            )
            for file in log.entries(RawFile):
                shutil.copyfile(files.place(log.files, file), part / "files" / file.uid)
            part.rename(place)
            return rows
    finally:
        with suppress(OSError):
            shutil.rmtree(part)


def _write_table(rows: Iterable[Entry], kind: type[Entry], path: Path, file_format: str) -> int:
    if file_format == "parquet":
        table = list(rows)
        store.replace(path, parquet(kind, table))
        return len(table)
    with store.replacing(path) as file:
        return sum(file.write(line.encode()) > 0 for line in csv_lines(kind, rows)) - 1  # without the header


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
    NotInstalled
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
    library("pyarrow.parquet", "Parquet needs pyarrow: pip install 'sensorgen[parquet]', or export CSV")
    import pyarrow

    return pyarrow


MOST_BYTES = 64_000_000
THESIS = "thesis Table D.1"
NAMES = yamlfile.read(Path(__file__).with_name("columns.yaml"))
_UNIT = re.compile(r"(.+?)\s*(?:[\[(]\s*([kmg]?)(?:Ω|ohms?)?\s*[\])]|[/_ ]\s*([kmg]?)(?:Ω|ohms?))$", re.IGNORECASE)
_TRUTH = {"": None, "yes": True, "true": True, "1": True, "baked": True, "no": False, "false": False, "0": False,
          "unbaked": False, "not baked": False}  # fmt: skip


@contextmanager
def opened(path: Path) -> Iterator[CsvTable]:
    """Open a table.

    Raises
    ------
    BadInput
        Missing, no regular file, too large, or without a header.
    """
    checked_head(path, MOST_BYTES, "a table as CSV in UTF-8")
    with csv_table.opened(path) as table:
        twice = [name for name, count in Counter(table.names).items() if count > 1 and name]
        if twice:
            raise table.error(1, f"column {shown(twice[0])} stands twice; expected each once")
        yield table


def readings(
    table: CsvTable, columns: Mapping[str, str], source: str, log: Log | None = None
) -> tuple[Iterator[Reading], list[str]]:
    """Readings of a table as it is read, and the columns that are ignored.

    Parameters
    ----------
    table : CsvTable
        An open table.
    columns : mapping
        From our columns (``NAMES``) to the table's, where the names are not recognised.
    source : str
        Name of the table in the log.
    log : Log, optional
        Where names are bound to designs.

    Raises
    ------
    BadInput
        A cell that cannot be parsed, or a column in a unit that is none of resistance; with file, row and column.
    """
    places = _places(table, columns)
    left_out = [name for k, name in enumerate(table.names) if k not in set(places.values()) and name]
    return _rows(table, places, source, log), left_out


def _rows(table: CsvTable, places: Mapping[str, int], source: str, log: Log | None) -> Iterator[Reading]:
    seen: Counter[str] = Counter()
    bound = {row.specimen for row in log.entries(Print)} if log else set()
    for number, cells in _cells(table, places):
        content = json.dumps(list(cells.values()))
        seen[content] += 1
        uid = sha256(f"{seen[content]} {content}".encode()).hexdigest()[:32]
        named = log if " ".join(cells["specimen"].split()) in bound else None  # a query for each would take long
        yield _row(table, number, cells, source=source, uid=uid, log=named)
    if not seen:
        raise BadInput(f"{table.name}: no rows below the header")


def _cells(table: CsvTable, places: Mapping[str, int]) -> Iterator[tuple[int, dict[str, str]]]:
    """Number of each row and its cells by our columns, with the units in the header."""
    prefixes = {axis: prefix for axis in ("y", "z") if axis in places and (prefix := _prefix(table, places[axis]))}
    for number, row in table.text_rows():
        cells = {ours: row[places[ours]].strip() if ours in places else "" for ours in NAMES}
        yield number, cells | {axis: notes.with_prefix(cells[axis], prefix) for axis, prefix in prefixes.items()}


def _prefix(table: CsvTable, column: int) -> str:
    """Prefix of the unit in a column's header, as k of ``Y (kohm)``; "" without one."""
    name = table.names[column]
    match = _UNIT.fullmatch(name)
    if match is None and name.endswith((")", "]")):
        raise table.error(1, f"unit of column {shown(name)}; expected ohm, kohm or Mohm, or a name without brackets")
    return match[2] or match[3] or "" if match else ""


def _places(table: CsvTable, columns: Mapping[str, str]) -> dict[str, int]:
    """Position of each of our columns in the table."""
    position = dict(zip(map(str.casefold, table.names), count(), strict=False))
    plain = {_UNIT.sub(r"\1", name): k for name, k in position.items()} | position
    places = {ours: plain[name] for ours, names in NAMES.items() for name in reversed(names) if name in plain}
    for ours, theirs in columns.items():
        if ours not in NAMES:
            raise UnknownName("column of --column", ours, NAMES)
        if theirs.casefold() not in position:
            raise UnknownName(f"column of {table.name}", theirs, table.names)
        places[ours] = position[theirs.casefold()]
    for needed in (("specimen",), ("y", "z")):
        if not places.keys() & {*needed}:
            raise BadInput(
                f"{table.name}, row 1: no column {' or '.join(needed)} among {shown(', '.join(table.names))}; "
                f"name it, as --column {needed[0]}=NAME"
            )
    return places


def _row(table: CsvTable, number: int, cells: Mapping[str, str], **about: Any) -> Reading:
    baked = cells["baked"].casefold()
    try:  # of a hundred thousand rows: a context manager would take longer than they
        if baked not in _TRUTH:
            raise BadInput(f"column baked: {shown(cells['baked'])}; expected yes, no or nothing")
        return reading(
            cells["specimen"], cells["y"], cells["z"], remark=cells["remark"], baked=_TRUTH[baked],
            separator=table.separator, measured_at=cells["measured_at"], source_row=number - 1, **about,
        )  # fmt: skip
    except SensorgenError as error:
        raise error.within(f"{table.name}, row {number}") from None


def thesis_readings() -> list[Reading]:
    """Table D.1 of the thesis, 69 rows as printed.

    >>> rows = thesis_readings()
    >>> len(rows), rows[11].written, rows[11].y_words, rows[11].z_ohm
    (69, '23 triX', '0.68k', (45.0,))
    """
    with opened(Path(__file__).with_name("table_d1.csv")) as table:
        return list(readings(table, {}, THESIS)[0])


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
    if not current:
        yield from rows
        return
    rows = list(rows)
    unchanged = {row.uid for row in rows} & current.keys()
    gone = {uid: reading for uid, reading in current.items() if uid not in unchanged}
    for row in rows:
        known = row.uid in unchanged or not gone or next(log.entries(Reading, uid=row.uid), None)
        yield row if known else _correction(log, row, gone, table, alike=bool(unchanged))


def _correction(log: Log, row: Reading, gone: dict[str, Reading], table: str, *, alike: bool) -> Reading:
    """Row as the correction of one that has gone from its table, and is taken out of these; itself if it is new."""
    taken_back = next(log.entries(Reading, replaced=True, uid=row.uid), None) is not None  # an edit, perhaps
    old = _in_place(row, gone.values(), alike=alike) or (None if taken_back else _same(row, gone.values()))
    if old:
        del gone[old.uid]
        uid = sha256(f"{row.uid} {old.uid}".encode()).hexdigest()[:32] if taken_back else row.uid
        return replace(row, uid=uid, supersedes=old.uid)
    other = next((old for old in gone.values() if old.specimen == row.specimen), None)
    if other and not taken_back:
        raise BadInput(
            f"{table}, row {(row.source_row or 0) + 1}: not what reading {other.number} of {other.specimen} was in "
            f"a table of this name. If it corrects that one: sensorgen log withdraw reading {other.number} "
            "--reason corrected, and import again. If it is another table: give the file another name"
        )
    return row


def _in_place(row: Reading, gone: Iterable[Reading], *, alike: bool) -> Reading | None:
    """Reading in a row's place with its values, or, of a table that is ``alike`` otherwise, of its specimen."""
    here = (old for old in gone if old.source_row == row.source_row)
    return next((o for o in here if _measured(o) == _measured(row) or (alike and o.specimen == row.specimen)), None)


def _same(row: Reading, gone: Iterable[Reading]) -> Reading | None:
    """Reading of a row's specimen with its values."""
    return next((o for o in gone if o.specimen == row.specimen and _measured(o) == _measured(row)), None)


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
    elsewhere : dict of str to int
        Number of rows that the log has of each other table.
    left_out : tuple of str
        Columns that were ignored.
    """

    rows: int
    new: int
    doubtful: int
    corrections: int = 0
    elsewhere: dict[str, int] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()

    def document(self) -> Iterator[Part]:
        """Rows, and the columns that were ignored."""
        known = f"{self.rows - self.new} were there" if self.new < self.rows else ""
        doubtful = f"{self.doubtful} with doubts" if self.doubtful else ""
        edited = f"{self.corrections} correct what was logged before the table was edited" if self.corrections else ""
        yield ", ".join(filter(None, (f"{self.new} of {self.rows} rows logged", known, doubtful, edited)))
        for table, equal in self.elsewhere.items():
            yield f"{equal} were there as rows of {table}: if they were measured anew, give them a date or a remark"
        if self.left_out:
            yield f"columns left out: {', '.join(self.left_out)}"


def thesis(log: Log) -> ImportedRecording:
    """Log Table D.1 of the thesis."""
    return _add(log, thesis_readings())


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
    raw_file = files.keep(log.files, path)
    meter = accuracy.find(table.preamble)
    row = replace(
        notes.with_readings(replace(of, doubts=(*of.doubts, *table.doubts)), table.readings, _MOST_DOUBTS),
        uid=sha256(f"{of.specimen} {raw_file.uid}".encode()).hexdigest()[:32], file=raw_file.uid,
        instrument=instrument or (meter.name if meter else ""),
    )  # fmt: skip
    new = [row for row in log.add([raw_file, row]) if isinstance(row, Reading)]
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
        From sensorgen's columns to the table's, as in :func:`sensorgen.measure.log.exchange.readings`.

    Raises
    ------
    BadInput
        A file that cannot be read; with its name, row and column. Nothing is logged then.
    """
    if path.suffix.lower() == ".json":
        return _add(log, list(prints.rows(path, files.keep(log.files, path))))
    if path.is_dir():
        return _add(log, _exported(log, path))
    with _table(log, path, columns) as (rows, left_out):
        return _add(log, rows, left_out)


def _exported(log: Log, path: Path) -> list[Entry]:
    """Rows of an exported log, whose raw files are kept."""
    exported: list[Entry] = []
    for kind, name in FILES.items():
        file = next((p for suffix in FORMATS if (p := path / f"{name}.{suffix}").is_file()), None)
        if file is None:
            if kind in LATER:
                continue
            raise BadInput(f"{str(path)!r} has no {name}.csv; expected the folder of an exported log")
        with _table(log, file, {}) as (table, _):
            rows = list(table)
        if not all(isinstance(row, kind) for row in rows):
            raise BadInput(f"{file}: columns of another table; expected those of {name}")
        exported += rows
    for row in exported:
        if isinstance(row, RawFile):
            files.keep(log.files, path / "files" / row.uid, row)
    return exported


@contextmanager
def _table(log: Log, path: Path, columns: Mapping[str, str]) -> Iterator[tuple[Iterable[Entry], Sequence[str]]]:
    """Rows of a table as it is read, and the columns that are ignored."""
    if path.suffix.lower() == ".parquet":
        yield from_parquet(path)[1], ()
        return
    if not columns and lcr.looks_like(path) and not _is_log_table(path):
        raise BadInput(f"{path}: the export of an LCR meter; say of which specimen, as --specimen S1")
    with opened(path) as table:
        if kind := kind_of(table.names):
            yield from_csv(kind, table), ()
        else:
            rows, left_out = readings(table, columns, path.name, log)
            yield corrections(log, rows, path.name), left_out


def _is_log_table(path: Path) -> bool:
    """Test whether a file is an exported table of a log, or has a column of specimens."""
    with suppress(BadInput), opened(path) as table:
        return kind_of(table.names) is not None or bool(
            {name.casefold() for name in table.names} & {*NAMES["specimen"]}
        )
    return False


def _add(log: Log, rows: Iterable[Entry], left_out: Iterable[str] = ()) -> ImportedRecording:
    numbers, new, doubtful, corrections = count(), 0, 0, 0
    for row in log.adding(row for row, _ in zip(rows, numbers, strict=False)):
        new += 1
        doubtful += isinstance(row, Reading) and bool(row.doubts)
        corrections += bool(getattr(row, "supersedes", "")) and not row.claimed_at  # of no export
    elsewhere = {there: n for (there, here), n in log.passed_over.items() if there != here}
    return ImportedRecording(next(numbers), new, doubtful, corrections, elsewhere, tuple(left_out))
