r"""Cones in a square array, apex down: cogs that touch the film at a blunt tip.

One cell, cut through its middle (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
      \eeeeeeeeeeeeee/     cone, of the top electrode or of dielectric
         \eeeeeeee/
            \ee/           tip
    xxxxxxxxxxxxxxxxxxxx   film
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass, field

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.array import ArrayParams, array_scene, beside_round
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Fill, Piece, Scene, rounded


@dataclass(frozen=True)
class Params(ArrayParams):
    """Parameters of the cones."""

    root_mm: float = field(
        default=1.0, metadata={"help": "Diameter of a cone at the top electrode.", "range": (0.02, 100.0)}
    )
    tip_mm: float = field(
        default=0.66, metadata={"help": "Diameter of its blunt tip; 0 for a sharp one.", "range": (0.0, 100.0)}
    )

    def __post_init__(self) -> None:
        """Refuse cones that would run into each other, or that grow towards the tip."""
        self.refuse_wider(self.root_mm)
        if self.tip_mm > self.root_mm:
            raise OutOfRange(f"tip_mm {self.tip_mm:g} is wider than root_mm {self.root_mm:g}: expected at most that")


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the array of cones."""
    tip, base = p.tip_mm / 2, p.root_mm / 2

    def cone(x: float, y: float, z: float) -> list[Piece]:
        roof = rounded(z + p.height_mm)
        profile = [(0.0, z), *([(tip, z)] if tip else []), (base, roof), (0.0, roof)]
        return [Revolved(x, y, tuple(profile))]

    def around(x: float, y: float, z: float) -> list[Piece]:
        roof, half = rounded(z + p.height_mm), p.period_mm / 2
        profile = [(tip, z), (half, z), (half, roof), *([(base, roof)] if base < half else [])]
        ring = [Revolved(x, y, tuple(profile))] if tip < half else []
        return [*ring, *beside_round(x, y, p.period_mm, z, roof)]

    return array_scene(p, fill, cone, around)
