"""Two layers of crossed strips: cogs hang from cogs, and the lower ones stand on the film.

One period of one layer, seen along its strips (e: conductor, x: dielectric, blank: air)::

    eeeeeee   xxxxxxx   |eeeeeee ...
    etpu   air  x60  air

The upper layer's conductor strips hang on the top electrode, the lower layer's hang on them where they
cross: all of them are at the top electrode's potential.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import ceil

from sensorgen.scene.scene import SLIVER_MM, Body, Envelope, Fill, Prism, Scene, box, rounded

SHORT = "sq"  # as the thesis's specimens are named: sqXY, sqYX


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters of the crossed strips."""

    etpu_width_mm: float = field(default=0.7, metadata={"help": "Width of a conductor strip.", "range": (0.02, 50.0)})
    air_width_mm: float = field(
        default=0.3, metadata={"help": "Air between a conductor strip and its neighbours.", "range": (0.02, 50.0)}
    )
    x60_width_mm: float = field(default=0.7, metadata={"help": "Width of a dielectric strip.", "range": (0.02, 50.0)})
    upper_height_mm: float = field(
        default=0.3, metadata={"help": "Height of the upper strip layer.", "range": (0.01, 10.0)}
    )
    lower_height_mm: float = field(
        default=0.3, metadata={"help": "Height of the lower strip layer.", "range": (0.01, 10.0)}
    )
    dielectric_mm: float = field(
        default=0.2, metadata={"help": "Thickness of the film under the strips.", "range": (0.0, 10.0)}
    )
    along: str = field(
        default="xy",
        metadata={"help": "Direction of the upper, then of the lower strips (xy: sqXY).", "choices": ("xy", "yx")},
    )

    @property
    def period_mm(self) -> float:
        """Period of both layers [mm]."""
        return self.etpu_width_mm + self.x60_width_mm + 2 * self.air_width_mm

    def cells(self) -> float:
        """How many cells of the pattern the sensor holds [-]."""
        return self.length_mm * self.width_mm / self.period_mm**2


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the crossed-strip sensor."""
    low = p.electrode_mm
    film = low + p.dielectric_mm
    middle = film + p.lower_height_mm
    roof = middle + p.upper_height_mm
    top = roof + p.electrode_mm
    upper, lower = p.along[0], p.along[1]

    def plate(z0: float, z1: float) -> tuple[Prism, ...]:
        return (box(0.0, p.length_mm, 0.0, p.width_mm, z0, z1),) if z1 - z0 > SLIVER_MM else ()

    def both(part: str) -> tuple[Prism, ...]:
        return _strips(p, part, lower, film, middle) + _strips(p, part, upper, middle, roof)

    feet = _strips(p, "x60", lower, film, middle)
    bodies = [
        Body("bottom_electrode", fill.bottom_electrode, plate(0.0, low), "bottom"),
        *_lower(plate(low, film), feet, fill),
        Body("support", fill.support, both("air") if fill.support else ()),
        Body("hanging_dielectric", fill.dielectric, _strips(p, "x60", upper, middle, roof)),
        Body("top_electrode_with_cogs", fill.top_electrode, both("etpu") + plate(roof, top), "top"),
        Body("isolation", fill.isolation, plate(top, top + p.isolation_mm)),
    ]
    return Scene(tuple(bodies), (p.length_mm, p.width_mm, rounded(top + p.isolation_mm)))


def _lower(film: tuple[Prism, ...], feet: tuple[Prism, ...], fill: Fill) -> list[Body]:
    """Film and lower dielectric strips: one body where they are of one material."""
    if film and fill.film == fill.dielectric:
        return [Body("film_and_lower", fill.film, film + feet)]
    return [Body("film", fill.film, film), Body("lower_dielectric", fill.dielectric, feet)]


def _strips(p: Params, part: str, direction: str, z0: float, z1: float) -> tuple[Prism, ...]:
    """The strips of one part, in one direction, between two heights."""
    if direction == "x":
        return tuple(box(0.0, p.length_mm, a, b, z0, z1) for a, b in _places(p, part, p.width_mm))
    return tuple(box(a, b, 0.0, p.width_mm, z0, z1) for a, b in _places(p, part, p.length_mm))


def _places(p: Params, part: str, end_mm: float) -> Iterator[tuple[float, float]]:
    """Where the strips of a part start and stop, the last one cut at the sensor's end [mm]."""
    etpu, air, x60 = p.etpu_width_mm, p.air_width_mm, p.x60_width_mm
    runs = {
        "etpu": [(0.0, etpu)],
        "x60": [(etpu + air, etpu + air + x60)],
        "air": [(etpu, etpu + air), (etpu + air + x60, p.period_mm)],
    }
    for k in range(ceil(end_mm / p.period_mm - 1e-9)):
        for start, stop in runs[part]:
            a, b = rounded(k * p.period_mm + start), min(rounded(k * p.period_mm + stop), end_mm)
            if b - a > SLIVER_MM:
                yield a, b
