"""Inversion: force and position behind readings, with all that a calibration leaves open.

The posterior over force and position is worked out on a grid as fine as the readings tell, for all readings together:
at each of its points the expected ratio and the covariance of readings about it are known beforehand.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import BadInput
from sensorgen.prediction.calibration.fitting import Posterior, by_rest, readings, usual_presses
from sensorgen.prediction.calibration.rest import LOADS_N, STALE_S, Rest, load_probabilities
from sensorgen.prediction.calibration.specimen import Bench, SpecimenModel, spread_of
from sensorgen.prediction.inference import NORMAL_90, Index, cramer_rao, parts, whitening
from sensorgen.prediction.inverse.estimator import Prior
from sensorgen.prediction.inverse.forward import FORCE_LIMIT_N, pairs
from sensorgen.prediction.inverse.verdict import PressAnswers, Worded, chi2_limit
from sensorgen.prediction.sensor_model import SensorModel

LEVEL = 0.9  # probability of the intervals
_COARSE = 20, 16  # forces and positions at which covariances are worked out
_MOST = 128, 96  # forces and positions of the grid
_LEAST = 40, 32
_BLOCK = 128  # readings at a time
_PARTS = 3  # of a cell of the grid, over which the density falls
_COARSEST = 4.0  # change of ln of the density over a cell from which on it counts as even there
_FEW_TONES = 2
OTHERWISE = 0.1  # probability, until a recheck, that something else than the press makes a part of the reading: a guess
_LOADED = 0.2  # probability, before any reading, that something lay on the sensor at rest: a guess
_CONFINED = 0.2  # probability, before any reading, that a session's presses are all on a part of the sensor: a guess
_STRETCHES = np.array([  # such parts, start and end over the length: places share errors, so that none is shorter
    (0.0, 1.0), *((start, start + of) for of in (0.1, 0.2, 0.4, 0.6, 0.8) for start in np.arange(0, 1.01 - of, 0.05)),
])  # fmt: skip
_APART = 0.02  # share of a session's presses that are anywhere, whatever the others are on: a guess
_INDEPENDENT = 100.0  # readings at most that tell of a stretch: samples of one press, and one calibration, err alike
_RARE = 0.005  # probability of a load at rest below which it is left out
_BELOW = 0.3  # share of what lies outside an interval that is below it, where that something is allowed for
_MORE = 3.2905267314919255  # standard deviations that noise exceeds once in a thousand
_BELOW_REST = 4.0  # standard deviations that noise exceeds in three readings of 100 000
_DOUBTED = 200  # readings beside one below its rest, whose rest was probably read the same way
_UNLIKE = 0.2  # share of the squared distance that another capacitance, of unknown place and size, may leave
_PLACES = 7  # of a second press, along the sensor
WIDE = 0.8  # share of the sensor above which an interval does not tell the position
_LOCATES = 0.4  # share of the sensor below which an interval is expected to tell it


class Verdict(Worded):
    """The verdict on a reading, the worst that applies."""

    OK = 0, "ok"
    FORCE_ONLY = 1, "force only"
    """The position's interval is most of the sensor, which locates other presses of this force."""
    AT_THE_END = 2, "at the end"
    """The force's interval ends at the largest force that was looked for."""
    NOT_CALIBRATED = 3, "not calibrated"
    """The interval is what the prediction alone allows."""
    STALE_REST = 4, "stale rest"
    """The reading at rest is too old."""
    LOADED_REST = 5, "rest under load"
    """This reading, or one of ``_DOUBTED`` beside it, lies below its reading at rest: that was read under a load."""
    NO_FIT = 6, "no fit"
    """No press explains the reading."""
    MORE = 7, "more than one press"
    """Another capacitance besides one press explains it: a second press, or a hand."""
    CHANGED = 8, "changed since calibration"
    """At rest, the sensor is not the one that was calibrated."""
    MISSING = 9, "missing"
    """Too little was measured."""


