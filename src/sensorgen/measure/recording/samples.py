"""A recording: impedance over time at several frequencies, with marks on single samples."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput

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

MOST_VALUES = 1 << 22  # readings at one frequency, of all lock-ins, with time and marks, that are worked on at once
MOST_TONES = 4096
PAUSE_S = 600.0  # a longer one ends a part of a recording: filter and drift do not reach across
_MOST_PARTS = 1000  # of a stretch
_FASTEST_HZ = 1e12  # beyond it a step is no step
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
class RecordingClock:
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
    part : int
        Number of the part of the file, from 1; 0 for all of it.
    """

    file: str
    format: str
    program: str = ""
    lockin: int = 1
    rate_hz: float = np.nan
    bandwidth_hz: float = np.nan
    notes: tuple[str, ...] = ()
    part: int = 0


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
    clock : RecordingClock
        Relation of ``time_s`` to real time.
    source : Source
        Origin.
    """

    time_s: Real
    tones_hz: Real
    impedance_ohm: Complex
    marks: Mapping[str, Bools]
    clock: RecordingClock
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

    def between(self, first: int, after: int) -> Self:
        """Samples from one up to another, which share memory with these."""
        at = slice(first, after)
        marks = {name: which[at] for name, which in self.marks.items()}
        return replace(self, time_s=self.time_s[at], impedance_ohm=self.impedance_ohm[at], marks=marks)


def stretches(count: int, tones: int) -> list[slice]:
    """Stretches of equal length, each of which can be worked on at once.

    Parameters
    ----------
    count, tones : int
        Samples, and frequencies of all lock-ins.

    Examples
    --------
    >>> stretches(1_000_000, 7)
    [slice(0, 333333, None), slice(333333, 666666, None), slice(666666, 1000000, None)]
    """
    pieces = max(1, -(-count * (tones + 2) // MOST_VALUES))
    ends = [count * k // pieces for k in range(pieces + 1)]
    return [slice(a, b) for a, b in pairwise(ends)]


def at_pauses(recordings: tuple[Recording, ...]) -> list[tuple[Recording, ...]]:
    """All lock-ins of one stretch, cut where any of them pauses for more than :data:`PAUSE_S`.

    Raises
    ------
    BadInput
        More pauses than any run has.
    """
    pauses = (time[np.flatnonzero(np.diff(time) > PAUSE_S)] for time in (one.time_s for one in recordings))
    ends = np.unique(np.concatenate([*pauses]))  # times of the last samples before
    if len(ends) >= _MOST_PARTS:
        raise BadInput(f"{len(ends)} pauses of more than {PAUSE_S:g} s; expected a recording, its time in seconds")
    parts = []
    for begin, end in pairwise([-np.inf, *ends, np.inf]):
        places = [np.searchsorted(one.time_s, (begin, end), side="right") for one in recordings]
        parts.append(tuple(one.between(a, b) for one, (a, b) in zip(recordings, places, strict=True) if b > a))
    return parts


def numbered(parts: Iterable[tuple[Recording, ...]]) -> Iterator[tuple[Recording, ...]]:
    """Parts of a file with their numbers, and with a remark where they begin; the only one has none."""
    number, ended = 0, 0.0
    following = iter(parts)
    now = next(following, None)
    while now is not None:
        then = next(following, None)
        number += 1
        of = number if then or number > 1 else 0
        yield tuple(replace(one, source=_source(one, of, ended)) for one in now)
        ended, now = float(now[0].time_s[-1]), then


def _source(one: Recording, part: int, ended_s: float) -> Source:
    source, begin = one.source, float(one.time_s[0])
    if part == 0:
        return source
    note = f"part {part}, from {begin:.6g} s to {float(one.time_s[-1]):.6g} s"
    if part > 1 and begin - ended_s > PAUSE_S:
        note += f", after a pause of {begin - ended_s:.6g} s"
    return replace(source, rate_hz=rate_hz(one.time_s), notes=(note, *source.notes), part=part)


def rate_hz(time_s: Real) -> float:
    """Sampling rate from the median step; nan where there is none [Hz]."""
    step = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    return 1 / step if step > 1 / _FASTEST_HZ else float("nan")
