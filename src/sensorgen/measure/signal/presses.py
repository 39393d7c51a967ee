"""Presses out of a run: where they are, and the readings before and under each."""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.response import principal_component
from sensorgen.measure.recording.samples import Bools, Complex, Real

THRESHOLD_N = 0.2
WINDOW_S, GUARD_S = 1.0, 0.3
_SHORTEST_S = 0.2
_LEAST = 8  # samples that a mean and its error need
_HYSTERESIS = 0.5
_STEP_S, _SURE, _MAD = 0.3, 6.0, 0.6745  # median absolute deviation of noise, over its standard deviation


class Press(NamedTuple):
    """When the tip pressed [s]."""

    start_s: float
    end_s: float


def pressed(time_s: Real, force_n: Real, threshold_n: float = THRESHOLD_N) -> list[Press]:
    """Presses by the force: above the threshold, until below half of it.

    Parameters
    ----------
    time_s, force_n : (n,) array
        Time [s] and force [N]; nan where the force is not known, which ends a press.
    threshold_n : float
        Force from which on the tip presses [N].

    Returns
    -------
    list of Press
        Those that last 0.2 s at least, also the last one where the run ends within it.
    """
    force = np.where(np.isfinite(force_n), force_n, -np.inf)
    return _spans(time_s, _held(force >= threshold_n, force < _HYSTERESIS * threshold_n))


def found(time_s: Real, impedance_ohm: Complex) -> list[Press]:
    """Presses by the readings alone: where they leave the level that most of them have.

    Parameters
    ----------
    time_s : (n,) array
        Time, even steps [s].
    impedance_ohm : (n, m) array
        Readings that count [ohm].

    Notes
    -----
    The strongest direction of ln Z, searched for steps: where means over 0.3 s before and after differ by more than six
    times their noise. What changes slower is no step, so that creep is no press; nor is a press that takes seconds to
    come. Which way presses go is told by what they come back to: after a press the readings are where they were before
    it, between two presses they are not, unless all are equally strong; then the first step is a press.

    Raises
    ------
    BadInput
        Readings that are all the same, or fewer than 16.
    """
    if len(time_s) < 2 * _LEAST:
        raise BadInput(f"{len(time_s)} readings; expected at least {2 * _LEAST} to find presses in")
    width = min(max(1, round(_STEP_S / float(np.median(np.diff(time_s))))), len(time_s) // 2)
    before, after = _beside(principal_component(impedance_ohm), width)
    step = after - before
    limit = _SURE * float(np.median(np.abs(step - np.median(step)))) / _MAD
    edges = [(at, 1) for at in _peaks(step, limit)] + [(at, -1) for at in _peaks(-step, limit)]
    spans = _returning(sorted(edges), before, after, width)
    return [Press(float(time_s[i]), float(time_s[j])) for i, j in spans if time_s[j] - time_s[i] >= _SHORTEST_S]


def _beside(values: Real, width: int) -> tuple[Real, Real]:
    """Means over so many samples before and from each one on."""
    sums = np.concatenate([[0.0], np.cumsum(np.pad(values, width, mode="edge"))])
    means = (sums[width:] - sums[:-width]) / width
    return means[: len(values)], means[width : width + len(values)]


def _peaks(step: Real, limit: float) -> list[int]:
    """Where the steps above a limit are steepest, one each."""
    edges = np.diff(np.concatenate([[False], step > limit, [False]]).astype(int))
    spans = zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True)
    return [int(a + np.argmax(step[a:b])) for a, b in spans]


