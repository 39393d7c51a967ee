"""Bodies of revolution about an upright axis, of straight edges and arcs: exact volume, cuts as polygons."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import acos, atan, atan2, ceil, cos, hypot, inf, isfinite, pi, sin, sqrt, tan
from typing import NamedTuple

from sensorgen.core.errors import BadInput
from sensorgen.scene.scene import (
    AXES,
    SLIVER_MM,
    Move,
    Outline,
    Point,
    area_mm2,
    described,
    fault,
    rounded,
    without_straight,
)

CHORD_MM = 1e-3  # largest distance of a round surface from the chords of its cuts and meshes
_ARC = pi / 12  # longest arc that a stretched one is made of


class _Edge(NamedTuple):
    """A straight edge of a profile, or an arc on which radius and height each only rise or only fall [mm]."""

    start: Point
    end: Point
    centre: Point | None = None

    def at_height(self, z_mm: float) -> float:
        """Radius at a height between its ends."""
        return self._at(1, z_mm)

    def at_radius(self, r_mm: float) -> float:
        """Height at a radius between its ends."""
        return self._at(0, r_mm)

    def _at(self, k: int, value_mm: float) -> float:
        """The other coordinate where the one of a number, 0 or 1, has a value between those of its ends."""
        a, b = self.start[1 - k], self.end[1 - k]
        if self.centre is None:
            along = self.end[k] - self.start[k]
            return a if not along else a + (value_mm - self.start[k]) / along * (b - a)
        middle = self.centre[1 - k]
        return middle + _leg(self.start, self.centre, value_mm - self.centre[k]) * (1.0 if a + b > 2 * middle else -1.0)

    def middle(self) -> Point:
        """Point half-way along it."""
        (ra, za), (rb, zb) = self.start, self.end
        if self.centre is None:
            return (ra + rb) / 2, (za + zb) / 2
        rc, zc = self.centre
        across, up = (ra + rb) / 2 - rc, (za + zb) / 2 - zc
        scale = hypot(ra - rc, za - zc) / hypot(across, up)
        return rc + across * scale, zc + up * scale

    def halves(self) -> tuple["_Edge", "_Edge"]:
        """It in two."""
        middle = self.middle()
        return _Edge(self.start, middle, self.centre), _Edge(middle, self.end, self.centre)

    def volume_mm3(self) -> float:
        """Of what it encloses with the axis of revolution, negative downwards: pi times the integral of r2 dz."""
        (ra, za), (rb, zb) = self.start, self.end
        if self.centre is None:
            return pi * (zb - za) * (ra * ra + ra * rb + rb * rb) / 3
        rc, zc = self.centre
        radius = hypot(ra - rc, za - zc)
        first, last = atan2(za - zc, ra - rc), atan2(zb - zc, rb - rc)
        turn = (last - first + pi) % (2 * pi) - pi
        first, last = first, first + turn
        # (rc + radius cos t)^2 radius cos t, term by term
        linear = sin(last) - sin(first)
        square = turn / 2 + (sin(2 * last) - sin(2 * first)) / 4
        cube = linear - (sin(last) ** 3 - sin(first) ** 3) / 3
        return pi * radius * (rc * rc * linear + 2 * rc * radius * square + radius * radius * cube)


def _leg(on: Point, centre: Point, other: float) -> float:
    """Leg of the right triangle over a circle's radius, given the other one."""
    radius = hypot(on[0] - centre[0], on[1] - centre[1])
    return sqrt(max((radius - other) * (radius + other), 0.0))


