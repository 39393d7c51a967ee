"""Posterior of the unknowns by readings of coupons, and the choice of coupons by it: D-optimal for the targets.

It is Gaussian in the logarithms of the unknowns, with coupons that may be dead. Each set of dead coupons is a model of
its own: its evidence (Laplace) weighs it, and the sum over sets is the result. A dead coupon's readings may be anything
within some decades.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, combinations_with_replacement, product
from math import log

import numpy as np

from sensorgen.analysis.characterise import LEVEL_SIGMA, Coupon, CouponSize, CouponTarget, Meters, nominal
from sensorgen.core.arrays import Mask, Real
from sensorgen.core.errors import OutOfRange
from sensorgen.prediction.inference import Index, LeastSquares, LocalFit, Normal, Parameter, descend, whitening

DEAD = 0.05  # of coupons, before anything is read
_DECADES = 6.0  # within which the reading of a dead coupon lies
_MOST_DEAD, _REFINED = 3, 4  # coupons at once; sets of dead ones that are solved, of those that are sketched
_STEP = 1e-4
_STILL = 1e-3  # in standard deviations: the last step


@dataclass(frozen=True)
class Observation:
    """Readings of a coupon.

    Attributes
    ----------
    coupon : Coupon
        What was read.
    sizes : tuple of CouponSize
        As measured, each with its standard deviation.
    log_values : (n,) array
        ln of the readings in SI units; nan where there is none.
    noise : (n,) array
        Their standard deviations.
    """

    coupon: Coupon
    sizes: tuple[CouponSize, ...]
    log_values: Real
    noise: Real

    @cached_property
    def read(self) -> Mask:
        """Mask of the readings that exist."""
        return np.isfinite(self.log_values)


def physical(unknowns: Sequence[Parameter], theta: Real) -> dict[str, Real]:
    """Values in SI units, by name, of coordinates in which the prior is normal; the last axis counts the unknowns."""
    return {u.key: u.value(theta[..., k]) for k, u in enumerate(unknowns)}


@dataclass(frozen=True)
class Linearisation:
    """A coupon's readings near a point: ln of the values, their Jacobian, and the covariance of their errors."""

    log_values: Real
    jacobian: Real
    covariance: Real


def linearised(
    coupon: Coupon, sizes: Sequence[CouponSize], noise: Real, unknowns: Sequence[Parameter], theta: Real
) -> Linearisation:  # fmt: skip
    """Expected readings, their derivatives by the unknowns, and the errors of meters and sizes together."""
    p, s = len(theta), len(sizes)
    steps = np.array([_STEP * u.spread for u in unknowns])
    points = np.tile(theta, (1 + p + s, 1))
    points[1 + np.arange(p), np.arange(p)] += steps
    around = {
        size.key: np.where(np.arange(1 + p + s) == 1 + p + k, size.drawn + 0.05 * size.spread, size.drawn)
        for k, size in enumerate(sizes)
    }
    with np.errstate(all="ignore"):
        ln = np.log(np.stack(coupon.expected(physical(unknowns, points), around), axis=-1))
    by_size = (ln[1 + p :] - ln[0]) / 0.05  # for one standard deviation each
    return Linearisation(ln[0], ((ln[1 : 1 + p] - ln[0]) / steps[:, None]).T, np.diag(noise**2) + by_size.T @ by_size)


@dataclass(frozen=True, eq=False)
class Mode(Normal):
    """Distribution of the unknowns given which coupons are dead.

    Attributes
    ----------
    dead : tuple of int
        Numbers of the observations.
    log_evidence : float
        ln of the probability of all readings and of this set.
    """

    dead: tuple[int, ...] = ()
    log_evidence: float = 0.0


