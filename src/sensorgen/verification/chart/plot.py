"""Cost against error: a panel per standard scene with the Pareto front, or one per quantity of a design (PNG, HTML)."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import floor, log10
from textwrap import wrap
from typing import TypeVar

from sensorgen.analysis.plots import static
from sensorgen.analysis.plots.figure import GREY, Axis, Curve, Figure, Panel, look
from sensorgen.analysis.plots.pages import PageSection, page
from sensorgen.core.lazy import by_key
from sensorgen.verification import peers
from sensorgen.verification.chart import kind_of
from sensorgen.verification.chart.measured import ChartPoint
from sensorgen.verification.design_chart.results import DesignChart, Point

TITLE = "Speed and accuracy of the models"
ALT = (
    "Processor time against relative error, both logarithmic. Filled marks: the truth lies between bounds; hollow: no "
    "bounds. Dashed: Pareto front."
)
OVERVIEW = (  # a cell in the plane and in 3D, a press, a line, a network, and the whole prediction
    "tri, 0.1 mm", "rect, 0.1 mm", "tri pressed, 0.1 mm: rise of C", "line, seven tones",
    "sheet, contacts on one edge", "prediction of tri, 0.1 mm",
)  # fmt: skip

ALT_OF_DESIGN = (
    "Hollow: cold, in a new process with nothing stored. Filled: warm, solved once more in the same process. Dotted: "
    "what the references are known to; no error is drawn below."
)


@dataclass(frozen=True)
class _Cost:
    """Title of its axis, and columns of a point that give it: whether their marks are hollow."""

    axis: str
    columns: dict[str, bool]


_COSTS = {
    "processor time": _Cost("processor time [s]", {"cold_cpu_s": True, "warm_cpu_s": False}),
    "time by the clock": _Cost("time by the clock [s]", {"cold_wall_s": True, "warm_wall_s": False}),
    "peak memory": _Cost("peak memory of the process [MB]", {"memory_mb": False}),
}
_IN_PICTURE = ("processor time", "peak memory")

AnyPoint = TypeVar("AnyPoint", ChartPoint, Point)


def png(points: Sequence[ChartPoint]) -> bytes:
    """All scenes in one picture."""
    return _picture("chart", TITLE, _words(ALT), {figure.title: figure.choices[""] for figure in figures(points)})


def overview(points: Sequence[ChartPoint]) -> bytes | None:
    """The scenes that decide, in one picture; None where none of them was measured."""
    here = [p for name in OVERVIEW for p in points if p.scene == name]
    panels = {figure.title: figure.choices[""] for figure in figures(here)}
    return _picture("overview", TITLE, _words(ALT), panels) if here else None


def _words(alt: str) -> str:
    """Words of a picture, with the programs of others that are missing here."""
    absent = ", ".join(name for name in peers.ALL if peers.missing(name))
    return f"{alt} Not installed here: {absent}." if absent else alt


def html(points: Sequence[ChartPoint]) -> str:
    """A page with a figure per scene."""
    return page(TITLE, [_words(ALT)], [PageSection(figures=tuple(figures(points)))])


def png_of_design(chart: DesignChart) -> bytes:
    """Time and memory of all quantities in one picture."""
    panels = {
        f"{figure.key}, {cost}": figure.choices[cost] for figure in figures_of_design(chart) for cost in _IN_PICTURE
        if cost in figure.choices
    }  # fmt: skip
    return _picture("chart", _title(chart), _words(ALT_OF_DESIGN), panels)


def html_of_design(chart: DesignChart) -> str:
    """A page: each quantity with its figure, whose axis can be chosen, and its table."""
    shown = {figure.key: figure for figure in figures_of_design(chart)}
    sections = [
        PageSection(key, title, (shown[key],) if key in shown else (), tuple(chart.parts(key)))
        for key, title in chart.titles.items()
    ]
    load = f"{chart.body}; {chart.force_n:g} N at {chart.position_m * 1e3:g} mm."
    return page(_title(chart), [load, _words(ALT_OF_DESIGN)], sections)


def _title(chart: DesignChart) -> str:
    return f"Speed and accuracy for {chart.design}"


def figures(points: Sequence[ChartPoint]) -> Iterator[Figure]:
    """A figure per scene."""
    for number, (scene, here) in enumerate(_grouped(points, "scene").items()):
        numbers, curves = looks(scene, points), list[Curve]()
        for model, mine in sorted(_grouped(here, "model").items(), key=lambda each: numbers[each[0]]):
            text, costs = [f"{p.model}: {p.result}" for p in mine], [p.seconds for p in mine]
            curves += _marks(model, costs, mine, text, numbers[model], hollow=not mine[0].bounded)
        curves.append(_front(here))
        asked = f"relative error of {kind_of(scene).asked}"
        drawn = _panel(curves, "processor time [s]", asked, [p.error for p in here], scene)
        yield Figure(f"scene-{number}", scene, f"R{asked[1:]}; each point names its model and result.", {"": (drawn,)})


def _front(points: Sequence[ChartPoint]) -> Curve:
    front = list(steps([p for p in points if p.front]))
    ends = [x for x, _ in front], [y for _, y in front]
    return Curve("line", "Pareto front", *ends, colour=GREY, dash="dash")


def figures_of_design(chart: DesignChart) -> Iterator[Figure]:
    """A figure per quantity, to choose time or memory in."""
    by_question = _grouped(chart.points, "question")
    for key, title in chart.titles.items():
        if points := by_question.get(key):
            choices = {
                name: (_panel_of_cost(points, title, cost),) for name, cost in _COSTS.items()
                if _costs(points, cost.columns)
            }  # fmt: skip
            yield Figure(key, title, f"Relative error of {title}. {ALT_OF_DESIGN}", choices, "across")


def _panel_of_cost(points: Sequence[Point], title: str, cost: _Cost) -> Panel:
    """Marks of every model, joined from coarse to fine, and what the references are known to."""
    curves: list[Curve] = []
    for k, (model, mine) in enumerate(_grouped(points, "model").items()):
        text = [f"{p.model} {p.level}: {p.error:.2g} off, against {p.against}" for p in mine]
        for column, hollow in cost.columns.items():
            costs = _costs(mine, [column])
            curves += _marks("" if hollow else model, costs, mine, text, k, hollow=hollow)
    costs, doubts = _costs(points, cost.columns), sorted({p.doubt for p in points})
    for words, doubt in zip(("known to", *[""] * len(doubts)), doubts, strict=False):
        curves.append(Curve("line", words, [min(costs), max(costs)], [doubt, doubt], colour=GREY, dash="dot"))
    return _panel(curves, cost.axis, f"relative error: {title}", [doubts[0], *(p.error for p in points)], title)


def _costs(points: Sequence[Point], columns: Iterable[str]) -> list[float]:
    """Costs of points; none where the system does not measure them."""
    return [cost for p in points for column in columns if (cost := getattr(p, column)) is not None]


def _grouped(points: Sequence[AnyPoint], column: str) -> dict[str, list[AnyPoint]]:
    """Points by the text of a column, in the order of their first."""
    return by_key((getattr(point, column), point) for point in points)


def _marks(
    name: str, costs: Sequence[float], points: Sequence[ChartPoint | Point], text: Sequence[str], k: int, *,
    hollow: bool,
) -> Iterator[Curve]:  # fmt: skip
    """Marks of one model, its levels joined by a line; ``k`` is the number of its colour and mark."""
    style, errors = look(k), [p.error for p in points]
    if len(costs) > 1:
        yield Curve("line", "", costs, errors, colour=style["colour"])
    curve = Curve("points", name, costs, errors, text=text, **style)
    yield replace(curve, symbol=f"{curve.symbol}-open") if hollow else curve


def _panel(curves: Sequence[Curve], cost: str, asked: str, errors: Sequence[float], title: str) -> Panel:
    """Cost against error, both logarithmic, whole decades around the least and the largest error."""
    ends = zip((min(errors), max(errors)), (-0.3, 1.3), strict=True)
    low, high = (10.0 ** (floor(log10(end)) + beyond) for end, beyond in ends)
    y = Axis("\n".join(wrap(f"{asked} [-]", 34)), log=True, low=low, high=high)
    return Panel(tuple(curves), Axis(cost, log=True), y, title=title)


def _picture(key: str, title: str, alt: str, panels: Mapping[str, tuple[Panel, ...]]) -> bytes:
    """All panels in one picture, two beside each other, each with its legend."""
    words = "\n".join([title, *wrap(alt, 110)])
    return static.png(Figure(key, words, alt, panels, "panel", columns=2, beside=True))


def looks(scene: str, points: Sequence[ChartPoint]) -> dict[str, int]:
    """Models of all scenes with the same question, those with bounds first, and the number of their colour and mark."""
    alike = [p for p in points if kind_of(p.scene) is kind_of(scene)]
    names = sorted({(not p.bounded, p.model) for p in alike})
    return {model: k for k, (_, model) in enumerate(names)}


def steps(front: Sequence[ChartPoint]) -> Iterator[tuple[float, float]]:
    """A staircase: an error holds until a smaller one is reached."""
    for k, point in enumerate(front):
        if k:
            yield point.seconds, front[k - 1].error
        yield point.seconds, point.error
