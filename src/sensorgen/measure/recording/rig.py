"""The rig's log: what it was told to do, what it measured, and when something went wrong."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import islice
from math import isinf
from pathlib import Path
from typing import TextIO

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.matfive import MOST_BYTES
from sensorgen.measure.recording.samples import Bools, Real

TIME, SET_FORCE, SET_POSITION, FORCE, ERROR = "time_s", "set_force_n", "set_position_mm", "force_n", "error"
COLUMNS = (TIME, SET_FORCE, SET_POSITION, FORCE, ERROR)
_NEEDED = (TIME, SET_FORCE, SET_POSITION)
_FINE = frozenset({"", "0", "0.0", "false", "no", "none", "ok"})
_LONGEST_LINE = 1 << 16
_MOST_COLUMNS = 1000


@dataclass(frozen=True, eq=False)
class RigLog:
    """What the rig did, row by row.

    Attributes
    ----------
    time_s : (n,) array
        By the rig's own clock, since 1970 or since whenever [s].
    set_force_n, set_position_mm : (n,) array
        What it was told: force [N], centre of the tip along the sensor [mm].
    force_n : (n,) array
        What it measured [N]; nan where it did not.
    error : (n,) array
        Rows that say that something went wrong, whose time is not after all others before, or that are not whole.
    notes : tuple of str
        What is to be known of the log, in words.
    """

    time_s: Real
    set_force_n: Real
    set_position_mm: Real
    force_n: Real
    error: Bools
    notes: tuple[str, ...] = ()

    def counts(self) -> dict[str, int]:
        """Rows, and those with an error."""
        return {"rows": len(self.time_s), "errors": int(np.count_nonzero(self.error))}


def rig(path: Path | str, columns: Mapping[str, str] | None = None) -> RigLog:
    """The log in a CSV file.

    Parameters
    ----------
    path : Path or str
        The file; ``time_s``, ``set_force_n`` and ``set_position_mm`` must be there, ``force_n`` and ``error`` may.
        Times are seconds, or dates as 2023-05-04T12:00:01.25+02:00.
    columns : mapping of str to str, optional
        What the file calls its columns, to what we call them.

    Raises
    ------
    BadInput
        A file that cannot be read, lacks a column or has a cell that is no number, with file, row and column.
    """
    path = Path(path)
    try:
        if path.is_file() and path.stat().st_size > MOST_BYTES:
            raise BadInput(f"more than {MOST_BYTES >> 30} GB; expected a rig's log: split the run")
        with path.open(encoding="utf-8-sig", newline="") as file:
            return _read(file, columns or {})
    except UnicodeDecodeError as error:
        raise BadInput(f"{path}: not UTF-8 text near byte {error.start}; save the log as CSV in UTF-8") from None
    except (OSError, ValueError) as error:
        raise BadInput(f"cannot read {str(path)!r}: {getattr(error, 'strerror', None) or error}") from None
    except BadInput as error:
        raise error.within(str(path)) from None


def _read(file: TextIO, columns: Mapping[str, str]) -> RigLog:
    lines = _lines(file)
    header = next(lines, (0, ""))[1]
    separator = max(";\t,", key=header.count)
    names = [name.strip() for name in _cells(1, header, separator)]
    where = _places(names, columns)
    found: list[list[float]] = []
    errors: list[bool] = []
    for row, line in lines:
        cells = _cells(row, line, separator)
        whole = len(cells) == len(names)
        if not whole and line.endswith(("\n", "\r")):
            raise BadInput(f"row {row}: {len(cells)} cells, but the header has {len(names)}")
        if not whole:  # the last row of a run that stopped half-way
            break
        found.append([_value(cells, where.get(name), name, row, separator) for name in COLUMNS[:-1]])
        errors.append(ERROR in where and cells[where[ERROR]].strip().lower() not in _FINE)
    else:
        whole = True
    if not found:
        raise BadInput("no rows below the header")
    return _log(np.array(found, float), np.array(errors, bool), () if whole else ("the last row is not whole",))


def _lines(file: TextIO) -> Iterator[tuple[int, str]]:
    """Filled lines with their numbers; a line that has no end is no table's."""
    for row in range(1, 1 << 62):
        line = file.readline(_LONGEST_LINE)
        if not line:
            return
        if len(line) == _LONGEST_LINE:
            raise BadInput(f"row {row}: longer than {_LONGEST_LINE} characters; expected a table of a rig's log")
        if "\0" in line:
            raise BadInput(f"row {row}: a zero byte; expected text")
        if not line.isspace():
            yield row, line


def _cells(row: int, line: str, separator: str) -> list[str]:
    if '"' not in line:  # then a comma is a comma: ten times as fast
        return line.rstrip("\r\n").split(separator, _MOST_COLUMNS)[:_MOST_COLUMNS]
    try:
        return list(islice(next(csv.reader([line], delimiter=separator, strict=True), []), _MOST_COLUMNS))
    except csv.Error as error:
        raise BadInput(f"row {row}: this is no row of a CSV file ({error})") from None


def _places(names: Sequence[str], columns: Mapping[str, str]) -> dict[str, int]:
    missing = [name for name in columns if name not in names]
    if missing:
        raise BadInput(f"no column {missing[0]!r}, which the map of columns names; there are {', '.join(names[:12])}")
    ours = [columns.get(name, name) for name in names]
    lacking = [name for name in _NEEDED if ours.count(name) != 1]
    if lacking:
        raise BadInput(
            f"columns {', '.join(names[:12]) or 'none'}; expected {', '.join(_NEEDED)} once each, and {FORCE} and "
            f"{ERROR} if there are: {lacking[0]} is not there once"
        )
    return {name: ours.index(name) for name in COLUMNS if name in ours}


def _value(cells: Sequence[str], at: int | None, name: str, row: int, separator: str) -> float:
    text = "" if at is None else cells[at].strip()
    if not text:
        return float("nan")
    if separator == ";":
        text = text.replace(",", ".")
    value: float | None
    try:
        value = float(text)
    except ValueError:
        value = _date(text) if name == TIME else None
    if value is None or "_" in text or not text.isascii() or isinf(value):
        raise BadInput(f"row {row}, column {name}: {text[:60]!r} is not a number; leave empty what was not measured")
    return value


def _date(text: str) -> float | None:
    """Seconds since 1970 of a date with its time zone."""
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        return None
    return found.timestamp() if found.tzinfo else None


def _log(values: Real, errors: Bools, notes: tuple[str, ...]) -> RigLog:
    before = np.fmax.accumulate(np.concatenate([[-np.inf], values[:-1, 0]]))
    late = ~(values[:, 0] > before)
    said = f"{np.count_nonzero(late)} rows are not after those before them: taken as errors"
    incomplete = ~np.isfinite(values[:, :3]).all(axis=1)
    time, force, position, measured = values.T
    return RigLog(
        time, force, position, measured, errors | late | incomplete, (*notes, *([said] if late.any() else []))
    )
