"""Exports of LCR meters: a table of frequency and two or more quantities, as each maker writes it.

Separators (comma, semicolon, tab), decimal commas, comment lines, lines with settings before the header, a row of units
below it, units in the header or beside each number, UTF-8 with a byte order mark and Windows-1252 are all recognised.
"""

import csv
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sensorgen.core import yamlfile
from sensorgen.core.errors import BadInput, within
from sensorgen.measure import immittance
from sensorgen.measure.csv_table import miscounted
from sensorgen.measure.immittance import AcReading
from sensorgen.measure.input_file import checked_head

MOST_BYTES = 16_000_000
EXPECTED = "a header such as Frequency,Cp,D with numbers below it"
MOST_BARE_F = 1e-6  # a larger capacitance without a unit is in another one than F
_HEADER_LINES, _HEAD_BYTES = 200, 100_000  # within which the header stands
_COMMENTS = ("#", "!", "%", "//", "*")
_WORDS = yamlfile.read(Path(__file__).with_name("lcr.yaml"))
_QUANTITY = {name: quantity for quantity, names in _WORDS["names"].items() for name in names.split()}
_FUNCTIONS: dict[str, list[str]] = _WORDS["functions"]  # of meters: what primary and secondary are
_UNIT = re.compile(r"(?P<name>.+?)\s*(?:[\[(](?P<in>[^\])]*)[\])]|[/_ ](?P<after>[^/_ ]+))")
_NUMBER = re.compile(rf"(?P<number>{immittance.NUMBER})\s*(?P<unit>\S*)")
_MISSING = re.compile(r"|[-–]+|n/?a|nan|inf|[-+]?ol|over(load|flow)?|error", re.IGNORECASE)
_STATUS = ("status", "stat", "state", "error", "validity")


@dataclass(frozen=True)
class LcrTable:
    """An export of an LCR meter.

    Attributes
    ----------
    readings : tuple of AcReading
        Row by row; repeats of a frequency are rows of their own.
    rows : int
        Rows with a reading.
    preamble : str
        Lines before the header.
    doubts : tuple of str
        What was assumed or left out.
    left_out : tuple of str
        Columns that were ignored.
    """

    readings: tuple[AcReading, ...]
    rows: int
    preamble: str
    doubts: tuple[str, ...]
    left_out: tuple[str, ...]


@dataclass(frozen=True)
class _Column:
    """Position of a quantity, what its numbers are multiplied by, and its head."""

    at: int
    quantity: str
    scale: float | None
    head: str

    def scale_of(self, unit: str) -> float | None:
        """Factor to SI of a number with a unit of its own; the column's without one."""
        return float(immittance.factor(self.quantity, unit)) if unit else self.scale


_Number = tuple[float, bool]  # in SI units, and True if its unit is known
_Row = dict[_Column, _Number]


@dataclass(frozen=True)
class _Header:
    line: int
    separator: str
    columns: tuple[_Column, ...]
    heads: tuple[str, ...]

    @property
    def status(self) -> list[int]:
        """Positions of the meter's marks of rows."""
        return [k for k, head in enumerate(self.heads) if head.casefold() in _STATUS]


def read(path: Path) -> LcrTable:
    """Read an export.

    Parameters
    ----------
    path : Path
        CSV or text file.

    Raises
    ------
    BadInput
        No such header, no frequency, no quantity, an unknown unit, or a cell that is no number; with file and row.
    """
    lines = _lines(path)
    header = _header(lines, path)
    columns, first_row = _with_units(lines, header)
    rows, faulty = list[_Row](), 0
    for number, cells in _rows(lines, header, first_row, path):
        if any(cells[k].strip("+0. ") for k in header.status):
            faulty += 1
        else:
            rows.append(dict(_numbers(cells, columns, f"{path}, row {number + 1}")))
    overloads = len(rows) * len(columns) - sum(map(len, rows))
    readings = tuple(_readings(rows, columns, path))
    if not readings:
        raise BadInput(f"{path}: no readings below the header in row {header.line + 1}")
    used = {column.at for column in columns} | set(header.status)
    left_out = tuple(head for k, head in enumerate(header.heads) if k not in used and head)
    return LcrTable(readings, len(rows), "\n".join(lines[: header.line]), _doubts(columns, overloads, faulty), left_out)


