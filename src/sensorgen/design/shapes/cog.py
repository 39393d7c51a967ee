"""Cogs of the top electrode in a solid dielectric, without air (thesis 2.3.2, figure 2.5).

One period, seen along the cogs (e: conductor, x: dielectric)::

    eeeeeeeeeeeeeeeeeeee   top electrode
    xxxxxxeeeeeeeexxxxxx   cog, dielectric around it
    xxxxxxeeeeeeeexxxxxx
    xxxxxxxxxxxxxxxxxxxx   dielectric under the cogs
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass, field
from math import ceil

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.scene import SLIVER_MM, Body, Envelope, Fill, Prism, Scene, box, rounded


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters of the cogs."""

    period_mm: float = field(default=2.0, metadata={"help": "Period of the cogs.", "range": (0.1, 100.0)})
    cog_width_mm: float = field(default=1.0, metadata={"help": "Width of a cog.", "range": (0.02, 100.0)})
    height_mm: float = field(default=0.3, metadata={"help": "Height of a cog.", "range": (0.01, 10.0)})
    dielectric_mm: float = field(
        default=0.3, metadata={"help": "Thickness of the dielectric under the cogs.", "range": (0.0, 10.0)}
    )
    along: str = field(
        default="x", metadata={"help": "Axis along which the cogs follow each other.", "choices": ("x", "y")}
    )

    def __post_init__(self) -> None:
        """Refuse cogs that leave no dielectric between them."""
        if self.cog_width_mm >= self.period_mm:
            raise OutOfRange(
                f"cog_width_mm {self.cog_width_mm:g} leaves nothing of period_mm {self.period_mm:g}: expected less"
            )

    def cells(self) -> float:
        """Number of cells of the pattern in the sensor [-]."""
        return (self.length_mm if self.along == "x" else self.width_mm) / self.period_mm


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the cogs; a cog is in the middle of each period."""
    low, tip = p.electrode_mm, p.electrode_mm + p.dielectric_mm
    roof, top = tip + p.height_mm, tip + p.height_mm + p.electrode_mm
    end, depth = (p.length_mm, p.width_mm) if p.along == "x" else (p.width_mm, p.length_mm)

    def plate(z0: float, z1: float) -> tuple[Prism, ...]:
        return (box(0.0, p.length_mm, 0.0, p.width_mm, z0, z1),) if z1 > z0 else ()

    def strips(start: float, stop: float) -> tuple[Prism, ...]:
        count = ceil(end / p.period_mm - 1e-9) + 1
        spans = ((max(k * p.period_mm + start, 0.0), min(k * p.period_mm + stop, end)) for k in range(count))
        kept = [(a, b) for a, b in spans if b - a > SLIVER_MM]
        return tuple(box(a, b, 0.0, depth, tip, roof) if p.along == "x" else box(0.0, depth, a, b, tip, roof)
                     for a, b in kept)  # fmt: skip

    half = (p.period_mm - p.cog_width_mm) / 2
    between = strips(-half, half)
    film = [Body("film_and_dielectric", fill.dielectric, plate(low, tip) + between)]
    if fill.film != fill.dielectric:
        film = [Body("film", fill.film, plate(low, tip)), Body("dielectric", fill.dielectric, between)]
    bodies = (
        Body("bottom_electrode", fill.bottom_electrode, plate(0.0, low), "bottom"),
        *film,
        Body("top_electrode_with_cogs", fill.top_electrode, strips(half, p.period_mm - half) + plate(roof, top), "top"),
        Body("isolation", fill.isolation, plate(top, top + p.isolation_mm)),
    )
    return Scene(bodies, (p.length_mm, p.width_mm, rounded(top + p.isolation_mm)))
