"""G-code against the design that it prints: heights, deposit, nozzle, widths of lines, purging, and lines beside it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import groupby

import numpy as np
import shapely

from sensorgen.asprinted import ledger, nozzle
from sensorgen.asprinted.beads import Beads, beads, connected, pieces
from sensorgen.core.arrays import Mask, Real, Whole
from sensorgen.core.errors import BadInput
from sensorgen.core.findings import runs
from sensorgen.design.design import Design
from sensorgen.design.printer import PRIME_MM3
from sensorgen.export.gcode.motion import NOT_MODEL, Paths
from sensorgen.export.gcode.moves import NO_TOOL, Motion, ToolChange
from sensorgen.export.gcode.results import GcodeFinding
from sensorgen.scene.layers import LayerRegions, Region
from sensorgen.scene.scene import Point

LEVEL_MM = 0.005  # a line this far from the top of a layer lies in none; G-code has three decimals
WIDEST = 2.0  # lines, of one printed line
THINNEST, LONG_MM = 0.25, 2.0  # a line is thin that is thinner, in lines, and longer
SHIFTED = 0.35  # lines, by which a tool's middle may be off; walls and seams make 0.1
SOME_THIN = 0.6  # share of a tool's length that may be thin
MOST_LAYERS = 2.5  # that a line may lie above what stands there
PURGED_MM3 = PRIME_MM3 / 3  # that fill the nozzle after a change of tools; towers take PRIME_MM3
_SUPPORT = "support"
_OF_ANOTHER = ("first-layer", "layers", "material", "volume")  # rules that the print of another design breaks


def check(
    design: Design,
    paths: Paths,
    motion: Motion,
    centre_mm: Point,
    *,
    alone: bool = False,
    piece: str = "",
    lines: Beads | None = None,
) -> list[GcodeFinding]:
    """Disagreements with the design, as findings about lines of the file.

    Parameters
    ----------
    design : Design
        That is to be printed.
    paths : Paths
        Lines of the file, with the printer's own tool numbers, in the design's own directions.
    motion : Motion
        The file.
    centre_mm : (float, float)
        Middle of the piece on the bed [mm].
    alone : bool
        Whether the file prints nothing else.
    piece : str
        Name of the piece among others, which every finding then names.
    lines : Beads, optional
        Lines of the piece; found in ``paths`` if not given.
    """
    found = _of_piece(design, paths, motion, centre_mm, alone, lines)
    return [replace(f, message=f"{piece}: {f.message}") for f in found] if piece else found


def check_motion(design: Design, motion: Motion) -> list[GcodeFinding]:
    """Disagreements of a file that prints the design at any place, once or more often, alone or with others.

    Raises
    ------
    BadInput
        It does not print this design; see :func:`sensorgen.asprinted.beads.pieces`.
    """
    places, found = pieces(design, motion), list[GcodeFinding]()
    for number, place in enumerate(places, 1):
        x, y = place.bed_mm
        name = f"piece {number} of {len(places)}, at x {x:.4g}, y {y:.4g} mm on the bed" if len(places) > 1 else ""
        found += check(design, place.paths, motion, place.centre_mm, piece=name)
    return found


def _of_piece(
    design: Design, paths: Paths, motion: Motion, centre_mm: Point, alone: bool, lines: Beads | None
) -> list[GcodeFinding]:  # fmt: skip
    ends = _ends(design, paths, centre_mm)
    inside, waste = _inside(design, ends), _waste(paths)
    model = ~waste & (paths.length_mm() > 0)
    piece = model & inside
    if not piece.any():
        way = ends[1][model] if model.any() else np.array([[np.nan, np.nan]])
        off = np.maximum(-way, way - np.array(design.printed.size_mm[:2])).clip(0.0)
        message = f"nothing is printed at the place of {design.name}; the nearest line is "
        message += f"{float(np.hypot(*off.T).min()):.3g} mm away" if model.any() else "not there at all"
        return [GcodeFinding("place", "error", 1, message, "slice this design")]
    lines, layers = lines or beads(design, paths, centre_mm, cut=not alone), ledger.sampled(design, 0.0)
    return [
        *_heights(design, paths, piece),
        *ledger.check(design, lines),
        *nozzle.check(design, motion, lines),
        *_shifts(design, lines, layers),
        *_widths(design, lines),
        *_purged(design, paths, motion.changes, piece),
        *_floating(design, paths, np.logical_not(inside)),
        *_beside(paths, ends, _plan(design, layers), model & ~inside & alone, waste),
    ]


def misfits(design: Design, paths: Paths, centre_mm: Point) -> list[GcodeFinding]:
    """Errors of a piece whose layers, materials or volumes are not those of a design; arguments as of :func:`check`.

    Raises
    ------
    BadInput
        It is higher than the design: that of another one.
    """
    piece = _inside(design, _ends(design, paths, centre_mm)) & ~_waste(paths) & (paths.length_mm() > 0)
    top_mm, printed_mm = design.printed.size_mm[2], float(paths.end_mm[piece, 2].max(initial=0.0))
    if printed_mm > top_mm + design.layers.layer_mm / 2 + LEVEL_MM:
        raise BadInput(
            f"this G-code prints up to Z {printed_mm:g} mm, above the top of {design.name} at {top_mm:g} mm; expected "
            "the design that it was sliced from: give that one, or slice this one"
        )
    if not piece.any():
        return []
    findings = [*_heights(design, paths, piece), *ledger.check(design, beads(design, paths, centre_mm))]
    return [f for f in findings if f.severity == "error" and f.rule in _OF_ANOTHER]


def _ends(design: Design, paths: Paths, centre_mm: Point) -> list[Real]:
    """Ends of all lines from the corner of the piece [mm]."""
    corner = np.array(centre_mm) - np.array(design.printed.size_mm[:2]) / 2
    return [p[:, :2] - corner for p in (paths.start_mm, paths.end_mm)]


def _inside(design: Design, ends: Sequence[Real]) -> Mask:
    """Lines whose middle is at the place of the piece."""
    middle, beyond = (ends[0] + ends[1]) / 2, design.machine.line_mm() / 4
    return np.asarray(((middle > -beyond) & (middle < np.array(design.printed.size_mm[:2]) + beyond)).all(1))


def _waste(paths: Paths) -> Mask:
    """Lines of tower, skirt and the like."""
    return np.asarray(np.array([kind in NOT_MODEL for kind in paths.kinds])[paths.kind])


def _heights(design: Design, paths: Paths, piece: Mask) -> Iterator[GcodeFinding]:
    """The first layer is as high as the design's, and every line lies in a layer, in order."""
    tops = np.array(design.layers.boundaries_mm(design.printed.size_mm[2]))[1:]
    first_mm, layer_mm = design.layers.first_layer_mm, design.layers.layer_mm
    z = paths.end_mm[:, 2]
    lowest = float(z[piece].min())
    if abs(lowest - first_mm) > LEVEL_MM:
        message = f"the lowest line lies at Z {lowest:g} mm; the first layer of {design.name} is {first_mm:g} mm"
        lines, advice = paths.number[piece & (z == lowest)], "set the first layer's height, and no offset of Z"
        yield GcodeFinding.of("first-layer", lines, message, advice)
    near = np.searchsorted((tops[1:] + tops[:-1]) / 2, z)  # the layer whose top is nearest
    slanted = np.abs(paths.start_mm[:, 2] - z) > LEVEL_MM
    between = piece & ((np.abs(z - tops[near]) > LEVEL_MM) | slanted)
    if between.any():
        worst = float(z[between][0])
        message = (
            f"lines at Z {worst:g} mm lie in no layer of {design.name}: {first_mm:g} mm, then every {layer_mm:g} mm"
        )
        yield GcodeFinding.of("layers", paths.number[between], message, "slice with this design's layers")
    order = near[piece & ~between]
    if (np.diff(order) < 0).any():
        back = paths.number[piece & ~between][1:][np.diff(order) < 0]
        message = f"a layer of {design.name} is printed after one that lies higher"
        yield GcodeFinding.of("layers", back, message, "print layer by layer")
    yield from _missing(design, paths, piece & ~between, near, tops)


