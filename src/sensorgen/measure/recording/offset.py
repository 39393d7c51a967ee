r"""The offset of the clocks of a recording and of the rig, with its error.

What tells it is that the sensor answers to the force: the recording is fitted by

.. math::
   y(t) = \sum_{i=0}^{3} c_i t^i + \sum_{i=1}^{2} b_i \ln(1 + t / \tau_i) + \sum_{i=1}^{3} \sum_{j=0}^{2} c_{ij} F^i x^j
          + \sum_{i=1}^{4} d_i \int_0^t F(s)\, e^{-(t - s)/T_i} \frac{ds}{T_i}

with F and x taken the offset earlier, y the strongest direction in which ln Z moves, time constants of a tenth and a
hundredth of the run for what creeps, and T from one second to a minute for a film that answers slowly, or it would be
taken for a clock that is late. A correlation over all distances finds the place, a search around it and Gauss-Newton
the rest; the standard error is that of the fit, with as many samples as are independent of each other.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.movement import slowly, strongest
from sensorgen.measure.recording.rig import RigLog
from sensorgen.measure.recording.samples import Real, Recording

_GRID_S = 0.05  # of the correlation
_MOST_GRID = 1 << 21
_MOST_FITTED = 40_000
_LEAST_SHARE = 0.05  # of the recording's variance that the force must explain before it tells the time
_LEAST_RATIO = 8.0  # Fisher's F: of what chance explains at the best of thousands of offsets, with noise that wanders
_SURE = 3.0
_MOST_SKEW = 1e-3
_STEPS = 20
_CREEP = (10.0, 100.0)  # times that the time constants fit into the run
_ANSWERS_S = (1.0, 2.0, 4.0, 8.0, 32.0)
_AROUND_S, _FEW = np.linspace(-2.0, 2.0, 41), 4000  # of the search around the best correlation; samples for it


class Offset(NamedTuple):
    """Of the two clocks."""

    offset_s: float
    """To be added to the rig's time to have the recording's [s]."""
    error_s: float
    """Its standard error [s]."""
    skew: float
    """Rate of the recording's clock over the rig's, less 1; 0 unless it stands out of its error [-]."""
    skew_error: float
    """Its standard error [-]."""
    middle_s: float
    """The recording's time at which the offset is that [s]."""
    explained: float
    """Share of the signal's variance that the force explains [-]."""
    by_chance: bool
    """Whether that is no more than chance explains."""


