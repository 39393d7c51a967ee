"""Ledger of deposit: material laid at each place of each layer, by tool, against the drawing.

Printed and drawn are rasters of 0.1 mm, as shares of a full layer. Volume is conserved: a line is spread over its
rectangle, with a share of each of its points to the four nearest cells. Limits are beyond the files of PrusaSlicer 2.5
and 2.9 and CuraEngine 4.13 and 5.0 for all shapes (bench/results/ledger.md).
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial, reduce
from itertools import groupby

import numpy as np
import shapely

from sensorgen.asprinted.beads import Beads
from sensorgen.checks import estimate
from sensorgen.core.arrays import Mask, Real, parts_of
from sensorgen.core.findings import runs
from sensorgen.design.design import Design
from sensorgen.export.gcode.results import GcodeFinding
from sensorgen.scene.connections import groups
from sensorgen.scene.layers import LayerRegions, Region, drawn, narrow_mm, parts

PITCH_MM = 0.1
NEAR_MIDDLE = 0.1  # of a layer: slicers may sample a face this near to mid-height on either side
_MARGIN = 10  # cells around the piece
_MOST_CELLS = 10_000  # along a line; longer ones are slips
_LOT = 16_000  # points of lines that are laid at once: few enough for the processor's cache
_ROWS = 4  # scan lines of a row of cells
# Volume of a body in a layer over the least and the most that any walls make of it: whole layers, strips, other parts
# (of tips under two lines wide slicers leave out more), and strips of classic walls, which print whole lines
_FACE = 0.15  # change of a body's area with the height of the sample, that means a face near mid-height
_WHOLE, _OF_STRIPS, _OF_PARTS, _CLASSIC = (0.9, 1.1), (0.9, 1.12), (0.75, 1.4), (0.9, 1.75)
_WINDOW = 1.1  # lines, of the window that holes and piles are looked for in
_OPEN, _HOLE_LINES = 0.3, 2.0  # filled share of a window a line wide in a hole; least area, in line widths squared
_PILED, _PILE_LINES = 1.7, 5.0  # as above, where lines lie upon each other
_LOCAL = ((4.5, -0.25, 0.35), (2.3, -0.45, 0.75))  # window in lines, and shares of a layer by which a tool may be off
_STRIPS = ((4.5, -0.15, 0.2), (2.3, -0.33, 0.55))  # as above, in layers of strips
_FOREIGN_LINES = 1.0  # area that a tool may fill further than a line from its material, in line widths squared
_UNSUPPORTED, _ALONE = 0.2, 0.8  # filled share of the layer below that supports a line; share of a tool's lines
_NOWHERE = 10**9  # line of the file
_STEP_MM = 0.2  # along lines, to look below them


@dataclass(frozen=True, eq=False)
class LayerRaster:
    """One layer as rasters.

    Attributes
    ----------
    number : int
        Layer from 0 [-].
    lines : Beads
        Its lines.
    printed : dict of int to (n, m) array
        By tool that has lines, filled share of the layer [-].
    total : (n, m) array
        Filled share by all tools [-].
    smoothed : (n, m) array
        Mean of it in a window of ``_WINDOW`` lines [-].
    drawn : dict of int to tuple of (n, m) array
        By tool, as drawn; one for each way in which slicers may sample the layer [-].
    strips : bool
        Drawn as strips, several of a body.
    """

    number: int
    lines: Beads
    printed: dict[int, Real]
    total: Real
    smoothed: Real
    drawn: dict[int, tuple[Real, ...]]
    strips: bool


@dataclass(frozen=True)
class Disagreement:
    """Disagreement of a layer: rule, subject, layer from 0, amount, message, place [mm] and line of the file."""

    rule: str
    subject: str
    layer: int
    amount: float
    message: str
    at_mm: tuple[float, float]
    line: int


def sampled(design: Design, off: float) -> tuple[LayerRegions, ...]:
    """Layers of a design, sampled ``off`` layers above mid-height."""
    scene, shift = design.printed, off * design.layers.layer_mm
    return drawn(scene, tuple(z + shift for z in design.layers.boundaries_mm(scene.size_mm[2])))


def check(design: Design, lines: Beads) -> Iterator[GcodeFinding]:
    """Findings about the deposit of a piece.

    Parameters
    ----------
    design : Design
        That is to be printed.
    lines : Beads
        Of the piece.
    """
    if not len(lines.number):
        return  # the heights say why
    around = [sampled(design, off) for off in (0.0, NEAR_MIDDLE, -NEAR_MIDDLE)]
    faults, below = [*_volumes(design, lines, around)], None
    for raster in rasters(design, lines, around):
        for rule in (_holes, _piles, _foreign, _local):
            faults += rule(design, raster)
        if below is not None:
            faults += _unsupported(design, raster, below)
        below = raster.total
    yield from _merged(faults)


def rasters(design: Design, lines: Beads, around: Sequence[Sequence[LayerRegions]]) -> Iterator[LayerRaster]:
    """Layers of a piece as rasters, from the bed up; ``around`` is the drawing at and near mid-height."""
    shape = tuple(int(np.ceil(size / PITCH_MM)) + 2 * _MARGIN for size in design.printed.size_mm[:2])
    names = bodies_by_tool(design)
    line = design.machine.line_mm()
    cover = lru_cache(4 * len(around) * len(names))(_cover)  # of this layer and the one before, often the same
    for k, layer in enumerate(around[0]):
        here, sampled_here = lines.of(lines.layer == k), [each[k] for each in around]
        shown = {
            tool: tuple(cover(way, shape) for way in dict.fromkeys(_ways(sampled_here, mine, line)))
            for tool, mine in names.items()
        }
        printed = {tool: deposit(here.of(here.tool == tool), shape) for tool in names if (here.tool == tool).any()}
        total: Real = sum(printed.values(), np.zeros(shape, np.float32))
        several = any(len(parts(region)) > 1 for region in layer.regions.values())
        smoothed = _mean(total, _WINDOW * line)
        yield LayerRaster(k, here, printed, total, smoothed, shown, bool(layer.along) and several)


def bodies_by_tool(design: Design) -> dict[int, list[str]]:
    """Names of the bodies that each tool prints."""
    names: dict[int, list[str]] = defaultdict(list)
    for body in design.printed.bodies:
        names[design.tool(body.material)].append(body.name)
    return names


def _ways(around: Sequence[LayerRegions], names: Sequence[str], line_mm: float) -> Iterator[tuple[Region, ...]]:
    """Regions of some bodies as slicers may print them: all of each, and without parts narrower than a line."""
    for each in around:
        regions = [each.region(name) for name in names]
        yield tuple(regions)
        yield tuple(_wide(region, line_mm) for region in regions)


@lru_cache(maxsize=256)
def _wide(region: Region, line_mm: float) -> Region:
    """Region without its parts narrower than a line."""
    plan = parts(region)
    wide = [part for part, width in zip(plan, narrow_mm(plan), strict=True) if width >= line_mm] if plan else []
    return region if len(wide) == len(plan) else shapely.MultiPolygon(wide)


def deposit(lines: Beads, shape: tuple[int, ...]) -> Real:
    """Filled share of each cell of a layer by some of its lines; what lies outside the raster is left out."""
    way = lines.end_mm - lines.start_mm
    length = np.hypot(*way.T)
    long, wide = (
        np.clip(np.round(size / PITCH_MM), 1, most).astype(np.int64)
        for size, most in ((length, _MOST_CELLS), (lines.width_mm, _MOST_CELLS // 100))
    )
    counts, corners = long * wide, np.array([0, 1, shape[1], shape[1] + 1])
    across = way[:, ::-1] * [-1, 1] * (lines.width_mm / length)[:, None]
    shares, filled = lines.volume_mm3 / lines.height_mm / counts / PITCH_MM**2, np.zeros(shape[0] * shape[1])
    along, aside = way / (long * PITCH_MM)[:, None], across / (wide * PITCH_MM)[:, None]
    corner = (lines.start_mm - across / 2) / PITCH_MM + (along + aside) / 2 + _MARGIN - 0.5
    for lot in np.array_split(np.arange(len(counts)), counts.sum() // _LOT + 1):
        which, step = parts_of(counts[lot])
        line = lot[which]
        many, share = wide[line], shares[line]
        row = step // many
        column = step - row * many
        x, y = (corner[line, k] + row * along[line, k] + column * aside[line, k] for k in (0, 1))
        inside = (x >= 0) & (y >= 0) & (x < shape[0] - 1) & (y < shape[1] - 1)
        if not inside.all():
            x, y, share = x[inside], y[inside], share[inside]
        i, j = x.astype(np.int64), y.astype(np.int64)
        cell, right, up = i * shape[1] + j, share * (x - i), y - j
        left = share - right
        four = np.stack([left - left * up, left * up, right - right * up, right * up], axis=1)
        np.add.at(filled, (cell[:, None] + corners).ravel(), four.ravel())  # at once: far cells are slow to reach
    return filled.reshape(shape).astype(np.float32)


def _cover(regions: Sequence[Region], shape: tuple[int, ...]) -> Real:
    """Share of each cell that regions cover: exact along y, by scan lines across."""
    rings = shapely.get_rings(shapely.normalize(shapely.get_parts(regions)))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    edge = np.flatnonzero(ring[1:] == ring[:-1])
    (x0, y0), (x1, y1) = (points[edge + k].T / PITCH_MM + _MARGIN for k in (0, 1))
    ends = [np.ceil(_ROWS * f(x0, x1) - 0.5).astype(np.int64) for f in (np.minimum, np.maximum)]
    first, last = (np.clip(end, 0, _ROWS * shape[0]) for end in ends)
    which, step = parts_of(last - first)
    row = first[which] + step
    share = ((row + 0.5) / _ROWS - x0[which]) / (x1 - x0)[which]
    y = np.clip(y0[which] + share * (y1 - y0)[which], 0, shape[1] - 1e-9)
    cell, sign = row // _ROWS * (shape[1] + 1) + y.astype(np.int64), np.sign(x1 - x0)[which]
    size = shape[0] * (shape[1] + 1)
    steps = np.zeros(size + 1)
    np.add.at(steps, cell, sign * (1 - y % 1) / _ROWS)
    np.add.at(steps, cell + 1, sign * (y % 1) / _ROWS)
    return np.asarray(np.abs(steps[:size].reshape(shape[0], -1).cumsum(1)[:, :-1]).astype(np.float32))


def _mean(of: Real, window_mm: float) -> Real:
    """Mean in a square window around each cell."""
    cells = max(round(window_mm / PITCH_MM), 3)
    return _sum(of, cells) / cells**2


def _sum(of: Real | Mask, cells: int) -> Real:
    """Sum in a square window of some cells around each, of nothing outside: SciPy takes longer to load than this."""
    first, (rows, columns) = cells // 2 + 1, of.shape
    sums = np.zeros((rows + cells, columns + cells))
    sums[first : first + rows, first : first + columns] = of
    sums.cumsum(0, out=sums).cumsum(1, out=sums)
    bands = sums[cells:] - sums[:-cells]
    return np.asarray(bands[:, cells:] - bands[:, :-cells])


def _largest(wrong: Mask, least_mm2: float = 0.0) -> tuple[float, tuple[float, float]]:
    """Area of the largest connected place [mm2], and its middle from the corner of the piece [mm]; 0 up to a least."""
    if np.count_nonzero(wrong) * PITCH_MM**2 <= least_mm2:
        return 0.0, (0.0, 0.0)
    cell = np.cumsum(wrong).reshape(wrong.shape) - 1
    right, up = wrong[:-1] & wrong[1:], wrong[:, :-1] & wrong[:, 1:]
    pairs = np.concatenate([(cell[:-1][right], cell[1:][right]), (cell[:, :-1][up], cell[:, 1:][up])], axis=1)
    place = groups(int(wrong.sum()), *pairs)
    areas = np.bincount(place)
    x, y = ((np.argwhere(wrong)[place == areas.argmax()].mean(0) + 0.5 - _MARGIN) * PITCH_MM).tolist()
    return float(areas.max()) * PITCH_MM**2, (round(x, 2), round(y, 2))


def _line_at(lines: Beads, at_mm: tuple[float, float]) -> int:
    """Line of the file nearest to a place; 1 without any."""
    if not len(lines.number):
        return 1
    off = np.hypot(*((lines.start_mm + lines.end_mm) / 2 - at_mm).T)
    return int(lines.number[off.argmin()])


def _near(of: Mask, by_mm: float) -> Mask:
    """Cells with a marked one within a distance, along x and y."""
    return _sum(of, 2 * round(by_mm / PITCH_MM) + 1) > 0.5


def _sparse(design: Design) -> float:
    """Least share of infill of any material of a design."""
    return min(each.infill for each in estimate.lines(design).values())


def _holes(design: Design, raster: LayerRaster) -> Iterator[Disagreement]:
    """Places inside the drawing that stay open; sparse infill is open by itself."""
    line = design.machine.line_mm()
    if _sparse(design) < 1:
        return
    plan = sum(reduce(np.minimum, each) for each in raster.drawn.values())
    open_ = ~_near(np.asarray(plan) <= 1 - _OPEN / 4, 0.8 * line) & (raster.smoothed < _OPEN)
    area, at = _largest(open_, _HOLE_LINES * line**2)
    if area > _HOLE_LINES * line**2:
        size = area + line * np.sqrt(area)  # the window leaves half a line at each side out
        message = f"a hole of about {size:.2g} mm2"
        yield Disagreement("hole", "", raster.number, size, message, at, _line_at(raster.lines, at))


def _piles(design: Design, raster: LayerRaster) -> Iterator[Disagreement]:
    """Lines upon each other in one layer."""
    line = design.machine.line_mm()
    area, at = _largest(raster.smoothed > _PILED, _PILE_LINES * line**2)
    if area > _PILE_LINES * line**2:
        message = f"lines lie upon each other on {area:.2g} mm2"
        yield Disagreement("pile", "", raster.number, area, message, at, _line_at(raster.lines, at))


def _foreign(design: Design, raster: LayerRaster) -> Iterator[Disagreement]:
    """Material further than a line from where its tool's material is drawn."""
    line = design.machine.line_mm()
    for tool, printed in raster.printed.items():
        near = _near(reduce(np.maximum, raster.drawn[tool]) >= _OPEN / 4, line)
        stray = np.where(near, 0.0, printed)
        area = float(stray.sum()) * PITCH_MM**2
        if area > _FOREIGN_LINES * line**2:
            _, at = _largest(stray > 0)
            share = float(stray.sum() / printed.sum())
            message = f"tool {tool} prints {area:.2g} mm2 ({share:.0%} of its lines) where its material is not drawn"
            own = raster.lines.of(raster.lines.tool == tool)
            yield Disagreement("material", f"{tool}", raster.number, area, message, at, _line_at(own, at))


