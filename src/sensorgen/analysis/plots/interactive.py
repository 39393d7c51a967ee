"""Figures for a browser: plain data that Plotly's script draws; the Python library itself is not used."""

import base64
from collections.abc import Iterator, Sequence
from html import escape
from math import isfinite, log10
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.analysis.plots.figure import Axis, BodyTriangles, Curve, Figure, Map, Panel, Values
from sensorgen.core.arrays import Real

_ROW_PX, _LEAST_PX, _PANEL_PX, _SOLID_PX, _FRAME_PX = 19, 260, 320, 560, 110
_BELOW_PX = 58  # from the last axis to a legend: below its title
_MOST_MARKS = 4000  # of a map without a grid; WebGL would take more, but compiles scripts, which the page forbids
_GAPS = (0.08, 0.34)  # between panels, of a panel's height: over one axis, or each over its own
_DIVERGING = [[0, "#7f3b08"], [0.25, "#f1a340"], [0.5, "#f7f7f7"], [0.75, "#998ec3"], [1, "#2d004b"]]
# Words of logarithmic ticks by the unit, else plain numbers; without a format, 20 is written as 2
_LOG = {"[-]": {"exponentformat": "power"}, "[ohm]": {"tickformat": "~s"}, "[Hz]": {"tickformat": "~s"}}

Data = dict[str, Any]


def data(figure: Figure) -> Data:
    """A figure as data for the page's script: name, layout and traces of each choice."""
    choices = [
        {"name": name, "layout": _layout(panels, figure), "data": list(_all_traces(panels))}
        for name, panels in figure.choices.items()
    ]
    return {"key": figure.key, "chooser": figure.chooser, "choices": choices}


def _all_traces(panels: Sequence[Panel]) -> Iterator[Data]:
    """Of all panels; a name that comes again is not in the legend again."""
    named: set[str] = set()
    for k, panel in enumerate(panels):
        for trace in _traces(panel, _domain(panels, k)):
            if trace.get("showlegend"):
                trace["showlegend"] = trace["name"] not in named
                named.add(trace["name"])
            axes = "y" if _alike(panels) else "yx"
            yield trace | ({f"{axis}axis": f"{axis}{k + 1}" for axis in axes} if k else {})


def _traces(panel: Panel, domain: list[float]) -> Iterator[Data]:
    for part in panel.content:
        if isinstance(part, BodyTriangles):
            yield _body(part)
        elif isinstance(part, Map):
            yield from _map(part, panel, domain)
        else:
            yield _curve(part, panel)


def height_px(figure: Figure) -> int:
    """Height at which it is drawn [px]."""
    panels = next(iter(figure.choices.values()))
    if panels[0].solid:
        return _SOLID_PX
    return max(_LEAST_PX, _FRAME_PX + sum(_ROW_PX * len(panel.y.names) or _PANEL_PX for panel in panels))


