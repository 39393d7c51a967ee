"""A design as printed: its layers, estimated or from G-code, as a scene with electrode gap, volumes and lost parts.

Its unit cell is one period of the drawing, from the middle of the sensor. G-code is rounded to a micrometre, so that no
printed period repeats another exactly: a model that looks for mirrors would have to solve the whole sensor. The
drawing's mirrors say where a period starts and ends.
"""

from collections import defaultdict
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import shapely

from sensorgen.checks import estimate, volumes
from sensorgen.core.errors import BadInput
from sensorgen.core.findings import Finding, LayerVolume
from sensorgen.design.design import Design
from sensorgen.design.walls import WALLS
from sensorgen.scene.geometry import meshes
from sensorgen.scene.layers import LayerRegions, drawn, scene_of
from sensorgen.scene.scene import FLOATING, Body, Point, Scene, seen_from_above

if TYPE_CHECKING:
    from sensorgen.asprinted.beads import Beads
    from sensorgen.export.gcode.motion import Paths
    from sensorgen.scene.connections import Connected
from functools import lru_cache
from itertools import pairwise

from shapely.affinity import translate

from sensorgen.core.arrays import Real
from sensorgen.scene.layers import Region, cleaned, parts
from sensorgen.scene.repetition import Band, Slice, affordable, repeat
from sensorgen.scene.scene import SLIVER_MM, rounded
from sensorgen.scene.sections import square_to
from sensorgen.scene.slabs import is_open

SHIFT_MM = 0.05  # of a layer or strip to both sides along x and y, which a printer may miss its place by
_ROUNDED_MM = SHIFT_MM / 10  # edges nearer than this are one: no printer parts them, nor prints a weld as narrow
_GRID_MM = 1e-3  # of corners: G-code has three decimals


@dataclass(frozen=True)
class Window:
    """A rectangle in plan [mm].

    Attributes
    ----------
    x_mm, y_mm : (float, float)
        Its sides [mm].
    repeats : (bool, bool)
        Whether the pattern goes on by shifts along x and y; else by mirrors.
    """

    x_mm: Point
    y_mm: Point
    repeats: tuple[bool, bool] = (False, False)

    def sides_mm(self) -> Point:
        """Lengths along x and y [mm]."""
        return rounded(self.x_mm[1] - self.x_mm[0]), rounded(self.y_mm[1] - self.y_mm[0])

    def area_mm2(self) -> float:
        """Area [mm2]."""
        x, y = self.sides_mm()
        return x * y


@lru_cache(maxsize=64)  # by whatever walls a drawing is printed, its period is the same
def window(scene: Scene, boundaries_mm: tuple[float, ...]) -> Window:
    """One period of a drawing near its middle, along x and y.

    It starts and ends where least conducts in the patterned layers, so that a cog that is printed lopsided is whole.
    Along an axis without mirrors that repeat it is the whole sensor.

    Parameters
    ----------
    scene : Scene
        The drawing.
    boundaries_mm : tuple of float
        Of its layers, from the bed up [mm].
    """
    conducting = {body.name for body in scene.bodies if body.terminal}
    (x, one), (y, other) = (_period(drawn(scene, boundaries_mm), conducting, scene.size_mm, axis) for axis in (0, 1))
    return Window(x, y, (one, other))


def inside(plan: Window, whole: Scene, layers: Sequence[LayerRegions]) -> Window:
    """The period of a rectangle inside a border that cuts it: as wide as a fifth of it where nothing changes across.

    Parameters
    ----------
    plan : Window
        Of the rectangle.
    whole : Scene
        The rectangle.
    layers : sequence of LayerRegions
        Inside the border.

    Raises
    ------
    BadInput
        The border cuts this period.
    """
    sides = []
    for axis, (low, high) in zip("xy", (plan.x_mm, plan.y_mm), strict=True):
        uniform = len(square_to(whole, axis)) == 1
        sides.append((0.4 * high + 0.6 * low, 0.6 * high + 0.4 * low) if uniform else (low, high))
    period_window = Window(sides[0], sides[1], plan.repeats)
    box = shapely.box(sides[0][0], sides[1][0], sides[0][1], sides[1][1])
    if not any(
        shapely.covers(shapely.union_all(list(layer.regions.values())).buffer(SLIVER_MM), box) for layer in layers
    ):
        raise BadInput("the border cuts the period in the middle of the sensor; expected one that leaves it whole")
    return period_window


