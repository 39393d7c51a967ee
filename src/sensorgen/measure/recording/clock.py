"""Sample times from the sample index and the sampling rate, and their place in real time from the computer's stamps.

The instrument samples at even steps. The computer stamps whole blocks as they arrive, delayed by its other work, so
that stamps step backwards between blocks. The sample index over the sampling rate gives a time that rises; a straight
line through the first stamps of all blocks gives its real time, with the error of one stamp over the square root of
their number. Where the stamps leave that line for good by more than two blocks, samples were lost and the time jumps
with them; where they go back for good, the computer's clock was set, and the time does not jump.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.samples import Bools, Real, RecordingClock

_OUTLIER = 6.0  # standard deviations from which on a stamp is an outlier, or a step a gap
_SIGNIFICANT = 3.0  # standard errors from which on a skew is one
MAX_SKEW = 1e-3  # of two quartz clocks, with room to spare: more is a wrong rate
_NEIGHBOURS = 5  # blocks at either side that must agree on a step
_LATEST_S = 1e11  # since 1970: the year 5000; a larger number is no time
_SAME_STEP = 1e-3  # relative difference of two steps that count as equal


@dataclass(frozen=True, eq=False)
class Rebuilt:
    """Sample times of a recording.

    Attributes
    ----------
    time_s : (n,) array
        Rising [s].
    clock : RecordingClock
        Relation to real time.
    marks : dict of str to (n,) array
        Marks of gaps and of bad stamps.
    notes : tuple of str
        Corrections that were made.
    """

    time_s: Real
    clock: RecordingClock
    marks: dict[str, Bools]
    notes: tuple[str, ...]


def rebuilt(count: int, time_s: Real | None, stamp_s: Real | None) -> Rebuilt:
    """Rising time of every sample.

    Parameters
    ----------
    count : int
        Number of samples.
    time_s : (count,) array, optional
        Time by the instrument [s]; replaced by index times median step where it does not rise.
    stamp_s : (count,) array, optional
        Stamps by the computer's clock, in seconds since 1970 [s].

    Raises
    ------
    BadInput
        Neither gives a sampling rate.
    """
    time_s, stamp_s = (None if t is None else np.where(np.abs(t) < _LATEST_S, t, np.nan) for t in (time_s, stamp_s))
    even, notes = _even(count, time_s, stamp_s)
    marks = {name: np.zeros(count, bool) for name in ("gap", "reversed stamp", "repeated stamp", "no stamp")}
    if stamp_s is None:
        return Rebuilt(even, RecordingClock(), marks, notes)
    steps = np.diff(stamp_s)
    marks["reversed stamp"][1:], marks["repeated stamp"][1:] = steps < 0, steps == 0
    marks["no stamp"][:] = ~np.isfinite(stamp_s)
    if marks["no stamp"].all():
        return Rebuilt(even, RecordingClock(), marks, notes)
    first, first_stamp = _block_starts(stamp_s)
    set_back = np.zeros(count)
    for index, jump_s in _jumps(even, first, first_stamp):
        if jump_s > 0:
            even[index:] += jump_s
            marks["gap"][index] = True
            notes += (f"{jump_s:.3g} s were lost before sample {index + 1}",)
        else:
            set_back[index:] += jump_s
            notes += (f"the computer's clock was set back by {-jump_s:.3g} s at sample {index + 1}",)
    return Rebuilt(even, _fitted(even[first], first_stamp - set_back[first]), marks, notes)


def _even(count: int, time_s: Real | None, stamp_s: Real | None) -> tuple[Real, tuple[str, ...]]:
    """Time of the instrument, or even steps where it does not rise or is missing; and a note on that."""
    if time_s is not None and np.isfinite(time_s).all() and (np.diff(time_s) > 0).all():
        return np.array(time_s, float), ()
    if count == 1:
        return np.zeros(1), ()
    if time_s is not None:
        steps = np.diff(time_s)
        rising = steps[np.isfinite(steps) & (steps > 0)]
        if not len(rising):
            raise BadInput("the time does not rise at any sample; expected seconds that do")
        step, first = float(np.median(rising)), time_s[np.flatnonzero(np.isfinite(time_s))[0]]
        note = f"the time does not rise everywhere: taken as even steps of {step:.6g} s"
        return np.asarray(first + step * np.arange(count)), (note,)
    if stamp_s is None or np.count_nonzero(np.isfinite(stamp_s)) < 2:
        raise BadInput("no sampling times; expected a time, stamps, or a sampling rate")
    start, stamp = _block_starts(stamp_s)
    half = max(1, len(start) // 2)
    far = start[half:] - start[:-half]  # slopes over half of the run, which lost samples change least
    step = float(np.median((stamp[half:] - stamp[:-half]) / far)) if len(far) else float(np.median(np.diff(stamp_s)))
    if not step > 0:
        raise BadInput("the time stamps do not rise; expected seconds that do")
    return np.asarray(step * np.arange(count)), ()


def _block_starts(stamp_s: Real) -> tuple[NDArray[np.intp], Real]:
    """First samples of the blocks and their stamps; a block begins where a step differs from the median step."""
    finite = np.flatnonzero(np.isfinite(stamp_s))
    stamps = stamp_s[finite]
    steps = np.diff(stamps)
    usual = float(np.median(steps)) if len(steps) else 0.0
    begins = np.concatenate([[True], np.abs(steps - usual) > np.maximum(_SAME_STEP * abs(usual), 1e-6)])
    if np.count_nonzero(begins) < 2:  # no blocks: every sample has a stamp of its own
        begins[:] = True
    return finite[begins], stamps[begins]


def _jumps(even: Real, first: NDArray[np.intp], stamp_s: Real) -> list[tuple[int, float]]:
    """Samples at which the stamps leave the time for good, and by how much [s]."""
    difference = stamp_s - even[first]
    steps = np.diff(difference)
    if len(steps) < 2:
        return []
    block_s = float(np.median(np.diff(even[first])))
    least = max(2 * block_s, _OUTLIER * 1.4826 * float(np.median(np.abs(steps - np.median(steps)))))
    jumps = []
    for k in np.flatnonzero(np.abs(steps) > least):
        before, after = difference[max(0, k + 1 - _NEIGHBOURS) : k + 1], difference[k + 1 : k + 1 + _NEIGHBOURS]
        jump = float(np.median(after) - np.median(before))
        if abs(jump) > least and len(after) > 1 and jump * steps[k] > 0:
            jumps.append((int(first[k + 1]), jump))
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
