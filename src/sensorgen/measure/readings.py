"""Impedances from CSV files, block by block: one row per sample, two columns per tone, anything else beside them.

The columns of a tone are ``re_ohm_1.1kHz`` and ``im_ohm_1.1kHz``, the frequency as units are typed. Cells that are
empty or NaN were not measured. Rows are counted as an editor does: the header is row 1.
"""

import csv
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from sensorgen.core import units
from sensorgen.core.errors import BadInput

BLOCK = 1 << 14
_TONE = re.compile(r"(re|im)_ohm_(.*)", re.IGNORECASE)
_AS_THEY_ARE: Mapping[str, str] = {}
_WANTED = "two columns per tone, as re_ohm_1.1kHz and im_ohm_1.1kHz"


@dataclass(frozen=True)
class Block:
    """Some rows of a file.

    Attributes
    ----------
    rows : list of int
        Their numbers in the file.
    impedance_ohm : (n, n_tones) array
        Readings [ohm]; nan where a cell is empty or says so.
    kept : list of list of str
        The cells of the other columns, row by row, as they stand there.
    numbers : (n, k) array
        Columns beside the tones that were asked for as numbers; nan where a cell is empty.
    """

    rows: list[int]
    impedance_ohm: NDArray[np.complex128]
    kept: list[list[str]]
    numbers: NDArray[np.float64]


@dataclass(frozen=True)
class _Header:
    """Columns of a file: names, what lies between them, and where the tones are."""

    names: list[str]
    separator: str
    frequency_hz: list[float]
    re: list[int]
    im: list[int]
    kept: list[int]
    numbers: list[int]


class Readings:
    """A file whose header has been read.

    Attributes
    ----------
    name : str
        Of the file, for messages.
    frequency_hz : (n_tones,) array
        Tones, in the order of their real parts' columns [Hz].
    kept : list of str
        Names of the columns that belong to no tone and were not asked for.
    numbers : list of str
        Names of the columns that were asked for and are there.
    """

    def __init__(
        self, name: str, file: IO[str], columns: Mapping[str, str] = _AS_THEY_ARE, beside: Sequence[str] = ()
    ) -> None:
        self.name, self._file, self._next = name, file, 1
        header = self._lines(1)
        if not header or not header[0].strip():
            raise BadInput(f"{name}: the file is empty; expected a header with {_WANTED}")
        try:
            self._header = _header(header[0], columns, beside)
        except BadInput as error:
            raise error.within(f"{name}, row 1") from None
        self.frequency_hz = np.array(self._header.frequency_hz)
        self.kept = [self._header.names[i] for i in self._header.kept]
        self.numbers = [self._header.names[i] for i in self._header.numbers]

    def blocks(self, size: int = BLOCK) -> Iterator[Block]:
        """The rows, up to ``size`` at a time.

        Raises
        ------
        BadInput
            A row that is too short or too long, a cell that is no finite number, or text that is not UTF-8; with file,
            row and column. Also a file without rows.
        """
        found = False
        while lines := self._lines(size):
            first = self._next - len(lines)
            filled = [(first + i, line) for i, line in enumerate(lines) if not line.isspace()]
            if filled:
                found = True
                yield self._block([row for row, _ in filled], [line for _, line in filled])
        if not found:
            raise BadInput(f"{self.name}: no rows below the header")

    def _lines(self, count: int) -> list[str]:
        lines = list(islice(self._file, count))
        for row, line in enumerate(lines, self._next):
            if not line.isascii():
                self._check_utf8(row, line)
        self._next += len(lines)
        return lines

    def _check_utf8(self, row: int, line: str) -> None:
        """Refuse bytes that were no UTF-8: they stand in the text as lone surrogates."""
        try:
            line.encode()
        except UnicodeEncodeError as error:
            raise BadInput(
                f"{self.name}, row {row}, character {error.start + 1}: byte {ord(line[error.start]) & 0xFF:#04x} "
                "is not UTF-8; save the file as CSV in UTF-8"
            ) from None

    def _block(self, rows: list[int], lines: list[str]) -> Block:
        header = self._header
        cells = None if self._plain(lines) else self._cells(rows, lines)
        values = self._numbers(lines) if cells is None else None
        if values is None or np.isinf(values).any():
            cells = cells or self._cells(rows, lines)
            values = self._one_by_one(rows, cells)
        if header.kept:
            split = cells or [line.rstrip("\r\n").split(header.separator) for line in lines]
            kept = [[row[i] for i in header.kept] for row in split]
        else:
            kept = [[] for _ in rows]
        n = len(header.re)
        impedance = np.empty((len(rows), n), np.complex128)
        impedance.real, impedance.imag = values[:, :n], values[:, n : 2 * n]
        return Block(rows, impedance, kept, values[:, 2 * n :])

    def _plain(self, lines: list[str]) -> bool:
        """Whether every separator separates: no quotes, and as many cells as the header has."""
        header = self._header
        count = len(header.names) - 1
        return all(line.count(header.separator) == count and '"' not in line for line in lines)

    def _numbers(self, lines: list[str]) -> NDArray[np.float64] | None:
        """All numbers at once, or None where a cell is none."""
        header = self._header
        if header.separator == ";":
            lines = [line.replace(",", ".") for line in lines]
        try:
            return np.loadtxt(
                lines,
                delimiter=header.separator,
                usecols=header.re + header.im + header.numbers,
                comments=None,
                ndmin=2,
                dtype=float,
            )
        except ValueError:
            return None

    def _cells(self, rows: list[int], lines: list[str]) -> list[list[str]]:
        header, found = self._header, []
        for row, line in zip(rows, lines, strict=True):
            try:
                cells = _split(line, header.separator)
                if len(cells) != len(header.names):
                    raise BadInput(self._miscounted(len(cells)))
            except BadInput as error:
                raise error.within(f"{self.name}, row {row}") from None
            found.append(cells)
        return found

    def _miscounted(self, count: int) -> str:
        wanted, separator = len(self._header.names), self._header.separator
        text = f"{count} cells, but the header has {wanted}"
        if separator == "," and count > wanted:
            text += "; if the numbers have decimal commas, write ';' between the columns"
        return text

    def _one_by_one(self, rows: list[int], cells: list[list[str]]) -> NDArray[np.float64]:
        header = self._header
        columns = header.re + header.im + header.numbers
        found = np.empty((len(rows), len(columns)))
        for i, (row, line) in enumerate(zip(rows, cells, strict=True)):
            for j, column in enumerate(columns):
                try:
                    found[i, j] = _number(line[column], header.separator)
                except BadInput as error:
                    raise error.within(f"{self.name}, row {row}, column {header.names[column]}") from None
        return found