def _layout(panels: Sequence[Panel], figure: Figure) -> Data:
    solid = panels[0].solid
    layout: Data = {
        "height": height_px(figure), "margin": {"l": 60, "r": 12, "t": 20, "b": 44}, "barmode": "stack",
        "hovermode": "closest", "dragmode": "turntable" if solid else "zoom",
        "legend": {"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0},
    }  # fmt: skip
    if solid:
        return layout | {"scene": _scene(panels[0], figure.stretch), "margin": {"l": 0, "r": 0, "t": 0, "b": 0}}
    alike = _alike(panels)
    numbers = ["", *map(str, range(2, len(panels) + 1))]
    for k, (number, panel) in enumerate(zip(numbers, panels, strict=True)):
        layout[f"yaxis{number}"] = _axis(panel.y) | {"domain": _domain(panels, k)}
        if not alike:
            layout[f"xaxis{number}"] = _axis(panel.x) | {"anchor": f"y{number}"}
            layout[f"yaxis{number}"]["anchor"] = f"x{number}"
        if panel.equal:
            layout[f"yaxis{number}"]["scaleanchor"] = f"x{'' if alike else number}"
    if alike:
        layout["xaxis"] = _axis(panels[0].x) | {"anchor": f"y{numbers[-1]}"}
    if len(panels) > 1 and not figure.chooser:
        layout["annotations"] = _titles(panels)
        layout["legend"] |= {"y": -_BELOW_PX / (height_px(figure) - _FRAME_PX), "yanchor": "top"}
    return layout


def _titles(panels: Sequence[Panel]) -> list[Data]:
    """Titles over the panels that have one."""
    return [
        {"text": escape(panel.title), "xref": "paper", "yref": "paper", "x": 0, "y": _domain(panels, k)[1],
         "yanchor": "bottom", "showarrow": False} for k, panel in enumerate(panels) if panel.title
    ]  # fmt: skip


def _alike(panels: Sequence[Panel]) -> bool:
    """True where all panels have one axis across."""
    return all(panel.x == panels[0].x for panel in panels)


def _domain(panels: Sequence[Panel], k: int) -> list[float]:
    """Lower and upper end of a panel, of the height of all."""
    gap = _GAPS[not _alike(panels)]
    share = 1 / (len(panels) + (len(panels) - 1) * gap)
    top = 1 - k * (1 + gap) * share
    return [max(0.0, top - share), top]


def _axis(axis: Axis) -> Data:
    data: Data = {"title": {"text": escape(axis.title)}, "automargin": True, "zeroline": False}
    if axis.log:
        data |= {"type": "log", **_LOG.get(axis.title.rpartition(" ")[2], {"tickformat": "~g"})}
    if isfinite(axis.low) and isfinite(axis.high):
        data["range"] = [log10(end) if axis.log else end for end in (axis.low, axis.high)]
    elif isfinite(axis.low):
        data["rangemode"] = "tozero"
    if axis.names:
        names = [escape(n) for n in axis.names]
        data |= {
            "type": "category", "categoryorder": "array", "categoryarray": names,
            "range": [len(names) - 0.5, -0.5], "tickmode": "array", "tickvals": names,
        }  # fmt: skip
    return data


def _scene(panel: Panel, stretch: tuple[float, float, float]) -> Data:
    corners = np.vstack([body.vertices_mm for body in panel.content if isinstance(body, BodyTriangles)])
    size = np.ptp(corners, axis=0) * stretch
    axes = {
        f"{name}axis": {"title": {"text": escape(axis.title)}}
        for name, axis in zip("xyz", (panel.x, panel.y, panel.z), strict=True)
    }
    return axes | {
        "aspectmode": "manual", "aspectratio": dict(zip("xyz", (size / size.max() * 2).tolist(), strict=True)),
        "camera": {"eye": {"x": -0.75, "y": -1.25, "z": 0.75}},
    }  # fmt: skip


def _body(body: BodyTriangles) -> Data:
    numbers = (*body.vertices_mm.T, *body.triangles.T)
    return {
        "type": "mesh3d", "name": escape(body.name), "showlegend": True, "color": body.colour, "flatshading": True,
        **{name: packed(values) for name, values in zip("xyzijk", numbers, strict=True)},
        "lighting": {"ambient": 0.55, "diffuse": 0.7, "specular": 0.05}, "hoverinfo": "name",
    }  # fmt: skip


def _map(part: Map, panel: Panel, domain: list[float]) -> Iterator[Data]:
    """The colours, and the lines along which the quantity has certain values; log scales as powers of ten."""
    values = np.log10(part.values) if part.log else part.values
    low, high = (log10(end) for end in part.span) if part.log else part.span
    colours: Any = _DIVERGING if part.signed else "Viridis"
    bar = _bar(part, low, high, domain)
    across, up = (escape(axis.title.partition(" [")[0]) for axis in (panel.x, panel.y))
    if part.values.ndim == 2 and part.x.ndim == 1:
        grid = {"x": packed(part.x), "y": packed(part.y), "z": packed(values)}
        value = "customdata" if part.log else "z"
        yield grid | {"zmin": low, "zmax": high} | {
            "type": "heatmap", "colorscale": colours, "reversescale": part.log, "colorbar": bar,
            "hovertemplate": f"{across} %{{x:.4g}}, {up} %{{y:.4g}}: %{{{value}:.5g}}<extra></extra>",
        } | ({"customdata": packed(part.values)} if part.log else {})  # fmt: skip
        yield from _levels(part, grid)
        return
    x, y, colour = _thinned(part.x, part.y, values)
    yield {
        "type": "scatter", "mode": "markers", "x": packed(x), "y": packed(y), "showlegend": False,
        "hovertemplate": f"{across} %{{x:.5g}}, {up} %{{y:.5g}}: %{{marker.color:.5g}}<extra></extra>",
        "marker": {"size": 5, "color": packed(colour), "colorscale": colours, "cmin": low, "cmax": high,
                   "colorbar": bar},
    }  # fmt: skip


def _bar(part: Map, low: float, high: float, domain: list[float]) -> Data:
    """Bar of the colours; of a log scale its ticks are powers of ten."""
    bar: Data = {"thickness": 12, "title": {"text": escape(part.label), "side": "right"}, "y": sum(domain) / 2,
                 "len": domain[1] - domain[0], "lenmode": "fraction"}  # fmt: skip
    if not part.log:
        return bar
    ticks = np.arange(np.ceil(low), np.floor(high) + 1)
    return bar | {"tickvals": ticks.tolist(), "ticktext": [f"{10.0**t:g}" for t in ticks]}


def _thinned(x: Real, y: Real, values: Real) -> tuple[Real, ...]:
    """Every so many of the values along each axis, at most ``_MOST_MARKS`` in all."""
    every = max(1, round((values.size / _MOST_MARKS) ** (1 / values.ndim)))
    return tuple(v[(slice(None, None, every),) * v.ndim].ravel() for v in (x, y, values))


def _levels(part: Map, grid: Data) -> Iterator[Data]:
    """White lines along which a quantity on a log scale has certain values, the first one solid."""
    for k, level in enumerate(map(log10, part.levels) if part.log else ()):
        yield grid | {
            "type": "contour", "showscale": False, "hoverinfo": "skip",
            "contours": {"coloring": "lines", "start": level, "end": level, "size": 1},
            "line": {"dash": "dash" if k else "solid", "width": 2}, "colorscale": [[0, "#fff"], [1, "#fff"]],
    }  # fmt: skip


def _curve(curve: Curve, panel: Panel) -> Data:
    common = {
        "name": escape(curve.name), "showlegend": bool(curve.name), "legendgroup": escape(curve.name),
        "x": _values(curve.x), "y": _values(curve.y),
    }  # fmt: skip
    if curve.kind == "bars":
        return common | {"type": "bar", "orientation": "h", "marker": {"color": curve.colour}}
    if curve.kind == "ranges":
        return common | {
            "type": "scatter", "mode": "markers",
            "marker": {"color": curve.colour, "symbol": "line-ns-open", "size": 9},
            "error_x": _spread(curve, {"thickness": 9, "width": 0, "color": curve.colour + "70"}),
            "hovertemplate": "%{y}: predicted %{x:.4g}<extra></extra>",
        }  # fmt: skip
    if curve.kind == "line":
        line = {"color": curve.colour, "dash": curve.dash, "width": 1.4}
        trace = common | {"type": "scatter", "mode": "lines", "line": line}
    else:
        marker = {"color": curve.colour, "symbol": curve.symbol, "size": 8 if len(curve.x) < 200 else 5}
        trace = common | {"type": "scatter", "mode": "markers", "marker": marker}
    if len(curve.low):
        trace["error_x"] = _spread(curve, {"thickness": 1.5, "width": 4, "color": curve.colour})
    if len(curve.text):
        where = "%{y}: %{x:.4g}<br>%{text}" if panel.y.names else "%{text}<br>%{x:.4g}, %{y:.4g}"
        trace |= {"text": [escape(t) for t in curve.text], "hovertemplate": f"{where}<extra></extra>"}
    return trace


def _spread(curve: Curve, how: Data) -> Data:
    at, low, high = (np.asarray(values, float) for values in (curve.x, curve.low, curve.high))
    return {"type": "data", "symmetric": False, "array": _values(high - at), "arrayminus": _values(at - low), **how}


def _values(values: Values) -> Any:
    if isinstance(values, np.ndarray):
        return packed(values)
    return [escape(v) if isinstance(v, str) else float(v) if isfinite(v) else None for v in values]


def packed(values: NDArray[Any] | Sequence[float]) -> dict[str, str]:
    """Numbers as Plotly's script takes them in fewest letters: single precision where that does, shape beside."""
    array = np.asarray(values)
    finite = array[np.isfinite(array)]
    # values that differ little for their size would show steps in single precision
    fine = bool(finite.size and np.ptp(finite) < 1e-4 * np.abs(finite).max())
    whole = array.dtype.kind in "iu" and ("<u2" if np.array_equal(array, array.astype("<u2")) else "<i4")
    small = array.astype(whole or ("<f8" if fine else "<f4"))
    data = {"dtype": small.dtype.str[1:], "bdata": base64.b64encode(small.tobytes()).decode()}
    return data | ({"shape": ", ".join(map(str, array.shape))} if array.ndim > 1 else {})
