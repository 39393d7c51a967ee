"""Processor time against error, a panel per scene, with the Pareto front (PNG, HTML)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import floor, log10
from textwrap import wrap

from sensorgen.analysis.plots import static
from sensorgen.analysis.plots.figure import GREY, Axis, Curve, Figure, Panel, look
from sensorgen.analysis.plots.pages import PageSection, page
from sensorgen.verification.chart import kind_of
from sensorgen.verification.chart.measured import ChartPoint

TITLE = "Speed and accuracy of the models"
ALT = (
    "Processor time against relative error, both logarithmic. Filled marks: the truth lies between bounds; hollow: no "
    "bounds. Dashed: Pareto front."
)

OVERVIEW = (  # a cell in the plane and in 3D, a press, a line, a network, and the whole prediction
    "tri, 0.1 mm", "rect, 0.1 mm", "tri pressed, 0.1 mm: rise of C", "line, seven tones",
    "sheet, contacts on one edge", "prediction of tri, 0.1 mm",
)  # fmt: skip


def png(points: Sequence[ChartPoint]) -> bytes:
    """All scenes in one picture."""
    return picture("chart", TITLE, ALT, {figure.title: figure.choices[""] for figure in figures(points)})


def overview(points: Sequence[ChartPoint]) -> bytes | None:
    """The scenes that decide, in one picture; None where none of them was measured."""
    here = [p for name in OVERVIEW for p in points if p.scene == name]
    panels = {figure.title: figure.choices[""] for figure in figures(here)}
    return picture("overview", TITLE, ALT, panels) if here else None


def html(points: Sequence[ChartPoint]) -> str:
    """A page with a figure per scene."""
    return page(TITLE, [ALT], [PageSection(figures=tuple(figures(points)))])


def figures(points: Sequence[ChartPoint]) -> Iterator[Figure]:
    """A figure per scene."""
    for number, scene in enumerate(dict.fromkeys(p.scene for p in points)):
        here = [p for p in points if p.scene == scene]
        curves = [curve for model, k in looks(scene, points).items() for curve in _of_model(model, here, k)]
        front = list(steps([p for p in here if p.front]))
        ends = [x for x, _ in front], [y for _, y in front]
        curves.append(Curve("line", "Pareto front", *ends, colour=GREY, dash="dash"))
        errors, asked = [p.error for p in here], f"relative error of {kind_of(scene).ASKED}"
        drawn = panel(curves, "processor time [s]", asked, (min(errors), max(errors)), scene)
        yield Figure(f"scene-{number}", scene, f"R{asked[1:]}; each point names its model and result.", {"": (drawn,)})


def _of_model(model: str, points: Sequence[ChartPoint], k: int) -> Iterator[Curve]:
    """Marks of one model among the points of a scene; none where it is silent there."""
    if mine := [p for p in points if p.model == model]:
        text = [f"{p.model}: {p.result}" for p in mine]
        hollow = not mine[0].bounded
        yield from marks(model, [p.seconds for p in mine], [p.error for p in mine], text, k, hollow=hollow)


def marks(
    name: str, costs: Sequence[float], errors: Sequence[float], text: Sequence[str], k: int, *, hollow: bool
) -> Iterator[Curve]:
    """Marks of one model, its levels joined by a line; ``k`` is the number of its colour and mark."""
    style = look(k)
    if len(costs) > 1:
        yield Curve("line", "", costs, errors, colour=style["colour"])
    curve = Curve("points", name, costs, errors, text=text, **style)
    yield replace(curve, symbol=f"{curve.symbol}-open") if hollow else curve


def panel(curves: Sequence[Curve], cost: str, asked: str, ends: tuple[float, float], title: str) -> Panel:
    """Cost against error, both logarithmic, whole decades around the least and the largest error."""
    low, high = (10.0 ** (floor(log10(end)) + beyond) for end, beyond in zip(ends, (-0.3, 1.3), strict=True))
    y = Axis("\n".join(wrap(f"{asked} [-]", 34)), log=True, low=low, high=high)
    return Panel(tuple(curves), Axis(cost, log=True), y, title=title)


def picture(key: str, title: str, alt: str, panels: Mapping[str, tuple[Panel, ...]]) -> bytes:
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
