r"""Sum of tones that drives a specimen, and its demodulation: discrete Fourier transform over whole periods.

In a window of whole periods of every tone the tones are orthogonal, so that no window function, filter or reference is
needed. Only a few coefficients are needed, so the transform has two steps: segments of B samples are multiplied by one
matrix for all tones, then shifted in phase and summed:

.. math:: U_k = \frac{2}{N} \sum_{a=0}^{N/B-1} e^{-2 \pi i k a B / N}
          \sum_{b=0}^{B-1} u_{aB + b} \, e^{-2 \pi i k b / N}

Tones that are all multiples of 100 Hz have whole periods in 10 ms.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import gcd
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import OutOfRange

TONES_HZ = (1100.0, 2300.0, 5300.0, 10100.0, 19900.0, 49900.0, 99700.0)  # thesis, Table 5.1; it prints 4990 for 49900
WEIGHTS = (10.0, 7.0, 4.5, 3.0, 2.0, 1.5, 1.0)
_CANDIDATES = 64  # sets of phases
_POINTS = 10_000  # at which they are compared


@dataclass(frozen=True, eq=False)
class Multisine:
    """One period of a sum of tones.

    Attributes
    ----------
    samples : (n,) array
        Waveform with a peak of 1.
    amplitude : (m,) array
        Of each tone.
    """

    samples: Real
    amplitude: Real


def multisine(tones_hz: Real, rate_hz: float, count: int) -> Multisine:
    """Cosines with the thesis's weights and a low peak.

    Parameters
    ----------
    tones_hz : (m,) array
        Tones [Hz]; one that Table 5.1 does not name has the weight 1.
    rate_hz : float
        Rate of the generator [Hz].
    count : int
        Samples of a period, whole periods of every tone.

    Notes
    -----
    Phases of Schroeder or Newman need tones in a row and gain less than a tenth here. Of 64 sets of phases, always the
    same, the one with the lowest peak is used: 0.8 of the sum of the amplitudes for the thesis's tones.

    Examples
    --------
    >>> wave = multisine(np.array(TONES_HZ), 1e6, 10_000)
    >>> bool(abs(wave.samples).max() == 1), bool(wave.amplitude.sum() > 1.2)
    (True, True)
    """
    weights = np.array([dict(zip(TONES_HZ, WEIGHTS, strict=True)).get(float(f), 1.0) for f in tones_hz])
    phases = np.exp(2j * np.pi * np.random.default_rng(51).uniform(size=(_CANDIDATES, len(weights))))
    turns = np.exp(2j * np.pi * np.outer(tones_hz / rate_hz, np.arange(0, count, -(-count // _POINTS))))
    peaks = np.abs(((weights * phases) @ turns).real).max(axis=1)
    spectrum = np.zeros(count // 2 + 1, complex)
    spectrum[np.round(tones_hz * count / rate_hz).astype(int)] = weights * phases[np.argmin(peaks)] * count / 2
    samples = np.fft.irfft(spectrum, count)
    peak = np.abs(samples).max()
    return Multisine(samples / peak, weights / peak)


_BATCH = 1 << 16  # samples that fit into the cache
_SEGMENT = 256  # least samples of a segment: large enough for the matrix product, small enough for the sum


def window_samples(rate_hz: float, tones_hz: ArrayLike) -> int:
    """Length of the shortest window with whole periods of every tone, in samples.

    Parameters
    ----------
    rate_hz : float
        Sampling rate [Hz].
    tones_hz : (m,) array
        Tones, whole numbers of hertz [Hz].

    Raises
    ------
    OutOfRange
        Tones that are not whole numbers of hertz between 0 and half the rate; a rate without a whole number of samples
        in any window up to a second.

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
    """Amplitude and phase of every tone in consecutive windows.

    Parameters
    ----------
    signal : (n,) array
        Waveform; an incomplete window at the end is ignored.
    rate_hz : float
        Sampling rate [Hz].
    tones_hz : (m,) array
        Tones [Hz].
    window : int
        Length of a window, whole periods of every tone; the shortest if not given [samples].

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
    """Coefficients of each window (n, m), normalised to amplitudes."""
    (count, size), tones = windows.shape, len(bins)
    mixer, between = _factors(size, tuple(bins.tolist()))
    sums, step = np.empty((count, tones), np.complex128), _BATCH // size or 1
    for i in range(0, count, step):
        mixed = np.asarray(windows[i : i + step], float).reshape(-1, len(mixer)) @ mixer
        segments = (mixed[:, :tones] + 1j * mixed[:, tones:]).reshape(-1, len(between), tones)
        sums[i : i + step] = (segments * between).sum(axis=1)
    return np.asarray(sums * (2 / size))


@lru_cache(maxsize=8)
def _factors(size: int, bins: tuple[int, ...]) -> tuple[NDArray[np.float64], Complex]:
    """Matrix of a segment: real parts, imaginary parts; phase factors of the segments."""
    segment = next(n for n in range(min(_SEGMENT, size), size + 1) if size % n == 0)
    within, between = (  # whole turns are removed first, to keep the digits
        np.exp(-2j * np.pi * (np.outer(at, bins) % size) / size)
        for at in (np.arange(segment), np.arange(0, size, segment))
    )
    return np.hstack([within.real, within.imag]), between


def clipped(signal: NDArray[Any], limit: float, size: int, count: int) -> NDArray[np.bool_]:
    """Windows with consecutive samples at the end of the range; a single sample may be a crest.

    Parameters
    ----------
    signal : (n,) array
        Waveform.
    limit : float
        End of the range, either way, in the unit of the signal.
    size, count : int
        Length of a window [samples], and number of windows.
    """
    beyond, step = np.zeros(count, bool), _BATCH // size or 1
    for i in range(0, count if np.isfinite(limit) else 0, step):
        some = signal[i * size : (i + step) * size]
        if some.max() >= limit or some.min() <= -limit:
            at = (np.abs(some[: (count - i) * size]) >= limit).reshape(-1, size)
            beyond[i : i + step] = (at[:, 1:] & at[:, :-1]).any(axis=1)
    return beyond
