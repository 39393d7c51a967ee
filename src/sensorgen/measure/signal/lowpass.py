"""Butterworth low-pass of order 4, as in the thesis: causal for a stream, zero-phase for a recording.

Second-order sections and not polynomials: with a cut-off far below the sampling rate the poles lie close to 1, where
polynomial coefficients lose so many digits that the filter becomes unstable. The sampling rate is that of the
recording: the thesis's 66.6666 Hz belongs to another version of the instrument's program.
"""

from dataclasses import dataclass, field
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import OutOfRange
from sensorgen.measure.recording.samples import Recording

CUTOFF_HZ = 0.2727
ORDER = 4
_SETTLED = 3.0  # over the cut-off: settling time of the filter
_END = 0.5  # over the cut-off: length of the ends that are extrapolated
_LONGEST_GAP = 0.5  # over the cut-off: longer gaps are not interpolated
_EVEN = 1e-3  # of a step: deviation of even samples
_MOST_STEPS = 1 << 22  # even steps of a recording


def sections(rate_hz: float, cutoff_hz: float = CUTOFF_HZ) -> Real:
    """Second-order sections of the low-pass.

    Parameters
    ----------
    rate_hz : float
        Sampling rate [Hz].
    cutoff_hz : float
        Cut-off frequency: -3 dB in one pass, -6 dB forward and backward [Hz].

    Raises
    ------
    OutOfRange
        A cut-off frequency that is not between 0 and half the rate.
    """
    from scipy.signal import butter

    if not 0 < cutoff_hz < rate_hz / 2:
        raise OutOfRange(
            f"a cut-off of {cutoff_hz:g} Hz at {rate_hz:g} samples/s; expected one between 0 and half of it"
        )
    return np.asarray(butter(ORDER, cutoff_hz, fs=rate_hz, output="sos"))


@dataclass
class Live:
    """Causal filter for a stream, started in the steady state of the first reading.

    Parameters
    ----------
    rate_hz, cutoff_hz : float
        Sampling rate and cut-off frequency [Hz].

    Examples
    --------
    >>> live = Live(140.0)
    >>> live(np.full((3, 1), 41 + 2j)).round(6).ravel().tolist()
    [(41+2j), (41+2j), (41+2j)]
    """

    rate_hz: float
    cutoff_hz: float = CUTOFF_HZ
    _sections: Real = field(init=False, repr=False)
    _state: NDArray[Any] | None = field(init=False, default=None, repr=False)
    _last: NDArray[Any] | None = field(init=False, default=None, repr=False)

    def __post_init__(self) -> None:
        """Compute the sections."""
        self._sections = sections(self.rate_hz, self.cutoff_hz)

    def __call__(self, block: NDArray[Any]) -> NDArray[Any]:
        """Filter the next samples (n, m); where a sample is nan, the last reading is held and the result is nan."""
        from scipy.signal import sosfilt, sosfilt_zi

        missing, filled = np.isnan(block), np.array(block)
        last = np.full(block.shape[1], np.nan, block.dtype) if self._last is None else self._last
        for j in np.flatnonzero(missing.any(axis=0)):  # gaps get the reading before, at the begin the first one
            gap, before = missing[:, j], np.maximum.accumulate(np.where(missing[:, j], -1, np.arange(len(block))))
            first = filled[np.argmin(gap), j] if np.isnan(last[j]) and not gap.all() else last[j]
            filled[:, j] = np.where(before >= 0, filled[before, j], first)
        if len(filled):
            self._last = filled[-1].copy()
        if self._state is None:
            self._state = np.full((len(self._sections), 2, block.shape[1]), np.nan, block.dtype)
        fresh = np.isnan(self._state[0, 0]) & bool(len(block))  # a column begins with its own first reading
        self._state[:, :, fresh] = sosfilt_zi(self._sections)[:, :, None] * filled[:1, fresh]
        filtered, self._state = sosfilt(self._sections, filled, axis=0, zi=self._state)
        return np.where(missing, np.nan, filtered)


