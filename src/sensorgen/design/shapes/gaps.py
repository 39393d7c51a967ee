"""A plate with regular air gaps: strips of dielectric from electrode to electrode, air between them (thesis 2.3.3).

One period, seen along the strips (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
    xxxxxxx      xxxxxxx
    xxxxxxx      xxxxxxx   dielectric, with a gap through all of its thickness
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass, field
from math import ceil

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.scene import SLIVER_MM, Body, Envelope, Fill, Prism, Scene, box, rounded


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters of the plate with gaps."""

    period_mm: float = field(default=2.0, metadata={"help": "Period of the gaps.", "range": (0.1, 100.0)})
    gap_width_mm: float = field(default=0.8, metadata={"help": "Width of an air gap.", "range": (0.02, 100.0)})
    dielectric_mm: float = field(
        default=0.6, metadata={"help": "Thickness of the dielectric plate.", "range": (0.01, 10.0)}
    )
    along: str = field(
        default="x", metadata={"help": "Axis along which the gaps follow each other.", "choices": ("x", "y")}
    )

    def __post_init__(self) -> None:
        """Refuse gaps that leave no dielectric."""
        if self.gap_width_mm >= self.period_mm:
            raise OutOfRange(
                f"gap_width_mm {self.gap_width_mm:g} leaves nothing of period_mm {self.period_mm:g}: expected less"
            )

    def cells(self) -> float:
        """Number of cells of the pattern in the sensor [-]."""
        return (self.length_mm if self.along == "x" else self.width_mm) / self.period_mm


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the plate with gaps; the gap is in the middle of each period."""
    low, high = p.electrode_mm, p.electrode_mm + p.dielectric_mm
    top = high + p.electrode_mm
    end, depth = (p.length_mm, p.width_mm) if p.along == "x" else (p.width_mm, p.length_mm)

    def plate(z0: float, z1: float) -> tuple[Prism, ...]:
        return (box(0.0, p.length_mm, 0.0, p.width_mm, z0, z1),) if z1 > z0 else ()

    def strips(start: float, stop: float) -> tuple[Prism, ...]:
        count = ceil(end / p.period_mm - 1e-9) + 1
        spans = ((max(k * p.period_mm + start, 0.0), min(k * p.period_mm + stop, end)) for k in range(count))
        kept = [(a, b) for a, b in spans if b - a > SLIVER_MM]
        return tuple(box(a, b, 0.0, depth, low, high) if p.along == "x" else box(0.0, depth, a, b, low, high)
                     for a, b in kept)  # fmt: skip

    half = (p.period_mm - p.gap_width_mm) / 2
    bodies = (
        Body("bottom_electrode", fill.bottom_electrode, plate(0.0, low), "bottom"),
        Body("dielectric", fill.dielectric, strips(-half, half)),
        Body("support", fill.support, strips(half, p.period_mm - half) if fill.support else ()),
        Body("top_electrode", fill.top_electrode, plate(high, top), "top"),
        Body("isolation", fill.isolation, plate(top, top + p.isolation_mm)),
    )
    return Scene(bodies, (p.length_mm, p.width_mm, rounded(top + p.isolation_mm)))
