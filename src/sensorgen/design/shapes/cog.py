"""Cogs of the top electrode in a solid dielectric, without air (thesis 2.3.2, figure 2.5).

One period, seen along the cogs (e: conductor, x: dielectric)::

    eeeeeeeeeeeeeeeeeeee   top electrode
    xxxxxxeeeeeeeexxxxxx   cog, dielectric around it
    xxxxxxeeeeeeeexxxxxx
    xxxxxxxxxxxxxxxxxxxx   dielectric under the cogs
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass

from sensorgen.scene.patterns import StripParams
from sensorgen.scene.scene import Body, Fill, Scene, parameter


@dataclass(frozen=True)
class Params(StripParams):
    """Parameters of the cogs."""

    cog_width_mm: float = parameter(1.0, "Width of a cog.", 0.02, 100.0)
    height_mm: float = parameter(0.3, "Height of a cog.", 0.01, 10.0)
    dielectric_mm: float = parameter(0.3, "Thickness of the dielectric under the cogs.", 0.0, 10.0)

    def __post_init__(self) -> None:
        """Refuse cogs that leave no dielectric between them."""
        self.refuse_whole("cog_width_mm")


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the cogs; a cog is in the middle of each period."""
    low, tip = p.electrode_mm, p.electrode_mm + p.dielectric_mm
    roof, half = tip + p.height_mm, (p.period_mm - p.cog_width_mm) / 2
    between = p.strips(-half, half, tip, roof)
    film = [Body("film_and_dielectric", fill.dielectric, p.plate(low, tip) + between)]
    if fill.film != fill.dielectric:
        film = [Body("film", fill.film, p.plate(low, tip)), Body("dielectric", fill.dielectric, between)]
    return p.between_electrodes(fill, film, roof, p.strips(half, p.period_mm - half, tip, roof))
