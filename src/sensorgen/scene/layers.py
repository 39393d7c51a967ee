"""Layers as regions in plan: what every body covers at one height, as polygons [mm]."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from sensorgen.scene.scene import SLIVER_MM, Body, Outline, Prism, Scene, box, rectangle, rounded

Region = Polygon | MultiPolygon


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
        """What a body covers; empty where it is absent."""
        return self.regions.get(body, MultiPolygon())

    def mapped(self, regions: Mapping[str, Region]) -> "LayerRegions":
        """The layer with other regions, empty ones left out."""
        return replace(self, regions={name: region for name, region in regions.items() if not region.is_empty})


def parts(region: Region) -> list[Polygon]:
    """Separate polygons of a region, from left to right."""
    found: list[Polygon] = [p for p in shapely.get_parts(region).tolist() if p.geom_type == "Polygon" and p.area > 0]
    return sorted(found, key=lambda part: part.bounds)


def united(outlines: Iterable[Outline]) -> Region:
    """Union of outlines."""
    polygons = [Polygon(outline) for outline in outlines]
    return polygons[0] if len(polygons) == 1 else shapely.union_all(polygons)


def cleaned(region: Region) -> Region:
    """A region without parts narrower than a sliver, which are rounding."""
    kept = [p for p in parts(region) if min(p.bounds[2] - p.bounds[0], p.bounds[3] - p.bounds[1]) > SLIVER_MM]
    return kept[0] if len(kept) == 1 else MultiPolygon(kept)


def is_box(part: Polygon) -> bool:
    """Whether a polygon is a rectangle along the axes."""
    x0, y0, x1, y1 = part.bounds
    return abs((x1 - x0) * (y1 - y0) - part.area) < SLIVER_MM**2


def narrow_mm(part: Polygon) -> float:
    """Smaller side of the smallest rectangle around a polygon [mm]."""
    x0, y0, x1, y1 = part.bounds
    if is_box(part):
        return min(x1 - x0, y1 - y0)
    around = np.diff(shapely.get_coordinates(shapely.minimum_rotated_rectangle(part))[:3], axis=0)
    return float(np.hypot(*around.T).min())


def drawn(scene: Scene, boundaries_mm: Sequence[float]) -> tuple[LayerRegions, ...]:
    """Every layer of a scene as a slicer samples it, at mid-height.

    Parameters
    ----------
    scene : Scene
        As it lies on the bed.
    boundaries_mm : sequence of float
        Of its layers, from the bed up [mm].
    """
    return _drawn(scene, tuple(boundaries_mm))


@lru_cache(maxsize=16)
def _drawn(scene: Scene, boundaries_mm: tuple[float, ...]) -> tuple[LayerRegions, ...]:
    known: dict[frozenset[Outline], Region] = {}
    spans = {body.name: [(p.span("z"), p) for p in body.prisms] for body in scene.bodies}
    layers = []
    for bottom, top in pairwise(boundaries_mm):
        at, regions = rounded((bottom + top) / 2), {}
        for name, prisms in spans.items():
            cuts = frozenset(o for (low, high), p in prisms if low <= at <= high for o in p.cut("z", at))
            if cuts and cuts not in known:
                known[cuts] = united(cuts)
            if cuts:
                regions[name] = known[cuts]
        layers.append(LayerRegions(bottom, top, regions, _along(regions, scene)))
    return tuple(layers)


def _along(regions: Mapping[str, Region], scene: Scene) -> str:
    """The axis along which everything runs from edge to edge, "y" first; "" where there is none."""
    found = [part for region in regions.values() for part in parts(region)]
    if not all(map(is_box, found)):
        return ""
    low, high = np.array([part.bounds for part in found]).reshape(-1, 2, 2).swapaxes(0, 1)
    whole = ((low < SLIVER_MM) & (high > np.array(scene.size_mm[:2]) - SLIVER_MM)).all(0)
    return "y" if whole[1] else "x" if whole[0] else ""


def scene_of(layers: Sequence[LayerRegions], like: Scene) -> Scene:
    """Layers as a scene: the bodies of another scene, filled with upright prisms; equal ones above each other are one.

    Rectilinear regions become boxes, regions with holes are cut through their holes.
    """
    bodies = (replace(body, prisms=tuple(_prisms(layers, body))) for body in like.bodies)
    return Scene(tuple(bodies), (*like.size_mm[:2], layers[-1].top_mm if layers else 0.0))


def _prisms(layers: Sequence[LayerRegions], body: Body) -> list[Prism]:
    growing: dict[Outline, tuple[float, float]] = {}
    found = []
    for layer in layers:
        for outline in outlines(layer.region(body.name)):
            bottom, top = growing.get(outline, (layer.bottom_mm, layer.bottom_mm))
            if top < layer.bottom_mm - SLIVER_MM:
                found.append(_prism(outline, bottom, top))
                bottom = layer.bottom_mm
            growing[outline] = (bottom, layer.top_mm)
    found += [_prism(outline, *span) for outline, span in growing.items()]
    return sorted(found, key=lambda p: (p.start_mm, p.outline))


def _prism(outline: Outline, bottom_mm: float, top_mm: float) -> Prism:
    (x0, y0), (x1, y1) = outline[0], outline[len(outline) // 2]
    if outline == rectangle(x0, x1, y0, y1):
        return box(x0, x1, y0, y1, bottom_mm, top_mm)
    return Prism("z", outline, rounded(bottom_mm), rounded(top_mm))


def outlines(region: Region) -> Iterator[Outline]:
    """Outlines without holes that together are a region: rectangles where all its edges run along the axes."""
    for part in parts(region):
        x0, y0, x1, y1 = part.bounds
        at = None if is_box(part) else _cut_at(part)
        if at is not None:
            for left, right in ((x0, at), (at, x1)):
                yield from outlines(shapely.clip_by_rect(part, left, y0, right, y1))
        elif is_box(part):
            yield rectangle(x0, x1, y0, y1)
        else:
            corners = shapely.get_coordinates(shapely.simplify(part, SLIVER_MM))[:-1]
            yield tuple((rounded(x), rounded(y)) for x, y in corners.tolist())


def _cut_at(part: Polygon) -> float | None:
    """Where to cut a polygon that is rectilinear or has holes; None where it is neither."""
    corners = shapely.get_coordinates(part)
    if (np.abs(np.diff(corners, axis=0)).min(1) < SLIVER_MM).all() and not part.interiors:
        inside = corners[(corners[:, 0] > part.bounds[0] + SLIVER_MM) & (corners[:, 0] < part.bounds[2] - SLIVER_MM), 0]
        return float(inside.min()) if len(inside) else None
    return float(part.interiors[0].centroid.x) if part.interiors else None
