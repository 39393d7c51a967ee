"""Estimate of a print without a slicer: each layer at mid-height, each part as wide as the slicer's walls print it.

The rules were found by slicing with PrusaSlicer 2.5 (Arachne and classic walls) and CuraEngine 4.13, nozzle 0.4 mm;
they scale with the nozzle. Capacitance of the estimate: within 2 % of PrusaSlicer's G-code, 7 % of CuraEngine's.
"""

from collections.abc import Callable, Sequence
from functools import partial
from math import pi

import numpy as np
import shapely

from sensorgen.checks.widths import SWELLS, VANISHES
from sensorgen.core.errors import UnknownName
from sensorgen.design.printer import Printer, Quality
from sensorgen.scene.layers import LayerRegions, Region, cleaned, drawn, narrow_mm, parts, united
from sensorgen.scene.scene import SLIVER_MM, Body, Scene

ROUND = 1 - pi / 4  # a bead's rounded sides take this share of its height from its width


def arachne(width_mm: float, layer_mm: float, printer: Printer) -> float:
    """Variable lines: the narrowest vanish, narrow ones swell, the rest is a rounding narrower [mm]."""
    if width_mm < VANISHES * printer.nozzle_mm - SLIVER_MM:
        return 0.0
    swells = SWELLS * printer.nozzle_mm
    return swells if width_mm < swells else width_mm - ROUND * layer_mm


def classic(width_mm: float, layer_mm: float, printer: Printer) -> float:
    """Lines of one width: what no whole line fits vanishes [mm]."""
    return 0.0 if width_mm < printer.line_mm() - SLIVER_MM else width_mm - ROUND * layer_mm


def cura(width_mm: float, layer_mm: float, printer: Printer) -> float:  # noqa: ARG001 - every rule is called alike
    """Cura's walls: what no whole line fits vanishes, the rest keeps its width [mm]."""
    return 0.0 if width_mm < printer.line_mm() - SLIVER_MM else width_mm


def cura_gaps(width_mm: float, layer_mm: float, printer: Printer) -> float:  # noqa: ARG001
    """Cura with ``fill_outline_gaps``: nothing vanishes [mm]."""
    return width_mm


Rule = Callable[[float, float, Printer], float]
RULES: dict[str, Rule] = {"arachne": arachne, "classic": classic, "cura": cura, "cura-gaps": cura_gaps}


def layers(scene: Scene, printer: Printer, quality: Quality, walls: str = "arachne") -> list[LayerRegions]:
    """What gets printed of every layer.

    Parameters
    ----------
    scene : Scene
        As it lies on the bed.
    printer, quality : Printer, Quality
        What prints it.
    walls : str
        One of ``RULES``.

    Raises
    ------
    UnknownName
        No such walls.

    Notes
    -----
    The width of a part is the smaller side of the smallest rectangle around it. A strip from edge to edge of the sensor
    keeps its length, a plate stays whole. Where two bodies swell into each other the electrode keeps the place, and
    support gives it up. Nothing sags: gaps are upper limits.
    """
    if walls not in RULES:
        raise UnknownName("walls", walls, RULES)
    wide = RULES[walls]
    return [_printed(layer, scene, printer, wide) for layer in drawn(scene, quality.boundaries_mm(scene.size_mm[2]))]


def _printed(layer: LayerRegions, scene: Scene, printer: Printer, wide: Rule) -> LayerRegions:
    length, width, _ = scene.size_mm
    regions: dict[str, Region] = {}
    for body in sorted((b for b in scene.bodies if b.name in layer.regions), key=_order):
        found = _widened(layer, body.name, length * width, partial(_width, wide, layer.height_mm, printer))
        widened = shapely.clip_by_rect(found, 0.0, 0.0, length, width)
        others = shapely.union_all(list(regions.values()))
        regions[body.name] = cleaned(shapely.difference(united(widened), others))
    return layer.mapped(regions)


def _width(wide: Rule, layer_mm: float, printer: Printer, width_mm: float) -> float:
    return wide(width_mm, layer_mm, printer)


def _order(body: Body) -> tuple[bool, bool]:
    """Electrodes first and support last, as their tools are."""
    return body.is_support(), not body.terminal


def _widened(layer: LayerRegions, body: str, plan_mm2: float, wide: Callable[[float], float]) -> Sequence[Region]:
    """The parts of a body in a layer as their walls print them."""
    found = parts(layer.region(body))
    if not found or found[0].area > plan_mm2 * (1 - SLIVER_MM):
        return found
    bounds = shapely.bounds(found)
    across = {"y": bounds[:, 2] - bounds[:, 0], "x": bounds[:, 3] - bounds[:, 1]}
    width = across[layer.along] if layer.along else np.array([narrow_mm(part) for part in found])
    printed = np.array([wide(w) for w in width.tolist()])
    more = (printed - width)[:, None] / 2
    if layer.along:
        sides = np.array([-1, 0, 1, 0] if layer.along == "y" else [0, -1, 0, 1])
        swollen = shapely.box(*(bounds + more * sides).T)
    else:
        swollen = shapely.buffer(found, more[:, 0], join_style="mitre")
    return list(swollen[printed > 0])
