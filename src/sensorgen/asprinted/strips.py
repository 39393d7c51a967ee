"""A layer as strips: what a cut across it shows, and the axis along which it looks the same everywhere."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

from sensorgen.asprinted.intervals import Intervals, united
from sensorgen.checks.slices import Rectangle, Slices, slanted
from sensorgen.core.errors import SensorgenError
from sensorgen.design.printer import Quality
from sensorgen.scene.scene import SLIVER_MM, Body, Prism, Scene, box


class NoStrips(SensorgenError):
    """A layer that no single cut shows in full."""


@dataclass(frozen=True)
class Strips:
    """One layer.

    Attributes
    ----------
    along : str
        Axis of the strips, "x" or "y"; the runs lie on the other one.
    bottom_mm, top_mm : float
        Where the layer starts and ends [mm].
    runs : mapping of str to Intervals
        What each body covers across the strips, by its name [mm].
    """

    along: str
    bottom_mm: float
    top_mm: float
    runs: Mapping[str, Intervals]

    @property
    def across(self) -> str:
        """The axis that the runs lie on."""
        return "x" if self.along == "y" else "y"


@lru_cache(maxsize=16)
def drawn(scene: Scene, quality: Quality) -> tuple[Strips, ...]:
    """Every layer of a scene as a slicer samples it, at mid-height.

    Raises
    ------
    NoStrips
        A layer is slanted in plan, or has strips in both directions.
    """
    heights = quality.boundaries_mm(scene.size_mm[2])
    if any(slanted(p) for b in scene.bodies for p in b.prisms):
        raise _no_strips(1, heights[0], heights[1])
    slices = Slices(scene, quality)
    return tuple(_drawn(scene, slices, k, *between) for k, between in enumerate(pairwise(heights)))


def _drawn(scene: Scene, slices: Slices, layer: int, bottom_mm: float, top_mm: float) -> Strips:
    shown = {body.name: slices.body(body, layer) for body in scene.bodies}
    along = next((axis for axis in "yx" if all(_spans(r, axis, scene) for rs in shown.values() for r in rs)), None)
    if along is None:
        raise _no_strips(layer + 1, bottom_mm, top_mm)
    runs = {name: united(_across(r, along) for r in rs) for name, rs in shown.items() if rs}
    return Strips(along, bottom_mm, top_mm, runs)


def _no_strips(layer: int, bottom_mm: float, top_mm: float) -> NoStrips:
    return NoStrips(
        f"layer {layer}, from {bottom_mm:g} to {top_mm:g} mm, is not made of strips along x or y; expected a "
        "shape that is, as tri, rect or reference: look at the slices themselves"
    )


def _spans(r: Rectangle, along: str, scene: Scene) -> bool:
    start, end = (r.x0, r.x1) if along == "x" else (r.y0, r.y1)
    return start < SLIVER_MM and end > scene.size_mm["xy".index(along)] - SLIVER_MM


def _across(r: Rectangle, along: str) -> tuple[float, float]:
    return (r.y0, r.y1) if along == "x" else (r.x0, r.x1)


def scene_of(layers: Sequence[Strips], like: Scene) -> Scene:
    """Strips as a scene: the bodies of another scene, filled with one box for each run and layer."""
    bodies = tuple(
        Body(body.name, body.material, tuple(_boxes(layers, body.name, like.size_mm)), body.terminal)
        for body in like.bodies
    )
    return Scene(bodies, (*like.size_mm[:2], layers[-1].top_mm if layers else 0.0))


def _boxes(layers: Sequence[Strips], name: str, size_mm: tuple[float, float, float]) -> Iterable[Prism]:
    """One box for each run; equal runs above each other are one box."""
    growing: dict[tuple[str, float, float], tuple[float, float]] = {}
    for layer in layers:
        for a, b in layer.runs.get(name, ()):
            key = (layer.along, a, b)
            bottom, top = growing.get(key, (layer.bottom_mm, layer.bottom_mm))
            if top < layer.bottom_mm - SLIVER_MM:
                yield _box(key, bottom, top, size_mm)
                bottom = layer.bottom_mm
            growing[key] = (bottom, layer.top_mm)
    yield from (_box(key, bottom, top, size_mm) for key, (bottom, top) in growing.items())


def _box(key: tuple[str, float, float], bottom: float, top: float, size_mm: tuple[float, float, float]) -> Prism:
    along, start, end = key
    if along == "y":
        return box(start, end, 0.0, size_mm[1], bottom, top)
    return box(0.0, size_mm[0], start, end, bottom, top)
