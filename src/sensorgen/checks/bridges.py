"""Rule 9: bridges, overhangs and islands over air, and lines over an empty layer. Any body below supports."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import ceil
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from sensorgen.checks.widths import TOUCH_MM, VANISHES, Slices
from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.findings import Finding
from sensorgen.design.printer import Printer, Quality
from sensorgen.scene.layers import LayerRegions, Region, cleaned, inside, is_rectilinear, narrow_mm, parts, united
from sensorgen.scene.scene import SLIVER_MM, Body


class _Span(NamedTuple):
    """An unsupported stretch, and the middle of a place where it shows [mm]."""

    mm: float = 0.0
    x: float = 0.0
    y: float = 0.0


def check(slices: Slices, printer: Printer, quality: Quality) -> Iterator[Finding]:
    """Findings about bridges (supported at both ends), overhangs (at one) and islands (at none)."""
    line, least = printer.line_mm(), VANISHES * printer.nozzle_mm
    known: dict[tuple[int, ...], dict[str, _Span]] = {}
    for layer in range(1, len(slices.layers)):
        # What vanishes in the slicer neither needs support nor gives any.
        ground = [r for b in slices.scene.bodies if not (r := slices.printed(b, layer - 1, least)).is_empty]
        for body in slices.scene.bodies:
            shape = slices.printed(body, layer, least)
            key = (id(shape), *map(id, ground))
            if key not in known:
                known[key] = _spans(shape, ground, least)
            yield from _judged(body, layer + 1, slices.layers.mids_mm[layer], known[key], quality, line)


def _judged(
    body: Body, layer: int, z_mm: float, spans: dict[str, _Span], quality: Quality, line_mm: float
) -> Iterator[Finding]:
    limits = {"bridge": (quality.bridge_warning_mm, quality.bridge_error_mm), "overhang": (line_mm / 2, line_mm)}
    for kind, (warn, fail) in limits.items():
        span = spans[kind]
        if span.mm > warn + TOUCH_MM:
            severe = span.mm > fail + TOUCH_MM
            yield Finding(
                "9-bridge", "error" if severe else "warning", body.name,
                f"{'a bridge' if kind == 'bridge' else 'an overhang'} of {span.mm:.3g} mm over air",
                f"narrow it to {warn:.2g} mm, print upside down, or fill the air with support",
                round(span.mm, 9), round(fail if severe else warn, 9), layer, (span.x, span.y, z_mm),
            )  # fmt: skip
    island = spans["island"]
    if island.mm > 0:
        yield Finding(
            "9-bridge", "error", body.name, f"an island {island.mm:.3g} mm wide starts in mid-air",
            "turn the sensor over, or fill the air with support (--support bvoh)",
            round(island.mm, 9), 0.0, layer, (island.x, island.y, z_mm),
        )  # fmt: skip


def loose(slices: Slices) -> Iterator[Finding]:
    """Findings about bodies with a part that hangs on none of the rest once soluble support is washed out."""
    bodies = [b for b in slices.scene.bodies if not b.is_support()]
    if len(bodies) == len(slices.scene.bodies):
        return
    plans = [shapely.get_parts(united([slices.body(b, k) for b in bodies])) for k in range(len(slices.layers))]
    held = _together(plans)
    for body in bodies if not all(map(np.all, held)) else ():
        for k, (plan, of) in enumerate(zip(plans, held, strict=True)):
            stray = shapely.intersection(slices.body(body, k), shapely.union_all(plan[~of]))
            if stray.area > SLIVER_MM**2:
                yield Finding(
                    "9-loose", "error", body.name, "nothing holds it once the support is washed out",
                    "let a body that stays reach from one to the other", layer=k + 1,
                    place_mm=(round(stray.centroid.x, 3), round(stray.centroid.y, 3), slices.layers.mids_mm[k]),
                )  # fmt: skip
                break


def _together(plans: Sequence[NDArray[np.object_]]) -> list[Mask]:
    """Parts of each layer that are joined to the largest piece of all layers."""
    from sensorgen.scene.connections import groups

    first, pairs = np.cumsum([0, *map(len, plans)]), [np.zeros((2, 0), np.int64)]
    for start, (below, above) in zip(first, pairwise(plans), strict=False):
        one, other = shapely.STRtree(below).query(above, predicate="intersects")
        on = shapely.area(shapely.intersection(above[one], below[other])) > SLIVER_MM**2
        pairs.append(np.stack([start + len(below) + one[on], start + other[on]]))
    group = groups(int(first[-1]), *np.concatenate(pairs, axis=1))
    most = np.bincount(group, shapely.area(np.concatenate(plans))).argmax()
    return np.split(group == most, first[1:-1])


def _grid(
    shape: Region, ground: Sequence[Region], step_mm: float, rectilinear: bool
) -> tuple[tuple[Real, Real], Mask, Mask]:
    """Lines along x and y, and which cells between them the shape fills, and the ground.

    The lines are those of all edges; where some are slanted, lines a step apart.
    """
    x, y = (np.unique(at.round(9)) for at in shapely.get_coordinates([shape, *ground]).T)
    if rectilinear:
        x, y = (at[np.diff(at, prepend=-np.inf) > SLIVER_MM] for at in (x, y))
    else:
        x, y = (np.linspace(at[0], at[-1], ceil((at[-1] - at[0]) / step_mm) + 1) for at in (x, y))
    middles = (x[:-1] + x[1:]) / 2, (y[:-1] + y[1:]) / 2
    below = np.any([inside(region, *middles) for region in ground], axis=0)
    return (x, y), inside(shape, *middles), below


def _spans(shape: Region, ground: Sequence[Region], least_mm: float) -> dict[str, _Span]:
    """Longest bridge, overhang and island of a shape above a ground, along x or y.

    Every unsupported place is held along x or along y; the better way counts. Places that are held neither way,
    as the corners of a roof that juts out on two sides, hold on to those that are.
    """
    spans = dict.fromkeys(("bridge", "overhang", "island"), _Span())
    if shape.is_empty or any(shape is region for region in ground):
        return spans
    if shapely.covers(ground, shapely.box(*shape.bounds)).any():
        return spans
    rectilinear = is_rectilinear(shapely.multipolygons(shapely.get_parts([shape, *ground])))
    if not rectilinear and cleaned(shapely.difference(shape, shapely.union_all(ground))).is_empty:
        return spans
    lines, filled, below = _grid(shape, ground, least_mm / 2, rectilinear)
    air = filled & ~below

    # Lines that graze round supports miss some of them: no bridge is longer than the widest place without support is
    # wide, no overhang than its furthest place is away.
    most = {"bridge": np.inf, "overhang": np.inf, "island": np.inf}
    if not rectilinear:
        under = shapely.union_all(ground)
        places = shapely.get_parts(shapely.difference(shape, under))
        radii = shapely.length(shapely.maximum_inscribed_circle(places, tolerance=least_mm / 10))
        corners = shapely.points(np.unique(shapely.get_coordinates(shape).round(9), axis=0))
        _, away = shapely.STRtree(shapely.get_parts(under)).query_nearest(
            corners, return_distance=True, all_matches=False
        )
        most["bridge"], most["overhang"] = 2 * float(radii.max()), float(away.max())

    def note(kind: str, lengths: Real, where: Mask) -> None:
        lengths = lengths.clip(max=most[kind])
        i, j = np.unravel_index(np.argmax(np.where(where, lengths, 0.0)), where.shape)
        if where[i, j] and lengths[i, j] > spans[kind].mm:
            x, y = (float(line[k] + line[k + 1]) / 2 for line, k in zip(lines, (i, j), strict=True))
            spans[kind] = _Span(float(lengths[i, j]), round(x, 9), round(y, 9))

    while air.any():
        ends, lengths, narrow = _best(filled, lines, air)
        note("bridge", lengths, ends == 2)
        note("overhang", lengths, ends == 1)
        if not ends.any():
            note("island", narrow, air & (narrow > least_mm + TOUCH_MM))
            break
        air &= ends == 0
    return spans


def _best(filled: Mask, lines: tuple[Real, Real], air: Mask) -> tuple[Whole, Real, Real]:
    """Best support of every unsupported place: number of ends, length, and its narrower stretch [mm]."""
    ways = [_held(filled, air, lines[0]), tuple(m.T for m in _held(filled.T, air.T, lines[1]))]
    ends, lengths = (np.stack([way[k] for way in ways]) for k in (0, 1))
    # A bridge beats an overhang beats an island; among equals the shorter.
    best = np.argmin(np.where(ends == 2, lengths, np.where(ends == 1, 2 * lengths, np.inf)), axis=0)[None]
    return *(np.take_along_axis(m, best, 0)[0] for m in (ends, lengths)), lengths.min(axis=0)


def _held(filled: Mask, air: Mask, line: Real) -> tuple[Whole, Real]:
    """Along the first axis: number of supported ends of each unsupported stretch, and its length [mm]."""
    ends = np.zeros(filled.shape, np.int64)
    lengths = np.zeros(filled.shape)
    padded = np.pad(filled, ((1, 1), (0, 0)))
    edges = np.diff(np.pad(air, ((1, 1), (0, 0))).astype(np.int8), axis=0).T
    rows, starts = np.nonzero(edges == 1)
    stops = np.nonzero(edges == -1)[1]
    for start, stop, row in zip(starts, stops, rows, strict=True):
        ends[start:stop, row] = int(padded[start, row]) + int(padded[stop + 1, row])
        lengths[start:stop, row] = line[stop] - line[start]
    return ends, lengths


RULE = "9-support"
_OPEN, _ALONE = 0.8, 0.8  # share of a part over nothing, and share of a body's parts in a layer


def findings(layers: Sequence[LayerRegions], line_mm: float) -> Iterator[Finding]:
    """Bodies of which most lines of a layer lie over an empty layer, with length and share.

    Parameters
    ----------
    layers : sequence of LayerRegions
        As printed.
    line_mm : float
        Width of a line; wider parts are bridges, of rule 9.
    """
    for number, (below, layer) in enumerate(pairwise(layers), 2):
        under = np.array([part for region in below.regions.values() for part in parts(region)], object)
        tree = shapely.STRtree(under)
        for body, region in layer.regions.items():
            plan = parts(region)
            widths, middles = narrow_mm(plan), _middles(plan)
            line, part = tree.query(middles, predicate="intersects")
            met = shapely.length(shapely.intersection(middles[line], under[part]))
            share = 1 - np.bincount(line, met, len(plan)) / shapely.length(middles)
            alone = (share > _OPEN) & (widths < 2 * line_mm)
            lengths = shapely.area(plan) / widths
            length, whole = float(lengths[alone].sum()), float(lengths.sum())
            if length > _ALONE * whole:
                at = plan[int(alone.argmax())].centroid
                yield Finding(
                    RULE, "warning", body,
                    f"{length:.0f} mm of its lines ({length / whole:.0%}) lie over an empty layer",
                    "print what lies below: increase period_mm, or use other walls or thinner layers",
                    place_mm=(round(at.x, 3), round(at.y, 3), layer.bottom_mm), layer=number, count=int(alone.sum()),
                )  # fmt: skip


def _middles(plan: Sequence[shapely.Polygon]) -> NDArray[np.object_]:
    """Middle of each part along the longer side of the box around it, as a line."""
    x0, y0, x1, y1 = shapely.bounds(np.array(plan, object)).T
    along = x1 - x0 > y1 - y0
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    start = np.column_stack([np.where(along, x0, x), np.where(along, y, y0)])
    end = np.column_stack([np.where(along, x1, x), np.where(along, y, y1)])
    return np.asarray(shapely.linestrings(np.stack([start, end], axis=1)))