def _returning(edges: list[tuple[int, int]], before: Real, after: Real, width: int) -> list[tuple[int, int]]:
    """Begins and ends of presses: of the two ways to pair steps, the one that comes back to where it began."""
    if not edges:
        return []
    levels = _moved(before, -(width // 2)), _moved(after, width // 2)
    first = edges[0][1]
    likely, other = ([(i, j) for (i, a), (j, b) in pairwise(edges) if (a, b) == (s, -s)] for s in (first, -first))
    return other if _astray(other, *levels) < _astray(likely, *levels) / 2 else likely


def _moved(values: Real, by: int) -> Real:
    """Values so many places on, at the ends the outermost."""
    return values[np.clip(np.arange(len(values)) + by, 0, len(values) - 1)]


def _astray(spans: list[tuple[int, int]], before: Real, after: Real) -> float:
    """How far from where they began spans end, in the middle of them."""
    return float(np.median([abs(after[j] - before[i]) for i, j in spans])) if spans else np.inf


def _held(on: Bools, off: Bools) -> Bools:
    """On from where ``on`` says until ``off`` does."""
    said = np.where(on, 1, np.where(off, -1, 0))
    last = np.maximum.accumulate(np.where(said != 0, np.arange(len(said)), 0))
    return np.asarray(said[last] == 1)


def _spans(time_s: Real, on: Bools) -> list[Press]:
    edges = np.diff(np.concatenate([[False], on, [False]]).astype(int))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    spans = (Press(float(time_s[a]), float(time_s[b])) for a, b in zip(starts, ends, strict=True))
    return [span for span in spans if span.end_s - span.start_s >= _SHORTEST_S]


@dataclass(frozen=True, eq=False)
class Pairs:
    """Readings before and under each press, row by row; tones beside each other.

    Attributes
    ----------
    time_s : (p,) array
        When the press began [s].
    force_n, position_mm : (p,) array
        What pressed: means over the window [N], [mm].
    before_ohm, pressed_ohm : (p, m) array
        Means over the windows [ohm].
    difference_ohm : (p, m) array
        The one less the other [ohm].
    error_ohm : (p, m) array
        Standard errors of the difference: of R in the real part, of X in the imaginary part [ohm].
    samples : (p, 2) array
        Readings behind the two means.
    left_out : tuple of str
        Presses without enough readings, in words.
    """

    time_s: Real
    force_n: Real
    position_mm: Real
    before_ohm: Complex
    pressed_ohm: Complex
    difference_ohm: Complex
    error_ohm: Complex
    samples: NDArray[np.intp]
    left_out: tuple[str, ...] = ()


class _Mean(NamedTuple):
    """Of the readings in a window, with its standard errors."""

    value: Complex
    error: Complex
    samples: int


def pairs(
    time_s: Real, impedance_ohm: Complex, valid: Bools, presses: list[Press], force_n: Real, position_mm: Real,
    window_s: float = WINDOW_S, guard_s: float = GUARD_S,
) -> Pairs:  # fmt: skip
    """Before and under each press, and the difference with its standard error.

    Parameters
    ----------
    time_s : (n,) array
        Time [s].
    impedance_ohm : (n, m) array
        Readings, not filtered: their mean is the better filter, and its error is known [ohm].
    valid : (n,) array of bool
        Readings that count.
    presses : list of Press
        As :func:`pressed` or :func:`found` gives them.
    force_n, position_mm : (n,) array
        What pressed when; nan where nobody knows [N], [mm].
    window_s : float
        How long is averaged: until ``guard_s`` before the press, and until ``guard_s`` before its end [s].
    guard_s : float
        Distance of the windows from the ramps [s].

    Notes
    -----
    The error is that of the noise: the scatter about a straight line within each window, with as many samples as are
    independent. Drift between the two windows is not in it; see :mod:`sensorgen.measure.signal.drift`.

    Raises
    ------
    BadInput
        No press with readings before and under it.
    """
    rows, left_out, last_end = [], [], -np.inf
    for k, press in enumerate(presses, 1):
        until, end = press.start_s - guard_s, press.end_s - guard_s
        before = _counting(time_s, valid, max(until - window_s, last_end + guard_s), until)
        under = _counting(time_s, valid, max(end - window_s, press.start_s + guard_s), end)
        last_end = press.end_s
        if min(len(before), len(under)) < _LEAST:
            left_out.append(
                f"press {k} at {press.start_s:.6g} s: {len(before)} readings before and {len(under)} under it"
            )
            continue
        means = _mean(time_s[before], impedance_ohm[before]), _mean(time_s[under], impedance_ohm[under])
        rows.append((press.start_s, _middle(force_n[under]), _middle(position_mm[under]), *means))
    if not rows:
        raise BadInput(f"{len(presses)} presses, none with {_LEAST} readings before and under it; expected some")
    at, force, position, first, second = zip(*rows, strict=True)
    return Pairs(
        np.array(at), np.array(force), np.array(position), _column(first), _column(second),
        _column(second) - _column(first),
        np.array([np.hypot(a.error.real, b.error.real) + 1j * np.hypot(a.error.imag, b.error.imag)
                  for a, b in zip(first, second, strict=True)]),
        np.array([(a.samples, b.samples) for a, b in zip(first, second, strict=True)]), tuple(left_out),
    )  # fmt: skip


def _middle(values: Real) -> float:
    """Mean of those that are known; nan where none is."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else np.nan


def _column(means: tuple[_Mean, ...]) -> Complex:
    return np.array([mean.value for mean in means])


def _counting(time_s: Real, valid: Bools, start_s: float, end_s: float) -> NDArray[np.intp]:
    """Readings between two times that count."""
    first, after = np.searchsorted(time_s, start_s), np.searchsorted(time_s, end_s, side="right")
    return first + np.flatnonzero(valid[first:after])


def _mean(time_s: Real, z: Complex) -> _Mean:
    errors = [_error(time_s, part) for part in (z.real, z.imag)]
    return _Mean(z.mean(axis=0), errors[0] + 1j * errors[1], len(z))


def _error(time_s: Real, values: Real) -> Real:
    """Standard error of a mean of readings that scatter about a straight line, and may hang together."""
    t = time_s - time_s.mean()
    left = values - values.mean(axis=0)
    left = left - t[:, None] * (t @ left / (t @ t))
    variance = (left**2).sum(axis=0) / (len(left) - 2)
    power = np.maximum((left**2).sum(axis=0), 1e-300)
    rho = np.clip((left[1:] * left[:-1]).sum(axis=0) / power + 1 / len(left), 0.0, 1 - 1 / len(left))
    return np.asarray(np.sqrt(variance / len(left) * (1 + rho) / (1 - rho)))
