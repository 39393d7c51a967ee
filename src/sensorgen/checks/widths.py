"""The scene as a slicer sees it, cut once per layer at mid-height; rules 5 and 6 about its widths and gaps.

Rules 5 and 6: what is too narrow at mid-layer vanishes or swells, and narrow gaps close.

The limits were found by slicing (PrusaSlicer 2.5 with Arachne and with classic walls, CuraEngine 4.13; nozzle
0.4 mm, line 0.44 mm) and scale with the nozzle. A width is the distance from the middle of an edge, square to it, to
the edge across.
"""

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress, pairwise
from math import inf
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from sensorgen.core.arrays import Mask
from sensorgen.core.findings import Finding, runs
from sensorgen.design.printer import Printer, Quality
from sensorgen.scene.layers import Region, are_boxes, drawn, is_rectilinear, narrow_mm, region_at
from sensorgen.scene.scene import Body, Point, Scene

TOUCH_MM = 1e-9  # below this a distance is rounding


@dataclass(frozen=True)
class Layers:
    """Boundaries of the printed layers, from the bed up [mm]."""

    boundaries_mm: tuple[float, ...]

    def __len__(self) -> int:
        """Number of layers [-]."""
        return len(self.boundaries_mm) - 1

    @cached_property
    def mids_mm(self) -> tuple[float, ...]:
        """Heights at which a slicer samples [mm]."""
        return tuple(round((a + b) / 2, 12) for a, b in pairwise(self.boundaries_mm))

    def printed_mm(self, z_mm: float) -> float:
        """Height at which a face drawn at ``z_mm`` comes out: the boundary after the last sample up to it [mm]."""
        return self.boundaries_mm[min(bisect_left(self.mids_mm, z_mm + TOUCH_MM), len(self))]

    def off_grid_mm(self, z_mm: float) -> float:
        """Distance of a height from the nearest boundary [mm]."""
        return min(abs(z_mm - b) for b in self.boundaries_mm)


class Slices:
    """Every body in every layer: cut once, asked by all rules. Layers are counted from 0."""

    def __init__(self, scene: Scene, quality: Quality) -> None:
        """Cut ``scene``, as it lies on the bed, into the layers of ``quality``."""
        self.scene = scene
        self.layers = Layers(tuple(quality.boundaries_mm(scene.size_mm[2])))
        self._drawn = drawn(scene, self.layers.boundaries_mm)
        self._wider: dict[tuple[int, float], Region] = {}

    def body(self, body: Body, layer: int) -> Region:
        """Region of a body in a layer."""
        return self._drawn[layer].region(body.name)

    def near(self, body: Body, layer: int, above_mm: float) -> Region:
        """Region of a body a little above a layer's mid-height, or below it [mm]."""
        return region_at(body, self.layers.mids_mm[layer] + above_mm)

    def printed(self, body: Body, layer: int, least_mm: float) -> Region:
        """Part of a body wider than ``least_mm`` in a layer: one object for equal layers, which share a region."""
        region = self.body(body, layer)
        key = id(region), least_mm
        if key not in self._wider:
            pieces = shapely.get_parts(region)
            self._wider[key] = shapely.multipolygons(pieces[narrow_mm(pieces) > least_mm + TOUCH_MM])
        return self._wider[key]


# As shares of the nozzle.
VANISHES = 0.12 / 0.4  # only Cura filling outline gaps prints a stretch this narrow
SWELLS = 0.34 / 0.4  # Arachne prints anything narrower at this width
OVERFILLED = 0.70 / 0.4  # classic walls put 1.8 to 1.17 times the material into anything narrower
GAP_CLOSES = 0.10 / 0.4
_NEAR = 1e-3  # of half a layer: a step in height within which flanks are straight


@dataclass(frozen=True)
class _Band:
    """Fate of stretches up to a width."""

    upto_mm: float
    severity: str
    effect: str
    advice: str
    noun: str = "stretch"


@dataclass(frozen=True)
class _Narrow:
    """The narrow stretches of one body, layer and band, or its closing gaps."""

    band: _Band
    layer: int
    z_mm: float
    stretches: "Sequence[Stretch]"


@dataclass(frozen=True)
class Stretch:
    """A straight way across a region, or across a gap in it [mm]."""

    width_mm: float
    middle_mm: Point
    way: Point


