"""Processor time against error, a panel per scene, with the Pareto front (PNG, HTML)."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import floor, log10
from textwrap import wrap

from sensorgen.analysis.plots import static
from sensorgen.analysis.plots.figure import GREY, Axis, Curve, Figure, Panel, look
from sensorgen.analysis.plots.pages import page
from sensorgen.verification.chart import kind_of
from sensorgen.verification.chart.measured import Point

TITLE = "Speed and accuracy of the models"
ALT = (
    "Processor time against relative error, both logarithmic. Filled marks: the truth lies between bounds; hollow: no "
    "bounds. Dashed: Pareto front."
)

OVERVIEW = (  # a cell in the plane and in 3D, a press, a line, a network, and the whole prediction
    "tri, 0.1 mm", "rect, 0.1 mm", "tri pressed, 0.1 mm: rise of C", "line, seven tones",
    "sheet, contacts on one edge", "prediction of tri, 0.1 mm",
)  # fmt: skip


def png(points: Sequence[Point]) -> bytes:
    """All scenes in one picture."""
    panels = {figure.title: figure.choices[""] for figure in figures(points)}
    title = "\n".join([TITLE, *wrap(ALT, 120)])
    return static.png(Figure("chart", title, ALT, panels, "scene", columns=2, beside=True))


def overview(points: Sequence[Point]) -> bytes | None:
    """The scenes that decide, in one picture; None where none of them was measured."""
    here = [p for name in OVERVIEW for p in points if p.scene == name]
    panels = {figure.title: figure.choices[""] for figure in figures(here)}
    title = "\n".join([TITLE, *wrap(ALT, 110)])
    return static.png(Figure("overview", title, ALT, panels, "scene", columns=2, beside=True)) if here else None


def html(points: Sequence[Point]) -> str:
    """A page with a figure per scene."""
    return page(TITLE, [ALT], list(figures(points)))


def figures(points: Sequence[Point]) -> Iterator[Figure]:
    """A figure per scene."""
    for number, scene in enumerate(dict.fromkeys(p.scene for p in points)):
        here = [p for p in points if p.scene == scene]
        curves = [
            curve for model, k in looks(scene, points).items() if (mine := [p for p in here if p.model == model])
            for curve in _curves(mine, k)
        ]  # fmt: skip
        front = list(steps([p for p in here if p.front]))
        curves.append(
            Curve("line", "Pareto front", [x for x, _ in front], [y for _, y in front], colour=GREY, dash="dash")
        )
        low = 10.0 ** (floor(log10(min(p.error for p in here))) - 0.3)
        high = 10.0 ** (floor(log10(max(p.error for p in here))) + 1.3)
        asked = "\n".join(wrap(f"relative error of {kind_of(scene).ASKED} [-]", 34))
        panel = Panel(
            tuple(curves), Axis("processor time [s]", log=True), Axis(asked, log=True, low=low, high=high), title=scene
        )
        words = f"Relative error of {kind_of(scene).ASKED}; each point names its model and result."
        yield Figure(f"scene-{number}", scene, words, {"": (panel,)})


def _curves(points: Sequence[Point], k: int) -> Iterator[Curve]:
    """Marks of one model, hollow if it has no bounds, joined by a line."""
    style = look(k)
    x, y = [p.seconds for p in points], [p.error for p in points]
    if len(points) > 1:
        yield Curve("line", "", x, y, colour=style["colour"])
    text = [f"{p.model}: {p.said}" for p in points]
    marks = Curve("points", points[0].model, x, y, text=text, **style)
    yield marks if points[0].bounded else replace(marks, symbol=f"{marks.symbol}-open")


def looks(scene: str, points: Sequence[Point]) -> dict[str, int]:
    """Models of all scenes with the same question, those with bounds first, and the number of their colour and mark."""
    alike = [p for p in points if kind_of(p.scene) is kind_of(scene)]
    names = sorted({(not p.bounded, p.model) for p in alike})
    return {model: k for k, (_, model) in enumerate(names)}


def steps(front: Sequence[Point]) -> Iterator[tuple[float, float]]:
    """A staircase: an error holds until a smaller one is reached."""
    for k, point in enumerate(front):
        if k:
            yield point.seconds, front[k - 1].error
        yield point.seconds, point.error
