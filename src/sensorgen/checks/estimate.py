"""Estimate of a print without a slicer: each layer at mid-height, each part as wide as the slicer's walls print it.

The rules were found by slicing with PrusaSlicer 2.5 and 2.9 (Arachne and classic walls) and CuraEngine 4.13 and 5.0,
nozzles of 0.25 to 0.6 mm; they scale with the nozzle. Against the real slices: bench/results/estimate.md.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
import shapely

from sensorgen.checks.widths import SWELLS, VANISHES
from sensorgen.core.errors import UnknownName
from sensorgen.design.design import Design, Infill
from sensorgen.design.printer import Printer, Quality
from sensorgen.scene.layers import LayerRegions, Region, cleaned, drawn, narrow_mm, parts, united
from sensorgen.scene.scene import SLIVER_MM, Scene

ROUND = 1 - pi / 4  # a bead's rounded sides take this share of its height from its width
_TRACE = 0.04 / 0.4  # of the nozzle, below which Cura filling gaps prints nothing
_FEATURE = 1 / 4  # of the line, below which Cura 5 prints nothing: its ``min_feature_size``
# Where infill can lie in odd and in even layers, in pitches: one line above the other, or above the space between
SHIFTS = ((0.0, 0.0), (0.25, 0.25), (0.5, 0.5), (0.75, 0.75), (0.0, 0.5))
Shift = tuple[float, float]


@dataclass(frozen=True)
class LineLayout:
    """Layout of a material's lines.

    Attributes
    ----------
    line_mm : float
        Width of a line [mm].
    walls_mm : float
        Width of all lines that run around a part [mm].
    infill : float
        Share of the rest that is filled [-].
    pattern : str
        Of a sparse infill, which is stripes here whatever it is.
    """

    line_mm: float
    walls_mm: float = 0.0
    infill: float = 1.0
    pattern: str = "rectilinear"


def lines(design: Design) -> dict[str, LineLayout]:
    """Layout of the lines of each material of a design, as far as its print settings are known."""
    layouts = {}
    for name, source in design.used().items():
        material, infill = design.material(name), design.infill.get(name, Infill())
        line = design.profile.line_mm.get(name, design.machine.line_mm())
        walls = design.profile.wall_lines.get(name) or material.chosen("wall_lines", source)
        percent = infill.percent or material.chosen("infill_percent", source)
        pattern = infill.pattern or design.layers.infill_pattern
        shares = (1.0 if walls is None else walls) * line, (100.0 if percent is None else percent) / 100.0
        layouts[name] = LineLayout(line, *shares, pattern)
    return layouts


def arachne(width_mm: float, layer_mm: float, line_mm: float, nozzle_mm: float) -> float:  # noqa: ARG001
    """Variable lines: the narrowest vanish, narrow ones swell, the rest is a rounding narrower [mm]."""
    if width_mm < VANISHES * nozzle_mm - SLIVER_MM:
        return 0.0
    swells = SWELLS * nozzle_mm
    return swells if width_mm < swells else width_mm - ROUND * layer_mm


def classic(width_mm: float, layer_mm: float, line_mm: float, nozzle_mm: float) -> float:  # noqa: ARG001
    """Lines of one width: what no whole line fits vanishes [mm]."""
    return 0.0 if width_mm < line_mm - SLIVER_MM else width_mm - ROUND * layer_mm


def cura(width_mm: float, layer_mm: float, line_mm: float, nozzle_mm: float) -> float:  # noqa: ARG001
    """Cura's walls: what no whole line fits vanishes [mm].

    Of two lines that overlap, one is thinned by the overlap and keeps its path: half of the overlap stays open. It is
    the one further from the middle of the bed (along y: from its back), so that a strip is lopsided.
    """
    if width_mm < line_mm - SLIVER_MM:
        return 0.0
    return max(line_mm, min(width_mm, 1.5 * width_mm - line_mm))


def cura_gaps(width_mm: float, layer_mm: float, line_mm: float, nozzle_mm: float) -> float:
    """Cura with ``fill_outline_gaps``: what no whole line fits keeps its width [mm]."""
    if width_mm < line_mm - SLIVER_MM:
        return width_mm if width_mm > _TRACE * nozzle_mm - SLIVER_MM else 0.0
    return cura(width_mm, layer_mm, line_mm, nozzle_mm)


def cura_5(width_mm: float, layer_mm: float, line_mm: float, nozzle_mm: float) -> float:  # noqa: ARG001
    """Variable lines of Cura 5: as ``arachne``, but they fill the width, and the narrowest is a quarter line [mm]."""
    return 0.0 if width_mm < _FEATURE * line_mm - SLIVER_MM else max(width_mm, SWELLS * nozzle_mm)


Rule = Callable[[float, float, float, float], float]
RULES: dict[str, Rule] = {
    "arachne": arachne, "classic": classic, "cura": cura, "cura-gaps": cura_gaps, "cura-5": cura_5
}  # fmt: skip


def layers(
    scene: Scene, printer: Printer, quality: Quality, walls: str = "arachne",
    laid: Mapping[str, LineLayout] | None = None, shift: Shift | None = None, overlap: bool = False,
) -> list[LayerRegions]:  # fmt: skip
    """Printed part of every layer.

    Parameters
    ----------
    scene : Scene
        As it lies on the bed.
    printer, quality : Printer, Quality
        What prints it.
    walls : str
        One of ``RULES``.
    laid : mapping of str to LineLayout, optional
        Material to its lines; solid ones of the printer's width if not given.
    shift : (float, float), optional
        How far the infill of odd and of even layers lies aside, in pitches [-]; so that lines of two layers meet as
        often as those that cross do if not given.
    overlap : bool
        Bodies that swell into each other keep all of it: slicers print the place twice.

    Raises
    ------
    UnknownName
        No such walls.

    Notes
    -----
    The width of a part is the smaller side of the smallest rectangle around it. A strip from edge to edge of the sensor
    keeps its length, a plate stays whole. Where two bodies swell into each other the electrode keeps the place, and
    support gives it up. Nothing sags: gaps are upper limits. Sparse infill is parallel stripes that fill its share; the
    stripes of every other layer are shifted. A layer whose
    mid-height is the top of the sensor is printed, which PrusaSlicer does not always do.
    """
    if walls not in RULES:
        raise UnknownName("walls", walls, RULES)
    printed: list[LayerRegions] = []
    known: dict[object, Mapping[str, Region]] = {}  # of equal layers, which share their regions
    given = drawn(scene, quality.boundaries_mm(scene.size_mm[2]))
    way = "x" if any(layer.along == "x" for layer in given) else "y"
    sparse = {b.name: laid[b.material] for b in scene.bodies if laid and b.material in laid}
    for number, layer in enumerate(given):
        key = round(layer.height_mm, 12), *((name, id(region)) for name, region in layer.regions.items())
        if key not in known:
            known[key] = _printed(layer, scene, printer, RULES[walls], laid or {}, overlap=overlap)
        regions = dict(known[key])
        for name, mine in sparse.items():
            if mine.infill < 1 and name in regions:
                whole = regions[name].area > scene.size_mm[0] * scene.size_mm[1] * (1 - SLIVER_MM)
                line_mm = RULES[walls](mine.line_mm, layer.height_mm, mine.line_mm, printer.nozzle_mm)
                aside = (shift or (0.0, mine.infill * (1 - mine.infill)))[number % 2]
                along = way if whole else layer.along or way
                regions[name] = _sparse(regions[name], mine, line_mm, along, aside)
        printed.append(layer.mapped(regions))
    return printed


def _sparse(region: Region, lines: LineLayout, line_mm: float, way: str, shift: float) -> Region:
    """A region with stripes of air along ``way`` from edge to edge, within its walls, by a share of the pitch aside."""
    x0, y0, x1, y1 = shapely.bounds(parts(region)).T
    wall = lines.walls_mm
    inside = (x0 + wall, y0, x1 - wall, y1) if way == "y" else (x0, y0 + wall, x1, y1 - wall)
    low, high = (inside[0], inside[2]) if way == "y" else (inside[1], inside[3])
    wide = high > low + SLIVER_MM
    if not wide.any():
        return region
    share = lines.infill
    pitch = sqrt(2) * line_mm / share  # cut across lines at 45 degrees
    starts = pitch * (shift + np.arange(np.floor(low[wide].min() / pitch) - 1, high[wide].max() / pitch + 1))
    ends = starts + pitch * (1 - share)
    edge = np.array([y0.min(), y1.max()] if way == "y" else [x0.min(), x1.max()])
    air = shapely.box(starts, edge[0], ends, edge[1]) if way == "y" else shapely.box(edge[0], starts, edge[1], ends)
    within = shapely.union_all(shapely.box(*(side[wide] for side in inside)))
    return cleaned(shapely.difference(region, shapely.intersection(within, shapely.multipolygons(air))))


def _printed(
    layer: LayerRegions, scene: Scene, printer: Printer, wide: Rule, laid: Mapping[str, LineLayout], *, overlap: bool
) -> dict[str, Region]:
    """Regions that walls make of a layer; one that two bodies swell into is the first one's, unless they overlap."""
    length, width, _ = scene.size_mm
    regions: dict[str, Region] = {}
    # Electrodes first and support last, as their tools are.
    for body in sorted(scene.bodies, key=lambda b: (b.is_support(), not b.terminal)):
        if body.name in layer.regions:
            line_mm = laid[body.material].line_mm if body.material in laid else printer.line_mm()

            def printed_width(width_mm: float, line_mm: float = line_mm) -> float:
                return wide(width_mm, layer.height_mm, line_mm, printer.nozzle_mm)

            aside = scene.size_mm if wide in (cura, cura_gaps) else None
            swollen = _widened(layer, body.name, length * width, printed_width, aside)
            inside = shapely.clip_by_rect(swollen, 0.0, 0.0, length, width)
            region, others = united(inside), shapely.get_parts([] if overlap else list(regions.values()))
            met = np.unique(shapely.STRtree(others).query(inside, predicate="intersects")[1])
            free = shapely.difference(region, shapely.union_all(others[met])) if met.size else region
            regions[body.name] = cleaned(free)
    return regions


