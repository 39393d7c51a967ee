"""Unit cell of a cross-section as edges with a region on each side, for a mesher; of any prismatic scene."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import dist
from typing import TypeVar

import shapely

from sensorgen.core.errors import BadInput
from sensorgen.scene.repetition import Slice, cut, repeats, slices, straightened
from sensorgen.scene.scene import Point, Scene
from sensorgen.scene.sections import sections

OUTSIDE = 0  # the region beyond the cell
AIR = "air"
BLOCK = "tip"  # material of a block on the top, which presses and carries no field
_DIGITS = 9  # of a coordinate [mm]: places nearer than a picometre are one
_SLIVER_MM = 1e-9
_PARTED_MM = 2e-3  # by which steps that touch in a corner are parted: what the decimals of G-code leave open

Edge = tuple[Point, Point]
End = TypeVar("End", Point, int)  # an end of an edge, or its node's number


@dataclass(frozen=True)
class Region:
    """A part of a cell: its material, and the electrode that it belongs to, or ""."""

    material: str
    terminal: str


@dataclass(frozen=True)
class ContactCell:
    """A unit cell, or half of one that is its own mirror image.

    Attributes
    ----------
    edges : mapping
        Each edge, from its left or lower end, to the regions (left of it, right of it); 0 is outside.
    regions : tuple of Region
        Region k is ``regions[k - 1]``.
    left_mm, right_mm : float
        Where it begins and ends [mm].
    mirrored : bool
        Both sides are mirrors; else the cell repeats.
    turned : bool
        Whether it is turned about its left side, where x is 0.
    """

    edges: Mapping[Edge, tuple[int, int]]
    regions: tuple[Region, ...]
    left_mm: float
    right_mm: float
    mirrored: bool
    turned: bool = False

    def width_mm(self) -> float:
        """Width [mm]."""
        return self.right_mm - self.left_mm

    def blocks(self) -> set[int]:
        """Regions of a block on its top."""
        return {k for k, region in enumerate(self.regions, 1) if region.material == BLOCK}

    def without_block(self) -> "ContactCell":
        """The cell without the block on its top."""
        own = self.blocks()
        edges = {edge: tuple(OUTSIDE if k in own else k for k in sides) for edge, sides in self.edges.items()}
        return replace(self, edges={edge: (a, b) for edge, (a, b) in edges.items() if a != b})

    @property
    def air(self) -> int:
        """Region of the air, or ``OUTSIDE`` where there is none."""
        return next((k for k, region in enumerate(self.regions, 1) if region.material == AIR), OUTSIDE)

    def solid(self, region: int) -> bool:
        """Test whether a region is filled by a body."""
        return region != OUTSIDE and self.regions[region - 1].material != AIR

    def faces(self) -> dict[Edge, tuple[int, int]]:
        """Edges with a body on one side only, as in ``edges``."""
        return {e: sides for e, sides in self.edges.items() if self.solid(sides[0]) != self.solid(sides[1])}


Strip = tuple[float, float, list[tuple[Region, Point, Point]]]


def cell_of(scene: Scene, period_mm: float | None) -> ContactCell:
    """The cell of a prismatic scene: half a period between two mirrors where there are such, else a whole one.

    Parameters
    ----------
    scene : Scene
        As drawn or as printed, without its support.
    period_mm : float or None
        Period of the pattern; None for a scene without one: a piece of a plate as long as high, else all of it [mm].

    Raises
    ------
    BadInput
        The scene is no prism, or shorter than its period.
    """
    whole = _only_section(scene)
    start, end = whole[0].left_mm, whole[-1].right_mm
    period = period_mm or (min(end - start, max(whole[0].bands[-1].top_mm)) if len(whole) == 1 else end - start)
    if period > (end - start) * (1 + 1e-9):
        raise BadInput(f"the sensor is {end - start:g} mm long, less than its period of {period:g} mm")
    axes = {place for s in whole for place in (s.left_mm, (s.left_mm + s.right_mm) / 2)}
    for axis in sorted(axes):
        middle, stop = axis + period / 2, axis + period
        if stop <= end + _SLIVER_MM and repeats(cut(whole, axis, stop), axis, middle):
            return between(whole, axis, middle, mirrored=True)
    return between(whole, start, start + period, mirrored=False)


def _only_section(scene: Scene) -> list[Slice]:
    """Slices of a scene's cross-section; raises BadInput where it is no prism, or has several."""
    try:
        every = sections(scene)
        whole = straightened(slices(every[0], 0.0, layered=True))
    except ValueError as error:
        raise BadInput(f"compression needs a prismatic scene: {error}") from None
    if len(every) > 1:
        raise BadInput(f"compression needs one cross-section; this scene has {len(every)}: it must be solved in 3D")
    return whole


