"""Hysteresis: how far a reading on the way down lies from the one on the way up, at the same force."""

from typing import NamedTuple

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.samples import Real
from sensorgen.measure.signal.presses import THRESHOLD_N, pressed
from sensorgen.measure.signal.run import Processed

_FORCES = 41
_INNER = 0.1  # of the span at either end, where the two ways meet or the tip lifts off


class Hysteresis(NamedTuple):
    """Of one press, reading by reading (a column may be R or X at a tone)."""

    share: Real
    """Largest distance of the two ways, over the span of the readings (m,) [-]."""
    error: Real
    """Standard error that noise gives the distance at one force; the largest of many is a few of it (m,) [-]."""
    at_n: Real
    """Force at which it is (m,) [N]."""
    lost: Real
    """Area between the two ways over the area under the way up (m,) [-]."""
    force_n: Real
    """Forces of the two ways (k,) [N]."""
    up: Real
    """Readings on the way up (k, m)."""
    down: Real
    """Readings on the way down (k, m)."""


def hysteresis(force_n: Real, values: Real) -> Hysteresis:
    """Of one press: up to the largest force, and down again.

    Parameters
    ----------
    force_n : (n,) array
        Force over time [N].
    values : (n, m) array
        Readings beside it, R or X of every tone.

    Raises
    ------
    BadInput
        A press that does not go up and down again over a common range of forces.
    """
    top = int(np.argmax(force_n))
    low = max(force_n[: top + 1].min(initial=np.inf), force_n[top:].min(initial=np.inf))
    high = float(force_n[top])
    if not high > low or min(top, len(force_n) - 1 - top) < 2:
        raise BadInput(f"forces from {low:g} to {high:g} N on both ways; expected a press that goes up and down again")
    at = np.linspace(low, high, _FORCES)
    up = _way(force_n[: top + 1], values[: top + 1], at)
    down = _way(force_n[top:][::-1], values[top:][::-1], at)
    span = np.ptp(np.vstack([up, down]), axis=0)
    span = np.where(span > 0, span, np.nan)
    apart = np.abs(down - up)
    inner = (at >= low + _INNER * (high - low)) & (at <= high - _INNER * (high - low))
    where = np.argmax(np.where(inner[:, None], apart, -1.0), axis=0)
    columns = np.arange(values.shape[1])
    under = np.trapezoid(np.abs(up - up[0]), at, axis=0)
    lost = np.trapezoid(apart, at, axis=0) / np.where(under > 0, under, np.nan)
    error = np.hypot(
        _error(force_n[: top + 1], values[: top + 1], at, up), _error(force_n[top:], values[top:], at, down)
    )
    return Hysteresis(apart[where, columns] / span, error / span, at[where], lost, at, up, down)


def _error(force_n: Real, values: Real, at: Real, way: Real) -> Real:
    """Standard error of a way at one force: the scatter about it, over the root of how many readings a mean has."""
    through = np.column_stack([np.interp(force_n, at, column) for column in way.T])
    return np.asarray((values - through).std(axis=0) / np.sqrt(max(len(values) / len(at), 1)))


def _way(force_n: Real, values: Real, at: Real) -> Real:
    """Readings at given forces, straight between the means of those that are nearest to each."""
    step = (at[-1] - at[0]) / (len(at) - 1)
    _, places = np.unique(np.round((force_n - at[0]) / step), return_inverse=True)
    counts = np.bincount(places)
    forces, *means = (np.bincount(places, column) / counts for column in (force_n, *values.T))
    return np.column_stack([np.interp(at, forces, mean) for mean in means])


class Ways(NamedTuple):
    """Of all presses of a run."""

    ways: dict[float, Hysteresis]
    """By the begin of the press [s]; columns are R, then X, tone by tone."""
    left_out: tuple[str, ...]
    """Presses that do not go up and down again, in words."""


def of_presses(worked: Processed, threshold_n: float = THRESHOLD_N) -> Ways:
    """Hysteresis of every press of a run, its drift taken out.

    Parameters
    ----------
    worked : Processed
        A recording, worked up with the rig's log.
    threshold_n : float
        Force from which on the tip presses [N].

    Raises
    ------
    BadInput
        No press that goes up and down again.
    """
    one, valid = worked.recording, worked.recording.valid()
    time, force = one.time_s[valid], worked.force_n[valid]
    z = one.impedance_ohm[valid]
    clean = worked.drift.removed(time, z) if worked.drift else z
    values = np.hstack([clean.real, clean.imag])
    found: dict[float, Hysteresis] = {}
    left_out = []
    for press in pressed(time, force, threshold_n):
        during = (time >= press.start_s) & (time <= press.end_s)
        try:
            found[press.start_s] = hysteresis(force[during], values[during])
        except BadInput as error:
            left_out.append(f"left out: press at {press.start_s:.6g} s: {error}")
    if not found:
        raise BadInput(left_out[0] if left_out else "nothing pressed")
    return Ways(found, tuple(left_out))
