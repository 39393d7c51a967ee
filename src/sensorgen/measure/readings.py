"""Impedance readings from CSV: one row per sample, two columns per frequency, other columns beside them.

The columns of a frequency are ``re_ohm_1.1kHz`` and ``im_ohm_1.1kHz``, the frequency as units are typed. Cells that are
empty or NaN were not measured.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sensorgen.core import units
from sensorgen.core.errors import BadInput, within
from sensorgen.measure import csv_table, lcr
from sensorgen.measure.csv_table import BLOCK_ROWS, SAME_NAMES, CsvTable, TableRows, listed
from sensorgen.measure.immittance import impedance, pair

_IMPEDANCE = re.compile(r"(re|im)_ohm_(.*)", re.IGNORECASE)
REST = "rest"  # column with 1 where nothing is on the sensor
_EXPECTED = "expected two columns per frequency, as re_ohm_1.1kHz and im_ohm_1.1kHz"


@dataclass(frozen=True)
class FileRows(TableRows):
    """Consecutive rows of a file: numbers of ``Readings.numbers``, text of ``Readings.kept``.

    Attributes
    ----------
    impedance_ohm : (n, m) array
        Readings at m frequencies [ohm]; nan where a cell is empty or says so.
    """

    impedance_ohm: NDArray[np.complex128]


class Readings:
    """A table of impedance readings.

    Parameters
    ----------
    table : CsvTable
        The open file.
    beside : sequence of str
        Columns to give as numbers, where the file has them.
    newest : bool
        Drop readings that wait behind a newer one, as of a pipe that brings more than is worked off; those with 1 in a
        column ``rest`` stay.

    Attributes
    ----------
    frequency_hz : (m,) array
        Frequencies, in the order of their real parts' columns [Hz].
    kept : list of str
        Columns of no impedance that are not in ``beside``.
    numbers : list of str
        Columns of ``beside`` that the file has.
    dropped : int
        Rows that were dropped for newer ones.
    """

    dropped = 0

    def __init__(self, table: CsvTable, beside: Sequence[str] = (), *, newest: bool = False) -> None:
        self._table, self._newest, names = table, newest, table.names
        for name in beside:
            if names.count(name) > 1:
                raise table.error(1, f"{names.count(name)} columns are {name}; expected one")
        with within(f"{table.name}, row 1"):
            self._re, self._im = _impedance_columns(names)
        self._beside, self._others = list[int](), list[int]()
        for at in sorted(set(range(len(names))) - {*self._re.values(), *self._im.values()}):
            (self._beside if names[at] in beside else self._others).append(at)
        self.frequency_hz = np.array(list(self._re))
        self.kept = [names[at] for at in self._others]
        self.numbers = [names[at] for at in self._beside]

    def blocks(self, size: int = BLOCK_ROWS) -> Iterator[FileRows]:
        """Rows, up to ``size`` at a time; errors as :meth:`sensorgen.measure.csv_table.CsvTable.blocks`."""
        m = len(self._re)
        columns = [*self._re.values(), *(self._im[f] for f in self._re), *self._beside]
        for block in self._table.blocks(columns, self._others, size):
            impedance = np.empty((len(block.rows), m), np.complex128)
            impedance.real, impedance.imag = block.numbers[:, :m], block.numbers[:, m : 2 * m]
            rows = FileRows(block.rows, block.numbers[:, 2 * m :], block.text, impedance)
            yield self._only_newest(rows) if self._newest else rows

    def _only_newest(self, block: FileRows) -> FileRows:
        at_rest = [np.nan_to_num(block.numbers[:, k]) != 0 for k, name in enumerate(self.numbers) if name == REST]
        stays = at_rest[0] if at_rest else np.zeros(len(block.rows), bool)
        stays[np.flatnonzero(~stays)[-1:]] = True
        self.dropped += int(np.count_nonzero(~stays))
        rows = np.flatnonzero(stays).tolist()
        text = [block.text[k] for k in rows]
        return FileRows([block.rows[k] for k in rows], block.numbers[rows], text, block.impedance_ohm[rows])


class LcrReadings(Readings):
    """Sweeps of an LCR meter as readings: one sample each, without other columns.

    Parameters
    ----------
    table : LcrTable
        Its export. A frequency that returns begins the next sweep.

    Attributes
    ----------
    frequency_hz, kept, numbers
        As of :class:`Readings`.

    Raises
    ------
    BadInput
        No two quantities that determine an impedance.
    """

    def __init__(self, table: lcr.LcrTable) -> None:
        self._sweeps: list[dict[float, dict[str, float]]] = []
        before = 0.0
        for one in table.readings:
            last = self._sweeps[-1] if self._sweeps else {}
            again = one.frequency_hz in last and (before != one.frequency_hz or one.quantity in last[before])
            if again or not self._sweeps:
                self._sweeps.append({})
            self._sweeps[-1].setdefault(one.frequency_hz, {})[one.quantity] = one.value
            before = one.frequency_hz
        self.frequency_hz = np.array(sorted(set().union(*self._sweeps)))
        self.kept: list[str] = []
        self.numbers: list[str] = []
        if pair({one.quantity for one in table.readings}) is None:
            raise BadInput("no two quantities that determine an impedance; expected two, as Cp and D")

    def blocks(self, size: int = BLOCK_ROWS) -> Iterator[FileRows]:
        """All sweeps, up to ``size`` at a time."""
        for start in range(0, len(self._sweeps), size):
            some = self._sweeps[start : start + size]
            z = [[impedance(sweep.get(f, {}), f) or np.nan for f in self.frequency_hz.tolist()] for sweep in some]
            rows = list(range(start + 1, start + len(some) + 1))
            yield FileRows(rows, np.empty((len(some), 0)), [[]] * len(some), np.array(z, np.complex128))


@contextmanager
def readings(
    path: str, columns: Mapping[str, str] = SAME_NAMES, beside: Sequence[str] = (), *, newest: bool = False
) -> Iterator[Readings]:
    """Open a file of impedance readings; "-" is the standard input.

    Parameters
    ----------
    path : str
        CSV file, or the export of an LCR meter.
    columns : mapping of str to str
        From the file's column names to sensorgen's.
    beside : sequence of str
        Other columns to give as numbers, where the file has them.
    newest : bool
        As of :class:`Readings`.

    Raises
    ------
    BadInput
        A file that cannot be read; a header without impedances, with half an impedance, or with one twice.
    """
    if path != "-" and not columns and lcr.looks_like(Path(path)):
        with within(path):
            sweeps = LcrReadings(lcr.read(Path(path)))
        yield sweeps
        return
    with csv_table.opened(path, columns) as table:
        yield Readings(table, beside, newest=newest)


def _impedance_columns(names: Sequence[str]) -> tuple[dict[float, int], dict[float, int]]:
    """Columns of the real and of the imaginary parts, by frequency [Hz]."""
    parts: dict[str, dict[float, int]] = {"re": {}, "im": {}}
    for at, name in enumerate(names):
        if match := _IMPEDANCE.fullmatch(name):
            with within(f"column {name}"):
                part, frequency = parts[match[1].lower()], units.frequency_hz(match[2])
            if not frequency > 0:
                raise BadInput(f"column {name}: expected a frequency above 0 Hz")
            if frequency in part:
                raise BadInput(f"columns {names[part[frequency]]} and {name} are the same part of one impedance")
            part[frequency] = at
    for one, other in (("re", "im"), ("im", "re")):
        for frequency, at in parts[one].items():
            if frequency not in parts[other]:
                raise BadInput(f"column {names[at]} has no partner {other}_{names[at][3:]}")
    if not parts["re"]:
        raise BadInput(f"no impedances among the columns {listed(names)}; {_EXPECTED}")
    return parts["re"], parts["im"]