def estimated(recording: Recording, time: Real, rig: RigLog, within_s: float) -> Offset:
    """The offset by one lock-in's readings.

    Parameters
    ----------
    recording : Recording
        What the instrument measured.
    time : (n,) array
        When, by the clock that is to be compared with the rig's [s].
    rig : RigLog
        What the rig did.
    within_s : float
        How far the clocks may be apart at most [s].

    Raises
    ------
    BadInput
        Too little to compare.
    """
    if np.count_nonzero(~rig.error) < 2 or np.count_nonzero(recording.valid()) < 16:
        raise BadInput(
            f"{np.count_nonzero(~rig.error)} rows of the rig and {np.count_nonzero(recording.valid())} samples without "
            "errors; expected at least 2 and 16"
        )
    valid = np.flatnonzero(recording.valid())
    used = valid[:: max(1, len(valid) // _MOST_FITTED)]
    signal = strongest(recording.impedance_ohm[used])
    return _refined(time[used], signal, rig, _correlated(time[used], signal, rig, within_s))


def _force(rig: RigLog) -> tuple[Real, Real, Real]:
    good = ~rig.error
    force = np.where(np.isfinite(rig.force_n), rig.force_n, rig.set_force_n)[good]
    return rig.time_s[good], force, rig.set_position_mm[good]


def _correlated(time: Real, signal: Real, rig: RigLog, within_s: float) -> float:
    """The offset at which signal and force go together best, on a grid."""
    from scipy.signal import correlate

    rows, force, _ = _force(rig)
    step = max(_GRID_S, (np.ptp(time) + np.ptp(rows)) / _MOST_GRID)
    ours = _flat(np.interp(np.arange(time[0], time[-1], step), time, signal))
    theirs = _flat(np.interp(np.arange(rows[0], rows[-1], step), rows, force))
    if len(ours) < 4 or len(theirs) < 4:
        raise BadInput(f"{min(np.ptp(time), np.ptp(rows)):.3g} s to compare; expected at least {4 * step:g} s")
    found = np.abs(correlate(ours, theirs, method="fft"))
    lags = np.arange(-(len(theirs) - 1), len(ours))
    shared = np.minimum(np.minimum(len(ours), len(theirs)), np.minimum(lags + len(theirs), len(ours) - lags))
    offsets = time[0] - rows[0] + lags * step
    allowed = (shared * 2 >= min(len(ours), len(theirs))) & (np.abs(offsets) <= within_s)
    if not allowed.any():
        raise BadInput(
            f"recording and rig's log do not overlap within {within_s:g} s: their clocks are "
            f"{time[0] - rows[0]:.6g} s apart"
        )
    score = np.where(allowed, found / np.sqrt(np.maximum(shared, 1)), -1.0)
    return float(offsets[int(np.argmax(score))])


def _flat(values: Real) -> Real:
    """Without what changes slowly: a second is the sharpest that presses share."""
    width = min(len(values), round(20 / _GRID_S))
    padded = np.pad(values, width // 2, mode="edge")
    sums = np.cumsum(np.concatenate([[0.0], padded]))
    mean = (sums[width:] - sums[:-width])[: len(values)] / width
    return np.asarray(values - mean)


def _shapes(rig: RigLog) -> Callable[[Real], Real]:
    """What force and position may do to a signal, side by side, at any times of the rig's clock."""
    rows, force, position = _force(rig)
    where = (position - position.mean()) / max(float(np.ptp(position)), 1e-9)
    answers = [slowly(rows, force, tau) for tau in _ANSWERS_S]

    def shapes(at: Real) -> Real:
        f, x = np.interp(at, rows, force), np.interp(at, rows, where)
        return np.column_stack([*(f**i * x**j for i in (1, 2, 3) for j in (0, 1, 2)), *(a(at) for a in answers)])

    return shapes


def _around(time: Real, signal: Real, drift: Real, basis: Callable[[Real], Real], offset: float) -> float:
    """The offset near another at which least is left; a film that answers slowly makes the first one late."""
    few = slice(None, None, max(1, len(time) // _FEW))

    def left(by: float) -> float:
        model = np.hstack([drift[few], basis(time[few] - offset - by)])
        rest = signal[few] - model @ _solved(model, signal[few])
        return float(rest @ rest)

    return offset + float(min(_AROUND_S, key=left))


def _refined(time: Real, signal: Real, rig: RigLog, offset: float) -> Offset:
    middle = float((time[0] + time[-1]) / 2)
    half = max(float(np.ptp(time)) / 2, 1e-9)
    u = (time - middle) / half
    h = float(np.median(np.diff(rig.time_s[~rig.error]))) / 2
    basis = _shapes(rig)
    creep = [np.log1p((1 + u) * ratio / 2) for ratio in _CREEP]
    drift, skew = np.column_stack([np.ones_like(u), u, u**2, u**3, *creep]), 0.0
    offset = _around(time, signal, drift, basis, offset)
    covariance, fitted, left = np.full((2, 2), np.nan), signal * 0, signal
    for _ in range(_STEPS):
        at = time - offset - skew * (time - middle)
        shapes = basis(at)
        model = np.hstack([drift, shapes])
        weights = _solved(model, signal)
        fitted, left = shapes @ weights[drift.shape[1] :], signal - model @ weights
        slope = -((basis(at + h) - basis(at - h)) / (2 * h)) @ weights[drift.shape[1] :]
        whole = np.hstack([model, slope[:, None], (slope * u * half)[:, None]])
        step = _solved(whole, left)[-2:]
        covariance = _covariance(whole, left)
        offset, skew = offset + float(np.clip(step[0], -h, h)), float(np.clip(skew + step[1], -_MOST_SKEW, _MOST_SKEW))
        if abs(step[0]) < 1e-3 * covariance[0, 0] ** 0.5 or abs(step[0]) < 1e-9:
            break
    error, skew_error = np.sqrt(np.diag(covariance))
    explained = float(np.var(fitted) / (np.var(fitted) + np.var(left))) if np.var(signal) > 0 else 0.0
    sure = bool(abs(skew) > _SURE * skew_error)
    by_chance = explained < _LEAST_SHARE or _ratio(signal, drift, shapes, left) < _LEAST_RATIO
    return Offset(offset, float(error), skew if sure else 0.0, float(skew_error), middle, explained, by_chance)


def _ratio(signal: Real, drift: Real, shapes: Real, left: Real) -> float:
    """Fisher's F of what force explains at once, beside drift and slow answers, which follow noise that wanders."""
    slow = np.hstack([drift, shapes[:, -len(_ANSWERS_S) :]])
    without = signal - slow @ _solved(slow, signal)
    at_once = shapes.shape[1] - len(_ANSWERS_S)
    free = float(_independent(left)) - slow.shape[1] - at_once
    more = float(without @ without) / max(float(left @ left), 1e-300) - 1
    return float(more * free / at_once)


def _solved(model: Real, signal: Real) -> Real:
    """Least squares by the normal equations, which are ten times as fast, and good enough for a step towards them."""
    size = np.sqrt((model**2).sum(axis=0))
    scaled = model / np.where(size > 0, size, 1.0)
    return np.asarray(
        np.linalg.lstsq(scaled.T @ scaled, scaled.T @ signal, rcond=1e-13)[0] / np.where(size > 0, size, 1)
    )


def _covariance(model: Real, left: Real) -> Real:
    """Of the last two weights, with residuals that hang together: each counts for as many as are independent."""
    variance = float((left**2).sum()) / max(len(left) - model.shape[1], 1) * len(left) / _independent(left)
    return np.asarray(np.linalg.pinv(model.T @ model)[-2:, -2:] * variance)


def _independent(left: Real) -> float:
    """How many residuals are independent of each other, if each hangs on the one before."""
    count = len(left)
    rho = float((left[1:] * left[:-1]).sum() / max(float((left**2).sum()), 1e-300))
    rho = min(max(rho, 0.0), 1 - 1 / count)
    return count * (1 - rho) / (1 + rho)
