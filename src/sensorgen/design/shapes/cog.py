"""Cogs of the top electrode in a solid dielectric, without air (thesis 2.3.2, figure 2.5).

One period, seen along the cogs (e: conductor, x: dielectric)::

    eeeeeeeeeeeeeeeeeeee   top electrode
    xxxxxxeeeeeeeexxxxxx   cog, dielectric around it
    xxxxxxeeeeeeeexxxxxx
    xxxxxxxxxxxxxxxxxxxx   dielectric under the cogs
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass, field

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.scene import Body, Fill, Scene, rounded
from sensorgen.scene.strips import StripParams


@dataclass(frozen=True)
class Params(StripParams):
    """Parameters of the cogs."""

    cog_width_mm: float = field(default=1.0, metadata={"help": "Width of a cog.", "range": (0.02, 100.0)})
    height_mm: float = field(default=0.3, metadata={"help": "Height of a cog.", "range": (0.01, 10.0)})
    dielectric_mm: float = field(
        default=0.3, metadata={"help": "Thickness of the dielectric under the cogs.", "range": (0.0, 10.0)}
    )

    def __post_init__(self) -> None:
        """Refuse cogs that leave no dielectric between them."""
        if self.cog_width_mm >= self.period_mm:
            raise OutOfRange(
                f"cog_width_mm {self.cog_width_mm:g} leaves nothing of period_mm {self.period_mm:g}: expected less"
            )


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the cogs; a cog is in the middle of each period."""
    low, tip = p.electrode_mm, p.electrode_mm + p.dielectric_mm
    roof, top = tip + p.height_mm, tip + p.height_mm + p.electrode_mm
    half = (p.period_mm - p.cog_width_mm) / 2
    between = p.strips(-half, half, tip, roof)
    film = [Body("film_and_dielectric", fill.dielectric, p.plate(low, tip) + between)]
    if fill.film != fill.dielectric:
        film = [Body("film", fill.film, p.plate(low, tip)), Body("dielectric", fill.dielectric, between)]
    bodies = (
        Body("bottom_electrode", fill.bottom_electrode, p.plate(0.0, low), "bottom"),
        *film,
        Body(
            "top_electrode_with_cogs",
            fill.top_electrode,
            p.strips(half, p.period_mm - half, tip, roof) + p.plate(roof, top),
            "top",
        ),
        Body("isolation", fill.isolation, p.plate(top, top + p.isolation_mm)),
    )
    return Scene(bodies, (p.length_mm, p.width_mm, rounded(top + p.isolation_mm)))
