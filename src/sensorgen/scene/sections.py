"""Cross-sections of a scene, and the vertical columns that they are made of."""

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain, pairwise

from sensorgen.scene.scene import Body, Outline, Point, Scene, shadow, sides

ROUNDING_MM = 1e-9  # edges nearer than this are one edge, reached by different sums


@dataclass(frozen=True, eq=False)  # one object for one section: its columns are cut once
class Section:
    """A cross-section that the sensor has over some depth.

    Attributes
    ----------
    across : str
        Axis that the section runs along, "x" or "y"; its outlines are in (across, z).
    depth_mm : float
        Total length over which the sensor looks like this, square to the section [mm].
    at_mm : float
        One place where it does [mm].
    regions : tuple of (Body, Outline)
        What is cut.
    """

    across: str
    depth_mm: float
    at_mm: float
    regions: tuple[tuple[Body, Outline], ...]


def sections(scene: Scene) -> list[Section]:
    """The distinct cross-sections of a scene, with the depth of each; together they are the scene.

    One for shapes of one extrusion, a few for crossed strips.

    Raises
    ------
    ValueError
        Some outline is slanted in plan, or slants run both ways, or a body is no prism: no vertical cut is constant
        over a depth.
    """
    return list(_fewest(scene))


@lru_cache(maxsize=8)
def _fewest(scene: Scene) -> list[Section]:
    every = [_sections(scene, n) for n in "yx" if _is_constant(scene, n)]
    if not every:
        raise ValueError("no direction in which this scene is made of constant cross-sections")
    return min(every, key=len)


def square_to(scene: Scene, normal: str) -> list[Section]:
    """The distinct cross-sections of a scene square to "x" or "y"; none where some piece changes along that axis."""
    return _sections(scene, normal) if _is_constant(scene, normal) else []


def distinct(values: Iterable[float], near: float) -> list[float]:
    """Values in order, without those that are no more than ``near`` above the one before."""
    rising = sorted(values)
    return rising[:1] + [value for before, value in pairwise(rising) if value - before > near]


def _is_constant(scene: Scene, normal: str) -> bool:
    return all(p.is_constant(normal) for _, p in scene.pieces)


def _through(cuts: list[float], spans: list[tuple[float, float]]) -> list[list[int]]:
    """Numbers of the spans that go through each interval between cuts."""
    inside: list[list[int]] = [[] for _ in cuts[1:]]
    for index, (low, high) in enumerate(spans):
        for k in range(bisect_left(cuts, low), bisect_left(cuts, high)):
            inside[k].append(index)
    return inside


def _sections(scene: Scene, normal: str) -> list[Section]:
    across = "x" if normal == "y" else "y"
    pieces = scene.pieces
    spans = [p.span(normal) for _, p in pieces]
    cuts = sorted(set(chain.from_iterable(spans)))
    looks: dict[object, int] = {}
    look = [looks.setdefault((body.name, shadow(p, normal)), len(looks)) for body, p in pieces]
    by_look: dict[tuple[int, ...], tuple[float, float, list[int]]] = {}
    for (low, high), here in zip(pairwise(cuts), _through(cuts, spans), strict=True):
        key = tuple(look[i] for i in here)
        depth, at, members = by_look.get(key, (0.0, (low + high) / 2, here))
        by_look[key] = (depth + high - low, at, members)
    return [
        Section(across, depth, at, tuple((pieces[i][0], o) for i in members for o in pieces[i][1].cut(normal, at)))
        for depth, at, members in by_look.values()
    ]


@dataclass(frozen=True)
class Layer:
    """One material within a column, between two straight lines.

    ``bottom_mm`` and ``top_mm`` are heights at the column's left and right side [mm].
    """

    body: Body
    bottom_mm: Point
    top_mm: Point


@dataclass(frozen=True)
class SectionColumn:
    """A vertical strip of a section in which every interface is one straight line."""

    left_mm: float
    right_mm: float
    layers: tuple[Layer, ...]


def columns(section: Section) -> list[SectionColumn]:
    """Cut a section into columns, from left to right; layers from bottom to top."""
    return list(_columns(section))


@lru_cache(maxsize=8)
def alike(section: Section, digits: int = 12) -> list[int]:
    """Of each column, the number of the first that looks like it: as wide, of the same bodies at the same heights.

    Sizes are equal where they are to so many digits after the point [mm].
    """
    firsts: dict[object, int] = {}
    numbers = []
    for k, column in enumerate(_columns(section)):
        lines = ((own.body.name, *(round(z, digits) for z in own.bottom_mm + own.top_mm)) for own in column.layers)
        numbers.append(firsts.setdefault((round(column.right_mm - column.left_mm, digits), *lines), k))
    return numbers


@lru_cache(maxsize=8)
def _columns(section: Section) -> list[SectionColumn]:
    cuts = sorted({u for _, outline in section.regions for u, _ in outline})
    edges: list[list[tuple[Point, int]]] = [[] for _ in cuts[1:]]
    for number, (_, outline) in enumerate(section.regions):
        for a, b in sides(outline):
            (ua, va), (ub, vb) = sorted((a, b))
            for k in range(bisect_left(cuts, ua), bisect_left(cuts, ub)):
                slope = (vb - va) / (ub - ua)
                left, right = va + (cuts[k] - ua) * slope, va + (cuts[k + 1] - ua) * slope
                edges[k].append(((left, vb if cuts[k + 1] == ub else right), number))
    return [
        SectionColumn(left, right, _layers(section, crossing))
        for (left, right), crossing in zip(pairwise(cuts), edges, strict=True)
        if right - left > ROUNDING_MM
    ]


def overlap(scene: Scene) -> str | None:
    """Where bodies run into each other, or an outline into itself; None where nowhere, or where no section tells."""
    try:
        cuts_of = sections(scene)
    except ValueError:
        return None
    for section in cuts_of:
        for column in columns(section):
            for below, above in pairwise(column.layers):
                if min(a - b for a, b in zip(above.bottom_mm, below.top_mm, strict=True)) < -ROUNDING_MM:
                    names = " and ".join(dict.fromkeys((below.body.name, above.body.name)))
                    return f"outlines overlap near {section.across} = {column.left_mm:g} mm: {names}"
    return None


def _layers(section: Section, edges: list[tuple[Point, int]]) -> tuple[Layer, ...]:
    by_region: dict[int, list[Point]] = {}
    for line, number in edges:
        by_region.setdefault(number, []).append(line)
    layers = []
    for number, lines in by_region.items():
        rising = sorted(lines, key=sum)
        body = section.regions[number][0]
        layers += [Layer(body, low, high) for low, high in zip(rising[::2], rising[1::2], strict=True)]
    return tuple(sorted(layers, key=lambda layer: sum(layer.bottom_mm) + sum(layer.top_mm)))
