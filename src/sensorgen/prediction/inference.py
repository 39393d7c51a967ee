"""Inference: parameters with normal priors, least squares with bounds, posteriors, and Cramer-Rao bounds.

The one engine behind a press (`inverse`, many samples of two parameters), a specimen (`calibration`), materials
(`fit`), coupons (`characterise`) and a design that was not printed yet (`identifiability`): each a forward model.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Mask, Real

NORMAL_90 = 1.6448536269514722  # normal deviate of 5 %
STEP = 1e-3  # of central differences [standard deviations]
_MOST_LN = 80.0  # of a parameter's logarithm: beyond, numbers overflow
_STEPS = 30
_STRONG = 1.0  # damping of a step that is less than half of the undamped one
PARALLEL = 1e-9  # sine of the angle between two directions below which they are one: slopes are right to 1e-11

Index = NDArray[np.intp]


@dataclass(frozen=True)
class Parameter:
    """Quantity with its prior: a normal distribution, of ln unless linear.

    Attributes
    ----------
    key : str
        Name.
    centre, spread : float
        Mean and standard deviation of ln of the value in SI units, or of the value.
    linear : bool
        Of the value itself.
    unit, shown : str, float
        Unit for people, and the factor to it.
    """

    key: str
    centre: float
    spread: float
    linear: bool = False
    unit: str = ""
    shown: float = 1.0

    def value(self, coordinate: Real) -> Real:
        """Value of a coordinate in which the prior is normal."""
        return coordinate if self.linear else np.asarray(np.exp(np.clip(coordinate, -_MOST_LN, _MOST_LN)))

    def at(self, deviations: Real) -> Real:
        """Value at so many standard deviations of the prior from its mean."""
        return self.value(self.centre + self.spread * deviations)


class Samples:
    """Record of arrays whose first axes count samples."""

    def rows(self, which: Index | Mask) -> Self:
        """Some of the samples."""
        return type(self)(*(column[which] for column in vars(self).values()))

    def put(self, which: Index | Mask, other: Self) -> None:
        """Take the other's samples at these rows."""
        for own, new in zip(vars(self).values(), vars(other).values(), strict=True):
            own[which] = new

    @classmethod
    def joined(cls, several: Sequence[Self]) -> Self:
        """Records one after the other."""
        return cls(*map(np.concatenate, zip(*(vars(one).values() for one in several), strict=True)))


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal distribution of p parameters.

    Attributes
    ----------
    at : (p,) array
        Mean.
    covariance : (p, p) array
        Of the parameters.
    """

    at: Real
    covariance: Real

    @property
    def information(self) -> Real:
        """Inverse of the covariance (p, p)."""
        return np.asarray(np.linalg.inv(self.covariance))

    def of(self, weights: Real) -> "Normal":
        """Distribution of linear combinations (k, p)."""
        return Normal(weights @ self.at, weights @ self.covariance @ weights.T)

    def part(self, which: Sequence[int]) -> "Normal":
        """Distribution of some of the parameters."""
        return Normal(self.at[which], self.covariance[np.ix_(which, which)])

    def beyond(self, before: "Normal") -> tuple[Real, Real]:
        """Information that readings alone gave (p, p), and its product with their estimate (p,)."""
        after = self.information
        return after - before.information, after @ self.at - before.information @ before.at

    def given(self, which: Sequence[int], part: "Normal") -> Self:
        """Distribution once some parameters are known otherwise; the others follow by their correlation."""
        own = self.part(which)
        by = self.covariance[:, which] @ own.information
        spread = self.covariance + by @ (part.covariance - own.covariance) @ by.T
        return replace(self, at=self.at + by @ (part.at - own.at), covariance=spread)


def standard(p: int) -> Normal:
    """Prior of parameters in its own standard deviations."""
    return Normal(np.zeros(p), np.eye(p))


def parts(value: Complex) -> Real:
    """Real parts, then imaginary parts, along the last axis."""
    return np.concatenate([value.real, value.imag], -1)


def whitening(covariance: Real) -> Real:
    """Matrices (..., k, k) that turn errors of these covariances into independent ones of standard deviation 1."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def slopes(function: Callable[[Real], Real], at: Real, which: Sequence[int] | slice = slice(None)) -> Real:
    """Derivatives by p parameters, or some of them (..., p): central differences of a function of points (2 p, p)."""
    step = np.eye(len(at))[which] * STEP
    more, less = np.split(function(np.concatenate([at + step, at - step])), 2)
    return np.moveaxis(more - less, 0, -1) / (2 * STEP)


