"""Inversion: force and position behind readings, with all that a calibration leaves open.

The posterior over force and position is worked out on a grid as fine as the readings tell, for all readings together:
at each of its points the expected ratio and the covariance of readings about it are known beforehand.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import BadInput
from sensorgen.prediction.calibration.fitting import Data, Posterior, covariances, memory
from sensorgen.prediction.calibration.rest import STALE_S
from sensorgen.prediction.calibration.specimen import Presses, SpecimenModel, parts
from sensorgen.prediction.inverse.forward import FORCE_LIMIT_N
from sensorgen.prediction.inverse.prior import Prior
from sensorgen.prediction.inverse.verdict import chi2_limit

LEVEL = 0.9  # probability of the intervals
_COARSE = 20, 16  # forces and positions at which covariances are worked out
_MOST = 128, 96  # forces and positions of the grid
_LEAST = 40, 32
_BLOCK = 128  # readings at a time
_FEW_TONES = 2


class Verdict(IntEnum):
    """The verdict on a reading, the worst that applies."""

    OK = 0
    FORCE_ONLY = 1
    """The position's interval is most of the sensor."""
    AT_THE_END = 2
    """The force's interval ends at the largest force that was looked for."""
    NOT_CALIBRATED = 3
    """The interval is what the prediction alone allows."""
    STALE_REST = 4
    """The reading at rest is too old."""
    NO_FIT = 5
    """No press explains the reading."""
    MISSING = 6
    """Too little was measured."""

    @property
    def words(self) -> str:
        """As files and people read it."""
        return _WORDS[self]


_WORDS = ("ok", "force only", "at the end", "not calibrated", "stale rest", "no fit", "missing")


@dataclass(frozen=True, eq=False)
class Found:
    """Presses behind readings.

    Attributes
    ----------
    force_n, position_m : (n,) array
        Medians [N], [m]; nan where nothing was found.
    force_90_n, position_90_m : (n, 2) array
        5 % and 95 % quantiles, or those of the inverter's level [N], [m].
    chi2 : (n,) array
        Least squared distance of the reading from what a press makes, over its covariance [-].
    tones : (n,) array
        Number of frequencies that count.
    verdict : (n,) array
        Numbers of :class:`Verdict`.
    """

    force_n: Real
    position_m: Real
    force_90_n: Real
    position_90_m: Real
    chi2: Real
    tones: NDArray[np.intp]
    verdict: NDArray[np.uint8]


class _Table(NamedTuple):
    """Whitening of a set of tones at every point of the grid, and the mean there, whitened."""

    root: NDArray[np.float32]
    """(points * k, k), of k parts of the reading."""
    mean: NDArray[np.float32]
    """(points, k)."""
    ln_density: Real
    """(points,), without the distance."""


