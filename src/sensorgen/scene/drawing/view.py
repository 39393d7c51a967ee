"""Contents of a drawing: the cross-sections that show most, their period, and sizes worth a dimension line.

Numbers only; nothing here knows of paper.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, pairwise, permutations
from math import hypot

from sensorgen.core.lazy import by_key
from sensorgen.scene.scene import AXES, FLOATING, SLIVER_MM, Body, Outline, Point, Scene, area_mm2, clipped, sides
from sensorgen.scene.sections import Section, SectionColumn, alike, columns, distinct

PLACES = 8  # tried for a section from the edge on, and amid: two periods of crossed strips change eight times
PROBE = 64  # corners looked at for a period: enough for two repetitions of any pattern one would draw
SAME_MM, SAME_DIGITS = 1e-6, 6
BEFORE = 0.1  # share of a view before the crossing that it begins with
CHORD_MM = 0.01  # of facets from the curved face that they stand for, as an import has them
MOST_LEVELS, MOST_COLUMNS, MOST_EXTENTS, MOST_PIECES = 9, 8, 3, 2  # measures of a view
Region = tuple[Body, Outline]


@dataclass(frozen=True)
class View:
    """A section, seen from ``start_mm`` up to ``end_mm``, as counted from the sensor's corner.

    Attributes
    ----------
    section : Section
        What is cut, over the sensor's whole extent.
    extent_mm : float
        How long the sensor is along the section [mm].
    period_mm : tuple of float
        Edges of the columns of one period [mm]; empty where nothing repeats.
    end_mm, start_mm : float
        The part of it that is looked at [mm].
    """

    section: Section
    extent_mm: float
    period_mm: tuple[float, ...]
    end_mm: float
    start_mm: float = 0.0

    @cached_property
    def regions(self) -> list[Region]:
        """Cut bodies, as far as the view reaches."""
        cut_bodies = []
        for body, outline in self.section.regions:
            along = [u for u, _ in outline]
            if self.start_mm <= min(along) and max(along) <= self.end_mm:
                cut_bodies.append((body, outline))
            elif min(along) < self.end_mm and (part := clipped(outline, self.end_mm, self.start_mm)):
                cut_bodies.append((body, part))
        return cut_bodies

    @cached_property
    def cut(self) -> Section:
        """The section as far as the view reaches."""
        return replace(self.section, regions=tuple(self.regions))

    @property
    def columns(self) -> list[SectionColumn]:
        """The columns that are looked at."""
        return columns(self.cut)

    @property
    def normal(self) -> str:
        """Axis square to the section."""
        return "y" if self.section.across == "x" else "x"

    def crossing_mm(self) -> float | None:
        """Where the first column with two terminals begins [mm]; None where they are nowhere above each other."""
        two = (c.left_mm for c in self.columns if len({layer.body.terminal for layer in c.layers} - {"", FLOATING}) > 1)
        return next(two, None)

    def first(self, length_mm: float) -> "View":
        """So much of it from its corner on; where nothing repeats and no terminals cross there, where they first do."""
        corner, whole = replace(self, end_mm=length_mm), replace(self, end_mm=self.extent_mm)
        if self.period_mm or corner.crossing_mm() is not None or (crossing := whole.crossing_mm()) is None:
            return corner
        start = max(min(round(crossing - BEFORE * length_mm, 1), self.extent_mm - length_mm), 0.0)
        return replace(self, start_mm=start, end_mm=start + length_mm)

    def repeat_mm(self) -> float:
        """Length of one period, 0 where nothing repeats [mm]."""
        return self.period_mm[-1] - self.period_mm[0] if self.period_mm else 0.0


def views(scene: Scene) -> list[View]:
    """The view along x and the one along y, without those that show nothing but plates."""
    both = [_view(scene, across) for across in "xy"]
    return [view for view in both if len(view.columns) > 1] or both[:1]


def _stretches(scene: Scene, normal: str) -> list[Point]:
    """Stretches along an axis in which the sensor keeps one look; those near its middle first where it never does."""
    edges = sorted({edge for _, p in scene.pieces for edge in p.span(normal)})
    stretches = [(low, high) for low, high in pairwise(edges) if high - low > SLIVER_MM]
    if not all(p.is_constant(normal) for _, p in scene.pieces):
        middle = scene.size_mm[AXES.index(normal)] / 2
        stretches.sort(key=lambda ends: abs(sum(ends) / 2 - middle))
    return stretches


def _view(scene: Scene, across: str) -> View:
    """The section in which most of the terminals is seen: through the conductor strips, not beside them."""
    normal = "y" if across == "x" else "x"
    spans = [(p.span(normal), body, p) for body, p in scene.pieces]
    cuts = []
    every = _stretches(scene, normal)
    amid = len(every) // 2
    for low, high in dict.fromkeys((*every[:PLACES], *every[amid : amid + PLACES])):
        at = (low + high) / 2
        cut = ((body, o) for (start, end), body, p in spans if start < at < end for o in p.cut(normal, at))
        cuts.append(Section(across, high - low, at, tuple(cut)))
    section = max(cuts, key=_shown_mm2)
    extent = scene.size_mm[AXES.index(across)]
    corners = sorted({u for _, outline in section.regions for u, _ in outline})
    probe = View(section, extent, (), corners[min(PROBE, len(corners) - 1)])
    return View(section, extent, period(probe.cut), probe.end_mm)


def _shown_mm2(section: Section) -> tuple[float, float]:
    """Area of the terminals, and of everything, that a section shows [mm2]."""
    areas = [(area_mm2(outline), bool(body.terminal)) for body, outline in section.regions]
    return round(sum(area for area, terminal in areas if terminal), 6), round(sum(area for area, _ in areas), 6)


def period(section: Section) -> tuple[float, ...]:
    """Edges of the columns of the first full period [mm]; empty where nothing repeats.

    The first and the last column may be the rest of one, where the outline cuts through the pattern.
    """
    row = list(zip(columns(section), alike(section, SAME_DIGITS), strict=True))
    for inner in (row, row[:-1], row[1:-1]):
        for n in range(1, min(2 * len(inner) // 3, len(inner) - 2) + 1):  # two columns at least must come again
            if all(a == b for (_, a), (_, b) in zip(inner, inner[n:], strict=False)):
                return tuple(column.left_mm for column, _ in inner[: n + 1])
    return ()


@dataclass(frozen=True)
class Measure:
    """A distance on one axis, and where on the other axis its two ends are [mm]."""

    low_mm: float
    high_mm: float
    ends_mm: Point = (0.0, 0.0)

    @property
    def value_mm(self) -> float:
        """The distance [mm]."""
        return self.high_mm - self.low_mm

    def same(self, other: "Measure") -> bool:
        """True where both have the same ends."""
        return abs(self.low_mm - other.low_mm) + abs(self.high_mm - other.high_mm) < SAME_MM


@dataclass(frozen=True)
class Gap:
    """Where two terminals come nearest to each other in a view, in (along, z) [mm].

    ``at_corner`` is False in the middle of a flat edge, which shows better.
    """

    near: Point
    far: Point
    at_corner: bool

    @property
    def value_mm(self) -> float:
        """The distance [mm]."""
        return hypot(self.near[0] - self.far[0], self.near[1] - self.far[1])


def heights(views: Sequence[View], height_mm: float) -> list[list[Measure]]:
    """Vertical measures in lanes from the sensor outwards: level by level, whole bodies, the whole."""
    spans = [span for view in views for span in _extents(view)]
    levels = distinct([0.0, height_mm, *(z for view in views for z in _levels(view))], SAME_MM)
    if len(levels) > MOST_LEVELS:
        levels = distinct([0.0, height_mm, *chain.from_iterable(spans)], SAME_MM)
    steps = [Measure(low, high) for low, high in pairwise(levels[:MOST_LEVELS])]
    whole = Measure(0.0, height_mm)
    bodies = _new((Measure(*span) for span in spans), [*steps, whole])
    lanes = _lanes(sorted(bodies, key=lambda m: m.value_mm)[:MOST_EXTENTS])
    return [*([steps] if len(steps) > 1 else []), *lanes, [whole]]


def _lanes(measures: Iterable[Measure]) -> list[list[Measure]]:
    """Measures side by side, those that overlap in different lanes."""
    lanes: list[list[Measure]] = []
    for m in sorted(measures, key=lambda m: m.low_mm):
        free = next((lane for lane in lanes if lane[-1].high_mm <= m.low_mm + SAME_MM), None)
        if free is None:
            lanes.append([m])
        else:
            free.append(m)
    return lanes


def widths(view: View) -> tuple[list[list[Measure]], list[list[Measure]]]:
    """Horizontal measures in rows from the sensor outwards: those above the view, and those below it."""
    middle, edges = _reach(view, None, max) / 2, _edges(view)
    lowest = [_reach(view, u, min) for u in edges]
    above = bool(edges) and min(lowest) > middle
    steps, whole = _columns(view, edges, [_reach(view, u, max) for u in edges] if above else lowest)
    known = [*steps, *whole, Measure(view.start_mm, view.end_mm)]
    pieces = _new(_flats(view), known, by_value=True)[:MOST_PIECES]
    upper, lower = ([[m] for m in pieces if (m.ends_mm[0] > middle) == is_upper] for is_upper in (True, False))
    if above:
        return _filled([steps, *upper, whole]), lower
    return upper, _filled([steps, *lower, whole])


def _columns(view: View, edges: Sequence[float], reach: Sequence[float]) -> tuple[list[Measure], list[Measure]]:
    """Widths of the columns, unless there are too many, and of a period, where the view shows all of it."""
    steps = [Measure(a, b, ends) for (a, b), ends in zip(pairwise(edges), pairwise(reach), strict=True)]
    repeats = bool(edges and view.period_mm) and edges[-1] == view.period_mm[-1]
    whole = [Measure(edges[0], edges[-1], (reach[0], reach[-1]))] if repeats else []
    return steps if 1 < len(steps) <= MOST_COLUMNS else [], whole


def _edges(view: View) -> list[float]:
    """Edges of the columns of a period, or of all columns where nothing repeats, as far as the view goes [mm]."""
    columns = [*(column.left_mm for column in view.columns), view.columns[-1].right_mm]
    first, last, bends = view.start_mm - SAME_MM, view.end_mm + SAME_MM, set(_bends(view))
    within = [u for u in view.period_mm or columns if first <= u <= last]
    return [u for u in within if u in (within[0], within[-1]) or any(abs(u - bend) < SAME_MM for bend in bends)]


def _bends(view: View) -> Iterator[float]:
    """Places of corners, but for those between the facets of a curved face [mm]."""
    for _, outline in view.regions:
        for before, corner, after in zip(outline[-1:] + outline[:-1], outline, outline[1:] + outline[:1], strict=True):
            foot = _foot(corner, before, after)
            if hypot(corner[0] - foot[0], corner[1] - foot[1]) > CHORD_MM:
                yield corner[0]


def _filled(rows: Iterable[list[Measure]]) -> list[list[Measure]]:
    """Rows that have a measure."""
    return [row for row in rows if row]


def _flats(view: View) -> list[Measure]:
    """Level edges that the view's ends do not cut, from left to right."""
    edges = (edge for _, outline in view.regions for edge in sides(outline))
    flats = sorted((min(a[0], b[0]), max(a[0], b[0]), a[1]) for a, b in edges if a[1] == b[1])
    first, last = view.start_mm + SAME_MM, view.end_mm - SAME_MM
    return [Measure(low, high, (z, z)) for low, high, z in flats if low > first and high < last]


