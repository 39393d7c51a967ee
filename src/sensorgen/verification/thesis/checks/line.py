"""Differential equations of the unpressed line: 2.1 to 2.17, and B.1 to B.19 with the same in other words.

Left sides come from :mod:`._field`, which knows impedances only; right sides are evaluated as they are printed.
"""

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import line, line_closed
from sensorgen.verification.thesis.checks._field import (
    AREA_M2,
    CAPACITANCE_F_PER_M,
    EPS_R,
    FILM_M,
    FREQUENCY_HZ,
    GAMMA,
    HEIGHT_M,
    INPUT_V,
    LENGTH_M,
    LINE,
    OMEGA,
    PLACES_M,
    RHO_OHM_M,
    STEP_M,
    TRACKS,
    WIDTH_M,
)
from sensorgen.verification.thesis.verdicts import Part

_X = PLACES_M
_PERIOD_S = 1 / FREQUENCY_HZ
_NO_CURRENT_OHM = 1e18
_SLICE_F = CAPACITANCE_F_PER_M * STEP_M
_SLICE_OHM = 1 / (1j * OMEGA * _SLICE_F)  # impedance of a slice between the tracks


def _in_time(phasor: NDArray[np.complex128]) -> NDArray[np.float64]:
    """What a phasor is an eighth of a period later."""
    return np.real(phasor * np.exp(1j * OMEGA * _PERIOD_S / 8))


def slice_current() -> list[Part]:
    """2.1, B.5: current through a slice from the potentials at its ends."""
    rise = LINE.top_v(_X + STEP_M / 2) - LINE.top_v(_X - STEP_M / 2)
    resistance = RHO_OHM_M * STEP_M / AREA_M2
    ours = _in_time(LINE.current_a.at(_X))
    first, second = _in_time(rise / resistance), _in_time(-AREA_M2 / RHO_OHM_M * rise / STEP_M)
    return [
        Part("I1 by the first expression", "A", ours, first, -first),
        Part("I1 by the second expression", "A", ours, second),
    ]


def current_in_time() -> list[Part]:
    """2.2, B.6: current from the slope of the potential, at one moment."""
    return [
        Part("I1(x, t)", "A", _in_time(LINE.current_a.at(_X)), -AREA_M2 / RHO_OHM_M * _in_time(LINE.top_v(_X, order=1)))
    ]


def current() -> list[Part]:
    """2.3, B.7: the same as phasors."""
    return [Part("I1(x)", "A", LINE.current_a.at(_X), -AREA_M2 / RHO_OHM_M * LINE.top_v(_X, order=1))]


def slope_of_current() -> list[Part]:
    """2.4, B.8."""
    slope = LINE.current_a.at(_X, order=1)
    return [Part("dI1/dx", "A/m", slope, -AREA_M2 / RHO_OHM_M * LINE.top_v(_X, order=2))]


def _leaves() -> NDArray[np.complex128]:
    """By how much the current of the top track grows over a slice."""
    return LINE.current_a.at(_X + STEP_M / 2) - LINE.current_a.at(_X - STEP_M / 2)


def current_lost() -> list[Part]:
    """2.11, B.11: what a slice's capacitor takes is missing behind it."""
    taken = LINE.difference_v.at(_X) / _SLICE_OHM
    return [Part("I1(x + dx) - I1(x)", "A", _leaves(), -taken)]


def current_by_difference() -> list[Part]:
    """2.12, B.12: the same from the potentials, with its sign."""
    printed = -(LINE.bottom_v(_X) - LINE.top_v(_X)) / _SLICE_OHM
    return [Part("I1(x + dx) - I1(x)", "A", _leaves(), printed, -printed)]


def current_by_permittivity() -> list[Part]:
    """B.14."""
    printed = 1j * OMEGA * EPS0_F_PER_M * EPS_R * WIDTH_M * STEP_M * (LINE.top_v(_X) - LINE.bottom_v(_X)) / FILM_M
    return [Part("I1(x + dx) - I1(x)", "A", _leaves(), printed, -printed)]


def slope_by_permittivity() -> list[Part]:
    """B.15."""
    printed = 1j * OMEGA * EPS0_F_PER_M * EPS_R * WIDTH_M * (LINE.top_v(_X) - LINE.bottom_v(_X)) / FILM_M
    return [Part("dI1/dx", "A/m", LINE.current_a.at(_X, order=1), printed, -printed)]


def slope_by_impedance() -> list[Part]:
    """2.13: an impedance stands where an admittance per length belongs."""
    difference = LINE.top_v(_X) - LINE.bottom_v(_X)
    slope = LINE.current_a.at(_X, order=1)
    return [Part("dI1/dx", "A/m", slope, 1j * _SLICE_OHM * difference, -difference / (_SLICE_OHM * STEP_M))]


