"""Interpolate differences of readings over force and position, and normalise them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sensorgen.core.errors import BadInput
from sensorgen.measure.recording.samples import Real

POINTS = 50


@dataclass(frozen=True, eq=False)
class Surface:
    """Values on a grid, linear between the presses (Delaunay triangulation).

    Attributes
    ----------
    force_n, position_mm : (k,) array
        Axes of the grid [N], [mm].
    values : (k, k, m) array
        By force, then position; nan outside the convex hull of the presses.
    """

    force_n: Real
    position_mm: Real
    values: Real


def surface(force_n: Real, position_mm: Real, values: Real, points: int = POINTS) -> Surface:
    """Interpolate scattered presses linearly.

    Parameters
    ----------
    force_n, position_mm : (p,) array
        Force and position of the presses [N], [mm].
    values : (p, m) array
        Readings, as differences of R or X at every frequency.
    points : int
        Grid points along each axis.

    Raises
    ------
    BadInput
        Fewer than three presses, or all of them on one line.
    """
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError

    where = np.column_stack([force_n, position_mm])
    if len(where) < 3:
        raise BadInput(f"{len(where)} presses; expected three or more for a surface")
    forces, positions = (np.linspace(axis.min(), axis.max(), points) for axis in where.T)
    try:
        through = LinearNDInterpolator(where, values, rescale=True)
    except QhullError:
        raise BadInput("all presses lie on one line over force and position: they span no surface") from None
    return Surface(forces, positions, np.asarray(through(*np.meshgrid(forces, positions, indexing="ij"))))


def normalised(sets: Sequence[Real], *, together: bool = False) -> list[Real]:
    """Scale the differences of several sets to 0 to 1, as in figure 6.33 of the thesis.

    Parameters
    ----------
    sets : sequence of (p, m) arrays
        Differences of R, or of X, of each set; a column per frequency.
    together : bool
        One scale for all sets, to compare sizes; else one for each set, to compare shapes.

    Returns
    -------
    list of (p, m) arrays
        0 is the least and 1 the largest of each column; nan where all values of a column are equal.

    Examples
    --------
    >>> [values.ravel().tolist() for values in normalised([np.array([[1.0], [3.0]]), np.array([[2.0], [5.0]])])]
    [[0.0, 1.0], [0.0, 1.0]]
    """
    scales = [_scale(np.vstack(list(sets)))] * len(sets) if together and sets else [_scale(values) for values in sets]
    return [np.asarray((values - low) / span) for values, (low, span) in zip(sets, scales, strict=True)]


def _scale(values: Real) -> tuple[Real, Real]:
    low, span = np.nanmin(values, axis=0), np.nanmax(values, axis=0) - np.nanmin(values, axis=0)
    return low, np.where(span > 0, span, np.nan)
