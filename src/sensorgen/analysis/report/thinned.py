"""Fewer points to draw of a long recording, which look the same: the least and the most of every stretch."""

import numpy as np
from numpy.typing import NDArray

from sensorgen.measure.recording.samples import Real

MOST = 3000  # points of a curve: more than a screen is wide


def kept(values: Real, most: int = MOST) -> NDArray[np.intp]:
    """Which samples to draw.

    Parameters
    ----------
    values : (n,) array
        What is drawn over even time; nan where nothing is.
    most : int
        Points, about: each of ``most / 2`` stretches keeps its least and its largest value, in their order.

    Examples
    --------
    >>> kept(np.array([0.0, 5.0, 1.0, 1.0, -3.0, 1.0]), most=4).tolist()
    [0, 1, 3, 4]
    """
    if len(values) <= most:
        return np.arange(len(values))
    stretches = most // 2
    width = -(-len(values) // stretches)
    padded = np.full(stretches * width, np.nan)
    padded[: len(values)] = values
    rows = padded.reshape(stretches, width)
    starts = np.arange(stretches) * width
    low = np.argmin(np.where(np.isnan(rows), np.inf, rows), axis=1) + starts
    high = np.argmax(np.where(np.isnan(rows), -np.inf, rows), axis=1) + starts
    found = np.unique(np.concatenate([low, high]))
    return np.asarray(found[found < len(values)])
