"""The line and its lumped readings, at rest and pressed: 2.24, 2.25, B.49 to B.51, B.54, 5.1, circuits of chapter 2."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import compression, line
from sensorgen.models.sensor import Sensor
from sensorgen.solvers.line.inputs import read
from sensorgen.verification.thesis.checks import _field
from sensorgen.verification.thesis.checks._field import (
    CAPACITANCE_F_PER_M,
    FILM_M,
    HEIGHT_M,
    LENGTH_M,
    RHO_OHM_M,
    WIDTH_M,
)
from sensorgen.verification.thesis.items import ItemPart, Parts

_FORCE_N, _PATCH_M, _LEFT_M, _MODULUS_PA = 3.0, 0.01, 0.045, 6e6  # Table 3.1; the tip of Table C.1 in the middle
_S_PER_N = 0.02  # a piezoresistance that shows; no source gives one
_TONES_HZ = np.array([1.1e3, 99.7e3])
_CELLS = 2000  # of a ladder: its error is below 1e-6 then
_BEFORE = 0.5  # share of a cell's capacitance before its resistor
_LEAST_HZ, _MOST_HZ = 1e5, 2e6
_GAUSS = 24  # points of a quadrature

Matrix = NDArray[np.complex128]

_TRACKS: dict[str, Any] = {**_field.TRACKS, "length_m": LENGTH_M}
_PRESS = {"force_n": _FORCE_N, "modulus_pa": _MODULUS_PA, "tip_m": _PATCH_M, "left_m": _LEFT_M}
_RESISTANCE_OHM = 2 * RHO_OHM_M * LENGTH_M / (HEIGHT_M * WIDTH_M)
_CAPACITANCE_F = CAPACITANCE_F_PER_M * LENGTH_M


def _z(**given: Any) -> Any:
    """Impedance of the line by our model, of these inputs in place of its own [ohm]."""
    return line.impedance(line.PressedLine(**_TRACKS | given))


def by_powers() -> Parts:
    """2.24, 5.1, B.54: R from what the tracks turn into heat, X from what the film stores, per current squared."""
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
    x = (nodes + 1) / 2 * LENGTH_M
    current, voltage = _field.LINE.current_a.at(x), _field.LINE.difference_v.at(x)
    heat = weights @ abs(current) ** 2 * _RESISTANCE_OHM / 2
    stored = weights @ abs(voltage) ** 2 * _field.OMEGA * _CAPACITANCE_F / 2
    printed = complex(heat, -stored) / abs(_field.LINE.input_a) ** 2
    return _field.both_parts("Z", "ohm", _field.LINE.impedance_ohm, printed)


def corner() -> Parts:
    """2.25: where R and the size of X are alike: of one R and one C, and of the line, whose R and C vary."""
    from scipy.optimize import brentq

    def apart(ln_hz: float) -> float:
        z = _z(frequency_hz=np.exp(ln_hz))
        return float((z.real + z.imag) / abs(z))

    sensor = Sensor(
        LENGTH_M, WIDTH_M, (HEIGHT_M,) * 2, (RHO_OHM_M,) * 2, CAPACITANCE_F_PER_M, compression.unconfined(_MODULUS_PA)
    )
    alike = float(np.exp(brentq(apart, np.log(_LEAST_HZ), np.log(_MOST_HZ), xtol=1e-14)))
    lowest = _z(frequency_hz=_TONES_HZ[0])
    by_lowest = -_TONES_HZ[0] * lowest.imag / lowest.real  # 1/(2 pi R C) of its R and C
    printed = 1 / (2 * np.pi * _RESISTANCE_OHM * _CAPACITANCE_F)
    yield ItemPart("1/(2 pi R C), R of both tracks", "Hz", sensor.corner_frequency_hz(), printed)
    yield ItemPart("where R and |X| of the line are alike", "Hz", alike, float(by_lowest))


def by_frequency() -> Parts:
    """7.1.2: R hardly depends on the frequency, and X does; no numbers are given but the tones."""
    low, high = _z(frequency_hz=_TONES_HZ)
    changes = abs(np.log(high.real / low.real)) / abs(np.log(high.imag / low.imag))
    yield ItemPart("change of R over that of |X|, 1.1 to 99.7 kHz", "", changes, 0.01, shown=3, limit=True)
    yield ItemPart("X at 1.1 kHz over X at 99.7 kHz, by 1/f", "", low.imag / high.imag, _TONES_HZ[1] / _TONES_HZ[0])


def thinner() -> Parts:
    """B.49: by the area of the electrodes, and by that under the tip."""
    stress = np.asarray(_FORCE_N / (WIDTH_M * _PATCH_M))
    ours = -float(compression.unconfined(_MODULUS_PA).capacitive_strain(stress)[0]) * FILM_M
    printed, corrected = (-_FORCE_N * FILM_M / (WIDTH_M * length * _MODULUS_PA) for length in (LENGTH_M, _PATCH_M))
    yield ItemPart("change of thickness", "m", ours, printed, corrected)


def piezoresistive() -> Parts:
    """B.50: a line that is pressed all along, of a rigid film, is one of more resistivity."""
    stiff = {"modulus_pa": 1e30, "tip_m": LENGTH_M, "force_n": _FORCE_N, "frequency_hz": _TONES_HZ}
    ours = _z(**stiff, top_piezoresistance_per_n=_S_PER_N, bottom_piezoresistance_per_n=_S_PER_N)
    return _field.both_parts("Z", "ohm", ours, _field.unpressed_ohm(RHO_OHM_M * (1 + _S_PER_N * _FORCE_N), _TONES_HZ))


def three_sections() -> Parts:
    """B.51: product of the three sections' matrices as in B.44 to B.47; and as textbooks have it."""
    ours = [complex(line.impedance(_under_tip(tone))) for tone in _TONES_HZ]
    printed, textbook = ([_product(tone, of) for tone in _TONES_HZ] for of in (_by_exponentials, _by_functions))
    yield from _field.both_parts("Z", "ohm", ours, printed)
    yield from _field.both_parts("Z by cosh and sinh", "ohm", ours, textbook)


