"""Two presses on an array: the distance from which their places differ by more than their errors."""

from itertools import product

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.units import M_PER_MM
from sensorgen.prediction.array.model import ArrayModel

PRESS_N, PRESS_MM = 6.0, 10.0  # force of a press, and side of the square that it is on
APART = 3.0  # standard errors
_PHASES = (0.0, 0.125, 0.25, 0.375, 0.5)  # of a pitch, off the middle of a crossing
_PER_PITCH, _MOST = 8, 6  # distances to a pitch, and pitches
_STEP = 1e-3  # of a pitch


def pressures(model: ArrayModel, presses: Real) -> Real:
    """Mean pressure on the square of each crossing by presses of force [N], x and y [mm] in rows, (m, n) [Pa]."""
    found = np.zeros(model.here.shape)
    for force_n, x, y in presses:
        of = [
            np.clip(np.minimum(np.array(at) + pitch / 2, to + PRESS_MM / 2)
                    - np.maximum(np.array(at) - pitch / 2, to - PRESS_MM / 2), 0.0, None) / PRESS_MM
            for at, pitch, to in zip((model.layout.y_mm, model.layout.x_mm), model.layout.params.pitch[::-1], (y, x),
                                     strict=True)
        ]  # fmt: skip
        found += force_n / model.pitch_area_m2 * np.outer(*of)
    return found


def distance_mm(model: ArrayModel, information: Real) -> float:
    """Distance from which two equal presses are seen as two, wherever they lie; infinite if none of six pitches does.

    Presses of unknown force and place, along rows and along columns: the difference of their places is above
    ``APART`` standard errors, by the Cramer-Rao bound with priors of a press's own force and of the array's size.

    Parameters
    ----------
    information : (k, k) or (k,) array
        On the pressures on the surface [1/Pa2].
    """
    from scipy.sparse import diags_array

    matrix = diags_array(information) if information.ndim == 1 else information
    step = max(model.layout.params.pitch) / _PER_PITCH
    most = _PER_PITCH * max(1, min(_MOST, min(model.here.any(1).sum(), model.here.any(0).sum()) - 2))
    for k in range(most, 0, -1):
        ways = product((0, 1), _PHASES, _PHASES)
        if not all(_are_apart(model, matrix, k * step, *way) for way in ways):
            return (k + 1) * step if k < most else float("inf")
    return step


def _are_apart(model: ArrayModel, information: Real, distance: float, axis: int, dx: float, dy: float) -> bool:
    """Two presses along x or y, around the middle crossing and off it by a share of the pitch."""
    of, pitch = model.layout, model.layout.params.pitch
    crossings = np.argwhere(model.here)
    i, j = crossings[np.abs(crossings - crossings.mean(0)).sum(1).argmin()]
    middle = np.array([of.x_mm[j] + dx * pitch[0], of.y_mm[i] + dy * pitch[1]])
    half = np.eye(2)[axis] * distance / 2
    presses = np.array([[PRESS_N, *(middle - half)], [PRESS_N, *(middle + half)]])
    steps = np.diag([_STEP * PRESS_N, *(_STEP * np.array(pitch))] * 2).reshape(6, 2, 3)
    rises = [pressures(model, presses + step) - pressures(model, presses - step) for step in steps]
    slopes = np.stack([rise.ravel() / (2 * step.max()) for rise, step in zip(rises, steps, strict=True)], 1)
    prior = [PRESS_N, *(side / 12**0.5 for side in of.size_mm)] * 2
    spread = np.linalg.inv(slopes.T @ (information @ slopes) + np.diag(np.array(prior) ** -2.0))
    one, other = 1 + axis, 4 + axis
    return bool(APART**2 * (spread[one, one] + spread[other, other] - 2 * spread[one, other]) < distance**2)


def count(model: ArrayModel, distance: float) -> int:
    """Number of presses so far apart on the sensing area; 1 at least."""
    return max(1, int(model.here.sum() * model.pitch_area_m2 / (distance * M_PER_MM) ** 2))
