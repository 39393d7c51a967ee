r"""Phasors of several tones at once, from raw waveforms: the discrete Fourier transform over whole periods.

In a window that holds whole periods of every tone the tones are orthogonal, so that no window function, no filter and
no reference is needed. Only a few of the transform's values are wanted, so it is made in two steps: stretches of B
samples, one after the other, are mixed down to every tone by one matrix product, and then turned and put together:

.. math:: U_k = \frac{2}{N} \sum_{a=0}^{N/B-1} e^{-2 \pi i k a B / N}
          \sum_{b=0}^{B-1} u_{aB + b} \, e^{-2 \pi i k b / N}

Tones that are all multiples of 100 Hz have whole periods in 10 ms.
"""

from math import gcd
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.errors import BadInput, OutOfRange

Complex = NDArray[np.complex128]
_HARMONICS = range(2, 12)
_BATCH = 1 << 16  # samples at a time: they stay in the cache
_STRETCH = 256  # samples, at least: so many are mixed at the speed of a matrix product, and few are left to turn


class Demodulated(NamedTuple):
    """Impedances of windows one after the other."""

    time_s: NDArray[np.float64]
    """Middles of the windows [s]."""
    impedance_ohm: Complex
    """(windows, tones) [ohm]."""
    clipped: NDArray[np.bool_]
    """Windows in which a waveform stays at the end of its range."""


def window_samples(rate_hz: float, tones_hz: ArrayLike) -> int:
    """Samples of the shortest window that holds whole periods of every tone.

    Parameters
    ----------
    rate_hz : float
        Samples per second [Hz].
    tones_hz : (m,) array
        Tones, whole numbers of hertz [Hz].

    Raises
    ------
    OutOfRange
        Tones that are no whole numbers of hertz, from 0 to half the rate; a rate with no whole number of samples in any
        window up to a second.

    Examples
    --------
    >>> window_samples(1e6, [1100, 2300, 99700])
    10000
    """
    tones = np.atleast_1d(np.asarray(tones_hz, float))
    if not ((tones > 0) & (tones < rate_hz / 2) & (tones == np.round(tones))).all():
        raise OutOfRange(
            f"tones {tones.tolist()} Hz at {rate_hz:g} samples/s; expected whole hertz below half the rate"
        )
    common = gcd(*(int(f) for f in tones))
    for periods in range(1, common + 1):
        samples = periods * rate_hz / common
        if samples == round(samples):
            return round(samples)
    raise OutOfRange(f"{rate_hz:g} samples/s are no whole number in any window of whole periods; resample")


def phasors(signal: ArrayLike, rate_hz: float, tones_hz: ArrayLike, window: int = 0) -> Complex:
    """Amplitude and phase of every tone in windows one after the other.

    Parameters
    ----------
    signal : (n,) array
        Waveform; what is left over at the end counts for nothing.
    rate_hz : float
        Samples per second [Hz].
    tones_hz : (m,) array
        Tones [Hz].
    window : int
        Samples of a window, whole periods of every tone; the shortest if not given.

    Returns
    -------
    (windows, m) array
        In the unit of the signal; a cosine has phase 0 at the window's begin.

    Raises
    ------
    OutOfRange
        As :func:`window_samples`; a window without whole periods, or longer than the signal.
    """
    tones, size = np.atleast_1d(np.asarray(tones_hz, float)), window or window_samples(rate_hz, tones_hz)
    bins = tones * size / rate_hz
    if (np.abs(bins - np.round(bins)) > 1e-9).any():
        raise OutOfRange(f"a window of {size} samples at {rate_hz:g} samples/s holds no whole periods of every tone")
    values = np.asarray(signal)
    count = len(values) // size
    if count == 0:
        raise OutOfRange(f"a waveform of {len(values)} samples; expected at least a window, {size}")
    return _transformed(values[: count * size].reshape(count, size), np.round(bins).astype(np.int64))


def _transformed(windows: NDArray[Any], bins: NDArray[np.int64]) -> Complex:
    """Twice the mean of each window, turned back by so many turns (windows, m)."""
    (count, size), tones = windows.shape, len(bins)
    stretch = next(n for n in range(min(_STRETCH, size), size + 1) if size % n == 0)
    within, between = (_turns(at, bins, size) for at in (np.arange(stretch), np.arange(0, size, stretch)))
    mixer, step = np.hstack([within.real, within.imag]), _BATCH // size or 1
    found = np.empty((count, tones), np.complex128)
    for i in range(0, count, step):
        mixed = np.asarray(windows[i : i + step], float).reshape(-1, stretch) @ mixer
        sums = (mixed[:, :tones] + 1j * mixed[:, tones:]).reshape(-1, len(between), tones)
        found[i : i + step] = (sums * between).sum(axis=1)
    return np.asarray(found * (2 / size))