def _missing(design: Design, paths: Paths, rows: Mask, near: Whole, tops: Real) -> Iterator[GcodeFinding]:
    """No layer is without a line; ``near`` is the layer of each line, and ``rows`` are those that lie in one."""
    there = np.zeros(len(tops), bool)
    there[near[rows]] = True
    drawn_there = [list(layer.regions.values()) for layer in ledger.sampled(design, 0.0)]
    wide = np.array([any(_wide(r, design.machine.line_mm()).area > 0 for r in regions) for regions in drawn_there])
    narrow = ~wide & np.array([bool(regions) for regions in drawn_there])
    for absent, severity, advice in (
        (~there & wide, "error", "slice again; the file was cut, or layers were removed"),
        (
            ~there & narrow,
            "warning",
            "its parts are narrower than a line, and some walls leave them out: look at the layer",
        ),
    ):
        for layers in runs(np.flatnonzero(absent).tolist(), int):
            after = paths.number[rows & (near < layers[0])]
            which = f"layer {layers[0] + 1}" + (f" to {layers[-1] + 1}" if len(layers) > 1 else "")
            what = f"nothing of {design.name} is printed up to Z {tops[layers[-1]]:g} mm"
            message = f"{which} of {len(tops)} is missing: {what}"
            yield GcodeFinding("layers", severity, int(after.max(initial=1)), message, advice, len(layers))