@dataclass
class LocalFit(Samples):
    """Sum of squares near points, for n samples of p parameters.

    Attributes
    ----------
    at : (n, p) array
        The points.
    chi2 : (n,) array
        Sum of squares there, the prior's included.
    information : (n, p, p) array
        Gauss-Newton's.
    gradient : (n, p) array
        Half the descent of ``chi2``.
    """

    at: Real
    chi2: Real
    information: Real
    gradient: Real

    @classmethod
    def of(cls, at: Real, residual: Real, slope: Real) -> Self:
        """Fit by residuals (n, k) in standard deviations, and slopes (n, p, k) of what the parameters make of them."""
        chi2 = np.einsum("nk,nk->n", residual, residual)
        return cls(at, chi2, slope @ slope.transpose(0, 2, 1), (slope @ residual[:, :, None])[:, :, 0])

    def __add__(self, other: Self) -> Self:
        """Fit of both data, at the same points."""
        total = (getattr(self, name) + getattr(other, name) for name in ("chi2", "information", "gradient"))
        return type(self)(self.at, *total)

    def with_prior(self, mean: Real, information: Real) -> Self:
        """Fit with a normal prior of this information (p, p)."""
        off = mean - self.at
        pull = off @ information
        chi2 = self.chi2 + np.einsum("ni,ni->n", off, pull)
        return type(self)(self.at, chi2, self.information + information, self.gradient + pull)

    def step(self) -> Real:
        """Step to the least squares of the linear model (n, p)."""
        return _solved(self.information, self.gradient)

    def log_evidence(self) -> Real:
        """Ln of the integral of exp(-chi2/2) over the parameters, of the linear model (n,), less p/2 ln(2 pi)."""
        gain = np.einsum("ni,ni->n", self.step(), self.gradient)
        return np.asarray((gain - self.chi2 - np.linalg.slogdet(self.information)[1]) / 2)


def _solved(matrix: Real, right: Real) -> Real:
    """Solutions (n, p) of n systems of equations."""
    return np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0])


class LeastSquares(ABC):
    """Forward model with data, and rules of the descent."""

    reach = np.inf
    """Farthest that one step moves a parameter."""
    bound = np.inf
    """Largest magnitude of a parameter."""
    settled = STEP
    """Largest last step."""
    damping = 1.0
    """First damping where a step failed, relative to the information."""

    @abstractmethod
    def fit(self, at: Real, rows: Index) -> LocalFit:
        """Sum of squares of some samples at points."""

    def step(self, fit: LocalFit, damping: Real) -> Real:
        """Damped step within reach and bounds (n, p)."""
        information = fit.information * (1 + damping[:, None, None] * np.eye(fit.at.shape[1]))
        step = self._reachable(_solved(information, fit.gradient))
        within = np.clip(fit.at + step, -self.bound, self.bound) - fit.at
        ended = np.abs(fit.at + step) > self.bound
        if ended.any():  # those go to their bound, the others to the least squares along it
            left = fit.gradient - np.einsum("nij,nj->ni", information, np.where(ended, within, 0.0))
            free = ~(ended[:, :, None] | ended[:, None, :])
            reduced = np.where(free, information, np.eye(fit.at.shape[1]))
            step = self._reachable(_solved(reduced, np.where(ended, within, left)))
            within = np.clip(fit.at + step, -self.bound, self.bound) - fit.at
        return np.asarray(within)

    def _reachable(self, step: Real) -> Real:
        """Step shortened to the reach."""
        return np.asarray(step / np.maximum(1.0, np.abs(step).max(1, keepdims=True) / self.reach))

    def done(self, fit: LocalFit, step: Real, gain: Real, rows: Index) -> Mask:  # noqa: ARG002
        """Samples of which this is the last step, by it and by its gain in the sum of squares."""
        return np.asarray(np.abs(step).max(1) < self.settled)