def _gaps(outlines: Sequence[Outline], others: Sequence[Outline]) -> Iterator[Gap]:
    """From corners and middles of sides of some outlines to the sides of others."""
    edges = [edge for outline in others for edge in sides(outline)]
    for a, b in chain.from_iterable(map(sides, outlines)):
        between = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)
        for place, at_corner in ((a, True), (between, False)):
            yield from (Gap(place, _foot(place, *edge), at_corner) for edge in edges)


def nearest(view: View) -> Gap | None:
    """Where two terminals come nearest; of several such places the one nearest to the middle.

    Looks beyond the view's end where the first period does: its end must not hide the gap.
    """
    middle = view.end_mm / 2
    if view.period_mm and view.period_mm[-1] > view.end_mm:
        view = replace(view, end_mm=view.period_mm[-1])
    terminals: dict[str, list[Outline]] = {}
    for body, outline in view.regions:
        if body.terminal:
            terminals.setdefault(body.terminal, []).append(outline)
    gaps = chain.from_iterable(_gaps(*pair) for pair in permutations(terminals.values(), 2))
    return min(gaps, key=lambda gap: (round(gap.value_mm, 6), gap.at_corner, abs(gap.near[0] - middle)), default=None)


def _levels(view: View) -> Iterator[float]:
    """Heights at which an outline is flat or turns, but for corners that only the view's end makes."""
    for _, outline in view.regions:
        for before, (u, z), after in zip(outline[-1:] + outline[:-1], outline, outline[1:] + outline[:1], strict=True):
            flat = any(z == p[1] and abs(u - p[0]) > SAME_MM for p in (before, after))
            turns = (before[1] - z) * (after[1] - z) > 0 and view.start_mm + SAME_MM < u < view.end_mm - SAME_MM
            if flat or turns:
                yield z


