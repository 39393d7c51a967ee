r"""Resistivity that a multimeter's reading allows.

An electrode's resistance over its resistivity is known between bounds, so that each reading allows a range of
:math:`\varrho`. A film that leaks evenly lets R_Y read less than the electrode has; a bridge at the contacts does not:
which it was is not recorded, so the range runs from R_Y as it was read to R_Y as an even leak would have it.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import isfinite, log

from sensorgen.analysis.comparison.specimens import Compared
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.values import resistivities
from sensorgen.measure.signal.leakage import electrode_and_leak
from sensorgen.prediction.electrodes import electrode_resistance


@dataclass(frozen=True, slots=True)
class Allowed:
    """ln of the resistivities [ohm m] that a reading allows, and of the leak per area [S/m2]; nan where unknown."""

    low: float
    high: float
    leak: float


def usable(row: Compared) -> bool:
    """Whether a reading is one of a sound electrode."""
    return row.verdict.electrode == "sound" and isfinite(row.verdict.ry_ohm) and row.verdict.ry_ohm > 0


def allowed(row: Compared, body: Body) -> Allowed | None:
    """What a reading allows; None where it is none of a sound electrode."""
    if not usable(row):
        return None
    ry, rz = row.verdict.ry_ohm, row.verdict.rz_ohm
    per, design = _per_resistivity(body), body.design
    highest, leak = electrode_and_leak(ry, rz) if rz > 0 else (ry, float("nan"))
    area = design.area_mm2 * M_PER_MM**2
    return Allowed(log(ry / per[1]), log(highest / per[0]), log(leak / area) if leak > 0 else float("nan"))


@lru_cache(maxsize=64)
def _per_resistivity(body: Body) -> tuple[float, float]:
    """Bounds of an electrode's resistance over its resistivity [1/m]."""
    rho = resistivities(body.design)
    found = [
        end / rho[name].value
        for name, r in electrode_resistance(body).items()
        for end in (r.model.lower, r.model.upper, r.print.lower, r.print.upper)
    ]
    return min(found), max(found)
