"""Inversion: force and position from impedance, prepared once per sensor, for batches and streams."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.inference import Index, LocalFit, Samples, parts
from sensorgen.prediction.inverse.descent import LOOSE, TIGHT, FitGoal, descend
from sensorgen.prediction.inverse.forward import FORCE_LIMIT_N, Forward
from sensorgen.prediction.inverse.prior import PressPosterior, Prior, posterior
from sensorgen.prediction.inverse.single import PressEstimate, Single
from sensorgen.prediction.inverse.table import Local, ResponseTable
from sensorgen.prediction.inverse.verdict import NORMAL_90, PAIR, Status, covariance, statuses

NOISE = 1e-3
_DIAGONAL = np.arange(2)
_BLOCK = 1 << 13  # samples at a time
_MOST_NOISE = 1.0
_RIVAL = 2 * PAIR**0.5  # distance of two presses up to which noise may exchange them [standard deviations]


@dataclass(frozen=True)
class Estimates(Samples):
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


class _Pair(NamedTuple):
    """The best presses of a block, and others that explain it as well: rows and scaled presses."""

    best: LocalFit
    rows: Index
    others: Real


class Estimator:
    """Weighted least squares over all frequencies, prepared for one sensor.

    The residual is ln Z measured less ln Z of the model; both parts of it have the standard deviation ``noise``.

    Parameters
    ----------
    sensor : Sensor
        The sensor.
    frequency_hz : (n_tones,) array
        Frequencies [Hz].
    noise : float or (n_tones,) array
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
    >>> found = estimator.one(sensor.impedance(np.array([1e3, 1e4, 1e5]), 3.0, 0.06))
    >>> round(found.force_n, 6), round(found.position_m * 1e3, 6), found.status.words
    (3.0, 60.0, 'ok')
    """

    def __init__(
        self,
        sensor: Sensor,
        frequency_hz: ArrayLike,
        noise: ArrayLike = NOISE,
        prior: Prior | None = None,
        force_limit_n: float = FORCE_LIMIT_N,
    ) -> None:
        self._forward = Forward(sensor, frequency_hz)
        self.frequency_hz, self.prior = self._forward.frequency_hz, prior
        self._sigma = _noise(noise, len(self.frequency_hz))
        self._table = ResponseTable(self._forward, self._forward.force_limit_n(force_limit_n))
        self.scale = self._table.scale
        rival, gap = self._table.rivals(self._sigma)
        self._rival = np.where(gap < _RIVAL, rival, -1)
        self._single = Single(self._forward, self._table, self._sigma, self._rival)
        self._expected, self._information = (prior or Prior()).scaled(self.scale)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why all estimates are uncertain."""
        if len(self.frequency_hz) > 1:
            return ()
        return ("one frequency gives two numbers for two unknowns: bad readings cannot be detected",)

    def one(self, impedance_ohm: ArrayLike) -> PressEstimate:
        """The press behind one reading (n_tones,) [ohm]; errors as :meth:`batch`.

        A complete reading that one press explains takes a shorter way to the same result.
        """
        z = self._readings(np.asarray(impedance_ohm)[None])
        if self.prior is None and (z != 0).all() and np.isfinite(z).all():
            plain = self._single.press(parts(np.log(z)))
            if plain is not None:
                return plain
        found = self._block(z)
        return PressEstimate(
            float(found.force_n[0]),
            float(found.position_m[0]),
            found.covariance[0],
            Status(int(found.status[0])),  # type: ignore[call-arg]
        )

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
        target = FitGoal(response, weight, self._expected, self._information)
        found = self._least_squares(target)
        own = covariance(found.best.information - self._information)
        tones = measured.sum(1)
        ambiguous = np.zeros(len(z), bool)
        ambiguous[found.rows] = True
        status = statuses(found.best, own[:, _DIAGONAL, _DIAGONAL], tones, ambiguous)
        return self._in_si(found, self._known(target, found.best), status, tones)

    def _known(self, target: FitGoal, fit: LocalFit) -> PressPosterior:
        """Means, covariances and intervals of scaled presses."""
        if self.prior is not None:
            return posterior(target, self._table, fit)
        spread = covariance(fit.information)
        reach = NORMAL_90 * np.sqrt(spread[:, _DIAGONAL, _DIAGONAL])
        return PressPosterior(fit.at, spread, fit.at - reach, fit.at + reach)

    def _least_squares(self, target: FitGoal) -> _Pair:
        table = self._table
        start = table.nearest(target.response, target.weight)
        best = descend(target, self._exact, descend(target, table.at, start, LOOSE).at, TIGHT)
        rival = self._rival[table.cell(best.at)]
        rows = np.flatnonzero(rival >= 0)
        if not rows.size:
            return _Pair(best, rows, np.empty((0, 2)))
        second = descend(target.rows(rows), table.at, table.middles[rival[rows]], LOOSE)
        close = np.flatnonzero(second.chi2 < best.chi2[rows] + 2 * PAIR)
        rows = rows[close]
        second = descend(target.rows(rows), self._exact, second.at[close], TIGHT)
        won = np.flatnonzero(second.chi2 < best.chi2[rows])
        first = best.rows(rows[won])
        best.put(rows[won], second.rows(won))
        second.put(won, first)
        return _within_noise(best, rows, second)

    def _exact(self, press: Real) -> Local:
        """The exact response; its derivatives from the table."""
        force, position = (press * self.scale).T
        exact = parts(self._forward.log_impedance(force, np.minimum(position, self.scale[1])))
        return Local(exact, self._table.at(press).slope)

    def _in_si(
        self, found: _Pair, known: PressPosterior, status: NDArray[np.uint8], tones: NDArray[np.intp]
    ) -> Estimates:
        empty = status == Status.MISSING
        others = np.full((len(tones), 2), np.nan)
        others[found.rows] = found.others
        mean, low, high = (
            np.where(empty[:, None], np.nan, a) * self.scale for a in (known.mean, known.low, known.high)
        )
        return Estimates(
            force_n=mean[:, 0],
            position_m=mean[:, 1],
            covariance=known.covariance * np.outer(self.scale, self.scale),
            force_90_n=np.stack([low[:, 0], high[:, 0]], -1),
            position_90_m=np.stack([low[:, 1], high[:, 1]], -1),
            status=status,
            chi2=found.best.chi2,
            tones=tones,
            other_force_n=others[:, 0] * self.scale[0],
            other_position_m=others[:, 1] * self.scale[1],
        )


