"""Tables of readings kept by hand: CSV with any separator and any column names."""

import csv
import io
import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from sensorgen.core.errors import BadInput, SensorgenError, UnknownName
from sensorgen.core.records import shown
from sensorgen.measure.csv_table import separator_of
from sensorgen.measure.log.entries import Reading
from sensorgen.measure.log.notes import reading

MOST_BYTES = 64_000_000
MAX_CELL = 100_000  # characters
THESIS = "thesis Table D.1"
NAMES = {  # our columns, and names that are recognised
    "specimen": ("specimen", "design", "name", "name_raw", "sensor", "sample", "written"),
    "y": ("y", "ry", "r_y", "resistance in y", "resistance y", "y_words"),
    "z": ("z", "rz", "r_z", "resistance in z", "resistance z", "z_words"),
    "remark": ("remark", "remarks", "comment", "comments"),
    "baked": ("baked",),
    "measured_at": ("measured_at", "date", "time", "measured"),
}
_TRUTH = {"": None, "yes": True, "true": True, "1": True, "baked": True, "no": False, "false": False, "0": False,
          "unbaked": False, "not baked": False}  # fmt: skip
_FIRST_BYTES = {
    b"PK\x03\x04": "a zip archive or a spreadsheet", b"\x80\x04": "a pickle", b"\x80\x05": "a pickle",
    b"\x80\x03": "a pickle", b"\x80\x02": "a pickle", b"\x1f\x8b": "gzip", b"SQLite": "a database",
    b"\x89HDF": "HDF5", b"MATLAB": "MATLAB's", b"PAR1": "Parquet", b"\xd0\xcf\x11\xe0": "an old spreadsheet",
    b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16",
}  # fmt: skip


@dataclass(frozen=True)
class Sheet:
    """A table as text.

    Attributes
    ----------
    name : str
        Name of the file, for messages.
    columns : tuple of str
        Names in the header.
    rows : tuple of list of str
        Cells below the header, unchanged; without blank lines.
    numbers : tuple of int
        Row numbers in the file; the header is row 1.
    """

    name: str
    columns: tuple[str, ...]
    rows: tuple[list[str], ...]
    numbers: tuple[int, ...]


def sheet(path: Path) -> Sheet:
    """Read a CSV file as text.

    Raises
    ------
    BadInput
        Missing, no regular file, too large, not UTF-8 or not CSV; with file and row.
    """
    return parsed(_content(path), str(path))


def parsed(content: bytes, name: str) -> Sheet:
    """Read CSV as text from bytes; ``name`` stands for the file in messages."""
    text = _text(content, name)
    head = text.partition("\n")[0]
    if not head.strip():
        raise BadInput(f"{name}: row 1 is empty; expected a header such as specimen,y,z,remark")
    rows, numbers = [], []
    try:
        csv.field_size_limit(MAX_CELL)
        for number, row in enumerate(
            csv.reader(io.StringIO(text, newline=""), delimiter=separator_of(head), strict=True), 1
        ):
            if number == 1 or any(cell.strip() for cell in row):
                rows.append(row)
                numbers.append(number)
            if len(row) != len(rows[0]) and rows[-1] is row:
                raise BadInput(f"{name}, row {number}: {len(row)} cells; the header has {len(rows[0])}")
    except csv.Error as error:
        raise BadInput(f"{name}, row {len(rows) + 1}: not CSV ({error})") from None
    columns = tuple(cell.strip() for cell in rows[0])
    twice = [column for column, count in Counter(columns).items() if count > 1 and column]
    if twice:
        raise BadInput(f"{name}, row 1: column {shown(twice[0])} stands twice; expected each once")
    return Sheet(name, columns, tuple(rows[1:]), tuple(numbers[1:]))


def _content(path: Path) -> bytes:
    try:
        if path.exists() and not path.is_file():
            raise BadInput(f"{str(path)!r} is no file; expected a table as CSV")
        if (size := path.stat().st_size) > MOST_BYTES:
            raise BadInput(f"{str(path)!r}: {size} bytes; expected at most {MOST_BYTES}: split it")
        return path.read_bytes()
    except (OSError, ValueError) as error:
        raise BadInput(f"cannot read {str(path)!r}: {getattr(error, 'strerror', None) or error}") from None


