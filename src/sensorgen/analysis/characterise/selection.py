r"""Choice of coupons: D-optimal for the targets, with none or one of the coupons dead, each goal missed at a cost.

.. math:: \max_S \; (1 - p n) \, D(S) + p \sum_{i \in S} D(S \setminus i)
          - \lambda \sum_t \left[\ln^+ \frac{w_t(S)}{g_t} + \beta \sum_{i \in S} \ln^+ \frac{w_t(S \setminus i)}
          {3 g_t}\right], \quad
          D(S) = -\ln \det \left( A \left(P^{-1} + \sum_{k \in S} M_k\right)^{-1} A^T \right)

over multisets S of at most n coupons that the plate and the print time have room for; P is the prior covariance, M the
Fisher information of a coupon, A the derivatives of the targets, w half of a target's 95 % interval and g its goal. The
last term keeps any value from resting on a single coupon.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement, product

import numpy as np

from sensorgen.analysis.characterise.catalogue import LEVEL_SIGMA, Coupon, CouponTarget, Meters, nominal
from sensorgen.analysis.characterise.posterior import DEAD, CouponPosterior, Mode, gradient, linearised, physical
from sensorgen.core.arrays import Mask, Real
from sensorgen.core.errors import OutOfRange
from sensorgen.prediction.inference import Parameter, whitening

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
        noise = noise_of(coupon, unknowns, theta, meters)
        line = linearised(coupon, nominal(coupon, meters), noise, unknowns, theta)
        white = whitening(line.covariance) @ line.jacobian
        information.append(white.T @ white)
    wanted = np.stack([gradient(unknowns, theta, 1e-4 * spread, target)[1] for target in targets])
    counted = np.array([not target.derived for target in targets])
    goals = np.array([target.goal or np.inf for target in targets])
    return Candidates(tuple(coupons), np.array(information), np.diag(spread**-2.0), wanted, counted, goals)


def noise_of(coupon: Coupon, unknowns: Sequence[Parameter], theta: Real, meters: Meters) -> Real:
    """Standard deviations of ln of a coupon's expected readings."""
    sizes = {size.key: np.asarray(size.drawn) for size in coupon.sizes}
    expected = coupon.expected(physical(unknowns, theta), sizes)
    return np.array([meters.noise(r, float(v)) for r, v in zip(coupon.readings, expected, strict=True)])


def select(candidates: Candidates, count: int, fits: Fits) -> tuple[int, ...]:
    """The best set of at most ``count`` coupons, by exchange from the best one that greed finds.

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
