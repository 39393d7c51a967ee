"""A recording: impedance over time at several frequencies, with marks on single samples; and its rebuilt clock.

The instrument samples at even steps. The computer stamps whole blocks as they arrive, delayed by its other work, so
that stamps step backwards between blocks. The sample index over the sampling rate gives a time that rises; a straight
line through the first stamps of all blocks gives its real time, with the error of one stamp over the square root of
their number. Where the stamps leave that line for good by more than two blocks, samples were lost and the time jumps
with them; where they go back for good, the computer's clock was set, and the time does not jump. A time of the
instrument itself is followed likewise, sample by sample; if it rises everywhere it stays, its long steps marked.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import chain, pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import BadInput

MARKS = (
    "zero", "missing", "transient", "clipped", "invalid", "gap", "reversed stamp", "repeated stamp", "no stamp",
    "rig error",
)  # fmt: skip
"""Marks of samples."""
# zero: a tone is exactly 0 + 0j, as where the instrument skipped a block; missing: a tone is no finite number, or
# beyond any impedance (1e30 ohm); transient: the demodulator was still starting up; clipped: the input was beyond its
# range; invalid: the file says so; gap: the first after samples that were lost; stamps: earlier than the one before,
# the same, no finite number; rig error: the rig reported an error, or nothing.

HARMLESS = frozenset({"gap", "reversed stamp", "repeated stamp", "no stamp"})
"""Marks that leave a sample valid: the rebuilt clock corrects them."""

MOST_VALUES = 1 << 22  # readings at one frequency, of all lock-ins, with time and marks, that are worked on at once
MOST_TONES = 4096
PAUSE_S = 600.0  # a longer one ends a part of a recording: filter and drift do not reach across
_MOST_PARTS = 1000  # of a stretch
_FASTEST_HZ = 1e12  # beyond it a step is no step
_LARGEST_OHM = 1e30  # beyond it arithmetic fails before physics does


def blank(count: int) -> dict[str, Mask]:
    """Marks without any sample marked."""
    return {name: np.zeros(count, bool) for name in MARKS}


def sifted(impedance_ohm: Complex) -> dict[str, Mask]:
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
    marks: Mapping[str, Mask]
    clock: RecordingClock
    source: Source = field(default=Source("", ""))

    @classmethod
    def rebuilt(
        cls, impedance_ohm: Complex, tones_hz: Real, time_s: Real | None, stamp_s: Real | None, source: Source,
        **marks: Mask,
    ) -> Self:  # fmt: skip
        """Recording with a rising time of every sample; impedances of 0 and those that are no numbers become nan.

        Parameters
        ----------
        impedance_ohm : (n, m) array
            Readings [ohm].
        tones_hz : (m,) array
            Frequencies [Hz].
        time_s : (n,) array, optional
            Time by the instrument [s]; replaced by even steps, with its gaps, unless it rises everywhere.
        stamp_s : (n,) array, optional
            Stamps by the computer's clock, in seconds since 1970 [s].
        source : Source
            Origin, without rate and notes of the clock.
        **marks
            Marked samples, by the names of ``MARKS``.

        Raises
        ------
        BadInput
            Neither gives a sampling rate.
        """
        time_s, stamp_s = (None if t is None else np.where(np.abs(t) < _LATEST_S, t, np.nan) for t in (time_s, stamp_s))
        every, clock = blank(len(impedance_ohm)) | sifted(impedance_ohm) | marks, RecordingClock()
        time, notes = _instrument_time(len(impedance_ohm), time_s, stamp_s, every["gap"])
        if stamp_s is not None:
            steps = np.diff(stamp_s)
            every["reversed stamp"][1:], every["repeated stamp"][1:] = steps < 0, steps == 0
            every["no stamp"][:] = ~np.isfinite(stamp_s)
        if stamp_s is not None and not every["no stamp"].all():
            first = _block_starts(stamp_s)
            lost, set_back, more = _followed(time, first, stamp_s)
            every["gap"] |= lost > 0
            time += np.cumsum(lost)
            clock, notes = _fitted(time[first], (stamp_s - set_back)[first]), notes + more
        source = replace(source, rate_hz=rate_hz(time), notes=source.notes + notes)
        return cls(time, tones_hz, impedance_ohm, every, clock, source)

    def counts(self) -> dict[str, int]:
        """Number of samples, of valid samples, and of samples with each mark."""
        marked = {name: int(np.count_nonzero(which)) for name, which in self.marks.items()}
        return {"samples": len(self.time_s), "valid": int(np.count_nonzero(self.valid()))} | marked

    def valid(self) -> Mask:
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
    ended = 0.0
    for number, (now, then) in enumerate(pairwise(chain(parts, [()])), 1):
        of = number if then or number > 1 else 0
        yield tuple(replace(one, source=_source(one, of, ended)) for one in now)
        ended = float(now[0].time_s[-1])


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


_OUTLIER = 6.0  # standard deviations from which on a stamp is an outlier, or a step a gap
_SIGNIFICANT = 3.0  # standard errors from which on a skew is one
MAX_SKEW = 1e-3  # of two quartz clocks, with room to spare: more is a wrong rate
_NEIGHBOURS = 5  # blocks at either side that must agree on a step
_LATEST_S = 1e11  # since 1970: the year 5000; a larger number is no time
_SAME_STEP = 1e-3  # relative difference of two steps that count as equal
_FEW = 0.02  # share of samples whose time does not rise that are placed between their neighbours
_LEAST_BLOCKS, _UNEQUAL = 8, 0.25  # fewer steps of another length, or less even ones, are gaps and not blocks
_LAGS = (50, 2)  # of the run over the distance of stamps whose slope is the step: jumps need it, and it needs them


def _instrument_time(count: int, time_s: Real | None, stamp_s: Real | None, gap: Mask) -> tuple[Real, tuple[str, ...]]:
    """Time of the instrument, or even steps where it does not rise or is missing, and notes; marks gaps in place."""
    if time_s is None:
        if stamp_s is None or (count > 1 and np.count_nonzero(np.isfinite(stamp_s)) < 2):
            raise BadInput("no sampling times; expected a time, stamps, or a sampling rate")
        return _even(count, _block_starts(stamp_s), stamp_s), ()
    time_s, between = _placed(time_s)
    first = _block_starts(time_s)
    even = _even(count, first, time_s)
    step, steps = even[-1] / max(count - 1, 1), np.diff(time_s)
    if len(first) and np.isfinite(time_s).all() and (steps > 0).all():
        least = max(step / 2, _OUTLIER * 1.4826 * float(np.median(np.abs(steps - step)))) if count > 1 else 0.0
        gap[1:] = (steps - step > least) & (steps <= PAUSE_S)  # a pause begins a part of the recording
        return np.array(time_s, float), between
    note = f"the time does not rise everywhere: taken as even steps of {step:.6g} s"
    lost, set_back, notes = _followed(even, first, time_s)
    gap |= lost > 0
    even += np.cumsum(lost)
    return even + (np.nanmedian(time_s - set_back - even) if len(first) else 0.0), (note, *notes)


def _placed(time_s: Real) -> tuple[Real, tuple[str, ...]]:
    """A time that rises but at a few samples, with these between their neighbours, and a note; others as they are."""
    index = np.arange(len(time_s))
    rises = np.isfinite(time_s)
    highest = np.maximum.accumulate(np.where(rises, time_s, -np.inf))
    rises[1:] &= time_s[1:] > highest[:-1]
    rises[:-1] &= ~(time_s[1:] < time_s[:-1])  # of two that were exchanged neither is known
    few = int(np.count_nonzero(~rises))
    if not 0 < few <= _FEW * len(time_s):
        return time_s, ()
    note = f"the time of {few} samples does not rise: placed between their neighbours"
    return np.interp(index, index[rises], time_s[rises]), (note,)


def _followed(even: Real, first: NDArray[np.intp], stamp_s: Real) -> tuple[Real, Real, tuple[str, ...]]:
    """Time that was lost before each sample, by how much the clock was set back until it [s]; and notes on both."""
    jumps = np.zeros(len(even))
    jumps[first] = _jumps(even[first], stamp_s[first])
    notes = tuple(
        f"{jumps[k]:.3g} s were lost before sample {k + 1}" if jumps[k] > 0 else
        f"the clock was set back by {-jumps[k]:.3g} s at sample {k + 1}"
        for k in np.flatnonzero(jumps)
    )  # fmt: skip
    return np.maximum(jumps, 0), np.cumsum(np.minimum(jumps, 0)), notes


def _even(count: int, first: NDArray[np.intp], stamp_s: Real) -> Real:
    """Even steps, by median slopes: between near blocks, then over half of the run without the time of lost samples."""
    if count == 1:
        return np.zeros(1)
    stamps = rising = stamp_s[first]
    for share in _LAGS:
        lag = max(1, len(first) // share)
        slopes = (rising[lag:] - rising[:-lag]) / (first[lag:] - first[:-lag])
        step = float(np.median(slopes)) if len(slopes) else 0.0
        if not step > 0:
            raise BadInput("the time does not rise; expected seconds that do")
        rising = stamps - np.cumsum(_jumps(np.asarray(step * first), stamps))
    return np.asarray(step * np.arange(count))


def _block_starts(stamp_s: Real) -> NDArray[np.intp]:
    """First samples of the blocks: where a step differs from the median step, if blocks are equally long."""
    finite: NDArray[np.intp] = np.flatnonzero(np.isfinite(stamp_s))
    steps = np.diff(stamp_s[finite])
    usual = float(np.median(steps)) if len(steps) else 0.0
    begins = np.concatenate([[True], np.abs(steps - usual) > max(_SAME_STEP * abs(usual), 1e-6)])[: len(finite)]
    lengths = np.diff(np.flatnonzero(begins))
    if usual and (len(lengths) < _LEAST_BLOCKS or np.median(np.abs(lengths / np.median(lengths) - 1)) > _UNEQUAL):
        return finite  # every sample has a stamp of its own
    return np.asarray(finite[begins])


def _jumps(even: Real, stamp_s: Real) -> Real:
    """Time by which each stamp leaves the even time for good; 0 at most of them [s]."""
    jumps, difference = np.zeros(len(even)), stamp_s - even
    steps = np.diff(difference)
    if len(steps) < 2:
        return jumps
    block_s = float(np.median(np.diff(even)))
    least = max(2 * block_s, _OUTLIER * 1.4826 * float(np.median(np.abs(steps - np.median(steps)))))
    large = np.flatnonzero(np.abs(steps[:-1]) > least) + 1  # not the last: it would have no other that agrees
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(difference, _NEIGHBOURS, mode="edge"), _NEIGHBOURS)
    jump = np.median(windows[large + _NEIGHBOURS], axis=1) - np.median(windows[large], axis=1)
    here = steps[large - 1]
    jump = np.where(np.abs(jump) > np.abs(here) + least, here, jump)  # another one is near
    jumps[large] = np.where((np.abs(jump) > least) & (jump * here > 0), jump, 0.0)
    return jumps


def _fitted(time_s: Real, stamp_s: Real) -> RecordingClock:
    """Straight line through the stamps without outliers; without skew unless the skew is significant."""
    reference = float(np.median(stamp_s - time_s))  # stamps are large numbers: their fractions are what counts
    difference = stamp_s - time_s - reference
    spread = 1.4826 * float(np.median(np.abs(difference - np.median(difference))))
    limit = max(_OUTLIER * spread, MAX_SKEW * float(np.ptp(time_s)), 1e-6)
    good = np.abs(difference - np.median(difference)) <= limit
    t, difference = time_s[good], difference[good]
    count, middle = len(t), float(t.mean())
    if count < 3:
        return RecordingClock(reference + float(difference.mean()), blocks=count)
    moment = float(((t - middle) ** 2).sum())
    slope = float(((t - middle) * difference).sum()) / moment if moment > 0 else 0.0
    residual = difference - difference.mean() - slope * (t - middle)
    jitter = float(np.sqrt((residual**2).sum() / (count - 2)))
    slope_error = jitter / moment**0.5 if moment > 0 else float("inf")
    if not _SIGNIFICANT * slope_error < abs(slope) < MAX_SKEW:
        slope = 0.0
    epoch = reference + float(difference.mean()) - slope * middle
    return RecordingClock(epoch, slope, jitter / count**0.5, slope_error, jitter, count)
