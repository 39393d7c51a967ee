"""Two plain plates on top of each other that share the electrode between them: the double-layer differential sensor.

::

    ================  top electrode
    ................  upper dielectric, of the part 'dielectric'
    ================  middle electrode, as the top one
    ,,,,,,,,,,,,,,,,  lower dielectric, of the part 'film'
    ================  bottom electrode

A load strains both films: they differ by how they deform, so each has its thickness and material.
"""

from dataclasses import dataclass

from sensorgen.scene.scene import Body, Envelope, Fill, Scene, parameter


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters of the two plates."""

    lower_dielectric_mm: float = parameter(0.6, "Thickness of the lower dielectric plate.", 0.0, 10.0)
    upper_dielectric_mm: float = parameter(0.6, "Thickness of the upper dielectric plate.", 0.0, 10.0)


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the double sensor."""
    low = p.electrode_mm + p.lower_dielectric_mm
    high = low + p.electrode_mm
    roof = high + p.upper_dielectric_mm
    bodies = (
        Body("lower_dielectric", fill.film, p.plate(p.electrode_mm, low)),
        Body("middle_electrode", fill.top_electrode, p.plate(low, high), "middle"),
        Body("upper_dielectric", fill.dielectric, p.plate(high, roof)),
    )
    return p.between_electrodes(fill, bodies, roof)
