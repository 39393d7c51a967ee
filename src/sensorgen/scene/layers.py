"""Layers as regions in plan [mm], and the overlay of a scene: its pieces over which all layers are the same.

Overlay: the pieces of a scene over which all layers are the same, in cross-section or in plan.

Scenes of one extrusion, or of boxes, fall into columns of their cross-sections. Upright prisms of any outline, as round
or octagonal pillars, are overlaid in plan with shapely: faces between all their edges, exact to rounding.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from sensorgen.core.arrays import parts_of
from sensorgen.scene.scene import (
    SLIVER_MM,
    Body,
    Outline,
    Piece,
    Point,
    Prism,
    Scene,
    box,
    rectangle,
    rounded,
    seen_from_above,
)
from sensorgen.scene.sections import ROUNDING_MM, Layer, SectionColumn, alike, columns, sections

Region: TypeAlias = Polygon | MultiPolygon
EMPTY = MultiPolygon()
_SOLID = 1e-6  # share of air in a solid, by rounding
_BELOW_MM = 1e-7  # of a face at mid-height, all slicers print the body below it


@dataclass(frozen=True)
class LayerRegions:
    """One layer.

    Attributes
    ----------
    bottom_mm, top_mm : float
        Where the layer starts and ends [mm].
    regions : mapping of str to Region
        What each body covers, by its name; bodies that cover nothing are left out.
    along : str
        "x" or "y" where the layer is drawn as strips along that axis, from edge to edge of the sensor; else "".
    """

    bottom_mm: float
    top_mm: float
    regions: Mapping[str, Region]
    along: str = ""

    @property
    def height_mm(self) -> float:
        """Height of the layer [mm]."""
        return self.top_mm - self.bottom_mm

    def region(self, body: str) -> Region:
        """Region that a body covers; empty where it is absent."""
        return self.regions.get(body, EMPTY)

    def mapped(self, regions: Mapping[str, Region]) -> "LayerRegions":
        """The layer with other regions, empty ones left out."""
        return replace(self, regions={name: region for name, region in regions.items() if not region.is_empty})


def parts(region: Region) -> list[Polygon]:
    """Separate polygons of a region, from left to right."""
    polygons = shapely.get_parts(region)
    polygons = polygons[shapely.area(polygons) > 0]
    order: list[Polygon] = polygons[np.lexsort(shapely.bounds(polygons).T[::-1])].tolist()
    return order


def united(polygons: Sequence[Polygon]) -> Region:
    """Union of polygons; those that a line along y or x parts from their neighbours need no overlay."""
    separate = shapely.get_parts(np.array(polygons, dtype=object))
    separate = separate[shapely.area(separate) > 0]
    bounds = shapely.bounds(separate)
    for axis in (0, 1):
        rising = bounds[bounds[:, axis].argsort()]
        if (rising[1:, axis] > rising[:-1, axis + 2] + SLIVER_MM).all():
            return shapely.multipolygons(separate) if len(separate) != 1 else separate[0]
    return shapely.union_all(separate)


def cleaned(region: Region) -> Region:
    """A region without parts narrower than a sliver, which are rounding."""
    polygons = shapely.get_parts(region)
    low, high = shapely.bounds(polygons).reshape(-1, 2, 2).swapaxes(0, 1)
    wide = (high - low > SLIVER_MM).all(1)
    if wide.all():
        return region
    return shapely.multipolygons(polygons[wide])


def inside(region: Region, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mask (n, m) of the places of a grid, at rising x (n,) and y (m,) [mm], that lie in a region.

    An odd number of edges lies left of each: far sooner counted for a whole line than for each place by itself.
    """
    corners, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(region)), return_index=True)
    edges = np.stack([corners[:-1], corners[1:]], axis=1)[ring[1:] == ring[:-1]]
    low, high = np.take_along_axis(edges, edges[..., 1:].argsort(axis=1), axis=1).swapaxes(0, 1)
    first, last = np.searchsorted(y, low[:, 1]), np.searchsorted(y, high[:, 1])
    edge, step = parts_of(last - first)
    row = first[edge] + step
    (x0, y0), (x1, y1) = low[edge].T, high[edge].T
    met = np.zeros((len(x) + 1, len(y)), np.int64)
    np.add.at(met, (np.searchsorted(x, x0 + (y[row] - y0) / (y1 - y0) * (x1 - x0)), row), 1)
    return np.asarray(met.cumsum(axis=0)[:-1] % 2 == 1)