def _local(design: Design, raster: LayerRaster) -> Iterator[Disagreement]:
    """A tool's deposit is spread as the drawing is; how much it is in all is another rule's."""
    sparse, line = _sparse(design), design.machine.line_mm()
    for tool, printed in raster.printed.items():
        for lines, least, most in _STRIPS if raster.strips else _LOCAL:
            window, off = lines * line / sparse, []
            for plan in raster.drawn[tool]:
                ratio = float(printed.sum() / max(float(plan.sum()), 1.0))
                mean = _mean(printed - ratio * plan, window)
                off.append((float(mean.min()), float(mean.max()), mean))
            low, high, worst = min(off, key=lambda each: each[1] - each[0])
            for beyond, what in ((low < least, "lacks"), (high > most, "is too much")):
                if beyond:
                    area, at = _largest(worst < least if what == "lacks" else worst > most)
                    material = f"tool {tool}: material {what} over {max(area, window**2):.2g} mm2"
                    own = raster.lines.of(raster.lines.tool == tool)
                    yield Disagreement("spread", f"{tool}{what}", raster.number, area, material, at, _line_at(own, at))


def _unsupported(design: Design, raster: LayerRaster, below: Real) -> Iterator[Disagreement]:
    """A tool prints most of its lines of a layer over nothing: length and share."""
    for tool in raster.printed:
        own = raster.lines.of(raster.lines.tool == tool)
        open_mm, length_mm = _over_nothing(own, below)
        if length_mm > 0 and open_mm > _ALONE * length_mm:
            middle = (own.start_mm + own.end_mm).mean(0) / 2
            names = sorted({design.printed.bodies[body].name for body in own.body.tolist()})
            message = f"{open_mm:.0f} mm of {', '.join(names)} ({open_mm / length_mm:.0%}) lie over an empty layer"
            at = (round(float(middle[0]), 2), round(float(middle[1]), 2))
            yield Disagreement("support", f"{tool}", raster.number, open_mm, message, at, int(own.number.min()))