def between(whole: Sequence[Slice], left: float, right: float, *, mirrored: bool) -> ContactCell:
    """Edges of the part of a cross-section between two places [mm]; air below it and above it is outside."""
    strips = [(s.left_mm, s.right_mm, _layers(s)) for s in cut(whole, left, right)]
    regions = list(dict.fromkeys(region for _, _, layers in strips for region, _, _ in layers))
    number = {region: k + 1 for k, region in enumerate(regions)}
    edges: dict[Edge, tuple[int, int]] = {}
    for a, b, layers in strips:
        for region, low, high in layers:
            add(edges, _rounded((a, low[0])), _rounded((b, low[1])), (number[region], OUTSIDE))
            add(edges, _rounded((a, high[0])), _rounded((b, high[1])), (OUTSIDE, number[region]))
    for before, after in pairwise([None, *strips, None]):
        _uprights(edges, before, after, number)
    return _parted(ContactCell(borders(edges), tuple(regions), left, right, mirrored))


def _parted(cell: ContactCell) -> ContactCell:
    """A cell in which no steps touch in a corner, which carries nothing: the lower one is set back."""
    edges = dict(cell.edges)
    for corner, level, upright in _touching(cell):
        back = round(corner[0] + (_PARTED_MM if level[0] == corner else -_PARTED_MM), _DIGITS), corner[1]
        for edge in (level, upright):
            a, b = (back if end == corner else end for end in edge)
            add(edges, a, b, edges.pop(edge))
    return replace(cell, edges=edges)


def _touching(cell: ContactCell) -> Iterator[tuple[Point, Edge, Edge]]:
    """Corners in which two steps touch, with the level and the upright edge of the lower one."""
    for place, faces in _by_end(cell.faces()).items():
        upright = [edge for edge in faces if edge[0][0] == edge[1][0]]
        level = [edge for edge in faces if edge[0][1] == edge[1][1]]
        if len(upright) == len(level) == 2 and cell.left_mm < place[0] < cell.right_mm:
            yield place, next(edge for edge in level if cell.solid(cell.edges[edge][1])), min(upright)


def _by_end(edges: Iterable[Edge]) -> dict[Point, list[Edge]]:
    """Edges by the places where they end."""
    at: dict[Point, list[Edge]] = {}
    for edge in edges:
        for place in edge:
            at.setdefault(place, []).append(edge)
    return at


def _layers(strip: Slice) -> list[tuple[Region, Point, Point]]:
    """Regions from the lowest body of a slice up, each with its bottom and top line."""
    bands = strip.bands[1:] if strip.bands[0].material == AIR else strip.bands
    return [(Region(b.material, b.terminal), b.bottom_mm, b.top_mm) for b in bands]


