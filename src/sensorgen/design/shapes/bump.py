"""Round bumps in a square array: spherical caps that touch the film at their lowest point.

One cell, cut through its middle (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
      (eeeeeeeeeeeeee)     bump, of the top electrode or of dielectric
        (eeeeeeeeee)
           '-ee-'
    xxxxxxxxxxxxxxxxxxxx   film
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass, field
from math import sqrt

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.array import ArrayParams, array_scene, beside_round
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Fill, Piece, Scene, rounded


@dataclass(frozen=True)
class Params(ArrayParams):
    """Parameters of the bumps."""

    root_mm: float = field(
        default=1.0, metadata={"help": "Diameter of a bump at the top electrode.", "range": (0.02, 100.0)}
    )

    def __post_init__(self) -> None:
        """Refuse bumps that would run into each other, or that are more than half a sphere."""
        self.refuse_wider(self.root_mm)
        if self.height_mm > self.root_mm / 2:
            raise OutOfRange(
                f"height_mm {self.height_mm:g} is more than half of root_mm {self.root_mm:g}: expected at most "
                "half a sphere"
            )


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the array of bumps."""
    base = p.root_mm / 2
    bulge = p.height_mm / base  # a cap's half angle is four times the angle of which this is the tangent

    def bump(x: float, y: float, z: float) -> list[Piece]:
        roof = rounded(z + p.height_mm)
        return [Revolved(x, y, ((0.0, z), (base, roof), (0.0, roof)), (_half_arc(bulge), 0.0, 0.0))]

    def around(x: float, y: float, z: float) -> list[Piece]:
        roof, half = rounded(z + p.height_mm), p.period_mm / 2
        corners = [(0.0, z), (half, z), (half, roof), *([(base, roof)] if base < half else [])]
        bulges = [0.0] * (len(corners) - 1) + [-_half_arc(bulge)]
        return [Revolved(x, y, tuple(corners), tuple(bulges)), *beside_round(x, y, p.period_mm, z, roof)]

    return array_scene(p, fill, bump, around)


def _half_arc(whole: float) -> float:
    """Bulge of half of an arc, given the bulge of all of it.

    >>> round(_half_arc(1.0), 6)  # of half a circle, a quarter
    0.414214
    """
    return (sqrt(1.0 + whole * whole) - 1.0) / whole
