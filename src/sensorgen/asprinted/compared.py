"""A design as drawn beside the same as printed: electrode gap, capacitance, electrode resistance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import ceil

import numpy as np
from numpy.typing import NDArray

from sensorgen.asprinted import estimate
from sensorgen.asprinted.beads import CONVENTIONS, Beads, beads
from sensorgen.asprinted.beads import layers as printed_layers
from sensorgen.asprinted.rectilinear import plate
from sensorgen.asprinted.strips import Strips, drawn, scene_of
from sensorgen.asprinted.tally import Row, findings, tally
from sensorgen.asprinted.window import cut, evened, window
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.core.findings import Finding
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.values import permittivities
from sensorgen.export.gcode.paths import Paths
from sensorgen.models import traxels
from sensorgen.prediction import capacitance as planner
from sensorgen.scene.geometry import meshes, validity
from sensorgen.scene.scene import Scene
from sensorgen.solvers.network.nodes import Lines

ACCURACY = 0.02  # of the capacitance: the conventions for a line's width differ by more
CONTACTS_OHM_M2 = (0.0, 1e-6, 1e-5, 1e-4)  # no source gives the contact resistivity of printed eTPU
DEGREES = 45.0  # direction of PrusaSlicer's infill in our profiles, turned by 90 from layer to layer
_CLAMP_LINES = 2.6  # the contacts hold what lies nearer to an end than this many lines: walls and turns of infill
_JOINED_MM = 1e-4


@dataclass(frozen=True)
class Printed:
    """What is printed of a design.

    Attributes
    ----------
    source : str
        Which slicer says so, or that it is an estimate.
    layers : mapping of str to list of Strips
        Layers, by the convention for a line's width.
    lines : Beads or None
        The lines; None for an estimate.
    """

    source: str
    layers: Mapping[str, Sequence[Strips]]
    lines: Beads | None

    def scene(self, design: Design) -> Scene:
        """The whole print as a scene, as it lies on the bed, by the first convention."""
        return scene_of(self.first(), design.printed)

    def first(self) -> Sequence[Strips]:
        """The layers by the first convention."""
        return next(iter(self.layers.values()))

    def rows(self, design: Design) -> list[Row]:
        """Printed and exact volume per body and layer."""
        return tally(design, self.first(), self.lines)

    def findings(self, design: Design) -> list[Finding]:
        """What rule 7 says of them."""
        return design.waived(findings(self.rows(design), design.printed))


def estimated(design: Design, walls: str = "arachne") -> Printed:
    """What a slicer should make of a design, without one; raises as :func:`sensorgen.asprinted.estimate.layers`."""
    found = estimate.layers(design.printed, design.machine, design.layers, walls)
    return Printed(f"estimate from mid-planes, {walls} walls", {"mid-plane": found}, None)


def sliced(design: Design, paths: Paths, source: str, centre_mm: tuple[float, float] | None = None) -> Printed:
    """What a slicer's G-code makes of a design; raises BadInput where it prints nothing at the design's place."""
    lines = beads(design, paths, centre_mm)
    if not len(lines.number):
        tools = sorted({design.tool(body.material) for body in design.printed.bodies})
        raise BadInput(
            f"no line of {design.name} in this G-code: expected tools {tools} in layers of "
            f"{design.layers.layer_mm:g} mm at its place on the bed; was it sliced from this design?"
        )
    return Printed(source, {name: printed_layers(design, lines, name) for name in CONVENTIONS}, lines)


def cell(design: Design, printed: Sequence[Strips]) -> tuple[Scene, float]:
    """One period of a print as a scene, bottom electrode down, and how many of its plan the sensor has [-]."""
    scene = design.printed
    plan = window(drawn(scene, design.layers), scene)
    layers = cut(printed, plan)
    if all(side < whole for side, whole in zip(plan.sides_mm(), scene.size_mm[:2], strict=True)):
        layers = evened(layers, plan)
    found = scene_of(layers, replace(scene, size_mm=(*plan.sides_mm(), scene.size_mm[2])))
    if design.orientation == "upside-down":
        found = found.turned_over()
    kept = replace(found, bodies=tuple(b for b in found.bodies if not b.is_support()))
    smaller = kept.stretched(1.0 - design.shrinkage) if design.shrinkage else kept
    return smaller, scene.size_mm[0] * scene.size_mm[1] / plan.area_mm2()


def gap_mm(scene: Scene) -> float:
    """Smallest distance of two electrodes in a scene of boxes; infinite where there are no two [mm]."""
    spans: dict[str, list[list[tuple[float, float]]]] = {}
    for body in filter(lambda b: b.terminal, scene.bodies):
        spans.setdefault(body.terminal, []).extend([prism.span(axis) for axis in "xyz"] for prism in body.prisms)
    boxes = [np.array(found) for found in spans.values() if found]
    return min((_apart_mm(one, other) for one, other in combinations(boxes, 2)), default=float("inf"))


def _apart_mm(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Smallest distance of the boxes of two sets, (n, 3, 2) and (m, 3, 2) [mm]."""
    apart = np.maximum(one[:, None, :, 0] - other[None, :, :, 1], other[None, :, :, 0] - one[:, None, :, 1])
    return float(np.round(np.sqrt((apart.clip(0) ** 2).sum(2)).min(), 9))


