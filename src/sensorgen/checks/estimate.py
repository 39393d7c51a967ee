"""Estimate of a print without a slicer: each layer at mid-height, each part as wide as the slicer's walls print it.

The rules were found by slicing with PrusaSlicer 2.5 (Arachne and classic walls) and CuraEngine 4.13, nozzle 0.4 mm;
they scale with the nozzle. Capacitance of the estimate: within 2 % of PrusaSlicer's G-code, 7 % of CuraEngine's.
"""

from collections.abc import Callable, Mapping, Sequence
from math import pi

import numpy as np
import shapely

from sensorgen.checks.widths import SWELLS, VANISHES
from sensorgen.core.errors import UnknownName
from sensorgen.design.printer import Printer, Quality
from sensorgen.scene.layers import LayerRegions, Region, cleaned, drawn, narrow_mm, parts, united
from sensorgen.scene.scene import SLIVER_MM, Scene

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
    found: list[LayerRegions] = []
    known: dict[object, Mapping[str, Region]] = {}  # of equal layers, which share their regions
    for layer in drawn(scene, quality.boundaries_mm(scene.size_mm[2])):
        key = round(layer.height_mm, 12), *((name, id(region)) for name, region in layer.regions.items())
        if key not in known:
            known[key] = _printed(layer, scene, printer, RULES[walls])
        found.append(layer.mapped(known[key]))
    return found


def _printed(layer: LayerRegions, scene: Scene, printer: Printer, wide: Rule) -> dict[str, Region]:
    """What the walls make of one layer; a place that two bodies swell into goes to the one that is printed first."""
    length, width, _ = scene.size_mm
    regions: dict[str, Region] = {}
    # Electrodes first and support last, as their tools are.
    for body in sorted(scene.bodies, key=lambda b: (b.is_support(), not b.terminal)):
        if body.name in layer.regions:
            swollen = _widened(layer, body.name, length * width, printer, wide)
            inside = shapely.clip_by_rect(swollen, 0.0, 0.0, length, width)
            found, others = united(inside), shapely.get_parts(list(regions.values()))
            met = np.unique(shapely.STRtree(others).query(inside, predicate="intersects")[1])
            free = shapely.difference(found, shapely.union_all(others[met])) if met.size else found
            regions[body.name] = cleaned(free)
    return regions


def _widened(layer: LayerRegions, body: str, plan_mm2: float, printer: Printer, wide: Rule) -> Sequence[Region]:
    """The parts of a body in a layer as their walls print them."""
    found = parts(layer.region(body))
    if not found or found[0].area > plan_mm2 * (1 - SLIVER_MM):
        return found
    bounds = shapely.bounds(found)
    across = {"y": bounds[:, 2] - bounds[:, 0], "x": bounds[:, 3] - bounds[:, 1]}
    width = across[layer.along] if layer.along else narrow_mm(found)
    printed = np.array([wide(w, layer.height_mm, printer) for w in width.tolist()])
    more = (printed - width)[:, None] / 2
    if layer.along:
        sides = np.array([-1, 0, 1, 0] if layer.along == "y" else [0, -1, 0, 1])
        swollen = shapely.box(*(bounds + more * sides).T)
    else:
        swollen = shapely.buffer(found, more[:, 0], join_style="mitre")
    return list(swollen[printed > 0])