def _bands(printer: Printer) -> tuple[_Band, ...]:
    """Fate of narrow stretches by a printer's nozzle, from the narrowest on; a whole line prints."""
    line, swells = printer.line_mm(), SWELLS * printer.nozzle_mm
    widen = f"widen it to {line:.2g} mm"
    return (
        _Band(
            VANISHES * printer.nozzle_mm, "error", "vanishes (Cura filling outline gaps prints it 1.7 times too full)",
            widen,
        ),
        _Band(
            swells, "warning", f"prints {swells:.2g} mm wide (Arachne) or not at all (classic walls, plain Cura)", widen
        ),
        _Band(
            line - 2 * TOUCH_MM, "warning", "is narrower than a line: classic walls and plain Cura drop it",
            f"{widen}, or slice with Arachne",
        ),
        _Band(
            OVERFILLED * printer.nozzle_mm, "info", "gets 1.2 to 1.8 times its material with classic walls",
            "slice with Arachne",
        ),
    )  # fmt: skip


def check(slices: Slices, printer: Printer) -> Iterator[Finding]:
    """Findings about widths and gaps at mid-layer, one per body, band and run of layers."""
    bands, closes = _bands(printer), GAP_CLOSES * printer.nozzle_mm
    gap = _Band(closes, "warning", "closes when sliced", f"widen it to {closes:.2g} mm or more", "gap")
    known: dict[int, tuple[list[Stretch], list[Stretch]]] = {}  # equal layers share one region
    for body in slices.scene.bodies:
        narrow, gaps = [], []
        for layer, mid in enumerate(slices.layers.mids_mm):
            region = slices.body(body, layer)
            if id(region) not in known:
                across = stretches(region, bands[-1].upto_mm)
                known[id(region)] = across, stretches(region, closes - 3 * TOUCH_MM, gaps=True)
            across, between = known[id(region)]
            by_band = _by_band(bands, body, layer, across, slices)
            narrow += [_Narrow(band, layer, mid, here) for band, here in by_band if here]
            gaps += [_Narrow(gap, layer, mid, between)] if between else []
        yield from _findings("5-width", body, narrow)
        yield from _findings("6-gap", body, gaps)


def _by_band(
    bands: Sequence[_Band], body: Body, layer: int, across: Sequence[Stretch], slices: Slices
) -> Iterator[tuple[_Band, list[Stretch]]]:
    """Stretches by band. What vanishes is no error at tips, which taper out within their layer, and in support."""
    limits = pairwise((-inf, *(band.upto_mm + TOUCH_MM for band in bands)))
    for band, (least, most) in zip(bands, limits, strict=True):
        here = [s for s in across if least < s.width_mm <= most]
        if band.severity == "error" and here:
            tapers = _tapers(here, body, layer, slices)
            yield replace(band, severity="warning", noun="tip"), list(compress(here, tapers))
            here = list(compress(here, ~tapers))
        yield replace(band, severity="warning") if band.severity == "error" and body.is_support() else band, here


def _tapers(here: Sequence[Stretch], body: Body, layer: int, slices: Slices) -> Mask:
    """Mark tips, which lose half of their width up to the layer's boundary, and so all of it up to the next sample."""
    half = slices.layers.mids_mm[layer] - slices.layers.boundaries_mm[layer]
    width, middle, way = (np.array([getattr(s, k) for s in here]) for k in ("width_mm", "middle_mm", "way"))
    reach = 0.75 * width[:, None] * way
    lines = shapely.linestrings(np.stack([middle - reach, middle + reach], axis=1))
    lengths = []
    for sign in (-1, 1):
        polygons = shapely.get_parts(slices.near(body, layer, sign * _NEAR * half))
        line, part = shapely.STRtree(polygons).query(lines)
        inside = shapely.length(shapely.intersection(lines[line], polygons[part]))
        lengths.append(np.bincount(line, inside, len(lines)))
    return np.asarray(abs(lengths[1] - lengths[0]) / 2 / _NEAR > 0.49 * width)