@lru_cache(maxsize=64)
def _edges(outline: Outline, bulges: tuple[float, ...]) -> tuple[_Edge, ...]:
    """Edges of a profile, arcs cut where they are level or upright."""
    edges = []
    for a, b, bulge in zip(outline, outline[1:] + outline[:1], bulges, strict=True):
        if bulge == 0:
            edges.append(_Edge(a, b))
            continue
        du, dv, lift = b[0] - a[0], b[1] - a[1], (1 - bulge * bulge) / (4 * bulge)
        centre = ((a[0] + b[0]) / 2 - dv * lift, (a[1] + b[1]) / 2 + du * lift)
        radius, first = hypot(a[0] - centre[0], a[1] - centre[1]), atan2(a[1] - centre[1], a[0] - centre[0])
        turn = 4 * atan(bulge)
        low, high = sorted((first, first + turn))
        quarters = range(ceil(low / (pi / 2) + 1e-9), ceil(high / (pi / 2) - 1e-9))
        way = {0: (1.0, 0.0), 1: (0.0, 1.0), 2: (-1.0, 0.0), 3: (0.0, -1.0)}
        stops = [tuple(c + radius * w for c, w in zip(centre, way[k % 4], strict=True)) for k in quarters]
        places = [a, *((u, v) for u, v in (stops if turn > 0 else stops[::-1])), b]
        edges += [_Edge(start, end, centre) for start, end in pairwise(places)]
    return tuple(edges)