def offline(values: NDArray[Any], rate_hz: float, cutoff_hz: float = CUTOFF_HZ) -> NDArray[Any]:
    """Filter evenly sampled values forward and backward: no delay, -6 dB at the cut-off.

    Parameters
    ----------
    values : (n, m) array
        Real or complex, without gaps.
    rate_hz, cutoff_hz : float
        Sampling rate and cut-off [Hz].

    Notes
    -----
    Both ends are extended for the settling time of the filter: reflected at the end of a straight line through the last
    half period of the cut-off, so that a drift continues and the noise of the last reading does not become a step.

    Raises
    ------
    OutOfRange
        As :func:`sections`.
    """
    from scipy.signal import sosfiltfilt

    sos = sections(rate_hz, cutoff_hz)
    if len(values) < 2:
        return np.array(values)
    pad = min(len(values) - 1, ceil(_SETTLED * rate_hz / cutoff_hz))
    fit = min(len(values), ceil(_END * rate_hz / cutoff_hz))
    begin = 2 * _first(values[:fit]) - values[pad:0:-1]
    end = 2 * _first(values[: -fit - 1 : -1]) - values[-2 : -pad - 2 : -1]
    longer = np.concatenate([begin, values, end])
    smooth = np.empty_like(values, dtype=longer.dtype)
    parts = ((longer.real, smooth.real), (longer.imag, smooth.imag)) if np.iscomplexobj(values) else ((longer, smooth),)
    for part, into in parts:
        into[:] = np.asarray(sosfiltfilt(sos, part, axis=0, padlen=0))[pad : pad + len(values)]
    return smooth


def _first(values: NDArray[Any]) -> NDArray[Any]:
    """First value of a straight line through values."""
    t = np.arange(len(values)) - (len(values) - 1) / 2
    spread = float(t @ t)
    slope = t @ values / spread if spread else np.zeros(values.shape[1])
    return np.asarray(values.mean(axis=0) + slope * t[0])


def filtered(recording: Recording, cutoff_hz: float = CUTOFF_HZ) -> tuple[Real, Complex]:
    """Filter a recording's valid samples forward and backward, on even steps.

    Parameters
    ----------
    recording : Recording
        Invalid samples are interpolated linearly.
    cutoff_hz : float
        Cut-off frequency [Hz].

    Returns
    -------
    (n,) array, (n, m) array
        Times [s] and impedances [ohm]; nan within gaps that last longer than half a period of the cut-off.

    Raises
    ------
    OutOfRange
        As :func:`sections`; fewer than two valid samples.
    """
    valid = recording.valid()
    time = recording.time_s[valid]
    if len(time) < 2:
        raise OutOfRange(f"{len(time)} valid samples; expected two or more to filter")
    rate = recording.source.rate_hz
    sections(rate, cutoff_hz)
    even = np.abs(np.diff(time) * rate - 1).max() < _EVEN
    steps = (time[-1] - time[0]) * rate
    if steps * len(recording.tones_hz) > _MOST_STEPS:
        raise OutOfRange(f"{steps:.3g} even steps of {1 / rate:.3g} s for {len(time)} samples; expected fewer gaps")
    grid = time if even else np.arange(time[0], time[-1] + 0.5 / rate, 1 / rate)
    smooth = np.empty((len(grid), len(recording.tones_hz)), np.complex128)
    for k, column in enumerate(recording.impedance_ohm.T):  # one by one, to save memory
        values = column[valid] if even else np.interp(grid, time, column[valid])
        smooth[:, k] = offline(values[:, None], rate, cutoff_hz)[:, 0]
    before = np.clip(np.searchsorted(time, grid, side="right") - 1, 0, len(time) - 2)
    smooth[(time[before + 1] - time[before]) * cutoff_hz > _LONGEST_GAP] = complex("nan+nanj")
    return grid, smooth