def _over_nothing(lines: Beads, below: Real) -> tuple[float, float]:
    """Length of lines whose middle lies over an empty layer, and of all [mm]."""
    way = lines.end_mm - lines.start_mm
    length = np.hypot(*way.T)
    count = np.clip(np.ceil(length / _STEP_MM), 1, _MOST_CELLS).astype(np.int64)
    which, step = parts_of(count)
    share = (step + 0.5) / count[which]
    cell = ((lines.start_mm[which] + share[:, None] * way[which]) / PITCH_MM + _MARGIN).astype(np.int64)
    x, y = np.clip(cell, 0, np.array(below.shape) - 1).T
    return float((length / count)[which][below[x, y] < _UNSUPPORTED].sum()), float(length.sum())


def _volumes(
    design: Design, lines: Beads, around: Sequence[Sequence[LayerRegions]]
) -> Iterator[Disagreement]:  # fmt: skip
    """Each body takes in each layer about the volume that some walls make of it."""
    bodies, line = design.printed.bodies, design.machine.line_mm()
    laid = estimate.lines(design)
    by_rule = partial(estimate.layers, design.printed, design.machine, design.layers, laid=laid, overlap=True)
    by_walls = [by_rule(walls) for walls in estimate.RULES]
    printed = np.zeros((len(around[0]), len(bodies)))
    np.add.at(printed, (lines.layer, lines.body), lines.volume_mm3)
    for n, body in enumerate(bodies):
        for k, layer in enumerate(around[0]):
            areas = np.array([each[k].region(body.name).area for each in around])
            walls = np.array([each[k].region(body.name).area for each in by_walls])
            given, spare = printed[k, n], 2 * line * line * layer.height_mm  # ends of a line or two
            low, high = _expected(areas, walls, laid[body.material].infill, _limits(design, layer, body.name))
            low, high = low * layer.height_mm, high * layer.height_mm
            absent = given == 0 and (walls == 0).any()
            if absent or low - spare <= given <= high + spare:
                continue
            here = lines.of((lines.layer == k) & (lines.body == n))
            x, y = ((here.start_mm + here.end_mm).mean(0) / 2).round(2).tolist() if len(here.number) else (0.0, 0.0)
            message = f"{body.name} takes {given:.3g} mm3; expected {low:.3g} to {high:.3g} mm3"
            subject, number = f"{body.name}{given > high}", int(here.number.min(initial=_NOWHERE))
            yield Disagreement("volume", subject, k, given, message, (x, y), number)