def bend_by_permittivity() -> list[Part]:
    """B.16."""
    factor = RHO_OHM_M * 1j * OMEGA * EPS0_F_PER_M * EPS_R / (HEIGHT_M * FILM_M)
    printed = factor * (LINE.bottom_v(_X) - LINE.top_v(_X))
    return [Part("d2U1/dx2", "V/m2", LINE.top_v(_X, order=2), printed, -printed)]


def _by_cell() -> complex:
    """Gamma by an admittance per length, as 2.15 has to be."""
    return complex(RHO_OHM_M / (_SLICE_OHM * STEP_M) / AREA_M2)


def bend_by_impedance() -> list[Part]:
    """2.14."""
    difference = LINE.bottom_v(_X) - LINE.top_v(_X)
    printed = 1j * RHO_OHM_M * _SLICE_OHM * difference / HEIGHT_M
    return [Part("d2U1/dx2", "V/m2", LINE.top_v(_X, order=2), printed, -_by_cell() * difference)]


def _conduction() -> complex:
    """Gamma as the field has it: the bend of a potential over the difference of both."""
    return complex(np.mean(LINE.top_v(_X, order=2) / LINE.difference_v.at(_X)))


def conduction_by_impedance() -> list[Part]:
    """2.15."""
    return [Part("Gamma", "1/m2", _conduction(), 1j * RHO_OHM_M * _SLICE_OHM / HEIGHT_M, _by_cell())]


def conduction() -> list[Part]:
    """B.17."""
    return [Part("Gamma", "1/m2", _conduction(), GAMMA)]


def top_track() -> list[Part]:
    """2.16, B.18."""
    printed = GAMMA * (LINE.bottom_v(_X) - LINE.top_v(_X))
    return [Part("d2U1/dx2", "V/m2", LINE.top_v(_X, order=2), printed, -printed)]


def bottom_track() -> list[Part]:
    """2.17, B.19."""
    printed = GAMMA * (LINE.top_v(_X) - LINE.bottom_v(_X))
    return [Part("d2U2/dx2", "V/m2", LINE.bottom_v(_X, order=2), printed, -printed)]


def slice_impedance() -> list[Part]:
    """B.13: a slice whose tracks do not resist."""
    plain = TRACKS | {"top_resistivity_ohm_m": 0.0, "bottom_resistivity_ohm_m": 0.0}
    ours = line.impedance(line.PressedLine(length_m=STEP_M, **plain))
    whole = FILM_M / (1j * OMEGA * EPS0_F_PER_M * EPS_R * WIDTH_M * STEP_M)
    return [Part("by C", "ohm", ours, 1 / (1j * OMEGA * _SLICE_F)), Part("by permittivity", "ohm", ours, whole)]


def contacts() -> list[Part]:
    """B.1, B.2: what is connected, and the current that goes in, by the slope of the potential."""
    return [
        Part("U1(0)", "V", LINE.top_v(0.0), INPUT_V),
        Part("U2(0)", "V", LINE.bottom_v(0.0), 0.0, scale=INPUT_V),
        Part("I1(0)", "A", -AREA_M2 / RHO_OHM_M * LINE.top_v(0.0, order=1), LINE.input_a),
    ]


def far_end() -> list[Part]:
    """B.3: an open end, and one with so large a resistor that no current leaves; in both the potential ends flat."""
    shut = line.impedance(line.PressedLine(length_m=LENGTH_M, far_end=_NO_CURRENT_OHM, **TRACKS))
    flat = abs(LINE.input_a) * RHO_OHM_M / AREA_M2
    return [
        Part("Z", "ohm", LINE.impedance_ohm, shut),
        Part("dU1/dx at L", "V/m", LINE.top_v(LENGTH_M, order=1), 0.0, scale=flat),
    ]


def return_current() -> list[Part]:
    """B.4: as both tracks carry one current, only the sum of their resistances shows; here of unequal ones."""
    apart = {"top_resistivity_ohm_m": 0.5 * RHO_OHM_M, "bottom_resistivity_ohm_m": 1.5 * RHO_OHM_M}
    ours = line.impedance(line.PressedLine(length_m=LENGTH_M, **TRACKS | apart))
    printed = line_closed.uniform(line.PressedLine(length_m=LENGTH_M, **TRACKS))
    return [Part("Re Z", "ohm", np.real(ours), np.real(printed)), Part("Im Z", "ohm", np.imag(ours), np.imag(printed))]