@lru_cache(maxsize=256)
def _wide(region: Region, width_mm: float) -> Region:
    """The parts of a region that are at least so wide."""
    half = 0.49 * width_mm
    return region.buffer(-half, join_style="mitre").buffer(half, join_style="mitre")


def _shifts(design: Design, lines: Beads, layers: Sequence[LayerRegions]) -> Iterator[GcodeFinding]:
    """Each tool prints at its place in the piece: it spans what is drawn of its material."""
    size, beyond = np.array(design.printed.size_mm[:2]), design.machine.line_mm() / 4
    both = np.stack([lines.start_mm, lines.end_mm])
    own = ((both > -beyond) & (both < size + beyond)).all((0, 2))  # others run on into what touches the piece, as a tab
    names = ledger.bodies_by_tool(design)
    for tool in np.unique(lines.tool[own]).tolist():
        rows = own & (lines.tool == tool)
        plan = [layers[k].region(name) for k in np.unique(lines.layer[rows]).tolist() for name in names[tool]]
        x0, y0, x1, y1 = shapely.total_bounds(plan)
        ends = np.concatenate([lines.start_mm[rows], lines.end_mm[rows]])
        shift = (ends.min(0) + ends.max(0)) / 2 - [(x0 + x1) / 2, (y0 + y1) / 2]
        if np.abs(shift).max() > SHIFTED * design.machine.line_mm():
            message = f"what tool {tool} prints is shifted by x {shift[0]:.2g}, y {shift[1]:.2g} mm against the drawing"
            number = int(lines.number[rows][0])
            yield GcodeFinding(
                "place", "error", number, message, "slice without offsets of tools, or set them on the printer"
            )


def _widths(design: Design, lines: Beads) -> Iterator[GcodeFinding]:
    """No line is far wider than the nozzle lays, or far thinner."""
    line = design.machine.line_mm()
    length = np.hypot(*(lines.end_mm - lines.start_mm).T)
    thin = (lines.width_mm < THINNEST * line) & (length > LONG_MM)
    for tool in np.unique(lines.tool):  # a slicer fills a gap with a thin line now and then
        mine = lines.tool == tool
        thin[mine] &= length[thin & mine].sum() > SOME_THIN * length[mine].sum()
    for wrong, what, worst in (
        ((lines.width_mm > WIDEST * line) & (length > line), "wide", np.max),
        (thin, "thin", np.min),
    ):
        if wrong.any():
            width = float(worst(lines.width_mm[wrong]))
            message = (
                f"a line is {width:.2g} mm {what}; lines of a {design.machine.nozzle_mm:g} mm nozzle are {line:g} mm"
            )
            advice = "check E, the filament's diameter and the flow"
            yield GcodeFinding.of("width", lines.number[wrong], message, advice)