@dataclass(frozen=True, eq=False)
class _Coupons(LeastSquares):
    """Observations and unknowns, and which coupons are dead."""

    observations: Sequence[Observation]
    unknowns: Sequence[Parameter]
    dead: tuple[int, ...] = ()
    damping = 1e-3

    @cached_property
    def before(self) -> Mode:
        """Unknowns before any reading."""
        return _before(self.unknowns)

    def fit(self, at: Real, rows: Index) -> LocalFit:  # noqa: ARG002
        """Minus twice ln of the density of all readings but those of the dead, at unknowns (1, p)."""
        alive = (o for k, o in enumerate(self.observations) if k not in self.dead)
        return self.together(at, (self.one(o, at) for o in alive))

    def together(self, at: Real, fits: Iterable[LocalFit]) -> LocalFit:
        """Fit of several coupons and of what was known before."""
        zero = LocalFit.of(at, np.zeros((1, 0)), np.zeros((1, at.shape[1], 0)))
        return sum(fits, zero).with_prior(self.before.at, self.before.information)

    def one(self, o: Observation, at: Real) -> LocalFit:
        """Fit of a coupon; infinite where its readings are undefined, as of a gap that is wider than its film."""
        line = linearised(o.coupon, o.sizes, o.noise, self.unknowns, at[0])
        residual, slope = (o.log_values - line.log_values)[o.read], line.jacobian[o.read]
        covariance = line.covariance[np.ix_(o.read, o.read)]
        if not all(np.isfinite(part).all() for part in (residual, covariance, slope)):
            nothing = np.zeros((1, at.shape[1]))
            return LocalFit(at, np.array([np.inf]), nothing[:, None] * nothing.T, nothing)
        root = whitening(covariance)
        fit = LocalFit.of(at, (root @ residual)[None], (root @ slope).T[None])
        fit.chi2 += len(residual) * log(2 * np.pi) - 2 * np.log(np.diag(root)).sum()
        return fit

    def done(self, fit: LocalFit, step: Real, gain: Real, rows: Index) -> Mask:  # noqa: ARG002
        """Small steps, in standard deviations."""
        return np.asarray(gain < _STILL**2)

    def peak(self, start: Real) -> Mode:
        """Most likely unknowns."""
        first, fresh = start[None], np.zeros(1, np.intp)
        first = first if np.isfinite(self.fit(first, fresh).chi2).all() else self.before.at[None]
        return self.mode(self.fit(descend(self, first).at, fresh))

    def mode(self, fit: LocalFit) -> Mode:
        """Distribution by a fit that is linear up to its peak, with its evidence by Laplace's approximation."""
        count = sum(int(self.observations[k].read.sum()) for k in self.dead)
        evidence = float(fit.log_evidence()[0]) - count * log(_DECADES * log(10.0))
        evidence += len(self.dead) * log(DEAD) + (len(self.observations) - len(self.dead)) * log(1 - DEAD)
        covariance = np.asarray(np.linalg.inv(fit.information[0]))
        return Mode((fit.at + fit.step())[0], covariance, self.dead, evidence)

    def one_more(self, mode: Mode) -> Iterator[Mode]:
        """Distributions with one more coupon dead, of readings that are linear about this one's peak."""
        at = mode.at[None]
        fits = {k: self.one(o, at) for k, o in enumerate(self.observations) if k not in mode.dead}
        for also in fits:
            dead = replace(self, dead=tuple(sorted((*mode.dead, also))))
            yield dead.mode(self.together(at, (fit for k, fit in fits.items() if k != also)))


@dataclass(frozen=True)
class Interval95:
    """Median and 95 % interval of a target."""

    value: float
    low: float
    high: float

    def half_width(self) -> float:
        """Half of the interval, relative to the value [-]."""
        return (self.high - self.low) / 2 / abs(self.value) if self.value else np.inf


