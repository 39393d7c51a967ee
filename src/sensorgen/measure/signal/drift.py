r"""Drift of the elastomer: fitted to the rest between presses, and removed.

Without load, ln Z drifts by

.. math:: \ln Z(t) = a_0 + \sum_i a_i b_i(t) + \sum_k c_k \int_0^t F(s)\, e^{-(t - s)/\tau_k} \frac{ds}{\tau_k} + w(t)

with functions b of time alone, relaxation after earlier presses, and a random walk w: see
below. Each law has some of these terms; the law with the least Schwarz criterion (BIC)
is used. The fit is made in ln Z because creep of the permittivity multiplies Z, and is removed from the pressed
readings too.

An elastomer creeps with a spectrum of relaxation times, by a power of time or a stretched exponential: five logarithms
:math:`\ln(1 + t/\tau)`, with time constants from a three-hundredth of the run to all of it, approximate any of them,
and a cubic follows a change of temperature. A film that relaxes under a press recovers with the same time constants:
force convolved with an exponential describes the recovery. A random walk is known at rest only, and is interpolated
linearly from rest to rest.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from math import inf, log

import numpy as np

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.measure.recording.rig import relaxation

BIN_S = 0.25  # beyond the demodulator's own memory, so that bins are independent of each other
_TAUS = 5
_FASTEST = 300.0  # of the run: a time constant that short is a step
_POWERS = (1, 2, 3)
_ROUNDING = 1e-10  # of the largest singular value
_SCAN, _MOST_MEMORIES = 24, 3
_KNOTS_S = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)


Term = Callable[[Real], Real]
"""Part of a law: from times (n,) [s] to its functions of time, side by side (n, k)."""


@dataclass(frozen=True, eq=False)
class Bins:
    """Means of ln Z over short times.

    Attributes
    ----------
    time_s : (n,) array
        Mean times [s].
    values : (n, m) array
        ln Z.
    weight : (n,) array
        Square root of the number of readings over the usual number.
    """

    time_s: Real
    values: Complex
    weight: Real


def linear(start_s: float, seconds: float) -> Term:
    """Linear in time."""
    return lambda time_s: np.maximum(time_s - start_s, 0)[:, None] / seconds


def smooth(start_s: float, seconds: float) -> Term:
    """Cubic and logarithms of time."""
    taus = np.geomspace(1 / _FASTEST, 1, _TAUS)

    def columns(time_s: Real) -> Real:
        u = np.maximum(time_s - start_s, 0) / seconds
        return np.column_stack([*(u**n for n in _POWERS), *(np.log1p(u / tau) for tau in taus)])

    return columns


@dataclass(frozen=True, eq=False)
class Relaxation:
    """Relaxation after a force, with one time constant."""

    tau_s: float
    response_n: Callable[[Real], Real]

    def __call__(self, time_s: Real) -> Real:
        """Response [N] (n, 1)."""
        return self.response_n(time_s)[:, None]


@dataclass(frozen=True, eq=False)
class Wander:
    """Random walk, linear from rest to rest."""

    time_s: Real
    values: Complex

    def at(self, time_s: Real) -> Complex:
        """Values (n, m), constant beyond the ends."""
        return np.column_stack([np.interp(time_s, self.time_s, column) for column in self.values.T])


@dataclass(frozen=True, eq=False)
class LawFit:
    """A fitted law.

    Attributes
    ----------
    terms : tuple of Term
        Terms, besides a constant.
    weights : (1 + k, m) array
        Of the constant and of all columns.
    left : (n, m) array
        Weighted residuals.
    shared : int
        Number of parameters that all frequencies share.
    wander : Wander or None
        Added to the terms.
    """

    terms: tuple[Term, ...]
    weights: Complex
    left: Complex
    shared: int = 0
    wander: Wander | None = None

    def at(self, time_s: Real) -> Complex:
        """Logarithm of Z (n, m)."""
        values = _basis(self.terms, time_s) @ self.weights
        return np.asarray(values + self.wander.at(time_s) if self.wander else values)

    def bic(self) -> float:
        """Schwarz criterion; infinite with more parameters than half of the bins."""
        count, channels = len(self.left), 2 * self.left.shape[1]
        each = len(self.weights) + (len(self.wander.time_s) if self.wander else 0)
        if 2 * each > count:
            return inf
        return float(count * _misfit(_squares(self.left) / count) + (channels * each + self.shared) * log(count))


def binned(time_s: Real, values: Complex) -> Bins:
    """Means over 0.25 s each, without empty ones.

    Parameters
    ----------
    time_s : (n,) array
        Rising [s].
    values : (n, m) array
        ln Z.
    """
    which = np.floor((time_s - time_s[0]) / BIN_S)
    starts = np.flatnonzero(np.diff(which, prepend=-1.0))
    counts = np.diff(np.append(starts, len(time_s)))
    middle = np.add.reduceat(time_s, starts) / counts
    means: Complex = np.asarray(np.add.reduceat(values, starts), np.complex128) / counts[:, None]
    return Bins(middle, means, np.sqrt(counts / np.median(counts)))


def explained(bins: Bins, terms: tuple[Term, ...], shared: int = 0) -> LawFit:
    """Fit terms by least squares."""
    basis, weight = _basis(terms, bins.time_s), bins.weight[:, None]
    weights = np.linalg.lstsq(basis * weight, bins.values * weight, rcond=_ROUNDING)[0]
    left = np.asarray((bins.values - basis @ weights) * weight, np.complex128)
    return LawFit(terms, np.asarray(weights, np.complex128), left, shared)


def relaxing(bins: Bins, fit: LawFit, time_s: Real, force_n: Real, fastest_s: float) -> LawFit:
    """Add relaxation after presses to a fit: one time constant after the other while the BIC falls.

    Parameters
    ----------
    bins : Bins
        Of the readings at rest.
    fit : LawFit
        Fit to extend.
    time_s, force_n : (n,) array
        Time and force [s], [N].
    fastest_s : float
        Shortest time constant that is visible at rest [s].
    """
    from scipy.optimize import minimize

    def memory(log_tau: float) -> Relaxation:
        tau = float(np.exp(log_tau))
        return Relaxation(tau, relaxation(time_s, force_n, tau))

    taus = np.log(np.geomspace(fastest_s, max(2 * fastest_s, float(time_s[-1] - time_s[0])), _SCAN))
    base, weight = np.linalg.qr(_basis(fit.terms, bins.time_s) * bins.weight[:, None])[0], bins.weight[:, None]

    def misfit(logs: Real) -> float:
        columns = weight * np.hstack([memory(x)(bins.time_s) for x in logs])
        new = np.linalg.qr(columns - base @ (base.T @ columns))[0]
        return _misfit(_squares(fit.left) - _squares(new.T @ fit.left))

    best, logs = fit, np.empty(0)
    for _ in range(_MOST_MEMORIES):
        first = min(taus, key=lambda x: misfit(np.append(logs, x)))
        start, ends = np.append(logs, first), (taus[0], taus[-1])
        simplex = np.clip(start + 0.1 * np.vstack([np.zeros_like(start), np.eye(len(start))]), *ends)
        how = {"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-4, "maxfev": 80 * len(start)}
        logs = minimize(misfit, start, method="Nelder-Mead", bounds=[ends] * len(start), options=how).x
        more = explained(bins, (*fit.terms, *(memory(x) for x in logs)), fit.shared + len(logs))
        if more.bic() >= best.bic():
            break
        best = more
    return best


def wandering(bins: Bins, fit: LawFit) -> LawFit:
    """Add a random walk to a fit, with the distance of knots of least BIC."""
    fits = [fit]
    for apart_s in _KNOTS_S:
        starts = np.flatnonzero(np.diff(np.floor((bins.time_s - bins.time_s[0]) / apart_s), prepend=-1.0))
        share = bins.weight**2
        total = np.add.reduceat(share, starts)
        middle = np.add.reduceat(bins.time_s * share, starts) / total
        sums: Complex = np.asarray(np.add.reduceat(fit.left * bins.weight[:, None], starts), np.complex128)
        wander = Wander(middle, sums / total[:, None])
        left = fit.left - wander.at(bins.time_s) * bins.weight[:, None]
        fits.append(LawFit(fit.terms, fit.weights, left, fit.shared + 1, wander))
    return min(fits, key=LawFit.bic)


def _basis(terms: tuple[Term, ...], time_s: Real) -> Real:
    return np.column_stack([np.ones_like(time_s), *(term(time_s) for term in terms)])


def _squares(left: Complex) -> Real:
    """Sums of squares of both parts at every frequency."""
    return np.concatenate([(left.real**2).sum(axis=0), (left.imag**2).sum(axis=0)])


def _misfit(squares: Real) -> float:
    """Sum of logarithms over all channels."""
    return float(np.log(np.maximum(squares, 1e-30)).sum())


SETTLE_S = 1.0
LAWS = {
    "line": "a straight line over time",
    "smooth": "a cubic and five logarithms of time",
    "memory": "smooth, and relaxation after earlier presses",
    "wandering": "smooth, and a random walk from rest to rest",
    "memory+wandering": "smooth, relaxation after earlier presses, and a random walk from rest to rest",
}
"""Laws of drift, and their terms."""

_BELOW = {"wandering": "smooth", "memory+wandering": "memory"}  # laws with a random walk, and those without
BY_TIME = ("line", "smooth", "wandering")
"""Laws that need no force."""

_LEAST = 100
_BLOCK = 1 << 14  # samples whose drift is removed at once


@dataclass(frozen=True, eq=False)
class Drift:
    """Drift at rest.

    Attributes
    ----------
    law : str
        Of :data:`LAWS`.
    reason : str
        Reason for the law.
    start_s : float
        Time of the first reading [s].
    fit : LawFit
        ln Z at rest, at any time.
    """

    law: str
    reason: str
    start_s: float
    fit: LawFit

    def at(self, time_s: Real) -> Complex:
        """Drift of ln Z since the first reading, at any times [s] (n, m) [-]."""
        return np.asarray(self.fit.at(time_s) - self.fit.at(np.array([self.start_s])))

    def removed(self, time_s: Real, impedance_ohm: Complex) -> Complex:
        """Readings without drift [ohm]."""
        clean = np.empty_like(impedance_ohm)
        for k in range(0, len(time_s), _BLOCK):
            at = slice(k, k + _BLOCK)
            clean[at] = impedance_ohm[at] * np.exp(-self.at(time_s[at]))
        return clean

    def rest_ohm(self) -> Complex:
        """Impedance at rest at the first reading (m,) [ohm]."""
        return np.asarray(np.exp(self.fit.at(np.array([self.start_s]))[0]))


def fitted(
    time_s: Real, impedance_ohm: Complex, valid: Mask, force_n: Real, settle_s: float = SETTLE_S,
    among: Collection[str] = tuple(LAWS),
) -> Drift:  # fmt: skip
    """Fit the drift to the rest between presses.

    Parameters
    ----------
    time_s : (n,) array
        Time [s].
    impedance_ohm : (n, m) array
        Readings [ohm].
    valid : (n,) array of bool
        Valid readings.
    force_n : (n,) array
        Force; the sensor rests where it has been below 0.1 N for ``settle_s`` [N].
    settle_s : float
        Time to recover after a press [s].
    among : collection of str
        Names of :data:`LAWS` to choose from.

    Raises
    ------
    BadInput
        Too little rest to fit to, or no law to choose from.
    UnknownName
        No such law.
    """
    check(*among)
    rest = valid & ~_disturbed(time_s, force_n, settle_s)
    if np.count_nonzero(rest) < _LEAST:
        raise BadInput(f"{np.count_nonzero(rest)} readings at rest; expected {_LEAST} or more to fit a drift to")
    bins, start = _bins(time_s, impedance_ohm, rest), float(time_s[0])
    seconds = max(float(time_s[-1]) - start, 1e-9)
    by_time = explained(bins, (smooth(start, seconds),))
    fits = {"line": explained(bins, (linear(start, seconds),)), "smooth": by_time}
    if "memory" in "".join(among):
        fits["memory"] = relaxing(bins, by_time, time_s, force_n, settle_s / 2)
    fits |= {name: wandering(bins, fits[_BELOW[name]]) for name in _BELOW if name in among}
    scores = {name: fits[name].bic() for name in LAWS if name in among}
    best = min(scores, key=lambda name: scores[name])
    return Drift(best, f"{LAWS[best]} ({_reason(scores, best)})", start, fits[best])


def _bins(time_s: Real, impedance_ohm: Complex, rest: Mask) -> Bins:
    """Bins of ln Z at rest, frequency by frequency, to save memory."""
    columns = (column[rest] for column in impedance_ohm.T)
    each = [binned(time_s[rest], (np.log(np.abs(z)) + 1j * np.unwrap(np.angle(z)))[:, None]) for z in columns]
    return replace(each[0], values=np.hstack([of.values for of in each]))


def _reason(scores: Mapping[str, float], best: str) -> str:
    """Criteria of the other laws, above that of the best."""
    others = [f"{other} {scores[other] - scores[best]:.0f}" for other in scores if scores[other] > scores[best]]
    return f"BIC higher of {', '.join(others)}" if others else "the only law"


def check(*laws: str) -> None:
    """Refuse an unknown law, and none at all."""
    if not laws:
        raise BadInput(f"no law of drift to choose from; expected some of {', '.join(LAWS)}")
    for law in laws:
        if law not in LAWS:
            raise UnknownName("law of drift", law, LAWS)


def _disturbed(time_s: Real, force_n: Real, settle_s: float) -> Mask:
    """Samples under a press or just after one, or with an unknown force."""
    pressing = ~(np.abs(force_n) < 0.1)
    last = np.maximum.accumulate(np.where(pressing, time_s, -np.inf))
    coming = np.minimum.accumulate(np.where(pressing, time_s, np.inf)[::-1])[::-1]
    return np.asarray((time_s - last < settle_s) | (coming - time_s < settle_s / 10))
