"""Tables that people keep: CSV with any separator and any names of columns, to readings of the multimeter."""

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
from sensorgen.measure.log.entries import Reading
from sensorgen.measure.log.words import reading

MOST_BYTES = 64_000_000
MOST_LETTERS = 100_000  # of a cell
THESIS = "thesis Table D.1"
NAMES = {  # columns of ours, and what they are called in the wild
    "specimen": ("specimen", "design", "name", "name_raw", "sensor", "sample", "written"),
    "y": ("y", "ry", "r_y", "resistance in y", "resistance y", "y_words"),
    "z": ("z", "rz", "r_z", "resistance in z", "resistance z", "z_words"),
    "remark": ("remark", "remarks", "comment", "comments"),
    "baked": ("baked",),
    "measured_at": ("measured_at", "date", "time", "measured"),
}
_TRUTH = {"": None, "yes": True, "true": True, "1": True, "baked": True, "no": False, "false": False, "0": False,
          "unbaked": False, "not baked": False}  # fmt: skip
_BEGINNINGS = {
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
        Of its file, for messages.
    columns : tuple of str
        Names in its header.
    rows : tuple of list of str
        The cells below it, as they stand; blank lines are left out.
    numbers : tuple of int
        The rows' numbers, the header being row 1.
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
        Not there, no plain file, too large, not UTF-8 or not CSV; with file, row and column as far as there are any.
    """
    return parsed(_content(path), str(path))


def parsed(content: bytes, name: str) -> Sheet:
    """The same for bytes; ``name`` stands for the file in messages."""
    text = _text(content, name)
    head = text.partition("\n")[0]
    if not head.strip():
        raise BadInput(f"{name}: row 1 is empty; expected a header such as specimen,y,z,remark")
    rows, numbers = [], []
    try:
        csv.field_size_limit(MOST_LETTERS)
        for number, row in enumerate(
            csv.reader(io.StringIO(text, newline=""), delimiter=_separator(head), strict=True), 1
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


def _separator(head: str) -> str:
    return max(",;\t", key=head.count)


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
    what = next((said for start, said in _BEGINNINGS.items() if content.startswith(start)), "")
    if what:
        raise BadInput(f"{name} is {what}; expected a table as CSV in UTF-8")
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
    """The readings in a table, and the columns that were left out.

    Parameters
    ----------
    table : Sheet
        The table.
    columns : mapping
        Of ours (``NAMES``) to those of the table, where they are not known by themselves.
    source : str
        What to call it in the log.

    Raises
    ------
    BadInput
        A cell that cannot be read; with file, row and column. Nothing is taken from such a table.
    """
    places = _places(table, columns)
    seen: Counter[str] = Counter()
    found = [
        _row(table, row, number, places, seen, source) for row, number in zip(table.rows, table.numbers, strict=True)
    ]
    if not found:
        raise BadInput(f"{table.name}: no rows below the header")
    taken = set(places.values())
    return found, [name for k, name in enumerate(table.columns) if k not in taken and name]


def _places(table: Sheet, columns: Mapping[str, str]) -> dict[str, int]:
    """Which of the table's columns is which of ours."""
    there = {name.casefold(): k for k, name in enumerate(table.columns)}
    found = {}
    for ours, theirs in columns.items():
        if ours not in NAMES:
            raise UnknownName("column of --column", ours, NAMES)
        if theirs.casefold() not in there:
            raise UnknownName(f"column of {table.name}", theirs, table.columns)
        found[ours] = there[theirs.casefold()]
    for ours, names in NAMES.items():
        known = [there[name] for name in names if name in there]
        if ours not in found and known:
            found[ours] = known[0]
    for wanted in (("specimen",), ("y", "z")):
        if not any(ours in found for ours in wanted):
            raise BadInput(
                f"{table.name}, row 1: no column {' or '.join(wanted)} among {shown(', '.join(table.columns))}; "
                f"name it, as --column {wanted[0]}=NAME"
            )
    return found


def _row(
    table: Sheet, row: list[str], number: int, places: Mapping[str, int], seen: Counter[str], source: str
) -> Reading:
    cells = {ours: row[place] for ours, place in places.items()}
    same = json.dumps([cells.get(ours, "").strip() for ours in NAMES])
    seen[same] += 1
    try:
        return reading(
            cells["specimen"].strip(),
            cells.get("y", "").strip(),
            cells.get("z", "").strip(),
            remark=cells.get("remark", "").strip(),
            baked=_truth(cells.get("baked", "")),
            table=True,
            measured_at=cells.get("measured_at", "").strip(),
            source=source,
            source_row=number - 1,
            uid=sha256(f"{seen[same]} {same}".encode()).hexdigest()[:32],
        )
    except SensorgenError as error:
        raise error.within(f"{table.name}, row {number}") from None


def _truth(cell: str) -> bool | None:
    word = cell.strip().casefold()
    if word not in _TRUTH:
        raise BadInput(f"column baked: {shown(cell)}; expected yes, no or nothing")
    return _TRUTH[word]


def thesis() -> list[Reading]:
    """Table D.1 of the thesis, 69 rows in its own words.

    >>> rows = thesis()
    >>> len(rows), rows[11].written, rows[11].y_words, rows[11].z_ohm
    (69, '23 triX', '0.68k', (45.0,))
    """
    name = Path(__file__).with_name("table_d1.csv")
    return readings(parsed(name.read_bytes(), THESIS), {}, THESIS)[0]
