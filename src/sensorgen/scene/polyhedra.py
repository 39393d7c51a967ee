"""Bodies with flat faces: closed triangle meshes, and lofts between outlines at two heights."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain
from math import hypot, inf, isfinite

from sensorgen.core.errors import BadInput
from sensorgen.scene.scene import (
    AXES,
    PLANE,
    SLIVER_MM,
    Move,
    Outline,
    Piece,
    Place,
    Point,
    area_mm2,
    between,
    described,
    is_rectangle,
    rounded,
    without_straight,
)


@dataclass(frozen=True)
class Polyhedron:
    """A closed surface of triangles, as CAD programs export it.

    Attributes
    ----------
    vertices : tuple of (float, float, float)
        Corners, x, y and z [mm].
    triangles : tuple of (int, int, int)
        Numbers of corners, counter-clockwise seen from outside; turned round if all are clockwise.

    Raises
    ------
    BadInput
        The surface is open, has an edge of more than two triangles, or encloses nothing.
    """

    vertices: tuple[Place, ...]
    triangles: tuple[tuple[int, int, int], ...]

    def __post_init__(self) -> None:
        """Refuse surfaces that are not closed, and turn those that are inside out."""
        reason = self._fault()
        if reason:
            raise BadInput(
                f"a body of {len(self.vertices)} vertices and {len(self.triangles)} triangles {reason}; expected a "
                "closed surface, every edge between two triangles"
            )
        if self.volume_mm3() < 0:
            object.__setattr__(self, "triangles", tuple((a, c, b) for a, b, c in self.triangles))

    def _fault(self) -> str:
        if not all(map(isfinite, chain.from_iterable(self.vertices))):
            return "has a corner that is nowhere"
        if not all(0 <= number < len(self.vertices) for number in chain.from_iterable(self.triangles)):
            return "refers to a vertex that it does not have"
        start = self._open_edge()
        if start is not None:
            place = ", ".join(f"{value:.6g}" for value in self.vertices[start])
            return f"is open, or not oriented, at the edge from ({place}) mm"
        return "encloses nothing" if not self.triangles or abs(self.volume_mm3()) < SLIVER_MM**3 else ""

    def _open_edge(self) -> int | None:
        """Vertex at which an edge begins that is not once in each direction; None of a closed, oriented surface."""
        edges = Counter((triangle[k - 1], triangle[k]) for triangle in self.triangles for k in range(3))
        wrong = (a for (a, b), count in edges.items() if count > 1 or edges[b, a] != 1 or a == b)
        return next(wrong, None)

    def span(self, axis: str) -> Point:
        """Lowest and highest coordinate along an axis [mm]."""
        used = {number for triangle in self.triangles for number in triangle}
        values = [self.vertices[number][AXES.index(axis)] for number in used]
        return min(values), max(values)

    def volume_mm3(self, low_mm: float = -inf, high_mm: float = inf) -> float:
        """Exact volume, of all of it or between two heights, by the divergence theorem [mm3]."""
        x0 = self.vertices[0][0]
        flux = []  # of the field (x, 0, 0), which level faces do not pass
        for triangle in self.triangles:
            corners = between([self.vertices[number] for number in triangle], 2, low_mm, high_mm)
            for k in range(1, len(corners) - 1):
                (xa, ya, za), (xb, yb, zb), (xc, yc, zc) = corners[0], corners[k], corners[k + 1]
                normal = (yb - ya) * (zc - za) - (zb - za) * (yc - ya)
                flux.append((xa + xb + xc - 3 * x0) * normal)
        return sum(flux) / 6

    def is_box(self) -> bool:
        """True for a box with six faces square to the axes."""
        sides = [high - low for low, high in map(self.span, AXES)]
        whole = sides[0] * sides[1] * sides[2]
        return whole > 0 and abs(self.volume_mm3() - whole) < 1e-12 * whole

    def is_round(self) -> bool:
        """True for curved faces, of which cuts and meshes have the chords."""
        return False

    def is_constant(self, axis: str) -> bool:  # noqa: ARG002
        """True where all cuts square to an axis are the same."""
        return self.is_box()

    def levels_mm(self) -> set[float]:
        """Heights of its corners [mm]."""
        return {round(z, 9) for _, _, z in self.vertices}

    def faces_mm(self) -> set[float]:
        """Heights of its level faces, ridges and tips; not of corners amid a flank, as a curved one has [mm]."""
        heights = [round(z, 9) for _, _, z in self.vertices]
        levels, rising, falling = set[float](), set[int](), set[int]()
        for triangle in self.triangles:
            low, *_, high = sorted(heights[number] for number in triangle)
            levels |= {low} if low == high else set()
            rising |= {number for number in triangle if heights[number] < high}
            falling |= {number for number in triangle if heights[number] > low}
        return levels | {heights[number] for number in (rising | falling) - (rising & falling)}

    def cut(self, axis: str, at_mm: float) -> list[Outline]:
        """Outlines in which the plane ``axis = at_mm`` cuts it, in ``PLANE[axis]`` [mm]; those with holes in parts."""
        across = AXES.index(axis)
        first, second = (AXES.index(other) for other in PLANE[axis])
        after = self._crossed([vertex[across] <= at_mm for vertex in self.vertices], axis)

        def crossing(edge: tuple[int, int]) -> Point:
            a, b = (self.vertices[number] for number in edge)
            share = (at_mm - a[across]) / (b[across] - a[across])
            return rounded(a[first] + share * (b[first] - a[first])), rounded(
                a[second] + share * (b[second] - a[second])
            )

        loops = [without_straight([crossing(edge) for edge in ring]) for ring in _rings(after)]
        return _without_holes([loop for loop in loops if len(loop) > 2 and abs(area_mm2(loop)) > SLIVER_MM**2])

    def _crossed(self, below: list[bool], axis: str) -> dict[tuple[int, int], tuple[int, int]]:
        """Edges that a plane crosses, each with the next one, by the vertices that lie below it."""
        after: dict[tuple[int, int], tuple[int, int]] = {}
        for a, b, c in self.triangles:
            sides = (c, a), (a, b), (b, c)
            up = [(start, end) for start, end in sides if below[start] > below[end]]
            down = [(end, start) for start, end in sides if below[start] < below[end]]
            # (x, z) is left-handed: seen against y, triangles run the other way round
            after.update(zip(up, down, strict=True) if axis == "y" else zip(down, up, strict=True))
        return after

    def moved(self, move: Move) -> "Polyhedron":
        """It at another place, scaled or turned."""
        flat = move.outline("z", tuple((x, y) for x, y, _ in self.vertices))
        heights = (move.at("z", z) for _, _, z in self.vertices)
        return replace(self, vertices=tuple((x, y, z) for (x, y), z in zip(flat, heights, strict=True)))


def _rings(after: dict[tuple[int, int], tuple[int, int]]) -> Iterator[list[tuple[int, int]]]:
    """Rings of edges, each with its follower; ``after`` is emptied."""
    while after:
        ring, place = [], next(iter(after))
        while place in after:
            ring.append(place)
            place = after.pop(place)
        yield ring


def _without_holes(loops: list[Outline]) -> list[Outline]:
    """Outlines as they are where none runs clockwise, which is a hole; else their region in parts without holes."""
    if all(area_mm2(loop) > 0 for loop in loops):
        return loops
    import shapely

    from sensorgen.scene.layers import outlines

    region = shapely.Polygon()
    for loop in loops:
        region = shapely.symmetric_difference(region, shapely.Polygon(loop))
    return list(outlines(region))


@dataclass(frozen=True)
class Loft:
    """Straight flanks between outlines at two heights: a pyramid, a hip roof, a tapered pillar.

    Attributes
    ----------
    lower, upper : tuple of (float, float)
        Corners (x, y) at the bottom and at the top [mm], equally many, each above the other; given either way round,
        kept counter-clockwise. One of them may be a line or a point, given as often as the other has corners.
    bottom_mm, top_mm : float
        Their heights [mm].

    Raises
    ------
    BadInput
        The outlines have other numbers of corners, enclose nothing, run in different senses, or a flank is not flat.
    """

    lower: Outline
    upper: Outline
    bottom_mm: float
    top_mm: float

    def __post_init__(self) -> None:
        """Refuse outlines that no flat flanks join, and turn those that run clockwise."""
        reason = self._fault()
        if reason:
            raise BadInput(f"a loft {reason}: {described(self.lower)} below {described(self.upper)}")
        if area_mm2(self.lower) + area_mm2(self.upper) < 0:
            object.__setattr__(self, "lower", self.lower[::-1])
            object.__setattr__(self, "upper", self.upper[::-1])

    def _fault(self) -> str:
        if len(self.lower) != len(self.upper) or len(self.lower) < 3:
            return f"joins {len(self.lower)} corners to {len(self.upper)}; expected equally many, at least three"
        values = [*(v for p in (*self.lower, *self.upper) for v in p), self.bottom_mm, self.top_mm]
        if not all(map(isfinite, values)):
            return "has a corner that is nowhere"
        if self.top_mm - self.bottom_mm < SLIVER_MM:
            return f"from {self.bottom_mm:g} to {self.top_mm:g} mm has no height"
        areas = area_mm2(self.lower), area_mm2(self.upper)
        if max(map(abs, areas)) < SLIVER_MM**2:
            return "encloses nothing"
        if min(areas) < -(SLIVER_MM**2) and max(areas) > SLIVER_MM**2:
            return "is twisted: its outlines run in different senses"
        return next(filter(None, map(self._fault_of_flank, range(len(self.lower)))), "")

    def _fault_of_flank(self, k: int) -> str:
        (a, b), (c, d) = (self.lower[k - 1], self.lower[k]), (self.upper[k - 1], self.upper[k])
        below, above = ((q[0] - p[0], q[1] - p[1]) for p, q in ((a, b), (c, d)))
        cross = below[0] * above[1] - below[1] * above[0]
        if abs(cross) > SLIVER_MM * max(hypot(*below), hypot(*above)):
            return f"has a flank that is not flat, from ({a[0]:.6g}, {a[1]:.6g}) to ({b[0]:.6g}, {b[1]:.6g})"
        if below[0] * above[0] + below[1] * above[1] < -(SLIVER_MM**2):
            return f"has a flank that crosses itself, from ({a[0]:.6g}, {a[1]:.6g}) to ({b[0]:.6g}, {b[1]:.6g})"
        return ""

    def span(self, axis: str) -> Point:
        """Lowest and highest coordinate along an axis [mm]."""
        if axis == "z":
            return self.bottom_mm, self.top_mm
        values = [p[AXES.index(axis)] for p in (*self.lower, *self.upper)]
        return min(values), max(values)

    def volume_mm3(self, low_mm: float = -inf, high_mm: float = inf) -> float:
        """Exact volume, of all of it or between two heights: areas are quadratic in height (Simpson) [mm3]."""
        low, high = max(low_mm, self.bottom_mm), min(high_mm, self.top_mm)
        if low >= high:
            return 0.0
        first, middle, last = (area_mm2(self._outline(z)) for z in (low, (low + high) / 2, high))
        return (high - low) * (first + 4 * middle + last) / 6

    def is_box(self) -> bool:
        """True for a box with six faces square to the axes."""
        return self.lower == self.upper and is_rectangle(self.lower)

    def is_round(self) -> bool:
        """True for curved faces, of which cuts and meshes have the chords."""
        return False

    def is_constant(self, axis: str) -> bool:
        """True where all cuts square to an axis are the same."""
        return self.is_box() or (axis == "z" and self.lower == self.upper)

    def levels_mm(self) -> set[float]:
        """Heights of its level faces [mm]."""
        return {self.bottom_mm, self.top_mm}

    def cut(self, axis: str, at_mm: float) -> list[Outline]:
        """Outlines in which the plane ``axis = at_mm`` cuts it, in ``PLANE[axis]`` [mm]."""
        if axis != "z":
            return self.polyhedron().cut(axis, at_mm)
        if not self.bottom_mm <= at_mm < self.top_mm:
            return []
        outline = without_straight([(rounded(x), rounded(y)) for x, y in self._outline(at_mm)])
        return [outline] if len(outline) > 2 and area_mm2(outline) > SLIVER_MM**2 else []

    def _outline(self, z_mm: float) -> Outline:
        share = (z_mm - self.bottom_mm) / (self.top_mm - self.bottom_mm)
        return tuple(
            (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
            for a, b in zip(self.lower, self.upper, strict=True)
        )

    def moved(self, move: Move) -> "Loft":
        """It at another place, scaled or turned."""
        ends = [
            (move.at("z", z), move.outline("z", o))
            for z, o in ((self.bottom_mm, self.lower), (self.top_mm, self.upper))
        ]
        (bottom, lower), (top, upper) = sorted(ends)
        return Loft(lower, upper, bottom, top)

    def faces(self) -> list[tuple[Place, ...]]:
        """Corners of its flat faces, flanks first [mm]."""
        ends = [[(x, y, z) for x, y in o] for o, z in ((self.lower, self.bottom_mm), (self.upper, self.top_mm))]
        below, above = ends
        flanks = [(below[k - 1], below[k], above[k], above[k - 1]) for k in range(len(below))]
        caps = [end for end, o in zip(ends, (self.lower, self.upper), strict=True) if area_mm2(o) > SLIVER_MM**2]
        corners = (tuple(dict.fromkeys(face)) for face in (*flanks, *caps))
        return [face for face in corners if len(face) > 2]

    def polyhedron(self) -> Polyhedron:
        """It as a closed surface of triangles."""
        return _of_loft(self)


def surface(piece: Piece) -> Polyhedron:
    """Closed surface of a piece with flat faces."""
    if not isinstance(piece, Loft | Polyhedron):
        raise TypeError(f"{type(piece).__name__} has faces that are not flat, or an outline of its own")
    return piece.polyhedron() if isinstance(piece, Loft) else piece


@lru_cache(maxsize=64)
def _of_loft(loft: Loft) -> Polyhedron:
    numbers = dict[Place, int]()
    ends = (loft.lower, loft.bottom_mm), (loft.upper, loft.top_mm)
    below, above = ([numbers.setdefault((x, y, z), len(numbers)) for x, y in o] for o, z in ends)
    triangles = []
    for k in range(len(below)):
        a, b, c, d = below[k - 1], below[k], above[k], above[k - 1]
        triangles += [(a, b, c), (a, c, d)]
    triangles += [(below[c], below[b], below[a]) for a, b, c in _cap(loft.lower)]
    triangles += [(above[a], above[b], above[c]) for a, b, c in _cap(loft.upper)]
    return Polyhedron(tuple(numbers), tuple(t for t in triangles if len(set(t)) == 3))


def _cap(outline: Outline) -> list[tuple[int, int, int]]:
    """Triangles of an end of a loft; none where it is a line or a point."""
    return triangulated(outline) if abs(area_mm2(outline)) > SLIVER_MM**2 else []


def triangulated(outline: Outline) -> list[tuple[int, int, int]]:
    """Triangles of a flat outline, counter-clockwise, as indices of its corners."""
    corners = len(outline)
    turns = (area_mm2((outline[k - 2], outline[k - 1], outline[k])) for k in range(corners))
    if corners < 5 and all(turn > 0 for turn in turns):
        return [(0, k, k + 1) for k in range(1, corners - 1)]
    import manifold3d
    import numpy as np

    return [(a, b, c) for a, b, c in manifold3d.triangulate([np.array(outline)]).tolist()]
