"""Posterior of the unknowns by readings of coupons: Gaussian in their logarithms, with coupons that may be dead.

Each set of dead coupons is a model of its own: its evidence (Laplace) weighs it, and the sum over sets is the result.
A dead coupon's readings may be anything within some decades.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import log

import numpy as np

from sensorgen.analysis.characterise.catalogue import Coupon, Size, Target, Unknown
from sensorgen.core.arrays import Mask, Real

DEAD = 0.05  # of coupons, before anything is read
_DECADES = 6.0  # within which the reading of a dead coupon lies
_MOST_DEAD, _REFINED = 3, 4  # coupons at once; sets of dead ones that are solved, of those that are sketched
_STEP, _STEPS = 1e-4, 40
_STILL = 0.02  # in standard deviations: the last step


@dataclass(frozen=True)
class Observation:
    """Readings of a coupon.

    Attributes
    ----------
    coupon : Coupon
        What was read.
    sizes : tuple of Size
        As measured, each with its standard deviation.
    log_values : (n,) array
        ln of the readings in SI units; nan where there is none.
    noise : (n,) array
        Their standard deviations.
    """

    coupon: Coupon
    sizes: tuple[Size, ...]
    log_values: Real
    noise: Real

    @cached_property
    def read(self) -> Mask:
        """Mask of the readings that exist."""
        return np.isfinite(self.log_values)


def physical(unknowns: Sequence[Unknown], theta: Real) -> dict[str, Real]:
    """Values in SI units, by name, of coordinates in which the prior is normal; the last axis counts the unknowns."""
    return {
        u.key: theta[..., k] if u.linear else np.exp(np.clip(theta[..., k], -80, 80)) for k, u in enumerate(unknowns)
    }


@dataclass(frozen=True)
class Line:
    """A coupon's readings near a point: ln of the values, their Jacobian, and the covariance of their errors."""

    log_values: Real
    jacobian: Real
    covariance: Real


def linearised(
    coupon: Coupon, sizes: Sequence[Size], noise: Real, unknowns: Sequence[Unknown], theta: Real
) -> Line:  # fmt: skip
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
        found = np.log(np.stack(coupon.expected(physical(unknowns, points), around), axis=-1))
    by_size = (found[1 + p :] - found[0]) / 0.05  # for one standard deviation each
    return Line(found[0], ((found[1 : 1 + p] - found[0]) / steps[:, None]).T, np.diag(noise**2) + by_size.T @ by_size)


@dataclass(frozen=True)
class Mode:
    """One set of dead coupons.

    Attributes
    ----------
    dead : tuple of int
        Numbers of the observations.
    mean, covariance : (p,) array, (p, p) array
        Of the unknowns.
    log_evidence : float
        ln of the probability of all readings and of this set.
    """

    dead: tuple[int, ...]
    mean: Real
    covariance: Real
    log_evidence: float


class _Problem:
    """Observations and unknowns: the posterior density near a point, and its peaks."""

    def __init__(self, observations: Sequence[Observation], unknowns: Sequence[Unknown]) -> None:
        self.observations, self.unknowns = observations, unknowns
        self.centre, self.spread = np.array([(u.centre, u.spread) for u in unknowns]).T

    def lines(self, theta: Real, dead: Sequence[int] = ()) -> dict[int, Line]:
        """Every coupon's readings near a point, but those of the dead."""
        return {
            k: linearised(o.coupon, o.sizes, o.noise, self.unknowns, theta)
            for k, o in enumerate(self.observations) if k not in dead
        }  # fmt: skip

    def density(self, theta: Real, lines: Mapping[int, Line]) -> tuple[float, Real, Real]:
        """Minus ln of the posterior density, its gradient, and its curvature."""
        off = (theta - self.centre) / self.spread
        cost, gradient = float(0.5 * off @ off + np.log(self.spread).sum()), off / self.spread
        curvature: Real = np.diag(self.spread**-2.0)
        for k, line in lines.items():
            o = self.observations[k]
            residual = (o.log_values - line.log_values)[o.read]
            covariance = line.covariance[np.ix_(o.read, o.read)]
            if not all(np.isfinite(part).all() for part in (residual, covariance, line.jacobian)):
                return np.inf, gradient, curvature
            root = np.linalg.inv(np.linalg.cholesky(covariance))
            white, jacobian = root @ residual, root @ line.jacobian[o.read]
            cost += float(0.5 * white @ white - np.log(np.diag(root)).sum()) + 0.5 * len(white) * log(2 * np.pi)
            gradient = gradient - jacobian.T @ white
            curvature = curvature + jacobian.T @ jacobian
        return cost, gradient, curvature

    def peak(self, start: Real, dead: tuple[int, ...]) -> Mode:
        """Most likely unknowns given which coupons are dead, by Gauss and Newton with halved steps."""
        theta, (cost, gradient, curvature) = start, self.density(start, self.lines(start, dead))
        if not np.isfinite(cost):  # a gap that is wider than its film, as a step too far may have it
            theta, (cost, gradient, curvature) = self.centre, self.density(self.centre, self.lines(self.centre, dead))
        for _ in range(_STEPS):
            step, share = -np.linalg.solve(curvature, gradient), 1.0
            size = float(np.sqrt(step @ curvature @ step))
            new = self.density(theta + step, self.lines(theta + step, dead))
            while not new[0] <= cost + 1e-9 and share > 1e-3:
                share /= 2
                new = self.density(theta + share * step, self.lines(theta + share * step, dead))
            if not new[0] <= cost + 1e-9:
                break
            theta, (cost, gradient, curvature) = theta + share * step, new
            if size * share < _STILL:
                break
        return self.mode(theta, dead, cost, curvature)

    def sketch(self, mode: Mode, lines: Mapping[int, Line], also: int) -> Mode:
        """The peak with one more coupon dead, from readings that are linear around another peak."""
        dead = tuple(sorted((*mode.dead, also)))
        cost, gradient, curvature = self.density(mode.mean, {k: line for k, line in lines.items() if k not in dead})
        step = -np.linalg.solve(curvature, gradient)
        return self.mode(mode.mean + step, dead, cost + 0.5 * float(gradient @ step), curvature)

    def mode(self, theta: Real, dead: tuple[int, ...], cost: float, curvature: Real) -> Mode:
        """A peak with its evidence by Laplace's approximation."""
        covariance = np.asarray(np.linalg.inv(curvature), np.float64)
        _, log_det = np.linalg.slogdet(covariance)
        count = sum(int(self.observations[k].read.sum()) for k in dead)
        evidence = -cost + 0.5 * float(log_det) - count * log(_DECADES * log(10.0))
        evidence += len(dead) * log(DEAD) + (len(self.observations) - len(dead)) * log(1 - DEAD)
        return Mode(dead, theta, covariance, evidence)


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
class Posterior:
    """Unknowns after the readings.

    Attributes
    ----------
    unknowns : tuple of Unknown
        In the order of the modes' columns.
    modes : tuple of Mode
        Sets of dead coupons, the most likely first.
    weights : (m,) array
        Probability of each [-].
    names : tuple of str
        Of the observations.
    """

    unknowns: tuple[Unknown, ...]
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

    def interval(self, target: Target) -> Interval95:
        """Median and 95 % interval of a target: quantiles of the sum of normal distributions."""
        means, sigmas = zip(*(_normal(self.unknowns, m.mean, m.covariance, target) for m in self.modes), strict=True)
        return _quantiles(np.array(means), np.array(sigmas), self.weights, linear=target.linear)


