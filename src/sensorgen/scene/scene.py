"""The scene: which material fills which outline, in millimetres, along which axis.

Plain data without a CAD kernel. Drawing, checks, meshes, solids and models all read it, so they cannot
disagree about the sensor. x runs along the sensor, y across it, z up; the corner is at 0, 0, 0.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from math import inf, isfinite
from typing import Any, ClassVar, Protocol, Self

from sensorgen.core.errors import BadInput

Point = tuple[float, float]
Place = tuple[float, float, float]
Outline = tuple[Point, ...]

AXES = "xyz"
PLANE = {"x": ("y", "z"), "y": ("x", "z"), "z": ("x", "y")}  # the two axes of an outline, by the axis square to it
SLIVER_MM = 1e-6  # a nanometre: narrower pieces are rounding, not geometry, and the CAD kernel refuses them from 1e-7
FLOATING = "floating"  # terminal of a conductor that no contact reaches
_SHOWN = 5  # corners of an outline that an error shows


class Piece(Protocol):
    """Solid of a body: :class:`Prism` here, others in :mod:`sensorgen.scene.revolved` and ``polyhedra``."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def span(self, axis: str) -> Point:
        """Lowest and highest coordinate along an axis [mm]."""

    def volume_mm3(self, low_mm: float = -inf, high_mm: float = inf) -> float:
        """Exact volume, of all of it or between two heights [mm3]."""

    def is_box(self) -> bool:
        """True for a box with six faces square to the axes."""

    def is_round(self) -> bool:
        """True for curved faces, of which cuts and meshes have the chords."""

    def is_constant(self, axis: str) -> bool:
        """True where all cuts square to an axis are the same."""

    def levels_mm(self) -> set[float]:
        """Heights of level faces and edges [mm]."""

    def cut(self, axis: str, at_mm: float) -> list[Outline]:
        """Outlines in which the plane ``axis = at_mm`` cuts it, in ``PLANE[axis]`` [mm]."""

    def moved(self, move: "Move") -> Self:
        """It at another place, scaled or turned."""


@dataclass(frozen=True)
class Move:
    """Scale and then shift along each axis, before which x and y may be exchanged.

    Attributes
    ----------
    scale : (float, float, float)
        Along x, y and z: alike along x and y, 1 or -1 along z; below 0 it mirrors [-].
    shift_mm : (float, float, float)
        Along x, y and z [mm].
    exchanges : bool
        Whether x and y are exchanged: the mirror image about the line x = y.
    """

    scale: Place = (1, 1, 1)
    shift_mm: Place = (0, 0, 0)
    exchanges: bool = False

    def at(self, axis: str, value_mm: float) -> float:
        """Coordinate along an axis after the move [mm]."""
        k = AXES.index(axis)
        return rounded(self.scale[k] * value_mm + self.shift_mm[k])

    def outline(self, axis: str, outline: Outline) -> Outline:
        """Outline in ``PLANE[axis]`` after the move [mm]."""
        first, second = PLANE[axis]
        turned = ((v, u) for u, v in outline) if self.exchanges and axis == "z" else outline
        return tuple((self.at(first, u), self.at(second, v)) for u, v in turned)


