"""A virtual array that is walked on, and sends its frames as lines of text.

Written from the protocol in :mod:`sensorgen.measure.lab.frame_stream`, its lines by that module, its readings by the
print's own network.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensorgen.core.arrays import Complex
from sensorgen.measure.lab.frame_stream import QUESTION, FrameForm
from sensorgen.measure.virtual.array import VirtualArray, printed, walked
from sensorgen.measure.virtual.plant import Simulator
from sensorgen.prediction.array.model import ArrayModel
from sensorgen.prediction.array.readout import ArrayReadout

REST_S = 3.0  # unloaded at the begin
_STEP_S, _PERIOD_S = 0.6, 1.0
_SETTLED = 2  # steps until play and creep repeat
_HEADER_S = 10.0
_HOUR_S = 3600.0
_DAMAGED = 7  # every so many lines


@dataclass(frozen=True, eq=False)
class WalkedArray:
    """Readings of a print under steps, one a second.

    Attributes
    ----------
    rest, step : (m, n), (k, m, n) array
        Readings at rest and through a step, without noise [S].
    readout : ArrayReadout
        Of the noise.
    drift : float
        Of all readings, in an hour [-].
    """

    rest: Complex
    step: Complex
    readout: ArrayReadout
    drift: float = 0.0

    @classmethod
    def of(cls, print_: VirtualArray, model: ArrayModel, readout: ArrayReadout, rate_hz: float,
           drift: float = 0.0) -> "WalkedArray":  # fmt: skip
        """Readings of a print at a rate."""
        maps = walked(model.layout, frames=max(2, round(_STEP_S * rate_hz))).pressure_kpa
        swing = np.zeros((max(1, round(_PERIOD_S * rate_hz)) - len(maps), *maps.shape[1:]))
        load = np.concatenate([np.zeros((1, *maps.shape[1:])), *[maps, swing] * _SETTLED])
        quiet = replace(readout, noise=1e-15, noise_s=0.0)
        found = print_.frames(load, np.arange(len(load)) / rate_hz, quiet, np.random.default_rng(0))
        return cls(found[0], found[-len(maps) - len(swing) :], readout, drift)

    def siemens(self, number: int, time_s: float, rate_hz: float, draw: np.random.Generator) -> Complex:
        """Readings of a frame by its number [S]."""
        since = number - round(REST_S * rate_hz)
        clean = self.rest if since < 0 else self.step[since % len(self.step)]
        clean = clean * (1 + self.drift * time_s / _HOUR_S)
        sigma = self.readout.sigma_s(clean)
        noise = draw.normal(size=clean.shape) + 1j * draw.normal(size=clean.shape)
        return np.asarray(clean + np.where(np.isfinite(sigma), sigma, 0.0) * noise)

    def advance(self, time_s: float) -> None:
        """Nothing: frames are by their number."""


class FrameSender(Simulator):
    """Device that sends a frame whenever one is due, from its first question or reading on.

    Attributes
    ----------
    fault : str
        Also "damaged": every seventh line loses bytes; "size": a column is left out; "saturated": the first row is.
    """

    def __init__(self, walk: WalkedArray, rate_hz: float, seed: int = 0, form: str = "capacitance") -> None:
        super().__init__(walk)  # type: ignore[arg-type]
        (m, n), self._walk, self._rate_hz = walk.rest.shape, walk, rate_hz
        self.form = FrameForm(m, n, form, "n" if form == "siemens" else "p", walk.readout.frequency_hz[0])
        self._draw, self._begun_s, self._sent, self._header_s = np.random.default_rng(seed), np.nan, 0, -np.inf

    def _take(self, line: bytes) -> None:
        if line + b"\n" == QUESTION:
            self._out += self.form.header()

    def _step(self) -> None:
        if np.isnan(self._begun_s):
            self._begun_s = self._now_s
        if self._now_s - self._header_s >= _HEADER_S:
            self._out, self._header_s = self._out + self.form.header(), self._now_s
        due = int((self._now_s - self._begun_s) * self._rate_hz + 1e-6)
        for number in range(max(self._sent, due - int(self._rate_hz)), due):  # nobody listened: frames are lost
            self._out += self._line(number)
        self._sent = max(self._sent, due)

    def _line(self, number: int) -> bytes:
        time_s = number / self._rate_hz
        siemens, form = self._walk.siemens(number, time_s, self._rate_hz, self._draw), self.form
        if self.fault == "size":
            siemens, form = siemens[:, 1:], replace(form, columns=form.columns - 1)
        if self.fault == "saturated":
            siemens[0] = complex(np.inf, np.inf)
        line = form.frame(number, time_s, siemens)
        damaged = self.fault == "damaged" and number % _DAMAGED == 0
        return line[: len(line) // 3] + line[len(line) // 2 :] if damaged else line


def sender(
    model: ArrayModel, readout: ArrayReadout, rate_hz: float, *, seed: int = 0, faults: Sequence[str] = (),
    form: str = "capacitance",
) -> FrameSender:  # fmt: skip
    """Device on a print with scatter, hysteresis, creep, drift, noise and faults, of a law of its own."""
    print_ = printed(model, seed, faults=faults, own_law=True, play=0.02, creep=0.02)
    return FrameSender(WalkedArray.of(print_, model, readout, rate_hz, drift=1e-3), rate_hz, seed, form)
