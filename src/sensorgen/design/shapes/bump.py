"""Round bumps in a square array: spherical caps that touch the film, cut off flat at the tip.

One cell, cut through its middle (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
      (eeeeeeeeeeeeee)     bump, of the top electrode or of dielectric
        (eeeeeeeeee)
           'eeee'
    xxxxxxxxxxxxxxxxxxxx   film
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass
from math import asin, hypot, sqrt, tan

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.patterns import TippedParams, revolved_scene
from sensorgen.scene.scene import SLIVER_MM, Fill, Scene, parameter


@dataclass(frozen=True)
class Params(TippedParams):
    """Parameters of the bumps."""

    root_mm: float = parameter(1.0, "Diameter of a bump at the top electrode.", 0.02, 100.0)
    tip_mm: float = parameter(0.58, "Diameter of its flat tip; 0 for a whole cap.", 0.0, 100.0)

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
    return revolved_scene(p, fill, bulge)