def are_boxes(polygons: Sequence[Polygon] | NDArray[np.object_]) -> NDArray[np.bool_]:
    """Mask of the polygons that are rectangles along the axes (n,)."""
    x0, y0, x1, y1 = shapely.bounds(polygons).T
    return np.asarray(abs((x1 - x0) * (y1 - y0) - shapely.area(polygons)) < SLIVER_MM**2)


def is_rectilinear(region: Region) -> bool:
    """True where all edges run along x or y."""
    rings = shapely.get_rings(shapely.get_parts(region))
    corners, ring = shapely.get_coordinates(rings, return_index=True)
    steps = np.abs(np.diff(corners, axis=0)).min(1)
    return bool((steps[ring[1:] == ring[:-1]] < SLIVER_MM).all())


def narrow_mm(polygons: Sequence[Polygon] | NDArray[np.object_]) -> NDArray[np.float64]:
    """Smaller side of the smallest rectangle around each polygon (n,) [mm]."""
    outlines_of = np.array(polygons, dtype=object)
    x0, y0, x1, y1 = shapely.bounds(outlines_of).T
    narrow: NDArray[np.float64] = np.minimum(x1 - x0, y1 - y0)
    turned = ~are_boxes(outlines_of)
    if turned.any():
        corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(outlines_of[turned])).reshape(-1, 5, 2)
        narrow[turned] = np.hypot(*np.diff(corners[:, :3], axis=1).T).min(axis=0)
    return narrow


@lru_cache(maxsize=16)
def drawn(scene: Scene, boundaries_mm: tuple[float, ...]) -> tuple[LayerRegions, ...]:
    """Every layer of a scene as a slicer samples it, at mid-height, or just below it where faces lie there.

    Parameters
    ----------
    scene : Scene
        As it lies on the bed.
    boundaries_mm : tuple of float
        Of its layers, from the bed up [mm].
    """
    layers, faces = [], {rounded(z) for body in scene.bodies for z in faces_mm(body)}
    for bottom, top in pairwise(boundaries_mm):
        middle = rounded((bottom + top) / 2)
        at = middle - _BELOW_MM if middle in faces else middle
        by_body = {body.name: region_at(body, at) for body in scene.bodies}
        regions = {name: region for name, region in by_body.items() if not region.is_empty}
        layers.append(LayerRegions(bottom, top, regions, _along(regions, scene)))
    return tuple(layers)


def faces_mm(body: Body) -> set[float]:
    """Heights of a body's horizontal faces and edges, without those between facets of a curved one [mm]."""
    return {z for p in body.pieces for z in getattr(p, "faces_mm", p.levels_mm)()}


def region_at(body: Body, z_mm: float) -> Region:
    """Region of a body at a height."""
    return _united(tuple(dict.fromkeys(o for p in body.pieces for o in p.cut("z", z_mm))))


@lru_cache(maxsize=64)
def _united(outlines: tuple[Outline, ...]) -> Region:
    """Union of outlines; equal layers share one."""
    by_corners = defaultdict(list)
    for outline in outlines:
        by_corners[len(outline)].append(outline)
    return united([part for alike in by_corners.values() for part in shapely.polygons(np.array(alike))])


