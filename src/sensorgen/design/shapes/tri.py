r"""Prisms of triangles: cogs that touch the film along a line, apex down.

One period, seen along the prisms (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
    \eeeeeeee/\xxxxxxxx/   hanging triangles, base p/2, alternately cog and dielectric
      \eeee/    \xxxx/
    x   \/   xx   \/   x   lower triangles, base p/2, apex up, valleys under the hanging apexes
    xxxxxxxxxxxxxxxxxxxx   film
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass

from sensorgen.scene.patterns import LayerFrame, TriangleParams, layer_bodies
from sensorgen.scene.scene import Body, Fill, Scene, rounded


@dataclass(frozen=True)
class Params(TriangleParams):
    """Parameters of the triangular microstructure."""


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the triangular sensor."""
    f = LayerFrame(p, p.electrode_mm)
    bodies = [
        Body("bottom_electrode", fill.bottom_electrode, f.prisms([f.layer(0.0, f.low)]), "bottom"),
        *layer_bodies(p, fill, f.low),
        Body("isolation", fill.isolation, f.prisms([f.layer(f.top, f.top + p.isolation_mm)]) if p.isolation_mm else ()),
    ]
    size_mm = (p.length_mm, p.width_mm, rounded(f.top + p.isolation_mm))
    return Scene(tuple(bodies), size_mm)