def _doubts(columns: Sequence[_Column], overloads: int, faulty: int) -> tuple[str, ...]:
    """Remarks on what was assumed or left out."""
    names = {_name(column.head)[0] for column in columns}
    doubts = [text for name, text in _WORDS["assumed"].items() if name in names]
    doubts += [f"{overloads} cells without a number"] if overloads else []
    doubts += [f"{faulty} rows left out: the meter marked them as faulty"] if faulty else []
    return tuple(doubts)


def _rows(lines: Sequence[str], header: _Header, first: int, path: Path) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of each row of the table."""
    for number in range(first, len(lines)):
        cells = _cells(lines[number], header.separator)
        if not any(cells) or _is_remark(lines[number]):
            continue
        if wrong := miscounted(cells, len(header.heads), header.separator):
            raise BadInput(f"{path}, row {number + 1}: {wrong}")
        yield number, cells


def looks_like(path: Path) -> bool:
    """Test whether a file has the header of an LCR meter's export."""
    try:
        return bool(_header(_lines(path, _HEAD_BYTES), path))
    except BadInput:
        return False


def _lines(path: Path, most_bytes: int = MOST_BYTES) -> list[str]:
    checked_head(path, MOST_BYTES, EXPECTED)
    with path.open("rb") as file:
        content = file.read(most_bytes)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", "replace")
    if "\0" in text:
        raise BadInput(f"{path}: a zero byte; expected {EXPECTED}")
    return text.splitlines()


def _cells(line: str, separator: str) -> list[str]:
    try:
        cells = [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]
    except csv.Error as error:
        raise BadInput(f"{error}; expected {EXPECTED}") from None
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _header(lines: Sequence[str], path: Path) -> _Header:
    """The first line with names of two quantities, of which one has to be the frequency."""
    for number, line in enumerate(lines[:_HEADER_LINES]):
        bare = line.strip().lstrip("#!%*").strip()  # some write the header as a comment
        separator = max(";\t,", key=bare.count)
        heads = _cells(bare, separator) if separator in bare else []
        columns = tuple(_columns(heads, lines[:number]))
        quantities = {column.quantity for column in columns}
        if len(quantities) == len(columns) > 1:
            if "frequency" not in quantities:
                raise BadInput(f"{path}, row {number + 1}: no column of the frequency among {', '.join(heads)}")
            return _Header(number, separator, columns, tuple(heads))
    first = next((line.strip() for line in lines if line.strip()), "")
    raise BadInput(f"{path}: no table of an LCR meter, begins with {first!r:.60}; expected {EXPECTED}")


def _columns(heads: Sequence[str], before: Sequence[str]) -> Iterator[_Column]:
    for at, head in enumerate(heads):
        name, unit = _name(head)
        if name in ("primary", "secondary", "a", "b", "dataa", "datab") and (function := _function(before)):
            quantity = function[name in ("secondary", "b", "datab")]
            unit, quantity = (quantity, "phase") if quantity in ("deg", "rad") else (unit, quantity)
        else:
            quantity = _QUANTITY.get(name, "")
        if not quantity:
            continue
        try:
            scale = float(immittance.factor(quantity, unit)) if unit else None
        except BadInput:
            continue
        yield _Column(at, quantity, scale, head)


def _function(before: Sequence[str]) -> list[str] | None:
    """Primary and secondary quantity, where a line of settings names the meter's function, as Cp-D or CPD."""
    for line in before:
        for word in re.split(r"[\s,;:=\"]+", line.upper()):
            if quantities := _FUNCTIONS.get(re.sub(r"[-–/_]", "", word)):
                return quantities
    return None