def _extents(view: View) -> Iterator[Point]:
    """Lowest and highest place of each body [mm]."""
    by_body = by_key((body.name, z) for body, outline in view.regions for _, z in outline)
    return ((min(zs), max(zs)) for zs in by_body.values())


def _reach(view: View, at_mm: float | None, end: Callable[..., float]) -> float:
    """Height of the lowest or the highest corner at one place of the section, or at all [mm]."""
    corners = (corner for _, outline in view.regions for corner in outline)
    return end((z for u, z in corners if at_mm is None or abs(u - at_mm) < SAME_MM), default=0.0)


def _new(measures: Iterable[Measure], known: Sequence[Measure], by_value: bool = False) -> list[Measure]:
    """Those that no other one tells already."""
    new: list[Measure] = []
    for m in measures:
        if not any(abs(m.value_mm - k.value_mm) < SAME_MM if by_value else m.same(k) for k in [*known, *new]):
            new.append(m)
    return new


def _foot(p: Point, a: Point, b: Point) -> Point:
    """The point of an edge that is nearest to ``p``."""
    along = (b[0] - a[0], b[1] - a[1])
    share = ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / (along[0] ** 2 + along[1] ** 2)
    share = min(max(share, 0.0), 1.0)
    return a[0] + share * along[0], a[1] + share * along[1]
