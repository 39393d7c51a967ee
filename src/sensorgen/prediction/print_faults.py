"""Verdicts on a print that one fault of it alone leads to, by the rules of the checks."""

import shapely

from sensorgen.checks import estimate, volumes
from sensorgen.checks.review import review
from sensorgen.design.design import Design
from sensorgen.design.walls import rule, rules
from sensorgen.scene.layers import drawn, united

CHANGE, PRINT = "CHANGE", "PRINT"


def by_walls(design: Design) -> str:
    """Verdict with the walls of other slicers: CHANGE where they lose a body, PRINT where these alone do; else ""."""
    own, others = rule("prusa", design.walls), rules(design.profile.walls)
    lost = {walls: _loses(design, walls) for walls in dict.fromkeys((own, *others))}
    if not lost[own]:
        return CHANGE if any(lost.values()) else ""
    return PRINT if any(not lost[w] and review(design, walls=w).verdict != CHANGE for w in lost) else ""


def _loses(design: Design, walls: str) -> bool:
    """Test whether a body is not printed at all in some layer, which the design does not waive."""
    scene = design.printed
    layers = estimate.layers(scene, design.machine, design.layers, walls, estimate.lines(design))
    found = design.waived(volumes.findings(volumes.rows(scene, layers), scene))
    return any(f.severity == "error" and not f.waiver for f in found)


def by_first_layer(design: Design, thinner_mm: float) -> str:
    """Verdict with a first layer thinner by a length [mm]: CHANGE where none is left, or electrodes in it touch.

    A line keeps its area, so that its sides move out by w t / (2 (h - t)); within an electrode they have no room.
    """
    scene, quality = design.printed, design.layers
    first = drawn(scene, quality.boundaries_mm(scene.size_mm[2]))[0]
    left_mm = first.height_mm - thinner_mm
    if left_mm <= 0:
        return CHANGE
    aside_mm = design.machine.line_mm() * thinner_mm / (2 * left_mm)
    ends = {b.terminal: [first.region(c.name) for c in scene.bodies if c.terminal == b.terminal] for b in scene.bodies}
    spread = [shapely.buffer(united(parts), aside_mm) for terminal, parts in ends.items() if terminal]
    area_mm2 = sum(region.area for region in spread) - shapely.union_all(spread).area
    return CHANGE if area_mm2 > 1e-9 else ""
