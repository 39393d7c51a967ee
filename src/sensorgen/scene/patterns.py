"""Patterns that several shapes share: strips, rows of triangles, square arrays of structures.

Strips across a sensor that follow each other along one of its axes: what the shapes of them share.

Rows of triangles between a bottom and a top electrode: what the shapes of one and of two layers share.

Structures in a square array that hang from the top electrode, their tips on a film: what the shapes of it share.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from math import ceil, cos, floor, pi, sin

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import (
    SLIVER_MM,
    Body,
    Envelope,
    Fill,
    Outline,
    Piece,
    Point,
    Prism,
    Scene,
    box,
    choice,
    clipped,
    parameter,
    rectangle,
    rounded,
)


@dataclass(frozen=True)
class StripParams(Envelope):
    """Parameters of every such pattern."""

    period_mm: float = parameter(2.0, "Period of the pattern.", 0.1, 100.0)
    along: str = choice("x", "Axis along which the strips follow each other.", "x", "y")

    def refuse_whole(self, name: str) -> None:
        """Refuse a width that leaves nothing of the period."""
        if (width_mm := getattr(self, name)) >= self.period_mm:
            raise OutOfRange(f"{name} {width_mm:g} leaves nothing of period_mm {self.period_mm:g}: expected less")

    def cells(self) -> float:
        """Number of cells of the pattern in the sensor [-]."""
        return (self.length_mm if self.along == "x" else self.width_mm) / self.period_mm

    def strips(self, start_mm: float, stop_mm: float, low_mm: float, high_mm: float) -> tuple[Prism, ...]:
        """A box in each period from one place in it to another, cut at the sensor's ends, between two heights [mm]."""
        sizes = (self.length_mm, self.width_mm)
        end, depth = sizes if self.along == "x" else sizes[::-1]
        count = ceil(end / self.period_mm - 1e-9) + 1
        spans = (
            (max(k * self.period_mm + start_mm, 0.0), min(k * self.period_mm + stop_mm, end)) for k in range(count)
        )
        within = [(a, b) for a, b in spans if b - a > SLIVER_MM]
        if self.along == "x":
            return tuple(box(a, b, 0.0, depth, low_mm, high_mm) for a, b in within)
        return tuple(box(0.0, depth, a, b, low_mm, high_mm) for a, b in within)


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


_NO_RIM_MM = 1e-6


@dataclass(frozen=True)
class ArrayParams(Envelope):
    """Parameters of every such array."""

    period_mm: float = parameter(1.25, "Period of the array, both ways.", 0.1, 100.0)
    height_mm: float = parameter(0.4, "Height of a structure.", 0.01, 10.0)
    dielectric_mm: float = parameter(0.2, "Thickness of the film under the tips.", 0.0, 10.0)
    cog: str = choice(
        "electrode", "What a structure extends: cogs of the electrode, or a dielectric that carries it.", "electrode",
        "dielectric",
    )  # fmt: skip

    def cells(self) -> float:
        """Number of cells of the pattern in the sensor [-]."""
        return self.length_mm * self.width_mm / self.period_mm**2

    def fitting(self) -> tuple[int, int]:
        """Number of whole cells along its length and width."""
        along, across = (floor(size / self.period_mm + 1e-9) for size in (self.length_mm, self.width_mm))
        return along, across

    def parts(self) -> list[tuple[float, float, float]]:
        """Length and width of sensors that make it up [mm], and how many of each: one cell, then those with rims.

        Inner cells are mirrored in their walls, so that they may be cut there; what whole cells leave at either end
        belongs to the last of them, and the two ends of a row are one sensor of two cells. The wall between an end and
        an inner cell is no mirror: insulating it lowers the capacitance, of cones on 12 x 6 mm by at most 0.15 %.
        """

        def along(size: float, cells: int) -> list[tuple[float, int]]:
            left = size - cells * self.period_mm
            if left < _NO_RIM_MM:
                return [(self.period_mm, cells)]
            ends = min(cells, 2)
            return [(self.period_mm, cells - ends), (rounded(ends * self.period_mm + left), 1)]

        rows, columns = (along(*each) for each in zip((self.length_mm, self.width_mm), self.fitting(), strict=True))
        cell, *rims = [(x, y, float(m * n)) for x, m in rows for y, n in columns]
        return [cell, *(rim for rim in rims if rim[2])]

    def refuse_wider(self, width_mm: float) -> None:
        """Refuse structures that would run into each other, and a sensor without room for one cell."""
        least = min(self.length_mm, self.width_mm)
        if self.period_mm > least + 1e-9:
            raise OutOfRange(
                f"period_mm {self.period_mm:g} is more than the sensor's shorter side, {least:g} mm: the array has no "
                "cell; expected at most that: shorten the period, or enlarge length_mm and width_mm"
            )
        if width_mm > self.period_mm:
            raise OutOfRange(
                f"a structure {width_mm:g} mm wide does not fit period_mm {self.period_mm:g}: expected at most that"
            )


