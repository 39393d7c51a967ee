"""A plate with regular air gaps: strips of dielectric from electrode to electrode, air between them (thesis 2.3.3).

One period, seen along the strips (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
    xxxxxxx      xxxxxxx
    xxxxxxx      xxxxxxx   dielectric, with a gap through all of its thickness
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass, field

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.scene import Body, Fill, Scene, rounded
from sensorgen.scene.strips import StripParams


@dataclass(frozen=True)
class Params(StripParams):
    """Parameters of the plate with gaps."""

    gap_width_mm: float = field(default=0.6, metadata={"help": "Width of an air gap.", "range": (0.02, 100.0)})
    dielectric_mm: float = field(
        default=0.6, metadata={"help": "Thickness of the dielectric plate.", "range": (0.01, 10.0)}
    )

    def __post_init__(self) -> None:
        """Refuse gaps that leave no dielectric."""
        if self.gap_width_mm >= self.period_mm:
            raise OutOfRange(
                f"gap_width_mm {self.gap_width_mm:g} leaves nothing of period_mm {self.period_mm:g}: expected less"
            )


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the plate with gaps; the gap is in the middle of each period."""
    low, high = p.electrode_mm, p.electrode_mm + p.dielectric_mm
    top = high + p.electrode_mm
    half = (p.period_mm - p.gap_width_mm) / 2
    bodies = (
        Body("bottom_electrode", fill.bottom_electrode, p.plate(0.0, low), "bottom"),
        Body("dielectric", fill.dielectric, p.strips(-half, half, low, high)),
        Body("support", fill.support, p.strips(half, p.period_mm - half, low, high) if fill.support else ()),
        Body("top_electrode", fill.top_electrode, p.plate(high, top), "top"),
        Body("isolation", fill.isolation, p.plate(top, top + p.isolation_mm)),
    )
    return Scene(bodies, (p.length_mm, p.width_mm, rounded(top + p.isolation_mm)))
