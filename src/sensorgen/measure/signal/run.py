"""Process a recording: join it with the rig, filter it, remove its drift, average its presses; hysteresis of each."""

from dataclasses import dataclass, replace

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.rig import NO_CLOCKS, Joined
from sensorgen.measure.recording.samples import Recording
from sensorgen.measure.signal import drift, lowpass, presses
from sensorgen.measure.signal.presses import THRESHOLD_N, by_force


@dataclass(frozen=True, eq=False)
class Processed:
    """A processed recording.

    Attributes
    ----------
    recording : Recording
        With the rig's errors among its marks.
    force_n : (n,) array
        Force at each sample [N]; nan where unknown.
    filtered_s, filtered_ohm : (k,), (k, m) array
        Low-passed forward and backward on even steps, with drift [s], [ohm].
    drift : Drift or None
        Drift removed from the presses' readings; None if none was.
    pairs : Pairs or None
        Readings before and under each press; None where there are none.
    clock_error_s : float
        Standard error of the rig's clock; nan if unknown [s].
    by_force : bool
        Whether presses were detected by the rig's force; else by the readings alone, force and position unknown.
    notes : tuple of str
        Offset of the clocks, presses left out, other remarks.
    """

    recording: Recording
    force_n: Real
    filtered_s: Real
    filtered_ohm: Complex
    drift: drift.Drift | None
    pairs: presses.Pairs | None
    clock_error_s: float
    by_force: bool
    notes: tuple[str, ...]

    @property
    def left_out(self) -> tuple[str, ...]:
        """Presses that were left out, or why the rig's force shows none."""
        return self.pairs.left_out if self.pairs else self.notes[-1:] if self.by_force else ()

    def rest_ohm(self) -> Complex:
        """Readings with nothing on the sensor (k, m): before presses, else the valid ones without a force [ohm]."""
        if self.pairs:
            return self.pairs.before_ohm
        return self.recording.impedance_ohm[self.recording.valid() & ~(np.abs(self.force_n) >= THRESHOLD_N / 2)]


def processed(
    recording: Recording, rig: Joined | None = None, *, remove_drift: bool = True, law: str = "",
    cutoff_hz: float = lowpass.CUTOFF_HZ,
) -> Processed:  # fmt: skip
    """Process a recording.

    Parameters
    ----------
    recording : Recording
        Recording of one lock-in.
    rig : Joined or None
        The recording joined with the log of a rig; without it, presses are detected in the readings.
    remove_drift : bool
        Whether to fit the drift between presses and remove it from the presses' readings.
    law : str
        Law of drift, of :data:`sensorgen.measure.signal.drift.LAWS`; the best by BIC if not given, without a log of
        the rig among those that need no force.
    cutoff_hz : float
        Cut-off frequency of the low-pass [Hz].

    Raises
    ------
    BadInput
        Fewer than 16 valid samples.
    OutOfRange
        A cut-off frequency that is not between 0 and half the sampling rate.
    UnknownName
        No such law of drift.
    """
    if law:
        drift.check(law)
    beside = _beside(recording, rig)
    one, force, notes = beside.recording, beside.force_n, list(beside.notes)
    valid = one.valid()
    filtered = lowpass.filtered(one, cutoff_hz)
    if rig:
        spans = presses.by_force(one.time_s, force)
    else:
        spans = presses.by_readings(one.time_s[valid], one.impedance_ohm[valid])
    removed, pairs, z = None, None, one.impedance_ohm
    if remove_drift and spans:
        try:
            removed = _drift(one, spans, force if rig else None, law)
            z = removed.removed(one.time_s, z)
        except BadInput as error:
            notes.append(f"drift not removed: {error}")
    try:
        pairs = presses.pairs(one.time_s, z, valid, spans, force, beside.set_position_mm) if spans else None
        notes += map("left out: {}".format, pairs.left_out) if pairs else [_no_presses(force)]
    except BadInput as error:
        notes.append(_no_presses(force, f"no presses: {error}"))
    return Processed(one, force, *filtered, removed, pairs, beside.clocks.offset_error_s, rig is not None, tuple(notes))


def _no_presses(force_n: Real, otherwise: str = "nothing pressed") -> str:
    """Reason that a force shows no press after a rest: its zero, its sign, or another one."""
    low, high = np.nanmin(force_n, initial=np.inf), np.nanmax(force_n, initial=-np.inf)
    if THRESHOLD_N / 2 <= low < np.inf:
        return f"no presses: the force is never below {low:.3g} N; expected 0 between presses: take its zero off"
    if low <= -THRESHOLD_N and high < -low:
        return f"no presses: the force goes down to {low:.3g} N; expected one that rises under a press: change its sign"
    return otherwise


def _beside(recording: Recording, rig: Joined | None) -> Joined:
    """Recording with force and position, nan without a rig; notes on both."""
    if rig is None:
        unknown = np.full(len(recording.time_s), np.nan)
        return Joined(recording, unknown, unknown, unknown, NO_CLOCKS, recording.source.notes)
    return replace(rig, notes=(*recording.source.notes, rig.clocks.words(), *rig.notes))


def _drift(one: Recording, spans: list[presses.PressTimes], force_n: Real | None, law: str) -> drift.Drift:
    """Drift between presses; without a force [N] by a law that needs their times alone."""
    among = (law,) if law else drift.BY_TIME if force_n is None else tuple(drift.LAWS)
    if force_n is None:
        force_n = np.zeros(len(one.time_s))
        for start, end in spans:
            force_n[np.searchsorted(one.time_s, start) : np.searchsorted(one.time_s, end, side="right")] = 1.0
    return drift.fitted(one.time_s, one.impedance_ohm, one.valid(), force_n, among=among)


