"""Differential equations of the unpressed line: 2.1 to 2.17, and B.1 to B.19 with the same in other words.

Left sides come from :mod:`._field`, which knows impedances only; right sides are evaluated as they are printed, and
where they are misprinted once more as they have to be.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import line
from sensorgen.verification.thesis.checks import _field
from sensorgen.verification.thesis.checks._field import EPS_R, FILM_M, GAMMA, INPUT_V, LENGTH_M, LINE, OMEGA, TRACKS
from sensorgen.verification.thesis.items import ItemPart, Parts

_X = _field.PLACES_M
_DX = _field.STEP_M
_A_OVER_RHO, _RHO_OVER_H = _field.AREA_M2 / _field.RHO_OHM_M, _field.RHO_OHM_M / _field.HEIGHT_M
_SLICE_F = _field.CAPACITANCE_F_PER_M * _DX
_SLICE_OHM = 1 / (1j * OMEGA * _SLICE_F)  # impedance of a slice between the tracks
_SLICE_S_PER_M = 1j * OMEGA * EPS0_F_PER_M * EPS_R * _field.WIDTH_M / FILM_M  # the same by permittivity, per length
_GAMMA_BY_CELL = _A_OVER_RHO**-1 / (_SLICE_OHM * _DX)  # by an admittance per length, as 2.15 has to be
_NO_CURRENT_OHM = 1e18


def _u(*, order: int = 0) -> NDArray[np.complex128]:
    """U1 or a derivative of it."""
    return LINE.top_v(_X, order)


def _difference() -> NDArray[np.complex128]:
    """U1 - U2."""
    return LINE.top_v(_X) - LINE.bottom_v(_X)


def _rise(field: Callable[[NDArray[np.float64]], NDArray[np.complex128]]) -> NDArray[np.complex128]:
    """By how much a field grows over a slice."""
    return field(_X + _DX / 2) - field(_X - _DX / 2)


def _in_time(phasor: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Value of a phasor an eighth of a period later."""
    return np.real(phasor * np.exp(1j * np.pi / 4))


def _gamma() -> complex:
    """Gamma as the field has it: the bend of a potential over the difference of both."""
    return complex(np.mean(_u(order=2) / LINE.difference_v.at(_X)))


def _wrong_sign(name: str, unit: str, ours: NDArray[np.complex128], printed: NDArray[np.complex128]) -> Parts:
    yield ItemPart(name, unit, ours, printed, -printed)


def current_in_time() -> Parts:
    """2.2, B.6: current from the slope of the potential, at one moment."""
    yield ItemPart("I1(x, t)", "A", _in_time(LINE.current_a.at(_X)), -_A_OVER_RHO * _in_time(_u(order=1)))


def current() -> Parts:
    """2.3, B.7: the current from that slope, as phasors."""
    yield ItemPart("I1(x)", "A", LINE.current_a.at(_X), -_A_OVER_RHO * _u(order=1))


def slope_of_current() -> Parts:
    """2.4, B.8: slopes of both."""
    yield ItemPart("dI1/dx", "A/m", LINE.current_a.at(_X, 1), -_A_OVER_RHO * _u(order=2))


def current_lost() -> Parts:
    """2.11, B.11: current that a slice's capacitor takes is missing behind it."""
    yield ItemPart("I1(x + dx) - I1(x)", "A", _rise(LINE.current_a.at), -LINE.difference_v.at(_X) / _SLICE_OHM)


def current_by_difference() -> Parts:
    """2.12, B.12: that current from the potentials."""
    return _wrong_sign("I1(x + dx) - I1(x)", "A", _rise(LINE.current_a.at), _difference() / _SLICE_OHM)


def current_by_permittivity() -> Parts:
    """B.14: that current from the potentials, by permittivity."""
    return _wrong_sign("I1(x + dx) - I1(x)", "A", _rise(LINE.current_a.at), _SLICE_S_PER_M * _DX * _difference())


def slope_by_permittivity() -> Parts:
    """B.15: slope of the current by permittivity."""
    return _wrong_sign("dI1/dx", "A/m", LINE.current_a.at(_X, 1), _SLICE_S_PER_M * _difference())


