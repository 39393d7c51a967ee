"""Least squares of presses on the unit square, many samples together."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sensorgen.core.arrays import Mask, Real
from sensorgen.prediction import inference
from sensorgen.prediction.inference import Index, LocalFit
from sensorgen.prediction.inverse.table import Local

LOOSE, TIGHT = 0.2, 0.01  # share of the residual that a step still removes when a sample is done (Bates and Watts 1981)
REACH = 0.1  # farthest that one step moves the position: beyond it the response is not linear
ROUNDING = 1e-14  # of ln Z: what no step can remove
_FLOOR = 1e-9  # least information on the square's edge: keeps a singular matrix solvable, far below any reading's own

Model = Callable[[Real], Local]


@dataclass(frozen=True)
class FitGoal:
    """Goal of a fit: responses with their weights, and a normal prior.

    Attributes
    ----------
    response, weight : (n, 2 n_tones) array
        Measured ln Z; 1/sigma, 0 where it is missing.
    expected, information : (2,), (2, 2) array
        The prior's mean, scaled, and the inverse of its covariance, 0 where it is uniform.
    """

    response: Real
    weight: Real
    expected: Real
    information: Real

    def rows(self, rows: Index) -> "FitGoal":
        """Some of the samples."""
        return FitGoal(self.response[rows], self.weight[rows], self.expected, self.information)

    def fit(self, press: Real, local: Local) -> LocalFit:
        """Fit of the responses by presses."""
        residual = (self.response - local.value) * self.weight
        return LocalFit.of(press, residual, local.slope * self.weight[:, None]).with_prior(
            self.expected, self.information
        )


@dataclass(frozen=True)
class _Presses(inference.LeastSquares):
    """Responses to be explained by presses in the unit square, which no step leaves."""

    target: FitGoal
    model: Model
    offset: float
    damping = 1e-3

    def fit(self, at: Real, rows: Index) -> LocalFit:
        """Fit of some samples by presses."""
        return self.target.rows(rows).fit(at, self.model(at))

    def step(self, fit: LocalFit, damping: Real) -> Real:
        """Step to the least squares of the linear model; along an edge where it would leave the square."""
        (ff, fx), (_, xx) = fit.information.transpose(1, 2, 0)
        ff, xx = ff * (1 + damping) + _FLOOR, xx * (1 + damping) + _FLOOR
        by_force, by_position = fit.gradient.T
        determinant = ff * xx - fx * fx
        force = (xx * by_force - fx * by_position) / determinant
        position = (ff * by_position - fx * by_force) / determinant
        at_force, at_position = fit.at.T
        inside = _inside(at_position, np.minimum(np.maximum(position, -REACH), REACH))
        force = np.where(inside == position, force, (by_force - fx * inside) / ff)
        within = _inside(at_force, force)
        inside = np.where(within == force, inside, (by_position - fx * within) / xx)
        return np.stack([within, _inside(at_position, inside)], 1)

    def done(self, fit: LocalFit, step: Real, gain: Real, rows: Index) -> Mask:  # noqa: ARG002
        """Samples within the accuracy asked for; one far below noise goes on to the end."""
        rounding = ROUNDING**2 * np.einsum("nk,nk->n", self.target.weight[rows], self.target.weight[rows])
        return np.asarray(gain <= self.offset**2 * fit.chi2 * np.minimum(fit.chi2, 1.0) + rounding)


def descend(target: FitGoal, model: Model, start: Real, offset: float) -> LocalFit:
    """Least squares from a start in the unit square.

    Parameters
    ----------
    target : FitGoal
        Responses and prior.
    model : callable
        Response and derivatives at scaled presses.
    start : (n, 2) array
        Scaled presses [-].
    offset : float
        Share of the residual at which a sample is done, below noise the residual's share of that [-].
    """
    return inference.descend(_Presses(target, model, offset), start)


def _inside(at: Real, step: Real) -> Real:
    """The step, or as much of it as stays on the unit length."""
    return np.minimum(np.maximum(step, -at), 1.0 - at)
