"""A plain plate of X60 between two electrodes: what the microstructures are compared with.

::

    ================  top electrode
    ................  dielectric
    ================  bottom electrode
"""

from dataclasses import dataclass

from sensorgen.scene.scene import Body, Envelope, Fill, Scene, parameter


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters of the plate."""

    dielectric_mm: float = parameter(0.6, "Thickness of the dielectric plate.", 0.0, 10.0)


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the plate sensor."""
    low, high = p.electrode_mm, p.electrode_mm + p.dielectric_mm
    return p.between_electrodes(fill, [Body("dielectric", fill.dielectric, p.plate(low, high))], high)