@dataclass(frozen=True)
class CouponPosterior:
    """Unknowns after the readings.

    Attributes
    ----------
    unknowns : tuple of Parameter
        In the order of the modes' columns.
    modes : tuple of Mode
        Sets of dead coupons, the most likely first.
    weights : (m,) array
        Probability of each [-].
    names : tuple of str
        Of the observations.
    """

    unknowns: tuple[Parameter, ...]
    modes: tuple[Mode, ...]
    weights: Real
    names: tuple[str, ...]

    def dead(self) -> dict[str, float]:
        """Probability that a coupon is dead, of those where it exceeds one half [-]."""
        shares = {
            name: float(sum(w for w, mode in zip(self.weights, self.modes, strict=True) if k in mode.dead))
            for k, name in enumerate(self.names)
        }
        return {name: share for name, share in shares.items() if share > 0.5}

    def interval(self, target: CouponTarget) -> Interval95:
        """Median and 95 % interval of a target: quantiles of the sum of normal distributions."""
        means, sigmas = [], []
        for mode in self.modes:
            mean, by = gradient(self.unknowns, mode.at, 0.01 * np.sqrt(np.diag(mode.covariance)), target)
            means.append(mean)
            sigmas.append(float(np.sqrt(by @ mode.covariance @ by)))
        return _quantiles(np.array(means), np.array(sigmas), self.weights, linear=target.linear)


def gradient(unknowns: Sequence[Parameter], at: Real, steps: Real, target: CouponTarget) -> tuple[float, Real]:
    """A target, or its ln unless it is linear, and its derivatives by the unknowns (p,), by differences of steps."""
    values = target.value(physical(unknowns, np.vstack([at, at + np.diag(steps)])))
    values = values if target.linear else np.log(np.maximum(values, 1e-300))
    return float(values[0]), (values[1:] - values[0]) / steps


def _quantiles(means: Real, sigmas: Real, weights: Real, *, linear: bool) -> Interval95:
    from scipy.optimize import brentq
    from scipy.special import ndtr

    ends = []
    for level in (0.5, 0.025, 0.975):
        around = (means - 9 * sigmas).min(), (means + 9 * sigmas).max()
        at = brentq(lambda end, level=level: weights @ ndtr((end - means) / sigmas) - level, *around, xtol=1e-15)
        value = float(at if linear else np.exp(at))
        ends.append(0.0 if linear and abs(value) < 1e-9 * float(sigmas.max()) else value)
    return Interval95(*ends)


def _before(unknowns: Sequence[Parameter]) -> Mode:
    mean, spread = np.array([(u.centre, u.spread) for u in unknowns]).T
    return Mode(mean, np.diag(spread**2))


def prior(unknowns: Sequence[Parameter]) -> CouponPosterior:
    """The unknowns before any reading."""
    return CouponPosterior(tuple(unknowns), (_before(unknowns),), np.ones(1), ())


def posterior(observations: Sequence[Observation], unknowns: Sequence[Parameter]) -> CouponPosterior:
    """The unknowns after readings of coupons, of which up to three may be dead.

    Parameters
    ----------
    observations : sequence of Observation
        Those with at least one reading count.
    unknowns : sequence of Parameter
        With what was known before.
    """
    problem = _Coupons([o for o in observations if o.read.any()], unknowns)
    best = problem.peak(problem.before.at)
    modes = {best.dead: best}
    for _ in range(_MOST_DEAD):
        around = sorted(problem.one_more(best), key=lambda mode: -mode.log_evidence)[:_REFINED]
        modes |= {m.dead: replace(problem, dead=m.dead).peak(m.at) for m in around if m.dead not in modes}
        top = max(modes.values(), key=lambda mode: mode.log_evidence)
        if top is best:
            break
        best = top
    ranked = sorted(modes.values(), key=lambda mode: -mode.log_evidence)
    weights = np.exp([mode.log_evidence - best.log_evidence for mode in ranked])
    count = int((weights > 1e-6 * weights.sum()).sum())
    weights = weights[:count] / weights[:count].sum()
    return CouponPosterior(
        tuple(unknowns), tuple(ranked[:count]), weights, tuple(o.coupon.name for o in problem.observations)
    )