@dataclass(frozen=True, eq=False)
class InvertedPresses(PressAnswers):
    """Presses behind readings.

    Attributes
    ----------
    force_n, position_m : (n,) array
        Medians [N], [m]; nan where nothing was found.
    force_90_n, position_90_m : (n, 2) array
        5 % and 95 % quantiles, or those of the inverter's level [N], [m].
    chi2 : (n,) array
        Least squared distance of the reading from what a press makes, over its covariance [-].
    more : (n,) array
        Deviation there towards another capacitance elsewhere, in standard deviations [-].
    below : (n,) array
        Capacitance by which the reading lies below its reading at rest, in standard deviations [-].
    stretches : (n, s) array
        Probability of the reading under presses on a stretch of the sensor, over that under presses anywhere [-].
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
    more: Real
    below: Real
    stretches: Real
    tones: Index
    verdict: NDArray[np.uint8]

    def statuses(self) -> list[str]:
        """Verdict on each reading, in words."""
        return Verdict.in_words(self.verdict)


class _Readings(NamedTuple):
    """Readings over those at rest, and loads that may have lain on the sensor at rest, the most probable one last.

    Attributes
    ----------
    parts : (n, 2 m) array
        Of ln of the ratio.
    on_stretch : (n, s) array
        Factor on the probability of places on each stretch of the sensor.
    chance : (k,) array
        Probability of each load.
    by_load : (k, 2 m) array
        Parts of ln Z at rest under it over that of the free sensor.
    """

    parts: Real
    on_stretch: Real
    chance: Real
    by_load: Real

    def rows(self, which: Index) -> "_Readings":
        """Some of the readings."""
        return self._replace(parts=self.parts[which], on_stretch=self.on_stretch[which])


class _Table(NamedTuple):
    """Whitening of a set of tones at every point of the grid, and the mean there, whitened.

    Attributes
    ----------
    root : (points * k, k) array
        Of k parts of the reading.
    mean : (points, k) array
        Whitened.
    ln_density : (points,) array
        Without the distance.
    more : (points, k) array
        Unit vectors, whitened, towards another capacitance elsewhere; nan where not computed yet.
    """

    root: NDArray[np.float32]
    mean: NDArray[np.float32]
    ln_density: Real
    more: Real


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
    otherwise : float
        Probability that the press makes a share of a reading alone [-]: the sensor is softer or the tip wider than in
        the calibration, or something else is there, and the frequencies do not separate these. The share is below s
        with the probability sqrt(s).
    session : bool
        A batch is of one session: all of its readings together tell whether something lay on the sensor at rest, and,
        for the force, on which part of the sensor all presses are. Readings that tell neither are as apart.

    Attributes
    ----------
    force_n, position_m : (f,), (x,) array
        The grid [N], [m].
    level : float
        Probability of the intervals that further readings get [-].
    """

    def __init__(
        self, model: SpecimenModel, posterior: Posterior, prior: Prior | None = None,
        force_limit_n: float = FORCE_LIMIT_N, otherwise: float = 0.0, session: bool = False,
    ) -> None:  # fmt: skip
        self.level, self._otherwise, self._session = LEVEL, otherwise, session
        self._posterior, self._length = posterior, model.sensor.length_m
        coarse = np.linspace(0, 1, _COARSE[0]) ** 2 * force_limit_n, np.linspace(0, self._length, _COARSE[1])
        mean, covariance = readings(model, posterior, *coarse)
        self._position_error_m = coarse[0], np.minimum(_position_errors(coarse, mean, covariance), self._length)
        self.force_n, self.position_m = _grid(coarse, mean, covariance)
        self._covariances = _refined(coarse, (self.force_n, self.position_m), covariance)
        self._mean = parts(model.ratio(posterior.at, usual_presses(posterior, *pairs(self.force_n, self.position_m))))
        self._weight = np.log(_steps(self.force_n)[:, None] * _steps(self.position_m)).ravel()
        for axis, normal in enumerate(() if prior is None else (prior.force_n, prior.position_m)):
            if normal is not None:
                at = pairs(self.force_n, self.position_m)[axis]
                self._weight = self._weight - ((at - normal[0]) / normal[1]) ** 2 / 2
        self._tables: dict[bytes, _Table] = {}
        self._tangents = _slopes((self.force_n, self.position_m), self._mean)
        self._elsewhere = _elsewhere(model, posterior, force_limit_n)
        at_rest = usual_presses(posterior, LOADS_N, np.full(len(LOADS_N), self._length / 2))
        fall = -model.scatters(posterior.at, at_rest.rows(LOADS_N == 0))[0, :, 1]
        weighted = np.linalg.solve(self._covariances[0], fall)
        self._fall = weighted / np.sqrt(fall @ weighted)
        by_load = parts(model.ratio(posterior.at, at_rest))
        self._by_load = by_load - by_load[0]
        self._stretches = (1 - _APART) * _stretches(_edges(self.position_m) / self._length) + _APART

    def batch(self, ratio: Complex, rest_age_s: Real | None = None, changed: Mask | None = None) -> InvertedPresses:
        """Presses behind readings.

        Parameters
        ----------
        ratio : (n, m) array
            Ln of the reading over the latest reading at rest; nan where a tone was not measured.
        rest_age_s : (n,) array, optional
            Age of that reading at rest [s].
        changed : (n,) array of bool, optional
            Where that reading is of another sensor than the calibrated one, see :class:`Rest`.

        Raises
        ------
        BadInput
            Another number of tones than the calibration has.
        """
        m = self._mean.shape[1] // 2
        if ratio.ndim != 2 or ratio.shape[1] != m:
            raise BadInput(f"readings of shape {ratio.shape}; expected (n, {m}), a column for each calibrated tone")
        measured = np.isfinite(ratio)
        ratio = np.where(measured, ratio, np.nan)
        below = parts(ratio) @ self._fall
        anywhere = np.eye(1, len(_STRETCHES)).repeat(len(ratio), 0)
        readings = _Readings(parts(ratio), anywhere, np.ones(1), self._by_load[:1])
        session = self._session and len(ratio) > 1
        if session:
            readings = self._with_rest(readings, below, rest_age_s)
        presses = self._inverted(readings, measured)
        if session:
            chance = _stretch_probabilities(presses)
            if chance[0] < (1 - _CONFINED) * (1 - 1e-9):  # else nothing is told
                factors = chance / presses.stretches
                presses = self._inverted(readings._replace(on_stretch=factors), measured)
        presses.below[:] = below
        stale = np.zeros(len(ratio), bool) if rest_age_s is None else ~(rest_age_s <= STALE_S)
        return self._judged(presses, stale, np.zeros(len(ratio), bool) if changed is None else changed)

    def _with_rest(self, readings: _Readings, below: Real, rest_age_s: Real | None) -> _Readings:
        """Readings with the loads at rest that those below it show, where that is one.

        Readings farther below, and loads that would put some there, are left to the verdict.
        """
        several = rest_age_s is not None and (np.diff(rest_age_s) < 0).any()
        if several or not (below > 0).any():
            return readings
        by_load = -self._by_load @ self._fall
        chance = load_probabilities(below[below < _BELOW_REST], by_load, _LOADED) * (by_load < _BELOW_REST)
        chance[0] = max(chance[0], 1e-300)
        chance /= chance.sum()
        if chance[0] >= 1 - _LOADED:
            return readings
        order = np.argsort(chance)[np.sort(chance) > _RARE]
        return readings._replace(chance=chance[order], by_load=self._by_load[order])

    def _inverted(self, readings: _Readings, measured: Mask) -> InvertedPresses:
        """Presses behind readings by their measured tones (n, m), without one of them where no press explains all."""
        presses = self._by_tones(readings, measured, _FEW_TONES)
        bad = np.flatnonzero(~_one_press(presses) & ~_more(presses))
        if bad.size:
            self._without_one(presses, bad, readings, measured)
        return presses

    def _by_tones(self, readings: _Readings, measured: Mask, fewest: int) -> InvertedPresses:
        """Presses behind readings of which at least so many tones were measured (n, m)."""
        presses = nothing(len(measured))
        for tones in np.unique(measured, axis=0):
            if tones.sum() >= fewest:
                self._put(presses, np.flatnonzero((measured == tones).all(axis=1)), readings, tones)
        return presses

    def _put(self, presses: InvertedPresses, rows: Index, readings: _Readings, tones: Mask) -> None:
        columns = np.flatnonzero(np.tile(tones, 2))
        table, blocks = self._table(tones, columns), np.split(rows, range(_BLOCK, len(rows), _BLOCK))
        with ThreadPoolExecutor(2) as pool:
            of_blocks = pool.map(lambda some: self._block(readings.rows(some), table, columns), blocks)
            for some, of_block in zip(blocks, of_blocks, strict=True):
                presses.put(some, replace(of_block, tones=np.full(len(some), tones.sum())))

    def _without_one(self, presses: InvertedPresses, rows: Index, readings: _Readings, measured: Mask) -> None:
        """Of readings that no press explains, leave out the tone whose absence explains the most."""
        best, bad = nothing(len(rows)), readings.rows(rows)
        for tone in range(measured.shape[1]):
            left = measured[rows]
            left[:, tone] = False
            trial = self._by_tones(bad, left, max(_FEW_TONES, measured.shape[1] // 2))
            better = (trial.chi2 <= chi2_limit(2 * trial.tones - 2)) & ~(best.chi2 <= trial.chi2)
            best.put(better, trial.rows(better))
        good = np.isfinite(best.chi2)
        presses.put(rows[good], best.rows(good))

    def _block(self, readings: _Readings, table: _Table, columns: Index) -> InvertedPresses:
        k, each = len(columns), np.arange(len(readings.parts))
        density = np.zeros((len(table.mean), len(each)))
        for chance, by_load in zip(readings.chance, readings.by_load, strict=True):
            ratio = (readings.parts + by_load)[:, columns]
            white = (table.root @ ratio.T.astype(np.float32)).reshape(-1, k, len(each))
            white -= table.mean[:, :, None]
            chi2 = np.square(white).sum(1, dtype=np.float64)
            ln = table.ln_density[:, None] - chi2 / 2
            under_load = np.exp(ln - ln.max(0))
            density += under_load * (chance / under_load.sum(0))
        best = chi2.argmin(0)  # by the most probable load
        if fresh := [int(point) for point in np.unique(best) if np.isnan(table.more[point, 0])]:
            table.more[fresh] = self._towards_more(table.root.reshape(-1, k, k)[fresh], fresh, columns)
        more = np.abs(np.einsum("nk,nk->n", table.more[best], white[best, :, each]))
        shaped = density.reshape(len(self.force_n), len(self.position_m), -1)
        by_place = shaped.sum(0)
        by_force = np.einsum("fxn,nx->fn", shaped, readings.on_stretch @ self._stretches)
        force, position = _finer(self.force_n, by_force), _finer(self.position_m, by_place)
        return replace(
            nothing(len(each)),
            force_n=_quantiles(*force, (0.5,))[:, 0], force_90_n=self._force_ends(*force),
            position_m=_quantiles(*position, (0.5,))[:, 0], position_90_m=_densest(*position, self.level),
            chi2=chi2[best, each], more=more, stretches=by_place.T @ self._stretches.T,
        )  # fmt: skip

    def _force_ends(self, edges: Real, force: Real) -> Real:
        """Ends of the interval of the force (n, 2), of probabilities (k, n) between borders (k + 1,)."""
        out = 1 - self.level
        if not self._otherwise:
            return _quantiles(edges, force, (out / 2, 1 - out / 2))
        low, high = np.sqrt(edges[:-1]), np.sqrt(np.maximum(edges[1:], 1e-9))
        share = np.clip((np.minimum(high[:, None], high) - low[:, None]) / high, 0.0, None)  # of forces below another
        mixed = (1 - self._otherwise) * force + self._otherwise * share @ force
        return _quantiles(edges, mixed, (_BELOW * out, 1 - (1 - _BELOW) * out))

    def _towards_more(self, root: NDArray[np.float32], points: Sequence[int], columns: Index) -> Real:
        """Unit vectors, whitened, in which another capacitance moves a reading the most, and no press (points, k)."""
        tangent = root @ self._tangents[points][:, columns]
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True) + 1e-300
        other = root @ self._elsewhere[columns]
        for _ in range(2):  # to rounding
            other = other - tangent @ (np.linalg.pinv(tangent) @ other)
        return np.asarray(np.linalg.svd(other, full_matrices=False)[0][:, :, 0])

    def _table(self, tones: Mask, columns: Index) -> _Table:
        key = tones.tobytes()
        if key not in self._tables:
            covariance = self._covariances[:, columns[:, None], columns]
            root = whitening(covariance)
            ln = np.log(np.diagonal(root, axis1=1, axis2=2)).sum(1) + self._weight
            mean = np.einsum("gij,gj->gi", root, self._mean[:, columns])
            self._tables[key] = _Table(
                root.reshape(-1, len(columns)).astype(np.float32),
                mean.astype(np.float32),
                ln,
                np.full(mean.shape, np.nan),
            )
        return self._tables[key]

    def _judged(self, presses: InvertedPresses, stale: Mask, changed: Mask) -> InvertedPresses:
        expected = 2 * NORMAL_90 * np.interp(presses.force_n, *self._position_error_m)
        wide = np.ptp(presses.position_90_m, axis=1) > WIDE * self._length
        rules = (
            (Verdict.FORCE_ONLY, wide & (expected < _LOCATES * self._length)),
            (Verdict.AT_THE_END, presses.force_90_n[:, 1] > self.force_n[-2]),
            (Verdict.NOT_CALIBRATED, np.full(len(wide), self._posterior.presses == 0)),
            (Verdict.STALE_REST, stale),
            (Verdict.NO_FIT, ~_one_press(presses)),
            (Verdict.MORE, _more(presses)),
            (Verdict.CHANGED, changed),
            (Verdict.MISSING, presses.tones < _FEW_TONES),
        )
        return replace(presses, verdict=Verdict.worst(len(wide), rules))


def _one_press(presses: InvertedPresses) -> Mask:
    """Readings that are not known to be of anything but one press."""
    return ~(presses.chi2 > chi2_limit(2 * presses.tones - 2))


def _more(presses: InvertedPresses) -> Mask:
    """Readings that another capacitance besides a press explains, and a press alone does not."""
    left = presses.chi2 - np.square(presses.more)
    return (presses.more > _MORE) & (left <= np.maximum(chi2_limit(2 * presses.tones - 3), _UNLIKE * presses.chi2))


def doubt_rest(presses: InvertedPresses, rest: Mask, left: int) -> int:
    """Mark readings below their reading at rest, and those near them, whose rest was read the same way.

    Parameters
    ----------
    presses : InvertedPresses
        Results in the order of time; their verdicts change.
    rest : (n,) array of bool
        Readings at rest.
    left : int
        Readings that those before these leave to be marked.

    Returns
    -------
    int
        Readings that are left to be marked after these.
    """
    count = np.cumsum(~rest)
    low = presses.below > _BELOW_REST
    last = np.maximum.accumulate(np.where(low, count, left - _DOUBTED))
    following = np.minimum.accumulate(np.where(low, count, count[-1:] + _DOUBTED)[::-1])[::-1]
    doubted = ~rest & ((count - last < _DOUBTED) | (following - count < _DOUBTED))
    presses.verdict[doubted] = np.maximum(presses.verdict[doubted], Verdict.LOADED_REST)
    return max(int(_DOUBTED - (count[-1] - last[-1])), 0) if len(count) else left


def of_design(
    predicted: SensorModel, frequency_hz: Real, rest: Rest, noise: Real | float,
    prior: Prior | None = None, force_limit_n: float = FORCE_LIMIT_N,
) -> Inverter:  # fmt: skip
    """Inverter of a specimen of which nothing is known but its design and readings at rest.

    Parameters
    ----------
    predicted : SensorModel
        Of the design.
    frequency_hz : (m,) array
        Frequencies [Hz].
    rest : Rest
        Readings with nothing on the sensor.
    noise : (m,) array or float
        Standard deviation of the parts of a ratio to their mean [-].
    prior, force_limit_n
        As of :class:`Inverter`.

    Raises
    ------
    BadInput
        A frequency without a reading at rest.
    """
    mean, count = rest.mean()
    if not np.isfinite(mean).all():
        raise BadInput("a frequency without a reading at rest; expected one at each")
    if len(frequency_hz) < _FEW_TONES:
        raise BadInput("readings at one frequency; expected two or more, or --perfect (perfect=True)")
    model = SpecimenModel(predicted.sensor, frequency_hz, spread_of(predicted, Bench()))
    known = by_rest(model, np.log(mean), noise / count**0.5, noise)
    return Inverter(model, known, prior, force_limit_n)


def nothing(n: int) -> InvertedPresses:
    """Results of readings in which nothing was found yet."""
    (force, place, *others), ends = np.full((5, n), np.nan), np.full((2, n, 2), np.nan)
    tones, verdict = np.zeros(n, np.intp), np.full(n, Verdict.MISSING, np.uint8)
    stretches = np.full((n, len(_STRETCHES)), np.nan)
    return InvertedPresses(force, place, ends[0], ends[1], others[0], others[1], others[2], stretches, tones, verdict)


def _stretches(edges: Real) -> Real:
    """Density of places on each stretch over that on all of the sensor (s, x), in cells between borders (x + 1,)."""
    start, end = _STRETCHES.T[:, :, None]
    within = np.maximum(np.minimum(edges[1:], end) - np.maximum(edges[:-1], start), 0.0)
    return np.asarray(within / (end - start) / np.diff(edges))


def _stretch_probabilities(presses: InvertedPresses) -> Real:
    """Probabilities that the presses of a session are on all of the sensor, and on each stretch (s,)."""
    fits = presses.chi2 <= chi2_limit(2 * presses.tones - 2)
    ln = np.log(presses.stretches[fits]).sum(0) * min(1.0, _INDEPENDENT / max(fits.sum(), 1))
    before = np.append(1 - _CONFINED, np.full(len(ln) - 1, _CONFINED / (len(ln) - 1)))
    chance = before * np.exp(ln - ln.max())
    return np.asarray(chance / chance.sum())


def _position_errors(coarse: tuple[Real, Real], mean: Real, covariance: Real) -> Real:
    """Standard error of the position at each force of a grid, the median over positions [m]."""
    _, error, _ = cramer_rao(*np.einsum("gij,gjk->kgi", whitening(covariance), _slopes(coarse, mean)))
    return np.asarray(np.median(np.nan_to_num(error, nan=np.inf).reshape(len(coarse[0]), -1), axis=1))


def _slopes(grid: tuple[Real, Real], mean: Real) -> Real:
    """Derivatives of a mean (points, k) by force and by position (points, k, 2)."""
    shaped = mean.reshape(len(grid[0]), len(grid[1]), -1)
    slopes = np.stack([np.gradient(shaped, at, axis=axis) for axis, at in enumerate(grid)], -1)
    return slopes.reshape(*mean.shape, 2)


def _grid(coarse: tuple[Real, Real], mean: Real, covariance: Real) -> tuple[Real, Real]:
    """Forces and positions, as far apart as a reading can tell them, within limits."""
    slopes, axes = _slopes(coarse, mean), []
    information = np.einsum("gik,gij,gjk->kg", slopes, np.linalg.inv(covariance), slopes)
    for axis, at in enumerate(coarse):
        per_step = np.sqrt(information[axis]).reshape(len(coarse[0]), -1).max(1 - axis)
        passed = np.concatenate([[0.0], np.cumsum((per_step[1:] + per_step[:-1]) / 2 * np.diff(at))])
        passed = passed / passed[-1] + np.linspace(0, 0.5, len(at))  # some everywhere
        steps = float(np.sum((per_step[1:] + per_step[:-1]) / 2 * np.diff(at)))
        count = int(np.clip(steps, _LEAST[axis], _MOST[axis]))
        axes.append(np.interp(np.linspace(0, passed[-1], count), passed, at))
    return axes[0], axes[1]


def _refined(coarse: tuple[Real, Real], fine: tuple[Real, Real], values: Real) -> Real:
    """Values on another grid, straight in between: a mean of covariances is one."""
    from scipy.interpolate import RegularGridInterpolator

    shaped = values.reshape(len(coarse[0]), len(coarse[1]), *values.shape[1:])
    return np.asarray(RegularGridInterpolator(coarse, shaped)(np.stack(pairs(*fine), -1)))


def _elsewhere(model: SpecimenModel, posterior: Posterior, force_n: float) -> Real:
    """Parts that a hand at the contacts, and presses along the sensor, add to a reading (2 m, 1 + places)."""
    places = np.linspace(0, model.sensor.length_m, _PLACES)
    presses = model.ratio(posterior.at, usual_presses(posterior, np.full(_PLACES, force_n / 4), places))
    omega = 2 * np.pi * model.frequency_hz
    by_hand = -1j * omega * np.exp(model.rest(posterior.at)) * model.spread.stray_f
    return parts(np.concatenate([by_hand[None], presses])).T


def _edges(at: Real) -> Real:
    """Borders of the cells of a grid's points, half of the way to either neighbour."""
    return np.concatenate([at[:1], (at[1:] + at[:-1]) / 2, at[-1:]])


def _steps(at: Real) -> Real:
    """Weight of each point of a grid."""
    return np.diff(_edges(at))


def _finer(grid: Real, probability: Real) -> tuple[Real, Real]:
    """Borders of parts of the cells of a grid (r k + 1,), and their probabilities (r k, n), of its points' (k, n).

    Ln of the density is a parabola about each point. Were the density even over a cell, which is about as wide as what
    a reading tells, it would be wider than it is by the cell's own: intervals of 90 % held 92 %.
    """
    ln = np.log(np.maximum(probability, 1e-300) / _steps(grid)[:, None])
    middle = np.clip(np.arange(len(grid)), 1, len(grid) - 2)
    left, right = np.diff(grid)[middle - 1, None], np.diff(grid)[middle, None]
    fall, rise = (ln[middle] - ln[middle - 1]) / left, (ln[middle + 1] - ln[middle]) / right
    bend = (rise - fall) / (left + right)
    edges = _edges(grid)
    at = edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(_PARTS) + 0.5) / _PARTS
    away = (at - grid[middle, None])[:, :, None]
    parabola = away * ((fall * right + rise * left) / (left + right))[:, None] + away**2 * bend[:, None]
    parabola += (ln[middle] - ln)[:, None]  # less than the point's own
    even = abs(bend) * np.maximum(left, right) ** 2 > _COARSEST  # the grid is too coarse to tell a shape
    density = np.where(even[:, None], 0.0, np.minimum(parabola, _COARSEST))
    share = probability[:, None] * np.exp(density)
    parts = edges[:-1, None] + np.diff(edges)[:, None] * np.arange(_PARTS) / _PARTS
    return np.append(parts, edges[-1]), share.reshape(-1, share.shape[2])


