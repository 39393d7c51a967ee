"""Rows of triangles between a bottom and a top electrode: what the shapes of one and of two layers share."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.scene import Body, Envelope, Fill, Outline, Point, Prism, choice, clipped, parameter, rectangle


@dataclass(frozen=True)
class TriangleParams(Envelope):
    """Parameters of the triangular microstructure."""

    period_mm: float = parameter(2.0, "Period of the pattern.", 0.1, 100.0)
    hang_height_mm: float = parameter(0.5, "Height of the hanging triangles.", 0.01, 10.0)
    lower_height_mm: float = parameter(0.24, "Height of the triangles on the film.", 0.01, 10.0)
    dielectric_mm: float = parameter(0.2, "Thickness of the film under the apexes.", 0.0, 10.0)
    along: str = choice("x", "Axis along which the pattern repeats (x: triX, y: triY).", "x", "y")
    tip_mm: float = parameter(
        0.0, "Width of the hanging triangles' flat tips; 0 for sharp ones.", 0.0, 50.0, later=True
    )

    def __post_init__(self) -> None:
        """Refuse triangles that would run into each other."""
        if self.lower_height_mm >= self.hang_height_mm:
            raise OutOfRange(
                f"lower_height_mm {self.lower_height_mm:g} must stay below hang_height_mm "
                f"{self.hang_height_mm:g}: the triangles would run into each other"
            )
        if self.tip_mm >= self.period_mm / 2:
            raise OutOfRange(
                f"tip_mm {self.tip_mm:g} leaves no flanks; expected less than half of period_mm {self.period_mm:g}"
            )

    def cells(self) -> float:
        """Number of cells of the pattern in the sensor [-]."""
        return (self.length_mm if self.along == "x" else self.width_mm) / self.period_mm


def layer_bodies(p: TriangleParams, fill: Fill, floor_mm: float) -> list[Body]:
    """Bodies of one layer over an electrode that ends at a height, its upper electrode among them."""
    f = LayerFrame(p, floor_mm)
    return [
        *_lower(f, fill),
        Body("support", fill.support, f.prisms(f.air()) if fill.support else ()),
        Body("hanging_dielectric", fill.dielectric, f.prisms(f.hanging())),
        Body("top_electrode_with_cogs", fill.top_electrode, f.prisms([f.comb()]), "top"),
    ]


def _lower(f: "LayerFrame", fill: Fill) -> list[Body]:
    """Film and lower triangles: one body where they are of one material."""
    if f.film == f.low:
        return [Body("lower_dielectric", fill.dielectric, f.prisms(f.feet()))]
    if fill.film == fill.dielectric:
        return [Body("film_and_lower", fill.film, f.prisms([f.film_with_feet()]))]
    film = Body("film", fill.film, f.prisms([f.layer(f.low, f.film)]))
    return [film, Body("lower_dielectric", fill.dielectric, f.prisms(f.feet()))]


class LayerFrame:
    """Heights and places that the outlines of one layer share, and the outlines, not yet cut at the end [mm]."""

    def __init__(self, p: TriangleParams, floor_mm: float) -> None:
        self.low = floor_mm
        self.film = self.low + p.dielectric_mm
        self.peak = self.film + p.lower_height_mm
        self.roof = self.film + p.hang_height_mm
        self.top = self.roof + p.electrode_mm
        self.quarter, self.blunt = p.period_mm / 4, p.tip_mm / 2
        self.end, self.depth = (p.length_mm, p.width_mm) if p.along == "x" else (p.width_mm, p.length_mm)
        self.axis = "y" if p.along == "x" else "x"
        # Hanging apexes, first a cog's, then in turn; enough of them to go beyond the end.
        self.apexes = [(k + 0.5) * p.period_mm / 2 for k in range(2 * ceil(p.cells() - 1e-9) + 1)]

    def prisms(self, outlines: Iterable[Iterable[Point]]) -> tuple[Prism, ...]:
        """Cut outlines to the sensor and extrude them; what lies beyond its end is left out."""
        cut = (clipped(outline, self.end) for outline in outlines)
        return tuple(Prism(self.axis, outline, 0.0, self.depth) for outline in cut if outline)

    def layer(self, z0: float, z1: float) -> Outline:
        """A plate between two heights."""
        return rectangle(0.0, self.end, z0, z1)

    def triangle(self, apex: float) -> list[Point]:
        """A hanging triangle, from left to right."""
        tips = [(apex - self.blunt, self.film), (apex + self.blunt, self.film)] if self.blunt else [(apex, self.film)]
        return [(apex - self.quarter, self.roof), *tips, (apex + self.quarter, self.roof)]

    def hanging(self) -> list[list[Point]]:
        """Dielectric triangles that hang from the electrode."""
        return [self.triangle(apex) for apex in self.apexes[1::2]]

    def comb(self) -> list[Point]:
        """Top electrode with its cogs."""
        beyond = max(self.end, self.apexes[-1] + self.quarter)
        teeth = [point for apex in self.apexes[::2] for point in self.triangle(apex)]
        return [(beyond, self.top), (0.0, self.top), (0.0, self.roof), *teeth, (beyond, self.roof)]

    def feet(self) -> list[list[Point]]:
        """Triangles on the film, each to the left of a hanging apex."""
        q, t = self.quarter, self.blunt
        return [[(a - 2 * q + t, self.film), (a - t, self.film), (a - q, self.peak)] for a in self.apexes]

    def film_with_feet(self) -> list[Point]:
        """The film and the triangles on it."""
        q, t = self.quarter, self.blunt
        valleys = ([(a + t, self.film), (a - t, self.film)] if t else [(a, self.film)] for a in reversed(self.apexes))
        peaks = ((a + q, self.peak) for a in reversed(self.apexes))
        teeth = [point for peak, valley in zip(peaks, valleys, strict=True) for point in (peak, *valley)]
        return [(0.0, self.low), (teeth[0][0], self.low), *teeth, (self.apexes[0] - self.quarter, self.peak)]

    def air(self) -> list[list[Point]]:
        """Air above each foot."""
        q, t = self.quarter, self.blunt
        return [[(a - 2 * q + t, self.film), (a - q, self.peak), (a - t, self.film), (a - q, self.roof)]
                for a in self.apexes]  # fmt: skip
