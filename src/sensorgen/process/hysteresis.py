"""Hysteresis: how far a reading on the way down lies from the one on the way up, at the same force."""

from typing import NamedTuple

import numpy as np

from sensorgen.errors import BadInput
from sensorgen.recording.samples import Real

_FORCES = 41
_INNER = 0.1  # of the span at either end, where the two ways meet or the tip lifts off


class Hysteresis(NamedTuple):
    """Of one press, reading by reading (a column may be R or X at a tone)."""

    share: Real
    """Largest distance of the two ways, over the span of the readings (m,) [-]."""
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
    return Hysteresis(apart[where, columns] / span, at[where], lost, at, up, down)


def _way(force_n: Real, values: Real, at: Real) -> Real:
    """Readings at given forces, of equal forces their mean."""
    forces, places = np.unique(force_n, return_inverse=True)
    counts = np.bincount(places)
    means = [np.bincount(places, column) / counts for column in values.T]
    return np.column_stack([np.interp(at, forces, mean) for mean in means])
