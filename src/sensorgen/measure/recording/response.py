"""Principal component of ln Z over frequencies, and exponential response to a force."""

from collections.abc import Callable

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.samples import Complex, Real

_GRID_S = 0.02
_MOST_GRID = 1 << 21  # 11.6 h
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
    t = np.linspace(-1, 1, len(impedance_ohm))
    basis = np.column_stack([np.ones_like(t), t])
    found: list[Real] = []
    for parts in ((np.log(np.abs(z)), np.unwrap(np.angle(z))) for z in impedance_ohm.T):  # one by one, to save memory
        for channel in parts:
            noise, spread = float(np.median(np.abs(np.diff(channel)))), float(np.ptp(channel))
            if spread > 0:
                channel = channel / (noise if noise > _NOISELESS * spread else spread)
                found.append(channel - basis @ np.linalg.lstsq(basis, channel, rcond=None)[0])
    if not found:
        raise BadInput("the readings do not change: they show no presses")
    directions = np.linalg.svd([[a @ b for b in found] for a in found])[2]
    component = np.zeros_like(t)
    for weight, channel in zip(directions[0], found, strict=True):
        component += weight * channel
    return component


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
    step = max(_GRID_S, float(time_s[-1] - time_s[0]) / _MOST_GRID)
    grid = np.arange(time_s[0], time_s[-1] + step, step)
    kept = np.exp(-step / tau_s)
    response = lfilter([(1 - kept) / 2] * 2, [1, -kept], np.interp(grid, time_s[known], force_n[known]))
    return lambda at_s: np.interp(at_s, grid, response)
