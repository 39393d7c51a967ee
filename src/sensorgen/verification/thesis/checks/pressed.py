"""The pressed line and its lumped readings: 2.24, 2.25, B.49 to B.51, B.54, 5.1, and the circuits of chapter 2."""

from typing import Any

import numpy as np

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import compression, line, line_abcd, line_closed, line_fit, line_ladder
from sensorgen.models.sensor import Sensor
from sensorgen.verification.thesis.checks._field import (
    CAPACITANCE_F_PER_M,
    EPS_R,
    FILM_M,
    HEIGHT_M,
    LENGTH_M,
    RHO_OHM_M,
    WIDTH_M,
)
from sensorgen.verification.thesis.verdicts import Part

_FORCE_N, _PATCH_M, _LEFT_M, _MODULUS_PA = 3.0, 0.01, 0.045, 6e6  # Table 3.1; the tip of Table C.1 in the middle
_S_PER_N = 0.02  # a piezoresistance that shows; no source gives one
_TONES_HZ = np.array([1.1e3, 99.7e3])
_CELLS = 2000  # of a ladder: its error is below 1e-6 then
_LEAST_HZ, _MOST_HZ, _HALVINGS = 1e5, 1e7, 60

_TRACKS: dict[str, Any] = {
    "length_m": LENGTH_M,
    "width_m": WIDTH_M,
    "top_thickness_m": HEIGHT_M,
    "bottom_thickness_m": HEIGHT_M,
    "top_resistivity_ohm_m": RHO_OHM_M,
    "bottom_resistivity_ohm_m": RHO_OHM_M,
    "film_m": FILM_M,
    "eps_r": EPS_R,
}
_PRESS = {"force_n": _FORCE_N, "modulus_pa": _MODULUS_PA, "tip_m": _PATCH_M, "left_m": _LEFT_M}
_RESISTANCE_OHM = 2 * RHO_OHM_M * LENGTH_M / (HEIGHT_M * WIDTH_M)
_CAPACITANCE_F = CAPACITANCE_F_PER_M * LENGTH_M


def _both(name: str, ours: Any, printed: Any) -> list[Part]:
    return [
        Part(f"Re {name}", "ohm", np.real(ours), np.real(printed)),
        Part(f"Im {name}", "ohm", np.imag(ours), np.imag(printed)),
    ]


def in_series() -> list[Part]:
    """2.24, B.54: a resistor and a capacitor in series, in place of a line, at the lowest tone."""
    tone = _TONES_HZ[0]
    ours = line.impedance(line.PressedLine(frequency_hz=tone, **_TRACKS))
    printed = _RESISTANCE_OHM + 1 / (2j * np.pi * tone * _CAPACITANCE_F)
    real, imaginary = _both("Z", ours, printed)
    rise = [float(np.real(line.impedance(line.PressedLine(frequency_hz=f, **_TRACKS)))) for f in _TONES_HZ]
    return [real, imaginary, Part("Re Z, lowest and highest tone", "ohm", np.array(rise))]


def corner() -> list[Part]:
    """2.25: the formula, and where the line's resistance has really fallen by a tenth."""
    printed = 1 / (2 * np.pi * _RESISTANCE_OHM * _CAPACITANCE_F)
    sensor = Sensor(
        LENGTH_M, WIDTH_M, (HEIGHT_M,) * 2, (RHO_OHM_M,) * 2, CAPACITANCE_F_PER_M, compression.unconfined(_MODULUS_PA)
    )
    return [
        Part("1/(2 pi R C)", "Hz", sensor.corner_frequency_hz(), printed),
        Part("where Re Z has fallen by 10 %", "Hz", _falls_by(0.1), printed),
    ]


def _falls_by(share: float) -> float:
    """Frequency at which Re Z is lower than at low frequency by a share, by halving in the logarithm [Hz]."""
    rest = float(np.real(line.impedance(line.PressedLine(frequency_hz=1.0, **_TRACKS))))
    low, high = np.log(_LEAST_HZ), np.log(_MOST_HZ)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        fallen = 1 - float(np.real(line.impedance(line.PressedLine(frequency_hz=np.exp(middle), **_TRACKS)))) / rest
        low, high = (middle, high) if fallen < share else (low, middle)
    return float(np.exp(low))