COPIES = 3  # of one coupon at most
MISSED = 10.0  # lambda, as much as five halved intervals are worth for a goal missed by a factor of two
RESERVE = 3.0  # a dead coupon may widen an interval beyond its goal by this factor; more costs a share of lambda
_SHARE = 0.4
_MOST_PAIRS = 10_000  # of exchanges of two coupons at once
_GAIN = 1e-9  # below which an exchange is rounding

Fits = Callable[[tuple[int, ...]], bool]


@dataclass(frozen=True, eq=False)
class Candidates:
    """Coupons of a catalogue with what each would say.

    Attributes
    ----------
    coupons : tuple of Coupon
        The catalogue.
    information : (n, p, p) array
        Fisher information of each on the unknowns, at their prior means.
    prior : (p, p) array
        Inverse of the prior covariance.
    wanted : (t, p) array
        Derivatives of the targets (of ln, where they have one) by the unknowns.
    counted : (t,) array
        Which of them are independent.
    goals : (t,) array
        Half of the 95 % interval; infinite where there is no goal [-].
    """

    coupons: tuple[Coupon, ...]
    information: Real
    prior: Real
    wanted: Real
    counted: Mask
    goals: Real

    def worth(self, chosen: Sequence[int]) -> float:
        """The criterion of a set of coupons, by their numbers: larger is better."""
        pieces = self.information[list(chosen)]
        whole = self.prior + pieces.sum(axis=0)
        covariance = np.linalg.inv(np.concatenate([whole[None], whole - pieces]))
        spread = self.wanted @ covariance @ self.wanted.T
        _, log_det = np.linalg.slogdet(spread[:, self.counted][:, :, self.counted])
        over = LEVEL_SIGMA * np.sqrt(np.diagonal(spread, axis1=1, axis2=2)) / self.goals
        missed = np.log(np.maximum(1.0, over[0])).sum() + _SHARE * np.log(np.maximum(1.0, over[1:] / RESERVE)).sum()
        return float(-(1 - DEAD * len(pieces)) * log_det[0] - DEAD * log_det[1:].sum() - MISSED * missed)

    def expected(self, chosen: Sequence[int], unknowns: Sequence[Parameter]) -> CouponPosterior:
        """Posterior that a set of coupons is expected to give, all of them sound."""
        covariance = np.linalg.inv(self.prior + self.information[list(chosen)].sum(axis=0))
        mean = np.array([u.centre for u in unknowns])
        return CouponPosterior(tuple(unknowns), (Mode(mean, covariance),), np.ones(1), ())


def candidates(
    coupons: Sequence[Coupon], unknowns: Sequence[Parameter], targets: Sequence[CouponTarget], meters: Meters
) -> Candidates:
    """Fisher information of every coupon of a catalogue."""
    theta, spread = np.array([(u.centre, u.spread) for u in unknowns]).T
    information = []
    for coupon in coupons:
        expected = coupon.expected(physical(unknowns, theta), {s.key: np.asarray(s.drawn) for s in coupon.sizes})
        noise = np.array([meters.noise(r, float(v)) for r, v in zip(coupon.readings, expected, strict=True)])
        line = linearised(coupon, nominal(coupon, meters), noise, unknowns, theta)
        white = whitening(line.covariance) @ line.jacobian
        information.append(white.T @ white)
    wanted = np.stack([gradient(unknowns, theta, 1e-4 * spread, target)[1] for target in targets])
    counted = np.array([not target.derived for target in targets])
    goals = np.array([target.goal or np.inf for target in targets])
    return Candidates(tuple(coupons), np.array(information), np.diag(spread**-2.0), wanted, counted, goals)


