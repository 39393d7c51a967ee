"""Pieces that bodies are made of: prisms, bodies of revolution, lofts between two heights, closed triangle meshes.

All of them span an axis, have plane cuts and an exact volume, and can be turned over and stretched. Cuts of round
pieces are polygons with their corners on the surface; everything else is exact.
"""

from dataclasses import dataclass, fields, replace
from math import inf

from sensorgen.core.errors import BadInput
from sensorgen.scene.outlines import Outline, Place, Point, area_mm2, described, fault, is_rectangle, rectangle, rounded
from sensorgen.scene.polyhedra import Loft, Polyhedron
from sensorgen.scene.revolved import Revolved

AXES = "xyz"
PLANE = {"x": ("y", "z"), "y": ("x", "z"), "z": ("x", "y")}  # the two axes of an outline, by the axis square to it


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
        for (ua, va), (ub, vb) in zip(self.outline, self.outline[1:] + self.outline[:1], strict=True):
            low, high = (min(max(v, low_mm), high_mm) for v in (va, vb))
            if low != high:
                middle = ((low + high) / 2 - va) / (vb - va)
                area += (ua + middle * (ub - ua) - u0) * (high - low)
        return area * (self.end_mm - self.start_mm)

    def is_box(self) -> bool:
        """Whether its six faces are square to the axes."""
        return is_rectangle(self.outline)

    def is_constant(self, axis: str) -> bool:
        """Whether all its cuts square to an axis are the same."""
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

    def turned_over(self, size_mm: Place) -> "Prism":
        """It in a box of some size that is turned by half a turn about x."""
        _, width, height = (rounded(s) for s in size_mm)
        if self.axis == "x":
            return replace(self, outline=tuple((rounded(width - y), rounded(height - z)) for y, z in self.outline))
        size, extent = (height, width) if self.axis == "y" else (width, height)
        outline = tuple((x, rounded(size - v)) for x, v in reversed(self.outline))
        start, end = rounded(extent - self.end_mm), rounded(extent - self.start_mm)
        return replace(self, outline=outline, start_mm=start, end_mm=end)

    def stretched(self, factor: float) -> "Prism":
        """It scaled in x and y."""
        first, second = (1.0 if axis == "z" else factor for axis in PLANE[self.axis])
        along = 1.0 if self.axis == "z" else factor
        outline = tuple((rounded(u * first), rounded(v * second)) for u, v in self.outline)
        return replace(self, outline=outline, start_mm=self.start_mm * along, end_mm=self.end_mm * along)


Piece = Prism | Revolved | Loft | Polyhedron


def seen_from_above(piece: Piece) -> Outline:
    """Outline of an upright prism, or of a box, in (x, y) [mm].

    Raises
    ------
    ValueError
        It is neither: its outline changes with height.
    """
    if isinstance(piece, Prism) and piece.axis == "z":
        return piece.outline
    if not piece.is_box():
        raise ValueError("its outline changes with height")
    return rectangle(*piece.span("x"), *piece.span("y"))


def content(piece: Piece) -> list[object]:
    """Everything that a piece is, as plain data; of pieces of two kinds never the same."""
    return [getattr(piece, own.name) for own in fields(piece)]


def box(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> Prism:
    """Box between two corners, rounded [mm]."""
    x0, x1, y0, y1, z0, z1 = (rounded(value) for value in (x0, x1, y0, y1, z0, z1))
    return Prism("z", rectangle(x0, x1, y0, y1), z0, z1)