def _findings(rule: str, body: Body, narrow: Sequence[_Narrow]) -> Iterator[Finding]:
    """One finding for a band in neighbouring layers."""
    for band in dict.fromkeys(each.band for each in narrow):
        for run in runs((each for each in narrow if each.band == band), lambda each: each.layer):
            worst = min(run, key=lambda each: each.stretches[0].width_mm)
            least, most = worst.stretches[0].width_mm, max(each.stretches[-1].width_mm for each in run)
            ends = [_below(width, band.upto_mm) for width in (least, most)]
            wide = " to ".join(dict.fromkeys(ends))
            yield Finding(
                rule, band.severity, body.name, f"a {band.noun} {wide} mm wide at mid-layer {band.effect}", band.advice,
                least, round(band.upto_mm, 6), run[0].layer + 1, (*worst.stretches[0].middle_mm, worst.z_mm),
                max(len(each.stretches) for each in run), run[-1].layer + 1 if len(run) > 1 else None,
            )  # fmt: skip


def _below(width_mm: float, limit_mm: float) -> str:
    """A width with three digits, or as many as show that it is below a limit."""
    texts = [f"{width_mm:.{digits}g}" for digits in range(3, 8)]
    return next((text for text in texts if float(text) < round(limit_mm, 6)), texts[0])


def stretches(region: Region, limit_mm: float, *, gaps: bool = False) -> list[Stretch]:
    """Stretches across a region up to a width, the narrowest first; or, with ``gaps``, those across gaps in it.

    Rectilinear regions are also looked at from the ends of their edges, where other widths may face them.
    """
    polygons = shapely.get_parts(region)
    boxes = are_boxes(polygons)
    here = ~boxes | _narrow_boxes(polygons, limit_mm + 2 * TOUCH_MM, gaps=gaps)
    if not here.any():
        return []
    # Start and end of every edge, the region on its right
    simple = shapely.normalize(shapely.simplify(shapely.multipolygons(polygons[here]), 0.0))
    rings = shapely.get_rings(shapely.get_parts(simple))
    corners, ring = shapely.get_coordinates(rings, return_index=True)
    same = ring[1:] == ring[:-1]
    starts, ends = corners[:-1][same], corners[1:][same]
    way = (ends - starts)[:, ::-1] * [1.0, -1.0]
    way /= np.hypot(*way.T)[:, None] * (-1.0 if gaps else 1.0)
    tree = shapely.STRtree(shapely.linestrings(np.stack([starts, ends], axis=1)))
    by_place: dict[tuple[float, ...], Stretch] = {}
    has_corners = not boxes.all() and is_rectilinear(region)
    for share in (0.5, 1e-6, 1 - 1e-6) if has_corners else (0.5,):
        known = {stretch.width_mm for stretch in by_place.values()}
        widths = _across(tree, starts + share * (ends - starts), way, limit_mm)
        met = np.flatnonzero(np.isfinite(widths))
        middles = (starts[met] + share * (ends - starts)[met] + way[met] * widths[met, None] / 2).round(9)
        for width, out, (x, y), at in zip(
            widths[met].tolist(), way[met].tolist(), middles.tolist(), middles.round(6).tolist(), strict=True
        ):
            if share == 0.5 or width not in known:
                by_place.setdefault((width, *at), Stretch(width, (x, y), tuple(out)))
    return sorted(by_place.values(), key=lambda s: (s.width_mm, abs(s.way[1]), s.middle_mm))


def _narrow_boxes(boxes: NDArray[Any], upto_mm: float, *, gaps: bool) -> Mask:
    """Mask of the boxes whose shorter side is up to a width; or, with ``gaps``, which are so near to another part."""
    low, high = shapely.bounds(boxes).reshape(-1, 2, 2).swapaxes(0, 1)
    if not gaps:
        return np.asarray((high - low).min(axis=1, initial=np.inf) <= upto_mm)
    here, there = shapely.STRtree(boxes).query(shapely.box(*(low - upto_mm).T, *(high + upto_mm).T))
    return np.isin(np.arange(len(boxes)), here[here != there])


def _across(
    tree: shapely.STRtree, places: NDArray[np.float64], way: NDArray[np.float64], limit_mm: float
) -> NDArray[np.float64]:
    """Distances from places at which an edge is met (n,), inf where none is within the limit [mm]."""
    rays = shapely.linestrings(np.stack([places + 1e-8 * way, places + (limit_mm + 2 * TOUCH_MM) * way], axis=1))
    ray, edge = tree.query(rays)
    met = shapely.intersection(rays[ray], tree.geometries[edge])
    nearest = np.full(len(places), np.inf)
    np.fmin.at(nearest, ray, shapely.distance(shapely.points(places[ray]), met))
    return np.array([round(w, 9) if w <= limit_mm + TOUCH_MM else np.inf for w in nearest.tolist()])
