"""The direction in which readings of several tones move together, and what a film makes of a force."""

from collections.abc import Callable

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.samples import Complex, Real

_GRID_S = 0.02
_NOISELESS = 1e-9  # of the spread: below it, noise is none


def strongest(impedance_ohm: Complex) -> Real:
    """The direction in which ln Z moves most, in units of its noise, without its straight trend.

    Parameters
    ----------
    impedance_ohm : (n, m) array
        Readings that count [ohm].

    Raises
    ------
    BadInput
        Readings that are all the same.
    """
    channels = np.hstack([np.log(np.abs(impedance_ohm)), np.unwrap(np.angle(impedance_ohm), axis=0)])
    noise = np.median(np.abs(np.diff(channels, axis=0)), axis=0)
    spread = np.ptp(channels, axis=0)
    told = spread > 0
    if not told.any():
        raise BadInput("the readings are all the same: nothing in them tells of presses")
    channels = channels[:, told] / np.where(noise > _NOISELESS * spread, noise, spread)[told]
    t = np.linspace(-1, 1, len(channels))
    basis = np.column_stack([np.ones_like(t), t])
    channels = channels - basis @ np.linalg.lstsq(basis, channels, rcond=None)[0]
    directions = np.linalg.svd(channels.T @ channels)[2]
    return np.asarray(channels @ directions[0])


def slowly(time_s: Real, force_n: Real, tau_s: float) -> Callable[[Real], Real]:
    r"""A force as a film with one time constant answers to it, :math:`\int F(s) e^{-(t - s)/\tau} ds / \tau`.

    Parameters
    ----------
    time_s, force_n : (n,) array
        What pressed when, rising [s], [N]; between, and where nobody knows, straight lines.
    tau_s : float
        The time constant [s].

    Returns
    -------
    callable
        From any times [s] to the answer [N].
    """
    from scipy.signal import lfilter

    known = np.isfinite(force_n)
    if not known.any():
        return np.zeros_like
    grid = np.arange(time_s[0], time_s[-1] + _GRID_S, _GRID_S)
    kept = np.exp(-_GRID_S / tau_s)
    answer = lfilter([(1 - kept) / 2] * 2, [1, -kept], np.interp(grid, time_s[known], force_n[known]))
    return lambda at_s: np.interp(at_s, grid, answer)