def _normal(unknowns: Sequence[Unknown], mean: Real, covariance: Real, target: Target) -> tuple[float, float]:
    """Mean and standard deviation of a target, of its ln unless it is linear."""
    spreads = np.sqrt(np.diag(covariance))
    points = np.vstack([mean, mean + np.diag(0.01 * spreads)])
    found = target.value(physical(unknowns, points))
    if not target.linear:
        found = np.log(np.maximum(found, 1e-300))
    by = (found[1:] - found[0]) / (0.01 * spreads)
    return float(found[0]), float(np.sqrt(by @ covariance @ by))


def _quantiles(means: Real, sigmas: Real, weights: Real, *, linear: bool) -> Interval95:
    from scipy.special import ndtr

    found = []
    for level in (0.5, 0.025, 0.975):
        low, high = (means - 9 * sigmas).min(), (means + 9 * sigmas).max()
        for _ in range(60):
            middle = (low + high) / 2
            below = weights @ ndtr((middle - means) / sigmas) < level
            low, high = (middle, high) if below else (low, middle)
        value = float(high if linear else np.exp(high))
        found.append(0.0 if linear and abs(value) < 1e-9 * float(sigmas.max()) else value)
    return Interval95(*found)


def prior(unknowns: Sequence[Unknown]) -> Posterior:
    """The unknowns before any reading."""
    mean, spread = np.array([(u.centre, u.spread) for u in unknowns]).T
    return Posterior(tuple(unknowns), (Mode((), mean, np.diag(spread**2), 0.0),), np.ones(1), ())


def posterior(observations: Sequence[Observation], unknowns: Sequence[Unknown]) -> Posterior:
    """The unknowns after readings of coupons, of which up to three may be dead.

    Parameters
    ----------
    observations : sequence of Observation
        Those with at least one reading count.
    unknowns : sequence of Unknown
        With what was known before.
    """
    problem = _Problem([o for o in observations if o.read.any()], unknowns)
    best = problem.peak(problem.centre, ())
    modes: dict[tuple[int, ...], Mode] = {(): best}
    for _ in range(_MOST_DEAD):
        lines = problem.lines(best.mean, best.dead)
        around = sorted((problem.sketch(best, lines, k) for k in lines), key=lambda mode: -mode.log_evidence)
        modes |= {m.dead: problem.peak(m.mean, m.dead) for m in around[:_REFINED] if m.dead not in modes}
        top = max(modes.values(), key=lambda mode: mode.log_evidence)
        if top is best:
            break
        best = top
    ranked = sorted(modes.values(), key=lambda mode: -mode.log_evidence)
    weights = np.exp([mode.log_evidence - best.log_evidence for mode in ranked])
    kept = weights > 1e-6 * weights.sum()
    weights = np.where(kept, weights, 0.0)
    return Posterior(
        tuple(unknowns), tuple(m for m, k in zip(ranked, kept, strict=True) if k), weights[kept] / weights.sum(),
        tuple(o.coupon.name for o in problem.observations),
    )  # fmt: skip
