r"""Square pyramids in a square array, apex down: cogs that touch the film at a blunt tip.

One cell, cut through its middle (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
      \eeeeeeeeeeeeee/     pyramid, of the top electrode or of dielectric
         \eeeeeeee/
            \ee/           tip
    xxxxxxxxxxxxxxxxxxxx   film
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass

from sensorgen.scene.patterns import TippedParams, array_scene
from sensorgen.scene.polyhedra import Loft
from sensorgen.scene.scene import Fill, Outline, Piece, Scene, parameter, rectangle, rounded


@dataclass(frozen=True)
class Params(TippedParams):
    """Parameters of the pyramids."""

    root_mm: float = parameter(1.0, "Side of a pyramid at the top electrode.", 0.02, 100.0)
    tip_mm: float = parameter(0.66, "Side of its blunt tip; 0 for a sharp one.", 0.0, 100.0)


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the array of pyramids."""

    def square(x: float, y: float, side: float) -> Outline:
        half = side / 2
        return tuple((rounded(u), rounded(v)) for u, v in rectangle(x - half, x + half, y - half, y + half))

    def pyramid(x: float, y: float, z: float) -> list[Piece]:
        return [Loft(square(x, y, p.tip_mm), square(x, y, p.root_mm), z, rounded(z + p.height_mm))]

    def around(x: float, y: float, z: float) -> list[Piece]:
        tip, base, cell = (square(x, y, side) for side in (p.tip_mm, p.root_mm, p.period_mm))
        sides = [((cell[k - 1], cell[k], low[k], low[k - 1]), (cell[k - 1], cell[k], high[k], high[k - 1]))
                 for k in range(4) for low, high in [(tip, base)]]  # fmt: skip
        return [Loft(low, high, z, rounded(z + p.height_mm)) for low, high in sides] if p.tip_mm < p.period_mm else []

    return array_scene(p, fill, pyramid, around)
