"""A virtual array that is walked on, and sends its frames as lines of text by its print's own network and law."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sensorgen.core.arrays import Complex
from sensorgen.measure.lab.frame_stream import QUESTION, FrameForm
from sensorgen.measure.virtual.array import printed, walked
from sensorgen.measure.virtual.plant import Simulator
from sensorgen.prediction.array.model import ArrayModel
from sensorgen.prediction.array.readout import ArrayReadout

REST_S = 3.0  # unloaded at the begin
_STEP_S, _SWING_S = 0.6, 0.4  # of each step
_SETTLED = 2  # steps until play and creep repeat
_HEADER_S, _HOUR_S = 10.0, 3600.0
_DRIFT = 1e-3  # of all readings, in an hour


class FrameSender(Simulator):
    """Device that sends a frame whenever one is due: first at rest, then a step each second.

    Parameters
    ----------
    rest, step : (m, n), (k, m, n) array
        Readings without noise [S].
    readout : ArrayReadout
        Of the noise.
    rate_hz : float
        Frames per second.
    form : str
        "capacitance" or "siemens".

    Attributes
    ----------
    fault : str
        Also "damaged": each line loses bytes.
    """

    def __init__(
        self, rest: Complex, step: Complex, readout: ArrayReadout, rate_hz: float, form: str = "capacitance"
    ) -> None:
        super().__init__(self)  # type: ignore[arg-type]  # no other mechanism
        m, n = rest.shape
        self.form = FrameForm(m, n, form, "n" if form == "siemens" else "p", readout.frequency_hz[0])
        self._rest, self._walk, self._readout, self._rate_hz = rest, step, readout, rate_hz
        self._draw, self._begun_s, self._sent, self._header_s = np.random.default_rng(0), np.nan, 0, -np.inf

    def advance(self, time_s: float) -> None:
        """Begin with the first message."""
        self._begun_s = time_s if np.isnan(self._begun_s) else self._begun_s

    def _take(self, line: bytes) -> None:
        if line + b"\n" == QUESTION:
            self._out += self.form.header()

    def _step(self) -> None:
        if self._now_s - self._header_s >= _HEADER_S:
            self._out, self._header_s = self._out + self.form.header(), self._now_s
        due = int((self._now_s - self._begun_s) * self._rate_hz + 1e-6)
        for number in range(max(self._sent, due - int(self._rate_hz)), due):  # nobody listened: frames are lost
            line = self.form.frame(number, number / self._rate_hz, self._siemens(number))
            self._out += line[: len(line) // 3] + line[len(line) // 2 :] if self.fault == "damaged" else line
        self._sent = max(self._sent, due)

    def _siemens(self, number: int) -> Complex:
        since = number - round(REST_S * self._rate_hz)
        clean = self._rest if since < 0 else self._walk[since % len(self._walk)]
        clean = clean * (1 + _DRIFT * number / self._rate_hz / _HOUR_S)
        noise = self._draw.normal(size=clean.shape) + 1j * self._draw.normal(size=clean.shape)
        return np.asarray(clean + np.where(clean == 0, 0.0, self._readout.sigma_s(clean)) * noise)


def sender(
    model: ArrayModel, readout: ArrayReadout, rate_hz: float, *, seed: int = 0, faults: Sequence[str] = ()
) -> FrameSender:  # fmt: skip
    """Device on a print with scatter, hysteresis, creep, drift, noise and faults, of a law of its own."""
    print_ = printed(model, seed, faults=faults, own_law=True, play=0.02, creep=0.02)
    maps = walked(model.layout, frames=max(2, round(_STEP_S * rate_hz))).pressure_kpa
    cycle = np.concatenate([maps, np.zeros((max(1, round(_SWING_S * rate_hz)), *maps.shape[1:]))])
    load = np.concatenate([0 * cycle[:1], *[cycle] * _SETTLED])
    quiet = replace(readout, noise=1e-15, noise_s=0.0)
    found = print_.frames(load, np.arange(len(load)) / rate_hz, quiet, np.random.default_rng(0))
    return FrameSender(found[0], found[-len(cycle) :], readout, rate_hz)