def _turns(at: NDArray[np.int64], bins: NDArray[np.int64], size: int) -> Complex:
    """Back by so many turns in a window, at some of its samples; whole turns are left out before they cost digits."""
    return np.asarray(np.exp(-2j * np.pi * (np.outer(at, bins) % size) / size))


def impedance(
    voltage_v: ArrayLike, current_a: ArrayLike, rate_hz: float, tones_hz: ArrayLike, range_v: float = np.inf,
    range_a: float = np.inf,
) -> Demodulated:  # fmt: skip
    """Impedance at every tone from two waveforms that were sampled together.

    Parameters
    ----------
    voltage_v, current_a : (n,) array
        Waveforms [V], [A].
    rate_hz : float
        Samples per second [Hz].
    tones_hz : (m,) array
        Tones [Hz].
    range_v, range_a : float
        Largest values that the instrument can show [V], [A].

    Raises
    ------
    BadInput
        Waveforms of unequal length; a tone without current.
    OutOfRange
        As :func:`window_samples`.
    """
    voltage, current = np.asarray(voltage_v), np.asarray(current_a)
    if voltage.shape != current.shape or voltage.ndim != 1:
        raise BadInput(f"waveforms of {voltage.shape} and {current.shape} samples; expected two of one length")
    size = window_samples(rate_hz, tones_hz)
    u, i = (phasors(signal, rate_hz, tones_hz, size) for signal in (voltage, current))
    if not i.all():
        raise BadInput("a tone carries no current at all; expected the waveform of the current")
    clipped = _clipped(voltage, range_v, size, len(u)) | _clipped(current, range_a, size, len(u))
    return Demodulated(np.asarray((np.arange(len(u)) + 0.5) * size / rate_hz, float), u / i, clipped)


def _clipped(signal: NDArray[Any], limit: float, size: int, count: int) -> NDArray[np.bool_]:
    """Windows with several samples in a row at the rail; a single one may be the crest of a whole wave."""
    found, step = np.zeros(count, bool), _BATCH // size or 1
    for i in range(0, count if np.isfinite(limit) else 0, step):
        some = signal[i * size : (i + step) * size]
        if some.max() >= limit or some.min() <= -limit:
            at = (np.abs(some[: (count - i) * size]) >= limit).reshape(-1, size)
            found[i : i + step] = (at[:, 1:] & at[:, :-1]).any(axis=1)
    return found


def coincidences(tones_hz: ArrayLike) -> list[tuple[float, str]]:
    """Tones that another one's distortion falls on.

    Parameters
    ----------
    tones_hz : (m,) array
        Tones [Hz].

    Returns
    -------
    list of (float, str)
        The tone that is hit [Hz], and by what: a harmonic up to the 11th, or 2a + b or 2a - b of two others.

    Examples
    --------
    >>> coincidences([1000, 2000])
    [(2000.0, '2 x 1000 Hz')]

    Of the thesis's tones two are hit, by one relation:

    >>> coincidences([1100, 2300, 5300, 10100, 19900, 49900, 99700])
    [(49900.0, '2 x 19900 + 10100 Hz'), (10100.0, '49900 - 2 x 19900 Hz')]
    """
    tones = [float(f) for f in np.atleast_1d(np.asarray(tones_hz, float))]
    found = [(hit, f"{n} x {f:g} Hz") for f in tones for n in _HARMONICS for hit in tones if hit == n * f]
    pairs = [(a, b) for a in tones for b in tones if a != b]
    found += [(hit, f"2 x {a:g} + {b:g} Hz") for a, b in pairs for hit in tones if hit == 2 * a + b]
    found += [(hit, _difference(a, b)) for a, b in pairs for hit in tones if hit == abs(2 * a - b) != b]
    return found


def _difference(a: float, b: float) -> str:
    return f"2 x {a:g} - {b:g} Hz" if 2 * a > b else f"{b:g} - 2 x {a:g} Hz"
