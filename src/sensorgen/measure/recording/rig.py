"""Log of the rig: set force and position, measured force, errors, each with the rig's own time."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure import csv_table
from sensorgen.measure.csv_table import SAME_NAMES, CsvTable, listed
from sensorgen.measure.input_file import checked_head
from sensorgen.measure.recording.samples import Bools, Real
from sensorgen.measure.recording.spool import MOST_BYTES

_TIME, _STAMP = "time_s", "stamp_s"
_NEEDED = ("set_force_n", "set_position_mm")
_MOST_ROWS = 1 << 21  # 29 h at 20 rows/s
_FORCE, _ERROR = "force_n", "error"
_NO_ERROR = frozenset({"", "0", "0.0", "false", "no", "none", "ok"})


@dataclass(frozen=True, eq=False)
class RigLog:
    """Rows of the rig's log.

    Attributes
    ----------
    time_s : (n,) array
        Time by the rig's clock, since 1970 or since any other moment [s].
    set_force_n, set_position_mm : (n,) array
        Set force [N]; set position of the tip's centre along the sensor [mm].
    force_n : (n,) array
        Measured force [N]; nan where none was measured.
    error : (n,) array
        Rows that report an error, are not later than all rows before, or are incomplete.
    notes : tuple of str
        Remarks on the whole log.
    stamped : bool
        Whether the time is by the computer that stamped the recording, too.
    """

    time_s: Real
    set_force_n: Real
    set_position_mm: Real
    force_n: Real
    error: Bools
    notes: tuple[str, ...] = ()
    stamped: bool = False

    def sound(self) -> tuple[Real, Real, Real, Real]:
        """Time [s], force (the set one if none was measured), set force [N] and position [mm] of sound rows."""
        good = ~self.error
        force = np.where(np.isfinite(self.force_n), self.force_n, self.set_force_n)
        return self.time_s[good], force[good], self.set_force_n[good], self.set_position_mm[good]

    def counts(self) -> dict[str, int]:
        """Number of rows, and of those with an error."""
        return {"rows": len(self.time_s), "errors": int(np.count_nonzero(self.error))}


def rig(path: Path | str, columns: Mapping[str, str] | None = None) -> RigLog:
    """Read the rig's log.

    Parameters
    ----------
    path : Path or str
        CSV file with the columns ``time_s``, ``set_force_n`` and ``set_position_mm``; ``force_n`` and ``error`` are
        optional. Times are seconds, or dates as 2023-05-04T12:00:01.25+02:00. ``stamp_s`` in place of ``time_s``:
        seconds since 1970 by the computer that stamped the recording, too.
    columns : mapping of str to str, optional
        From the file's column names to sensorgen's.

    Raises
    ------
    BadInput
        A file that cannot be read, lacks a column or has a cell that is no number, with file, row and column.
    """
    path = Path(path)
    checked_head(path, MOST_BYTES, "a rig's log as CSV")
    try:
        with csv_table.opened(path, columns or SAME_NAMES) as table:
            return _read(table)
    except OSError as error:
        raise BadInput(f"cannot read {str(path)!r}: {error.strerror or error}") from None


def _check_names(table: CsvTable, time_name: str) -> None:
    for needed in (time_name, *_NEEDED):
        if table.names.count(needed) != 1:
            expected = ", ".join((_TIME, *_NEEDED))
            message = f"columns {listed(table.names)}; expected {expected} once each, and {_FORCE} and {_ERROR} if "
            raise table.error(1, f"{message}available: {needed} is not there once")


def _read(table: CsvTable) -> RigLog:
    names = table.names
    time_name = _STAMP if _STAMP in names else _TIME
    _check_names(table, time_name)
    force, error = ([names.index(name)] if name in names else [] for name in (_FORCE, _ERROR))
    needed_columns = [names.index(name) for name in (time_name, *_NEEDED)]
    numbers, reported = [], []
    for block in table.blocks([*needed_columns, *force], error, dates=needed_columns[:1], truncated=True):
        numbers.append(block.numbers)
        reported.append(np.array([bool(c) and c[0].strip().lower() not in _NO_ERROR for c in block.text]))
        if block.rows[-1] > _MOST_ROWS:
            raise table.error(block.rows[-1], f"more rows than expected, {_MOST_ROWS}; split the log of the rig")
    values = np.concatenate(numbers)
    incomplete = ~np.isfinite(values[:, :3]).all(axis=1)
    late = ~(values[:, 0] > np.fmax.accumulate(np.concatenate([[-np.inf], values[:-1, 0]])))
    notes = ["the last row is incomplete: dropped"] if table.truncated else []
    if late.any():
        notes.append(f"{np.count_nonzero(late)} rows are not later than the rows before: taken as errors")
    time, set_force, position = values[:, :3].T
    measured = values[:, 3] if force else np.full(len(values), np.nan)
    error_rows = np.concatenate(reported) | late | incomplete
    return RigLog(time, set_force, position, measured, error_rows, tuple(notes), time_name == _STAMP)
