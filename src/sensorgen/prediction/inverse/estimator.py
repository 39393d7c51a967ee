"""Inversion: force and position from impedance, prepared once per sensor, for batches and streams.

Least squares of presses on the unit square, many samples together; with a prior, means and intervals by quadrature.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.inference import NORMAL_90, Index, LeastSquares, LocalFit, Samples, descend, parts
from sensorgen.prediction.inverse.forward import FORCE_LIMIT_N, Local, ResponseTable, bearable_n, log_impedance, tones
from sensorgen.prediction.inverse.verdict import PAIR, PressAnswers, Status, covariance, statuses

LOOSE, TIGHT = 0.2, 0.01  # share of the residual that a step still removes when a sample is done (Bates and Watts 1981)
REACH = 0.1  # farthest that one step moves the position: beyond it the response is not linear
ROUNDING = 1e-14  # of ln Z: what no step can remove
_FLOOR = 1e-9  # least information on the square's edge: keeps a singular matrix solvable, far below any reading's own


@dataclass(frozen=True)
class FitGoal(LeastSquares):
    """Responses to be explained by presses in the unit square, which no step leaves, with a normal prior.

    Attributes
    ----------
    response, weight : (n, 2 n_tones) array
        Measured ln Z; 1/sigma, 0 where it is missing.
    expected, prior : (2,), (2, 2) array
        The prior's mean, scaled, and the inverse of its covariance, 0 where it is uniform.
    model : callable
        Response and derivatives at scaled presses.
    offset : float
        Share of the residual at which a sample is done, below noise the residual's share of that [-].
    """

    response: Real
    weight: Real
    expected: Real
    prior: Real
    model: Callable[[Real], Local]
    offset: float
    damping = 1e-3

    def rows(self, rows: Index) -> "FitGoal":
        """Some of the samples."""
        return replace(self, response=self.response[rows], weight=self.weight[rows])

    def fit(self, at: Real, rows: Index) -> LocalFit:
        """Fit of some samples by presses."""
        local, weight = self.model(at), self.weight[rows]
        residual = (self.response[rows] - local.value) * weight
        return LocalFit.of(at, residual, local.slope * weight[:, None]).with_prior(self.expected, self.prior)

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
        rounding = ROUNDING**2 * np.einsum("nk,nk->n", self.weight[rows], self.weight[rows])
        return np.asarray(gain <= self.offset**2 * fit.chi2 * np.minimum(fit.chi2, 1.0) + rounding)


def _inside(at: Real, step: Real) -> Real:
    """The step, or as much of it as stays on the unit length."""
    return np.minimum(np.maximum(step, -at), 1.0 - at)


GUESS_INFORMATION = 12.0  # 1/variance of a uniform guess on a unit length
_POSITIONS, _FORCES = 32, 16
_REACH = 5.0  # standard errors to either side that the quadrature spans
_STEPS = 3
_QUADRATURES = 256  # samples at a time: each is evaluated at 512 presses

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


def posterior(goal: FitGoal, fit: LocalFit) -> PressPosterior:
    """Posterior means, covariances and 90 % intervals of scaled presses.

    Positions are spread over what the fit leaves open, at each of them forces over what that position leaves open: the
    density may be as curved or cut off as it likes, as long as it has one ridge of forces.

    Parameters
    ----------
    goal : FitGoal
        The responses, the prior, and the sensor.
    fit : LocalFit
        Its least squares.
    """
    n = len(fit.at)
    blocks = np.split(np.arange(n), range(_QUADRATURES, n, _QUADRATURES))
    return PressPosterior.joined([_posterior(goal.rows(rows), fit.rows(rows)) for rows in blocks])


def _posterior(goal: FitGoal, fit: LocalFit) -> PressPosterior:
    information = fit.information + np.eye(2) * GUESS_INFORMATION
    deviation = np.sqrt(np.linalg.inv(information)[:, 1, 1])
    x, dx = _spread(fit.at[:, 1], deviation, _POSITIONS)
    repeated = np.repeat(np.arange(len(x)), _POSITIONS)
    ridge, width = _ridge(goal, repeated, np.repeat(fit.at[:, 0], _POSITIONS), x.ravel())
    force, df = _spread(ridge, width, _FORCES)
    press = np.stack([force.ravel(), np.repeat(x.ravel(), _FORCES)], -1)
    chi2 = goal.fit(press, np.repeat(repeated, _FORCES)).chi2.reshape(len(x), -1)
    weight = np.exp((chi2.min(1, keepdims=True) - chi2) / 2) * np.repeat(df.reshape(x.shape), _FORCES, 1) * dx[:, None]
    return _moments(press.reshape(len(x), -1, 2), weight / weight.sum(1, keepdims=True))


def _spread(middle: Real, deviation: Real, count: int) -> tuple[Real, Real]:
    """Middles of equal steps over what is within reach and within the square, (n, count), and the steps (n,)."""
    low = np.clip(middle - _REACH * deviation, 0.0, 1.0)
    step = (np.clip(middle + _REACH * deviation, 0.0, 1.0) - low) / count
    return low[:, None] + step[:, None] * (np.arange(count) + 0.5), step


def _ridge(goal: FitGoal, rows: Index, force: Real, position: Real) -> tuple[Real, Real]:
    """The most probable force at each position, and its standard error."""
    for _ in range(_STEPS):
        fit = goal.fit(np.stack([force, position], -1), rows)
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


NOISE = 1e-3
_DIAGONAL = np.arange(2)
_BLOCK = 1 << 13  # samples at a time
_MOST_NOISE = 1.0
_RIVAL = 2 * PAIR**0.5  # distance of two presses up to which noise may exchange them [standard deviations]


@dataclass(frozen=True)
class Estimates(PressAnswers):
    """Estimated presses, sample by sample.

    Attributes
    ----------
    force_n, position_m : (n,) array
        Least squares, or the posterior mean where a prior is given [N], [m]; nan where nothing was measured.
    covariance : (n, 2, 2) array
        Of force and position [N2, N m, m2]; a variance is inf where the reading does not depend on its quantity.
    force_90_n, position_90_m : (n, 2) array
        Borders of the 90 % intervals [N], [m].
    status : (n,) array
        Numbers of :class:`Status`.
    chi2 : (n,) array
        Sum of squared residuals over their variances [-].
    tones : (n,) array
        Number of frequencies that were measured.
    other_force_n, other_position_m : (n,) array
        A second press that fits the reading as well [N], [m]; nan where there is none.
    """

    force_n: Real
    position_m: Real
    covariance: Real
    force_90_n: Real
    position_90_m: Real
    status: NDArray[np.uint8]
    chi2: Real
    tones: NDArray[np.intp]
    other_force_n: Real
    other_position_m: Real

    def statuses(self) -> list[str]:
        """Status of each reading, in words."""
        return Status.in_words(self.status)

    def identified(self, *, prior: bool = False) -> "Estimates":
        """Estimates that are nan where the readings do not identify a quantity, unless a prior was stated."""
        counts = self.status[:, None] <= np.array([Status.FORCE_ONLY, Status.AT_THE_END])  # force, position
        counts |= (prior & (self.status <= Status.NOT_IDENTIFIABLE))[:, None]
        force, position = np.where(counts, 1.0, np.nan).T[:, :, None]
        return replace(
            self, force_n=self.force_n * force[:, 0], position_m=self.position_m * position[:, 0],
            force_90_n=self.force_90_n * force, position_90_m=self.position_90_m * position,
        )  # fmt: skip


class Estimator:
    """Weighted least squares over all frequencies, prepared for one sensor.

    The residual is ln Z measured less ln Z of the model; both parts of it have the standard deviation ``noise``.

    Parameters
    ----------
    sensor : Sensor
        The sensor.
    frequency_hz : (n_tones,) array
        Frequencies [Hz].
    noise : float
        Standard deviation of the real and of the imaginary part of Z, each relative to its magnitude [-].
    prior : Prior, optional
        With it the answer is the posterior's mean and covariance.
    force_limit_n : float
        Largest force of the search, at most what the sensor bears [N].

    Raises
    ------
    BadInput, OutOfRange
        Frequencies or noise that are not above 0; noise as large as the signal.

    Examples
    --------
    >>> from sensorgen.models.compression import unconfined
    >>> sensor = Sensor(0.1, 0.01, (3e-4, 3e-4), (5.0, 5.0), 7.6e-10, unconfined(6e5))
    >>> estimator = Estimator(sensor, [1e3, 1e4, 1e5])
    >>> presses = estimator.batch(sensor.impedance(np.array([1e3, 1e4, 1e5]), 3.0, 0.06)[None])
    >>> presses.force_n.round(6).tolist(), presses.position_m.round(6).tolist(), presses.status.tolist()
    ([3.0], [0.06], [0])
    """

    def __init__(
        self,
        sensor: Sensor,
        frequency_hz: ArrayLike,
        noise: float = NOISE,
        prior: Prior | None = None,
        force_limit_n: float = FORCE_LIMIT_N,
    ) -> None:
        self._sensor, self.frequency_hz, self.prior = sensor, tones(frequency_hz), prior
        if not 0 < noise <= _MOST_NOISE:
            raise OutOfRange(f"a noise of {noise:g}; expected above 0 and up to 1, the share of the impedance")
        self._sigma = noise
        self._table = ResponseTable(sensor, self.frequency_hz, bearable_n(sensor, force_limit_n))
        self.scale = self._table.scale
        rival, gap = self._table.rivals(self._sigma)
        self._rival = np.where(gap < _RIVAL, rival, -1)
        self._expected, self._information = (prior or Prior()).scaled(self.scale)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why all estimates are uncertain."""
        if len(self.frequency_hz) > 1:
            return ()
        return ("one frequency gives two numbers for two unknowns: bad readings cannot be detected",)

    def batch(self, impedance_ohm: ArrayLike) -> Estimates:
        """The presses behind readings (n, n_tones) [ohm].

        A value that is NaN, infinite or exactly 0 was not measured; the others still count.

        Raises
        ------
        BadInput
            Another shape, or no numbers.
        """
        z = self._readings(impedance_ohm)
        if len(z) <= _BLOCK:
            return self._block(z)
        with ThreadPoolExecutor() as pool:
            blocks = list(pool.map(self._block, (z[start : start + _BLOCK] for start in range(0, len(z), _BLOCK))))
        return Estimates.joined(blocks)

    def _readings(self, impedance_ohm: ArrayLike) -> Complex:
        try:
            z = np.asarray(impedance_ohm, np.complex128)
        except (TypeError, ValueError):
            raise BadInput(f"readings are complex numbers in ohm, not {str(impedance_ohm)[:60]!r}") from None
        if z.ndim != 2 or z.shape[1] != len(self.frequency_hz):
            raise BadInput(
                f"expected readings of shape (n, {len(self.frequency_hz)}), one column per frequency; not {z.shape}"
            )
        return z

    def _block(self, z: Complex) -> Estimates:
        measured = np.isfinite(z) & (z != 0)
        response = parts(np.log(np.where(measured, z, 1.0)))
        weight = np.tile(measured, 2) / self._sigma
        goal = FitGoal(response, weight, self._expected, self._information, self._table.at, LOOSE)
        best, others = self._least_squares(goal)
        own = covariance(best.information - self._information)
        tones, known = measured.sum(1), self._known(goal, best)
        status = statuses(best, own[:, _DIAGONAL, _DIAGONAL], tones, np.isfinite(others[:, 0]))
        mean, low, high, other = (
            np.where(tones[:, None], of, np.nan) * self.scale for of in (known.mean, known.low, known.high, others)
        )
        force_90, position_90 = np.stack([low, high], -1).transpose(1, 0, 2)
        return Estimates(
            force_n=mean[:, 0], position_m=mean[:, 1], force_90_n=force_90, position_90_m=position_90, status=status,
            covariance=known.covariance * np.outer(self.scale, self.scale), chi2=best.chi2, tones=tones,
            other_force_n=other[:, 0], other_position_m=other[:, 1],
        )  # fmt: skip

    def _known(self, goal: FitGoal, fit: LocalFit) -> PressPosterior:
        """Means, covariances and intervals of scaled presses."""
        if self.prior is not None:
            return posterior(goal, fit)
        spread = covariance(fit.information)
        reach = NORMAL_90 * np.sqrt(spread[:, _DIAGONAL, _DIAGONAL])
        return PressPosterior(fit.at, spread, fit.at - reach, fit.at + reach)

    def _least_squares(self, goal: FitGoal) -> tuple[LocalFit, Real]:
        """The best presses, and others that explain the readings as well, scaled (n, 2); nan where there are none."""
        table, exact = self._table, replace(goal, model=self._exact, offset=TIGHT)
        best = descend(exact, descend(goal, table.nearest(goal.response, goal.weight)).at)
        others, rival = np.full_like(best.at, np.nan), self._rival[table.cell(best.at)]
        rows = np.flatnonzero(rival >= 0)
        if rows.size:
            second = descend(goal.rows(rows), table.middles[rival[rows]])
            close = np.flatnonzero(second.chi2 < best.chi2[rows] + 2 * PAIR)
            rows = rows[close]
            second = descend(exact.rows(rows), second.at[close])
            won = np.flatnonzero(second.chi2 < best.chi2[rows])
            first = best.rows(rows[won])
            best.put(rows[won], second.rows(won))
            second.put(won, first)
            as_well = _within_noise(best.rows(rows), second)
            others[rows[as_well]] = second.at[as_well]
        return best, others

    def _exact(self, press: Real) -> Local:
        """The exact response; its derivatives from the table."""
        force, position = (press * self.scale).T
        exact = parts(log_impedance(self._sensor, self.frequency_hz, force, np.minimum(position, self.scale[1])))
        return Local(exact, self._table.at(press).slope)


def _within_noise(first: LocalFit, second: LocalFit) -> Mask:
    """Second presses that are presses of their own and explain the reading as well."""
    apart = second.at - first.at
    distance = np.einsum("ni,nij,nj->n", apart, first.information, apart)
    return np.asarray((second.chi2 < first.chi2 + PAIR) & (distance > PAIR))