def _widened(
    layer: LayerRegions, body: str, plan_mm2: float, wide: Callable[[float], float], lopsided: Sequence[float] | None
) -> Sequence[Region]:
    """The parts of a body in a layer as their walls print them; strips that are ``lopsided``, in a sensor of a size."""
    plan = parts(layer.region(body))
    if not plan or plan[0].area > plan_mm2 * (1 - SLIVER_MM):
        return plan
    bounds = shapely.bounds(plan)
    across = {"y": bounds[:, 2] - bounds[:, 0], "x": bounds[:, 3] - bounds[:, 1]}
    width = across[layer.along] if layer.along else narrow_mm(plan)
    printed = np.array([wide(w) for w in width.tolist()])
    more = (printed - width)[:, None] / 2
    if layer.along:
        sides = np.array([-1, 0, 1, 0] if layer.along == "y" else [0, -1, 0, 1])
        swollen = bounds + more * sides
        if lopsided:
            # What is lost is lost on the far side of the bed's middle, along y on the front
            off = bounds[:, ::2].mean(axis=1) - lopsided[0] / 2 if layer.along == "y" else -np.ones(len(plan))
            swollen += np.minimum(more, 0.0) * np.sign(off)[:, None] * abs(sides)
        swollen = shapely.box(*swollen.T)
    else:
        swollen = shapely.buffer(plan, more[:, 0], join_style="mitre")
    return list(swollen[printed > 0])
