"""What a press does: figures 6.1 to 6.12, by the line, by finite elements under load, and by plates."""

import numpy as np

from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.models.sensor import Sensor
from sensorgen.prediction import compression as compressed
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.query import TONES_HZ
from sensorgen.prediction.sensor_model import build_sensor
from sensorgen.verification.thesis.verdicts import Part

_KPA = 100.0
_M_PER_UM = 1e-6
_SHOWN = 3  # digits that a mesh leaves as they are
_DEPTH_M, _PERIOD_M = 20e-3, 2e-3  # of the cell of 6.1.2
_CORNERS_N, _CORNERS_M = np.array([0.0, 6.0]), np.array([0.01, 0.09])
_MIDDLE_N, _MIDDLE_M = 3.0, 0.05
_LOW_AND_HIGH_HZ = np.array([TONES_HZ[0], TONES_HZ[-1]])


def _pressed(
    shape: str, *, parameters: dict[str, float], base: str = "bonded", period: str = "fixed"
) -> compressed.CompressionResult:
    """A cell under 100 kPa, of the cache where it was solved before."""
    made = designs.make({"shape": shape, "parameters": parameters})
    found = compressed.answer(
        drawn(made), compressed.Asked((0.0, _KPA), compressed.BoundaryConditions(base=base, period=period))
    )
    if found.faults:
        raise SensorgenError(f"the cell under {_KPA:g} kPa was not solved: {found.faults[0]}")
    return found


def _top(name: str, moved: compressed.CompressionResult, thesis_mm: float) -> Part:
    """How far the top of a cell moves, against what the thesis has."""
    ours = float(moved.displacement_um[-1]) * _M_PER_UM
    return Part(name, "m", ours, thesis_mm * M_PER_MM, shown=_SHOWN)


def top(shape: str, displacement_mm: float, film_mm: float, base: str = "bonded", period: str = "fixed") -> list[Part]:
    """6.5: triangular cell; 6.8: on a base that slides, its period free to widen; 6.9: the rectangular one, in 3D."""
    found = _pressed(shape, parameters={"dielectric_mm": film_mm}, base=base, period=period)
    return [_top("displacement of the top at 100 kPa", found, displacement_mm)]


def plates(two_mm: float, three_mm: float) -> list[Part]:
    """6.11: the plain plate, fixed at its sides so that only its bulk deforms."""
    found = _pressed("reference", parameters={})
    return [_top("2D", found, two_mm), _top("3D", found, three_mm)]


def gain(rise_f: float, film_mm: float) -> list[Part]:
    """6.12: by how much the capacitance of the triangular cell rises."""
    found = _pressed("tri", parameters={"dielectric_mm": film_mm})
    lower, upper = np.array(found.lower_f_per_m2, float), np.array(found.upper_f_per_m2, float)
    rest, *_, last = (lower + upper) / 2
    return [
        Part(
            "rise of C at 100 kPa, 2 mm by 20 mm", "F", float(last - rest) * _DEPTH_M * _PERIOD_M, rise_f, shown=_SHOWN
        )
    ]


def _plate() -> Sensor:
    """The sensor of Table 3.1, free to widen as in B.49."""
    return build_sensor(drawn(designs.make({"shape": "reference"})), "unconfined").sensor


def impedance() -> list[Part]:
    """6.1: R and X without force and at 6 N, at both ends of the tones."""
    z = _plate().impedance(_LOW_AND_HIGH_HZ[:, None], _CORNERS_N, _MIDDLE_M)
    return [
        Part("R at 1.1 and 99.7 kHz, 0 and 6 N at 50 mm", "ohm", z.real.ravel()),
        Part("X there", "ohm", z.imag.ravel()),
    ]


def by_place(of: str) -> list[Part]:
    """6.2 and 6.3: slopes of R or X in the middle."""
    found = _plate().response(_LOW_AND_HIGH_HZ, _MIDDLE_N, _MIDDLE_M)
    part = np.real if of == "R" else np.imag
    return [
        Part(f"d{of}/dF at 1.1 and 99.7 kHz, 3 N at 50 mm", "ohm/N", part(found.by_force_ohm_per_n)),
        Part(f"d{of}/dx there", "ohm/mm", part(found.by_position_ohm_per_m) * M_PER_MM),
    ]


def way_back() -> list[Part]:
    """6.4: ranges of R that force and position span at each tone, which is what an inverse has to go by."""
    z = _plate().impedance(_LOW_AND_HIGH_HZ[:, None, None], _CORNERS_N[:, None], _CORNERS_M)
    return [
        Part("R spans at 1.1 and 99.7 kHz", "ohm", np.ptp(z.real.reshape(2, -1), axis=1)),
        Part("X spans there", "ohm", np.ptp(z.imag.reshape(2, -1), axis=1)),
    ]


def charge(charge_c: float, capacitance_f: float) -> list[Part]:
    """6.1 to 6.3: charge at 1 V."""
    return [Part("C of 1 pC at 1 V", "F", charge_c / 1.0, capacitance_f, charge_c)]