def _expected(areas: Real, walls: Real, infill: float, limits: tuple[float, float]) -> tuple[float, float]:
    """Least and most area of a body in a layer, by its drawing as slicers sample it and as walls print it [mm2]."""
    least, most = limits
    if areas[0] <= 0:
        return 0.0, most * float(areas.max())
    samples = areas / areas[0]
    samples = np.where(np.abs(samples - 1) < _FACE, 1.0, samples)
    expected = np.append(walls[walls > 0], infill * areas[0])
    high = max(float(expected.max()), float(areas[0])) * float(samples.max())
    return least * float(expected.min() * samples.min()), most * high


def _limits(design: Design, layer: LayerRegions, body: str) -> tuple[float, float]:
    """Least and most volume of a body in a layer, of what walls make of it."""
    if len(parts(layer.region(body))) < 2:
        return _WHOLE
    if not layer.along:
        return _OF_PARTS
    return _CLASSIC if design.walls == "classic" else _OF_STRIPS


_ADVICE = {
    "hole": "slice again: lines are missing",
    "pile": "slice again: lines are printed twice, or of two bodies",
    "material": "put each material on its tool (--tool)",
    "spread": "slice again: lines are missing, doubled or moved",
    "support": "print what lies below it: other walls, thinner layers, or wider parts",
    "volume": "slice again: lines are missing or doubled, or their flow is another",
}


def _merged(faults: Iterable[Disagreement]) -> Iterator[GcodeFinding]:
    """One finding for the same fault in neighbouring layers, with the worst of them."""
    order = sorted(faults, key=lambda fault: (fault.rule, fault.subject, fault.layer))
    for (rule, _), same in groupby(order, lambda fault: (fault.rule, fault.subject)):
        for some in runs(same, lambda fault: fault.layer):
            worst = max(some, key=lambda fault: fault.amount)
            first, last, (x, y) = some[0].layer + 1, some[-1].layer + 1, worst.at_mm
            where = f"in layer {first}" if first == last else f"in layers {first} to {last}"
            message = f"{worst.message} {where}, at x {x:g}, y {y:g} mm from the sensor's corner"
            severity = "warning" if rule == "support" else "error"
            number = min(some, key=lambda fault: fault.line).line
            yield GcodeFinding(rule, severity, number if number < _NOWHERE else 1, message, _ADVICE[rule], len(some))