def _densest(edges: Real, probability: Real, level: float) -> Real:
    """Ends of the most probable cells (n, 2), of their borders (k + 1,) and probabilities (k, n): an end may be one.

    Between quantiles no reading of little information would have a press near an end.
    """
    share = probability / probability.sum(0)
    order = np.argsort(-share / np.maximum(np.diff(edges), 1e-300)[:, None], axis=0)
    ranked = np.take_along_axis(share, order, 0)
    before = np.cumsum(ranked, 0) - ranked
    inside, n = before < level, np.arange(share.shape[1])
    last = inside.sum(0) - 1
    inside[last, n] = False
    rest = np.where(last, (level - before[last, n]) / np.maximum(ranked[last, n], 1e-300), 1.0)  # of the last cell
    start, end = edges[order[last, n]], edges[order[last, n] + 1]
    low, high = np.where(inside, edges[:-1][order], np.inf).min(0), np.where(inside, edges[1:][order], -np.inf).max(0)
    return np.stack([np.minimum(low, end - rest * (end - start)), np.maximum(high, start + rest * (end - start))], 1)


def _quantiles(edges: Real, density: Real, shares: Sequence[float]) -> Real:
    """Quantiles (n, q) of probabilities (k, n) of cells between borders (k + 1,)."""
    total = np.concatenate([np.zeros((1, density.shape[1])), np.cumsum(density, 0)])
    total /= total[-1]
    quantiles = np.empty((density.shape[1], len(shares)))
    for k, share in enumerate(shares):
        at = np.clip((total < share).sum(0), 1, len(edges) - 1)
        low, high = total[at - 1, np.arange(len(quantiles))], total[at, np.arange(len(quantiles))]
        part = np.clip((share - low) / np.maximum(high - low, 1e-300), 0, 1)
        quantiles[:, k] = edges[at - 1] + part * (edges[at] - edges[at - 1])
    return quantiles
