"""The printed scene from a slicer's G-code: per layer what each tool really fills.

A layer of strips is cut across, near the middle of the sensor, and what the cut shows is taken along the whole strip.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensorgen.asprinted.intervals import Intervals, distances_mm, length_mm, united, within, without
from sensorgen.asprinted.rules import ROUND
from sensorgen.asprinted.strips import Strips, drawn
from sensorgen.core.errors import UnknownName
from sensorgen.design.design import Design
from sensorgen.export.gcode.paths import Paths
from sensorgen.scene.scene import SLIVER_MM, Point, Scene

CONVENTIONS = ("vol", "deposit", "stadium")
FULL = 0.95  # a plate of which this share is filled has no holes but between rounded lines
_CUTS = (-0.37, -0.2, 0.0, 0.17, 0.41)  # places of the cuts, in shares of a tenth of the sensor, from its middle
_LEVEL_MM = 0.01  # a line belongs to a layer whose top it is this near

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Beads:
    """The lines of one piece, from its corner [mm]; ``body`` counts in the bodies of its scene.

    Attributes
    ----------
    start_mm, end_mm : (n, 2) array
        In plan.
    width_mm, height_mm : (n,) array
        Width that keeps the volume in a rectangle of the layer's height, and that height.
    volume_mm3 : (n,) array
        What the line takes.
    layer, body, tool : (n,) array of int
        Layer from 0, body, and the printer's own number of the tool [-].
    number : (n,) array of int
        Line of the file, from 1 [-].
    """

    start_mm: Floats
    end_mm: Floats
    width_mm: Floats
    height_mm: Floats
    volume_mm3: Floats
    layer: NDArray[np.int64]
    body: NDArray[np.int64]
    tool: NDArray[np.int64]
    number: NDArray[np.int64]

    def of(self, rows: NDArray[np.bool_]) -> "Beads":
        """The lines of a mask."""
        return Beads(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def beads(design: Design, paths: Paths, centre_mm: Point | None = None) -> Beads:
    """The lines that print a design, each given to the body that it belongs to.

    Parameters
    ----------
    design : Design
        That was sliced.
    paths : Paths
        Lines of the file, with the printer's own tool numbers.
    centre_mm : (float, float), optional
        Middle of the piece on the printer's bed [mm]; the middle of the bed if not given.
    """
    scene, machine = design.printed, design.machine
    corner = np.array(centre_mm or machine.bed_centre_mm()) - np.array(scene.size_mm[:2]) / 2
    found = paths.model()
    ends = [p[:, :2] - corner for p in (found.start_mm, found.end_mm)]
    tools = {design.tool(body.material) for body in scene.bodies}
    heights = np.array(design.layers.boundaries_mm(scene.size_mm[2]))
    layer = np.abs(found.end_mm[:, 2, None] - heights[1:]).argmin(1)
    here = np.abs(found.end_mm[:, 2] - heights[1:][layer]) < _LEVEL_MM
    # Lines run half a line inside their body: what touches the piece from outside, as a tab, is half a line away.
    middle, margin = (ends[0] + ends[1]) / 2, machine.line_mm() / 4
    here &= ((middle > -margin) & (middle < np.array(scene.size_mm[:2]) + margin)).all(1)
    here &= np.isin(found.tool, sorted(tools))
    height = np.diff(heights)[layer]
    volume = found.volume_mm3(machine.filament_mm)
    width = volume / (found.length_mm() * height)
    body = _owners(design, scene, found.tool, layer, middle)
    columns = (*ends, width, height, volume, layer, body, found.tool, found.number)
    return Beads(*(c[here] for c in columns))


def _owners(
    design: Design, scene: Scene, tool: NDArray[np.int64], layer: NDArray[np.int64], middle: Floats
) -> NDArray[np.int64]:
    """The body that each line belongs to: of its tool's, the one that is drawn nearest in its layer, or near it."""
    layers = drawn(scene, design.layers)
    owner = np.zeros(len(tool), np.int64)
    for one in {design.tool(body.material) for body in scene.bodies}:
        mine = [k for k, body in enumerate(scene.bodies) if design.tool(body.material) == one]
        for number in np.unique(layer[tool == one]):
            rows = np.flatnonzero((tool == one) & (layer == number))
            shown = _nearest(layers, int(number), {scene.bodies[k].name: k for k in mine})
            axis = "xy".index(layers[number].across)
            away = np.array([distances_mm(runs, middle[rows, axis]) for runs in shown.values()])
            owner[rows] = np.array(list(shown))[away.argmin(0)]
    return owner


def _nearest(layers: Sequence[Strips], number: int, mine: Mapping[str, int]) -> dict[int, Intervals]:
    """What some bodies show in a layer, or in the nearest one that shows any of them."""
    order = sorted(range(len(layers)), key=lambda k: abs(k - number))
    found = ({mine[n]: r for n, r in layers[k].runs.items() if n in mine} for k in order)
    return next(filter(None, found))


