"""Two layers of crossed strips: cogs hang from cogs, and the lower ones stand on the film.

One period of one layer, seen along its strips (e: conductor, x: dielectric, blank: air)::

    eeeeeee   xxxxxxx   |eeeeeee ...
    etpu   air  x60  air

The upper layer's conductor strips hang on the top electrode, the lower layer's hang on them where they
cross: all of them are at the top electrode's potential.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil, cos, floor, radians, sin

from sensorgen.scene.scene import (
    SLIVER_MM,
    Body,
    Envelope,
    Fill,
    Outline,
    Point,
    Prism,
    Scene,
    area_mm2,
    box,
    choice,
    parameter,
    rectangle,
    rounded,
)

SHORT = "sq"  # as the thesis's specimens are named: sqXY, sqYX


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters of the crossed strips."""

    etpu_width_mm: float = parameter(0.7, "Width of a conductor strip.", 0.02, 50.0)
    air_width_mm: float = parameter(0.3, "Air between a conductor strip and its neighbours.", 0.02, 50.0)
    x60_width_mm: float = parameter(0.7, "Width of a dielectric strip.", 0.02, 50.0)
    upper_height_mm: float = parameter(0.3, "Height of the upper strip layer.", 0.01, 10.0)
    lower_height_mm: float = parameter(0.3, "Height of the lower strip layer.", 0.01, 10.0)
    dielectric_mm: float = parameter(0.2, "Thickness of the film under the strips.", 0.0, 10.0)
    along: str = choice("xy", "Direction of the upper, then of the lower strips (xy: sqXY).", "xy", "yx")
    angle_deg: float = parameter(90.0, "Angle from the lower to the upper strips [degree].", 10.0, 170.0, later=True)

    @property
    def period_mm(self) -> float:
        """Period of both layers [mm]."""
        return self.etpu_width_mm + self.x60_width_mm + 2 * self.air_width_mm

    def cells(self) -> float:
        """Number of cells of the pattern in the sensor [-]."""
        return self.length_mm * self.width_mm / self.period_mm**2


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the crossed-strip sensor."""
    low = p.electrode_mm
    film = low + p.dielectric_mm
    middle = film + p.lower_height_mm
    roof = middle + p.upper_height_mm
    upper, lower = p.along[0], p.along[1]

    def both(part: str) -> tuple[Prism, ...]:
        return _strips(p, part, lower, film, middle) + upper_strips(part)

    def upper_strips(part: str) -> tuple[Prism, ...]:
        if p.angle_deg == 90:
            return _strips(p, part, upper, middle, roof)
        way = radians(90.0 - p.angle_deg if lower == "y" else p.angle_deg)
        return tuple(Prism("z", outline, rounded(middle), rounded(roof)) for outline in _slanted(p, part, way))

    bodies = [
        *_lower(p.plate(low, film), _strips(p, "x60", lower, film, middle), fill),
        Body("support", fill.support, both("air") if fill.support else ()),
        Body("hanging_dielectric", fill.dielectric, upper_strips("x60")),
    ]
    return p.between_electrodes(fill, bodies, roof, both("etpu"))


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


def _slanted(p: Params, part: str, way: float) -> Iterator[Outline]:
    """Outlines of the strips of a part that run at an angle from x, the first edge of one through the corner [mm]."""
    across = (-sin(way), cos(way))
    whole = rectangle(0.0, p.length_mm, 0.0, p.width_mm)
    reach = [x * across[0] + y * across[1] for x, y in whole]
    for k in range(floor(min(reach) / p.period_mm), ceil(max(reach) / p.period_mm)):
        for start, stop in _runs(p, part):
            outline = _beyond(whole, across, k * p.period_mm + start, 1.0)
            outline = _beyond(outline, across, k * p.period_mm + stop, -1.0)
            if len(outline) > 2 and area_mm2(outline) > SLIVER_MM:
                yield outline


def _beyond(outline: Outline, across: Point, at_mm: float, side: float) -> Outline:
    """The part of a convex outline on one side of a line (Sutherland and Hodgman, 1974)."""
    corners: list[Point] = []
    away = [side * (x * across[0] + y * across[1] - at_mm) for x, y in outline]
    for k, (x, y) in enumerate(outline):
        (u, v), before = outline[k - 1], away[k - 1]
        if (before > 0) != (away[k] > 0):
            share = before / (before - away[k])
            corners.append((rounded(u + share * (x - u)), rounded(v + share * (y - v))))
        corners += [(x, y)] if away[k] > 0 else []
    return tuple(point for k, point in enumerate(corners) if point != corners[k - 1])


def _runs(p: Params, part: str) -> list[tuple[float, float]]:
    """Where the strips of a part start and stop in the first period [mm]."""
    etpu, air, x60 = p.etpu_width_mm, p.air_width_mm, p.x60_width_mm
    return {
        "etpu": [(0.0, etpu)],
        "x60": [(etpu + air, etpu + air + x60)],
        "air": [(etpu, etpu + air), (etpu + air + x60, p.period_mm)],
    }[part]


def _places(p: Params, part: str, end_mm: float) -> Iterator[tuple[float, float]]:
    """Where the strips of a part start and stop, the last one cut at the sensor's end [mm]."""
    for k in range(ceil(end_mm / p.period_mm - 1e-9)):
        for start, stop in _runs(p, part):
            a, b = rounded(k * p.period_mm + start), min(rounded(k * p.period_mm + stop), end_mm)
            if b - a > SLIVER_MM:
                yield a, b
