"""Potentials and currents along an unpressed line, from nothing but impedances that our model gives.

A piece of line with its far end open and shorted gives the piece as a two-port, by reciprocity and symmetry; the whole
line then says what flows into it. So the thesis's differential equations are tested against an independent model.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import line
from sensorgen.verification.thesis.items import ItemPart, Parts

LENGTH_M, WIDTH_M, HEIGHT_M, FILM_M = 0.1, 0.01, 3e-4, 6e-4  # Table 3.1
EPS_R = 4.68
RHO_OHM_M = 0.135  # Table C.1, mean of both electrodes: the thesis's equations know only one
FREQUENCY_HZ = 99.7e3
OMEGA = 2 * np.pi * FREQUENCY_HZ
STEP_M = 1e-6  # that stands for a Delta x
INPUT_V = 1.0

TRACKS = {
    "width_m": WIDTH_M, "top_thickness_m": HEIGHT_M, "bottom_thickness_m": HEIGHT_M, "top_resistivity_ohm_m": RHO_OHM_M,
    "bottom_resistivity_ohm_m": RHO_OHM_M, "film_m": FILM_M, "eps_r": EPS_R, "frequency_hz": FREQUENCY_HZ,
}  # fmt: skip

AREA_M2 = HEIGHT_M * WIDTH_M
CAPACITANCE_F_PER_M = EPS0_F_PER_M * EPS_R * WIDTH_M / FILM_M
GAMMA = 1j * OMEGA * EPS0_F_PER_M * EPS_R * RHO_OHM_M / (HEIGHT_M * FILM_M)  # B.17
K = np.sqrt(2 * GAMMA)

_DEGREE = 16  # of the polynomials: the fields' own are below rounding from 12 on


def unpressed_ohm(rho_ohm_m: float = RHO_OHM_M, frequency_hz: ArrayLike = FREQUENCY_HZ) -> Complex:
    r"""Impedance of the unpressed line in one equation, 2.18 and B.53.

    .. math:: Z = \frac{\sqrt{2} \rho\, (1 + e^{2 \sqrt{2 \Gamma} L})}{H \sqrt{\Gamma} W (-1 + e^{2 \sqrt{2 \Gamma} L})}
    """
    gamma = GAMMA * rho_ohm_m / RHO_OHM_M * np.asarray(frequency_hz) / FREQUENCY_HZ
    e = np.exp(2 * np.sqrt(2 * gamma) * LENGTH_M)
    return np.asarray(np.sqrt(2) * rho_ohm_m * (1 + e) / (AREA_M2 * np.sqrt(gamma) * (-1 + e)))


def both_parts(name: str, unit: str, ours: ArrayLike, printed: ArrayLike) -> Parts:
    """Both parts by themselves: of an impedance, the real one is small and all that tells a position."""
    parts = (("Re", np.real), ("Im", np.imag))
    for which, part in parts:
        yield ItemPart(f"{which} {name}", unit, part(ours), part(printed))


class Smooth:
    """A field along the line, and its derivatives."""

    def __init__(self, field: Callable[[Real], Complex]) -> None:
        """Interpolate between the ends."""
        places = chebyshev.chebpts1(_DEGREE + 1)
        values = field((places + 1) / 2 * LENGTH_M)
        self._terms: NDArray[Any] = np.linalg.solve(chebyshev.chebvander(places, _DEGREE), values)

    def at(self, x_m: ArrayLike, order: int = 0) -> Complex:
        """Value of the field, or a derivative of it, per metre to the power of the order."""
        terms = chebyshev.chebder(self._terms, order) * (2 / LENGTH_M) ** order
        return np.asarray(chebyshev.chebval(2 * np.asarray(x_m) / LENGTH_M - 1, terms))


class ThesisLine:
    """The line of Table 3.1 at its highest tone, 1 V on its top track and the bottom one earthed."""

    @cached_property
    def impedance_ohm(self) -> complex:
        """At the contacts."""
        return complex(line.impedance(line.PressedLine(length_m=LENGTH_M, **TRACKS)))

    @cached_property
    def input_a(self) -> complex:
        """Current into the top track."""
        return INPUT_V / self.impedance_ohm

    @cached_property
    def difference_v(self) -> Smooth:
        """U1 - U2."""
        return Smooth(lambda x: self._behind(x)[0])

    @cached_property
    def current_a(self) -> Smooth:
        """I1; I2 is its opposite, since what goes out on one track comes back on the other."""
        return Smooth(lambda x: self._behind(x)[1])

    def top_v(self, x_m: ArrayLike, order: int = 0) -> Complex:
        """U1 or a derivative: both tracks resist alike, so that U1 + U2 is the same everywhere."""
        return ((order == 0) * INPUT_V + self.difference_v.at(x_m, order)) / 2

    def bottom_v(self, x_m: ArrayLike, order: int = 0) -> Complex:
        """U2 or a derivative."""
        return ((order == 0) * INPUT_V - self.difference_v.at(x_m, order)) / 2

    def transfer(self, x_m: ArrayLike) -> tuple[Complex, Complex, Complex]:
        """A11 = A22, A12 and A21 of a piece of the line, from its impedances."""
        length = np.asarray(x_m, float)
        far_open = line.impedance(line.PressedLine(length_m=length, **TRACKS))
        far_short = line.impedance(line.PressedLine(length_m=length, far_end="short", **TRACKS))
        same = np.sqrt(far_open / (far_open - far_short))
        return same, -far_short * same, -same / far_open

    def _behind(self, x_m: ArrayLike) -> tuple[Complex, Complex]:
        same, a12, a21 = self.transfer(x_m)
        return same * INPUT_V + a12 * self.input_a, a21 * INPUT_V + same * self.input_a


LINE = ThesisLine()
PLACES_M = np.array([0.013, 0.031, 0.057, 0.086])  # where equations along the line are tried