def layers(design: Design, lines: Beads, convention: str = "vol", *, electrode_wins: bool = False) -> list[Strips]:
    """What every layer of a print holds.

    Parameters
    ----------
    design : Design
        That was printed.
    lines : Beads
        Its lines.
    convention : str
        How wide a line is: "vol", as a rectangle of its volume; "stadium", at the widest point of a round bead;
        "deposit", lines that overlap pushed apart until their volume has room.
    electrode_wins : bool
        Whether a place that two tools fill goes to the electrode; else to the tool that comes first.

    Raises
    ------
    NoStrips
        A layer is not made of strips along x or y.
    UnknownName
        No such convention.
    """
    if convention not in CONVENTIONS:
        raise UnknownName("convention for a line's width", convention, CONVENTIONS)
    scene = design.printed
    plan = drawn(scene, design.layers)
    return [
        _printed(layer, scene, lines.of(lines.layer == k), convention, electrode_wins=electrode_wins)
        for k, layer in enumerate(plan)
    ]


def _printed(layer: Strips, scene: Scene, lines: Beads, convention: str, *, electrode_wins: bool) -> Strips:
    axis = "xy".index(layer.across)
    end, long = scene.size_mm[axis], scene.size_mm[1 - axis]
    runs: dict[str, Intervals] = {}
    taken: Intervals = ()
    for k in _order(scene, lines, electrode_wins=electrode_wins):
        name, mine = scene.bodies[k].name, lines.of(lines.body == k)
        seen = [_cut(mine, axis, long / 2 + share * long / 10, convention) for share in _CUTS]
        filled = sorted(seen, key=length_mm)[len(seen) // 2]
        filled = _whole(within(filled, 0.0, end), layer.runs.get(name, ()), end)
        runs[name] = without(filled, taken)
        taken = united((*taken, *runs[name]))
    return Strips(layer.along, layer.bottom_mm, layer.top_mm, {n: found for n, found in runs.items() if found})


def _order(scene: Scene, lines: Beads, *, electrode_wins: bool) -> list[int]:
    """The bodies of a layer as they are printed, tool by tool."""
    here = np.unique(lines.body).tolist()
    first = {k: lines.number[lines.tool == lines.tool[lines.body == k][0]].min() for k in here}
    return sorted(here, key=lambda k: (electrode_wins and not scene.bodies[k].terminal, first[k], k))


def _whole(filled: Intervals, plan: Intervals, end: float) -> Intervals:
    """A plate that is all but full is full: its lines touch below their rounded edges."""
    is_plate = len(plan) == 1 and plan[0][1] - plan[0][0] > end - SLIVER_MM
    return plan if is_plate and length_mm(filled) > FULL * end else filled


def _cut(lines: Beads, axis: int, at_mm: float, convention: str) -> Intervals:
    """What a cut square to the strips meets, along one axis [mm]."""
    low, high = _met(lines, axis, at_mm, ROUND * lines.height_mm if convention == "stadium" else 0.0 * lines.height_mm)
    hit = high > low
    runs = united(zip(low[hit].tolist(), high[hit].tolist(), strict=True))
    if convention != "deposit":
        return runs
    lines_here = np.column_stack([low[hit], high[hit]])
    return united(_pushed(run, lines_here) for run in runs)


def _met(lines: Beads, axis: int, at_mm: float, wider: Floats) -> tuple[Floats, Floats]:
    """Where each line's rectangle, half a width longer at both ends, meets the cut; nothing where low is above high."""
    middle, way = (lines.start_mm + lines.end_mm) / 2, lines.end_mm - lines.start_mm
    length = np.hypot(*way.T)
    t = way / length[:, None]
    low, high = np.full(len(length), -np.inf), np.full(len(length), np.inf)
    off = at_mm - middle[:, 1 - axis]
    for u, v, half in (
        (t[:, axis], t[:, 1 - axis], (length + lines.width_mm) / 2),
        (t[:, 1 - axis], -t[:, axis], (lines.width_mm + wider) / 2),
    ):
        level = np.abs(u) < 1e-9
        slope = np.where(level, 1.0, u)
        a, b = (-half - v * off) / slope, (half - v * off) / slope
        outside = np.abs(v * off) > half
        low = np.where(level, np.where(outside, np.inf, low), np.maximum(low, np.minimum(a, b)))
        high = np.where(level, np.where(outside, -np.inf, high), np.minimum(high, np.maximum(a, b)))
    return middle[:, axis] + low, middle[:, axis] + high


def _pushed(run: Point, lines: Floats) -> Point:
    """A run of lines, as wide as all of them side by side."""
    inside = (lines[:, 0] >= run[0] - SLIVER_MM) & (lines[:, 1] <= run[1] + SLIVER_MM)
    more = max(float((lines[inside, 1] - lines[inside, 0]).sum()) - (run[1] - run[0]), 0.0) / 2
    return run[0] - more, run[1] + more
