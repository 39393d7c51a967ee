"""A plain plate of X60 between two electrodes: what the microstructures are compared with.

::

    ================  top electrode
    ................  dielectric
    ================  bottom electrode
"""

from dataclasses import dataclass, field

from sensorgen.scene.scene import Body, Envelope, Fill, Scene, rounded


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters of the plate."""

    dielectric_mm: float = field(
        default=0.6, metadata={"help": "Thickness of the dielectric plate.", "range": (0.0, 10.0)}
    )


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the plate sensor."""
    low, high = p.electrode_mm, p.electrode_mm + p.dielectric_mm
    top = high + p.electrode_mm

    bodies = (
        Body("bottom_electrode", fill.bottom_electrode, p.plate(0.0, low), "bottom"),
        Body("dielectric", fill.dielectric, p.plate(low, high)),
        Body("top_electrode", fill.top_electrode, p.plate(high, top), "top"),
        Body("isolation", fill.isolation, p.plate(top, top + p.isolation_mm)),
    )
    return Scene(bodies, (p.length_mm, p.width_mm, rounded(top + p.isolation_mm)))
