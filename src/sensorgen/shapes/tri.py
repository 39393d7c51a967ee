r"""Prisms of triangles: cogs that touch the film along a line, apex down.

One period, seen along the prisms (e: conductor, x: dielectric, blank: air)::

    eeeeeeeeeeeeeeeeeeee   top electrode
    \eeeeeeee/\xxxxxxxx/   hanging triangles, base p/2, alternately cog and dielectric
      \eeee/    \xxxx/
    x   \/   xx   \/   x   lower triangles, base p/2, apex up, valleys under the hanging apexes
    xxxxxxxxxxxxxxxxxxxx   film
    eeeeeeeeeeeeeeeeeeee   bottom electrode
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import ceil

from sensorgen.errors import OutOfRange
from sensorgen.scene import Body, Envelope, Fill, Outline, Point, Prism, Scene, clipped, rectangle


@dataclass(frozen=True)
class Params(Envelope):
    """Parameters of the triangular microstructure."""

    period_mm: float = field(default=2.0, metadata={"help": "Period of the pattern.", "range": (0.1, 100.0)})
    hang_height_mm: float = field(
        default=0.5, metadata={"help": "Height of the hanging triangles.", "range": (0.01, 10.0)}
    )
    lower_height_mm: float = field(
        default=0.24, metadata={"help": "Height of the triangles on the film.", "range": (0.01, 10.0)}
    )
    dielectric_mm: float = field(
        default=0.2, metadata={"help": "Thickness of the film under the apexes.", "range": (0.0, 10.0)}
    )
    along: str = field(
        default="x",
        metadata={"help": "Axis along which the pattern repeats (x: triX, y: triY).", "choices": ("x", "y")},
    )

    def __post_init__(self) -> None:
        """Refuse triangles that would run into each other."""
        if self.lower_height_mm >= self.hang_height_mm:
            raise OutOfRange(
                f"lower_height_mm {self.lower_height_mm:g} must stay below hang_height_mm "
                f"{self.hang_height_mm:g}: the triangles would run into each other"
            )

    def cells(self) -> float:
        """How many cells of the pattern the sensor holds [-]."""
        return (self.length_mm if self.along == "x" else self.width_mm) / self.period_mm


def scene(p: Params, fill: Fill) -> Scene:
    """Bodies of the triangular sensor."""
    low = p.electrode_mm
    film, roof = low + p.dielectric_mm, low + p.dielectric_mm + p.hang_height_mm
    top = roof + p.electrode_mm
    end, depth = (p.length_mm, p.width_mm) if p.along == "x" else (p.width_mm, p.length_mm)
    halves = range(2 * ceil(p.cells() - 1e-9) + 1)

    def prisms(outlines: Iterator[Outline] | list[Outline]) -> tuple[Prism, ...]:
        axis = "y" if p.along == "x" else "x"
        cut = (clipped(outline, end) for outline in outlines)
        return tuple(Prism(axis, outline, 0.0, depth) for outline in cut if outline)

    def apex(k: int) -> float:
        """Place of the k-th hanging apex; the even ones are cogs [mm]."""
        return (k + 0.5) * p.period_mm / 2

    def layer(z0: float, z1: float) -> tuple[Prism, ...]:
        return prisms([rectangle(0.0, end, z0, z1)])

    quarter = p.period_mm / 4
    comb = [(end, top), (0.0, top), (0.0, roof)]
    for k in halves[::2]:
        comb += [(apex(k) - quarter, roof), (apex(k), film), (apex(k) + quarter, roof)]
    comb += [(max(end, apex(halves[-1]) + quarter), roof), (max(end, apex(halves[-1]) + quarter), top)]
    hanging = ([(apex(k) - quarter, roof), (apex(k), film), (apex(k) + quarter, roof)] for k in halves[1::2])
    feet = ([(apex(k), film), (apex(k) - quarter, film + p.lower_height_mm), (apex(k) - 2 * quarter, film)] for k in halves)
    air = (
        [(apex(k) - 2 * quarter, film), (apex(k) - quarter, film + p.lower_height_mm), (apex(k), film), (apex(k) - quarter, roof)]
        for k in halves
    )

    bodies = [Body("bottom_electrode", fill.bottom_electrode, layer(0.0, low), "bottom")]
    if p.dielectric_mm > 0 and fill.film == fill.dielectric:
        sawtooth = _sawtooth([apex(k) for k in halves], film, film + p.lower_height_mm)
        foot = [(0.0, low), (sawtooth[0][0], low), *sawtooth]
        bodies.append(Body("film_and_lower", fill.film, prisms([tuple(foot)])))
    else:
        if p.dielectric_mm > 0:
            bodies.append(Body("film", fill.film, layer(low, film)))
        bodies.append(Body("lower_dielectric", fill.dielectric, prisms(map(tuple, feet))))
    if fill.support:
        bodies.append(Body("support", fill.support, prisms(map(tuple, air))))
    bodies.append(Body("hanging_dielectric", fill.dielectric, prisms(map(tuple, hanging))))
    bodies.append(Body("top_electrode_with_cogs", fill.top_electrode, prisms([tuple(comb)]), "top"))
    if p.isolation_mm > 0:
        bodies.append(Body("isolation", fill.isolation, layer(top, top + p.isolation_mm)))
    return Scene(tuple(bodies), (p.length_mm, p.width_mm, round(top + p.isolation_mm, 12)))


def _sawtooth(valleys_mm: list[float], low_mm: float, high_mm: float) -> list[Point]:
    """Upper side of film and lower triangles, from right to left [mm]."""
    quarter = (valleys_mm[1] - valleys_mm[0]) / 2
    line = [(valleys_mm[0] - quarter, high_mm)]
    for valley in valleys_mm:
        line += [(valley, low_mm), (valley + quarter, high_mm)]
    return line[::-1]
