"""Time and memory against error of one design's models, a panel per quantity (PNG, HTML)."""

from collections.abc import Iterator, Sequence

from sensorgen.analysis.plots import pages
from sensorgen.analysis.plots.figure import GREY, Curve, Figure, Panel
from sensorgen.verification.chart.plot import marks, panel, picture
from sensorgen.verification.design_chart.results import DesignChart, Point

ALT = (
    "Hollow: cold, in a new process with nothing stored. Filled: warm, once more in the same process. Dotted: what the "
    "references are known to; no error is drawn below."
)
_COSTS = {
    "processor time": ("processor time [s]", "cold_cpu_s", "warm_cpu_s"),
    "time by the clock": ("time by the clock [s]", "cold_wall_s", "warm_wall_s"),
    "peak memory": ("peak memory of the process [MB]", "memory_mb", ""),
}
_IN_PICTURE = ("processor time", "peak memory")


def png(chart: DesignChart) -> bytes:
    """Time and memory of all quantities in one picture."""
    panels = {
        f"{figure.key}, {cost}": figure.choices[cost] for figure in figures(chart) for cost in _IN_PICTURE
        if cost in figure.choices
    }  # fmt: skip
    return picture("chart", _title(chart), ALT, panels)


def html(chart: DesignChart) -> str:
    """A page: each quantity with its figure, whose axis can be chosen, and its table."""
    shown = {figure.key: figure for figure in figures(chart)}
    sections = [
        pages.PageSection(key, title, (shown[key],) if key in shown else (), tuple(chart.parts(key)))
        for key, title in chart.titles.items()
    ]
    return pages.page(
        _title(chart), [f"{chart.body}; {chart.force_n:g} N at {chart.position_m * 1e3:g} mm.", ALT], sections
    )


def _title(chart: DesignChart) -> str:
    return f"Speed and accuracy for {chart.design}"


def figures(chart: DesignChart) -> Iterator[Figure]:
    """A figure per quantity, to choose time or memory in."""
    for key, title in chart.titles.items():
        points = [p for p in chart.points if p.question == key]
        if points:
            choices = {
                cost: (_panel(points, title, *about),) for cost, about in _COSTS.items()
                if any(getattr(p, about[1]) is not None for p in points)
            }  # fmt: skip
            yield Figure(key, title, f"Relative error of {title}. {ALT}", choices, "across")


def _panel(points: Sequence[Point], title: str, axis: str, cold: str, warm: str) -> Panel:
    """Marks of every model, joined from coarse to fine, and what the references are known to."""
    curves: list[Curve] = []
    for k, model in enumerate(dict.fromkeys(p.model for p in points)):
        mine = [p for p in points if p.model == model and getattr(p, cold) is not None]
        text = [f"{p.model} {p.level}: {p.error:.2g} off, against {p.against}" for p in mine]
        for cost, hollow in ((cold, bool(warm)), (warm, False)):
            if cost:
                costs, errors = [getattr(p, cost) for p in mine], [p.error for p in mine]
                curves += marks("" if hollow else model, costs, errors, text, k, hollow=hollow)
    costs = [getattr(p, cost) for p in points for cost in (cold, warm) if cost and getattr(p, cost) is not None]
    doubts = sorted({p.doubt for p in points})
    for words, doubt in zip(("known to", *[""] * len(doubts)), doubts, strict=False):
        curves.append(Curve("line", words, [min(costs), max(costs)], [doubt, doubt], colour=GREY, dash="dot"))
    return panel(curves, axis, f"relative error: {title}", (doubts[0], max(p.error for p in points)), title)
