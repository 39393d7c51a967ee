"""Two plain plates on top of each other that share the electrode between them: the double-layer differential sensor.

::

    ================  top electrode
    ................  upper dielectric, of the part 'dielectric'
    ================  middle electrode, as the top one
    ,,,,,,,,,,,,,,,,  lower dielectric, of the part 'film'
    ================  bottom electrode

A load strains both films: they differ by how they deform, so each has its thickness and material.
"""

from dataclasses import dataclass, field

from sensorgen.scene.scene import Body, Envelope, Fill, Prism, Scene, box, rounded


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters of the two plates."""

    lower_dielectric_mm: float = field(
        default=0.6, metadata={"help": "Thickness of the lower dielectric plate.", "range": (0.0, 10.0)}
    )
    upper_dielectric_mm: float = field(
        default=0.6, metadata={"help": "Thickness of the upper dielectric plate.", "range": (0.0, 10.0)}
    )


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the double sensor."""
    parts = [
        ("bottom_electrode", fill.bottom_electrode, p.electrode_mm, "bottom"),
        ("lower_dielectric", fill.film, p.lower_dielectric_mm, ""),
        ("middle_electrode", fill.top_electrode, p.electrode_mm, "middle"),
        ("upper_dielectric", fill.dielectric, p.upper_dielectric_mm, ""),
        ("top_electrode", fill.top_electrode, p.electrode_mm, "top"),
        ("isolation", fill.isolation, p.isolation_mm, ""),
    ]
    bodies, at = [], 0.0
    for name, material, thickness, terminal in parts:
        bodies.append(Body(name, material, _plate(p, at, at + thickness), terminal))
        at += thickness
    return Scene(tuple(bodies), (p.length_mm, p.width_mm, rounded(at)))


def _plate(p: Params, z0: float, z1: float) -> tuple[Prism, ...]:
    return (box(0.0, p.length_mm, 0.0, p.width_mm, z0, z1),) if z1 > z0 else ()
