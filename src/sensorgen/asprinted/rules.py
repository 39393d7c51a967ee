"""How wide a slicer prints what is narrow: one rule for each way of walls, found by slicing.

PrusaSlicer 2.5 (Arachne and classic walls) and CuraEngine 4.13, nozzle 0.4 mm; the limits scale with the nozzle.
"""

from collections.abc import Callable
from math import pi

from sensorgen.checks.widths import SWELLS, VANISHES
from sensorgen.core.errors import UnknownName
from sensorgen.design.printer import Printer
from sensorgen.scene.scene import SLIVER_MM

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


def rule(walls: str) -> Rule:
    """The rule for a way of walls; raises UnknownName with the nearest one."""
    if walls not in RULES:
        raise UnknownName("way of walls", walls, RULES)
    return RULES[walls]