def select(candidates: Candidates, count: int, fits: Fits) -> tuple[int, ...]:
    r"""The best set of at most ``count`` coupons, by exchange from the best one that greed finds.

    Parameters
    ----------
    candidates : Candidates
        The catalogue.
    count : int
        Most coupons.
    fits : callable
        Whether plate and print time have room for a set.

    Raises
    ------
    OutOfRange
        There is no room for any coupon.

    Notes
    -----
    Coupons are added while there is room, each the best one; then one is exchanged for another, removed or added, or
    two are exchanged at once, as long as that is better (Fedorov's exchange). The optimum of such steps, not proved to
    be the largest: equal to the search through all sets on small catalogues.

    None or one of the coupons is dead, and each goal that is missed costs:

    .. math:: \max_S \; (1 - p n) \, D(S) + p \sum_{i \in S} D(S \setminus i)
              - \lambda \sum_t \left[\ln^+ \frac{w_t(S)}{g_t} + \beta \sum_{i \in S} \ln^+ \frac{w_t(S \setminus i)}
              {3 g_t}\right], \quad
              D(S) = -\ln \det \left( A \left(P^{-1} + \sum_{k \in S} M_k\right)^{-1} A^T \right)

    over multisets S of at most n coupons that the plate and the print time have room for; P is the prior covariance, M
    the Fisher information of a coupon, A the derivatives of the targets, w half of a target's 95 % interval and g its
    goal. The last term keeps any value from resting on a single coupon.
    """
    chosen: tuple[int, ...] = ()
    while True:
        least = candidates.worth(chosen) + _GAIN if chosen else -np.inf
        steps = (_ranked(candidates, step(candidates, chosen, count), least) for step in (_one_step, _two_steps))
        better = next((each for ranked in steps for each in ranked if fits(each)), None)
        if better is None:
            break
        chosen = better
    if not chosen:
        raise OutOfRange("no coupon fits on the plate within the print time; allow more hours, or a larger bed")
    return chosen


def _ranked(candidates: Candidates, sets: set[tuple[int, ...]], least: float) -> list[tuple[int, ...]]:
    """Sets that are worth more than ``least``, the best first."""
    worth = {s: candidates.worth(s) for s in sorted(sets) if s and all(s.count(k) <= COPIES for k in s)}
    return sorted((s for s, value in worth.items() if value > least), key=lambda s: -worth[s])


def _one_step(candidates: Candidates, chosen: tuple[int, ...], count: int) -> set[tuple[int, ...]]:
    """One coupon more, less, or another one."""
    every = range(len(candidates.coupons))
    steps = {tuple(sorted((*chosen, k))) for k in every} if len(chosen) < count else set()
    for left in _without_one(chosen):
        steps |= {tuple(sorted((*left, k))) for k in every} | {left}
    return steps


def _two_steps(candidates: Candidates, chosen: tuple[int, ...], count: int) -> set[tuple[int, ...]]:
    """One coupon for two, and two for two others; these of the same kinds alone where there are too many pairs."""
    every = range(len(candidates.coupons))
    few = len(chosen) ** 2 * len(every) ** 2 <= _MOST_PAIRS
    kinds = [few or (coupon.kind, coupon.material) for coupon in candidates.coupons]
    alike = {k: [j for j, kind in enumerate(kinds) if kind == kinds[k]] for k in chosen}
    steps: set[tuple[int, ...]] = set()
    for m, n in combinations(range(len(chosen)), 2):
        left = chosen[:m] + chosen[m + 1 : n] + chosen[n + 1 :]
        steps |= _with_pairs(left, product(alike[chosen[m]], alike[chosen[n]]))
    if len(chosen) < count:
        for left in _without_one(chosen):
            steps |= _with_pairs(left, combinations_with_replacement(every, 2))
    return steps


def _with_pairs(left: tuple[int, ...], pairs: Iterable[tuple[int, int]]) -> set[tuple[int, ...]]:
    return {tuple(sorted((*left, *pair))) for pair in pairs}


def _without_one(chosen: tuple[int, ...]) -> set[tuple[int, ...]]:
    return {chosen[:k] + chosen[k + 1 :] for k in range(len(chosen))}
