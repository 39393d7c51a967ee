"""Cost against error: a panel per standard scene with the Pareto front, or one per quantity of a design (PNG, HTML)."""

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from math import floor, log10
from textwrap import wrap

from sensorgen.analysis.plots import static
from sensorgen.analysis.plots.figure import GREY, Axis, Curve, Figure, Panel, look
from sensorgen.analysis.plots.pages import PageSection, page
from sensorgen.core.lazy import by_key
from sensorgen.verification import peers
from sensorgen.verification.chart.results import Chart, Point, unbeaten

OVERVIEW = (  # a cell in the plane and in 3D, a press, a line, a network, and the whole prediction
    "tri, 0.1 mm", "rect, 0.1 mm", "tri pressed, 0.1 mm: rise of C", "line, seven tones",
    "sheet, contacts on one edge", "prediction of tri, 0.1 mm",
)  # fmt: skip


_COSTS = {  # columns of a point by the title of an axis
    "processor time [s]": ("cold_cpu_s", "warm_cpu_s"), "time by the clock [s]": ("cold_wall_s", "warm_wall_s"),
    "peak memory of the process [MB]": ("memory_mb",),
}  # fmt: skip


def png(chart: Chart) -> bytes:
    """Time and memory of all questions in one picture."""
    panels = {
        f"{figure.key}, {cost}": panel for figure in figures(chart) for cost, panel in figure.choices.items()
        if "clock" not in cost
    }  # fmt: skip
    title, alt = chart.title, _words(chart)
    words = "\n".join([title, *wrap(alt, 110)])
    return static.png(Figure("chart", words, alt, panels, "panel", columns=2, beside=True))


def overview(chart: Chart) -> bytes | None:
    """The scenes that decide, in one picture; None where none of them was measured."""
    here = chart.only(OVERVIEW)
    return png(here) if here.points else None


def html(chart: Chart) -> str:
    """A page: each question with its figure, whose axis can be chosen, and its table."""
    shown = {figure.title: figure for figure in figures(chart)}
    sections = [
        PageSection(_anchor(key), title, (shown[title],) if title in shown else (), tuple(chart.parts(key)))
        for key, title in chart.titles.items()
    ]
    return page(chart.title, [*chart.head(), _words(chart)], sections)


def _words(chart: Chart) -> str:
    """Words of a picture, with the programs of others that are missing here."""
    absent = ", ".join(name for name in peers.ALL if peers.missing(name))
    return f"{chart.ALT} Not installed here: {absent}." if absent else chart.ALT


def _anchor(key: str) -> str:
    return re.sub(r"\W+", "-", key)


def figures(chart: Chart) -> Iterator[Figure]:
    """A figure per question, to choose time or memory in."""
    by_question = by_key((p.question, p) for p in chart.points)
    for key, title in chart.titles.items():
        if points := by_question.get(key):
            numbers = _numbers(chart, chart.asked[key])
            choices = {
                cost: (_panel(points, title, chart.asked[key], cost, numbers),) for cost, columns in _COSTS.items()
                if any(_pairs(points, column) for column in columns)
            }  # fmt: skip
            yield Figure(_anchor(key), title, f"Relative error of {chart.asked[key]}. {chart.ALT}", choices, "across")


def _numbers(chart: Chart, asked: str) -> dict[str, int]:
    """Models of all questions that ask for the same, and the number of their colour and mark."""
    models = dict.fromkeys(p.model for p in chart.points if chart.asked[p.question] == asked)
    return {model: k for k, model in enumerate(models)}


def _panel(points: Sequence[Point], title: str, asked: str, cost: str, numbers: Mapping[str, int]) -> Panel:
    """Cost against error, both logarithmic, whole decades around the least and the largest error."""
    columns = _COSTS[cost]
    costs, errors = zip(*(pair for column in columns for pair in _pairs(points, column)), strict=True)
    curves = [*_models(points, columns, numbers), _front(_pairs(points, columns[-1]))]
    near = sorted({p.doubt for p in points if p.doubt > min(errors) / 10})
    for words, doubt in zip(("known to", *[""] * len(near)), near, strict=False):
        curves.append(_line(words, [(min(costs), doubt), (max(costs), doubt)], "dot"))
    low, high = (10.0 ** (floor(log10(end)) + beyond) for end, beyond in ((min(errors), -0.3), (max(errors), 1.3)))
    y = Axis("\n".join(wrap(f"relative error of {asked} [-]", 34)), log=True, low=low, high=high)
    return Panel(tuple(curves), Axis(cost, log=True), y, title=title)


def _models(points: Sequence[Point], columns: Sequence[str], numbers: Mapping[str, int]) -> Iterator[Curve]:
    """Marks of every model, joined from coarse to fine; its number is that of its colour and mark."""
    for model, mine in by_key((p.model, p) for p in points).items():
        text = [f"{p.words()}: {p.error:.2g} off, against {p.against}" for p in mine]
        style, bare = look(numbers[model]), mine[0].cold_cpu_s is None and not mine[0].certified
        for column in columns:
            cold, pairs = column.startswith("cold"), _pairs(mine, column)
            if len(pairs) > 1:
                yield _line("", pairs, "solid", style["colour"])
            symbol = f"{style['symbol']}-open" if cold or bare else style["symbol"]
            yield Curve("points", "" if cold else model, *_split(pairs), text=text, **style | {"symbol": symbol})


def _front(pairs: Sequence[tuple[float, float]]) -> Curve:
    """A staircase: an error holds until a smaller one is reached."""
    best = unbeaten(pairs)
    stairs = [end for (_, before), (x, y) in pairwise(best) for end in ((x, before), (x, y))]
    return _line("Pareto front", [*best[:1], *stairs], "dash")


def _pairs(points: Sequence[Point], column: str) -> list[tuple[float, float]]:
    """Cost and error of points; none where the system does not measure a cost."""
    return [(cost, p.error) for p in points if (cost := getattr(p, column)) is not None]


def _line(name: str, pairs: Sequence[tuple[float, float]], dash: str, colour: str = GREY) -> Curve:
    return Curve("line", name, *_split(pairs), colour=colour, dash=dash)


def _split(pairs: Sequence[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [x for x, _ in pairs], [y for _, y in pairs]
