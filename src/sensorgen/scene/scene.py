"""The scene: which material fills which outline, in millimetres, along which axis.

Plain data without a CAD kernel. Drawing, checks, meshes, solids and models all read it, so they cannot
disagree about the sensor. x runs along the sensor, y across it, z up; the corner is at 0, 0, 0.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from math import isfinite

from sensorgen.core.errors import BadInput

Point = tuple[float, float]
Outline = tuple[Point, ...]

AXES = "xyz"
PLANE = {"x": ("y", "z"), "y": ("x", "z"), "z": ("x", "y")}  # the two axes of an outline, by prism axis
SLIVER_MM = 1e-6  # a nanometre: narrower pieces are rounding, not geometry, and the CAD kernel refuses them from 1e-7
FLOATING = "floating"  # terminal of a conductor that no contact reaches
_TOLD = 5  # corners of an outline that an error shows


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
        reason = _no_outline(self.outline)
        if reason:
            some = ", ".join(f"({u:.6g}, {v:.6g})" for u, v in self.outline[:_TOLD])
            told = some + (", ..." if len(self.outline) > _TOLD else "") or "none"
            raise BadInput(f"an outline {reason}: {told}; expected at least three corners around an area, each once")
        if area_mm2(self.outline) < 0:
            object.__setattr__(self, "outline", self.outline[::-1])

    def span(self, axis: str) -> Point:
        """Lowest and highest coordinate along an axis [mm]."""
        if axis == self.axis:
            return self.start_mm, self.end_mm
        values = [p[PLANE[self.axis].index(axis)] for p in self.outline]
        return min(values), max(values)

    def volume_mm3(self) -> float:
        """Exact volume [mm3]."""
        return area_mm2(self.outline) * (self.end_mm - self.start_mm)

    def is_box(self) -> bool:
        """Whether its six faces are square to the axes."""
        (a0, a1), (b0, b1) = (self.span(axis) for axis in PLANE[self.axis])
        corners = {(a0, b0), (a1, b0), (a1, b1), (a0, b1)}
        return len(self.outline) == 4 and set(self.outline) == corners and area_mm2(self.outline) != 0

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
        edges = zip(points, points[1:] + points[:1], strict=True)
        heights = sorted(
            a[1] if a[1] == b[1] else a[1] + (at_mm - a[0]) / (b[0] - a[0]) * (b[1] - a[1])
            for a, b in edges
            if (a[0] <= at_mm) != (b[0] <= at_mm)
        )
        runs = list(zip(heights[::2], heights[1::2], strict=True))
        if PLANE[axis].index(self.axis) == 0:
            return [rectangle(self.start_mm, self.end_mm, low, high) for low, high in runs]
        return [rectangle(low, high, self.start_mm, self.end_mm) for low, high in runs]


@dataclass(frozen=True)
class Body:
    """What one tool prints as one piece of the sensor.

    Attributes
    ----------
    name : str
        Its role, as in ``bottom_electrode``.
    material : str
        Name of its material.
    prisms : tuple of Prism
        They do not overlap. Boxes that share a face are one solid; other prisms touch at most along edges.
    terminal : str
        "top", "middle" or "bottom" where it is connected to an electrode's contact, ``FLOATING`` for a conductor that
        is connected to none, else "".
    """

    name: str
    material: str
    prisms: tuple[Prism, ...] = field(repr=False)
    terminal: str = ""

    def is_support(self) -> bool:
        """Whether it is dissolved after printing, and no part of the sensor in use."""
        return self.name == "support"

    def volume_mm3(self) -> float:
        """Exact volume [mm3]."""
        return sum(p.volume_mm3() for p in self.prisms)


@dataclass(frozen=True)
class Scene:
    """All bodies of a sensor; what no body fills is air.

    Attributes
    ----------
    bodies : tuple of Body
        From bottom to top; those that no prism fills, as in a sensor shorter than its pattern, are left out.
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
        object.__setattr__(self, "bodies", tuple(b for b in self.bodies if b.prisms))

    def body(self, name: str) -> Body:
        """The body of that name; raises KeyError where there is none."""
        return next(b for b in self.bodies if b.name == name)

    def turned_over(self) -> "Scene":
        """The scene turned by half a turn about x, to be printed upside down."""
        return self._mapped(lambda prism: _turned(prism, self.size_mm), self.size_mm)

    def stretched(self, factor: float) -> "Scene":
        """The scene scaled by ``factor`` [-] in x and y."""
        length, width, height = self.size_mm
        return self._mapped(lambda prism: _stretched(prism, factor), (length * factor, width * factor, height))

    def _mapped(self, change: Callable[[Prism], Prism], size_mm: tuple[float, float, float]) -> "Scene":
        bodies = tuple(replace(b, prisms=tuple(change(p) for p in b.prisms)) for b in self.bodies)
        return replace(self, bodies=bodies, size_mm=size_mm)


@dataclass(frozen=True)
class Fill:
    """Which material fills which part of a shape; "" leaves it empty."""

    bottom_electrode: str = "etpu"
    top_electrode: str = "etpu"
    film: str = "x60"
    dielectric: str = "x60"
    isolation: str = "x60"
    support: str = ""