@contextmanager
def readings(path: str, columns: Mapping[str, str] = _AS_THEY_ARE, beside: Sequence[str] = ()) -> Iterator[Readings]:
    """Open a file of readings; "-" is the standard input.

    Parameters
    ----------
    path : str
        The file.
    columns : mapping of str to str
        What the file calls its columns, to what we call them.
    beside : sequence of str
        Columns beside the tones that are to be read as numbers where they are there.

    Raises
    ------
    BadInput
        A file that is not there or cannot be read; no tones, half a tone, or one tone twice in its header.
    """
    if path != "-" and Path(path).is_dir():
        raise BadInput(f"{path} is a folder; expected a CSV file with {_WANTED}")
    if path == "-":
        yield Readings("standard input", _as_utf8(sys.stdin), columns, beside)
        return
    with _opened(path) as file:
        yield Readings(path, file, columns, beside)


def _opened(path: str) -> IO[str]:
    try:
        return Path(path).open(encoding="utf-8-sig", errors="surrogateescape", newline="\n")
    except (OSError, ValueError) as error:
        raise BadInput(f"cannot read {path!r}: {getattr(error, 'strerror', None) or error}") from None


def _as_utf8(file: IO[str]) -> IO[str]:
    if hasattr(file, "reconfigure"):
        file.reconfigure(encoding="utf-8-sig", errors="surrogateescape", newline="\n")
    return file


def _header(line: str, columns: Mapping[str, str], beside: Sequence[str]) -> _Header:
    separator = max(";\t,", key=line.count)
    names = _renamed([name.strip() for name in _split(line, separator)], columns, beside)
    parts: dict[str, dict[float, int]] = {"re": {}, "im": {}}
    kept = []
    for i, name in enumerate(names):
        match = _TONE.fullmatch(name)
        if match is None:
            kept.append(i)
            continue
        part, frequency = match[1].lower(), _hertz(name, match[2])
        if frequency in parts[part]:
            raise BadInput(f"columns {names[parts[part][frequency]]} and {name} are the same part of the same tone")
        parts[part][frequency] = i
    _check_pairs(parts, names)
    tones = list(parts["re"])
    numbers = [i for i in kept if names[i] in beside]
    kept = [i for i in kept if names[i] not in beside]
    return _Header(names, separator, tones, list(parts["re"].values()), [parts["im"][f] for f in tones], kept, numbers)


def _renamed(names: list[str], columns: Mapping[str, str], beside: Sequence[str]) -> list[str]:
    """Columns by our names; those that matter must be there once."""
    for given in columns:
        if given not in names:
            raise BadInput(f"no column {given!r}, which the map of columns names; there are {', '.join(names[:12])}")
    found = [columns.get(name, name) for name in names]
    for name in beside:
        if found.count(name) > 1:
            raise BadInput(f"{found.count(name)} columns are {name}; expected one")
    return found


def _split(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator, strict=True))
    except csv.Error as error:
        raise BadInput(
            f"this is no row of a CSV file ({error}); close every quotation mark just before a separator, and end rows "
            "with a line feed"
        ) from None


def _check_pairs(parts: dict[str, dict[float, int]], names: Sequence[str]) -> None:
    for one, other in (("re", "im"), ("im", "re")):
        for frequency, i in parts[one].items():
            if frequency not in parts[other]:
                raise BadInput(f"column {names[i]} has no partner {other}_{names[i][3:]}")
    if not parts["re"]:
        shown = ", ".join(names[:8]) + (", ..." if len(names) > 8 else "")
        raise BadInput(f"no impedances among the columns {shown}; expected {_WANTED}")


def _hertz(name: str, text: str) -> float:
    try:
        frequency = units.frequency_hz(text)
    except BadInput as error:
        raise error.within(f"column {name}") from None
    if not frequency > 0:
        raise BadInput(f"column {name}: expected a tone above 0 Hz")
    return frequency


def _number(text: str, separator: str) -> float:
    """A cell as a number; nan where it is empty."""
    plain = text.strip()
    if separator == ";":
        if "," in plain and "." in plain:
            raise BadInput(f"{text!r} has a point and a comma; write numbers as 1234.5 or 1234,5")
        plain = plain.replace(",", ".")
    try:
        value = float(plain) if plain else np.nan
    except ValueError:
        value = None
    if value is None or "_" in plain or not plain.isascii():  # Python reads 1_0 and other scripts' digits as well
        raise BadInput(f"{text!r} is not a number")
    if np.isinf(value):
        raise BadInput(f"{text!r} is not finite; leave the cell empty where nothing was measured")
    return value
