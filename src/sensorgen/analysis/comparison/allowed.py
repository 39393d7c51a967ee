r"""Resistivity that a multimeter's reading allows.

An electrode's resistance over its resistivity is known between bounds, and R_Z says how far the other electrode carries
current through the film (:mod:`sensorgen.measure.signal.verdicts`). The log does not say which electrode was read: each
reading allows a range of :math:`\varrho`.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import inf, isfinite, isnan, log, nan

from sensorgen.analysis.comparison.specimens import Compared
from sensorgen.core.bounds import Bounds
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.values import resistivities
from sensorgen.measure.signal.verdicts import electrode_and_leak
from sensorgen.prediction.rest_state import electrode_resistance


@dataclass(frozen=True, slots=True)
class AllowedValues:
    """ln of the resistivities [ohm m] that a reading allows, and of the leak per area [S/m2]; nan where unknown."""

    low: float
    high: float
    leak: float


def usable(row: Compared) -> bool:
    """Test whether a reading is one of a sound electrode."""
    return row.verdict.electrode == "sound" and isfinite(row.verdict.ry_ohm) and row.verdict.ry_ohm > 0


def allowed(row: Compared, body: Body) -> AllowedValues | None:
    """Resistivity that a reading allows; None without one above 0. A film without a reading is taken for tight."""
    ry, rz = row.verdict.ry_ohm, row.across_ohm
    if not 0 < ry < inf:
        return None
    ends, design = _per_resistivity(body), body.design
    area = design.area_mm2 * M_PER_MM**2
    known = [
        (this, *electrode_and_leak(ry, inf if isnan(rz) else rz, other.value / this.value))
        for this, other in zip(ends, ends[::-1], strict=True)
    ]
    leak = max(leak for *_, leak in known)
    low, high = min(ohm / this.upper for this, ohm, _ in known), max(ohm / this.lower for this, ohm, _ in known)
    return AllowedValues(log(low), log(high), log(leak / area) if 0 < leak < inf else nan)


@lru_cache(maxsize=64)
def _per_resistivity(body: Body) -> list[Bounds]:
    """Resistance of each electrode over its resistivity, without what the material leaves open [1/m]."""
    rho = resistivities(body.design)
    return [
        Bounds.of(r.value, r.unit, model=r.model, print=r.print).times(1 / rho[end].value, "1/m")
        for end, r in electrode_resistance(body).items()
    ]