def drawn_gap_mm(design: Design) -> float:
    """Smallest distance of the electrodes as drawn, exact [mm]."""
    scene = design.in_use
    return round(validity.electrode_gap_mm(scene, {b.name: meshes.mesh(b) for b in scene.bodies}), 9)


def capacitance_f(design: Design, printed: Printed, width: float = ACCURACY) -> dict[str, Interval | str]:
    """Capacitance of the whole sensor, by convention [F]; why there is none where no model can speak of it.

    Parameters
    ----------
    design : Design
        As drawn.
    printed : Printed
        What is printed of it.
    width : float
        How wide the bounds may be, relative to their middle [-].
    """
    permittivity = {t.material: t.value for t in permittivities(design)}
    found: dict[str, Interval | str] = {}
    for name, made in printed.layers.items():
        scene, times = cell(design, made)
        try:
            # Of a print that has shrunk back, as many cells make the sensor.
            found[name] = planner.capacitance(scene, permittivity, width).capacitance_f.times(times)
        except planner.Unpredictable as error:
            found[name] = str(error)
    return found


def resistance_ohm(
    design: Design, printed: Printed, contacts_ohm_m2: Sequence[float] = CONTACTS_OHM_M2
) -> dict[str, list[float]]:
    """Resistance of each electrode from end to end, one for each contact resistivity [ohm].

    Parameters
    ----------
    design : Design
        As drawn.
    printed : Printed
        What is printed of it; without lines, a plate of walls and infill as PrusaSlicer would lay them.
    contacts_ohm_m2 : sequence of float
        Contact resistivities between lines [ohm m2].
    """
    return {
        end: [solid * _ratio(design, printed, end, rho, contact) for contact in contacts_ohm_m2]
        for end, (solid, rho) in solid_ohm(design).items()
    }


def solid_ohm(design: Design) -> dict[str, tuple[float, float]]:
    """Of each electrode rho L / (H W) of its plate alone [ohm], and rho [ohm m].

    Parameters
    ----------
    design : Design
        As drawn.
    """
    p, found = design.params, {}
    for end in ("top", "bottom"):
        material, source = design.slot(f"{end}_electrode")
        rho = material.value("resistivity_ohm_m", source).value
        found[end] = rho * p.length_mm / (p.electrode_mm * p.width_mm) / M_PER_MM, rho
    return found


def _ratio(design: Design, printed: Printed, end: str, rho: float, contact: float) -> float:
    length, width, _ = design.printed.size_mm
    lines = _estimated_lines(design) if printed.lines is None else electrode(design, printed.lines, end)
    clamp = _CLAMP_LINES * design.machine.line_mm()
    if length <= 4 * clamp:
        raise OutOfRange(f"an electrode of {length:g} mm; expected more than {4 * clamp:g} mm to tell its resistance")
    area = design.params.electrode_mm * width * M_PER_MM**2
    reach = (length / 2 - clamp) * M_PER_MM
    return traxels.resistance(lines, rho, contact, (-reach, reach), area).ratio


def _estimated_lines(design: Design) -> Lines:
    length, width, _ = design.printed.size_mm
    count = max(ceil(design.params.electrode_mm / design.layers.layer_mm - 1e-9), 1)
    height = design.params.electrode_mm / count
    line = width / round(width / design.machine.line_mm())
    return plate(length, width, line, height, [DEGREES + 90 * (k % 2) for k in range(count)])


def electrode(design: Design, lines: Beads, end: str) -> Lines:
    """The lines of one electrode, its middle at the origin.

    Parameters
    ----------
    design : Design
        As drawn.
    lines : Beads
        Of the whole sensor.
    end : str
        "top" or "bottom".

    Raises
    ------
    OutOfRange
        None of it is printed.
    """
    mine = [k for k, body in enumerate(design.printed.bodies) if body.terminal == end]
    found = lines.of(np.isin(lines.body, mine))
    if not len(found.number):
        raise OutOfRange(f"no line prints the {end} electrode")
    middle = np.array(design.printed.size_mm[:2]) / 2
    start, stop = ((p - middle) * M_PER_MM for p in (found.start_mm, found.end_mm))
    meets = np.append(False, (np.abs(start[1:] - stop[:-1]) < _JOINED_MM * M_PER_MM).all(1))
    meets[1:] &= found.layer[1:] == found.layer[:-1]
    return Lines(start, stop, found.width_mm * M_PER_MM, found.height_mm * M_PER_MM, found.layer, meets)
