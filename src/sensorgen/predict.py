"""What a design should measure, by the cheapest models that can speak of it."""

import math
from typing import Any

from sensorgen.design import Design
from sensorgen.errors import MissingValue
from sensorgen.interval import Interval
from sensorgen.models import line
from sensorgen.planner import Unloaded, Unpredictable, unloaded
from sensorgen.units import M_PER_MM

TONES_HZ = (1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3)  # thesis, Table 5.1, its 4990 corrected


def prediction(design: Design) -> dict[str, Any]:
    """Everything that is predicted of a design, as plain data for ``prediction.json`` (SI units).

    A scene that no model can speak of, as a short, or a material without a value has a reason in place of numbers.
    """
    try:
        found = unloaded(design)
    except (Unpredictable, MissingValue) as error:
        return {"capacitance_f": None, "reason": str(error)}
    area = design.params.length_mm * design.params.width_mm * M_PER_MM**2
    resistance = _resistance_ohm(design, found)
    return {
        "model": {"capacitance": found.answer.model, "line": "line"},
        "refused": list(found.answer.refused),
        "capacitance_f": _bounds(found.answer.capacitance_f),
        "capacitance_per_area_f_per_m2": _bounds(found.answer.capacitance_f.times(1 / area)),
        "electrode_resistance_ohm": resistance,
        **_line(sum(resistance.values()), found.answer.capacitance_f),
        "values": [vars(t) for t in found.taken],
        "assumptions": [
            "ideal electrodes and no fringe at the sensor's edge for the capacitance",
            "electrode resistance of the plates alone: cogs can only lower it",
            "no dielectric loss and no leak: the sources give none",
            "unloaded, as drawn",
        ],
    }


def _resistance_ohm(design: Design, found: Unloaded) -> dict[str, float]:
    """Resistance of each electrode's plate from end to end, rho L / (H W) [ohm]."""
    p = design.params
    squares_per_m = p.length_mm / (p.electrode_mm * p.width_mm) / M_PER_MM
    return {end: rho * squares_per_m for end, rho in zip(("top", "bottom"), found.resistivity_ohm_m, strict=True)}


def _line(resistance_ohm: float, capacitance_f: Interval) -> dict[str, Any]:
    """Corner frequency and impedance at the tones, for both bounds of the capacitance."""
    ends = (capacitance_f.lower, capacitance_f.middle(), capacitance_f.upper)
    corner = [line.corner_frequency_hz(resistance_ohm, c) for c in ends]
    admittance = [[2j * math.pi * f * c for c in ends] for f in TONES_HZ]
    rows = line.cascade([resistance_ohm], [admittance], [1.0])  # per the sensor's own length
    return {
        "corner_frequency_hz": {"lower": corner[2], "middle": corner[1], "upper": corner[0]},
        "impedance_ohm": [
            {
                "frequency_hz": f,
                "re": float(row[1].real),
                "im": float(row[1].imag),
                "re_range": [float(row.real.min()), float(row.real.max())],
                "im_range": [float(row.imag.min()), float(row.imag.max())],
            }
            for f, row in zip(TONES_HZ, rows, strict=True)
        ],
    }


def _bounds(interval: Interval) -> dict[str, float]:
    return {"lower": interval.lower, "middle": interval.middle(), "upper": interval.upper}
