r"""How far a complex capacitance may be off, where dielectrics lose or leak.

Neither of Dirichlet's and Thomson's principles bounds a complex value, but both fields together do. Let u be any
continuous potential with its values at the electrodes, and D any flux without sources. What u misses, e, is zero at the
electrodes, so

.. math:: \int \varepsilon |\nabla u|^2 - C = \int \varepsilon \nabla e \cdot \nabla e, \qquad
          \int \rho\,|\nabla e|^2 \le \eta^2 = \int |\varepsilon \nabla u - D|^2 / \rho

with :math:`\rho = \mathrm{Re}(\varepsilon e^{j\phi}) > 0` for any angle :math:`\phi` (Cauchy and Schwarz). Hence C lies
within :math:`\kappa \eta^2` of the energy of u, :math:`\kappa = \max |\varepsilon| / \rho`.

Let f be what D misses; e and f are orthogonal, conjugated or not. Of the middle of both principles' values,

.. math:: M - C = \tfrac12 \int (\varepsilon \nabla e - f) \cdot (\nabla e + f / \varepsilon), \qquad
          |M - C| \le \tfrac12 \eta^2 \sqrt{(1 + t) / (1 - t)}

with t the largest tangent of an angle of :math:`\varepsilon e^{j\phi}`, below 1. Without losses this is half the
distance of the two bounds, which is :math:`\eta^2`.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sensorgen.core.bounds import Disc
from sensorgen.solvers.electrostatics.bounds import ROUNDING


@dataclass(frozen=True)
class Turned:
    """Permittivities turned by one angle, so that all real parts are as far above 0 as they can be.

    Attributes
    ----------
    weight : dict of complex to float
        rho of each permittivity [-].
    tangent : float
        Largest of their angles [-]; below 1 where losses are positive.
    """

    weight: dict[complex, float]
    tangent: float

    def kappa(self) -> float:
        """Largest modulus over rho [-]."""
        return float(np.hypot(1.0, self.tangent))


def turned(permittivity: Iterable[complex]) -> Turned:
    """The best angle for some permittivities, whose real parts are above 0.

    >>> round(turned([1.0, 1 - 1j]).tangent, 3)
    0.414
    """
    values = list(permittivity)
    angles = np.angle(values)
    back = np.exp(-1j * (angles.min() + angles.max()) / 2)
    return Turned({eps: float((eps * back).real) for eps in values}, float(np.tan(np.ptp(angles) / 2)))


@dataclass(frozen=True)
class Fields:
    """A potential and a flux of one cell, each integral over eps0: [mm], or per depth in two dimensions [-].

    Attributes
    ----------
    lower : complex
        Thomson's functional of the flux.
    energy, part : complex
        Of the potential; and weighted with how often each region occurs beyond the least.
    size : float
        As ``part``, of the modulus squared of the field, times rho.
    apart : float
        eta squared.
    unknowns : int
        That the larger of the two systems couples.
    rounding : float
        Share by which doubles may be off, where it was estimated; an answer allows for ``ROUNDING`` at least [-].
    """

    lower: complex
    energy: complex
    part: complex
    size: float
    apart: float
    unknowns: int
    rounding: float = 0.0


def disc(found: Fields, turn: Turned, shares: Sequence[float]) -> Disc:
    r"""Where the capacitance of the whole sensor lies, whose cell's regions occur as often as ``shares`` say.

    In the regions that occur more often, by w up to W, the energy is off by no more than
    :math:`\kappa (2 \sqrt{W s}\,\eta + W \eta^2)`, s the size of the part.
    """
    least, most = min(shares), max(shares) - min(shares)
    beyond = 2 * np.sqrt(most * found.size * found.apart) + most * found.apart
    return min(
        (
            _grown(least * c + found.part, least * off + turn.kappa() * beyond, found.rounding)
            for c, off in _whole(found, turn)
        ),
        key=lambda near: near.radius,
    )


def _whole(found: Fields, turn: Turned) -> Iterator[tuple[complex, float]]:
    """Values of the whole cell, and how far each may be off."""
    t = turn.tangent
    yield found.energy, turn.kappa() * found.apart
    if t < 1:
        yield (found.energy + found.lower) / 2, found.apart / 2 * np.sqrt((1 + t) / (1 - t))


def _grown(centre: complex, off: float, rounding: float) -> Disc:
    """A disc with room for rounding."""
    return Disc(complex(centre), float(off + max(rounding, ROUNDING) * abs(centre)))
