"""Presses out of a run: where they are, and the readings before and under each."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.errors import BadInput
from sensorgen.recording.movement import strongest
from sensorgen.recording.samples import Bools, Complex, Real

THRESHOLD_N = 0.2
WINDOW_S, GUARD_S = 1.0, 0.3
_SHORTEST_S = 0.2
_LEAST = 8  # samples that a mean and its error need
_HYSTERESIS = 0.5
_SMOOTH_S = 0.2


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
    The strongest direction of ln Z, smoothed over 0.2 s and freed of what changes slower than presses, is cut where two
    groups of values have the least variance within them (Otsu 1979). The larger group is the rest.

    Raises
    ------
    BadInput
        Readings that are all the same, or fewer than 16.
    """
    if len(time_s) < 2 * _LEAST:
        raise BadInput(f"{len(time_s)} readings; expected at least {2 * _LEAST} to find presses in")
    signal = _smoothed(strongest(impedance_ohm), max(1, round(_SMOOTH_S / float(np.median(np.diff(time_s))))))
    limit = _otsu(signal)
    if np.count_nonzero(signal > limit) * 2 > len(signal):
        signal, limit = -signal, -limit
    rest, press = np.median(signal[signal <= limit]), np.median(signal[signal > limit])
    quarter = (press - rest) / 8
    return _spans(time_s, _held(signal > limit + quarter, signal < limit - quarter))


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


def _smoothed(values: Real, width: int) -> Real:
    padded = np.pad(values, (width // 2, width - 1 - width // 2), mode="edge")
    return np.convolve(padded, np.full(width, 1 / width), mode="valid")


def _otsu(values: Real) -> float:
    """The cut with the least variance within the two groups."""
    ordered = np.sort(values)
    count, sums = np.arange(1, len(ordered)), np.cumsum(ordered)
    low, high = sums[:-1] / count, (sums[-1] - sums[:-1]) / (len(ordered) - count)
    best = int(np.argmax(count * (len(ordered) - count) * (high - low) ** 2))
    return float((ordered[best] + ordered[best + 1]) / 2)


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
        What pressed when [N], [mm].
    window_s : float
        How long is averaged: until ``guard_s`` before the press, and until ``guard_s`` before its end [s].
    guard_s : float
        Distance of the windows from the ramps [s].

    Notes
    -----
    The error is that of the noise: the scatter about a straight line within each window, with as many samples as are
    independent. Drift between the two windows is not in it; see :mod:`sensorgen.process.drift`.

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
        rows.append((press.start_s, float(np.nanmean(force_n[under])), float(np.nanmean(position_mm[under])), *means))
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
