r"""Recording and rig on one time: the offset of their clocks, with its error.

Both have their own clock. What tells their distance is that the sensor answers to the force: the recording is fitted by

.. math::
   y(t) = \sum_{i=0}^{3} c_i t^i + \sum_{i=1}^{2} b_i \ln(1 + t / \tau_i) + \sum_{i=1}^{3} \sum_{j=0}^{2} c_{ij} F^i x^j

with F and x taken the offset earlier, y the strongest direction in which ln Z moves, and time constants of a tenth and
a hundredth of the run for what creeps. A correlation over all distances finds the place, Gauss-Newton the rest; the
standard error is that of the fit, with as many samples as are independent of each other.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sensorgen.errors import BadInput
from sensorgen.recording.movement import strongest
from sensorgen.recording.rig import RigLog
from sensorgen.recording.samples import Real, Recording

_GRID_S = 0.05  # of the correlation
_MOST_GRID = 1 << 21
_MOST_FITTED = 60_000
_LEAST_SHARE = 0.05  # of the recording's variance that the force must explain before it tells the time
_LEAST_RATIO = 8.0  # Fisher's F: of what chance explains at the best of thousands of offsets, with noise that wanders
_SURE = 3.0
_MOST_SKEW = 1e-3
_STEPS = 20
_CREEP = (10.0, 100.0)  # times that the time constants fit into the run
_GAP = 5.0  # typical distances of the rig's rows: beyond it the rig is silent


class _Offset(NamedTuple):
    """Of the two clocks."""

    offset_s: float
    error_s: float
    skew: float
    skew_error: float
    explained: float
    by_chance: bool


@dataclass(frozen=True, eq=False)
class Joined:
    """What was measured, and what was done to the sensor then.

    Attributes
    ----------
    recording : Recording
        With the mark "rig error" where the rig was silent or in trouble.
    force_n : (n,) array
        Measured force, or the set one where none was measured, at each sample [N]; nan where the rig was silent.
    set_force_n, set_position_mm : (n,) array
        What the rig was told at that time [N], [mm].
    offset_s : float
        To be added to the rig's time to have the recording's real time, in the middle of the run [s].
    offset_error_s : float
        Its standard error [s]; nan where the clocks were believed because the sensor does not tell.
    skew, skew_error : float
        Rate of the recording's clock over the rig's, less 1; 0 unless it stands out of its error [-].
    explained : float
        Share of the signal's variance that the force explains at that offset [-].
    notes : tuple of str
        In words.
    """

    recording: Recording
    force_n: Real
    set_force_n: Real
    set_position_mm: Real
    offset_s: float
    offset_error_s: float
    skew: float
    skew_error: float
    explained: float
    notes: tuple[str, ...] = ()

    def words(self) -> str:
        """The offset, as a person reads it."""
        if np.isnan(self.offset_error_s):
            return f"the clocks are believed: the force explains {self.explained:.1%} of the signal and tells no offset"
        skew = f", skew {self.skew * 1e6:.3g} +- {self.skew_error * 1e6:.2g} ppm" if self.skew else ""
        return f"rig's clock + {self.offset_s:.4f} +- {self.offset_error_s:.2g} s{skew}"


def joined(recording: Recording, rig: RigLog, within_s: float = np.inf) -> Joined:
    """A recording with the rig's log beside it.

    Parameters
    ----------
    recording : Recording
        What the instrument measured.
    rig : RigLog
        What the rig did meanwhile; its rows with errors count for nothing.
    within_s : float
        How far the two clocks may be apart at most [s]; everything that leaves half of the shorter one to compare, if
        not given.

    Raises
    ------
    BadInput
        Too little to compare; no force that moves the readings, and no common clock to believe instead.
    """
    if np.count_nonzero(~rig.error) < 2 or np.count_nonzero(recording.valid()) < 16:
        raise BadInput(
            f"{np.count_nonzero(~rig.error)} rows of the rig and {np.count_nonzero(recording.valid())} samples without "
            "errors; expected at least 2 and 16"
        )
    common = bool(np.isfinite(recording.epoch_s))
    time = recording.real_s() if common else recording.time_s
    found = _estimated(recording, time, rig, within_s)
    if found.by_chance:
        if not common:
            raise BadInput(
                f"the force explains {found.explained:.1%} of the readings: too little to find the offset of the "
                "clocks, and the recording has no time stamps to go by"
            )
        found = found._replace(offset_s=0.0, error_s=np.nan, skew=0.0, skew_error=np.nan)
    return _beside(recording, rig, time, found)


def _beside(recording: Recording, rig: RigLog, time: Real, found: _Offset) -> Joined:
    """The rig's columns at the recording's times."""
    middle = float((time[0] + time[-1]) / 2)
    at = time - found.offset_s - found.skew * (time - middle)
    good = ~rig.error
    rows = rig.time_s[good]
    where = np.searchsorted(rows, at, side="right") - 1
    known = (where >= 0) & (at <= rows[-1])
    held = np.clip(where, 0, len(rows) - 1)
    step = float(np.median(np.diff(rows)))
    after = np.minimum(held + 1, len(rows) - 1)
    silent = ~known | ((rows[after] - rows[held] > _GAP * step) & (at - rows[held] > step))
    troubled = _troubled(rig, at)
    force = np.where(np.isfinite(rig.force_n), rig.force_n, rig.set_force_n)[good]
    blank = np.where(silent, np.nan, 1.0)
    marks = dict(recording.marks) | {"rig error": recording.marks["rig error"] | silent | troubled}
    notes = list(rig.notes)
    if silent.any():
        notes.append(f"{np.count_nonzero(silent)} samples while the rig was silent")
    return Joined(
        replace(recording, marks=marks), np.interp(at, rows, force) * blank, rig.set_force_n[good][held] * blank,
        rig.set_position_mm[good][held] * blank, *found[:-1], tuple(notes),
    )  # fmt: skip


def _troubled(rig: RigLog, at: Real) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Samples to which the nearest row before or after has an error."""
    finite = np.isfinite(rig.time_s)
    order = np.argsort(rig.time_s[finite], kind="stable")
    rows, bad = rig.time_s[finite][order], rig.error[finite][order]
    after = np.clip(np.searchsorted(rows, at), 1, len(rows) - 1)
    nearest = np.where(at - rows[after - 1] <= rows[after] - at, after - 1, after)
    return np.asarray(bad[nearest])


