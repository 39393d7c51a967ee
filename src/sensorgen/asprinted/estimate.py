"""The printed scene without a slicer: every layer's mid-plane, each strip as wide as its slicer would print it.

Tests hold it against the real slicers: capacitance within 2 % of PrusaSlicer's, 7 % of CuraEngine's.
"""

from sensorgen.asprinted.intervals import Intervals, united, within, without
from sensorgen.asprinted.rules import Rule, rule
from sensorgen.asprinted.strips import Strips, drawn, scene_of
from sensorgen.design.printer import Printer, Quality
from sensorgen.scene.scene import SLIVER_MM, Body, Scene


def estimate(scene: Scene, printer: Printer, quality: Quality, walls: str = "arachne") -> Scene:
    """What gets printed of a scene, in boxes.

    Parameters
    ----------
    scene : Scene
        As it lies on the bed.
    printer, quality : Printer, Quality
        What prints it.
    walls : str
        "arachne", "classic", "cura" or "cura-gaps".

    Returns
    -------
    Scene
        The same bodies in whole layers; what is lost is air. A strip that reaches from edge to edge stays whole.

    Raises
    ------
    NoStrips
        A layer is not made of strips along x or y.
    UnknownName
        No such way of walls.

    Notes
    -----
    Where two bodies swell into each other the electrode keeps the place, and support gives it up. Nothing
    sags: gaps are upper limits.
    """
    return scene_of(layers(scene, printer, quality, walls), scene)


def layers(scene: Scene, printer: Printer, quality: Quality, walls: str = "arachne") -> list[Strips]:
    """The layers of :func:`estimate`."""
    wide = rule(walls)
    return [_printed(layer, scene, printer, wide) for layer in drawn(scene, quality)]


def _printed(layer: Strips, scene: Scene, printer: Printer, wide: Rule) -> Strips:
    end = scene.size_mm["xy".index(layer.across)]
    runs: dict[str, Intervals] = {}
    taken: Intervals = ()
    for body in sorted(scene.bodies, key=_order):
        swollen = united(
            _widened(a, b, wide(b - a, layer.top_mm - layer.bottom_mm, printer)) if b - a < end - SLIVER_MM else (a, b)
            for a, b in layer.runs.get(body.name, ())
        )
        runs[body.name] = without(within(swollen, 0.0, end), taken)
        taken = united((*taken, *runs[body.name]))
    return Strips(layer.along, layer.bottom_mm, layer.top_mm, {name: found for name, found in runs.items() if found})


def _order(body: Body) -> tuple[bool, bool]:
    """Electrodes first and support last, as their tools are."""
    return body.is_support(), not body.terminal


def _widened(start: float, end: float, width: float) -> tuple[float, float]:
    middle = (start + end) / 2
    return middle - width / 2, middle + width / 2
