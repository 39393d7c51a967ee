r"""Fisher information of readings on force and position, and the Cramer-Rao bound.

The real and the imaginary part of Z at each frequency carry Gaussian noise of standard deviation ``noise`` \|Z\|, all
independent. Divided by Z a reading is then ln Z with noise ``noise`` in both parts, the same at every frequency.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import OutOfRange
from sensorgen.models.sensor import Response, Sensor
from sensorgen.prediction.identifiability.results import StandardErrors, finite
from sensorgen.prediction.inference import cramer_rao, orthogonal


class Slopes(NamedTuple):
    """Relative derivatives of Z, frequencies on the last axis."""

    by_force_per_n: Complex
    by_position_per_m: Complex


class LeastErrors(NamedTuple):
    """Least standard errors of any unbiased estimate of a press; nan where they are undefined."""

    force_n: Real
    position_m: Real
    correlation: Real


@dataclass(frozen=True)
class Setup:
    """One press on one sensor, read at some frequencies.

    Attributes
    ----------
    sensor : Sensor
        That is pressed.
    frequency_hz : tuple of float
        Frequencies [Hz]; one that is listed twice is read twice.
    noise : float
        Standard deviation of Re Z and of Im Z, each, relative to abs(Z) [-].
    force_n, position_m : float
        The press: force [N], centre of the tip [m].
    highest_hz : float
        Highest frequency of the instrument [Hz].
    assumed : str
        Assumption on the law of compression of a cell that was not solved, or "".
    """

    sensor: Sensor
    frequency_hz: tuple[float, ...]
    noise: float
    force_n: float
    position_m: float
    highest_hz: float
    assumed: str = ""

    def bounds(self) -> LeastErrors:
        """Bounds of the press by these readings."""
        return bounds(slopes(self.sensor, self.frequency_hz, self.force_n, self.position_m), self.noise)

    def on(self, sensor: Sensor) -> "Setup":
        """Press another sensor alike."""
        return replace(self, sensor=sensor)


def slopes(sensor: Sensor, frequency_hz: ArrayLike, force_n: ArrayLike, position_m: ArrayLike) -> Slopes:
    """Exact d ln Z by force [1/N] and by position [1/m].

    Parameters
    ----------
    sensor : Sensor
        That is pressed.
    frequency_hz : (n,) array
        Frequencies [Hz].
    force_n, position_m : float or array
        Presses [N], [m]; they broadcast, and the frequencies are a last axis.

    Raises
    ------
    OutOfRange
        As :meth:`sensorgen.models.sensor.Sensor.response`; also where Z is 0.
    """
    force, position = (np.asarray(value, float)[..., None] for value in (force_n, position_m))
    return relative(sensor.response(np.asarray(frequency_hz, float), force, position), force)


def relative(response: Response, force_n: ArrayLike) -> Slopes:
    """Derivatives of ln Z, of those of Z under a force [N]; errors as :func:`slopes`."""
    z, by_force, by_position = response
    if not z.all():
        raise OutOfRange("Z is 0: a relative change needs a resistance or a capacitance to change")
    return Slopes(
        by_force / z, np.where(np.equal(force_n, 0), 0.0, by_position / z)
    )  # at the ends rounding would leave residues


def bounds(found: Slopes, noise: float) -> LeastErrors:
    """Cramer-Rao bounds of force and position, both unknown: see :func:`sensorgen.prediction.inference.cramer_rao`.

    Slopes are those of ln Z; real and imaginary parts of all frequencies count alike.

    Parameters
    ----------
    found : Slopes
        Frequencies on the last axis.
    noise : float
        Of each part of Z, relative to abs(Z) [-].

    Returns
    -------
    Bounds
        sigma_F [N], sigma_x [m] and their correlation [-]; nan where the matrix is singular. Where Z does not
        depend on position (b = 0, as without a force) only sigma_x is nan: sigma_F then is n/norm(a).

    Examples
    --------
    Two readings, one of force alone and one of position alone:

    >>> b = bounds(Slopes(np.array([2.0 + 0j, 0]), np.array([0j, 5.0])), 0.01)
    >>> float(b.force_n), float(b.position_m)
    (0.005, 0.002)
    """
    force, position, correlation = cramer_rao(*found)
    return LeastErrors(noise * force, noise * position, correlation)


def shares(found: Slopes) -> tuple[Real, Real]:
    """Share of each frequency in the information on force, and on position, the other being unknown too [-].

    The information on one of them, 1/sigma^2, is a sum over frequencies; nan where it is undefined.
    """
    a, b = found
    with np.errstate(all="ignore"):
        force, position = (np.abs(orthogonal(u, v)) ** 2 for u, v in ((a, b), (b, a)))
        return force / force.sum(-1, keepdims=True), position / position.sum(-1, keepdims=True)


def undefined(setup: Setup, found: Slopes) -> str:
    """Why the position of a press is undefined, or ""."""
    if setup.force_n == 0:
        return "without a force there is no press to locate"
    if not found.by_position_per_m.any():
        return "Z does not depend on position"
    if np.isnan(bounds(found, setup.noise).position_m):
        return "these frequencies cannot separate it from force: both change Z in the same direction"
    return ""


def bearable(sensor: Sensor, force_n: Real, position_m: Real) -> Mask:
    """Where the law of compression is defined, in the broadcast shape of forces [N] and positions [m]."""

    def defined(stress_pa: Real) -> bool:
        try:
            sensor.compression.capacitive_strain(stress_pa)
        except OutOfRange:
            return False
        return True

    stress = sensor.stress_pa(force_n, position_m)
    if defined(stress):
        return np.ones(stress.shape, bool)
    return np.array([defined(np.asarray(one)) for one in stress.ravel()]).reshape(stress.shape)


def standard_errors(limits: LeastErrors) -> StandardErrors:
    """Bounds of one press, None where they are undefined."""
    return StandardErrors(
        sigma_force_n=finite(limits.force_n),
        sigma_position_m=finite(limits.position_m),
        correlation=finite(limits.correlation),
    )