@dataclass(frozen=True)
class Envelope:
    """Parameters that every shape has.

    The ranges in the metadata are those of sense for a printed sensor, far wider than any printer's.
    """

    length_mm: float = field(default=100.0, metadata={"help": "Length of the sensor, along x.", "range": (1.0, 1000.0)})
    width_mm: float = field(default=10.0, metadata={"help": "Width of the sensor, along y.", "range": (1.0, 1000.0)})
    electrode_mm: float = field(default=0.3, metadata={"help": "Thickness of each electrode.", "range": (0.01, 10.0)})
    isolation_mm: float = field(
        default=0.0, metadata={"help": "Isolation layer over the top electrode; 0 leaves it out.", "range": (0.0, 10.0)}
    )

    def cells(self) -> float:
        """How many cells of a repeating pattern the sensor holds; 1 without a pattern [-]."""
        return 1.0


def rectangle(a0: float, a1: float, b0: float, b1: float) -> Outline:
    """Rectangle from (a0, b0) to (a1, b1), counter-clockwise [mm]."""
    return ((a0, b0), (a1, b0), (a1, b1), (a0, b1))


def rounded(value_mm: float) -> float:
    """Round away what sums leave behind, so that faces that meet have equal coordinates [mm]."""
    return round(value_mm, 12)


def box(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> Prism:
    """Box between two corners, rounded [mm]."""
    x0, x1, y0, y1, z0, z1 = (rounded(value) for value in (x0, x1, y0, y1, z0, z1))
    return Prism("z", rectangle(x0, x1, y0, y1), z0, z1)


def area_mm2(outline: Iterable[Point]) -> float:
    """Signed area of an outline, positive when counter-clockwise [mm2]."""
    points = tuple(outline)
    u0, v0 = points[0]
    turn = zip(points, points[1:] + points[:1], strict=True)
    return sum((a[0] - u0) * (b[1] - v0) - (b[0] - u0) * (a[1] - v0) for a, b in turn) / 2.0


def _no_outline(outline: Outline) -> str:
    """Why corners are no outline, or ""."""
    if len(outline) < 3:
        return f"of {len(outline)} corners is open"
    if any(a == b for a, b in zip(outline, outline[1:] + outline[:1], strict=True)):
        return "has the same corner twice in a row"
    area = area_mm2(outline)
    if not isfinite(area):
        return "has a corner that is nowhere"
    return "encloses nothing" if abs(area) < SLIVER_MM**2 else ""


def clipped(outline: Iterable[Point], end_mm: float) -> Outline:
    """The part of an outline with first coordinate between 0 and ``end_mm`` [mm], exactly.

    For outlines that every vertical line meets in one piece; empty where less than a sliver is left.
    Coordinates are rounded, so that neighbours reached by different sums stay neighbours.

    >>> clipped([(0, 0), (2, 0), (2, 1), (0, 1)], 1.5)
    ((0, 0), (1.5, 0.0), (1.5, 1.0), (0, 1))
    """
    points = [(rounded(u), rounded(v)) for u, v in outline]
    for sign, limit in ((-1.0, 0.0), (1.0, end_mm)):
        kept: list[Point] = []  # on the near side of a vertical line (Sutherland and Hodgman, 1974)
        for a, b in zip(points[-1:] + points[:-1], points, strict=True):
            a_in, b_in = sign * (a[0] - limit) <= 0, sign * (b[0] - limit) <= 0
            if a_in != b_in:
                share = (limit - a[0]) / (b[0] - a[0])
                kept.append((limit, round(a[1] + share * (b[1] - a[1]), 12)))
            kept += [b] if b_in else []
        points = kept
    distinct = tuple(p for k, p in enumerate(points) if p != points[k - 1])
    width = max((p[0] for p in distinct), default=0.0) - min((p[0] for p in distinct), default=0.0)
    return distinct if len(distinct) > 2 and width > SLIVER_MM else ()


def _turned(prism: Prism, size_mm: tuple[float, float, float]) -> Prism:
    _, width, height = (round(s, 12) for s in size_mm)

    def back(value: float, size: float) -> float:
        return round(size - value, 12)

    if prism.axis == "x":
        return replace(prism, outline=tuple((back(y, width), back(z, height)) for y, z in prism.outline))
    size, extent = (height, width) if prism.axis == "y" else (width, height)
    outline = tuple((x, back(v, size)) for x, v in reversed(prism.outline))
    return replace(prism, outline=outline, start_mm=back(prism.end_mm, extent), end_mm=back(prism.start_mm, extent))


def _stretched(prism: Prism, factor: float) -> Prism:
    first, second = (1.0 if axis == "z" else factor for axis in PLANE[prism.axis])
    along = 1.0 if prism.axis == "z" else factor
    outline = tuple((round(u * first, 12), round(v * second, 12)) for u, v in prism.outline)
    return replace(prism, outline=outline, start_mm=prism.start_mm * along, end_mm=prism.end_mm * along)
