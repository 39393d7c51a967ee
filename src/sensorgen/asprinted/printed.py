"""A design as printed: its layers, estimated or from G-code, as a scene with electrode gap, volumes and lost parts."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import shapely

from sensorgen.checks import estimate, volumes
from sensorgen.checks.volumes import LayerVolume
from sensorgen.core.errors import BadInput
from sensorgen.core.findings import Finding
from sensorgen.design.design import Design
from sensorgen.design.walls import WALLS
from sensorgen.scene.geometry import meshes
from sensorgen.scene.layers import LayerRegions, drawn, scene_of
from sensorgen.scene.scene import FLOATING, Body, Point, Scene, seen_from_above

if TYPE_CHECKING:
    from sensorgen.asprinted.beads import Beads
    from sensorgen.asprinted.window import Window
    from sensorgen.export.gcode.paths import Paths
    from sensorgen.scene.connections import Connected


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
    """

    design: Design
    provenance: str
    layers: Mapping[str, Sequence[LayerRegions]]
    lines: "Beads | None" = None

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
        from sensorgen.asprinted.window import Window, inside, window
        from sensorgen.scene.slabs import is_open

        whole = self.design.unbordered.printed
        boundaries = self.design.layers.boundaries_mm(whole.size_mm[2])
        fringe = is_open(self.design.unbordered.in_use)  # is part of the capacitance
        plan = Window((0.0, whole.size_mm[0]), (0.0, whole.size_mm[1])) if fringe else window(whole, boundaries)
        if self.design.border:
            plan = inside(plan, whole, drawn(self.design.printed, boundaries))
        return {name: cell(self.design, own.layers, own.bodies, plan) for name, own in self._connected.items()}

    @cached_property
    def _connected(self) -> "dict[str, Connected]":
        """The layers by every convention, each conductor at the terminal that it touches."""
        from sensorgen.scene.connections import connected_layers

        bodies, conducts = self.design.printed.bodies, self.design.conducts
        return {name: connected_layers(layers, bodies, conducts) for name, layers in self.layers.items()}

    def remarks(self) -> dict[str, tuple[str, ...]]:
        """By every convention, where electrodes touch, and how many pieces of conductor float."""
        return {name: connected.remarks() for name, connected in self._connected.items()}

    @property
    def cell(self) -> PrintCell:
        """The unit cell by the first convention."""
        return next(iter(self.cells.values()))

    @property
    def gap_mm(self) -> Point:
        """Smallest and largest electrode gap of the conventions [mm]."""
        gaps = [gap_mm(cell.scene) for cell in self.cells.values()]
        return min(gaps), max(gaps)

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
        return self.design.waived([*volumes.findings(self.rows, self.design.printed), *shorts])


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
    from sensorgen.asprinted.beads import layers as printed_layers

    lines = beads(design, paths, centre_mm)
    if not len(lines.number):
        tools = sorted({design.tool(body.material) for body in design.printed.bodies})
        raise BadInput(
            f"no line of {design.name} in this G-code: expected tools {tools} in layers of "
            f"{design.layers.layer_mm:g} mm at its place on the bed; was it sliced from this design?"
        )
    by_convention = {name: printed_layers(design, lines, name) for name in CONVENTIONS}
    return Printed(design, f"printed, {slicer or 'from G-code'}", by_convention, lines)


def nominal(design: Design, paths: "Paths", slicer: str = "", centre_mm: Point | None = None) -> Printed:
    """A slicer's G-code by the first convention alone: for its volumes and layers, sooner than :func:`body`.

    Parameters
    ----------
    design, paths, slicer, centre_mm : Design, Paths, str, (float, float)
        As of :func:`body`; here a file that prints nothing of the design is no error.
    """
    from sensorgen.asprinted.beads import CONVENTIONS, beads
    from sensorgen.asprinted.beads import layers as printed_layers

    lines, first = beads(design, paths, centre_mm), CONVENTIONS[0]
    provenance = f"printed, {slicer or 'from G-code'}"
    return Printed(design, provenance, {first: printed_layers(design, lines, first)}, lines)


def cell(design: Design, layers: Sequence[LayerRegions], bodies: Sequence[Body], plan: "Window") -> PrintCell:
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
    """
    from sensorgen.asprinted.window import ROUNDED_MM, cut, evened

    scene = design.printed
    inside = cut(layers, plan)
    crossed = all(side < whole for side, whole in zip(plan.sides_mm(), scene.size_mm[:2], strict=True))
    if not any(plan.repeats):
        inside = evened(inside, plan) if crossed else evened(inside, plan, ROUNDED_MM)
    like = replace(scene, bodies=tuple(bodies), size_mm=(*plan.sides_mm(), scene.size_mm[2]), repeats=plan.repeats)
    scene_here = scene_of(inside, like)
    if design.orientation == "upside-down":
        scene_here = scene_here.turned_over()
    in_use = replace(scene_here, bodies=tuple(b for b in scene_here.bodies if not b.is_support()))
    smaller = in_use.stretched(1.0 - design.shrinkage) if design.shrinkage else in_use
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
