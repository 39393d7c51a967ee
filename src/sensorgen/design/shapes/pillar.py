"""Square micropillars in a square array, between a film and the top electrode.

One cell, cut through its middle (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
          eeeeeeee         pillar, of the top electrode or of dielectric
          eeeeeeee
    xxxxxxxxxxxxxxxxxxxx   film
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass

from sensorgen.scene.patterns import ArrayParams, array_scene
from sensorgen.scene.scene import Fill, Piece, Scene, box, parameter


@dataclass(frozen=True)
class Params(ArrayParams):
    """Parameters of the pillars."""

    side_mm: float = parameter(0.8, "Side of a pillar.", 0.02, 100.0)

    def __post_init__(self) -> None:
        """Refuse pillars that would run into each other."""
        self.refuse_wider(self.side_mm)


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the array of pillars."""
    half, cell = p.side_mm / 2, p.period_mm / 2

    def pillar(x: float, y: float, z: float) -> list[Piece]:
        return [box(x - half, x + half, y - half, y + half, z, z + p.height_mm)]

    def around(x: float, y: float, z: float) -> list[Piece]:
        top = z + p.height_mm
        if half == cell:
            return []
        beside = [box(x + i, x + i + cell - half, y - cell, y + cell, z, top) for i in (-cell, half)]
        return [*beside, *(box(x - half, x + half, y + j, y + j + cell - half, z, top) for j in (-cell, half))]

    return array_scene(p, fill, pillar, around)
