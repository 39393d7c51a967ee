r"""Two layers of triangles on top of each other that share the electrode between them: the differential sensor.

One period, seen along the prisms; each layer as the shape ``tri`` (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode, its cogs hang into the upper layer
    x   \/   xx   \/   x   upper triangles and film
    eeeeeeeeeeeeeeeeeeee   middle electrode, its cogs hang into the lower layer
    x   \/   xx   \/   x   lower triangles and film
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass, field, replace

from sensorgen.scene.patterns import LayerFrame, TriangleParams, layer_bodies
from sensorgen.scene.scene import Body, Fill, Scene, rounded

SHORT = "doubletri"
_MIDDLE = "middle_electrode_with_cogs"


@dataclass(frozen=True)
class Params(TriangleParams):
    """Parameters of both layers; of 2 mm, the tips of hanging triangles are too narrow for most slicers."""

    period_mm: float = field(default=3.0, metadata=TriangleParams.__dataclass_fields__["period_mm"].metadata)


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the double sensor of triangles."""
    lower = LayerFrame(p, p.electrode_mm)
    upper = LayerFrame(p, lower.top)
    first = [
        replace(b, name=_MIDDLE, terminal="middle") if b.terminal else replace(b, name=f"lower_{b.name}")
        for b in layer_bodies(p, fill, lower.low)
    ]
    second = [b if b.terminal else replace(b, name=f"upper_{b.name}") for b in layer_bodies(p, fill, upper.low)]
    lid = upper.prisms([upper.layer(upper.top, upper.top + p.isolation_mm)]) if p.isolation_mm else ()
    bodies = [
        Body("bottom_electrode", fill.bottom_electrode, lower.prisms([lower.layer(0.0, lower.low)]), "bottom"),
        *_joined(first, second),
        Body("isolation", fill.isolation, lid),
    ]
    return Scene(tuple(bodies), (p.length_mm, p.width_mm, rounded(upper.top + p.isolation_mm)))


def _joined(first: list[Body], second: list[Body]) -> list[Body]:
    """All bodies, the support of both layers as one."""
    supports = [b for b in (*first, *second) if b.name.endswith("support")]
    support = replace(supports[0], name="support", pieces=tuple(p for b in supports for p in b.pieces))
    return [*(b for b in first if b not in supports), support, *(b for b in second if b not in supports)]