def _name(head: str) -> tuple[str, str]:
    """Name as in ``_QUANTITY``, and unit, of a head such as ``Cp [pF]``, ``f/Hz`` or ``freq_hz``."""
    plain = re.sub(r"\s+", "", head.casefold())
    if plain in _QUANTITY:
        return plain, ""
    match = _UNIT.fullmatch(head.strip())
    if match is None:
        return plain, ""
    return re.sub(r"[\s_]+", "", match["name"].casefold()), (match["in"] or match["after"] or "").strip()


def _with_units(lines: Sequence[str], header: _Header) -> tuple[tuple[_Column, ...], int]:
    """Columns with the units of a row below the header, if there is one, and the first row of numbers."""
    below = header.line + 1
    while below < len(lines) and _is_remark(lines[below]):
        below += 1
    cells = _cells(lines[below], header.separator) if below < len(lines) else []
    if not any(cells) or any(map(_NUMBER.match, cells)) or len(cells) > len(header.heads):
        return header.columns, below
    units = [cell.strip("[]() -") for cell in cells] + [""] * len(header.heads)
    return tuple(replace(column, scale=column.scale_of(units[column.at])) for column in header.columns), below + 1


def _is_remark(line: str) -> bool:
    """Test whether a line is blank, or a comment."""
    return not line.strip() or line.lstrip().startswith(_COMMENTS)


def _numbers(cells: Sequence[str], columns: Sequence[_Column], where: str) -> Iterator[tuple[_Column, _Number]]:
    """Numbers of a row, without those that are missing."""
    for column in columns:
        cell = cells[column.at]
        if _MISSING.fullmatch(cell):
            continue
        match = _NUMBER.fullmatch(cell)
        if match is None:
            message = f"{cell!r:.40} is no number; leave the cell empty where nothing was measured"
            raise BadInput(f"{where}, column {column.head}: {message}")
        value = float(immittance.decimal(match["number"]))
        if abs(value) < immittance.NO_VALUE:
            with within(f"{where}, column {column.head}"):
                scale = column.scale_of(match["unit"])
                if scale is None and column.quantity in ("Cp", "Cs") and abs(value) > MOST_BARE_F:
                    raise BadInput(f"{value:g} F? Write the unit in the header, as {column.quantity} [pF]")
            yield column, (value * (1.0 if scale is None else scale), scale is not None)


def _readings(rows: Sequence[_Row], columns: Sequence[_Column], path: Path) -> Iterator[AcReading]:
    for numbers in _by_quantity(rows, columns, path):
        frequency = numbers.pop("frequency", math.nan)
        if frequency < 0 or (frequency == 0 and numbers):
            raise BadInput(f"{path}: a frequency of {frequency:g} Hz; expected one above 0")
        if frequency > 0:
            yield from (AcReading(quantity, value, frequency) for quantity, value in numbers.items())


def _by_quantity(rows: Sequence[_Row], columns: Sequence[_Column], path: Path) -> Iterator[dict[str, float]]:
    """Numbers of each row by their quantity; angles without a unit are in degrees, where that is certain."""
    degrees = _degrees(rows, columns, path)
    for row in rows:
        yield {
            column.quantity: math.radians(value) if degrees and column.quantity == "phase" and not known else value
            for column, (value, known) in row.items()
        }


def _degrees(rows: Sequence[_Row], columns: Sequence[_Column], path: Path) -> bool:
    """Test whether angles without a unit are in degrees: only if one is too large for radians."""
    bare = [value for row in rows for column, (value, known) in row.items() if column.quantity == "phase" and not known]
    if bare and max(map(abs, bare)) <= math.pi:
        head = next(column.head for column in columns if column.quantity == "phase")
        raise BadInput(f"{path}, column {head}: degrees or radians? Write the unit in the header, as phase [deg]")
    return bool(bare)
