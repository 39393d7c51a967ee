"""Pressure maps of an array's frames as they come, lot by lot."""

from collections import deque
from dataclasses import dataclass, field
from math import nan

import numpy as np

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.prediction.array.elements import Past
from sensorgen.prediction.array.frames import SCATTER, MapInverter, MapPlan, PressureMaps, at_rest, missing
from sensorgen.prediction.array.model import ArrayModel
from sensorgen.prediction.array.readout import ArrayReadout
from sensorgen.prediction.array.sessions import ArrayCalibration

_REST = 200  # frames at rest, at most, whose mean is the reference


@dataclass(eq=False)
class LiveMaps:
    """Inversion of a recording that goes on; memory does not grow.

    Frames at rest are the reference of those after them. The choice of the model, and the state of a calibration's
    memory, go on from lot to lot.

    Attributes
    ----------
    model, readout : ArrayModel, ArrayReadout
        The array, and how it is read, at one frequency.
    scatter : float
        Standard deviation of the gain from cell to cell [-].
    calibration : ArrayCalibration, optional
        Of each element.
    day : float
        Of the recording, as the calibration counts them [d].
    plan : MapPlan
        Choice of the model.
    dropped : int
        Frames that were not inverted: before any at rest.
    """

    model: ArrayModel
    readout: ArrayReadout
    scatter: float = SCATTER
    calibration: "ArrayCalibration | None" = None
    day: float = nan
    plan: MapPlan = field(default_factory=MapPlan)
    dropped: int = 0
    _past: Past = field(default_factory=Past)
    _rest: "deque[Complex]" = field(default_factory=lambda: deque(maxlen=_REST))
    _inverter: "MapInverter | None" = None

    @property
    def tared(self) -> bool:
        """True once frames at rest have come."""
        return bool(self._rest)

    def take(self, siemens: Complex, time_s: Real, rest: Mask) -> "PressureMaps | None":
        """Maps of a lot's loaded frames, (k, m, n) [S], as of the whole recording; None without any.

        Raises
        ------
        BadInput
            Readings at rest of which none is as predicted; no day, where the gain drifts.
        """
        if rest.any():
            self._renew(siemens[rest])
        loaded = np.flatnonzero(~rest)
        if loaded.size and not self.tared:
            self.dropped += len(loaded)
            return None
        if not loaded.size:
            return None
        if self._inverter is None:
            self._inverter = at_rest(self.model, self.readout, np.array(self._rest), self.scatter)
        frames = missing(siemens[loaded])
        maps = self._inverter.maps(frames, time_s[loaded], self.calibration, self.day, self.plan, self._past)
        return maps.on_surface()

    def _renew(self, frames: Complex) -> None:
        """Another reference: what was at rest before loaded frames is past."""
        if self._inverter is not None:
            self._rest.clear()
            self._inverter, self.plan = None, MapPlan()
        self._rest.extend(frames)
