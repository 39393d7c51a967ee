"""Presses and the bench: figures 5.6 to 6.12 and what the text concludes from them, by the line and finite elements."""

from typing import Any

import numpy as np

from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design.tip import EVEN, Tip
from sensorgen.measure.signal import lowpass
from sensorgen.models.press2d import BoundaryConditions
from sensorgen.models.sensor import Sensor
from sensorgen.prediction import compression as compressed
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.query import TONES_HZ
from sensorgen.prediction.sensor_model import build_sensor
from sensorgen.verification.thesis.items import ItemPart, Parts, table

_KPA = 100.0
_M_PER_UM = 1e-6
_SHOWN = 3  # digits that a mesh leaves as they are
_PERIOD_M = 2e-3
_CELL_M2 = _PERIOD_M * 20e-3  # of the triangular cell of 3.1.2
_CORNERS_N, _CORNERS_M = np.array([0.0, 6.0]), np.array([0.01, 0.09])
_MIDDLE_N, _MIDDLE_M = 3.0, 0.05
_GRAVITY_M_PER_S2 = 9.81
_LOW_AND_HIGH_HZ = np.array([TONES_HZ[0], TONES_HZ[-1]])


def _pressed(
    shape: str, *, parameters: dict[str, float], base: str = "bonded", period: str = "fixed"
) -> compressed.CompressionResult:
    """A cell under 100 kPa, of the cache where it was solved before."""
    design = designs.make({"shape": shape, "parameters": parameters})
    boundary, tip = BoundaryConditions(base=base, period=period), Tip(block=EVEN)
    question = compressed.PressQuestion((0.0, _KPA), boundary, sides="symmetric", tip=tip)
    curve = compressed.answer(drawn(design), question)
    if curve.faults or None in curve.displacement_um:
        raise SensorgenError(f"the cell under {_KPA:g} kPa was not solved: {'; '.join(curve.faults or curve.doubts)}")
    return curve


def _top(name: str, moved: compressed.CompressionResult, thesis_mm: float) -> ItemPart:
    """Displacement of the top of a cell, against that of the thesis."""
    ours = float(np.array(moved.displacement_um, float)[-1]) * _M_PER_UM
    return ItemPart(name, "m", ours, thesis_mm * M_PER_MM, shown=_SHOWN)


def _rise_f(curve: compressed.CompressionResult, cell_m2: float) -> float:
    """By how much the capacitance of a cell has risen [F]."""
    lower, upper = np.array(curve.lower_f_per_m2, float), np.array(curve.upper_f_per_m2, float)
    rest, *_, last = (lower + upper) / 2
    return float(last - rest) * cell_m2


def top(shape: str, displacement_mm: float, ways: list[dict[str, Any]]) -> Parts:
    """6.5: triangular cell with both films; 6.8: fixed, and free to slide and widen; 6.9: rectangular cell, in 3D."""
    for way in ways:
        film, boundary = way["film_mm"], {k: v for k, v in way.items() if k != "film_mm"}
        named = ", ".join([f"film {film:g} mm", *(f"{key} {value}" for key, value in boundary.items())])
        moved = _pressed(shape, parameters={"dielectric_mm": film}, **boundary)
        yield _top(f"displacement at 100 kPa, {named}", moved, displacement_mm)


def plates(two_mm: float, three_mm: float, two_f: float, three_f: float) -> Parts:
    """6.11: the plain plate, fixed at its sides so that only its bulk deforms."""
    curve = _pressed("reference", parameters={})
    yield _top("2D", curve, two_mm)
    yield _top("3D", curve, three_mm)
    for name, printed in (("2D", two_f), ("3D", three_f)):
        yield ItemPart(f"gain of C, {name}, 2 mm by 20 mm", "F", _rise_f(curve, _CELL_M2), printed, shown=2)


def gain(rise_f: float, deepest_mm: float, rect_f: float, film_mm: float) -> Parts:
    """6.12: by how much the capacitance of both cells rises, and how far the slope has to be extended."""
    tri, rect = (_pressed(shape, parameters={"dielectric_mm": film_mm}) for shape in ("tri", "rect"))
    rise = _rise_f(tri, _CELL_M2)
    deep = float(np.array(tri.displacement_um, float)[-1]) * _M_PER_UM * rise_f / rise
    yield ItemPart("(a) rise at 100 kPa, 2 mm by 20 mm", "F", rise, rise_f, shown=_SHOWN)
    deepest_m = deepest_mm * M_PER_MM
    yield ItemPart("(a) displacement for 10 pF by this slope", "m", deep, deepest_m, shown=_SHOWN, limit=True)
    yield ItemPart("(b) rise at 100 kPa, 2 mm by 2 mm", "F", _rise_f(rect, _PERIOD_M**2), rect_f, shown=2)


def sensitivity(shape: str, film_mm: float, increase: float, cell_f: float, plate_f: float) -> Parts:
    """6.1.2, 7.1.1: relative rise of C at 100 kPa over that of the plate; and the quotient of the thesis's numbers."""
    yield ItemPart("increase by its own numbers", "", cell_f / plate_f - 1, increase, scale=1.0, shown=_SHOWN)
    share = _plate_share(shape, film_mm)
    yield ItemPart("relative rise of the plate over the cell's, solved", "", share, 1 / (1 + increase), shown=2)


