r"""Laws that the drift of a resting sensor may follow, and how well each explains it.

An elastomer creeps as a spectrum of relaxations, by a power of time or a stretched exponential: five logarithms
:math:`\ln(1 + t/\tau)`, with time constants from a three-hundredth of the run to all of it, follow any of them as one
does not, and a cubic follows a room that warms up. A film that answers slowly to a press forgets it slowly: the
rest after it shows an exponential that began under the tip, so that force over time, smoothed by the same exponential,
tells what it was there. What wanders without any law is known at rest only, and goes straight from rest to rest.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, log
from typing import NamedTuple, Protocol

import numpy as np

from sensorgen.measure.recording.response import relaxation
from sensorgen.measure.recording.samples import Complex, Real

BIN_S = 0.25  # beyond the demodulator's own memory, so that bins are independent of each other
_TAUS = 5
_FASTEST = 300.0  # of the run: a time constant that short is a step
_POWERS = (1, 2, 3)
_SAME = 1e-10  # of the largest singular value: what is smaller is rounding
_SCAN, _MOST_MEMORIES = 24, 3
_KNOTS_S = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)


class Term(Protocol):
    """Part of a law."""

    def columns(self, time_s: Real) -> Real:
        """Its courses over time, side by side (n, k)."""


class Bins(NamedTuple):
    """Means of ln Z over short times."""

    time_s: Real
    """Middles [s]."""
    values: Complex
    """(n, m)."""
    weight: Real
    """Square root of the share of a whole bin that was measured."""


@dataclass(frozen=True)
class Line:
    """Straight over time."""

    start_s: float
    seconds: float

    def columns(self, time_s: Real) -> Real:
        """One column."""
        return np.maximum(time_s - self.start_s, 0)[:, None] / self.seconds


@dataclass(frozen=True)
class Smooth:
    """A cubic, and logarithms."""

    start_s: float
    seconds: float

    def columns(self, time_s: Real) -> Real:
        """Eight columns."""
        u = np.maximum(time_s - self.start_s, 0) / self.seconds
        taus = np.geomspace(1 / _FASTEST, 1, _TAUS)
        return np.column_stack([*(u**n for n in _POWERS), *(np.log1p(u / tau) for tau in taus)])


@dataclass(frozen=True, eq=False)
class Memory:
    """Force over time as a film with one time constant answers to it."""

    tau_s: float
    answer_n: Callable[[Real], Real]

    def columns(self, time_s: Real) -> Real:
        """One column [N]."""
        return self.answer_n(time_s)[:, None]


@dataclass(frozen=True, eq=False)
class Wander:
    """Straight lines from rest to rest."""

    time_s: Real
    values: Complex

    def at(self, time_s: Real) -> Complex:
        """Values (n, m), at the ends the outermost."""
        return np.column_stack([np.interp(time_s, self.time_s, column) for column in self.values.T])


@dataclass(frozen=True, eq=False)
class Fit:
    """A law with its numbers.

    Attributes
    ----------
    terms : tuple of Term
        What it consists of, besides a constant.
    weights : (1 + k, m) array
        Of the constant and of all columns.
    left : (n, m) array
        What it does not explain, bin by bin, weighted.
    shared : int
        Numbers that all tones share.
    wander : Wander or None
        On top of the terms.
    """

    terms: tuple[Term, ...]
    weights: Complex
    left: Complex
    shared: int = 0
    wander: Wander | None = None

    def at(self, time_s: Real) -> Complex:
        """The ln Z that it says (n, m)."""
        found = _basis(self.terms, time_s) @ self.weights
        return np.asarray(found + self.wander.at(time_s) if self.wander else found)

    def bic(self) -> float:
        """Schwarz's criterion; infinite with more numbers than half of the bins."""
        count, channels = len(self.left), 2 * self.left.shape[1]
        each = len(self.weights) + (len(self.wander.time_s) if self.wander else 0)
        if 2 * each > count:
            return inf
        return float(count * _misfit(_squares(self.left) / count) + (channels * each + self.shared) * log(count))


