"""What to draw of a scene: the cross-sections that show most, and their period.

Numbers only; nothing here knows of paper.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

from sensorgen.scene.scene import AXES, SLIVER_MM, Body, Outline, Scene, area_mm2, clipped
from sensorgen.scene.sections import Column, Section, columns

PLACES = 8  # places tried for a section: two periods of crossed strips change eight times
PROBE = 64  # corners looked at for a period: enough for two repetitions of any pattern one would draw
SAME_MM = 1e-6
Region = tuple[Body, Outline]


@dataclass(frozen=True)
class View:
    """A section, seen from the sensor's corner up to ``end_mm``.

    Attributes
    ----------
    section : Section
        What is cut, over the sensor's whole extent.
    extent_mm : float
        How long the sensor is along the section [mm].
    period_mm : tuple of float
        Edges of the columns of one period [mm]; empty where nothing repeats.
    end_mm : float
        How much of it is looked at [mm].
    """

    section: Section
    extent_mm: float
    period_mm: tuple[float, ...]
    end_mm: float

    @cached_property
    def regions(self) -> list[Region]:
        """What is cut, as far as it is looked at."""
        found = []
        for body, outline in self.section.regions:
            along = [u for u, _ in outline]
            if max(along) <= self.end_mm:
                found.append((body, outline))
            elif min(along) < self.end_mm and (part := clipped(outline, self.end_mm)):
                found.append((body, part))
        return found

    @cached_property
    def columns(self) -> list[Column]:
        """The columns that are looked at."""
        return columns(replace(self.section, regions=tuple(self.regions)))

    @property
    def normal(self) -> str:
        """Axis square to the section."""
        return "y" if self.section.across == "x" else "x"

    def repeat_mm(self) -> float:
        """Length of one period, 0 where nothing repeats [mm]."""
        return self.period_mm[-1] - self.period_mm[0] if self.period_mm else 0.0


def views(scene: Scene) -> list[View]:
    """The view along x and the one along y, without those that show nothing but plates."""
    both = [_view(scene, across) for across in "xy"]
    return [view for view in both if len(view.columns) > 1] or both[:1]


def _view(scene: Scene, across: str) -> View:
    """The section in which most of the terminals is seen: through the conductor strips, not beside them."""
    normal = "y" if across == "x" else "x"
    spans = [(p.span(normal), body, p) for body in scene.bodies for p in body.prisms]
    edges = sorted({edge for span, _, _ in spans for edge in span})
    # Through the first stretches in which the sensor keeps one look.
    stretches = [(low, high) for low, high in pairwise(edges) if high - low > SLIVER_MM]
    cuts = []
    for low, high in stretches[:PLACES]:
        at = (low + high) / 2
        cut = ((body, o) for (start, end), body, p in spans if start < at < end for o in p.cut(normal, at))
        cuts.append(Section(across, high - low, at, tuple(cut)))
    section = max(cuts, key=_shown_mm2)
    extent = scene.size_mm[AXES.index(across)]
    corners = sorted({u for _, outline in section.regions for u, _ in outline})
    probe = View(section, extent, (), corners[min(PROBE, len(corners) - 1)])
    return View(section, extent, period(probe.columns), probe.end_mm)


def _shown_mm2(section: Section) -> tuple[float, float]:
    """Area of the terminals, and of everything, that a section shows [mm2]."""
    areas = [(area_mm2(outline), bool(body.terminal)) for body, outline in section.regions]
    return round(sum(area for area, terminal in areas if terminal), 6), round(sum(area for area, _ in areas), 6)


def period(row: Sequence[Column]) -> tuple[float, ...]:
    """Edges of the columns of the first full period [mm]; empty where nothing repeats.

    The first and the last column may be the rest of one, where the outline cuts through the pattern.
    """
    for inner in (row, row[:-1], row[1:-1]):
        for n in range(1, min(2 * len(inner) // 3, len(inner) - 2) + 1):  # two columns at least must come again
            if all(_alike(a, b) for a, b in zip(inner, inner[n:], strict=False)):
                return tuple(c.left_mm for c in inner[: n + 1])
    return ()


def _alike(a: Column, b: Column) -> bool:
    """Whether two columns have the same bodies, width and heights."""
    (bodies, sizes), (others, beside) = (
        (
            [layer.body.name for layer in column.layers],
            [column.right_mm - column.left_mm, *(z for layer in column.layers for z in layer.bottom_mm + layer.top_mm)],
        )
        for column in (a, b)
    )
    return bodies == others and all(abs(p - q) < SAME_MM for p, q in zip(sizes, beside, strict=True))