def partition(bodies: Mapping[Region, shapely.Geometry], whole: shapely.Polygon, *, turned: bool) -> ContactCell:
    """A mirrored cell of regions that are polygons [mm], with air where they leave some of the whole."""
    air = whole - shapely.union_all([*bodies.values()])
    filled = {**bodies, **({Region(AIR, ""): air} if air.area > _SLIVER_MM else {})}
    regions = tuple(filled)
    lines = shapely.union_all([region.boundary for region in (*filled.values(), whole)])
    edges: dict[Edge, tuple[int, int]] = {}
    for face in shapely.polygonize([lines]).geoms:
        inside = face.representative_point()
        number = 1 + next(k for k, region in enumerate(filled.values()) if region.contains(inside))
        for ring in (shapely.orient_polygons(face).exterior, *face.interiors):
            for a, b in pairwise(_rounded(place) for place in ring.coords):
                add(edges, a, b, (number, OUTSIDE))
    left, _, right, _ = (round(v, _DIGITS) for v in whole.bounds)
    return ContactCell(borders(edges), regions, left, right, mirrored=True, turned=turned)


def joined(edges: Mapping[Edge, tuple[int, int]]) -> dict[Edge, tuple[int, int]]:
    """Edges of which those that continue each other in a straight line are one; else a mesh is fine there, too."""
    whole, at = dict(edges), _by_end(edges)
    for here in at.values():
        if len(here) != 2 or whole[here[0]] != whole[here[1]] or not _in_line(*sorted(here)):
            continue
        (a, b), (c, d) = sorted(here)
        whole[a, d] = whole.pop((a, b))
        del whole[c, d]
        for end, old in ((a, (a, b)), (d, (c, d))):
            at[end].remove(old)
            at[end].append((a, d))
    return whole


def _in_line(first: Edge, second: Edge) -> bool:
    """Test whether the second of two edges begins where the first ends, in its direction."""
    (a, b), (c, d) = first, second
    return b == c and abs((b[0] - a[0]) * (d[1] - c[1]) - (b[1] - a[1]) * (d[0] - c[0])) <= _SLIVER_MM * dist(a, d)


def add(
    edges: dict[tuple[End, End], tuple[int, int]], a: End, b: End, sides: tuple[int, int],
    empty: int = OUTSIDE,
) -> None:  # fmt: skip
    """Add an edge of some length, from its lesser end on; a side that is ``empty`` keeps the region that it has."""
    if a == b:
        return
    key, (left, right) = ((a, b), sides) if a < b else ((b, a), sides[::-1])
    known = edges.get(key, (empty, empty))
    edges[key] = (known[0] if left == empty else left, known[1] if right == empty else right)


def borders(edges: Mapping[tuple[End, End], tuple[int, int]]) -> dict[tuple[End, End], tuple[int, int]]:
    """Edges between two different regions."""
    return {edge: sides for edge, sides in edges.items() if sides[0] != sides[1]}


def _rounded(p: Point) -> Point:
    return round(p[0], _DIGITS), round(p[1], _DIGITS)


def _uprights(
    edges: dict[Edge, tuple[int, int]], before: Strip | None, after: Strip | None, number: Mapping[Region, int]
) -> None:
    """Upright edges where one strip ends and the next begins."""
    place = after[0] if after else before[1]  # type: ignore[index]
    sides = [_spans(before, 1, number), _spans(after, 0, number)]
    heights = sorted({v for spans in sides for low, high, _ in spans for v in (low, high)})
    for low, high in pairwise(heights):
        left, right = (_region_at(spans, (low + high) / 2) for spans in sides)
        if left or right:
            edges[_rounded((place, low)), _rounded((place, high))] = (left, right)


def _region_at(spans: Sequence[tuple[float, float, int]], height: float) -> int:
    return next((region for low, high, region in spans if low < height < high), OUTSIDE)


def _spans(strip: Strip | None, end: int, number: Mapping[Region, int]) -> list[tuple[float, float, int]]:
    """Regions and their heights at one end of a strip."""
    layers = strip[2] if strip else []
    heights = [(round(low[end], _DIGITS), round(high[end], _DIGITS), number[r]) for r, low, high in layers]
    return [(low, high, region) for low, high, region in heights if high - low > _SLIVER_MM]
