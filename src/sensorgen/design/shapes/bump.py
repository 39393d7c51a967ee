"""Round bumps in a square array: spherical caps that touch the film, cut off flat at the tip.

One cell, cut through its middle (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
      (eeeeeeeeeeeeee)     bump, of the top electrode or of dielectric
        (eeeeeeeeee)
           'eeee'
    xxxxxxxxxxxxxxxxxxxx   film
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass, field
from math import asin, hypot, sqrt, tan

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.array import ArrayParams, array_scene, beside_round
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import SLIVER_MM, Fill, Piece, Scene, rounded


@dataclass(frozen=True)
class Params(ArrayParams):
    """Parameters of the bumps."""

    root_mm: float = field(
        default=1.0, metadata={"help": "Diameter of a bump at the top electrode.", "range": (0.02, 100.0)}
    )
    tip_mm: float = field(
        default=0.58, metadata={"help": "Diameter of its flat tip; 0 for a whole cap.", "range": (0.0, 100.0)}
    )

    def __post_init__(self) -> None:
        """Refuse bumps that would run into each other, or that are more than half a sphere."""
        self.refuse_wider(self.root_mm)
        if self.tip_mm >= self.root_mm:
            raise OutOfRange(f"tip_mm {self.tip_mm:g} is no less than root_mm {self.root_mm:g}: expected less")
        half_sphere_mm = sqrt(self.root_mm**2 - self.tip_mm**2) / 2
        if self.height_mm > half_sphere_mm + SLIVER_MM:
            raise OutOfRange(
                f"height_mm {self.height_mm:g} is more than half a sphere with root_mm {self.root_mm:g} and tip_mm "
                f"{self.tip_mm:g}: expected at most {half_sphere_mm:.4g}"
            )


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the array of bumps."""
    tip, base = p.tip_mm / 2, p.root_mm / 2
    radius = hypot(tip, (base**2 - tip**2 + p.height_mm**2) / (2 * p.height_mm))
    bulge = tan(asin(hypot(base - tip, p.height_mm) / (2 * radius)) / 2)  # of a quarter of the arc's angle

    def bump(x: float, y: float, z: float) -> list[Piece]:
        roof = rounded(z + p.height_mm)
        corners = [(0.0, z), *([(tip, z)] if tip else []), (base, roof), (0.0, roof)]
        return [Revolved(x, y, tuple(corners), (*([0.0] if tip else []), bulge, 0.0, 0.0))]

    def around(x: float, y: float, z: float) -> list[Piece]:
        roof, half = rounded(z + p.height_mm), p.period_mm / 2
        corners = [(tip, z), (half, z), (half, roof), *([(base, roof)] if base < half else [])]
        bulges = [0.0] * (len(corners) - 1) + [-bulge]
        return [Revolved(x, y, tuple(corners), tuple(bulges)), *beside_round(x, y, p.period_mm, z, roof)]

    return array_scene(p, fill, bump, around)
