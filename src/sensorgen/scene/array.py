"""Structures in a square array that hang from the top electrode, their tips on a film: what the shapes of it share."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, floor, pi, sin

from sensorgen.core.errors import OutOfRange
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Body, Envelope, Fill, Piece, Prism, Scene, box, choice, parameter, rounded

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
        for i in range(counts[0])
        for j in range(counts[1])
    ]

    cogs = tuple(piece for x, y in places for piece in structure(x, y, rounded(film)))
    is_electrode = p.cog == "electrode"
    support: list[Piece] = []
    if fill.support:
        support = [piece for x, y in places for piece in around(x, y, rounded(film))]
        (x0, y0), (x1, y1) = starts, (p.length_mm - starts[0], p.width_mm - starts[1])
        sides = ((0.0, x0, 0.0, p.width_mm), (x1, p.length_mm, 0.0, p.width_mm))
        rims = (*sides, (x0, x1, 0.0, y0), (x0, x1, y1, p.width_mm))
        support += [box(*rim, film, roof) for rim in rims if rim[1] - rim[0] > 1e-9 and rim[3] - rim[2] > 1e-9]
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