def binned(time_s: Real, values: Complex) -> Bins:
    """Means over a quarter of a second each, where there is something.

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


def explained(bins: Bins, terms: tuple[Term, ...], shared: int = 0) -> Fit:
    """Some terms, fitted by least squares."""
    basis, weight = _basis(terms, bins.time_s), bins.weight[:, None]
    weights = np.linalg.lstsq(basis * weight, bins.values * weight, rcond=_SAME)[0]
    left = np.asarray((bins.values - basis @ weights) * weight, np.complex128)
    return Fit(terms, np.asarray(weights, np.complex128), left, shared)


def remembering(bins: Bins, found: Fit, time_s: Real, force_n: Real, fastest_s: float) -> Fit:
    """A fit with what the film remembers of the presses: one exponential after the other, while each is worth it.

    Parameters
    ----------
    bins : Bins
        Of the rest.
    found : Fit
        What is explained already.
    time_s, force_n : (n,) array
        What pressed when [s], [N].
    fastest_s : float
        The shortest time constant that shows at rest [s].
    """

    def memory(log_tau: float) -> Memory:
        tau = float(np.exp(log_tau))
        return Memory(tau, relaxation(time_s, force_n, tau))

    taus = np.log(np.geomspace(fastest_s, max(2 * fastest_s, float(time_s[-1] - time_s[0])), _SCAN))
    base, weight = np.linalg.qr(_basis(found.terms, bins.time_s) * bins.weight[:, None])[0], bins.weight[:, None]

    def misfit(logs: Real) -> float:
        columns = weight * np.hstack([memory(x).columns(bins.time_s) for x in logs])
        new = np.linalg.qr(columns - base @ (base.T @ columns))[0]
        return _misfit(_squares(found.left) - _squares(new.T @ found.left))

    best, logs = found, np.empty(0)
    for _ in range(_MOST_MEMORIES):
        first = min(taus, key=lambda x: misfit(np.append(logs, x)))
        logs = _refined(misfit, np.append(logs, first), taus[[0, -1]])
        more = explained(bins, (*found.terms, *(memory(x) for x in logs)), found.shared + len(logs))
        if more.bic() >= best.bic():
            break
        best = more
    return best


def _refined(score: Callable[[Real], float], start: Real, ends: Real) -> Real:
    """Where a score is least near a start, every number within the same ends."""
    from scipy.optimize import minimize

    simplex = np.clip(start + 0.1 * np.vstack([np.zeros_like(start), np.eye(len(start))]), *ends)
    how = {"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-4, "maxfev": 80 * len(start)}
    return np.asarray(minimize(score, start, method="Nelder-Mead", bounds=[tuple(ends)] * len(start), options=how).x)


def wandering(bins: Bins, found: Fit) -> Fit:
    """A fit with what wanders on top, its knots as far apart as is best."""
    fits = [found]
    for apart_s in _KNOTS_S:
        starts = np.flatnonzero(np.diff(np.floor((bins.time_s - bins.time_s[0]) / apart_s), prepend=-1.0))
        share = bins.weight**2
        total = np.add.reduceat(share, starts)
        middle = np.add.reduceat(bins.time_s * share, starts) / total
        sums: Complex = np.asarray(np.add.reduceat(found.left * bins.weight[:, None], starts), np.complex128)
        wander = Wander(middle, sums / total[:, None])
        left = found.left - wander.at(bins.time_s) * bins.weight[:, None]
        fits.append(Fit(found.terms, found.weights, left, found.shared + 1, wander))
    return min(fits, key=Fit.bic)


def _basis(terms: tuple[Term, ...], time_s: Real) -> Real:
    return np.column_stack([np.ones_like(time_s), *(term.columns(time_s) for term in terms)])


def _squares(left: Complex) -> Real:
    """Sums of squares of both parts of every tone."""
    return np.concatenate([(left.real**2).sum(axis=0), (left.imag**2).sum(axis=0)])


def _misfit(squares: Real) -> float:
    """Logarithm of what is left, over all channels."""
    return float(np.log(np.maximum(squares, 1e-30)).sum())
