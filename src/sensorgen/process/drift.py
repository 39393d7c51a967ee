r"""Creep of the elastomer, fitted to the rest between presses and taken out.

Where nothing presses, ln Z moves by

.. math:: \ln Z(t) = a + b t + c \ln(1 + t / \tau)

with one time constant for all tones: a straight part, and the logarithm in which elastomers creep. The fit is made in
ln Z because a permittivity that creeps multiplies Z and does not add to it, and taken out of the pressed readings too.
"""

from dataclasses import dataclass

import numpy as np

from sensorgen.errors import BadInput
from sensorgen.recording.samples import Bools, Complex, Real

SETTLE_S = 1.0
_TAUS = 9
_FASTEST = 300.0  # of the run: a time constant that short is a step
_LEAST = 30
_MOST_SEARCHED = 20_000  # readings that the time constant is looked for in; the rest is fitted to all


@dataclass(frozen=True, eq=False)
class Drift:
    """What the rest did.

    Attributes
    ----------
    start_s : float
        When the readings began [s].
    tau_s : float
        Time constant of the logarithm [s].
    weights : (3, m) array
        a, b [1/s] and c of every tone, complex: of ln abs(Z) and of the phase.
    scatter : (m,) array
        What is left of ln Z at rest, root mean square, each part apart in the real and the imaginary part.
    """

    start_s: float
    tau_s: float
    weights: Complex
    scatter: Complex

    def at(self, time_s: Real) -> Complex:
        """Relative drift of ln Z since the begin (n, m), at any times [s]."""
        return np.asarray(_basis(time_s - self.start_s, self.tau_s)[:, 1:] @ self.weights[1:])

    def removed(self, time_s: Real, impedance_ohm: Complex) -> Complex:
        """Readings as they would be without drift [ohm]."""
        return np.asarray(impedance_ohm * np.exp(-self.at(time_s)))

    def rest_ohm(self) -> Complex:
        """What the sensor has at rest, when the readings begin (m,) [ohm]."""
        return np.asarray(np.exp(self.weights[0]))


def fitted(time_s: Real, impedance_ohm: Complex, valid: Bools, force_n: Real, settle_s: float = SETTLE_S) -> Drift:
    """The drift of the rest between presses.

    Parameters
    ----------
    time_s : (n,) array
        Time [s].
    impedance_ohm : (n, m) array
        Readings [ohm].
    valid : (n,) array of bool
        Readings that count.
    force_n : (n,) array
        What pressed; rest is where it is below a tenth of a newton, and was for ``settle_s`` [N].
    settle_s : float
        How long the sensor needs to come back after a press [s].

    Raises
    ------
    BadInput
        Too little rest to fit to.
    """
    rest = valid & ~_disturbed(time_s, force_n, settle_s)
    if np.count_nonzero(rest) < _LEAST:
        raise BadInput(f"{np.count_nonzero(rest)} readings at rest; expected {_LEAST} or more to fit a drift to")
    start = float(time_s[0])
    t, z = time_s[rest] - start, impedance_ohm[rest]
    values = np.log(np.abs(z)) + 1j * np.unwrap(np.angle(z), axis=0)
    scale = np.maximum(np.abs(np.diff(values, axis=0)).mean(axis=0), 1e-300)  # tones count by their noise
    some = slice(None, None, max(1, len(t) // _MOST_SEARCHED))
    tau = _best_tau(t[some], (values / scale)[some])
    weights = np.linalg.lstsq(_basis(t, tau), values, rcond=None)[0]
    left = values - _basis(t, tau) @ weights
    scatter = np.sqrt((left.real**2).mean(axis=0)) + 1j * np.sqrt((left.imag**2).mean(axis=0))
    return Drift(start, tau, weights, scatter)


def _disturbed(time_s: Real, force_n: Real, settle_s: float) -> Bools:
    """Where something presses, did until just now, or where nobody knows."""
    pressing = ~(np.abs(force_n) < 0.1)
    last = np.maximum.accumulate(np.where(pressing, time_s, -np.inf))
    coming = np.minimum.accumulate(np.where(pressing, time_s, np.inf)[::-1])[::-1]
    return np.asarray((time_s - last < settle_s) | (coming - time_s < settle_s / 10))


def _basis(time_s: Real, tau_s: float) -> Real:
    return np.column_stack([np.ones_like(time_s), time_s, np.log1p(np.maximum(time_s, 0) / tau_s)])


def _best_tau(time_s: Real, values: Complex) -> float:
    """The time constant that leaves least: the best of a few, then between its neighbours."""
    from scipy.optimize import minimize_scalar

    def left(log_tau: float) -> float:
        basis = _basis(time_s, float(np.exp(log_tau)))
        rest = values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0]
        return float((np.abs(rest) ** 2).sum())

    longest = max(float(time_s[-1]), 1e-9)
    grid = np.log(np.geomspace(longest / _FASTEST, longest, _TAUS))
    best = int(np.argmin([left(log_tau) for log_tau in grid]))
    around = (grid[max(best - 1, 0)], grid[min(best + 1, _TAUS - 1)])
    return float(np.exp(minimize_scalar(left, bounds=around, method="bounded").x))
