"""The sum of tones that drives a specimen."""

from dataclasses import dataclass

import numpy as np

from sensorgen.core.arrays import Real

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