def _along(regions: Mapping[str, Region], scene: Scene) -> str:
    """The axis along which everything runs from edge to edge, "y" first; "" where there is none."""
    polygons = shapely.get_parts(list(regions.values()))
    if not are_boxes(polygons).all():
        return ""
    low, high = shapely.bounds(polygons).reshape(-1, 2, 2).swapaxes(0, 1)
    whole = (low < SLIVER_MM) & (high > np.array(scene.size_mm[:2]) - SLIVER_MM)
    return "y" if whole[:, 1].all() else "x" if whole[:, 0].all() else ""


def scene_of(layers: Sequence[LayerRegions], like: Scene) -> Scene:
    """Layers as a scene: the bodies of another scene, filled with upright prisms; equal ones above each other are one.

    Rectilinear regions become boxes, regions with holes are cut through their holes.
    """
    bodies = []
    for body in like.bodies:
        growing: dict[Outline, tuple[float, float]] = {}
        prisms: list[Prism] = []
        for layer in layers:
            for outline in outlines(layer.region(body.name)):
                bottom, top = growing.get(outline, (layer.bottom_mm, layer.bottom_mm))
                if top < layer.bottom_mm - SLIVER_MM:
                    prisms.append(_prism(outline, bottom, top))
                    bottom = layer.bottom_mm
                growing[outline] = (bottom, layer.top_mm)
        prisms += [_prism(outline, *span) for outline, span in growing.items()]
        prisms.sort(key=lambda p: (p.start_mm, p.outline))
        bodies.append(replace(body, pieces=tuple(prisms)))
    size = (*like.size_mm[:2], layers[-1].top_mm if layers else 0.0)
    return replace(like, bodies=tuple(bodies), size_mm=size)


