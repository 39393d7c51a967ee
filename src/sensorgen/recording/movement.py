"""The direction in which readings of several tones move together."""

import numpy as np

from sensorgen.errors import BadInput
from sensorgen.recording.samples import Complex, Real

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