@dataclass(frozen=True)
class Revolved:
    """A profile turned about an upright axis: a bump, a cone, a round pillar, a ring.

    Attributes
    ----------
    x_mm, y_mm : float
        Where the axis stands [mm].
    outline : tuple of (float, float)
        Corners of the profile, distance from the axis and height [mm]; given either way round, kept counter-clockwise.
    bulges : tuple of float
        Of the edge from each corner to the next: tangent of a quarter of its arc's angle, as in DXF; positive to the
        right of the edge, 0 for a straight edge, at most 1, half a circle. All straight if not given.

    Raises
    ------
    BadInput
        The profile is open, encloses nothing, lies beyond the axis, or has no bulge for each corner.
    """

    x_mm: float
    y_mm: float
    outline: Outline
    bulges: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse profiles that no body can have, and turn those that run clockwise."""
        bulges = self.bulges or (0.0,) * len(self.outline)
        object.__setattr__(self, "bulges", bulges)
        if reason := self._fault(bulges):
            raise BadInput(f"a profile of revolution {reason}: {described(self.outline)}")
        if self._area_mm2() < 0:
            object.__setattr__(self, "outline", self.outline[::-1])
            object.__setattr__(self, "bulges", tuple(-bulge for bulge in (*bulges[-2::-1], bulges[-1])))

    def _fault(self, bulges: tuple[float, ...]) -> str:
        if len(bulges) != len(self.outline):
            return f"has {len(bulges)} bulges; expected one for each of its {len(self.outline)} corners"
        if not all(abs(bulge) <= 1 for bulge in bulges):
            return "has a bulge that is no number from -1 to 1; expected two arcs in place of more than half a circle"
        if not (isfinite(self.x_mm) and isfinite(self.y_mm)):
            return "turns about an axis that is nowhere"
        if reason := fault(self.outline, self._area_mm2()):
            return reason
        low = min(r for edge in self._edges() for r, _ in (edge.start, edge.end))
        return f"lies beyond the axis that it turns about, at a radius of {low:.6g} mm" if low < 0 else ""

    def span(self, axis: str) -> Point:
        """Lowest and highest coordinate along an axis [mm]."""
        if axis == "z":
            heights = [z for edge in self._edges() for _, z in (edge.start, edge.end)]
            return min(heights), max(heights)
        at, radius = (self.x_mm, self.y_mm)[AXES.index(axis)], max(edge.start[0] for edge in self._edges())
        return at - radius, at + radius

    def volume_mm3(self, low_mm: float = -inf, high_mm: float = inf) -> float:
        """Exact volume, of all of it or between two heights [mm3]."""
        volumes = []
        for edge in self._edges():
            (_, za), (_, zb) = edge.start, edge.end
            ends = [min(max(z, low_mm), high_mm) for z in (za, zb)]
            if ends[0] != ends[1]:
                a, b = ((edge.at_height(z), z) if z != given[1] else given
                        for z, given in zip(ends, (edge.start, edge.end), strict=True))  # fmt: skip
                volumes.append(_Edge(a, b, edge.centre).volume_mm3())
        return sum(volumes)

    def is_box(self) -> bool:
        """False: no box has curved faces."""
        return False

    def is_round(self) -> bool:
        """True for curved faces, of which cuts and meshes have the chords."""
        return True

    def is_constant(self, axis: str) -> bool:  # noqa: ARG002
        """False: cuts are polygons, and it is round."""
        return False

    def levels_mm(self) -> set[float]:
        """Heights of its level faces, edges and ends [mm]."""
        return {round(z, 9) for z in (*self.span("z"), *(z for _, z in self.outline))}

    def cut(self, axis: str, at_mm: float) -> list[Outline]:
        """Outlines in which the plane ``axis = at_mm`` cuts it, in ``PLANE[axis]``, to ``CHORD_MM`` [mm].

        A ring is cut in halves, as outlines have no holes.
        """
        if axis == "z":
            rings = self._radii(at_mm)
            return [_moved(o, self.x_mm, self.y_mm) for ring in zip(rings[::2], rings[1::2], strict=True)
                    for o in _ring(*ring)]  # fmt: skip
        away, along = (self.x_mm, self.y_mm) if axis == "x" else (self.y_mm, self.x_mm)
        halves = _beside_axis(self.outline, self.bulges, rounded(abs(at_mm - away)))
        return [_moved(outline, along, 0.0) for outline in halves]

    def sides(self) -> list[tuple[Point, Point, Point | None]]:
        """Start and end of each side of the profile, and a point between them of each arc [mm]."""
        return [(e.start, e.end, e.middle() if e.centre else None) for e in self._edges()]

    def profile(self, chord_mm: float) -> list[Point]:
        """Corners of the profile, with those of chords at most ``chord_mm`` from its arcs [mm]."""
        corners = []
        for edge in self._edges():
            short = [edge]
            while edge.centre and _off_chord(short[0].middle(), short[0].start, short[0].end) > chord_mm:
                short = [half for whole in short for half in whole.halves()]
            corners += [part.start for part in short]
        return corners

    def moved(self, move: Move) -> "Revolved":
        """It at another place, scaled or turned."""
        factor, turn = abs(move.scale[0]), -1 if move.scale[2] < 0 else 1
        corners = list(zip(self.outline, self.bulges, strict=True)) if factor == 1 else list(self._stretched(factor))
        ((x, y),) = move.outline("z", ((self.x_mm, self.y_mm),))
        outline = tuple((r, move.at("z", z)) for (r, z), _ in corners)
        return Revolved(x, y, outline, tuple(turn * bulge for _, bulge in corners))

    def _stretched(self, factor: float) -> Iterator[tuple[Point, float]]:
        """Corners and bulges of the profile scaled along the radius.

        Arcs become short ones through the ellipse's points, exact to 1e-5 of the stretch.
        """
        for edge in self._edges():
            short = [edge]
            while edge.centre and len(short) < pi / 2 / _ARC:
                short = [half for whole in short for half in whole.halves()]
            for part in short:
                a, middle, b = ((r * factor, z) for r, z in (part.start, part.middle(), part.end))
                yield (rounded(a[0]), rounded(a[1])), _bulge(a, middle, b) if edge.centre else 0.0

    def _edges(self) -> tuple[_Edge, ...]:
        return _edges(self.outline, self.bulges)

    def _area_mm2(self) -> float:
        """Signed area of the profile, arcs included."""
        segments = 0.0
        for a, b, bulge in zip(self.outline, self.outline[1:] + self.outline[:1], self.bulges, strict=True):
            if bulge:
                turn = 4 * atan(bulge)
                radius = hypot(b[0] - a[0], b[1] - a[1]) / 2 / sin(turn / 2)
                segments += radius * radius * (turn - sin(turn)) / 2
        return (area_mm2(self.outline) if self.outline else 0.0) + segments

    def _radii(self, z_mm: float) -> list[float]:
        """Radii at which a level plane enters and leaves it, from the axis outwards."""
        return sorted(e.at_height(z_mm) for e in self._edges() if (e.start[1] <= z_mm) != (e.end[1] <= z_mm))


def _bulge(a: Point, between: Point, b: Point) -> float:
    """Bulge of the arc from a point to another one through a third."""
    (ua, va), (ub, vb) = ((p[0] - between[0], p[1] - between[1]) for p in (a, b))
    return tan((pi - atan2(abs(ua * vb - ub * va), ua * ub + va * vb)) / 2) * (1.0 if ua * vb - ub * va < 0 else -1.0)


def _moved(outline: Outline, u_mm: float, v_mm: float) -> Outline:
    return tuple((rounded(u + u_mm), rounded(v + v_mm)) for u, v in outline)


@lru_cache(maxsize=256)
def _ring(inner_mm: float, outer_mm: float) -> tuple[Outline, ...]:
    """Outlines of a disc, or of a ring in halves, about the origin; corners on the circles and on both axes."""
    if outer_mm - inner_mm < SLIVER_MM:
        return ()
    if inner_mm < SLIVER_MM:
        return (_arc(outer_mm, 4)[:-1],)
    half = (*_arc(outer_mm, 2), *_arc(inner_mm, 2)[::-1])
    return half, tuple((-x, -y) for x, y in half)


def _arc(radius_mm: float, quarters: int) -> Outline:
    """Corners on a circle about the origin, from its rightmost point on."""
    each = max(ceil(pi / 4 / acos(max(1 - CHORD_MM / radius_mm, 0.0))), 2)
    quarter = [(radius_mm * cos(k * pi / 2 / each), radius_mm * sin(k * pi / 2 / each)) for k in range(each)]
    quarter[0] = (radius_mm, 0.0)
    turns = ((1, 0, 0, 1), (0, -1, 1, 0), (-1, 0, 0, -1), (0, 1, -1, 0))
    arcs = [(c * x + d * y, e * x + f * y) for c, d, e, f in turns[:quarters] for x, y in quarter]
    c, d, e, f = turns[quarters % 4]
    return (*arcs, (c * radius_mm + d * 0.0, e * radius_mm + f * 0.0))


@lru_cache(maxsize=64)
def _beside_axis(outline: Outline, bulges: tuple[float, ...], away_mm: float) -> tuple[Outline, ...]:
    """Outlines of the upright cut at some distance from the axis, in (along, z), the axis at 0 [mm].

    The half on one side is the profile, its radii seen at that distance and those within it at the axis; it and its
    mirror image are one where they share an edge, but for a hole, which outlines do not have.
    """
    import shapely

    half = shapely.make_valid(shapely.Polygon(_seen(outline, bulges, away_mm)))
    halves = half, shapely.transform(half, lambda places: places * [-1.0, 1.0])
    whole = shapely.get_parts(shapely.union_all(halves))
    if any(shapely.get_num_interior_rings(part) > 0 for part in whole):
        whole = shapely.get_parts(halves)
    rings = (shapely.get_coordinates(shapely.orient_polygons(part))[:-1].tolist() for part in whole if part.area > 0)
    smooth = (without_straight([(u, z) for u, z in ring]) for ring in rings)
    return tuple(o for o in smooth if len(o) > 2 and area_mm2(o) > SLIVER_MM**2)


def _seen(outline: Outline, bulges: tuple[float, ...], away_mm: float) -> list[Point]:
    """Corners of a profile as the upright cut at some distance from the axis shows them, to ``CHORD_MM``."""
    ring: list[Point] = []
    for edge in _edges(outline, bulges):
        a, b, centre = edge
        todo = [edge]
        if min(a[0], b[0]) < away_mm < max(a[0], b[0]):
            at = (away_mm, edge.at_radius(away_mm))
            todo = [_Edge(a, at, centre), _Edge(at, b, centre)]
        if centre:
            todo = [quarter for part in todo for half in part.halves() for quarter in half.halves()]
        todo.reverse()
        while todo:
            part = todo.pop()
            start, middle, end = (_shown(p, away_mm) for p in (part.start, part.middle(), part.end))
            if _off_chord(middle, start, end) > 0.7 * CHORD_MM:  # the middle is not where a chord is furthest off
                todo += part.halves()[::-1]
            else:
                ring.append(end)
    return ring


def _shown(point: Point, away_mm: float) -> Point:
    return sqrt(max((point[0] - away_mm) * (point[0] + away_mm), 0.0)), point[1]


def _off_chord(point: Point, a: Point, b: Point) -> float:
    """Distance of a point from a straight line between two others."""
    du, dv = b[0] - a[0], b[1] - a[1]
    length = hypot(du, dv)
    if length == 0:
        return hypot(point[0] - a[0], point[1] - a[1])
    return abs((point[0] - a[0]) * dv - (point[1] - a[1]) * du) / length
