"""A plate with regular air gaps: strips of dielectric from electrode to electrode, air between them (thesis 2.3.3).

One period, seen along the strips (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
    xxxxxxx      xxxxxxx
    xxxxxxx      xxxxxxx   dielectric, with a gap through all of its thickness
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass

from sensorgen.scene.patterns import StripParams
from sensorgen.scene.scene import Body, Fill, Scene, parameter


@dataclass(frozen=True)
class Params(StripParams):
    """Parameters of the plate with gaps."""

    gap_width_mm: float = parameter(0.6, "Width of an air gap.", 0.02, 100.0)
    dielectric_mm: float = parameter(0.6, "Thickness of the dielectric plate.", 0.01, 10.0)

    def __post_init__(self) -> None:
        """Refuse gaps that leave no dielectric."""
        self.refuse_whole("gap_width_mm")


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the plate with gaps; the gap is in the middle of each period."""
    low, high = p.electrode_mm, p.electrode_mm + p.dielectric_mm
    half = (p.period_mm - p.gap_width_mm) / 2
    bodies = (
        Body("dielectric", fill.dielectric, p.strips(-half, half, low, high)),
        Body("support", fill.support, p.strips(half, p.period_mm - half, low, high) if fill.support else ()),
    )
    return p.between_electrodes(fill, bodies, high)