def _prism(outline: Outline, bottom_mm: float, top_mm: float) -> Prism:
    (x0, y0), (x1, y1) = outline[0], outline[len(outline) // 2]
    if outline == rectangle(x0, x1, y0, y1):
        return box(x0, x1, y0, y1, bottom_mm, top_mm)
    return Prism("z", outline, rounded(bottom_mm), rounded(top_mm))


def outlines(region: Region) -> Iterator[Outline]:
    """Outlines without holes that together are a region: rectangles where all its edges run along the axes.

    With holes its corners are rounded first: edges that a rounding error parts would be cut apart.
    """
    has_holes = any(part.interiors for part in parts(region))
    for part in parts(shapely.set_precision(region, SLIVER_MM) if has_holes else region):
        x0, y0, x1, y1 = part.bounds
        is_box = are_boxes([part])[0]
        at = None if is_box else _cut_at(part)
        if at is not None:
            for left, right in ((x0, at), (at, x1)):
                yield from outlines(shapely.clip_by_rect(part, left, y0, right, y1))
        elif is_box:
            yield rectangle(x0, x1, y0, y1)
        else:
            corners = shapely.get_coordinates(shapely.simplify(part, SLIVER_MM))[:-1]
            yield tuple((rounded(x), rounded(y)) for x, y in corners.tolist())


def _cut_at(part: Polygon) -> float | None:
    """Where to cut a polygon that is rectilinear or has holes; None where it is neither."""
    corners, holes = shapely.get_coordinates(part), shapely.get_num_interior_rings(part)
    slanted = np.count_nonzero(np.abs(np.diff(corners, axis=0)).min(1) >= SLIVER_MM)  # ways between rings among them
    if holes:
        hole = shapely.get_interior_ring(part, holes // 2)  # halves of many are cut sooner than one after the other
        return float(hole.bounds[0] if slanted <= holes and is_rectilinear(part) else hole.centroid.x)
    x = corners[:, 0]
    inside = x[(x > part.bounds[0] + SLIVER_MM) & (x < part.bounds[2] - SLIVER_MM)]
    return float(inside.min()) if not slanted and len(inside) else None


@dataclass(frozen=True)
class OverlayPart:
    """Columns side by side.

    Attributes
    ----------
    depth_mm : float
        Of all columns [mm].
    columns : tuple of SectionColumn
        From left to right in a cross-section; in plan in no order, each 1 mm deep and as wide as that makes its area.
    looks : tuple of int
        Of each column, the number of the first that looks like it.
    in_plan : bool
        Whether they come from a plan.
    """

    depth_mm: float
    columns: tuple[SectionColumn, ...]
    looks: tuple[int, ...]
    in_plan: bool = False


def overlay_parts(scene: Scene) -> list[OverlayPart]:
    """The parts that together are the scene.

    Raises
    ------
    ValueError
        Outlines overlap in plan, or are slanted both in plan and in elevation.
    """
    if all((isinstance(p, Prism) and p.axis != "z") or p.is_box() for _, p in scene.pieces):
        return [OverlayPart(s.depth_mm, tuple(columns(s)), tuple(alike(s))) for s in sections(scene)]
    patches = _patches(scene)
    return [OverlayPart(1.0, patches, tuple(range(len(patches))), in_plan=True)]


def is_solid(scene: Scene) -> bool:
    """True where bodies fill a scene, cogs or not, between electrodes over all of its plan: air has no place."""
    spans = np.array([[piece.span(axis) for axis in "xyz"] for _, piece in scene.pieces])
    low, high = spans[..., 0].min(axis=0), spans[..., 1].max(axis=0)
    whole = np.ptp(spans, axis=2)[:, :2].prod(axis=1) > (1 - _SOLID) * (high - low)[:2].prod()
    plates = {
        body.terminal for (body, piece), all_of in zip(scene.pieces, whole, strict=True) if all_of and piece.is_box()
    }
    volume = sum(piece.volume_mm3() for _, piece in scene.pieces)
    return {"bottom", "top"} <= plates and volume > (1 - _SOLID) * (high - low).prod()


@lru_cache(maxsize=8)
def _patches(scene: Scene) -> tuple[SectionColumn, ...]:
    """Pieces of the plan over which the same layers lie, those of one look as one."""
    pieces = scene.pieces
    numbers: dict[tuple[str, Point], int] = {}
    kinds = [numbers.setdefault((body.name, p.span("z")), len(numbers)) for body, p in pieces]
    first = dict(zip(reversed(kinds), reversed(pieces), strict=True))
    plans = np.array([_plan(body, p) for body, p in pieces])
    edges = shapely.boundary([*plans, shapely.box(0.0, 0.0, *scene.size_mm[:2])])
    faces = shapely.get_parts(shapely.polygonize([shapely.union_all(edges)]))
    over = defaultdict[int, list[int]](list)  # kinds of the pieces over each face
    for face, piece in shapely.STRtree(plans).query(shapely.point_on_surface(faces), predicate="within").T.tolist():
        over[face].append(kinds[piece])
    areas: dict[tuple[int, ...], float] = defaultdict(float)
    for face, area in enumerate(shapely.area(faces).tolist()):
        areas[tuple(sorted(over[face]))] += area
    looks = ((look, area) for look, area in areas.items() if area > ROUNDING_MM**2)
    return tuple(SectionColumn(0.0, area, _layers([first[kind] for kind in look])) for look, area in looks)


def _plan(body: Body, piece: Piece) -> shapely.Polygon:
    """An upright prism seen from above."""
    if not piece.is_constant("z"):
        raise ValueError(f"{body.name} is slanted or curved in elevation: no column has constant layers")
    plan = shapely.Polygon(seen_from_above(piece))
    if not plan.is_valid:
        raise ValueError(f"an outline of {body.name} crosses itself: {shapely.is_valid_reason(plan)} mm")
    return plan


def _layers(pieces: Sequence[tuple[Body, Piece]]) -> tuple[Layer, ...]:
    """Pieces over one place as layers, from bottom to top."""
    spans = sorted(((*p.span("z"), body) for body, p in pieces), key=lambda span: span[:2])
    for (_, top, lower), (bottom, _, upper) in pairwise(spans):
        if bottom < top - ROUNDING_MM:
            raise ValueError(f"outlines overlap in plan: {lower.name} and {upper.name} at z = {bottom:g} mm")
    return tuple(Layer(body, (low, low), (high, high)) for low, high, body in spans)
