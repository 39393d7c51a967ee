"""Capacitors and resistors of cells as circuits: 2.5, 2.7, 2.10, 2.19 to 2.23, 4.1, 6.1, B.9, B.10; their figures."""

from collections.abc import Sequence

import numpy as np

from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design import design as designs
from sensorgen.models import columns, fem2d, line
from sensorgen.verification.thesis.checks._columns import EPS_R, FILM_MM, PERMITTIVITY, Layer, piles, piles_f
from sensorgen.verification.thesis.checks._field import INPUT_V, LENGTH_M, OMEGA, RHO_OHM_M, TRACKS
from sensorgen.verification.thesis.items import ItemPart, Parts, table

_PLATE_M, _PLATE_M2 = 0.6e-3, 1e-3  # Table 3.1
_PLATE = designs.make({"shape": "reference"})
_SLOW_HZ = 1.0
_STRIP_MM, _GAP_MM, _HIGH_MM = 0.7, 0.3, 0.3  # of the rectangular design, where no sizes are printed
_WIDTH_MM, _DEPTH_MM = 0.35, 1.0  # of a rung
# Rungs of the rectangular design: layers from below, and the height of the cog in it [mm].
_RUNGS: dict[int, tuple[tuple[Layer, ...], float]] = {
    1: ((("x60", 0.4), ("air", 0.3)), 0.0),
    2: ((("x60", 0.1), ("air", 0.3)), 0.3),
    3: ((("x60", 0.7),), 0.0),
    4: ((("x60", 0.1),), 0.6),
}


def plate(eps_r: float = EPS_R) -> Parts:
    """2.5, 2.7, B.9: the plate of Table 3.1, of any dielectric, by columns."""
    ours = columns.capacitance(_PLATE.in_use, {"x60": eps_r, "air": 1.0})
    yield ItemPart("C", "F", (ours.lower + ours.upper) / 2, EPS0_F_PER_M * eps_r * _PLATE_M2 / _PLATE_M)


def earlier() -> Parts:
    """Chapter 1: the plate of Table C.1 at rest."""
    given = table("C.1")
    length, width = given["size_mm"]
    over = length * width / given["plate_mm"] * M_PER_MM
    yield ItemPart("C at rest", "F", EPS0_F_PER_M * given["x60"]["relative_permittivity"] * over)


def solved_plate() -> Parts:
    """4.1: the same by its field."""
    bounds = fem2d.capacitance(_PLATE.in_use, PERMITTIVITY)
    yield ItemPart("C", "F", bounds.upper, EPS0_F_PER_M * EPS_R * _PLATE_M2 / _PLATE_M)


def slice_of_plate() -> Parts:
    """B.10: what a plate of a length gains by a slice."""
    long, short = (piles_f([(length, [("x60", 0.6)])], 10.0) for length in (100.0, 99.0))
    yield ItemPart("C of 1 mm", "F", long - short, EPS0_F_PER_M * EPS_R * 1e-2 * 1e-3 / _PLATE_M)


def charge_of_plate() -> Parts:
    """6.1: charge that the line's current brings in a period, at a tone where its tracks do not count."""
    omega = 2 * np.pi * _SLOW_HZ
    z = line.impedance(line.PressedLine(**TRACKS | {"length_m": LENGTH_M, "frequency_hz": _SLOW_HZ}))
    printed = EPS0_F_PER_M * EPS_R * _PLATE_M2 / _PLATE_M * INPUT_V
    yield ItemPart("q at 1 V", "C", float(abs(INPUT_V / z) / omega), printed)


def air_gaps() -> Parts:
    """2.8 to 2.11: strips of dielectric and of air side by side between plates, by their field."""
    beside = [(_STRIP_MM, [("x60", _HIGH_MM)]), (_GAP_MM, [("air", _HIGH_MM)])]
    depth_mm = 1.0
    bounds = fem2d.capacitance(piles(beside, depth_mm), PERMITTIVITY)
    c_de, c_air = (
        EPS0_F_PER_M * PERMITTIVITY[layers[0][0]] * width * depth_mm / _HIGH_MM * M_PER_MM for width, layers in beside
    )
    yield ItemPart("C of both", "F", (bounds.lower + bounds.upper) / 2, c_de + c_air)


def cogs() -> Parts:
    """2.5, 2.6: a conductor's teeth in the dielectric, of the rectangular design's sizes; no sizes are printed."""
    flat, teeth = _STRIP_MM + _GAP_MM, [(_STRIP_MM, [("x60", FILM_MM)]), (_GAP_MM, [("x60", FILM_MM + _HIGH_MM)])]
    plain = piles_f([(flat, [("x60", FILM_MM + _HIGH_MM)])])
    field = fem2d.capacitance(piles(teeth, 1.0), PERMITTIVITY).upper
    cog_ohm = RHO_OHM_M * _HIGH_MM / (_STRIP_MM * 1.0 * M_PER_MM)
    both = [piles_f(teeth) / plain, field / plain]
    yield ItemPart("C with cogs over C without, by columns and by the field", "", both)
    yield ItemPart("a cog's resistance over the reactance below it, at 99.7 kHz", "", cog_ohm * OMEGA * field, shown=2)


def _reactance(layers: Sequence[Layer]) -> float:
    """Sum of 1/(omega C) of layers by 2.6 and 2.8 [ohm]."""
    area = _WIDTH_MM * _DEPTH_MM * M_PER_MM**2
    return sum(t * M_PER_MM / (OMEGA * EPS0_F_PER_M * PERMITTIVITY[name] * area) for name, t in layers)


def rung(number: int) -> Parts:
    """2.19, 2.21: magnitudes of reactances; 2.20, 2.22: added to a cog's resistance, as though they were real."""
    layers, cog_mm = _RUNGS[number]
    if not cog_mm:
        size = abs(1 / (1j * OMEGA * piles_f([(_WIDTH_MM, layers)], _DEPTH_MM)))
        yield ItemPart(f"size of Z_{number}", "ohm", size, _reactance(layers))
        return
    cog = RHO_OHM_M * cog_mm / (_WIDTH_MM * _DEPTH_MM * M_PER_MM)
    ours = cog + 1 / (1j * OMEGA * piles_f([(_WIDTH_MM, layers)], _DEPTH_MM))
    yield ItemPart(f"Z_{number}", "ohm", ours, complex(cog + _reactance(layers)), cog - 1j * _reactance(layers))


def rungs() -> Parts:
    """2.23: four impedances side by side, of cogs that do not resist."""
    z1, z2, z3, z4 = (-1j * _reactance(layers) for layers, _ in _RUNGS.values())
    ours = 1 / (1j * OMEGA * piles_f([(_WIDTH_MM, layers) for layers, _ in _RUNGS.values()], _DEPTH_MM))
    printed = z1 * z2 * z3 * z4 / (z1 * z2 * z3 + z2 * z3 * z4 + z1 * z2 * z4 + z1 * z3 * z4)
    yield ItemPart("Z_r", "ohm", ours, printed)
