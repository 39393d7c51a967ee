r"""Elastic layers over springs: the part of a pressure on top that reaches the springs, by its wave number.

Of one layer of thickness h without shear on its faces, with :math:`E' = E / (1 - \nu^2)` and a = k h / 2, equal
pressures on both faces close it by S on each side, opposite ones bend it by A [m/Pa]:

.. math:: S = \frac{4}{E' k} \frac{\sinh^2 a}{\sinh 2a + 2a}, \quad A = \frac{4}{E' k} \frac{\cosh^2 a}{\sinh 2a - 2a}

On springs of compliance g the part :math:`T = (A - S) / (A + S + 2 g)` arrives. Johnson, Contact Mechanics, ch. 5;
thin layers bend as plates, :math:`T = 1 / (1 + D k^4 g)`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sensorgen.core.arrays import Real

_THIN = 1e-2  # k h below which sinh 2a - 2a is its series
_FINE = 32  # waves to a square
_DEEP = 300.0  # k h beyond which nothing arrives


@dataclass(frozen=True)
class ElasticLayer:
    """A layer.

    Attributes
    ----------
    thickness_m : float
        Thickness [m].
    youngs_modulus_pa, poisson_ratio : float
        Of its material [Pa], [-].
    """

    thickness_m: float
    youngs_modulus_pa: float
    poisson_ratio: float

    def compliances(self, k: Real) -> tuple[Real, Real]:
        """S and A at wave numbers, (n,) [m/Pa]; k > 0 [1/m]."""
        x = np.minimum(k * self.thickness_m, _DEEP)
        per = 4 / (self.youngs_modulus_pa / (1 - self.poisson_ratio**2) * k)
        sine, square = np.sinh(x), np.cosh(x / 2) ** 2
        bent = np.where(x < _THIN, x**3 / 6 * (1 + x**2 / 20), sine - x)
        return per * (square - 1) / (sine + x), per * square / bent


def transfer(k: Real, layers: Sequence[ElasticLayer], spring_pa_per_m: float) -> Real:
    """Part of the pressure on top of layers that reaches springs under them, by wave number, (n,) [-].

    Parameters
    ----------
    k : (n,) array
        Wave numbers, 0 or more [1/m].
    layers : sequence of ElasticLayer
        From the springs up; they lie loose on each other, and on the springs.
    spring_pa_per_m : float
        Stiffness of the springs per area, > 0 [Pa/m].

    Examples
    --------
    >>> import numpy as np
    >>> plate = ElasticLayer(1e-4, 1e9, 0.0)  # D = 83 uN m
    >>> transfer(np.array([0.0, 1000.0]), [plate], 1e9).round(3).tolist()
    [1.0, 0.923]
    """
    k = np.maximum(k, 1e-6)
    found, soft = np.ones_like(k), np.full_like(k, 1 / spring_pa_per_m)
    for layer in layers:
        s, a = layer.compliances(k)
        both = a + s + 2 * soft
        found = found * (a - s) / both
        soft = (2 * a * s + soft * (a + s)) / both
    return np.asarray(found)


def kernel(
    layers: Sequence[ElasticLayer], spring_pa_per_m: float, pitch_m: tuple[float, float], count: int = 16
) -> Real:  # fmt: skip
    """Mean pressures on squares of a lattice for 1 on the square at 0, (count, count) [-].

    Parameters
    ----------
    layers, spring_pa_per_m
        As of :func:`transfer`.
    pitch_m : (float, float)
        Of the lattice along both axes [m].
    count : int
        Squares each way, until it repeats.
    """
    turns = np.fft.fftfreq(_FINE * count, 1 / _FINE)  # per pitch
    k = 2 * np.pi * np.hypot(turns[:, None] / pitch_m[0], turns[None, :] / pitch_m[1])
    square = np.sinc(turns)[:, None] ** 2 * np.sinc(turns)[None, :] ** 2
    part = square * transfer(k.ravel(), layers, spring_pa_per_m).reshape(k.shape)
    return np.asarray(np.fft.ifft2(part.reshape(_FINE, count, _FINE, count).sum((0, 2))).real)
