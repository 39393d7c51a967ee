r"""Creep of the elastomer, fitted to the rest between presses and taken out.

Where nothing presses, ln Z moves by

.. math:: \ln Z(t) = a_0 + \sum_{i=1}^{3} a_i t^i + \sum_{k=1}^{5} c_k \ln(1 + t / \tau_k)

with time constants from a three-hundredth of the run to all of it. An elastomer creeps as a spectrum of relaxations, by
a power of time or a stretched exponential; five logarithms follow any of them, as one does not, and the polynomial
follows a room that warms up. The fit is made in ln Z because a permittivity that creeps multiplies Z and does not add
to it, and taken out of the pressed readings too. What a press leaves behind and the film forgets is no drift.
"""

from dataclasses import dataclass

import numpy as np

from sensorgen.errors import BadInput
from sensorgen.recording.samples import Bools, Complex, Real

SETTLE_S = 1.0
_TAUS = 5
_FASTEST = 300.0  # of the run: a time constant that short is a step
_POWERS = (1, 2, 3)
_LEAST = 100
_SAME = 1e-10  # of the largest singular value: what is smaller is rounding


@dataclass(frozen=True, eq=False)
class Drift:
    """What the rest did.

    Attributes
    ----------
    start_s : float
        When the readings began [s].
    seconds : float
        How long they went on [s].
    weights : (9, m) array
        Of every tone, complex, of ln abs(Z) and of the phase: a, with t as a share of ``seconds``, and c.
    scatter : (m,) array
        What is left of ln Z at rest, root mean square, each part apart in the real and the imaginary part.
    """

    start_s: float
    seconds: float
    weights: Complex
    scatter: Complex

    def at(self, time_s: Real) -> Complex:
        """Relative drift of ln Z since the begin (n, m), at any times [s]."""
        return np.asarray(_basis(time_s - self.start_s, self.seconds)[:, 1:] @ self.weights[1:])

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
    seconds = max(float(time_s[-1]) - start, 1e-9)
    weights = np.linalg.lstsq(_basis(t, seconds), values, rcond=_SAME)[0]
    left = values - _basis(t, seconds) @ weights
    scatter = np.sqrt((left.real**2).mean(axis=0)) + 1j * np.sqrt((left.imag**2).mean(axis=0))
    return Drift(start, seconds, weights, scatter)


def _disturbed(time_s: Real, force_n: Real, settle_s: float) -> Bools:
    """Where something presses, did until just now, or where nobody knows."""
    pressing = ~(np.abs(force_n) < 0.1)
    last = np.maximum.accumulate(np.where(pressing, time_s, -np.inf))
    coming = np.minimum.accumulate(np.where(pressing, time_s, np.inf)[::-1])[::-1]
    return np.asarray((time_s - last < settle_s) | (coming - time_s < settle_s / 10))


def _basis(time_s: Real, seconds: float) -> Real:
    u = np.maximum(time_s, 0) / seconds
    taus = np.geomspace(1 / _FASTEST, 1, _TAUS)
    return np.column_stack([np.ones_like(u), *(u**n for n in _POWERS), *(np.log1p(u / tau) for tau in taus)])
