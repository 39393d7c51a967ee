r"""The thesis's own inverse: polynomials for R and C, fitted, then solved for force and position.

.. math:: C = C_0 + C_F F, \qquad R = R_0 + (A + E x + B x^2) F

R is Re Z at one frequency, and C is -1/(omega Im Z). The fit is linear: one least-squares solve replaces the search of
the thesis. Kept for comparison; :mod:`sensorgen.prediction.inverse` does the work.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Real
from sensorgen.core.errors import OutOfRange

SOURCE = "Thesis appendix C.1, Eqs. C.1 to C.5, corrected"


@dataclass(frozen=True)
class Roots:
    """Presses that the fit gives for readings.

    Attributes
    ----------
    force_n : (n,) array
        Force by C.4 [N].
    position_m : (n, 2) array
        Both roots, the smaller first, within the sensor or not [m]; nan where there is no real one, or where nothing
        depends on the position.
    """

    force_n: Real
    position_m: Real

    def choice(self, length_m: float) -> Real:
        """The root on the sensor; where both or neither are, the one nearest to its middle [m], (n,).

        Where no root is real, the middle.
        """
        middle = length_m / 2
        far = np.where(np.isnan(self.position_m), np.inf, abs(self.position_m - middle))
        picked = np.take_along_axis(self.position_m, far.argmin(1)[:, None], 1)[:, 0]
        return np.where(np.isinf(far).all(1), middle, picked)


@dataclass(frozen=True)
class LineFit:
    """Fitted coefficients at one frequency.

    Attributes
    ----------
    capacitance : (2,) array
        C0 [F], C_F [F/N].
    resistance : (4,) array
        Of 1, F, F x and F x^2 [ohm, and per N and m].
    residual_ohm : float
        Root mean square of what the fit of R leaves [ohm].
    """

    capacitance: Real
    resistance: Real
    residual_ohm: float

    def force_n(self, capacitance_f: ArrayLike) -> Real:
        """Force from the capacitance, C.4 [N]."""
        c0, per_newton = self.capacitance
        return np.asarray((np.asarray(capacitance_f, float) - c0) / per_newton)

    def presses(self, capacitance_f: ArrayLike, resistance_ohm: ArrayLike) -> Roots:
        """Force by C.4, and both positions by C.5 with its slips put right: the measured R, and b^2 under the root.

        Parameters
        ----------
        capacitance_f, resistance_ohm : (n,) array
            Measured at the frequency of the fit [F], [ohm].
        """
        force = self.force_n(capacitance_f)
        r0, a, e, b = self.resistance
        return Roots(force, _roots(b * force, e * force, r0 + a * force - np.asarray(resistance_ohm, float)))


def fit(force_n: ArrayLike, position_m: ArrayLike, capacitance_f: ArrayLike, resistance_ohm: ArrayLike) -> LineFit:
    """Fit R and C to known presses.

    Parameters
    ----------
    force_n, position_m : (n,) array
        Presses [N], [m].
    capacitance_f, resistance_ohm : (n,) array
        Readings there at one frequency, see :func:`series` [F], [ohm].

    Raises
    ------
    OutOfRange
        Presses that do not determine the coefficients, as with one force only.

    Examples
    --------
    >>> force, x = (a.ravel() for a in np.meshgrid([1.0, 2.0, 3.0], [0.0, 0.05, 0.1]))
    >>> found = fit(force, x, 70e-12 + 1e-12 * force, 100 + force * (1 + 20 * x - 90 * x**2))
    >>> found.presses([72e-12], [100 + 2 * (1 + 20 * 0.08 - 90 * 0.08**2)]).position_m.round(6).tolist()
    [[0.08, 0.142222]]
    """
    force, x, c, r = (np.asarray(a, float) for a in (force_n, position_m, capacitance_f, resistance_ohm))
    one = np.ones_like(force)
    resistance, left = _solved(np.stack((one, force, force * x, force * x * x), -1), r)
    return LineFit(_solved(np.stack([one, force], -1), c)[0], resistance, left)


def series(frequency_hz: float, impedance_ohm: ArrayLike) -> tuple[Real, Real]:
    """Capacitance [F] and resistance [ohm] of a reading, taken as a resistor in series with a capacitor.

    >>> c, r = series(1e3, 50.0 - 2e6j)
    >>> round(float(c) * 1e12, 3), float(r)
    (79.577, 50.0)
    """
    z = np.asarray(impedance_ohm)
    return np.asarray(-1 / (2 * np.pi * frequency_hz * z.imag)), np.asarray(z.real)


def _solved(basis: Real, wanted: Real) -> tuple[Real, float]:
    """Coefficients by least squares, each column at its own scale, and the root mean square of what is left."""
    scale = abs(basis).max(0)
    if not (scale > 0).all() or np.linalg.matrix_rank(basis / scale) < basis.shape[1]:
        raise OutOfRange("these presses do not determine the fit: give several forces at several positions")
    found = np.linalg.lstsq(basis / scale, wanted, rcond=None)[0] / scale
    return found, float(np.sqrt(np.mean((basis @ found - wanted) ** 2)))


def _roots(a: Real, b: Real, c: Real) -> Real:
    """Both roots of a x^2 + b x + c, as 2c/(-b - sgn(b) sqrt) and its partner: nothing cancels, and a may go to 0."""
    under = b * b - 4 * a * c
    q = -(b + np.copysign(np.sqrt(np.maximum(under, 0.0)), b)) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        both = np.stack([c / q, q / a], -1)
    both[under < 0] = np.nan
    return np.sort(np.where(np.isfinite(both), both, np.nan), -1)
