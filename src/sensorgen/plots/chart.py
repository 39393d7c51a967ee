"""Time against error, a panel per scene, with the front beyond which nothing lies (PNG, HTML)."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from sensorgen.chart.measured import Point
from sensorgen.plots.panels import png as written

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7a5195", "#8c564b", "#555555")
_MARKERS = "osD^vPX<>"
_SIDE_IN = (4.3, 3.5)
_COLUMNS = 4
_TIME, _ERROR = "processor time [s]", "relative error [-]"


def png(points: Sequence[Point]) -> bytes:
    """The picture; bounds as filled marks, formulas as hollow ones."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    scenes, models = _names(points)
    columns = min(_COLUMNS, len(scenes) + 1)
    rows = -(-(len(scenes) + 1) // columns)
    figure = Figure(figsize=(columns * _SIDE_IN[0], rows * _SIDE_IN[1]), dpi=100, layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
    for panel, scene in zip(panels, scenes, strict=False):
        _panel(panel, scene, [p for p in points if p.scene == scene], models)
    for panel in panels[len(scenes) :]:
        panel.set_axis_off()
    bounded = {p.model for p in points if p.bounded}
    keys = [
        Line2D(
            [], [], linestyle="", marker=_marker(_MARKERS, k), color=_COLOURS[k % 9],
            mfc=None if m in bounded else "none", label=m,
        )
        for k, m in enumerate(models)
    ]  # fmt: skip
    keys.append(Line2D([], [], color="0.4", lw=1, ls="--", label="Pareto front"))
    panels[len(scenes)].legend(
        handles=keys,
        loc="center",
        frameon=False,
        fontsize="x-small",
        ncols=2,
        columnspacing=1.0,
        handletextpad=0.2,
        title="filled: bounds; hollow: none",
    )
    return written(figure)


def _panel(panel: "Axes", scene: str, points: Sequence[Point], models: Sequence[str]) -> None:
    for k, model in enumerate(models):
        here = [p for p in points if p.model == model]
        if here:
            panel.plot(
                [p.seconds for p in here], [p.error for p in here], _marker(_MARKERS, k), color=_COLOURS[k % 9], ms=6,
                mfc=None if here[0].bounded else "none", ls="-" if len(here) > 1 else "", lw=0.8,
            )  # fmt: skip
    front = list(_steps([p for p in points if p.front]))
    panel.plot([x for x, _ in front], [y for _, y in front], color="0.4", lw=1, ls="--", zorder=0)
    panel.set(xscale="log", yscale="log", title=scene, xlabel=_TIME, ylabel=_ERROR)
    panel.tick_params(labelbottom=True, labelleft=True)
    panel.grid(alpha=0.25)


def _marker(markers: Sequence[str], k: int) -> str:
    """A mark that no other model of the same colour has."""
    return markers[(k + k // len(_COLOURS)) % len(markers)]


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

    scenes, models = _names(points)
    columns = min(_COLUMNS, len(scenes))
    rows = -(-len(scenes) // columns)
    figure = make_subplots(
        rows=rows, cols=columns, subplot_titles=scenes, horizontal_spacing=0.07, vertical_spacing=0.3 / rows
    )
    shown: set[str] = set()
    for number, scene in enumerate(scenes):
        place = {"row": number // columns + 1, "col": number % columns + 1}
        here = [p for p in points if p.scene == scene]
        for k, model in enumerate(models):
            mine = [p for p in here if p.model == model]
            if mine:
                figure.add_trace(go.Scatter(**_marks(mine, k, model not in shown)), **place)
                shown.add(model)
        figure.add_trace(go.Scatter(**_front(here, scene == scenes[-1])), **place)
    figure.update_xaxes(type="log", title_text=_TIME, exponentformat="power", dtick=1)
    figure.update_yaxes(type="log", title_text=_ERROR, exponentformat="power", dtick=2)
    figure.update_layout(
        title={"text": "Speed against accuracy of every model"},
        height=120 + 400 * rows, template="plotly_white", legend={"groupclick": "togglegroup"},
    )  # fmt: skip
    return str(figure.to_html(include_plotlyjs=True, div_id="chart", config={"displaylogo": False, "responsive": True}))


def _marks(points: Sequence[Point], k: int, first: bool) -> dict[str, Any]:
    hollow = "" if points[0].bounded else "-open"
    symbols = ("circle", "square", "diamond", "triangle-up", "triangle-down", "cross", "x", "star", "hexagon")
    return {
        "x": [p.seconds for p in points], "y": [p.error for p in points], "customdata": [p.said for p in points],
        "name": points[0].model,
        "mode": "lines+markers" if len(points) > 1 else "markers", "legendgroup": points[0].model, "showlegend": first,
        "marker": {"color": _COLOURS[k % 9], "symbol": _marker(symbols, k) + hollow, "size": 9},
        "line": {"width": 1, "color": _COLOURS[k % 9]},
        "hovertemplate": f"{points[0].model}<br>error %{{y:.3g}} in %{{x:.3g}} s<br>%{{customdata}}<extra></extra>",
    }  # fmt: skip


def _front(points: Sequence[Point], first: bool) -> dict[str, Any]:
    steps = list(_steps([p for p in points if p.front]))
    return {
        "x": [x for x, _ in steps], "y": [y for _, y in steps], "mode": "lines", "name": "Pareto front",
        "line": {"color": "grey", "width": 1.5, "dash": "dash"}, "legendgroup": "front", "showlegend": first,
        "hoverinfo": "skip",
    }  # fmt: skip


def _names(points: Sequence[Point]) -> tuple[list[str], list[str]]:
    """Scenes as measured; models, those with bounds first."""
    bounded = [p.model for p in points if p.bounded]
    return list(dict.fromkeys(p.scene for p in points)), sorted(set(bounded)) + sorted(
        {p.model for p in points} - set(bounded)
    )
