"""CSV tables: numbers block by block, or text row by row.

The separator is the commonest of ``;``, tab and ``,`` in the header; with ``;``, numbers may have decimal commas. Empty
cells are nan. Rows are counted as an editor counts them: the header is row 1. NumPy converts a whole block; where it
fails, cells are converted one by one, so that the message can name the cell.
"""

import codecs
import csv
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput
from sensorgen.core.files import reading

BLOCK_ROWS = 1 << 14
LONGEST_LINE = 1 << 18
_BLOCK_CHARACTERS = 1 << 21  # of a block: rows may be long
_MOST_LINES = 200  # of one row, whose cells may have line feeds
SAME_NAMES: Mapping[str, str] = {}


class Waiting:
    """Lines of a binary stream that knows how many have come already.

    Parameters
    ----------
    file : binary stream
        With ``read1``, which gives what is there without waiting for more.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file, self._come, self._at = file, b"", 0
        self._begun = False

    def __bool__(self) -> bool:
        """True if a whole line has come."""
        return self._come.find(b"\n", self._at) >= 0

    def readline(self, limit: int, /) -> str:
        """The next line with its line feed, at most so many bytes of it; empty at the end."""
        while not self and len(self._come) - self._at < limit and (more := self._file.read1(1 << 16)):  # type: ignore[attr-defined]
            self._come, self._at = self._come[self._at :] + more, 0
        end = self._come.find(b"\n", self._at, self._at + limit) + 1 or self._at + limit
        line, self._at = self._come[self._at : end], min(end, len(self._come))
        if not self._begun:
            line, self._begun = line.removeprefix(codecs.BOM_UTF8), True
        return line.decode(errors="surrogateescape")


@dataclass(frozen=True)
class TableRows:
    """Consecutive rows of a table.

    Attributes
    ----------
    rows : list of int
        Row numbers in the file.
    numbers : (n, k) array
        Columns that were asked for as numbers; nan where a cell is empty.
    text : list of list of str
        Columns that were asked for as text, row by row.
    """

    rows: list[int]
    numbers: NDArray[np.float64]
    text: list[list[str]]


class CsvTable:
    """A CSV table whose header has been read.

    Parameters
    ----------
    name : str
        Of the file, for messages.
    file : text stream
        Opened with ``errors="surrogateescape"``; of one that is :class:`Waiting`, a block is what has come.
    columns : mapping of str to str
        From the file's column names to sensorgen's.

    Attributes
    ----------
    names : list of str
        Columns, by sensorgen's names where ``columns`` has them.
    separator : str
        Of the columns: ``;``, tab or ``,``.
    truncated : bool
        Whether an incomplete last row was dropped.
    """

    def __init__(self, name: str, file: IO[str] | Waiting, columns: Mapping[str, str] = SAME_NAMES) -> None:
        self.name, self.truncated = name, False
        self._file, self._row = file, 0
        header = self._line()
        if not header.strip():
            raise BadInput(f"{name}: the file is empty; expected a header and rows below it")
        self.separator = max(";\t,", key=header.count)
        names = [cell.strip() for cell in self._cells(1, header)]
        for given in columns:
            if given not in names:
                raise self.error(1, f"no column {given!r}, which the map of columns names; columns: {listed(names)}")
        self.names = [columns.get(cell, cell) for cell in names]

    def error(self, row: int, message: str) -> BadInput:
        """Error with file and row."""
        return BadInput(f"{self.name}, row {row}: {message}")

    def blocks(
        self, numbers: Sequence[int], text: Sequence[int] = (), size: int = BLOCK_ROWS, *, dates: Collection[int] = (),
        truncated: bool = False,
    ) -> Iterator[TableRows]:  # fmt: skip
        """Rows, up to ``size`` at a time.

        Parameters
        ----------
        numbers, text : sequence of int
            Columns to give as numbers and as text.
        size : int
            Lines of a block.
        dates : collection of int
            Columns of ``numbers`` that may hold dates with a time zone; given in seconds since 1970.
        truncated : bool
            Whether the last row may be incomplete, as after a run that was stopped; it is dropped then.

        Raises
        ------
        BadInput
            A row with too few or too many cells, a cell that is no finite number, bytes that are not UTF-8, or no rows.
        """
        empty = True
        while batch := list(self._batch(size)):
            last = batch[-1][1]
            if truncated and not last.endswith("\n") and last.count(self.separator) < len(self.names) - 1:
                self.truncated = True
                batch.pop()
            if filled := [(row, line) for row, line in batch if not line.isspace()]:
                empty = False
                yield self._block(filled, numbers, text, dates)
        if empty:
            raise BadInput(f"{self.name}: no rows below the header")

    def _batch(self, size: int) -> Iterator[tuple[int, str]]:
        """Lines with their numbers, up to ``size``, and as many as memory should hold."""
        characters = 0
        for line in islice(iter(self._line, ""), size):
            yield self._row, line
            characters += len(line)
            if characters > _BLOCK_CHARACTERS or (isinstance(self._file, Waiting) and not self._file):
                return

    def _line(self) -> str:
        line = self._file.readline(LONGEST_LINE)
        self._row += bool(line)
        if len(line) == LONGEST_LINE:
            raise self.error(self._row, f"longer than {LONGEST_LINE} characters; expected a CSV table")
        try:
            _ = line.isascii() or line.encode()
        except UnicodeEncodeError as error:  # bytes that were not UTF-8 are lone surrogates in the text
            byte = ord(line[error.start]) & 0xFF
            message = f"character {error.start + 1}: byte {byte:#04x} is not UTF-8; save the file as CSV in UTF-8"
            raise BadInput(f"{self.name}, row {self._row}, {message}") from None
        if "\0" in line:
            raise self.error(self._row, "a zero byte; expected text")
        return line

    def _block(
        self, batch: Sequence[tuple[int, str]], numbers: Sequence[int], text: Sequence[int], dates: Collection[int]
    ) -> TableRows:
        rows, lines = map(list, zip(*batch, strict=True))
        values = self._converted_at_once(lines, numbers)
        if values is not None:  # no quotes: every separator separates, and splitting is faster
            cells = [line.rstrip("\r\n").split(self.separator) if text else [] for line in lines]
        else:
            cells = [self._counted(row, self._cells(row, line)) for row, line in zip(rows, lines, strict=True)]
            some = (self._number(row, line, at, dates) for row, line in zip(rows, cells, strict=True) for at in numbers)
            values = np.fromiter(some, float, len(rows) * len(numbers)).reshape(len(rows), len(numbers))
        return TableRows(rows, values, [[line[at] for at in text] for line in cells])

    def _number(self, row: int, cells: Sequence[str], at: int, dates: Collection[int]) -> float:
        try:
            return number(cells[at], decimal_comma=self.separator == ";", date=at in dates)
        except BadInput as error:
            raise error.within(f"{self.name}, row {row}, column {self.names[at]}") from None

    def _converted_at_once(self, lines: list[str], numbers: Sequence[int]) -> NDArray[np.float64] | None:
        """All numbers of a block, or None where a cell is quoted, empty, no number, or infinite."""
        if any('"' in line or line.count(self.separator) != len(self.names) - 1 for line in lines):
            return None
        if self.separator == ";":
            lines = [line.replace(",", ".") for line in lines]
        try:
            values = np.loadtxt(lines, delimiter=self.separator, usecols=numbers, comments=None, ndmin=2, dtype=float)
        except ValueError:
            return None
        return None if np.isinf(values).any() else values

    def text_rows(self) -> Iterator[tuple[int, list[str]]]:
        """Row number and cells of every row that is not blank; a cell may span lines.

        Raises
        ------
        BadInput
            As :meth:`blocks`.
        """
        begun = 0

        def lines() -> Iterator[str]:
            for line in iter(self._line, ""):
                if self._row - begun > _MOST_LINES:
                    raise self.error(begun, f"longer than {_MOST_LINES} lines; close every quotation mark")
                yield line

        rows = csv.reader(lines(), delimiter=self.separator, strict=True)
        while True:
            row = begun = self._row + 1
            try:
                cells = next(rows)
            except StopIteration:
                return
            except csv.Error as error:
                raise self._no_csv(row, error) from None
            if any(cell.strip() for cell in cells):
                yield row, self._counted(row, cells)

    def _cells(self, row: int, line: str) -> list[str]:
        try:
            return next(csv.reader([line], delimiter=self.separator, strict=True))
        except csv.Error as error:
            raise self._no_csv(row, error) from None

    def _no_csv(self, row: int, error: csv.Error) -> BadInput:
        advice = "close every quotation mark just before a separator, and end rows with a line feed"
        return self.error(row, f"this is no row of a CSV file ({error}); {advice}")

    def _counted(self, row: int, cells: list[str]) -> list[str]:
        if wrong := miscounted(cells, len(self.names), self.separator):
            raise self.error(row, wrong)
        return cells


def miscounted(cells: Sequence[str], wanted: int, separator: str) -> str:
    """Words on a row with too few or too many cells; "" of any other."""
    decimal = separator == "," and len(cells) > wanted
    advice = "; if the numbers have decimal commas, write ';' between the columns" if decimal else ""
    return f"{len(cells)} cells, but the header has {wanted}{advice}" if len(cells) != wanted else ""


@contextmanager
def opened(path: Path | str, columns: Mapping[str, str] = SAME_NAMES) -> Iterator[CsvTable]:
    """Open a CSV file; "-" is the standard input.

    Raises
    ------
    BadInput
        A file that is missing or cannot be read; a header without a column that ``columns`` names.
    """
    if path == "-":
        if sys.stdin is None:
            raise BadInput("the standard input is closed; expected a CSV table there, or the name of a file")
        yield CsvTable("standard input", Waiting(sys.stdin.buffer), columns)
        return
    if Path(path).is_dir():
        raise BadInput(f"{path} is a folder; expected a CSV file")
    with reading(path):
        file = Path(path).open(encoding="utf-8-sig", errors="surrogateescape", newline="\n")  # noqa: SIM115 - below
    with file:
        yield CsvTable(str(path), file, columns)


def listed(names: Sequence[str]) -> str:
    """First names of a header, for a message."""
    return (", ".join(names[:8]) or "none") + (", ..." if len(names) > 8 else "")


def _with_point(text: str) -> str:
    """Number with a decimal point in place of its comma."""
    if "," in text and "." in text:
        raise BadInput(f"{text[:60]!r} has a point and a comma; write numbers as 1234.5 or 1234,5")
    return text.replace(",", ".")


def number(text: str, *, decimal_comma: bool = False, date: bool = False) -> float:
    """Number in a cell; nan where it is empty.

    Raises
    ------
    BadInput
        No finite number.

    Examples
    --------
    >>> number("1,5", decimal_comma=True), number("1970-01-01T00:01:00Z", date=True), number(" ")
    (1.5, 60.0, nan)
    """
    stripped = (_with_point(text) if decimal_comma else text).strip()
    value: float | None
    try:
        value = float(stripped) if stripped else np.nan
    except ValueError:
        value = _seconds(stripped) if date else None
    if value is None or "_" in stripped or not stripped.isascii():  # Python reads 1_0 and other scripts' digits too
        raise BadInput(f"{text[:60]!r} is not a number; leave the cell empty where nothing was measured")
    if np.isinf(value):
        raise BadInput(f"{text[:60]!r} is not finite; leave the cell empty where nothing was measured")
    return value


def _seconds(text: str) -> float | None:
    """A date with its time zone, in seconds since 1970; None of any other text."""
    with suppress(ValueError):
        when = datetime.fromisoformat(text)
        return when.timestamp() if when.tzinfo else None
    return None
