"""A clock rebuilt from stamps and indices.

The instrument samples evenly; the computer stamps whole blocks as they arrive, late by what it had to do, so that
stamps step backwards at the borders of blocks. Index and sampling rate are therefore taken for the time, which then
rises from sample to sample, and the first stamps of the blocks say where that time lies in real time, each about
equally badly: a straight line through all of them is better than any one by the square root of their number. Where the
stamps move away for good by more than two blocks, samples were lost and the time jumps with them; where they move back
for good, somebody set the computer's clock, and the time does not.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.samples import Bools, Clock, Real

_FAR = 6.0  # standard deviations from which on a block's stamp is an outlier, or a step a gap
_SURE = 3.0  # standard errors from which on a skew is one
_MOST_SKEW = 1e-3  # of two quartz clocks, with room to spare: more is a misread rate
_NEIGHBOURS = 5  # blocks at either side that must agree on a step
_LATEST_S = 1e11  # since 1970: the year 5000; a number beyond is no time
_SAME = 1e-3  # of the step within a block: below it two steps are the same


class Rebuilt(NamedTuple):
    """A time that rises, its place in real time, and what the stamps were like."""

    time_s: Real
    clock: Clock
    marks: dict[str, Bools]
    notes: tuple[str, ...]


class _Blocks(NamedTuple):
    """First samples of the blocks: their indices, and their stamps."""

    first: NDArray[np.intp]
    stamp_s: Real


def rebuilt(count: int, time_s: Real | None, stamp_s: Real | None) -> Rebuilt:
    """A rising time for every sample.

    Parameters
    ----------
    count : int
        Samples.
    time_s : (count,) array, optional
        The instrument's own time [s]; where it does not rise, index and its commonest step replace it.
    stamp_s : (count,) array, optional
        Stamps of the computer's clock, in seconds since 1970 [s].

    Raises
    ------
    BadInput
        Neither of the two tells a sampling rate.
    """
    notes: list[str] = []
    time_s, stamp_s = _times(time_s), _times(stamp_s)
    even = _even(count, time_s, stamp_s, notes)
    if stamp_s is None or not np.isfinite(stamp_s).any():
        return Rebuilt(even, Clock(), _stamp_marks(count, stamp_s), tuple(notes))
    starts = _starts(stamp_s)
    jumps = _lost(even, starts)
    for index, lost in jumps:
        if lost > 0:
            even[index:] += lost
            notes.append(f"{lost:.3g} s were lost before sample {index + 1}")
        else:
            notes.append(f"the computer's clock was set back by {-lost:.3g} s at sample {index + 1}")
    marks = _stamp_marks(count, stamp_s)
    for index, lost in jumps:
        marks["gap"][index] = lost > 0
    steps = np.zeros(count)
    for index, lost in jumps:
        steps[index:] += min(lost, 0.0)
    return Rebuilt(even, _fit(even[starts.first], starts.stamp_s - steps[starts.first]), marks, tuple(notes))


def rate_hz(time_s: Real) -> float:
    """Samples per second by the middle of all steps; nan for fewer than two samples [Hz]."""
    return 1 / float(np.median(np.diff(time_s))) if len(time_s) > 1 else float("nan")


def _times(given_s: Real | None) -> Real | None:
    """What can be a time; nan elsewhere."""
    return None if given_s is None else np.where(np.abs(given_s) < _LATEST_S, given_s, np.nan)


def _even(count: int, time_s: Real | None, stamp_s: Real | None, notes: list[str]) -> Real:
    """The instrument's time, or one of even steps."""
    if time_s is not None and np.isfinite(time_s).all() and (np.diff(time_s) > 0).all():
        return np.array(time_s, float)
    if count == 1:
        return np.zeros(1)
    if time_s is not None:
        steps = np.diff(time_s)
        good = steps[np.isfinite(steps) & (steps > 0)]
        if not len(good):
            raise BadInput("the time does not rise at any sample; expected seconds that do")
        step, first = float(np.median(good)), time_s[np.flatnonzero(np.isfinite(time_s))[0]]
        notes.append(f"the time does not rise everywhere: taken as even steps of {step:.6g} s")
        return np.asarray(first + step * np.arange(count))
    return _from_stamps(count, stamp_s)


