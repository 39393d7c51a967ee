"""Prior of a press, and its posterior: means and intervals by quadrature."""

from dataclasses import dataclass

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import OutOfRange
from sensorgen.prediction.inference import LocalFit, Samples
from sensorgen.prediction.inverse.descent import FitGoal
from sensorgen.prediction.inverse.table import ResponseTable

GUESS_INFORMATION = 12.0  # 1/variance of a uniform guess on a unit length
_POSITIONS, _FORCES = 32, 16
_REACH = 5.0  # standard errors to either side that the quadrature spans
_STEPS = 3
_BLOCK = 256  # samples at a time: each is evaluated at 512 presses

Normal = tuple[float, float]


@dataclass(frozen=True)
class Prior:
    """A prior on a press: uniform on the sensor and up to the force limit, or normal within these.

    Attributes
    ----------
    force_n, position_m : (float, float) or None
        Mean and standard deviation [N], [m]; None is uniform.

    Examples
    --------
    >>> Prior(force_n=(3.0, 1.0)).position_m is None
    True
    """

    force_n: Normal | None = None
    position_m: Normal | None = None

    def __post_init__(self) -> None:
        """Refuse what is no distribution."""
        for name, normal in vars(self).items():
            if normal is not None and not (np.isfinite(normal).all() and normal[1] > 0):
                raise OutOfRange(f"prior on {name}: expected a mean and a standard deviation above 0, not {normal}")

    def scaled(self, scale: Real) -> tuple[Real, Real]:
        """Means (2,) and information (2, 2) on the unit square; 0 where it is uniform."""
        both = [normal or (0.0, np.inf) for normal in (self.force_n, self.position_m)]
        mean, deviation = np.array(both).T
        return mean / scale, np.diag((scale / deviation) ** 2)


@dataclass(frozen=True)
class PressPosterior(Samples):
    """Posterior of scaled presses; rows are samples."""

    mean: Real
    covariance: Real
    low: Real
    """(n, 2): 5 % of the probability lies below."""
    high: Real
    """(n, 2): 95 % lie below."""


def posterior(target: FitGoal, table: ResponseTable, fit: LocalFit) -> PressPosterior:
    """Posterior means, covariances and 90 % intervals of scaled presses.

    Positions are spread over what the fit leaves open, at each of them forces over what that position leaves open: the
    density may be as curved or cut off as it likes, as long as it has one ridge of forces.

    Parameters
    ----------
    target : FitGoal
        The responses, and the prior.
    table : ResponseTable
        The sensor.
    fit : LocalFit
        Its least squares.
    """
    n = len(fit.at)
    blocks = np.split(np.arange(n), range(_BLOCK, n, _BLOCK))
    return PressPosterior.joined([_posterior(target.rows(rows), table, fit.rows(rows)) for rows in blocks])


def _posterior(target: FitGoal, table: ResponseTable, fit: LocalFit) -> PressPosterior:
    information = fit.information + np.eye(2) * GUESS_INFORMATION
    deviation = np.sqrt(np.linalg.inv(information)[:, 1, 1])
    x, dx = _spread(fit.at[:, 1], deviation, _POSITIONS)
    repeated = np.repeat(np.arange(len(x)), _POSITIONS)
    ridge, width = _ridge(target.rows(repeated), table, np.repeat(fit.at[:, 0], _POSITIONS), x.ravel())
    force, df = _spread(ridge, width, _FORCES)
    every = np.repeat(repeated, _FORCES)
    press = np.stack([force.ravel(), np.repeat(x.ravel(), _FORCES)], -1)
    chi2 = target.rows(every).fit(press, table.at(press)).chi2.reshape(len(x), -1)
    weight = np.exp((chi2.min(1, keepdims=True) - chi2) / 2) * np.repeat(df.reshape(x.shape), _FORCES, 1) * dx[:, None]
    return _moments(press.reshape(len(x), -1, 2), weight / weight.sum(1, keepdims=True))


def _spread(middle: Real, deviation: Real, count: int) -> tuple[Real, Real]:
    """Middles of equal steps over what is within reach and within the square, (n, count), and the steps (n,)."""
    low = np.clip(middle - _REACH * deviation, 0.0, 1.0)
    step = (np.clip(middle + _REACH * deviation, 0.0, 1.0) - low) / count
    return low[:, None] + step[:, None] * (np.arange(count) + 0.5), step


def _ridge(target: FitGoal, table: ResponseTable, force: Real, position: Real) -> tuple[Real, Real]:
    """The most probable force at each position, and its standard error."""
    for _ in range(_STEPS):
        press = np.stack([force, position], -1)
        fit = target.fit(press, table.at(press))
        information = fit.information[:, 0, 0] + GUESS_INFORMATION
        force = np.clip(force + fit.gradient[:, 0] / information, 0.0, 1.0)
    return force, 1 / np.sqrt(information)


def _moments(press: Real, weight: Real) -> PressPosterior:
    mean = np.einsum("nk,nki->ni", weight, press)
    off = press - mean[:, None]
    covariance = np.einsum("nk,nki,nkj->nij", weight, off, off)
    low, high = (np.stack([_quantile(press[:, :, i], weight, p) for i in (0, 1)], -1) for p in (0.05, 0.95))
    return PressPosterior(mean, covariance, low, high)


def _quantile(value: Real, weight: Real, share: float) -> Real:
    """Value below which a share of the weight lies, each weight counted half on either side of its value."""
    order = np.argsort(value, 1)
    value, weight = np.take_along_axis(value, order, 1), np.take_along_axis(weight, order, 1)
    total = np.cumsum(weight, 1) - weight / 2
    return np.array([np.interp(share, t, v) for t, v in zip(total, value, strict=True)])
