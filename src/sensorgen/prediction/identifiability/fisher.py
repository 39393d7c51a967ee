r"""How well a reading tells force and position: Fisher information and the bound of Cramer and Rao.

The real and the imaginary part of Z at each tone carry Gaussian noise of standard deviation ``noise`` \|Z\|, all
independent. Divided by Z a reading is then ln Z with noise ``noise`` in both parts, at every tone the same.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.errors import OutOfRange
from sensorgen.models.sensor import Sensor

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

PARALLEL = 1e-9  # sine of the angle between two directions below which they are one: slopes are right to 1e-11


class Slopes(NamedTuple):
    """Relative derivatives of Z, tones on the last axis."""

    by_force_per_n: Complex
    by_position_per_m: Complex


class Bounds(NamedTuple):
    """Least standard errors of any unbiased estimate of a press; nan where they are undefined."""

    force_n: Real
    position_m: Real
    correlation: Real


@dataclass(frozen=True)
class Setup:
    """One press on one sensor, read by some tones.

    Attributes
    ----------
    sensor : Sensor
        What is pressed.
    frequency_hz : tuple of float
        Tones [Hz]; a tone that is there twice is read twice.
    noise : float
        Standard deviation of Re Z and of Im Z, each, as a share of abs(Z) [-].
    force_n, position_m : float
        The press: force [N], centre of the tip [m].
    highest_hz : float
        Highest tone that the instrument can give [Hz].
    assumed : str
        What is taken for granted of how the film gives way, where nobody solved it; or "".
    """

    sensor: Sensor
    frequency_hz: tuple[float, ...]
    noise: float
    force_n: float
    position_m: float
    highest_hz: float
    assumed: str = ""

    def bounds(self) -> Bounds:
        """What the tones tell of the press."""
        return bounds(slopes(self.sensor, self.frequency_hz, self.force_n, self.position_m), self.noise)

    def on(self, sensor: Sensor) -> "Setup":
        """The same press on another sensor."""
        return replace(self, sensor=sensor)


def slopes(sensor: Sensor, frequency_hz: ArrayLike, force_n: ArrayLike, position_m: ArrayLike) -> Slopes:
    """Exact d ln Z by force [1/N] and by position [1/m].

    Parameters
    ----------
    sensor : Sensor
        What is pressed.
    frequency_hz : (n,) array
        Tones [Hz].
    force_n, position_m : float or array
        Presses [N], [m]; they broadcast, and the tones come as a last axis.

    Raises
    ------
    OutOfRange
        As :meth:`sensorgen.models.sensor.Sensor.response`; also where Z is 0.
    """
    force, position = (np.asarray(value, float)[..., None] for value in (force_n, position_m))
    z, by_force, by_position = sensor.response(np.asarray(frequency_hz, float), force, position)
    if not z.all():
        raise OutOfRange("Z is 0: a relative change needs a resistance or a capacitance to change")
    return Slopes(by_force / z, np.where(force == 0, 0.0, by_position / z))  # at the ends rounding would leave dust


def bounds(found: Slopes, noise: float) -> Bounds:
    r"""Cramer-Rao bounds of force and position, both unknown.

    .. math:: \sigma_F = \frac{n}{\lVert a - (a \cdot b / b \cdot b)\, b \rVert}, \quad
              \sigma_x = \frac{n}{\lVert b - (a \cdot b / a \cdot a)\, a \rVert}, \quad
              a = \frac{\partial \ln Z}{\partial F}, \quad b = \frac{\partial \ln Z}{\partial x}

    with the real and imaginary parts of all tones as components: the inverse of the Fisher matrix
    [a.a, a.b; a.b, b.b]/n^2, by what is left of each slope beside the other so that no determinant cancels.

    Parameters
    ----------
    found : Slopes
        Tones on the last axis.
    noise : float
        n, of each part of Z, relative to abs(Z) [-].

    Returns
    -------
    Bounds
        sigma_F [N], sigma_x [m] and their correlation [-]; nan where the matrix is singular. Where position leaves
        no trace (b = 0, as without a force) only sigma_x is: sigma_F then is that of force alone, n/norm(a).

    Examples
    --------
    Two readings, one of force alone and one of position alone:

    >>> b = bounds(Slopes(np.array([2.0 + 0j, 0]), np.array([0j, 5.0])), 0.01)
    >>> float(b.force_n), float(b.position_m)
    (0.005, 0.002)
    """
    a, b = found
    with np.errstate(all="ignore"):
        force = _error(noise, _norm(_beside(a, b)), _norm(a))
        position = _error(noise, _norm(_beside(b, a)), _norm(b))
        return Bounds(force, position, np.where(np.isnan(position), np.nan, -_dot(a, b) / (_norm(a) * _norm(b))))


def _error(noise: float, left: Real, whole: Real) -> Real:
    return np.where(left > PARALLEL * whole, noise / left, np.nan)


def shares(found: Slopes) -> tuple[Real, Real]:
    """Share of each tone in what all tones tell of force, and of position, the other being unknown too [-].

    The information on one of them, 1/sigma^2, is a sum over tones; nan where it is undefined.
    """
    a, b = found
    with np.errstate(all="ignore"):
        force, position = (np.abs(_beside(u, v)) ** 2 for u, v in ((a, b), (b, a)))
        return force / force.sum(-1, keepdims=True), position / position.sum(-1, keepdims=True)


def undefined(setup: Setup, found: Slopes) -> str:
    """Why the position of a press is undefined, or nothing."""
    if setup.force_n == 0:
        return "without a force there is no press to locate"
    if not found.by_position_per_m.any():
        return "position leaves no trace in Z"
    if np.isnan(bounds(found, setup.noise).position_m):
        return "these tones cannot tell it from force: both move Z the same way"
    return ""


def bearable(sensor: Sensor, force_n: Real, position_m: Real) -> NDArray[np.bool_]:
    """Which presses the law of compression speaks of, in the broadcast shape of forces [N] and positions [m]."""
    stress = sensor.stress_pa(force_n, position_m)
    try:
        sensor.compression.capacitive_strain(stress)
    except OutOfRange:
        return np.array([_thins(sensor, one) for one in stress.ravel()]).reshape(stress.shape)
    return np.ones(stress.shape, bool)


def _thins(sensor: Sensor, stress_pa: np.float64) -> bool:
    try:
        sensor.compression.capacitive_strain(np.asarray(stress_pa))
    except OutOfRange:
        return False
    return True


def _dot(a: Complex, b: Complex) -> Real:
    return np.asarray((a.conj() * b).real.sum(-1))


def _norm(a: Complex) -> Real:
    return np.sqrt(_dot(a, a))


def _beside(a: Complex, b: Complex) -> Complex:
    """What is left of a beside b: a itself where b is nothing."""
    length = _dot(b, b)
    return np.asarray(a - (_dot(a, b) / np.where(length == 0, 1.0, length))[..., None] * b)
