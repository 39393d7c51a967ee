"""Capacitors and resistors of cells as circuits: 2.5, 2.7, 2.10, 2.19 to 2.23, 4.1, B.9, B.10."""

from collections.abc import Sequence

from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design.shapes import tri
from sensorgen.models import columns, thesis_cells
from sensorgen.verification.thesis.checks._columns import EPS_R, FILM_MM, PERMITTIVITY, Layer, piles_f
from sensorgen.verification.thesis.checks._field import OMEGA, RHO_OHM_M
from sensorgen.verification.thesis.verdicts import Part

_PLATE_M = 0.6e-3  # Table 3.1
_WIDTH_MM, _DEPTH_MM = 0.35, 1.0  # of a rung
# Rungs of the rectangular design: layers from below, and the height of the cog in it [mm].
_RUNGS: dict[int, tuple[tuple[Layer, ...], float]] = {
    1: ((("x60", 0.4), ("air", 0.3)), 0.0),
    2: ((("x60", 0.1), ("air", 0.3)), 0.3),
    3: ((("x60", 0.7),), 0.0),
    4: ((("x60", 0.1),), 0.6),
}


def plate(eps_r: float = EPS_R) -> list[Part]:
    """The plate of Table 3.1, of any dielectric."""
    found = designs.make({"shape": "reference"})
    ours = columns.capacitance(found.in_use, {"x60": eps_r, "air": 1.0})
    area = found.params.length_mm * found.params.width_mm * M_PER_MM**2
    return [Part("C", "F", (ours.lower + ours.upper) / 2, EPS0_F_PER_M * eps_r * area / _PLATE_M)]


def parallel() -> list[Part]:
    """2.10: two impedances side by side, under the cog and under the dielectric, of 1 m depth."""
    p = tri.Params(dielectric_mm=FILM_MM)
    ours = 1 / (1j * OMEGA * thesis_cells.triangles_f_per_m2(p, EPS_R) * p.period_mm * M_PER_MM / 2)
    one = 1 / (1j * OMEGA * thesis_cells.under_dielectric_f_per_m(p, EPS_R))
    two = 1 / (1j * OMEGA * thesis_cells.under_cog_f_per_m(p, EPS_R))
    return [Part("Z_t", "ohm", ours, one * two / (one + two))]


def _reactance(layers: Sequence[Layer]) -> float:
    """Sum of 1/(omega C) of layers by 2.6 and 2.8 [ohm]."""
    area = _WIDTH_MM * _DEPTH_MM * M_PER_MM**2
    return sum(t * M_PER_MM / (OMEGA * EPS0_F_PER_M * PERMITTIVITY[name] * area) for name, t in layers)


def rung(number: int) -> list[Part]:
    """2.19 to 2.22: reactances added to a resistance, that of the cog by 2.9, as though they were real."""
    layers, cog_mm = _RUNGS[number]
    cog = RHO_OHM_M * cog_mm / (_WIDTH_MM * _DEPTH_MM * M_PER_MM)
    ours = cog + 1 / (1j * OMEGA * piles_f([(_WIDTH_MM, layers)], _DEPTH_MM))
    return [Part(f"Z_{number}", "ohm", ours, complex(cog + _reactance(layers)), cog - 1j * _reactance(layers))]


def rungs() -> list[Part]:
    """2.23: four impedances side by side, of cogs that do not resist."""
    z1, z2, z3, z4 = (-1j * _reactance(layers) for layers, _ in _RUNGS.values())
    ours = 1 / (1j * OMEGA * piles_f([(_WIDTH_MM, layers) for layers, _ in _RUNGS.values()], _DEPTH_MM))
    printed = z1 * z2 * z3 * z4 / (z1 * z2 * z3 + z2 * z3 * z4 + z1 * z2 * z4 + z1 * z3 * z4)
    return [Part("Z_r", "ohm", ours, printed)]