def slope_by_impedance() -> Parts:
    """2.13: an impedance stands where an admittance per length belongs."""
    printed, corrected = 1j * _SLICE_OHM * _difference(), -_difference() / (_SLICE_OHM * _DX)
    yield ItemPart("dI1/dx", "A/m", LINE.current_a.at(_X, 1), printed, corrected)


def bend_by_permittivity() -> Parts:
    """B.16: bend of the potential by permittivity."""
    printed = -_RHO_OVER_H * 1j * OMEGA * EPS0_F_PER_M * EPS_R / FILM_M * _difference()
    return _wrong_sign("d2U1/dx2", "V/m2", _u(order=2), printed)


def bend_by_impedance() -> Parts:
    """2.14: bend of the potential by impedance."""
    printed, corrected = -1j * _RHO_OVER_H * _SLICE_OHM * _difference(), _GAMMA_BY_CELL * _difference()
    yield ItemPart("d2U1/dx2", "V/m2", _u(order=2), printed, corrected)


def conduction_by_impedance() -> Parts:
    """2.15: the conduction parameter by impedance."""
    yield ItemPart("Gamma", "1/m2", _gamma(), 1j * _RHO_OVER_H * _SLICE_OHM, _GAMMA_BY_CELL)


def conduction() -> Parts:
    """B.17: the conduction parameter."""
    yield ItemPart("Gamma", "1/m2", _gamma(), GAMMA)


def top_track() -> Parts:
    """2.16, B.18."""
    return _wrong_sign("d2U1/dx2", "V/m2", _u(order=2), -GAMMA * _difference())


def bottom_track() -> Parts:
    """2.17, B.19."""
    return _wrong_sign("d2U2/dx2", "V/m2", LINE.bottom_v(_X, 2), GAMMA * _difference())


def contacts() -> Parts:
    """B.1, B.2: potentials of the contacts, and the current that goes in, by the slope of the potential."""
    yield ItemPart("U1(0)", "V", LINE.top_v(0.0), INPUT_V)
    yield ItemPart("U2(0)", "V", LINE.bottom_v(0.0), 0.0, scale=INPUT_V)
    yield ItemPart("I1(0)", "A", -_A_OVER_RHO * LINE.top_v(0.0, 1), LINE.input_a)


def slice_current() -> Parts:
    """2.1, B.5: current through a slice from the potentials at its ends."""
    ours, rise = _in_time(LINE.current_a.at(_X)), _rise(LINE.top_v)
    first, second = _in_time(rise / (_DX / _A_OVER_RHO)), _in_time(-_A_OVER_RHO * rise / _DX)
    yield ItemPart("I1 by the first expression", "A", ours, first, -first)
    yield ItemPart("I1 by the second expression", "A", ours, second)


def slice_impedance() -> Parts:
    """B.13: a slice whose tracks do not resist."""
    plain = TRACKS | {"top_resistivity_ohm_m": 0.0, "bottom_resistivity_ohm_m": 0.0}
    ours = line.impedance(line.PressedLine(length_m=_DX, **plain))
    by_permittivity = 1 / (_SLICE_S_PER_M * _DX)
    yield ItemPart("by C", "ohm", ours, _SLICE_OHM)
    yield ItemPart("by permittivity", "ohm", ours, by_permittivity)


def far_end() -> Parts:
    """B.3: an open end, and one with so large a resistor that no current leaves; in both the potential ends flat."""
    shut = line.impedance(line.PressedLine(length_m=LENGTH_M, far_end=_NO_CURRENT_OHM, **TRACKS))
    yield ItemPart("Z", "ohm", LINE.impedance_ohm, shut)
    yield ItemPart("dU1/dx at L", "V/m", LINE.top_v(LENGTH_M, 1), 0.0, scale=abs(LINE.input_a) / _A_OVER_RHO)


def return_current() -> Parts:
    """B.4: as both tracks carry one current, only the sum of their resistances shows; here of unequal ones."""
    rho = _field.RHO_OHM_M
    apart = {"top_resistivity_ohm_m": 0.5 * rho, "bottom_resistivity_ohm_m": 1.5 * rho}
    ours = line.impedance(line.PressedLine(length_m=LENGTH_M, **TRACKS | apart))
    return _field.both_parts("Z", "ohm", ours, _field.unpressed_ohm())
