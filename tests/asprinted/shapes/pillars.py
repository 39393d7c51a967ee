"""Round posts, or strips at 45 degrees, that hang from the top electrode onto a film: a shape of a user's own.

::

    eeeeeee   top electrode
      eee     post or strip
    xxxxxxx   film
    eeeeeee   bottom electrode
"""

from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, pi, sin

import numpy as np
import shapely

from sensorgen.scene.layers import outlines
from sensorgen.scene.scene import Body, Envelope, Fill, Prism, Scene, box

SHORT = "pi"


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters."""

    period_mm: float = field(default=3.0, metadata={"help": "Period.", "range": (0.1, 100.0)})
    across_mm: float = field(default=1.6, metadata={"help": "Diameter, or width.", "range": (0.1, 100.0)})
    dielectric_mm: float = field(default=0.2, metadata={"help": "Film.", "range": (0.0, 10.0)})
    pattern: str = field(default="posts", metadata={"help": "Pattern.", "choices": ("posts", "slanted")})


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the sensor."""
    z = np.cumsum([0.0, p.electrode_mm, p.dielectric_mm, 0.4, p.electrode_mm]).round(9).tolist()
    x, y = p.length_mm, p.width_mm
    if p.pattern == "posts":
        turn = np.arange(32) * pi / 16
        places = np.mgrid[0 : int(x / p.period_mm) + 1, 0 : int(y / p.period_mm) + 1].reshape(2, -1).T
        plan = [
            [((i + 0.5) * p.period_mm + p.across_mm / 2 * cos(a), (j + 0.5) * p.period_mm + p.across_mm / 2 * sin(a))
             for a in turn]
            for i, j in places
        ]  # fmt: skip
    else:
        step, wide = p.period_mm * 2**0.5, p.across_mm * 2**0.5
        starts = np.arange(-int(y / step) - 2, int(x / step) + 2) * step
        plan = [[(s, 0.0), (s + wide, 0.0), (s + wide + y, y), (s + y, y)] for s in starts]
    inside = shapely.clip_by_rect(shapely.union_all([shapely.Polygon(o) for o in plan]), 0, 0, x, y)
    plates = [(box(0, x, 0, y, low, high),) for low, high in pairwise(z)]
    pattern = tuple(Prism("z", outline, z[2], z[3]) for outline in outlines(inside))
    bodies = (
        Body("bottom_electrode", fill.bottom_electrode, plates[0], "bottom"),
        Body("film", fill.film, plates[1]),
        Body("top_electrode_with_pattern", fill.top_electrode, pattern + plates[3], "top"),
    )
    return Scene(bodies, (x, y, z[-1]))
