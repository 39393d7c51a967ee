"""Whole rows of impedances from an instrument that measures one frequency after the other."""

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
        rows = [
            row
            for each in zip(found.time_s.tolist(), found.impedance_ohm, found.clipped.tolist(), strict=True)
            if (row := self._taken(*each))
        ]
        count = found.impedance_ohm.shape[1]
        times, impedance, clipped = zip(*rows, strict=True) if rows else ((), (), ())
        return Readings(
            np.array(times, float), np.array(impedance, complex).reshape(-1, count), np.array(clipped, bool), found.lost
        )

    def _taken(self, time_s: float, row: Complex, clipped: bool) -> tuple[float, Complex, bool] | None:
        known = np.isfinite(row)
        if known.all() or not known.any():
            return time_s, row, clipped
        self._row = row if self._row is None else np.where(known, row, self._row)
        self._times.append(time_s)
        self._clipped |= clipped
        if not np.isfinite(self._row).all():
            return None
        whole = float(np.mean(self._times)), self._row, self._clipped
        self._row, self._times, self._clipped = None, [], False
        return whole