def descend(problem: LeastSquares, start: Real) -> LocalFit:
    """Least squares by damped Gauss-Newton (Levenberg and Marquardt), many samples together.

    A step that is short because it is strongly damped is not the last.

    Parameters
    ----------
    problem : LeastSquares
        Model, data and rules.
    start : (n, p) array
        First points.

    Returns
    -------
    Fit
        The last step is unchecked, its error being of second order: information and gradient are those before it.
    """
    active = np.arange(len(start))
    best, damping = problem.fit(start.copy(), active), np.zeros(len(start))
    for _ in range(_STEPS):
        now = best.rows(active)
        step = problem.step(now, damping[active])
        gain = np.einsum("ni,ni->n", step, now.gradient)
        last = problem.done(now, step, gain, active) & (damping[active] <= _STRONG)
        done = active[last]
        best.at[done] += step[last]
        best.chi2[done] = np.maximum(best.chi2[done] - gain[last], 0.0)
        active, trial = active[~last], (now.at + step)[~last]
        if not active.size:
            break
        new = problem.fit(trial, active)
        better = new.chi2 <= best.chi2[active]
        best.put(active[better], new.rows(better))
        eased = np.where(damping[active] > problem.damping, damping[active] / 10, 0.0)
        damping[active] = np.where(better, eased, np.maximum(damping[active] * 10, problem.damping))
    return best


def cramer_rao(a: Real | Complex, b: Real | Complex, parallel: float = PARALLEL) -> tuple[Real, Real, Real]:
    r"""Least standard errors of any unbiased estimate of two parameters, both unknown, and their correlation.

    .. math:: \sigma_1 = 1/\lVert a - (a \cdot b / b \cdot b)\, b \rVert, \quad
              \sigma_2 = 1/\lVert b - (a \cdot b / a \cdot a)\, a \rVert

    The inverse of the Fisher matrix [a.a, a.b; a.b, b.b], by the rest of each slope so that no determinant cancels.

    Parameters
    ----------
    a, b : (..., k) array
        Slopes of readings with errors of standard deviation 1; of complex ones, in both parts.
    parallel : float
        Sine of the angle between two slopes below which they are one.

    Returns
    -------
    (...), (...), (...) array
        nan where undefined; if the readings do not depend on the second (b = 0), the first is 1/norm(a).
    """
    with np.errstate(all="ignore"):
        whole = [np.sqrt(dot(one, one)) for one in (a, b)]
        left = [np.sqrt(dot(rest, rest)) for rest in (orthogonal(a, b), orthogonal(b, a))]
        first, second = (np.where(r > parallel * w, 1 / r, np.nan) for r, w in zip(left, whole, strict=True))
        return first, second, np.where(np.isnan(second), np.nan, -dot(a, b) / (whole[0] * whole[1]))


def dot(a: Real | Complex, b: Real | Complex) -> Real:
    """Scalar product along the last axis, of both parts."""
    return np.asarray((a.conj() * b).real.sum(-1))


def orthogonal(a: Real | Complex, b: Real | Complex) -> Complex:
    """Component of a orthogonal to b; a itself where b is 0."""
    length = dot(b, b)
    return np.asarray(a - (dot(a, b) / np.where(length == 0, 1.0, length))[..., None] * b, np.complex128)