def _period(
    layers: Sequence[LayerRegions], conducting: set[str], size_mm: Sequence[float], axis: int
) -> tuple[Point, bool]:
    """A period along an axis, and whether it repeats by shifts."""
    end, wide = size_mm[axis], size_mm[1 - axis]
    patterned = [layer for layer in layers if layer.along != "xy"[axis]]
    low, width, shifts = _repeating(patterned, size_mm, axis)
    middle = int((end / 2 - low) // width)
    starts = [low + k * width for k in range(middle - 3, middle + 3)]
    inside = [s for s in starts if s > -SLIVER_MM and s + 2 * width < end + SLIVER_MM]
    if not inside:
        return (0.0, end), False
    conductors = [layer.region(name) for layer in patterned for name in conducting]

    def crossed(at: float) -> int:
        strip = [at - SLIVER_MM, 0.0, at + SLIVER_MM, wide]
        return int(shapely.intersects(conductors, shapely.box(*(strip if axis == 0 else np.roll(strip, 1)))).sum())

    start = min(inside, key=lambda s: (crossed(s), abs(s + width - end / 2)))
    return (start, start + 2 * width), shifts


def _repeating(patterned: Sequence[LayerRegions], size_mm: Sequence[float], axis: int) -> tuple[float, float, bool]:
    """Start of a period along an axis, half of it [mm], and whether it repeats by shifts; else by mirrors."""
    regions = [region for layer in patterned for region in layer.regions.values()]
    if all(layer.along for layer in patterned):
        low, high = _of_strips(list(set(regions)), size_mm, axis)
        return low, high - low, False
    repeated = repeat(regions, size_mm, axis)
    width = repeated.high_mm - repeated.low_mm
    return repeated.low_mm, width / 2 if repeated.shifts else width, repeated.shifts


def _of_strips(regions: Sequence[Region], size_mm: Sequence[float], axis: int) -> Point:
    """Ends of the cell of strips square to an axis, between mirrors [mm]."""
    end, wide = size_mm[axis], size_mm[1 - axis]
    places = np.unique(np.append(shapely.get_coordinates(regions)[:, axis], [0.0, end]))
    # A face sampled just below leaves slivers: their middle is where the drawing's mirrors see the edge. An edge so
    # near to the sensor's end is where the other periods have it, and the end is there too.
    groups = np.split(places, np.flatnonzero(np.diff(places) > SLIVER_MM) + 1)
    places = np.array([groups[0][-1], *(group.mean() for group in groups[1:-1]), groups[-1][0]])
    middles = (places[:-1] + places[1:]) / 2
    x, y = (middles, wide / 2) if axis == 0 else (wide / 2, middles)
    looks = np.array([shapely.contains_xy(region, x, y) for region in regions], dtype=bool)
    # Slices of one level band each, named by all that stands there
    bands = [(Band(look.tobytes().hex(), "", (0.0, 0.0), (1.0, 1.0)),) for look in looks.T.reshape(len(middles), -1)]
    strips = [Slice(a, b, band) for (a, b), band in zip(pairwise(places.tolist()), bands, strict=True)]
    piece = affordable(tuple(strips)).slices
    return piece[0].left_mm, piece[-1].right_mm


def cut(layers: Sequence[LayerRegions], to: Window, without: Container[str] = ()) -> list[LayerRegions]:
    """The part of some layers within a window, moved to the origin, with edges that rounding parted made one [mm]."""
    (x0, x1), (y0, y1) = to.x_mm, to.y_mm
    moved = []
    for layer in layers:
        inside = {n: shapely.clip_by_rect(r, x0, y0, x1, y1) for n, r in layer.regions.items() if n not in without}
        moved.append(layer.mapped({n: translate(r, -x0, -y0) for n, r in inside.items()}))
    return joined(moved, to)


def joined(layers: Sequence[LayerRegions], of: Window) -> list[LayerRegions]:
    """Layers of a window with edges that rounding parted made one, alike to both sides."""
    drawn = shapely.get_coordinates([region for layer in layers if layer.along for region in layer.regions.values()])
    places = []  # edges, rising, and where each goes: to the middle of those that rounding parted, or to the side
    for axis, side in enumerate(of.sides_mm()):
        edges = np.unique(np.append(drawn[:, axis], [0.0, side]))
        groups = np.split(edges, np.flatnonzero(np.diff(edges) >= _ROUNDED_MM) + 1)
        middles = [np.full(len(g), g.mean() - side / 2).round(9).round(6) + side / 2 for g in groups[1:-1]]
        places.append((edges, np.concatenate([0.0 * groups[0], *middles, 0.0 * groups[-1] + side]).round(9)))
    return [layer.mapped({n: _moved(r, places, layer.along) for n, r in layer.regions.items()}) for layer in layers]


def _moved(region: Region, places: list[tuple[Real, Real]], along: str) -> Region:
    """A region with its edges where they belong; slanted ones on a grid of the file's decimals."""
    if along:
        sides = zip(places * 2, shapely.bounds(parts(region)).T, strict=True)
        x0, y0, x1, y1 = (to[np.searchsorted(of, at)] for (of, to), at in sides)
        wide = (x1 > x0) & (y1 > y0)
        return shapely.union_all(shapely.box(x0, y0, x1, y1)[wide])
    high = np.array([to[-1] for _, to in places])

    def to_sides(at: Real) -> Real:
        return np.where(at < _ROUNDED_MM, 0.0, np.where(at > high - _ROUNDED_MM, high, at))

    return cleaned(shapely.transform(shapely.set_precision(region, _GRID_MM), to_sides))


def evened(layers: Sequence[LayerRegions], to: Window, within_mm: float = np.inf) -> list[LayerRegions]:
    """Layers of a window with each strip as far to one side as its mirror image is to the other [mm].

    For crossed strips, whose lopsided cell would take sixteen times the bricks, and for cells that are lopsided by no
    more than a printer may be: as they are where a strip would move by ``within_mm`` or more. Widths stay; a strip that
    is printed a little aside moves to its place, which changes the field in second order.
    """
    sides, even = np.array([*to.sides_mm(), *to.sides_mm()]), []
    for layer in layers:
        regions = dict(layer.regions)
        for name, region in regions.items() if layer.along else ():
            bounds = shapely.bounds(parts(region))
            mirrored = (sides - bounds)[::-1][:, [2, 3, 0, 1]]
            if np.abs(mirrored - bounds).max(initial=0.0) >= 2 * within_mm:
                return list(layers)
            regions[name] = shapely.union_all(shapely.box(*((bounds + mirrored) / 2).T))
        even.append(layer.mapped(regions))
    return even


@dataclass(frozen=True)
class PrintCell:
    """The unit cell of a print.

    Attributes
    ----------
    scene : Scene
        One period, bottom electrode down, without support, shrunk as the sensor in use.
    count : float
        How many of its plan the sensor has [-].
    """

    scene: Scene
    count: float


@dataclass(frozen=True, eq=False)
class Printed:
    """A design as printed.

    Attributes
    ----------
    design : Design
        As drawn.
    provenance : str
        "printed, estimated (PrusaSlicer, Arachne walls)", or "printed, " with slicer and version.
    layers : mapping of str to sequence of LayerRegions
        By the convention for a line's width; that of the first is the print's scene.
    lines : Beads or None
        The lines; None for an estimate.
    doubts : tuple of str
        Why the file may print another design.
    """

    design: Design
    provenance: str
    layers: Mapping[str, Sequence[LayerRegions]]
    lines: "Beads | None" = None
    doubts: tuple[str, ...] = ()

    @cached_property
    def scene(self) -> Scene:
        """The whole print as it lies on the bed."""
        return scene_of(self.first, self.design.printed)

    @property
    def first(self) -> Sequence[LayerRegions]:
        """The layers by the first convention."""
        return next(iter(self.layers.values()))

    @cached_property
    def cells(self) -> dict[str, PrintCell]:
        """The unit cell by every convention."""
        whole = self.design.unbordered.printed
        boundaries = self.design.layers.boundaries_mm(whole.size_mm[2])
        fringe = is_open(self.design.unbordered.in_use)  # is part of the capacitance
        plan = Window((0.0, whole.size_mm[0]), (0.0, whole.size_mm[1])) if fringe else window(whole, boundaries)
        if self.design.border:
            plan = inside(plan, whole, drawn(self.design.printed, boundaries))
        aside = _ROUNDED_MM if self.lines is None else SHIFT_MM
        return {name: cell(self.design, own.layers, own.bodies, plan, aside) for name, own in self._connected.items()}

    @cached_property
    def _connected(self) -> "dict[str, Connected]":
        """The layers by every convention, each conductor at the terminal that it touches."""
        from sensorgen.scene.connections import connected_layers

        bodies, conducts = self.design.printed.bodies, self.design.conducts
        return {name: connected_layers(layers, bodies, conducts) for name, layers in self.layers.items()}

    def remarks(self) -> dict[str, tuple[str, ...]]:
        """By every convention, where electrodes touch, how many pieces of conductor float, and doubts."""
        return {name: (*connected.remarks(), *self.doubts) for name, connected in self._connected.items()}

    @property
    def cell(self) -> PrintCell:
        """The unit cell by the first convention."""
        return next(iter(self.cells.values()))

    @cached_property
    def rows(self) -> list[LayerVolume]:
        """Printed and drawn volume per body and layer."""
        lines, scene, extruded = self.lines, self.design.printed, None
        if lines is not None:
            total = np.zeros((int(lines.layer.max(initial=0)) + 1, len(scene.bodies)))
            np.add.at(total, (lines.layer, lines.body), lines.volume_mm3)
            extruded = {(k, b.name): float(row[n]) for k, row in enumerate(total) for n, b in enumerate(scene.bodies)}
        return volumes.rows(scene, self.first, extruded)

    def findings(self) -> list[Finding]:
        """Rule 7, and rule 1 where electrodes touch by the first convention; with the design's waivers."""
        shorts = [
            Finding(
                "1-short", "error", " / ".join(dict.fromkeys(short.bodies)), f"as printed, {short.words()}: a short",
                "use other walls or line widths, or draw them further apart", 0.0, place_mm=short.place_mm,
                layer=next(k for k, layer in enumerate(self.first, 1) if layer.top_mm > short.place_mm[2]),
            )
            for short in next(iter(self._connected.values())).shorts
        ]  # fmt: skip
        other = [Finding("13-gcode", "warning", "file", doubt, "give its own design") for doubt in self.doubts]
        return self.design.waived([*volumes.findings(self.rows, self.design.printed), *shorts, *other])


def body(
    design: Design,
    paths: "Paths | None" = None,
    *,
    walls: str = "arachne",
    shift: estimate.Shift | None = None,
    slicer: str = "",
    centre_mm: Point | None = None,
) -> Printed:
    """A design as printed.

    Parameters
    ----------
    design : Design
        As drawn.
    paths : Paths, optional
        Lines of a slicer's file, with the printer's own tool numbers; estimated if not given.
    walls : str
        For an estimate, one of :data:`sensorgen.checks.estimate.RULES`.
    shift : (float, float), optional
        For an estimate, where sparse infill lies, as of :func:`sensorgen.checks.estimate.layers`.
    slicer : str
        Name and version of the slicer, for the provenance.
    centre_mm : (float, float), optional
        Middle of the piece on the printer's bed [mm]; the middle of the bed if not given.

    Raises
    ------
    BadInput
        The file prints nothing at the design's place.
    UnknownName
        No such walls.
    """
    if paths is None:
        laid = estimate.lines(design)
        layers = estimate.layers(design.printed, design.machine, design.layers, walls, laid, shift)
        return Printed(design, f"printed, estimated ({WALLS[walls]})", {"mid-plane": layers})
    from sensorgen.asprinted.beads import CONVENTIONS, beads

    lines = beads(design, paths, centre_mm)
    if not len(lines.number):
        tools = sorted({design.tool(body.material) for body in design.printed.bodies})
        raise BadInput(
            f"no line of {design.name} in this G-code: expected tools {tools} in layers of "
            f"{design.layers.layer_mm:g} mm at its place on the bed; was it sliced from this design?"
        )
    return _of_lines(design, lines, CONVENTIONS, slicer)


def nominal(design: Design, paths: "Paths", slicer: str = "", centre_mm: Point | None = None) -> Printed:
    """A slicer's G-code by the first convention alone: for its volumes and layers, sooner than :func:`body`.

    Parameters
    ----------
    design, paths, slicer, centre_mm : Design, Paths, str, (float, float)
        As of :func:`body`; here a file that prints nothing of the design is no error.
    """
    from sensorgen.asprinted.beads import CONVENTIONS, beads

    return _of_lines(design, beads(design, paths, centre_mm), CONVENTIONS[:1], slicer)


def _of_lines(design: Design, lines: "Beads", conventions: Sequence[str], slicer: str) -> Printed:
    """A design as some lines print it."""
    from sensorgen.asprinted.beads import layers

    by_convention = {name: layers(design, lines, name) for name in conventions}
    return Printed(design, f"printed, {slicer or 'from G-code'}", by_convention, lines)


def cell(
    design: Design, layers: Sequence[LayerRegions], bodies: Sequence[Body], plan: Window, aside_mm: float = SHIFT_MM
) -> PrintCell:  # fmt: skip
    """The unit cell of printed layers.

    Parameters
    ----------
    design : Design
        As drawn.
    layers : sequence of LayerRegions
        Its whole print.
    bodies : sequence of Body
        Whose regions they hold.
    plan : Window
        The drawing's.
    aside_mm : float
        By which a strip may lie aside of its place; of an estimate none does [mm].
    """
    scene = design.printed
    inside = cut(layers, plan, {body.name for body in bodies if body.is_support()})
    crossed = all(side < whole for side, whole in zip(plan.sides_mm(), scene.size_mm[:2], strict=True))
    if not any(plan.repeats):
        inside = joined(evened(inside, plan, np.inf if crossed else aside_mm), plan)
    like = replace(scene, bodies=tuple(bodies), size_mm=(*plan.sides_mm(), scene.size_mm[2]), repeats=plan.repeats)
    scene_here = scene_of(inside, like)
    if design.orientation == "upside-down":
        scene_here = scene_here.turned_over()
    smaller = scene_here.stretched(1.0 - design.shrinkage) if design.shrinkage else scene_here
    return PrintCell(smaller, scene.size_mm[0] * scene.size_mm[1] / plan.area_mm2())


def gap_mm(scene: Scene) -> float:
    """Smallest distance of two electrodes in a scene of upright prisms; infinite where there are no two [mm]."""
    plans, spans = defaultdict[str, list[shapely.Polygon]](list), defaultdict[str, list[Point]](list)
    for end, p in ((b.terminal, p) for b in scene.bodies if b.terminal not in ("", FLOATING) for p in b.pieces):
        plans[end].append(shapely.Polygon(seen_from_above(p)))
        spans[end].append(p.span("z"))
    apart = [np.inf]
    for one, other in combinations(plans, 2):
        low, high = (np.array(spans[end]) for end in (one, other))
        height = np.maximum(low[:, None, 0] - high[:, 1], high[:, 0] - low[:, None, 1]).clip(0.0)
        apart.append(np.hypot(shapely.distance(np.array(plans[one])[:, None], plans[other]), height).min())
    return float(np.round(min(apart), 9))


def drawn_gap_mm(design: Design) -> float:
    """Smallest distance of the electrodes as drawn, exact [mm]."""
    scene = design.in_use
    return round(meshes.electrode_gap_mm(scene, {b.name: meshes.mesh(b) for b in scene.bodies}), 9)
