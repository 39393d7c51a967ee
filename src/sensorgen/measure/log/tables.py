"""Tables of readings kept by hand: CSV with any separator and any column names."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path

from sensorgen.core.errors import BadInput, UnknownName, within
from sensorgen.core.records import shown
from sensorgen.measure import csv_table
from sensorgen.measure.csv_table import CsvTable
from sensorgen.measure.input_file import checked_head
from sensorgen.measure.log.entries import Reading
from sensorgen.measure.log.notes import reading

MOST_BYTES = 64_000_000
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


def readings(table: CsvTable, columns: Mapping[str, str], source: str) -> tuple[Iterator[Reading], list[str]]:
    """Readings of a table as it is read, and the columns that are ignored.

    Parameters
    ----------
    table : CsvTable
        An open table.
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
    left_out = [name for k, name in enumerate(table.names) if k not in set(places.values()) and name]
    return _rows(table, places, source), left_out


def _rows(table: CsvTable, places: Mapping[str, int], source: str) -> Iterator[Reading]:
    seen: Counter[str] = Counter()
    for number, cells in table.text_rows():
        yield _row(table, number, cells, places, seen, source)
    if not seen:
        raise BadInput(f"{table.name}: no rows below the header")


def _places(table: CsvTable, columns: Mapping[str, str]) -> dict[str, int]:
    """Position of each of our columns in the table."""
    position = {name.casefold(): k for k, name in enumerate(table.names)}
    places = {}
    for ours, theirs in columns.items():
        if ours not in NAMES:
            raise UnknownName("column of --column", ours, NAMES)
        if theirs.casefold() not in position:
            raise UnknownName(f"column of {table.name}", theirs, table.names)
        places[ours] = position[theirs.casefold()]
    for ours, names in NAMES.items():
        recognised = [position[name] for name in names if name in position]
        if ours not in places and recognised:
            places[ours] = recognised[0]
    for needed in (("specimen",), ("y", "z")):
        if not any(ours in places for ours in needed):
            raise BadInput(
                f"{table.name}, row 1: no column {' or '.join(needed)} among {shown(', '.join(table.names))}; "
                f"name it, as --column {needed[0]}=NAME"
            )
    return places


def _row(
    table: CsvTable, number: int, row: list[str], places: Mapping[str, int], seen: Counter[str], source: str
) -> Reading:
    cells = {ours: row[places[ours]].strip() if ours in places else "" for ours in NAMES}
    content = json.dumps(list(cells.values()))
    seen[content] += 1
    baked = cells["baked"].casefold()
    with within(f"{table.name}, row {number}"):
        if baked not in _TRUTH:
            raise BadInput(f"column baked: {shown(cells['baked'])}; expected yes, no or nothing")
        return reading(
            cells["specimen"], cells["y"], cells["z"], remark=cells["remark"], baked=_TRUTH[baked], table=True,
            measured_at=cells["measured_at"], source=source, source_row=number - 1,
            uid=sha256(f"{seen[content]} {content}".encode()).hexdigest()[:32],
        )  # fmt: skip


def thesis() -> list[Reading]:
    """Table D.1 of the thesis, 69 rows as printed.

    >>> rows = thesis()
    >>> len(rows), rows[11].written, rows[11].y_words, rows[11].z_ohm
    (69, '23 triX', '0.68k', (45.0,))
    """
    with opened(Path(__file__).with_name("table_d1.csv")) as table:
        return list(readings(table, {}, THESIS)[0])
