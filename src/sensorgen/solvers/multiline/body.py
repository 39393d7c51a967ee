"""A body that touches the top of a stack: one more conductor, through the isolation where it touches."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sensorgen.solvers.multiline.lines import Real, inverse
from sensorgen.solvers.multiline.piece import Matrix

Complex = NDArray[np.complex128]


class Body(NamedTuple):
    """What ties a body to the ground of the instrument: a resistor and a capacitor in series.

    The defaults are the human body model of ANSI/ESDA/JEDEC JS-001, 1.5 kohm and 100 pF: an assumption, made for
    discharges, that stands here for a person on an isolating floor. The resistor lies in the skin, over the touch.

    Attributes
    ----------
    resistance_ohm : float
        Of the skin under the touch [ohm], above 0.
    capacitance_f : float
        From the body to ground [F].
    """

    resistance_ohm: float = 1500.0
    capacitance_f: float = 100e-12

    def admittance_s(self, frequency_hz: ArrayLike) -> Complex:
        """Admittance from behind the skin to ground [S]."""
        return np.asarray(2j * np.pi * np.asarray(frequency_hz, float) * self.capacitance_f)


class Touch(NamedTuple):
    """Where a body lies on the top, over the whole width, and what is between.

    Attributes
    ----------
    left_m, length_m : float
        Left edge and length of the touched stretch [m].
    isolation_f_per_m : float
        Capacitance of the isolation per length [F/m], above 0; inf where the body lies on the bare electrode.
    force_n : float
        With which it presses, its stress shared by the whole touch [N].
    """

    left_m: ArrayLike
    length_m: ArrayLike
    isolation_f_per_m: float
    force_n: ArrayLike = 0.0

    def admittance_s_per_m(self, frequency_hz: ArrayLike, body: Body) -> Complex:
        """Admittance from the top track through isolation and skin, where they touch [S/m]."""
        skin = body.resistance_ohm * np.asarray(self.length_m, float)
        susceptance = 2 * np.pi * np.asarray(frequency_hz, float) * self.isolation_f_per_m
        return np.asarray(1 / (skin + 1 / (1j * susceptance)) if np.isfinite(self.isolation_f_per_m) else 1 / skin + 0j)


def with_body(r: list[Any], y: list[Any], touching: Complex) -> tuple[list[Any], list[Any]]:
    """The sections of a touched stack: the body is a track without resistance, coupled under the touch alone."""
    return [[*section, 0.0] for section in r], [[*section, touching * (k == 1)] for k, section in enumerate(y)]


def reading(admittance_s: Matrix, across: Real, tie: Real, body_s: Complex, bridge: bool) -> Complex:
    """What the instrument reads between driven and low track [ohm].

    Parameters
    ----------
    admittance_s : array (..., n, n)
        Of the stack and its body [S].
    across, tie : array (n,)
        The films between low and driven track, and between low track and body; -1 where they lie against it [-].
    body_s : array
        Admittance from the body to ground [S].
    bridge : bool
        Whether what flows to ground through the body goes past the ammeter.
    """
    tied = inverse(admittance_s + body_s[..., None, None] * np.outer(tie, tie))
    voltages = tied @ across
    past = body_s * (voltages @ tie) if bridge else 0.0
    return np.asarray(voltages @ across / (1 - past))