def _purged(design: Design, paths: Paths, changes: Sequence[ToolChange], piece: Mask) -> Iterator[GcodeFinding]:
    """Between taking a tool and its first line of the piece, it fills its nozzle elsewhere."""
    volume = paths.volume_mm3(design.machine.filament_mm)
    missing: dict[int, list[tuple[int, float]]] = {}
    taken = [next(same) for _, same in groupby(changes, key=lambda change: change.tool)]
    ends = [*(change.number for change in taken[1:]), math.inf]
    for change, end in zip(taken, ends, strict=True):
        rows = np.flatnonzero((paths.number > change.number) & (paths.number < end))
        own = rows[piece[rows]]
        if not len(own) or change.macro or change.tool == NO_TOOL:  # a macro that takes a tool primes it
            continue
        given = float(volume[rows[rows < own[0]]].sum())
        if given < PURGED_MM3:
            missing.setdefault(change.tool, []).append((int(paths.number[own[0]]), given))
    for tool, found in missing.items():
        number, given = min(found)
        message = (
            f"tool {tool} prints {given:.3g} mm3 elsewhere before its first line; {PURGED_MM3:g} mm3 fill its nozzle"
        )
        yield GcodeFinding("purge", "error", number, message, "use a prime tower", len(found))


def _plan(design: Design, layers: Sequence[LayerRegions]) -> shapely.Geometry:
    """Area of the bed that the piece covers: its rectangle, unless it was drawn elsewhere, cut, or has a ledge."""
    if design.border or design.geometry or design.layout:
        return shapely.union_all([region for layer in layers for region in layer.regions.values()])
    return shapely.box(0.0, 0.0, *design.printed.size_mm[:2])


def _floating(design: Design, paths: Paths, outside: Mask) -> Iterator[GcodeFinding]:
    """Lines beside the piece, as those of a tower, stand on the bed."""
    rows = np.flatnonzero(outside & (paths.length_mm() > 0))
    if not len(rows):
        return
    group = connected(paths.start_mm[rows, :2], paths.end_mm[rows, :2])
    order = np.lexsort((paths.end_mm[rows, 2], group))
    rows, z = rows[order], paths.end_mm[rows, 2][order]
    starts = np.diff(group[order], prepend=-1) != 0
    rise = np.where(starts, z, np.diff(z, prepend=0.0))
    layer_mm = max(design.layers.layer_mm, design.layers.first_layer_mm)
    jumps = np.cumsum(rise > MOST_LAYERS * layer_mm)
    air = jumps > np.maximum.accumulate(np.where(starts, jumps - (rise > MOST_LAYERS * layer_mm), 0))
    if paths.length_mm()[rows[air]].sum() > design.machine.line_mm():
        x, y = paths.end_mm[rows[air][0], :2]
        message = f"lines are printed in air at x {x:.4g}, y {y:.4g} mm on the bed, beside the sensor"
        yield GcodeFinding.of("clear", paths.number[rows[air]], message, "leave them out")


def _beside(
    paths: Paths, ends: list[Real], plan: shapely.Geometry, stray: Mask, waste: Mask
) -> Iterator[GcodeFinding]:  # fmt: skip
    """Tower and skirt keep clear of the piece, and nothing else is printed beside it."""
    support = np.array([kind.startswith(_SUPPORT) for kind in paths.kinds])[paths.kind]
    low, high = np.minimum(*ends), np.maximum(*ends)
    near = waste & ~support & (paths.length_mm() > 0) & (high > 0).all(1) & (low < np.array(plan.bounds[2:])).all(1)
    rows = np.flatnonzero(near)
    ways = shapely.linestrings(np.stack([ends[0][rows], ends[1][rows]], axis=1))
    near[rows] = shapely.intersects(ways, plan)
    if near.any():
        kinds = ", ".join(sorted({paths.kinds[kind] for kind in paths.kind[near].tolist()}))
        message = f"lines of {kinds} cross the sensor"
        yield GcodeFinding.of("clear", paths.number[near], message, "move them away from it")
    if stray.any():
        x, y = paths.end_mm[stray][0, :2]
        message = f"lines that belong to no body are printed at x {x:g}, y {y:g} mm on the bed"
        advice = "leave them out, or print them as skirt or tower"
        yield GcodeFinding.of("clear", paths.number[stray], message, advice)