@dataclass(frozen=True)
class Prism:
    """An outline extruded along one axis.

    Attributes
    ----------
    axis : str
        "x", "y" or "z".
    outline : tuple of (float, float)
        Corners in the plane ``PLANE[axis]`` [mm]; given either way round, kept counter-clockwise.
    start_mm, end_mm : float
        Where the extrusion starts and ends on its axis [mm].

    Raises
    ------
    BadInput
        The outline is open, or encloses nothing.
    """

    axis: str
    outline: Outline
    start_mm: float
    end_mm: float

    def __post_init__(self) -> None:
        """Refuse outlines that no body can have, and turn those that run clockwise."""
        reason = fault(self.outline)
        if reason:
            given = described(self.outline)
            raise BadInput(f"an outline {reason}: {given}; expected at least three corners around an area, each once")
        if area_mm2(self.outline) < 0:
            object.__setattr__(self, "outline", self.outline[::-1])

    def span(self, axis: str) -> Point:
        """Lowest and highest coordinate along an axis [mm]."""
        if axis == self.axis:
            return self.start_mm, self.end_mm
        values = [p[PLANE[self.axis].index(axis)] for p in self.outline]
        return min(values), max(values)

    def volume_mm3(self, low_mm: float = -inf, high_mm: float = inf) -> float:
        """Exact volume, of all of it or between two heights [mm3]."""
        if self.axis == "z":
            return area_mm2(self.outline) * max(min(self.end_mm, high_mm) - max(self.start_mm, low_mm), 0.0)
        u0 = self.outline[0][0]
        area = 0.0
        for (ua, va), (ub, vb) in sides(self.outline):
            low, high = (min(max(v, low_mm), high_mm) for v in (va, vb))
            if low != high:
                middle = ((low + high) / 2 - va) / (vb - va)
                area += (ua + middle * (ub - ua) - u0) * (high - low)
        return area * (self.end_mm - self.start_mm)

    def is_box(self) -> bool:
        """True for a box with six faces square to the axes."""
        return is_rectangle(self.outline)

    def is_round(self) -> bool:
        """True for curved faces, of which cuts and meshes have the chords."""
        return False

    def is_constant(self, axis: str) -> bool:
        """True where all cuts square to an axis are the same."""
        return self.axis == axis or self.is_box()

    def levels_mm(self) -> set[float]:
        """Heights of its level faces and edges [mm]."""
        return {self.start_mm, self.end_mm} if self.axis == "z" else {round(z, 9) for _, z in self.outline}

    def cut(self, axis: str, at_mm: float) -> list[Outline]:
        """Outlines in which the plane ``axis = at_mm`` cuts it, in ``PLANE[axis]`` [mm].

        Of two prisms that share a face in that plane it cuts the one behind the face, so that no place is lost.

        >>> box(0, 4, 0, 2, 0, 1).cut("x", 1.0)
        [((0, 0), (2, 0), (2, 1), (0, 1))]
        """
        if axis == self.axis:
            return [self.outline] if self.start_mm <= at_mm < self.end_mm else []
        here = PLANE[self.axis].index(axis)
        # Intervals in which the plane runs inside the outline
        points = [(p[here], p[1 - here]) for p in self.outline]
        heights = sorted(
            a[1] if a[1] == b[1] else a[1] + (at_mm - a[0]) / (b[0] - a[0]) * (b[1] - a[1])
            for a, b in sides(points)
            if (a[0] <= at_mm) != (b[0] <= at_mm)
        )
        runs = list(zip(heights[::2], heights[1::2], strict=True))
        if PLANE[axis].index(self.axis) == 0:
            return [rectangle(self.start_mm, self.end_mm, low, high) for low, high in runs]
        return [rectangle(low, high, self.start_mm, self.end_mm) for low, high in runs]

    def moved(self, move: Move) -> "Prism":
        """It at another place, scaled or turned.

        >>> Prism("y", ((0, 5), (1, 5), (1, 6)), 2, 3).moved(Move(shift_mm=(0, 0, 3), exchanges=True))
        Prism(axis='x', outline=((0, 8), (1, 8), (1, 9)), start_mm=2, end_mm=3)
        """
        axis = {"x": "y", "y": "x", "z": "z"}[self.axis] if move.exchanges else self.axis
        start, end = sorted(move.at(axis, at) for at in (self.start_mm, self.end_mm))
        return Prism(axis, move.outline(axis, self.outline), start, end)


@dataclass(frozen=True)
class Body:
    """Part of the sensor that one tool prints as one piece.

    Attributes
    ----------
    name : str
        Its role, as in ``bottom_electrode``.
    material : str
        Name of its material.
    pieces : tuple of Piece
        They do not overlap. Boxes that share a face are one solid; other pieces touch at most along edges.
    terminal : str
        "top", "middle" or "bottom" where it is connected to an electrode's contact, ``FLOATING`` for a conductor that
        is connected to none, else "".
    """

    name: str
    material: str
    pieces: tuple[Piece, ...] = field(repr=False)
    terminal: str = ""

    def is_support(self) -> bool:
        """True where it is dissolved after printing, and no part of the sensor in use."""
        return self.name == "support"

    def volume_mm3(self) -> float:
        """Exact volume [mm3]."""
        return sum(p.volume_mm3() for p in self.pieces)


@dataclass(frozen=True)
class Scene:
    """All bodies of a sensor; what no body fills is air.

    Attributes
    ----------
    bodies : tuple of Body
        From bottom to top; those that no piece fills, as in a sensor shorter than its pattern, are left out.
    size_mm : (float, float, float)
        Edges of the enclosing box, whose corner is the origin [mm].
    repeats : (bool, bool)
        Whether it is one period of a pattern that goes on by shifts along x and y; else its sides are mirrors, or ends.
    """

    bodies: tuple[Body, ...]
    size_mm: tuple[float, float, float]
    repeats: tuple[bool, bool] = (False, False)

    def __post_init__(self) -> None:
        """Leave out empty bodies."""
        object.__setattr__(self, "bodies", tuple(b for b in self.bodies if b.pieces))

    @property
    def pieces(self) -> list[tuple[Body, Piece]]:
        """Each piece with the body that it is of."""
        return [(body, piece) for body in self.bodies for piece in body.pieces]

    def body(self, name: str) -> Body:
        """The body of that name; raises KeyError where there is none."""
        return next(b for b in self.bodies if b.name == name)

    def turned_over(self) -> "Scene":
        """The scene turned by half a turn about x, to be printed upside down."""
        _, width, height = self.size_mm
        return self._moved(Move((1, -1, -1), (0, width, height)))

    def stretched(self, factor: float) -> "Scene":
        """The scene scaled by ``factor`` [-] in x and y."""
        length, width, height = self.size_mm
        return replace(self._moved(Move((factor, factor, 1))), size_mm=(length * factor, width * factor, height))

    def _moved(self, move: Move) -> "Scene":
        bodies = (replace(b, pieces=tuple(p.moved(move) for p in b.pieces)) for b in self.bodies)
        return replace(self, bodies=tuple(bodies))