def _text(content: bytes, name: str) -> str:
    other = next((kind for start, kind in _FIRST_BYTES.items() if content.startswith(start)), "")
    if other:
        raise BadInput(f"{name} is {other}; expected a table as CSV in UTF-8")
    if not content:
        raise BadInput(f"{name} is empty; expected a header such as specimen,y,z,remark, and rows below it")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        row = content.count(b"\n", 0, error.start) + 1
        raise BadInput(
            f"{name}, row {row}: byte {content[error.start]:#04x} is not UTF-8; save the table as CSV in UTF-8"
        ) from None
    if "\0" in text:
        raise BadInput(
            f"{name}, row {text.count(chr(10), 0, text.index(chr(0))) + 1}: a zero byte; expected text as CSV"
        )
    return text


def readings(table: Sheet, columns: Mapping[str, str], source: str) -> tuple[list[Reading], list[str]]:
    """Readings of a table, and the columns that are ignored.

    Parameters
    ----------
    table : Sheet
        The table.
    columns : mapping
        From our columns (``NAMES``) to the table's, where the names are not recognised.
    source : str
        Name of the table in the log.

    Raises
    ------
    BadInput
        A cell that cannot be parsed; with file, row and column.
    """
    places = _places(table, columns)
    seen: Counter[str] = Counter()
    rows = [
        _row(table, row, number, places, seen, source) for row, number in zip(table.rows, table.numbers, strict=True)
    ]
    if not rows:
        raise BadInput(f"{table.name}: no rows below the header")
    used = set(places.values())
    return rows, [name for k, name in enumerate(table.columns) if k not in used and name]


def _places(table: Sheet, columns: Mapping[str, str]) -> dict[str, int]:
    """Position of each of our columns in the table."""
    position = {name.casefold(): k for k, name in enumerate(table.columns)}
    places = {}
    for ours, theirs in columns.items():
        if ours not in NAMES:
            raise UnknownName("column of --column", ours, NAMES)
        if theirs.casefold() not in position:
            raise UnknownName(f"column of {table.name}", theirs, table.columns)
        places[ours] = position[theirs.casefold()]
    for ours, names in NAMES.items():
        recognised = [position[name] for name in names if name in position]
        if ours not in places and recognised:
            places[ours] = recognised[0]
    for needed in (("specimen",), ("y", "z")):
        if not any(ours in places for ours in needed):
            raise BadInput(
                f"{table.name}, row 1: no column {' or '.join(needed)} among {shown(', '.join(table.columns))}; "
                f"name it, as --column {needed[0]}=NAME"
            )
    return places


def _row(
    table: Sheet, row: list[str], number: int, places: Mapping[str, int], seen: Counter[str], source: str
) -> Reading:
    cells = {ours: row[places[ours]].strip() if ours in places else "" for ours in NAMES}
    content = json.dumps(list(cells.values()))
    seen[content] += 1
    baked = cells["baked"].casefold()
    try:
        if baked not in _TRUTH:
            raise BadInput(f"column baked: {shown(cells['baked'])}; expected yes, no or nothing")
        return reading(
            cells["specimen"], cells["y"], cells["z"], remark=cells["remark"], baked=_TRUTH[baked], table=True,
            measured_at=cells["measured_at"], source=source, source_row=number - 1,
            uid=sha256(f"{seen[content]} {content}".encode()).hexdigest()[:32],
        )  # fmt: skip
    except SensorgenError as error:
        raise error.within(f"{table.name}, row {number}") from None


def thesis() -> list[Reading]:
    """Table D.1 of the thesis, 69 rows as printed.

    >>> rows = thesis()
    >>> len(rows), rows[11].written, rows[11].y_words, rows[11].z_ohm
    (69, '23 triX', '0.68k', (45.0,))
    """
    name = Path(__file__).with_name("table_d1.csv")
    return readings(parsed(name.read_bytes(), THESIS), {}, THESIS)[0]