_FORCES = 41
_INNER = 0.1  # of the span at either end, where loading and unloading meet or the tip lifts off


@dataclass(frozen=True, eq=False)
class Hysteresis:
    """Hysteresis of one press; a column per reading, as R or X at a frequency.

    Attributes
    ----------
    share : (m,) array
        Largest difference of unloading and loading over the span of the readings at these forces [-].
    error : (m,) array
        Standard error of the difference at one force; the largest of many is a few of it [-]. With that of the rig's
        clock, if known, which moves both curves apart, from :func:`of_presses`.
    at_n : (m,) array
        Force of the largest difference [N].
    lost : (m,) array
        Area between the two curves over the area under the loading curve [-].
    force_n : (k,) array
        Forces of the two curves [N].
    up, down : (k, m) array
        Readings during loading and unloading.
    """

    share: Real
    error: Real
    at_n: Real
    lost: Real
    force_n: Real
    up: Real
    down: Real


def hysteresis(force_n: Real, values: Real) -> Hysteresis:
    """Hysteresis of one press: loading to the largest force, and unloading.

    Parameters
    ----------
    force_n : (n,) array
        Force over time [N].
    values : (n, m) array
        Readings, R or X of every frequency.

    Raises
    ------
    BadInput
        Loading and unloading without a common range of forces.
    """
    top = int(np.argmax(force_n))
    low = max(force_n[: top + 1].min(initial=np.inf), force_n[top:].min(initial=np.inf))
    high = float(force_n[top])
    if not high > low or min(top, len(force_n) - 1 - top) < 2:
        raise BadInput(
            f"loading and unloading have forces from {low:g} to {high:g} N in common; expected a press with loading "
            "and unloading"
        )
    at = np.linspace(low, high, _FORCES)
    up, up_error = _curve(force_n[: top + 1], values[: top + 1], at)
    down, down_error = _curve(force_n[top:], values[top:], at)
    span = np.ptp(np.vstack([up, down]), axis=0)
    span = np.where(span > 0, span, np.nan)
    difference = np.abs(down - up)
    inner = (at >= low + _INNER * (high - low)) & (at <= high - _INNER * (high - low))
    where = np.argmax(np.where(inner[:, None], difference, -1.0), axis=0)
    under = np.trapezoid(np.abs(up - up[0]), at, axis=0)
    lost = np.trapezoid(difference, at, axis=0) / np.where(under > 0, under, np.nan)
    share = difference[where, np.arange(values.shape[1])] / span
    return Hysteresis(share, np.hypot(up_error, down_error) / span, at[where], lost, at, up, down)


def _curve(force_n: Real, values: Real, at: Real) -> tuple[Real, Real]:
    """Readings at given forces, linear between the means nearest to each, and the standard error at one force."""
    step = (at[-1] - at[0]) / (len(at) - 1)
    _, places = np.unique(np.round((force_n - at[0]) / step), return_inverse=True)
    counts = np.bincount(places)
    forces, *means = (np.bincount(places, column) / counts for column in (force_n, *values.T))
    curve = np.column_stack([np.interp(at, forces, mean) for mean in means])
    through = np.column_stack([np.interp(force_n, at, column) for column in curve.T])
    return curve, np.asarray((values - through).std(axis=0) / np.sqrt(max(len(values) / len(at), 1)))


@dataclass(frozen=True, eq=False)
class Ways:
    """Hysteresis of all presses of a run.

    Attributes
    ----------
    ways : dict of float to Hysteresis
        By the begin of the press [s]; columns are R, then X, by frequency.
    left_out : tuple of str
        Presses without loading and unloading.
    """

    ways: dict[float, Hysteresis]
    left_out: tuple[str, ...]


def of_presses(worked: Processed, threshold_n: float = THRESHOLD_N) -> Ways:
    """Hysteresis of every press of a run, without drift.

    Parameters
    ----------
    worked : Processed
        A recording processed with the rig's log.
    threshold_n : float
        Least force of a press [N].

    Raises
    ------
    BadInput
        No press with loading and unloading.
    """
    one, valid = worked.recording, worked.recording.valid()
    time, force = one.time_s[valid], worked.force_n[valid]
    ways: dict[float, Hysteresis] = {}
    left_out = []
    late_n = np.interp(time + np.nan_to_num(worked.clock_error_s), time, force)
    for press in by_force(time, force, threshold_n):
        during = (time >= press.start_s) & (time <= press.end_s)
        z = one.impedance_ohm[np.flatnonzero(valid)[during]]
        clean = worked.drift.removed(time[during], z) if worked.drift else z
        values = np.hstack([clean.real, clean.imag])
        try:
            way, late = hysteresis(force[during], values), hysteresis(late_n[during], values)
            of_clock = late.share - way.share if np.isfinite(worked.clock_error_s) else np.nan
            ways[press.start_s] = replace(way, error=np.hypot(way.error, of_clock))
        except BadInput as error:
            left_out.append(f"left out: press at {press.start_s:.6g} s: {error}")
    if not ways:
        raise BadInput(left_out[0] if left_out else _no_presses(force))
    return Ways(ways, tuple(left_out))
