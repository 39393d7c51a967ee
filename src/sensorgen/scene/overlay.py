"""What lies over what: the pieces of a scene in which all layers are the same, be they seen from a side or from above.

Scenes of one extrusion, or of boxes, fall into columns of their cross-sections. Upright prisms of any outline, as round
or octagonal pillars, are laid over each other in plan: strips between neighbouring corners and crossings, in each of
which no two edges cross, and trapezoids between neighbouring edges. All of it is exact to rounding.
"""

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from sensorgen.scene.scene import Body, Outline, Point, Prism, Scene, rectangle
from sensorgen.scene.sections import ROUNDING_MM, Column, Layer, alike, columns, sections

_OUTSIDE = -1  # number of the sensor's own edge among the outlines


@dataclass(frozen=True)
class Part:
    """Columns side by side.

    Attributes
    ----------
    depth_mm : float
        Of all columns [mm].
    columns : tuple of Column
        From left to right in a cross-section; in plan in no order, each 1 mm deep and as wide as that makes its area.
    looks : tuple of int
        Of each column, the number of the first that looks like it.
    in_plan : bool
        Whether they come from a plan.
    """

    depth_mm: float
    columns: tuple[Column, ...]
    looks: tuple[int, ...]
    in_plan: bool = False


def parts(scene: Scene) -> list[Part]:
    """The parts that together are the scene.

    Raises
    ------
    ValueError
        Outlines overlap in plan, or are slanted both in plan and in elevation.
    """
    if all(p.axis != "z" or p.is_box() for body in scene.bodies for p in body.prisms):
        return [Part(s.depth_mm, tuple(columns(s)), tuple(alike(s))) for s in sections(scene)]
    found = _patches(scene)
    return [Part(1.0, found, tuple(range(len(found))), in_plan=True)]


@dataclass(frozen=True)
class _Edge:
    """A side of an outline, from left to right, and the number of the prism that it belongs to."""

    start: Point
    end: Point
    prism: int

    def at(self, x_mm: float) -> float:
        (xa, ya), (xb, yb) = self.start, self.end
        return yb if x_mm == xb else ya + (x_mm - xa) / (xb - xa) * (yb - ya)


@dataclass(frozen=True)
class _Strip:
    """What of the plan lies between two lines of constant x; ``lines`` are edges there, as heights left and right."""

    left_mm: float
    right_mm: float
    lines: tuple[tuple[float, float, int], ...]


@lru_cache(maxsize=8)
def _patches(scene: Scene) -> tuple[Column, ...]:
    """Pieces of the plan over which the same layers lie, those of one look as one."""
    prisms = [(body, p) for body in scene.bodies for p in body.prisms]
    slanted = next((body for body, p in prisms if p.axis != "z" and not p.is_box()), None)
    if slanted:
        raise ValueError(f"{slanted.name} is slanted in elevation, other bodies in plan: no column has constant layers")
    numbers: dict[tuple[str, Point], int] = {}
    kinds = [numbers.setdefault((body.name, p.span("z")), len(numbers)) for body, p in prisms]
    first = {kind: prisms[k] for k, kind in reversed(list(enumerate(kinds)))}
    areas: dict[tuple[int, ...], float] = defaultdict(float)
    for strip in _strips(_edges(scene, [p for _, p in prisms])):
        for over, area in _trapezoids(strip):
            areas[tuple(sorted(kinds[k] for k in over))] += area
    return tuple(Column(0.0, area, _layers([first[kind] for kind in look])) for look, area in areas.items())


def _edges(scene: Scene, prisms: Sequence[Prism]) -> list[_Edge]:
    """All sides that are not square to x, of the prisms and of the sensor itself."""
    length, width, _ = scene.size_mm
    outlines = [(_OUTSIDE, rectangle(0.0, length, 0.0, width)), *enumerate(map(_from_above, prisms))]
    return [
        _Edge(min(a, b), max(a, b), number)
        for number, outline in outlines
        for a, b in pairwise((*outline, outline[0]))
        if a[0] != b[0]
    ]


def _from_above(prism: Prism) -> Outline:
    return prism.outline if prism.axis == "z" else rectangle(*prism.span("x"), *prism.span("y"))


def _strips(edges: Sequence[_Edge]) -> Iterator[_Strip]:
    """Strips in which no two edges cross."""
    corners = {x for edge in edges for x in (edge.start[0], edge.end[0])}
    crossings = {x for strip in _between(edges, corners) for x in _crossings(strip)}
    return _between(edges, corners | crossings)


def _between(edges: Sequence[_Edge], places_mm: Iterable[float]) -> Iterator[_Strip]:
    cuts = sorted(places_mm)
    here: list[list[_Edge]] = [[] for _ in cuts[1:]]
    for edge in edges:
        for k in range(bisect_left(cuts, edge.start[0]), bisect_left(cuts, edge.end[0])):
            here[k].append(edge)
    for (left, right), found in zip(pairwise(cuts), here, strict=True):
        if right - left > ROUNDING_MM:
            yield _Strip(left, right, tuple((e.at(left), e.at(right), e.prism) for e in found))


def _crossings(strip: _Strip) -> list[float]:
    """Where edges cross within a strip [mm]."""
    left, right, prism = np.array(sorted(strip.lines)).T
    if (np.diff(right) > -ROUNDING_MM).all():
        return []
    above, below = left - left[:, None], right[:, None] - right
    crossed = (above > ROUNDING_MM) & (below > ROUNDING_MM)
    share = above[crossed] / (above[crossed] + below[crossed])
    if (crossed & (prism == prism[:, None])).any():
        raise ValueError(f"an outline crosses itself near x = {strip.left_mm:g} to {strip.right_mm:g} mm")
    return [float(x) for x in strip.left_mm + share * (strip.right_mm - strip.left_mm)]


def _trapezoids(strip: _Strip) -> Iterator[tuple[set[int], float]]:
    """The prisms over each piece between two neighbouring edges, and its area [mm2]."""
    over: set[int] = set()
    width = strip.right_mm - strip.left_mm
    for below, above in pairwise(sorted(strip.lines, key=lambda line: line[0] + line[1])):
        over ^= {below[2]}
        height = (above[0] + above[1] - below[0] - below[1]) / 2
        if over and height > ROUNDING_MM:
            yield over - {_OUTSIDE}, width * height


def _layers(found: Sequence[tuple[Body, Prism]]) -> tuple[Layer, ...]:
    """Prisms over one place as layers, from bottom to top."""
    spans = sorted(((*p.span("z"), body) for body, p in found), key=lambda span: span[:2])
    for (_, top, lower), (bottom, _, upper) in pairwise(spans):
        if bottom < top - ROUNDING_MM:
            raise ValueError(f"outlines overlap in plan: {lower.name} and {upper.name} at z = {bottom:g} mm")
    return tuple(Layer(body, (low, low), (high, high)) for low, high, body in spans)
