"""Time against error, a panel per scene, with the front beyond which nothing lies (PNG, HTML)."""

from collections.abc import Iterator, Sequence
from math import floor, log10
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from sensorgen.analysis.plots.panels import png as written
from sensorgen.verification.chart import kind_of
from sensorgen.verification.chart.measured import Point

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a5195", "#8c564b", "#555555")
_MARKERS = "osD^vPX<>"
_SYMBOLS = (
    "circle",
    "square",
    "diamond",
    "triangle-up",
    "triangle-down",
    "cross",
    "x",
    "triangle-left",
    "triangle-right",
)
_SIDE_IN = (5.2, 3.0)
_COLUMNS = 3
_LEGEND_SHARE = 0.16  # of the page's width, for what stands beside a panel
_TITLE = (
    "Processor time against error. Filled marks: the truth lies between bounds; hollow: no bounds. Dashed: Pareto front"
)
_TIME = "processor time [s]"


def png(points: Sequence[Point]) -> bytes:
    """The picture; bounds as filled marks, formulas as hollow ones."""
    from matplotlib.figure import Figure

    scenes = list(dict.fromkeys(p.scene for p in points))
    columns = min(_COLUMNS, len(scenes))
    rows = -(-len(scenes) // columns)
    figure = Figure(figsize=(columns * _SIDE_IN[0], rows * _SIDE_IN[1] + 0.4), dpi=100, layout="constrained")
    figure.suptitle("\n".join(wrap(_TITLE, 50 * columns)), fontsize="medium")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
    for panel, scene in zip(panels, scenes, strict=False):
        _panel(panel, scene, [p for p in points if p.scene == scene], points)
    for panel in panels[len(scenes) :]:
        panel.set_axis_off()
    return written(figure)


def _panel(panel: "Axes", scene: str, here: Sequence[Point], points: Sequence[Point]) -> None:
    for model, k in _looks(scene, points).items():
        mine = [p for p in here if p.model == model]
        if mine:
            panel.plot(
                [p.seconds for p in mine], [p.error for p in mine], _MARKERS[k % 9], color=_colour(k), ms=6,
                mfc=None if mine[0].bounded else "none", ls="-" if len(mine) > 1 else "", lw=0.8, label=model,
            )  # fmt: skip
    front = list(_steps([p for p in here if p.front]))
    panel.plot([x for x, _ in front], [y for _, y in front], color="0.4", lw=1, ls="--", zorder=0)
    panel.set(xscale="log", yscale="log", title=scene, xlabel=_TIME, ylabel="\n".join(wrap(_error(scene), 30)))
    panel.set_ylim(*_decades([p.error for p in here]))
    panel.tick_params(labelbottom=True)
    panel.grid(alpha=0.25)
    panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.03), frameon=False, fontsize="x-small", handletextpad=0.2)


def _decades(values: Sequence[float]) -> tuple[float, float]:
    """Whole powers of ten around them, with room."""
    return 10.0 ** (floor(log10(min(values))) - 0.3), 10.0 ** (floor(log10(max(values))) + 1.3)


def _error(scene: str) -> str:
    """What a panel's error is of."""
    return f"relative error of {kind_of(scene).ASKED} [-]"


def _looks(scene: str, points: Sequence[Point]) -> dict[str, int]:
    """Models of all scenes with the same question, those with bounds first, and the number of their colour and mark."""
    alike = [p for p in points if kind_of(p.scene) is kind_of(scene)]
    names = sorted({(not p.bounded, p.model) for p in alike})
    return {model: k for k, (_, model) in enumerate(names)}


def _colour(k: int) -> str:
    """Of a mark: the next one after each round of marks, so that no two models look alike."""
    return _COLOURS[(k + k // len(_MARKERS)) % len(_COLOURS)]


def _steps(front: Sequence[Point]) -> Iterator[tuple[float, float]]:
    """A staircase: an error holds until something nearer is ready."""
    for k, point in enumerate(front):
        if k:
            yield point.seconds, front[k - 1].error
        yield point.seconds, point.error


def html(points: Sequence[Point]) -> str:
    """The same as a page that answers to the mouse; its script is inside, and no network is needed."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    scenes = list(dict.fromkeys(p.scene for p in points))
    columns = min(2, len(scenes))
    rows = -(-len(scenes) // columns)
    figure = make_subplots(
        rows=rows,
        cols=columns,
        subplot_titles=scenes,
        horizontal_spacing=1.6 * _LEGEND_SHARE,
        vertical_spacing=0.3 / rows,
    )
    for number, scene in enumerate(scenes):
        place, key = (
            {"row": number // columns + 1, "col": number % columns + 1},
            f"legend{number + 1 if number else ''}",
        )
        here = [p for p in points if p.scene == scene]
        for model, k in _looks(scene, points).items():
            mine = [p for p in here if p.model == model]
            if mine:
                figure.add_trace(go.Scatter(**_marks(mine, k), legend=key), **place)
        figure.add_trace(go.Scatter(**_front(here), legend=key), **place)
        low, high = map(log10, _decades([p.error for p in here]))
        ticks = max(1, round((high - low) / 5))
        figure.update_yaxes(title_text="<br>".join(wrap(_error(scene), 34)), dtick=ticks, **place)
        figure.update_layout({key: _beside(figure.get_subplot(**place))})
    figure.update_xaxes(type="log", title_text=_TIME, exponentformat="power", dtick=1)
    figure.update_yaxes(type="log", exponentformat="power", title_font_size=12)
    figure.update_layout(title={"text": _TITLE, "font_size": 14}, height=120 + 380 * rows, template="plotly_white")
    figure.update_layout(margin_r=200)
    return str(figure.to_html(include_plotlyjs=True, div_id="chart", config={"displaylogo": False, "responsive": True}))


def _beside(panel: Any) -> dict[str, Any]:
    """Place of a panel's legend: to the right of it."""
    x, y = panel.xaxis.domain[1], panel.yaxis.domain[1]
    return {"x": x + 0.005, "y": y, "xanchor": "left", "yanchor": "top", "font": {"size": 10}}


def _marks(points: Sequence[Point], k: int) -> dict[str, Any]:
    hollow = "" if points[0].bounded else "-open"
    return {
        "x": [p.seconds for p in points], "y": [p.error for p in points], "customdata": [p.said for p in points],
        "name": points[0].model,
        "mode": "lines+markers" if len(points) > 1 else "markers",
        "marker": {"color": _colour(k), "symbol": _SYMBOLS[k % 9] + hollow, "size": 9},
        "line": {"width": 1, "color": _colour(k)},
        "hovertemplate": f"{points[0].model}<br>error %{{y:.3g}} in %{{x:.3g}} s<br>%{{customdata}}<extra></extra>",
    }  # fmt: skip


def _front(points: Sequence[Point]) -> dict[str, Any]:
    steps = list(_steps([p for p in points if p.front]))
    return {
        "x": [x for x, _ in steps], "y": [y for _, y in steps], "mode": "lines", "name": "Pareto front",
        "line": {"color": "grey", "width": 1.5, "dash": "dash"}, "hoverinfo": "skip",
    }  # fmt: skip
