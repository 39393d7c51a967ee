"""Whole rows of impedances from an instrument that measures one frequency after the other."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from sensorgen.core.arrays import Complex
from sensorgen.measure.lab.devices import Readings


@dataclass
class Sweeps:
    """Rows with some frequencies missing are put together; whole rows, and those without any number, pass as they are.

    A row of several has the mean of their times; it waits until each of its frequencies was measured.
    """

    _row: Complex | None = None
    _times: list[float] = field(default_factory=list)
    _clipped: bool = False

    def whole(self, found: Readings) -> Readings:
        """Rows that are whole now."""
        known = np.isfinite(found.impedance_ohm)
        if (known.all(axis=1) | ~known.any(axis=1)).all():
            return found
        rows = zip(found.time_s.tolist(), found.impedance_ohm, found.clipped.tolist(), strict=True)
        whole = [row for each in rows for row in self._taken(*each)]
        return Readings.joined(whole, found.impedance_ohm.shape[1], found.lost)

    def _taken(self, time_s: float, row: Complex, clipped: bool) -> Iterator[Readings]:
        known = np.isfinite(row)
        if not known.all() and known.any():
            self._row = row if self._row is None else np.where(known, row, self._row)
            self._times.append(time_s)
            self._clipped |= clipped
            if not np.isfinite(self._row).all():
                return
            time_s, row, clipped = float(np.mean(self._times)), self._row, self._clipped
            self._row, self._times, self._clipped = None, [], False
        yield Readings(np.array([time_s]), row[None], np.array([clipped]))
