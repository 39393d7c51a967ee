"""Weighted least squares on the unit square: Gauss-Newton, damped where it fails, for many samples together."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensorgen.prediction.inverse.forward import Real
from sensorgen.prediction.inverse.table import Local

LOOSE, TIGHT = 0.2, 0.01  # share of the residual that a step still removes when a sample is done (Bates and Watts 1981)
REACH = 0.1  # farthest that one step moves the position: beyond it the response is not linear
ROUNDING = 1e-14  # of ln Z: what no step can remove
_FLOOR = 1e-9  # least information on the square's edge: keeps a singular matrix solvable, far below any reading's own
_DAMPING = 1e-3  # first damping where a step failed
_STEPS = 30

Model = Callable[[Real], Local]
Index = NDArray[np.intp]


@dataclass
class Fit:
    """Least squares, sample by sample.

    Attributes
    ----------
    press : (n, 2) array
        Scaled force and position.
    chi2 : (n,) array
        Weighted sum of squares there, the prior's included.
    fisher : (n, 2, 2) array
        Information on the scaled press.
    gradient : (n, 2) array
        Half the descent of ``chi2``.
    """

    press: Real
    chi2: Real
    fisher: Real
    gradient: Real

    def rows(self, rows: Index) -> "Fit":
        """Some of the samples."""
        return Fit(*(value[rows] for value in vars(self).values()))

    def put(self, rows: Index, other: "Fit") -> None:
        """Take the other's samples at these rows."""
        for name, value in vars(self).items():
            value[rows] = getattr(other, name)


@dataclass(frozen=True)
class Target:
    """Goal of a fit: responses with their weights, and a normal prior.

    Attributes
    ----------
    response, weight : (n, 2 n_tones) array
        Measured ln Z; 1/sigma, 0 where it is missing.
    expected, information : (2,) array
        The prior's mean, scaled, and 1/variance, 0 where it is uniform.
    """

    response: Real
    weight: Real
    expected: Real
    information: Real

    def rows(self, rows: Index) -> "Target":
        """Some of the samples."""
        return Target(self.response[rows], self.weight[rows], self.expected, self.information)

    def fit(self, press: Real, local: Local) -> Fit:
        """Fit of the responses by presses."""
        residual = (self.response - local.value) * self.weight
        slope = local.slope * self.weight[:, None]
        off = self.expected - press
        chi2 = np.einsum("nk,nk->n", residual, residual) + (off * off) @ self.information
        fisher = slope @ slope.transpose(0, 2, 1)
        fisher[:, [0, 1], [0, 1]] += self.information
        gradient = (slope @ residual[:, :, None])[:, :, 0] + off * self.information
        return Fit(press, chi2, fisher, gradient)


def descend(target: Target, model: Model, start: Real, offset: float) -> Fit:
    """Least squares from a start in the unit square, which no step leaves.

    Parameters
    ----------
    target : Target
        What is to be explained.
    model : callable
        Response and derivatives at scaled presses.
    start : (n, 2) array
        Scaled presses [-].
    offset : float
        Share of the residual at which a sample is done, below noise the residual's share of that [-].
    """
    best = target.fit(start.copy(), model(start))
    damping, active = np.zeros(len(start)), np.arange(len(start))
    rounding = ROUNDING**2 * np.einsum("nk,nk->n", target.weight, target.weight)
    for _ in range(_STEPS):
        now = best.rows(active)
        step = _step(now, damping[active])
        gain = np.einsum("ni,ni->n", step, now.gradient)
        done_at = offset**2 * now.chi2 * np.minimum(now.chi2, 1.0)  # what is far below noise goes on to the end
        going = gain > done_at + rounding[active]
        done = active[~going]  # one last step, unchecked: its error is of second order
        best.press[done] += step[~going]
        best.chi2[done] = np.maximum(best.chi2[done] - gain[~going], 0.0)
        active, trial = active[going], (now.press + step)[going]
        if not active.size:
            break
        new = target.rows(active).fit(trial, model(trial))
        better = new.chi2 <= best.chi2[active]
        best.put(active[better], new.rows(np.flatnonzero(better)))
        eased = np.where(damping[active] > _DAMPING, damping[active] / 10, 0.0)
        damping[active] = np.where(better, eased, np.maximum(damping[active] * 10, _DAMPING))
    return best


def _step(fit: Fit, damping: Real) -> Real:
    """Step to the least squares of the linear model; along an edge where it would leave the square."""
    (ff, fx), (_, xx) = fit.fisher.transpose(1, 2, 0)
    ff, xx = ff * (1 + damping) + _FLOOR, xx * (1 + damping) + _FLOOR
    by_force, by_position = fit.gradient.T
    determinant = ff * xx - fx * fx
    force = (xx * by_force - fx * by_position) / determinant
    position = (ff * by_position - fx * by_force) / determinant
    at_force, at_position = fit.press.T
    inside = _inside(at_position, np.minimum(np.maximum(position, -REACH), REACH))
    force = np.where(inside == position, force, (by_force - fx * inside) / ff)
    within = _inside(at_force, force)
    inside = np.where(within == force, inside, (by_position - fx * within) / xx)
    found = np.empty_like(fit.press)
    found[:, 0], found[:, 1] = within, _inside(at_position, inside)
    return found


def _inside(at: Real, step: Real) -> Real:
    """The step, or as much of it as stays on the unit length."""
    return np.minimum(np.maximum(step, -at), 1.0 - at)
