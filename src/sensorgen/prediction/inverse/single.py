"""One reading at a time, at the rig's rate: the batch's least squares in plain numbers, where nothing is special."""

import math
from bisect import bisect_right
from typing import NamedTuple

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.prediction.inference import Index, parts
from sensorgen.prediction.inverse.descent import LOOSE, REACH, ROUNDING, TIGHT
from sensorgen.prediction.inverse.forward import Forward, Scalar
from sensorgen.prediction.inverse.table import ResponseTable
from sensorgen.prediction.inverse.verdict import PAIR, Status, chi2_limit

_ROUGH = 2  # steps on the table before the exact model is used
_STEPS = 6
_FIRST_ORDER = [2, 1]  # by force, by position; the others are the value and the mixed derivative
_SAME = PAIR / 2  # far below PAIR, the table being only near the truth
_GUESS = 1 / 12  # variance of a guess on the unit length


class PressEstimate(NamedTuple):
    """One estimate of a stream, as those of a batch [N], [m]."""

    force_n: float
    position_m: float
    covariance: Real
    status: Status


class _Normal(NamedTuple):
    """Normal equations of one step, and the sum of squares before it."""

    ff: float
    fx: float
    xx: float
    by_force: float
    by_position: float
    chi2: float

    def step(self, force: float, position: float) -> tuple[float, float]:
        """The undamped step; as the batch's, along an edge where it would leave the square."""
        determinant = self.ff * self.xx - self.fx * self.fx
        if not determinant > 0:
            return math.nan, math.nan
        by_force = (self.xx * self.by_force - self.fx * self.by_position) / determinant
        by_position = (self.ff * self.by_position - self.fx * self.by_force) / determinant
        inside = _inside(position, min(max(by_position, -REACH), REACH))
        if inside != by_position:
            by_force = (self.by_force - self.fx * inside) / self.ff
        within = _inside(force, by_force)
        if within != by_force:
            inside = _inside(position, (self.by_position - self.fx * within) / self.xx)
        return within, inside

    def gain(self, by_force: float, by_position: float) -> float:
        """Gain of the step in the sum of squares."""
        return by_force * self.by_force + by_position * self.by_position

    def distance(self, force: float, position: float) -> float:
        """Square of the distance of two presses, in units of noise."""
        return self.ff * force * force + 2 * self.fx * force * position + self.xx * position * position


class Single:
    """Undamped Gauss-Newton for a complete reading; all other cases are left to the batch.

    Parameters
    ----------
    forward : Forward
        The exact model.
    table : ResponseTable
        Its table.
    sigma : (2 n_tones,) array
        Standard deviations of ln Z.
    rival : (n_cells,) array
        For every cell, the cell whose presses may explain its readings as well, or -1.
    """

    def __init__(self, forward: Forward, table: ResponseTable, sigma: Real, rival: Index) -> None:
        self._model, self._table, self._weight, self._rival = Scalar(forward), table, 1 / sigma, rival.tolist()
        self._edges = [edges.tolist() for edges in table.edges]
        self._limit = float(chi2_limit(np.array([len(sigma) - 2]))[0])
        self._rounding = ROUNDING**2 * float(self._weight @ self._weight)
        self._scale = table.scale.tolist()

    def press(self, response: Real) -> PressEstimate | None:
        """The press behind ln Z (1, 2 n_tones); None where the batch has to look at it."""
        force, position = self._table.nearest(response, self._weight[None])[0].tolist()
        for _ in range(_ROUGH):
            by_force, by_position = self._normal(response[0], force, position).step(force, position)
            force, position = force + by_force, position + by_position
        for _ in range(_STEPS):
            normal = self._normal(response[0], force, position, exact=True)
            by_force, by_position = normal.step(force, position)
            force, position = force + by_force, position + by_position
            if not (0 < force < 1 and 0 < position < 1):
                return None
            if normal.gain(by_force, by_position) <= TIGHT**2 * normal.chi2 * min(normal.chi2, 1.0) + self._rounding:
                return self._answer(response[0], force, position, normal)
        return None

    def _normal(self, response: Real, force: float, position: float, exact: bool = False) -> _Normal:
        value, slope = self._table_at(force, position)
        if exact:
            value = parts(np.array(self._model.log_impedance(force * self._scale[0], position * self._scale[1])))
        slope *= self._weight
        residual = (response - value) * self._weight
        (ff, fx), (_, xx) = (slope @ slope.T).tolist()
        by_force, by_position = (slope @ residual).tolist()
        return _Normal(ff, fx, xx, by_force, by_position, float(residual @ residual))

    def _table_at(self, force: float, position: float) -> tuple[Real, Real]:
        """As :meth:`Table.at`, for one press."""
        cell, powers = self._cell(force, position), []
        k = divmod(cell, self._table.shape[1])
        for edges, at, i in zip(self._edges, (force, position), k, strict=True):
            width = edges[i + 1] - edges[i]
            t = (at - edges[i]) / width
            powers.append(np.array(((1.0, t, t * t, t * t * t), (0.0, 1 / width, 2 * t / width, 3 * t * t / width))))
        along = powers[0] @ self._table.coefficients[cell]
        both = (powers[1] @ along.reshape(2, 4, -1)).reshape(4, -1)
        return both[0], both[_FIRST_ORDER]

    def _cell(self, force: float, position: float) -> int:
        forces, positions = self._edges
        row = bisect_right(forces, force, 1, len(forces) - 1) - 1
        return row * self._table.shape[1] + bisect_right(positions, position, 1, len(positions) - 1) - 1

    def _alone(self, response: Real, press: tuple[float, float], best: _Normal) -> bool:
        """Test whether the rival's valley has no minimum near this sum of squares; False if undecided."""
        rival = self._rival[self._cell(*press)]
        if rival < 0:
            return True
        force, position = self._table.middles[rival].tolist()
        for _ in range(_STEPS):
            normal = self._normal(response, force, position)
            by_force, by_position = normal.step(force, position)
            force, position = force + by_force, position + by_position
            gain = normal.gain(by_force, by_position)
            if gain <= LOOSE**2 * normal.chi2:
                apart = best.distance(force - press[0], position - press[1])
                return normal.chi2 - gain > best.chi2 + 2 * PAIR or apart < _SAME
        return False

    def _answer(self, response: Real, force: float, position: float, normal: _Normal) -> PressEstimate | None:
        """The press in SI units, unless its verdict is not the plain one."""
        determinant = normal.ff * normal.xx - normal.fx**2
        variances = normal.xx / determinant, normal.ff / determinant
        if max(variances) > _GUESS or normal.chi2 > self._limit:
            return None
        if not self._alone(response, (force, position), normal):
            return None
        mixed = -normal.fx / determinant
        covariance = np.array([[variances[0], mixed], [mixed, variances[1]]]) * np.outer(self._scale, self._scale)
        return PressEstimate(force * self._scale[0], position * self._scale[1], covariance, Status.OK)


def _inside(at: float, step: float) -> float:
    """The step, or as much of it as stays on the unit length."""
    return min(max(step, -at), 1.0 - at)