@dataclass(frozen=True)
class TippedParams(ArrayParams):
    """Parameters of every array of structures that narrow towards a tip."""

    root_mm: float = parameter(1.0, "Size of a structure at the top electrode.", 0.02, 100.0)
    tip_mm: float = parameter(0.66, "Size of its blunt tip; 0 for a sharp one.", 0.0, 100.0)

    def __post_init__(self) -> None:
        """Refuse structures that would run into each other, or that grow towards the tip."""
        self.refuse_wider(self.root_mm)
        if self.tip_mm > self.root_mm:
            raise OutOfRange(f"tip_mm {self.tip_mm:g} is wider than root_mm {self.root_mm:g}: expected at most that")


def _rims(p: ArrayParams, starts: Sequence[float], film: float, roof: float) -> list[Piece]:
    """Boxes around the cells, up to the sides of the sensor [mm]."""
    (x0, y0), (x1, y1) = starts, (p.length_mm - starts[0], p.width_mm - starts[1])
    sides = ((0.0, x0, 0.0, p.width_mm), (x1, p.length_mm, 0.0, p.width_mm))
    rims = (*sides, (x0, x1, 0.0, y0), (x0, x1, y1, p.width_mm))
    return [box(*rim, film, roof) for rim in rims if rim[1] - rim[0] > 1e-9 and rim[3] - rim[2] > 1e-9]


def array_scene(
    p: ArrayParams,
    fill: Fill,
    structure: Callable[[float, float, float], Sequence[Piece]],
    around: Callable[[float, float, float], Sequence[Piece]],
) -> Scene:
    """Bodies of an array of whole cells in the middle of the sensor.

    Parameters
    ----------
    p, fill
        Of the shape.
    structure, around : callable
        Pieces of one structure, and of what is left open around it in its cell, from the middle of its tip, x, y and z
        [mm].
    """
    low, film = p.electrode_mm, p.electrode_mm + p.dielectric_mm
    roof, counts = film + p.height_mm, p.fitting()
    starts = [(size - n * p.period_mm) / 2 for size, n in zip((p.length_mm, p.width_mm), counts, strict=True)]
    places = [
        (rounded(starts[0] + (i + 0.5) * p.period_mm), rounded(starts[1] + (j + 0.5) * p.period_mm))
        for i, j in product(range(counts[0]), range(counts[1]))
    ]

    cogs = tuple(piece for x, y in places for piece in structure(x, y, rounded(film)))
    is_electrode = p.cog == "electrode"
    support: list[Piece] = []
    if fill.support:
        support = [piece for x, y in places for piece in around(x, y, rounded(film))]
        support += _rims(p, starts, film, roof)
    bodies = (
        Body("film", fill.film, p.plate(low, film)),
        Body("support", fill.support, tuple(support)),
        Body("hanging_dielectric", fill.dielectric, () if is_electrode else cogs),
    )
    return p.between_electrodes(fill, bodies, roof, cogs if is_electrode else None)


def revolved_scene(p: TippedParams, fill: Fill, bulge: float = 0.0) -> Scene:
    """Bodies of an array of round structures, whose flanks are straight, or arcs of a bulge as of ``Revolved``."""
    tip, base, half = p.tip_mm / 2, p.root_mm / 2, p.period_mm / 2

    def structure(x: float, y: float, z: float) -> list[Piece]:
        roof = rounded(z + p.height_mm)
        start = [((0.0, z), 0.0), ((tip, z), bulge)] if tip else [((0.0, z), bulge)]
        return [Revolved(x, y, *zip(*start, ((base, roof), 0.0), ((0.0, roof), 0.0), strict=True))]

    def around(x: float, y: float, z: float) -> list[Piece]:
        roof = rounded(z + p.height_mm)
        corners = [(tip, z), (half, z), (half, roof), *([(base, roof)] if base < half else [])]
        bulges = (*(0.0 for _ in corners[1:]), -bulge or 0.0)
        ring = [Revolved(x, y, tuple(corners), bulges)] if tip < half else []
        return [*ring, *beside_round(x, y, p.period_mm, z, roof)]

    return array_scene(p, fill, structure, around)


def beside_round(x_mm: float, y_mm: float, period_mm: float, z0: float, z1: float) -> list[Piece]:
    """Parts of a square cell beyond the circle in it, as upright prisms with chords for arcs."""
    half, quarter = period_mm / 2, 24
    arc = [(half * sin(pi / 2 * k / quarter), half * cos(pi / 2 * k / quarter)) for k in range(quarter + 1)]
    arc[0], arc[-1] = (0.0, half), (half, 0.0)
    corner = [*arc[::-1], (half, half)]
    return [
        Prism("z", tuple((rounded(x_mm + i * u), rounded(y_mm + j * v)) for u, v in corner), z0, z1)
        for i in (1.0, -1.0)
        for j in (1.0, -1.0)
    ]