def dielectrics(bodies: Iterable[Body]) -> tuple[str, ...]:
    """Materials of bodies of no terminal, air last."""
    return (*sorted({body.material for body in bodies if not body.terminal} - {"air"}), "air")


@dataclass(frozen=True)
class Fill:
    """Materials by the part of a shape that they fill; "" leaves it empty."""

    bottom_electrode: str = "etpu"
    top_electrode: str = "etpu"
    film: str = "x60"
    dielectric: str = "x60"
    isolation: str = "x60"
    support: str = ""


def parameter(default: float, about: str, low: float, high: float, **more: Any) -> Any:
    """Field of a shape's parameter, with its help and its range."""
    return field(default=default, metadata={"help": about, "range": (low, high), **more})


def choice(default: str, about: str, *choices: str) -> Any:
    """Field of a shape's parameter that is one of several words."""
    return field(default=default, metadata={"help": about, "choices": choices})


@dataclass(frozen=True)
class Envelope:
    """Parameters that every shape has.

    The ranges in the metadata are those of sense for a printed sensor, far wider than any printer's.
    """

    length_mm: float = parameter(100.0, "Length of the sensor, along x.", 1.0, 1000.0)
    width_mm: float = parameter(10.0, "Width of the sensor, along y.", 1.0, 1000.0)
    electrode_mm: float = parameter(0.3, "Thickness of each electrode.", 0.01, 10.0)
    isolation_mm: float = parameter(0.0, "Isolation layer over the top electrode; 0 leaves it out.", 0.0, 10.0)

    def cells(self) -> float:
        """Number of cells of a repeating pattern in the sensor; 1 without a pattern [-]."""
        return 1.0

    def plate(self, low_mm: float, high_mm: float) -> tuple[Prism, ...]:
        """All of the plan between two heights; nothing where they are one [mm]."""
        plates = (box(0.0, self.length_mm, 0.0, self.width_mm, low_mm, high_mm),)
        return plates if high_mm - low_mm > SLIVER_MM else ()

    def between_electrodes(
        self, fill: Fill, bodies: Sequence[Body], roof_mm: float, cogs: tuple[Piece, ...] | None = None
    ) -> Scene:
        """Scene of bodies between two plain electrodes, the upper one from a height on, perhaps with cogs [mm]."""
        name, top = "top_electrode" if cogs is None else "top_electrode_with_cogs", roof_mm + self.electrode_mm
        every = (
            Body("bottom_electrode", fill.bottom_electrode, self.plate(0.0, self.electrode_mm), "bottom"),
            *bodies,
            Body(name, fill.top_electrode, (cogs or ()) + self.plate(roof_mm, top), "top"),
            Body("isolation", fill.isolation, self.plate(top, top + self.isolation_mm)),
        )
        return Scene(every, (self.length_mm, self.width_mm, rounded(top + self.isolation_mm)))


def seen_from_above(piece: Piece) -> Outline:
    """Outline of an upright prism, or of a box, in (x, y) [mm].

    Raises
    ------
    ValueError
        It is neither: its outline changes with height.
    """
    if not piece.is_box() and not (isinstance(piece, Prism) and piece.axis == "z"):
        raise ValueError("its outline changes with height")
    return shadow(piece, "z")


def shadow(piece: Piece, axis: str) -> Outline:
    """Outline of a piece along an axis, in ``PLANE[axis]``: of a prism across the axis its rectangle [mm]."""
    if isinstance(piece, Prism) and piece.axis == axis:
        return piece.outline
    first, second = PLANE[axis]
    return rectangle(*piece.span(first), *piece.span(second))


def extent(pieces: Iterable[Piece], axis: str) -> tuple[float, float]:
    """Lowest and highest place of pieces along an axis [mm]."""
    lows, highs = zip(*(piece.span(axis) for piece in pieces), strict=True)
    return min(lows), max(highs)


def content(piece: Piece) -> list[object]:
    """Everything that a piece is, as plain data; of pieces of two kinds never the same."""
    return [getattr(piece, own.name) for own in fields(piece)]


