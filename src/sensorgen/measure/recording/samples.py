"""A recording: impedances over time, with everything that speaks against single samples beside them."""

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
    "invalid": "the file itself says that the sample does not count",
    "gap": "first sample after samples that were lost",
    "reversed stamp": "the time stamp is earlier than the one before",
    "repeated stamp": "the time stamp is the same as the one before",
    "no stamp": "the time stamp is not a finite number",
    "rig error": "the rig reported an error, or nothing",
}
"""What may be said of a sample, and what it means."""

_LARGEST_OHM = 1e30  # beyond it arithmetic fails before physics does

HARMLESS = frozenset({"gap", "reversed stamp", "repeated stamp", "no stamp"})
"""Marks that do not take a sample out: the rebuilt clock has put them right."""


def blank(count: int) -> dict[str, Bools]:
    """No mark at any of ``count`` samples."""
    return {name: np.zeros(count, bool) for name in MARKS}


def sifted(impedance_ohm: Complex) -> dict[str, Bools]:
    """Marks of what is no reading: exact zeros and what is not finite; both become nan in place [ohm]."""
    zero = impedance_ohm == 0
    with np.errstate(over="ignore"):
        missing = ~(np.abs(impedance_ohm) < _LARGEST_OHM)
    impedance_ohm[zero | missing] = complex("nan+nanj")
    return {"zero": zero.any(axis=1), "missing": missing.any(axis=1)}


@dataclass(frozen=True)
class Clock:
    """How a recording's time stands to real time: ``epoch_s + (1 + skew) time_s``.

    Attributes
    ----------
    epoch_s : float
        Real time at ``time_s`` = 0, in seconds since 1970; nan where the file has no stamps.
    skew : float
        Rate of the stamps' clock over the instrument's, less 1; 0 unless it stands out of its error [-].
    epoch_error_s, skew_error : float
        Standard errors [s], [-].
    jitter_s : float
        Standard deviation of a stamp about the rebuilt clock [s].
    blocks : int
        Blocks of stamps that the clock was fitted to.
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
    """Where a recording comes from.

    Attributes
    ----------
    file : str
        Name of the file, without its folder.
    format : str
        As in "MATLAB 5".
    program : str
        That wrote it, with its version; "" where the file does not say.
    lockin : int
        Which of the file's lock-ins, counted from 1.
    rate_hz : float
        Samples per second, from the file's own clock.
    bandwidth_hz : float
        Of the demodulator; nan where the file does not say.
    notes : tuple of str
        What was put right on the way, in words.
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
    """What one lock-in measured.

    Attributes
    ----------
    time_s : (n,) array
        Rebuilt clock, rising from sample to sample [s].
    tones_hz : (m,) array
        Tones, in the order of the columns [Hz].
    impedance_ohm : (n, m) array
        Complex impedance [ohm]; nan where nothing was measured.
    marks : mapping of str to (n,) array
        Which samples each of ``MARKS`` is true of; all of them, also those that are true of none.
    clock : Clock
        How ``time_s`` stands to real time.
    source : Source
        Where it comes from.
    """

    time_s: Real
    tones_hz: Real
    impedance_ohm: Complex
    marks: Mapping[str, Bools]
    clock: Clock
    source: Source = field(default=Source("", ""))

    @property
    def epoch_s(self) -> float:
        """Real time at ``time_s`` = 0, in seconds since 1970; nan where the file does not say."""
        return self.clock.epoch_s

    def real_s(self) -> Real:
        """Seconds since 1970 of every sample; nan where the file does not say."""
        return self.clock.real_s(self.time_s)

    def counts(self) -> dict[str, int]:
        """How many samples have each mark, and how many there are and count."""
        found = {name: int(np.count_nonzero(which)) for name, which in self.marks.items()}
        return {"samples": len(self.time_s), "valid": int(np.count_nonzero(self.valid()))} | found

    def valid(self) -> Bools:
        """Samples that nothing speaks against."""
        found = np.ones(len(self.time_s), bool)
        for name, which in self.marks.items():
            if name not in HARMLESS:
                found &= ~which
        return found