def _plate_share(shape: str, film_mm: float) -> float:
    """Relative rise of the plate's capacitance at 100 kPa over that of a cell [-]."""
    cell, plate = _pressed(shape, parameters={"dielectric_mm": film_mm}), _pressed("reference", parameters={})
    by = [_rise_f(curve, 1.0) / float(curve.lower_f_per_m2[0] or np.nan) for curve in (plate, cell)]
    return by[0] / by[1]


def more_sensitive(film_mm: float) -> Parts:
    """First research question: a plate's relative rise has to be the smaller one."""
    for shape in ("tri", "rect"):
        name = f"plate's relative rise at 100 kPa over that of {shape}"
        yield ItemPart(name, "", _plate_share(shape, film_mm), 1.0, shown=2, limit=True)


def several_tones() -> Parts:
    """Second research question: errors of force and position by seven tones, over seven readings at the highest one."""
    response = _plate().response(np.array(TONES_HZ), _MIDDLE_N, _MIDDLE_M)
    z, by = response.impedance_ohm, np.stack([response.by_force_ohm_per_n, response.by_position_ohm_per_m])
    known = np.einsum("ik,jk->kij", by / abs(z), by.conj() / abs(z)).real  # of noise that is a share of |Z|
    every, highest = (np.sqrt(np.diag(np.linalg.inv(k))) for k in (known.sum(axis=0), len(z) * known[-1]))
    for k, name in enumerate(("force", "position")):
        yield ItemPart(f"error of {name}", "", float(every[k] / highest[k]), 1.0, shown=_SHOWN, limit=True)


def _plate() -> Sensor:
    """The sensor of Table 3.1 with the electrodes of Table C.1, free to widen as in B.49."""
    slots = {f"{end}_electrode": f"etpu@thesis-c.1-{end}" for end in ("top", "bottom")}
    return build_sensor(drawn(designs.make({"shape": "reference", "materials": slots})), "unconfined").sensor


def impedance() -> Parts:
    """6.1: R and X without force and at 6 N, at both ends of the tones."""
    z = _plate().impedance(_LOW_AND_HIGH_HZ[:, None], _CORNERS_N, _MIDDLE_M)
    yield ItemPart("R at 1.1 and 99.7 kHz, 0 and 6 N at 50 mm", "ohm", z.real.ravel())
    yield ItemPart("X there", "ohm", z.imag.ravel())


def by_place(of: str) -> Parts:
    """6.2 and 6.3: slopes of R or X in the middle."""
    response = _plate().response(_LOW_AND_HIGH_HZ, _MIDDLE_N, _MIDDLE_M)
    part = np.real if of == "R" else np.imag
    yield ItemPart(f"d{of}/dF at 1.1 and 99.7 kHz, 3 N at 50 mm", "ohm/N", part(response.by_force_ohm_per_n))
    yield ItemPart(f"d{of}/dx there", "ohm/mm", part(response.by_position_ohm_per_m) * M_PER_MM)


def way_back() -> Parts:
    """6.4: ranges of R that force and position span at each tone, which is what an inverse has to go by."""
    z = _plate().impedance(_LOW_AND_HIGH_HZ[:, None, None], _CORNERS_N[:, None], _CORNERS_M)
    yield ItemPart("R spans at 1.1 and 99.7 kHz", "ohm", np.ptp(z.real.reshape(2, -1), axis=1))
    yield ItemPart("X spans there", "ohm", np.ptp(z.imag.reshape(2, -1), axis=1))


def charge(charge_c: float, capacitance_f: float) -> Parts:
    """6.3: charge at 1 V."""
    yield ItemPart("C of 1 pC at 1 V", "F", charge_c / 1.0, capacitance_f, charge_c)


def piston(mass_kg: float, force_n: float) -> Parts:
    """5.1.2: weight of the piston."""
    yield ItemPart("weight", "N", mass_kg * _GRAVITY_M_PER_S2, force_n)


def tip(diameter_mm: float, radius_mm: float) -> Parts:
    """5.6: outer diameter of the extension, and a radius of the whole."""
    yield ItemPart("radius (ours: half the diameter)", "mm", diameter_mm / 2, radius_mm)


def umbrella(force_n: float, flat_mm: float, range_kpa: list[float]) -> Parts:
    """1.1: the pressure of the bench's largest force on the flat end, over the whole width, against that of gait."""
    area_m2 = flat_mm * table("C.1")["size_mm"][1] * M_PER_MM**2
    yield ItemPart("largest pressure of the bench", "Pa", force_n / area_m2, 1e3 * range_kpa[0], shown=_SHOWN)


def flat_end(flat_mm: float) -> Parts:
    """5.1.3: what presses, against the length that is pressed by Table C.1."""
    yield ItemPart("flat end (ours: pressed length of Table C.1)", "mm", table("C.1")["tip_mm"], flat_mm)


def bridge() -> Parts:
    """5.9: currents of the tones at 1 V over one another, with the weights of Table 5.1 and with equal ones."""
    tones, weights = (np.array(table(number)[key]) for number, key in (("3.1", "tones_hz"), ("5.1", "weights")))
    current = 1 / abs(_plate().impedance(tones, 0.0, _MIDDLE_M))
    spread = [float(np.ptp(np.log(i))) for i in (current, current * weights)]
    yield ItemPart("largest over smallest current, equal and weighted tones", "", np.exp(spread), shown=_SHOWN)


def filtered(cutoff_hz: float, order: int) -> Parts:
    """5.3: the low-pass, as ours is set."""
    yield ItemPart("cut-off", "Hz", lowpass.CUTOFF_HZ, cutoff_hz, copied=True)
    yield ItemPart("order", "", lowpass.ORDER, order, copied=True)