class Inverter:
    """Force and position of one specimen, prepared once.

    Parameters
    ----------
    model : SpecimenModel
        Of the specimen.
    posterior : Posterior
        Of its calibration.
    prior : Prior, optional
        On force and position; even if not given.
    force_limit_n : float
        Largest force to look for [N].
    level : float
        Probability of the intervals [-].

    Attributes
    ----------
    force_n, position_m : (f,), (x,) array
        The grid [N], [m].
    level : float
        Probability of the intervals that further readings get [-].
    """

    def __init__(
        self, model: SpecimenModel, posterior: Posterior, prior: Prior | None = None,
        force_limit_n: float = FORCE_LIMIT_N, level: float = LEVEL,
    ) -> None:  # fmt: skip
        self.level = level
        self._posterior, self._length = posterior, model.sensor.length_m
        coarse = np.linspace(0, 1, _COARSE[0]) ** 2 * force_limit_n, np.linspace(0, self._length, _COARSE[1])
        mean, covariance = readings(model, posterior, *coarse)
        self.force_n, self.position_m = _grid(coarse, mean, covariance)
        self._means, self._covariances = (
            _refined(coarse, (self.force_n, self.position_m), v) for v in (mean, covariance)
        )
        self._mean = parts(model.ratio(posterior.at, _of(posterior, *_pairs(self.force_n, self.position_m))))
        self._weight = np.log(_steps(self.force_n)[:, None] * _steps(self.position_m)).ravel()
        for axis, normal in enumerate(() if prior is None else (prior.force_n, prior.position_m)):
            if normal is not None:
                at = _pairs(self.force_n, self.position_m)[axis]
                self._weight = self._weight - ((at - normal[0]) / normal[1]) ** 2 / 2
        self._tables: dict[bytes, _Table] = {}

    def batch(self, ratio: Complex, rest_age_s: Real | None = None) -> Found:
        """Presses behind readings.

        Parameters
        ----------
        ratio : (n, m) array
            Ln of the reading over the latest reading at rest; nan where a tone was not measured.
        rest_age_s : (n,) array, optional
            Age of that reading at rest [s].

        Raises
        ------
        BadInput
            Another number of tones than the calibration has.
        """
        m = self._mean.shape[1] // 2
        if ratio.ndim != 2 or ratio.shape[1] != m:
            raise BadInput(f"readings of shape {ratio.shape}; expected (n, {m}), a column for each calibrated tone")
        measured = np.isfinite(ratio)
        found = nothing(len(ratio))
        for pattern in np.unique(measured, axis=0):
            rows = np.flatnonzero((measured == pattern).all(axis=1))
            if pattern.sum() >= _FEW_TONES:
                self._put(found, rows, ratio, pattern)
        bad = np.flatnonzero(found.chi2 > chi2_limit(2 * found.tones - 2))
        if bad.size:
            self._without_one(found, bad, ratio, measured)
        stale = np.zeros(len(ratio), bool) if rest_age_s is None else ~(rest_age_s <= STALE_S)
        return self._judged(found, stale)

    def _put(self, found: Found, rows: NDArray[np.intp], ratio: Complex, tones: Mask) -> None:
        table = self._table(tones)

        def block(some: NDArray[np.intp]) -> None:
            values = self._block(parts(ratio[some][:, tones]), table)
            for name, value in zip(
                ("force_n", "position_m", "force_90_n", "position_90_m", "chi2"), values, strict=True
            ):
                getattr(found, name)[some] = value
            found.tones[some] = tones.sum()

        blocks = [rows[start : start + _BLOCK] for start in range(0, len(rows), _BLOCK)]
        if len(blocks) == 1:
            block(rows)
            return
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(block, blocks))

    def _without_one(self, found: Found, rows: NDArray[np.intp], ratio: Complex, measured: Mask) -> None:
        """Of readings that no press explains, leave out the tone whose absence explains the most."""
        best = nothing(len(rows))
        for tone in range(ratio.shape[1]):
            left = measured[rows].copy()
            left[:, tone] = False
            trial = nothing(len(rows))
            for pattern in np.unique(left, axis=0):
                if pattern.sum() >= max(_FEW_TONES, ratio.shape[1] // 2):
                    self._put(trial, np.flatnonzero((left == pattern).all(axis=1)), ratio[rows], pattern)
            better = (trial.chi2 <= chi2_limit(2 * trial.tones - 2)) & ~(best.chi2 <= trial.chi2)
            for name, value in vars(trial).items():
                getattr(best, name)[better] = value[better]
        good = np.isfinite(best.chi2)
        for name, value in vars(best).items():
            getattr(found, name)[rows[good]] = value[good]

    def _block(self, reading: Real, table: _Table) -> tuple[Real, ...]:
        k = reading.shape[1]
        white = (table.root @ reading.T.astype(np.float32)).reshape(-1, k, len(reading))
        white -= table.mean[:, :, None]
        np.square(white, out=white)
        chi2 = white.sum(1, dtype=np.float64)
        least = chi2.min(0)
        ln = table.ln_density[:, None] - chi2 / 2
        ln -= ln.max(0)
        density = np.exp(ln).reshape(len(self.force_n), len(self.position_m), -1)
        force, position = density.sum(1), density.sum(0)
        ends = [_quantiles(grid, d, self.level) for grid, d in ((self.force_n, force), (self.position_m, position))]
        return ends[0][:, 1], ends[1][:, 1], ends[0][:, ::2], ends[1][:, ::2], least

    def _table(self, tones: Mask) -> _Table:
        key = tones.tobytes()
        if key not in self._tables:
            kept = np.flatnonzero(np.tile(tones, 2))
            covariance = self._covariances[:, kept[:, None], kept]
            root = np.linalg.inv(np.linalg.cholesky(covariance))
            ln = np.log(np.diagonal(root, axis1=1, axis2=2)).sum(1) + self._weight
            mean = np.einsum("gij,gj->gi", root, self._mean[:, kept])
            self._tables[key] = _Table(root.reshape(-1, len(kept)).astype(np.float32), mean.astype(np.float32), ln)
        return self._tables[key]

    def _judged(self, found: Found, stale: Mask) -> Found:
        wide = np.ptp(found.position_90_m, axis=1) > 0.8 * self._length
        rules = (
            (Verdict.FORCE_ONLY, wide),
            (Verdict.AT_THE_END, found.force_90_n[:, 1] > self.force_n[-2]),
            (Verdict.NOT_CALIBRATED, np.full(len(wide), self._posterior.presses == 0)),
            (Verdict.STALE_REST, stale),
            (Verdict.NO_FIT, found.chi2 > chi2_limit(2 * found.tones - 2)),
            (Verdict.MISSING, found.tones < _FEW_TONES),
        )
        found.verdict[:] = Verdict.OK
        for verdict, applies in rules:
            found.verdict[applies] = verdict
        return found


def nothing(n: int) -> Found:
    """Results of readings in which nothing was found yet."""

    def nan(*shape: int) -> Real:
        return np.full(shape, np.nan)

    return Found(
        nan(n), nan(n), nan(n, 2), nan(n, 2), nan(n), np.zeros(n, np.intp), np.full(n, Verdict.MISSING, np.uint8)
    )


def _pairs(force_n: Real, position_m: Real) -> tuple[Real, Real]:
    force, position = np.meshgrid(force_n, position_m, indexing="ij")
    return force.ravel(), position.ravel()


def _of(posterior: Posterior, force_n: Real, position_m: Real) -> Presses:
    """Presses with the usual course."""
    unloading, decades = (np.full(len(force_n), mean) for mean, _ in (posterior.unloading, posterior.decades))
    return Presses(force_n, position_m, unloading, decades)


def readings(model: SpecimenModel, posterior: Posterior, force_n: Real, position_m: Real) -> tuple[Real, Real]:
    """Expected parts of ratios (points, 2 m), and their covariance with all that is open (points, 2 m, 2 m).

    Parameters
    ----------
    model, posterior
        Of the specimen.
    force_n, position_m : (f,), (x,) array
        Of a grid, whose points go along positions first [N], [m].
    """
    force, position = _pairs(force_n, position_m)
    presses = _of(posterior, force, position)
    slopes = model.slopes(posterior.at, presses)
    vectors = model.scatters(posterior.at, presses)
    noise = np.tile(posterior.noise, (len(force), 1))
    data = Data(presses, np.zeros_like(noise, complex), noise, np.zeros(noise.shape[1], complex), noise[0])
    components = posterior.components.copy()
    courses = (("hysteresis", posterior.unloading[1]), ("creep", posterior.decades[1]))
    unknown_course = [memory(model, posterior.at, name) * sd for name, sd in courses]
    components[0] = np.sqrt(components[0] ** 2 + np.sum(np.square(unknown_course)))
    own = covariances(model, posterior.at, data, components, vectors)
    shared = slopes @ posterior.covariance @ slopes.transpose(0, 2, 1)
    return parts(model.ratio(posterior.at, presses)), own + shared


def _grid(coarse: tuple[Real, Real], mean: Real, covariance: Real) -> tuple[Real, Real]:
    """Forces and positions, as far apart as a reading can tell them, within limits."""
    shape = len(coarse[0]), len(coarse[1])
    weight = np.linalg.inv(covariance)
    found = []
    for axis, at in enumerate(coarse):
        slope = np.asarray(np.gradient(mean.reshape(*shape, -1), at, axis=axis)).reshape(len(mean), -1)
        per_step = np.sqrt(np.einsum("gi,gij,gj->g", slope, weight, slope)).reshape(shape).max(1 - axis)
        passed = np.concatenate([[0.0], np.cumsum((per_step[1:] + per_step[:-1]) / 2 * np.diff(at))])
        passed = passed / passed[-1] + np.linspace(0, 0.5, len(at))  # some everywhere
        steps = float(np.sum((per_step[1:] + per_step[:-1]) / 2 * np.diff(at)))
        count = int(np.clip(steps, _LEAST[axis], _MOST[axis]))
        found.append(np.interp(np.linspace(0, passed[-1], count), passed, at))
    return found[0], found[1]


def _refined(coarse: tuple[Real, Real], fine: tuple[Real, Real], values: Real) -> Real:
    """Values on another grid, straight in between: a mean of covariances is one."""
    shaped: Real = values.reshape(len(coarse[0]), len(coarse[1]), -1)
    for axis in (0, 1):
        k = np.clip(np.searchsorted(coarse[axis], fine[axis], side="right") - 1, 0, len(coarse[axis]) - 2)
        share = (fine[axis] - coarse[axis][k]) / (coarse[axis][k + 1] - coarse[axis][k])
        share = share.reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        shaped = np.take(shaped, k, axis) * (1 - share) + np.take(shaped, k + 1, axis) * share
    return np.asarray(shaped.reshape(len(fine[0]) * len(fine[1]), *values.shape[1:]))


def _steps(at: Real) -> Real:
    """Weight of each point of a grid: half of the way to either neighbour."""
    middles = np.concatenate([at[:1], (at[1:] + at[:-1]) / 2, at[-1:]])
    return np.diff(middles)


def _quantiles(grid: Real, density: Real, level: float) -> Real:
    """Ends of an interval and the median between them (n, 3), of probabilities of a grid's points (k, n)."""
    edges = np.concatenate([grid[:1], (grid[1:] + grid[:-1]) / 2, grid[-1:]])
    total = np.concatenate([np.zeros((1, density.shape[1])), np.cumsum(density, 0)])
    total /= total[-1]
    found = np.empty((density.shape[1], 3))
    for k, share in enumerate(((1 - level) / 2, 0.5, (1 + level) / 2)):
        at = np.clip((total < share).sum(0), 1, len(grid))
        low, high = total[at - 1, np.arange(len(found))], total[at, np.arange(len(found))]
        part = np.clip((share - low) / np.maximum(high - low, 1e-300), 0, 1)
        found[:, k] = edges[at - 1] + part * (edges[at] - edges[at - 1])
    return found