def box(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> Prism:
    """Box between two corners, rounded [mm]."""
    x0, x1, y0, y1, z0, z1 = (rounded(value) for value in (x0, x1, y0, y1, z0, z1))
    return Prism("z", rectangle(x0, x1, y0, y1), z0, z1)


def rectangle(a0: float, a1: float, b0: float, b1: float) -> Outline:
    """Rectangle from (a0, b0) to (a1, b1), counter-clockwise [mm]."""
    return ((a0, b0), (a1, b0), (a1, b1), (a0, b1))


def is_rectangle(outline: Outline) -> bool:
    """True for a rectangle along the axes."""
    low, high = (tuple(map(end, zip(*outline, strict=True))) for end in (min, max))
    corners = {low, high, (low[0], high[1]), (high[0], low[1])}
    return len(outline) == 4 == len(corners) and set(outline) == corners and area_mm2(outline) != 0


def rounded(value_mm: float) -> float:
    """Round away what sums leave behind, so that faces that meet have equal coordinates [mm]."""
    return round(value_mm, 12)


def area_mm2(outline: Iterable[Point]) -> float:
    """Signed area of an outline, positive when counter-clockwise [mm2]."""
    points = tuple(outline)
    u0, v0 = points[0]
    return sum((a[0] - u0) * (b[1] - v0) - (b[0] - u0) * (a[1] - v0) for a, b in sides(points)) / 2.0


def fault(outline: Outline, area: float | None = None) -> str:
    """Why corners are no outline, of an area that their edges may curve [mm2], or ""."""
    if len(outline) < (3 if area is None else 2):
        return f"of {len(outline)} corners is open"
    if any(a == b for a, b in sides(outline)):
        return "has the same corner twice in a row"
    area = area_mm2(outline) if area is None else area
    if not isfinite(area):
        return "has a corner that is nowhere"
    return "encloses nothing" if abs(area) < SLIVER_MM**2 else ""


def described(outline: Outline) -> str:
    """The first corners of an outline, for an error."""
    some = ", ".join(f"({u:.6g}, {v:.6g})" for u, v in outline[:_SHOWN])
    return some + (", ..." if len(outline) > _SHOWN else "") or "none"


def clipped(outline: Iterable[Point], end_mm: float, start_mm: float = 0.0) -> Outline:
    """The part of an outline with first coordinate between ``start_mm`` and ``end_mm`` [mm], exactly.

    For outlines that every vertical line meets in one piece; empty where less than a sliver is left.
    Coordinates are rounded, so that neighbours reached by different sums stay neighbours.

    >>> clipped([(0, 0), (2, 0), (2, 1), (0, 1)], 1.5)
    ((0, 0), (1.5, 0.0), (1.5, 1.0), (0, 1))
    """
    part = between([(rounded(u), rounded(v)) for u, v in outline], 0, start_mm, end_mm)
    points = [(u, rounded(v)) for u, v in part]
    distinct = tuple(p for k, p in enumerate(points) if p != points[k - 1])
    width = max((p[0] for p in distinct), default=0.0) - min((p[0] for p in distinct), default=0.0)
    return distinct if len(distinct) > 2 and width > SLIVER_MM else ()


def between(
    corners: Sequence[tuple[float, ...]], axis: int, low_mm: float, high_mm: float
) -> Sequence[tuple[float, ...]]:  # fmt: skip
    """Part of a flat polygon between two values of a coordinate, by its number (Sutherland and Hodgman, 1974)."""
    for side, level in ((1.0, low_mm), (-1.0, high_mm)):
        inside: list[tuple[float, ...]] = []
        for a, b in zip([*corners[-1:], *corners[:-1]], corners, strict=True):
            if (side * (a[axis] - level) >= 0) != (side * (b[axis] - level) >= 0):
                share = (level - a[axis]) / (b[axis] - a[axis])
                place = [p + share * (q - p) for p, q in zip(a, b, strict=True)]
                place[axis] = level
                inside.append(tuple(place))
            if side * (b[axis] - level) >= 0:
                inside.append(b)
        corners = inside
    return corners


def sides(points: Sequence[Point]) -> Iterator[tuple[Point, Point]]:
    """Edges of an outline, from each corner to the next one."""
    return zip(points, [*points[1:], *points[:1]], strict=True)


def without_straight(loop: Sequence[Point]) -> Outline:
    """An outline without the corners at which it goes straight on."""
    corners: list[Point] = []
    for k, b in enumerate(loop):
        a, c = corners[-1] if corners else loop[k - 1], loop[(k + 1) % len(loop)]
        if b != a and (b == c or abs((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])) > SLIVER_MM**2):
            corners.append(b)
    return tuple(corners)