def estimate(
    sensor: Sensor,
    frequency_hz: ArrayLike,
    impedance_ohm: ArrayLike,
    noise: ArrayLike = NOISE,
    prior: Prior | None = None,
) -> Estimates:
    """Presses behind readings (n, n_tones) [ohm]; parameters and errors as of :class:`Estimator`."""
    return Estimator(sensor, frequency_hz, noise, prior).batch(impedance_ohm)


def _within_noise(best: LocalFit, rows: Index, second: LocalFit) -> _Pair:
    """Those second presses that are presses of their own and explain the reading as well."""
    first = best.rows(rows)
    apart = second.at - first.at
    distance = np.einsum("ni,nij,nj->n", apart, first.information, apart)
    real = (second.chi2 < first.chi2 + PAIR) & (distance > PAIR)
    return _Pair(best, rows[real], second.at[real])


def _noise(noise: ArrayLike, n_tones: int) -> Real:
    """Standard deviations of the 2 n_tones parts."""
    try:
        sigma = np.broadcast_to(np.asarray(noise, np.float64), n_tones)
    except (TypeError, ValueError):
        raise BadInput(f"noise is one number, or one per frequency ({n_tones}), not {str(noise)[:60]!r}") from None
    bad = ~((sigma > 0) & (sigma <= _MOST_NOISE))
    if bad.any():
        raise OutOfRange(f"a noise of {sigma[bad][0]:g}; expected above 0 and up to 1, the share of the impedance")
    return np.tile(sigma, 2)
