"""The figures of a report as PNG and SVG, the same to the byte every time."""

from collections.abc import Iterator
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.analysis.plots.libraries import needed
from sensorgen.analysis.report.charts import GREY, Axis, Body, Chart, Content, Relief, Trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis as AxisOf
    from matplotlib.figure import Figure

_WIDE_IN, _ROW_IN, _PANEL_IN, _FRAME_IN = 9.0, 0.17, 3.0, 1.3
_MARKERS = {"circle": "o", "square": "s", "diamond": "D", "cross": "X", "x": "x"}
_STYLES = {"solid": "-", "dash": "--"}
# Names and remarks are text and no formulas; SVG keeps letters as letters, and no random names.
_HOW: Any = {"text.parse_math": False, "svg.fonttype": "none", "svg.hashsalt": "sensorgen", "font.size": 9}


def files(chart: Chart) -> Iterator[tuple[str, bytes]]:
    """Name and content of a figure's files: each of its choices as PNG and as SVG."""
    needed("matplotlib")
    import matplotlib as mpl

    for k, (choice, content) in enumerate(chart.choices.items()):
        with mpl.rc_context(_HOW):
            figure = _figure(chart, choice, content)
            stem = f"{chart.key}-{k + 1}-{_plain(choice)}" if chart.chooser else chart.key
            for kind, how in (("png", {"Software": None}), ("svg", {"Date": None, "Creator": None})):
                target = BytesIO()
                figure.savefig(target, format=kind, dpi=110, metadata=how)
                yield f"{stem}.{kind}", target.getvalue()


def _plain(name: str) -> str:
    """A choice as a part of a file's name."""
    return "".join(c if c.isascii() and (c.isalnum() or c in ".-_") else "-" for c in name)[:60]


def _figure(chart: Chart, choice: str, content: Content) -> "Figure":
    from matplotlib.figure import Figure

    rows = [_ROW_IN * len(axis.names) or _PANEL_IN for axis in chart.y] if not chart.solid else [4.0]
    figure = Figure(figsize=(_WIDE_IN, _FRAME_IN + sum(rows)), layout="constrained")
    figure.suptitle(": ".join(filter(None, (chart.title, choice))), fontsize="large")
    if isinstance(content[0], Body):
        _bodies(figure, chart, content)
    elif isinstance(content[0], Relief):
        _relief(figure, chart, content[0])
    else:
        panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False, height_ratios=rows).ravel()
        _panels(chart, list(panels), content)
    return figure


def _panels(chart: Chart, panels: "list[Axes]", content: Content) -> None:
    for k, (panel, axis) in enumerate(zip(panels, chart.y, strict=True)):
        here = [trace for trace in content if isinstance(trace, Trace) and trace.row == k]
        places = {name: j for j, name in enumerate(axis.names)}
        left = np.zeros(max(1, len(axis.names)))
        for trace in here:
            _trace(panel, trace, places, left)
        _dress(panel, chart.x if k == len(panels) - 1 else Axis("", log=chart.x.log), axis)
        if any(trace.name for trace in here):
            panel.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=3, frameon=False, fontsize="small")


def _dress(panel: "Axes", x: Axis, y: Axis) -> None:
    panel.set(xlabel=x.title, ylabel=y.title, xscale="log" if x.log else "linear")
    if not y.names:
        panel.set_yscale("log" if y.log else "linear")
    else:
        panel.set_yticks(range(len(y.names)), y.names)
        panel.set_ylim(len(y.names) - 0.4, -0.6)
    if np.isfinite(x.low):
        panel.set_xlim(x.low, x.high)
    for axis, log in ((panel.xaxis, x.log), (panel.yaxis, y.log and not y.names)):
        if log:
            _decades(axis)
    panel.grid(alpha=0.3)
    panel.set_axisbelow(True)


def _decades(axis: "AxisOf") -> None:
    """Plain numbers at a logarithmic axis, between the decades too where there are few: formulas are not drawn."""
    from matplotlib.ticker import LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    between = (1.0, 2.0, 3.0, 5.0, 7.0) if high < 10 * low else (1.0, 2.0, 5.0) if high < 1e3 * low else (1.0,)
    axis.set_major_locator(LogLocator(subs=between))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def _trace(panel: "Axes", trace: Trace, places: dict[str, int], left: Any) -> None:
    x = np.asarray(trace.x, float)
    y: Any = [places[str(name)] for name in trace.y] if places else np.asarray(trace.y, float)
    label = trace.name or "_nolegend_"
    if trace.kind == "bars":
        panel.barh(y, x, left=left[y], color=trace.colour, label=label)
        left[y] += x
    elif trace.kind == "ranges":
        panel.hlines(y, trace.low, trace.high, color=GREY, alpha=0.5, lw=6, label=label)
        panel.plot(x, y, "|", color="0.3", ms=7)
    elif trace.kind == "line":
        panel.plot(x, y, _STYLES[trace.dash], color=trace.colour, lw=1, label=label)
    else:
        if len(trace.low):
            panel.hlines(y, trace.low, trace.high, color=trace.colour, lw=1.2)
        panel.plot(x, y, _MARKERS[trace.symbol], color=trace.colour, ms=5, label=label)


def _bodies(figure: "Figure", chart: Chart, content: Content) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    panel: Any = figure.add_subplot(projection="3d")
    bodies = [body for body in content if isinstance(body, Body)]
    faces = np.concatenate([body.vertices_mm[body.triangles] for body in bodies])
    colours = [body.colour for body in bodies for _ in body.triangles]
    panel.add_collection3d(Poly3DCollection(faces, facecolors=colours, shade=True, rasterized=True))
    for body in bodies:
        panel.plot([], [], [], "s", color=body.colour, label=body.name)
    low, high = faces.min(axis=(0, 1)), faces.max(axis=(0, 1))
    for axis, least, most in zip("xyz", low, high, strict=True):
        getattr(panel, f"set_{axis}lim")(least, most, view_margin=0)
    panel.set_box_aspect((high - low) * chart.stretch, zoom=1.5)
    panel.set(xlabel=chart.x.title, ylabel=chart.y[0].title, zlabel=chart.y[1].title)
    panel.view_init(elev=30, azim=-65)
    panel.legend(loc="upper left", frameon=False)


def _relief(figure: "Figure", chart: Chart, relief: Relief) -> None:
    panel = figure.add_subplot()
    drawn = panel.pcolormesh(relief.position_mm, relief.force_n, relief.values, shading="nearest", cmap="viridis")
    figure.colorbar(drawn, ax=panel, label=chart.y[1].title)
    panel.set(xlabel=chart.x.title, ylabel=chart.y[0].title)