def _from_stamps(count: int, stamp_s: Real | None) -> Real:
    """Even steps from stamps alone: the middle slope between blocks far apart, which lost samples bend least."""
    if stamp_s is None or np.count_nonzero(np.isfinite(stamp_s)) < 2:
        raise BadInput("nothing tells when the samples were taken; expected a time, stamps, or a sampling rate")
    first, stamp = _starts(stamp_s)
    half = max(1, len(first) // 2)
    far = first[half:] - first[:-half]
    step = float(np.median((stamp[half:] - stamp[:-half]) / far)) if len(far) else float(np.median(np.diff(stamp_s)))
    if not step > 0:
        raise BadInput("the time stamps do not rise; expected seconds that do")
    return np.asarray(step * np.arange(count))


def _starts(stamp_s: Real) -> _Blocks:
    """Blocks begin where a stamp's step is another than the commonest."""
    finite = np.flatnonzero(np.isfinite(stamp_s))
    stamps = stamp_s[finite]
    steps = np.diff(stamps)
    inside = float(np.median(steps)) if len(steps) else 0.0
    begins = np.concatenate([[True], np.abs(steps - inside) > np.maximum(_SAME * abs(inside), 1e-6)])
    if np.count_nonzero(begins) < 2:  # no blocks: each stamp is its own
        begins[:] = True
    return _Blocks(finite[begins], stamps[begins])


def _lost(even: Real, starts: _Blocks) -> list[tuple[int, float]]:
    """Samples at which the stamps move away from the time for good, and by how much [s]."""
    off = starts.stamp_s - even[starts.first]
    steps = np.diff(off)
    if len(steps) < 2:
        return []
    block_s = float(np.median(np.diff(even[starts.first])))
    least = max(2 * block_s, _FAR * 1.4826 * float(np.median(np.abs(steps - np.median(steps)))))
    found = []
    for k in np.flatnonzero(np.abs(steps) > least):
        before, after = off[max(0, k + 1 - _NEIGHBOURS) : k + 1], off[k + 1 : k + 1 + _NEIGHBOURS]
        moved = float(np.median(after) - np.median(before))
        if abs(moved) > least and len(after) > 1 and moved * steps[k] > 0:
            found.append((int(starts.first[k + 1]), moved))
    return found


def _fit(time_s: Real, stamp_s: Real) -> Clock:
    """A straight line through the stamps, outliers left out; flat where a slope does not stand out of its error."""
    reference = float(np.median(stamp_s - time_s))  # stamps are large numbers: their fractions are what counts
    off = stamp_s - time_s - reference
    spread = 1.4826 * float(np.median(np.abs(off - np.median(off))))
    good = np.abs(off - np.median(off)) <= max(_FAR * spread, _MOST_SKEW * float(np.ptp(time_s)), 1e-6)
    t, off = time_s[good], off[good]
    count, middle = len(t), float(t.mean())
    if count < 3:
        return Clock(reference + float(off.mean()), blocks=count)
    moment = float(((t - middle) ** 2).sum())
    slope = float(((t - middle) * off).sum()) / moment if moment > 0 else 0.0
    jitter = float(np.sqrt(((off - off.mean() - slope * (t - middle)) ** 2).sum() / (count - 2)))
    slope_error = jitter / moment**0.5 if moment > 0 else float("inf")
    if not _SURE * slope_error < abs(slope) < _MOST_SKEW:
        slope = 0.0
    error = jitter / count**0.5
    return Clock(reference + float(off.mean()) - slope * middle, slope, error, slope_error, jitter, count)


def _stamp_marks(count: int, stamp_s: Real | None) -> dict[str, Bools]:
    marks = {name: np.zeros(count, bool) for name in ("gap", "reversed stamp", "repeated stamp", "no stamp")}
    if stamp_s is not None:
        steps = np.diff(stamp_s)
        marks["reversed stamp"][1:], marks["repeated stamp"][1:] = steps < 0, steps == 0
        marks["no stamp"][:] = ~np.isfinite(stamp_s)
    return marks