def _estimated(recording: Recording, time: Real, rig: RigLog, within_s: float) -> _Offset:
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


def _refined(time: Real, signal: Real, rig: RigLog, offset: float) -> _Offset:
    rows, force, position = _force(rig)
    middle = float((time[0] + time[-1]) / 2)
    half = max(float(np.ptp(time)) / 2, 1e-9)
    u = (time - middle) / half
    h = float(np.median(np.diff(rows))) / 2
    length = max(float(np.ptp(position)), 1e-9)

    def basis(at: Real) -> Real:
        f, x = np.interp(at, rows, force), (np.interp(at, rows, position) - position.mean()) / length
        return np.column_stack([f**i * x**j for i in (1, 2, 3) for j in (0, 1, 2)])

    creep = [np.log1p((1 + u) * ratio / 2) for ratio in _CREEP]
    drift, skew = np.column_stack([np.ones_like(u), u, u**2, u**3, *creep]), 0.0
    covariance, fitted, left = np.full((2, 2), np.nan), signal * 0, signal
    for _ in range(_STEPS):
        at = time - offset - skew * (time - middle)
        shapes = basis(at)
        model = np.hstack([drift, shapes])
        weights = np.linalg.lstsq(model, signal, rcond=None)[0]
        fitted, left = shapes @ weights[drift.shape[1] :], signal - model @ weights
        slope = -((basis(at + h) - basis(at - h)) / (2 * h)) @ weights[drift.shape[1] :]
        whole = np.hstack([model, slope[:, None], (slope * u * half)[:, None]])
        step = np.linalg.lstsq(whole, left, rcond=None)[0][-2:]
        covariance = _covariance(whole, left)
        offset, skew = offset + float(np.clip(step[0], -h, h)), float(np.clip(skew + step[1], -_MOST_SKEW, _MOST_SKEW))
        if abs(step[0]) < 1e-3 * covariance[0, 0] ** 0.5 or abs(step[0]) < 1e-9:
            break
    error, skew_error = np.sqrt(np.diag(covariance))
    explained = float(np.var(fitted) / (np.var(fitted) + np.var(left))) if np.var(signal) > 0 else 0.0
    sure = bool(abs(skew) > _SURE * skew_error)
    ratio = explained / max(1 - explained, 1e-12) * (_independent(left) - model.shape[1]) / shapes.shape[1]
    by_chance = explained < _LEAST_SHARE or ratio < _LEAST_RATIO
    return _Offset(offset, float(error), skew if sure else 0.0, float(skew_error), explained, by_chance)


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
