"""Principal component of ln Z over frequencies, and exponential response to a force."""

from collections.abc import Callable

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.samples import Complex, Real

_GRID_S = 0.02
_NOISELESS = 1e-9  # of the spread: noise below it counts as none


def principal_component(impedance_ohm: Complex) -> Real:
    """First principal component of ln Z in units of its noise, without linear trend.

    Parameters
    ----------
    impedance_ohm : (n, m) array
        Valid readings [ohm].

    Returns
    -------
    (n,) array
        Component over time [-].

    Raises
    ------
    BadInput
        Readings without any change.
    """
    channels = np.hstack([np.log(np.abs(impedance_ohm)), np.unwrap(np.angle(impedance_ohm), axis=0)])
    noise = np.median(np.abs(np.diff(channels, axis=0)), axis=0)
    spread = np.ptp(channels, axis=0)
    changing = spread > 0
    if not changing.any():
        raise BadInput("the readings do not change: they show no presses")
    channels = channels[:, changing] / np.where(noise > _NOISELESS * spread, noise, spread)[changing]
    t = np.linspace(-1, 1, len(channels))
    basis = np.column_stack([np.ones_like(t), t])
    channels = channels - basis @ np.linalg.lstsq(basis, channels, rcond=None)[0]
    directions = np.linalg.svd(channels.T @ channels)[2]
    return np.asarray(channels @ directions[0])


def relaxation(time_s: Real, force_n: Real, tau_s: float) -> Callable[[Real], Real]:
    r"""Response of one relaxation time to a force, :math:`\int F(s) e^{-(t - s)/\tau} ds / \tau`.

    Parameters
    ----------
    time_s, force_n : (n,) array
        Time, rising [s], and force [N]; linear in between, and where the force is nan.
    tau_s : float
        Time constant [s].

    Returns
    -------
    callable
        From times [s] to the response [N].
    """
    from scipy.signal import lfilter

    known = np.isfinite(force_n)
    if not known.any():
        return np.zeros_like
    grid = np.arange(time_s[0], time_s[-1] + _GRID_S, _GRID_S)
    kept = np.exp(-_GRID_S / tau_s)
    response = lfilter([(1 - kept) / 2] * 2, [1, -kept], np.interp(grid, time_s[known], force_n[known]))
    return lambda at_s: np.interp(at_s, grid, response)
