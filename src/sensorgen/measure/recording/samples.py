"""A recording: impedance over time at several frequencies, with marks on single samples."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Bools = NDArray[np.bool_]

MARKS = {
    "zero": "a tone is exactly 0 + 0j: the instrument skipped a block",
    "missing": "a tone is no finite number, or beyond any impedance (1e30 ohm)",
    "transient": "the demodulator was still starting up",
    "clipped": "the instrument's input was beyond its range",
    "invalid": "the file marks the sample as invalid",
    "gap": "first sample after samples that were lost",
    "reversed stamp": "the time stamp is earlier than the one before",
    "repeated stamp": "the time stamp is the same as the one before",
    "no stamp": "the time stamp is not a finite number",
    "rig error": "the rig reported an error, or nothing",
}
"""Marks of samples, and their meanings."""

HARMLESS = frozenset({"gap", "reversed stamp", "repeated stamp", "no stamp"})
"""Marks that leave a sample valid: the rebuilt clock corrects them."""

_LARGEST_OHM = 1e30  # beyond it arithmetic fails before physics does


def blank(count: int) -> dict[str, Bools]:
    """Marks without any sample marked."""
    return {name: np.zeros(count, bool) for name in MARKS}


def sifted(impedance_ohm: Complex) -> dict[str, Bools]:
    """Marks of exact zeros and of numbers that are not finite; both are replaced by nan in place [ohm]."""
    zero = impedance_ohm == 0
    with np.errstate(over="ignore"):
        missing = ~(np.abs(impedance_ohm) < _LARGEST_OHM)
    impedance_ohm[zero | missing] = complex("nan+nanj")
    return {"zero": zero.any(axis=1), "missing": missing.any(axis=1)}


@dataclass(frozen=True)
class Clock:
    """Relation of a recording's time to real time: ``epoch_s + (1 + skew) time_s``.

    Attributes
    ----------
    epoch_s : float
        Real time at ``time_s`` = 0, in seconds since 1970; nan without stamps.
    skew : float
        Rate of the stamps' clock over the instrument's, less 1; 0 unless significant [-].
    epoch_error_s, skew_error : float
        Standard errors [s], [-].
    jitter_s : float
        Standard deviation of a stamp about the rebuilt clock [s].
    blocks : int
        Number of stamps in the fit, one for each block.
    """

    epoch_s: float = np.nan
    skew: float = 0.0
    epoch_error_s: float = np.nan
    skew_error: float = np.nan
    jitter_s: float = np.nan
    blocks: int = 0

    def real_s(self, time_s: Real) -> Real:
        """Seconds since 1970 at times of the recording [s]."""
        return np.asarray(self.epoch_s + (1 + self.skew) * time_s)


@dataclass(frozen=True)
class Source:
    """Origin of a recording.

    Attributes
    ----------
    file : str
        Name of the file, without its folder.
    format : str
        As in "MATLAB 5".
    program : str
        Program that wrote the file, with its version; "" if unknown.
    lockin : int
        Number of the lock-in in the file, from 1.
    rate_hz : float
        Sampling rate, from the file's own clock [Hz].
    bandwidth_hz : float
        Bandwidth of the demodulator; nan if unknown [Hz].
    notes : tuple of str
        Corrections that were made.
    """

    file: str
    format: str
    program: str = ""
    lockin: int = 1
    rate_hz: float = np.nan
    bandwidth_hz: float = np.nan
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Recording:
    """Recording of one lock-in.

    Attributes
    ----------
    time_s : (n,) array
        Time by the rebuilt clock, rising [s].
    tones_hz : (m,) array
        Frequencies of the excitation, in the order of the columns [Hz].
    impedance_ohm : (n, m) array
        Complex impedance [ohm]; nan where none was measured.
    marks : mapping of str to (n,) array
        Marked samples, for every name of ``MARKS``.
    clock : Clock
        Relation of ``time_s`` to real time.
    source : Source
        Origin.
    """

    time_s: Real
    tones_hz: Real
    impedance_ohm: Complex
    marks: Mapping[str, Bools]
    clock: Clock
    source: Source = field(default=Source("", ""))

    @property
    def epoch_s(self) -> float:
        """Real time at ``time_s`` = 0, in seconds since 1970; nan if unknown [s]."""
        return self.clock.epoch_s

    def real_s(self) -> Real:
        """Seconds since 1970 of every sample; nan if unknown [s]."""
        return self.clock.real_s(self.time_s)

    def counts(self) -> dict[str, int]:
        """Number of samples, of valid samples, and of samples with each mark."""
        marked = {name: int(np.count_nonzero(which)) for name, which in self.marks.items()}
        return {"samples": len(self.time_s), "valid": int(np.count_nonzero(self.valid()))} | marked

    def valid(self) -> Bools:
        """Samples without any mark but the harmless ones."""
        valid = np.ones(len(self.time_s), bool)
        for name, which in self.marks.items():
            if name not in HARMLESS:
                valid &= ~which
        return valid
