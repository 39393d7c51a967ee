"""The piece of a printed scene that stands for all of it: one period of the drawing, from its middle.

G-code is rounded to a micrometre, so that no printed period repeats another exactly: a model that looks for mirrors
would have to solve the whole sensor. The drawing's mirrors say where a period starts and ends.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from sensorgen.asprinted.intervals import Intervals, within
from sensorgen.asprinted.strips import Strips
from sensorgen.scene.scene import SLIVER_MM, Point, Scene
from sensorgen.scene.unit_cell import Band, Slice, mirrored

ROUNDED_MM = 2e-3  # edges nearer than this are one: G-code has three decimals


@dataclass(frozen=True)
class Window:
    """A rectangle in plan [mm]."""

    x_mm: Point
    y_mm: Point

    def sides_mm(self) -> Point:
        """Its lengths along x and y [mm]."""
        return self.x_mm[1] - self.x_mm[0], self.y_mm[1] - self.y_mm[0]

    def area_mm2(self) -> float:
        """Its area [mm2]."""
        x, y = self.sides_mm()
        return x * y

    def of(self, axis: str) -> Point:
        """Where it starts and ends on an axis [mm]."""
        return self.x_mm if axis == "x" else self.y_mm


def window(layers: Sequence[Strips], scene: Scene) -> Window:
    """One period of a drawing near its middle, along x and y.

    It starts and ends where least conducts in the patterned layers, so that a cog that is printed lopsided is whole.
    Along an axis without a pattern that repeats it is the whole sensor.

    Parameters
    ----------
    layers : sequence of Strips
        The drawing's layers.
    scene : Scene
        The drawing.
    """
    conducting = {body.name for body in scene.bodies if body.terminal}
    x, y = (
        _period([layer for layer in layers if layer.across == axis], conducting, scene.size_mm["xy".index(axis)])
        for axis in "xy"
    )
    return Window(x, y)


def _period(layers: Sequence[Strips], conducting: set[str], end: float) -> Point:
    piece = mirrored(list(_columns(layers, end))).slices
    low, width = piece[0].left_mm, piece[-1].right_mm - piece[0].left_mm
    middle = int((end / 2 - low) // width)
    starts = [low + k * width for k in range(middle - 3, middle + 3)]
    inside = [s for s in starts if s > -SLIVER_MM and s + 2 * width < end + SLIVER_MM]
    if not inside:
        return 0.0, end
    start = min(inside, key=lambda s: (_conductors(layers, conducting, s), abs(s + width - end / 2)))
    return start, start + 2 * width


def _columns(layers: Sequence[Strips], end: float) -> Iterable[Slice]:
    """The pattern as a walk across the strips meets it: one level band, named by all that stands on a place."""
    edges = {edge for layer in layers for runs in layer.runs.values() for run in runs for edge in run}
    looks: dict[tuple[object, ...], str] = {}
    for start, stop in pairwise(sorted({0.0, end} | edges)):
        if stop - start > SLIVER_MM:
            here = tuple(_there(layer, (start + stop) / 2) for layer in layers)
            name = looks.setdefault(here, str(len(looks)))
            yield Slice(start, stop, (Band(name, "", (0.0, 0.0), (1.0, 1.0)),))


def _there(layer: Strips, place: float) -> frozenset[str]:
    """Names of the bodies at a place."""
    return frozenset(name for name, runs in layer.runs.items() if any(a < place < b for a, b in runs))


def _conductors(layers: Sequence[Strips], conducting: set[str], place: float) -> int:
    """How many layers conduct at a place or beside it [-]."""
    return sum(
        any(a - SLIVER_MM < place < b + SLIVER_MM for a, b in layer.runs.get(name, ()))
        for layer in layers
        for name in conducting
    )


def cut(layers: Sequence[Strips], to: Window) -> list[Strips]:
    """The part of some layers within a window, moved to the origin, with edges that rounding parted made one [mm]."""
    found = [_cut(layer, *to.of(layer.across)) for layer in layers]
    places = {axis: _snapped(found, axis, side) for axis, side in zip("xy", to.sides_mm(), strict=True)}
    return [replace(layer, runs=_moved(layer, places[layer.across])) for layer in found]


def evened(layers: Sequence[Strips], to: Window) -> list[Strips]:
    """Layers of a window with each run as far to one side as its mirror image is to the other [mm].

    For crossed strips, whose lopsided cell would take sixteen times the bricks. Widths stay; a strip that is printed a
    little aside moves to its place, which changes the field in second order.
    """
    sides = dict(zip("xy", to.sides_mm(), strict=True))
    return [
        replace(layer, runs={name: _evened(runs, sides[layer.across]) for name, runs in layer.runs.items()})
        for layer in layers
    ]


def _evened(runs: Intervals, side: float) -> Intervals:
    mirrored_runs = [(side - b, side - a) for a, b in reversed(runs)]
    return tuple(
        (round((a + c) / 2, 6), round((b + d) / 2, 6)) for (a, b), (c, d) in zip(runs, mirrored_runs, strict=True)
    )


def _cut(layer: Strips, low: float, high: float) -> Strips:
    runs = {name: within(old, low, high) for name, old in layer.runs.items()}
    return replace(layer, runs={n: tuple((a - low, b - low) for a, b in new) for n, new in runs.items() if new})


def _snapped(layers: Sequence[Strips], axis: str, side: float) -> dict[float, float]:
    """Where each edge across an axis goes: to the middle of those that rounding parted, or to the window's side."""
    edges = sorted({e for layer in layers if layer.across == axis for rs in layer.runs.values() for r in rs for e in r})
    groups: list[list[float]] = []
    for edge in edges:
        if groups and edge - groups[-1][-1] < ROUNDED_MM:
            groups[-1].append(edge)
        else:
            groups.append([edge])
    return {edge: _place(group, side) for group in groups for edge in group}


def _place(group: Sequence[float], side: float) -> float:
    if group[0] < ROUNDED_MM:
        return 0.0
    return side if group[-1] > side - ROUNDED_MM else round(sum(group) / len(group), 6)


def _moved(layer: Strips, places: dict[float, float]) -> dict[str, tuple[Point, ...]]:
    runs = {n: tuple((places[a], places[b]) for a, b in rs) for n, rs in layer.runs.items()}
    return {name: tuple(run for run in found if run[1] > run[0]) for name, found in runs.items()}