def parts_of_z() -> list[Part]:
    """5.1: resistance and capacitance that a reading is taken apart into make it up again."""
    ours = line.impedance(line.PressedLine(frequency_hz=_TONES_HZ, **_TRACKS, **_PRESS))
    made = []
    for tone, z in zip(_TONES_HZ, ours, strict=True):
        c, r = line_fit.series(tone, z)
        made.append(complex(r + 1j * (-1 / (2 * np.pi * tone * c))))
    return _both("Z", ours, np.array(made))


def thinner() -> list[Part]:
    """B.49: by the area of the electrodes, and by that under the tip."""
    law = compression.unconfined(_MODULUS_PA)
    stress = np.asarray(_FORCE_N / (WIDTH_M * _PATCH_M))
    ours = -float(law.capacitive_strain(stress)[0]) * FILM_M

    def by(area_m2: float) -> float:
        return -_FORCE_N * FILM_M / (area_m2 * _MODULUS_PA)

    return [Part("change of thickness", "m", ours, by(WIDTH_M * LENGTH_M), by(WIDTH_M * _PATCH_M))]


def piezoresistive() -> list[Part]:
    """B.50: a line that is pressed all along, of a rigid film, is one of more resistivity."""
    stiff = {"modulus_pa": 1e30, "tip_m": LENGTH_M, "force_n": _FORCE_N}
    ours = line.impedance(
        line.PressedLine(
            frequency_hz=_TONES_HZ,
            **_TRACKS,
            **stiff,
            top_piezoresistance_per_n=_S_PER_N,
            bottom_piezoresistance_per_n=_S_PER_N,
        )
    )
    more = RHO_OHM_M * (1 + _S_PER_N * _FORCE_N)
    printed = line_closed.uniform(
        line.PressedLine(
            frequency_hz=_TONES_HZ, **_TRACKS | {"top_resistivity_ohm_m": more, "bottom_resistivity_ohm_m": more}
        )
    )
    return _both("Z", ours, printed)


def three_sections() -> list[Part]:
    """B.51: product of the three sections' matrices as in B.44 to B.47; and as textbooks have it."""
    given = _TRACKS | _PRESS | {"frequency_hz": _TONES_HZ}
    ours = line.impedance(line.PressedLine(**given))
    return [
        *_both("Z", ours, line_closed.impedance(line.PressedLine(**given))),
        *_both("Z by cosh and sinh", ours, line_abcd.impedance(line.PressedLine(**given))),
    ]


def ladder() -> list[Part]:
    """2.3, 2.4, B.4, B.5: a chain of resistors and capacitors, each cell's capacitance halved between its ends."""
    given = _TRACKS | _PRESS | {"frequency_hz": _TONES_HZ[1]}
    return _both(
        "Z", line.impedance(line.PressedLine(**given)), line_ladder.impedance(line.PressedLine(**given), _CELLS)
    )


def cog_resistance() -> list[Part]:
    """2.9: a conductor of a cog's size, as our tracks count theirs."""
    height, width, across = 0.5e-3, 0.5e-3, 0.01
    sensor = Sensor(height, across, (width,) * 2, (RHO_OHM_M, 0.0), 1e-9, compression.unconfined(_MODULUS_PA))
    return [Part("R_c", "ohm", sensor.resistance_ohm(), RHO_OHM_M * height / (across * width))]


def reactance_of(eps_r: float) -> list[Part]:
    """2.6, 2.8: a capacitor's impedance, and the positive number that stands for it."""
    tone = float(_TONES_HZ[0])
    plain = _TRACKS | {"top_resistivity_ohm_m": 0.0, "bottom_resistivity_ohm_m": 0.0, "eps_r": eps_r}
    printed = FILM_M / (2 * np.pi * tone * EPS0_F_PER_M * eps_r * WIDTH_M * LENGTH_M)
    return [
        Part("X", "ohm", line.impedance(line.PressedLine(frequency_hz=tone, **plain)), complex(printed), printed / 1j)
    ]
