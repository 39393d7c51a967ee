"""A porous plate: infill as the dielectric, lines of one direction in each layer, crossed from layer to layer.

Cut across the lines of every other layer (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
    xxxxxxxxxxxxxxxxxxxx   lines seen from their side
    xxxxx     xxxxx        lines seen from their end
    xxxxxxxxxxxxxxxxxxxx
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from dataclasses import dataclass
from itertools import pairwise
from math import floor

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.scene import SLIVER_MM, Body, Envelope, Fill, Prism, Scene, box, parameter


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters of the porous plate."""

    dielectric_mm: float = parameter(0.6, "Thickness of the porous plate.", 0.01, 10.0)
    line_mm: float = parameter(0.5, "Width of a line of the infill.", 0.02, 50.0)
    space_mm: float = parameter(0.4, "Least air between two lines; they are spread evenly.", 0.02, 50.0)
    layer_mm: float = parameter(0.1, "Height after which the lines change direction.", 0.01, 10.0)

    def __post_init__(self) -> None:
        """Refuse plates that are no whole number of layers."""
        layers = self.dielectric_mm / self.layer_mm
        if abs(layers - round(layers)) > 1e-6 or layers < 1:
            raise OutOfRange(
                f"dielectric_mm {self.dielectric_mm:g} is {layers:.4g} layers of layer_mm {self.layer_mm:g}: expected "
                "a whole number"
            )

    @property
    def period_mm(self) -> float:
        """Period of the lines, both ways [mm]."""
        return self.line_mm + self.space_mm

    def cells(self) -> float:
        """Number of cells of the pattern in the sensor, in all layers [-]."""
        return self.length_mm * self.width_mm / self.period_mm**2


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the porous plate; the lowest lines run along y."""
    low = p.electrode_mm

    def lines(of_air: bool) -> tuple[Prism, ...]:
        laid = []
        for layer in range(round(p.dielectric_mm / p.layer_mm)):
            z = (low + layer * p.layer_mm, low + (layer + 1) * p.layer_mm)
            for a, b in _places(p, p.width_mm if layer % 2 else p.length_mm, of_air):
                laid.append(box(0.0, p.length_mm, a, b, *z) if layer % 2 else box(a, b, 0.0, p.width_mm, *z))
        return tuple(laid)

    bodies = (
        Body("porous_dielectric", fill.dielectric, lines(of_air=False)),
        Body("support", fill.support, lines(of_air=True) if fill.support else ()),
    )
    return p.between_electrodes(fill, bodies, low + p.dielectric_mm)


def _places(p: Params, end_mm: float, of_air: bool) -> list[tuple[float, float]]:
    """Where the lines, or the spaces between them, start and stop: as many as fit, evenly from end to end [mm]."""
    count = max(floor((end_mm - p.line_mm) / p.period_mm + 1e-9) + 1, 1)
    pitch = (end_mm - p.line_mm) / (count - 1) if count > 1 else 0.0
    starts = [k * pitch for k in range(count)]
    if not of_air:
        return [(a, min(a + p.line_mm, end_mm)) for a in starts]
    ends = [(a + p.line_mm, b) for a, b in pairwise([*starts, end_mm])]
    return [(a, b) for a, b in ends if b - a > SLIVER_MM]