def _under_tip(tone_hz: float) -> line.PressedLine:
    return line.PressedLine(**_TRACKS | _PRESS | {"frequency_hz": tone_hz})


def _product(tone_hz: float, matrix: Callable[[complex, complex], Matrix]) -> complex:
    """-A22/A21 of the product of the sections' matrices, each by its gamma l and characteristic impedance."""
    whole = np.eye(2, dtype=complex)
    for r, y, length in zip(*read(_under_tip(tone_hz)).sections(), strict=True):
        whole = matrix(complex(np.sqrt(r * y) * length), complex(np.sqrt(r / y))) @ whole
    return complex(-whole[1, 1] / whole[1, 0])


def _by_exponentials(z: complex, zc: complex) -> Matrix:
    """B.44 to B.47."""
    e = np.exp(z)
    same, other = (1 + e**2) / (2 * e), -(e**2 - 1) / (2 * e)
    return np.array([[same, other * zc], [other / zc, same]])


def _by_functions(z: complex, zc: complex) -> Matrix:
    return np.array([[np.cosh(z), -np.sinh(z) * zc], [-np.sinh(z) / zc, np.cosh(z)]])


def ladder() -> Parts:
    """2.3, 2.4, B.4, B.5: a chain of resistors and capacitors, each cell's capacitance halved between its ends."""
    given, admittance = _under_tip(_TONES_HZ[1]), 0j
    for r, y, length in reversed(list(zip(*read(given).sections(), strict=True))):
        ohm, half = complex(r * length / _CELLS), complex(y * length / _CELLS) * _BEFORE
        for _ in range(_CELLS):
            admittance += complex(y * length / _CELLS) - half
            admittance = admittance / (1 + ohm * admittance) + half
    return _field.both_parts("Z", "ohm", line.impedance(given), 1 / admittance)


def cog_resistance() -> Parts:
    """2.9: a conductor of a cog's size, as our tracks count theirs."""
    height, width, across = 0.5e-3, 0.5e-3, 0.01
    sensor = Sensor(height, across, (width,) * 2, (RHO_OHM_M, 0.0), 1e-9, compression.unconfined(_MODULUS_PA))
    yield ItemPart("R_c", "ohm", sensor.resistance_ohm(), RHO_OHM_M * height / (across * width))


def reactance_of(eps_r: float) -> Parts:
    """2.6, 2.8: the size of a capacitor's reactance."""
    tone = float(_TONES_HZ[0])
    printed = FILM_M / (2 * np.pi * tone * EPS0_F_PER_M * eps_r * WIDTH_M * LENGTH_M)
    ours = _z(frequency_hz=tone, top_resistivity_ohm_m=0.0, bottom_resistivity_ohm_m=0.0, eps_r=eps_r)
    yield ItemPart("size of X", "ohm", float(abs(ours)), printed)
