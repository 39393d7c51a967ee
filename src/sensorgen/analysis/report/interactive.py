"""Figures for a browser: plain data that Plotly's script draws, without the library itself."""

import base64
from collections.abc import Sequence
from html import escape
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.analysis.report.charts import Axis, Body, Chart, Relief, Trace, Values

_ROW_PX, _LEAST_PX, _PANEL_PX, _SOLID_PX = 19, 260, 380, 560
_MODES = {"points": "markers", "line": "lines"}


def figure(chart: Chart) -> dict[str, Any]:
    """A figure as data for the page's script: layout, and the traces of each choice."""
    return {
        "key": chart.key,
        "layout": _layout(chart),
        "choices": [
            {"name": name, "data": [_drawn(part, chart) for part in content]} for name, content in chart.choices.items()
        ],
    }


def height_px(chart: Chart) -> int:
    """How high it is drawn [px]."""
    if chart.solid:
        return _SOLID_PX
    return max(_LEAST_PX, 110 + sum(_ROW_PX * len(axis.names) or _PANEL_PX for axis in chart.y))


def _layout(chart: Chart) -> dict[str, Any]:
    layout: dict[str, Any] = {
        "height": height_px(chart), "margin": {"l": 60, "r": 12, "t": 8, "b": 44}, "barmode": "stack",
        "hovermode": "closest", "dragmode": "turntable" if chart.solid else "zoom",
        "legend": {"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0},
    }  # fmt: skip
    if chart.solid:
        return layout | {"scene": _scene(chart), "margin": {"l": 0, "r": 0, "t": 0, "b": 0}}
    layout["xaxis"] = _axis(chart.x)
    gap, count = 0.08, len(chart.y)
    for k, axis in enumerate(chart.y):
        top = 1 - k * (1 + gap) / (count + (count - 1) * gap)
        layout[f"yaxis{k + 1 if k else ''}"] = _axis(axis) | {
            "domain": [max(0.0, top - 1 / (count + (count - 1) * gap)), top]
        }
    if count > 1:
        layout["xaxis"]["anchor"] = f"y{count}"
    return layout


def _axis(axis: Axis) -> dict[str, Any]:
    found: dict[str, Any] = {"title": {"text": escape(axis.title)}, "automargin": True, "zeroline": False}
    if axis.log:
        found |= {"type": "log", "exponentformat": "SI"}
    if isfinite(axis.low):
        found["range"] = [axis.low, axis.high]
    if axis.names:
        found |= {
            "type": "category", "categoryorder": "array", "categoryarray": [escape(n) for n in axis.names],
            "range": [len(axis.names) - 0.5, -0.5], "tickmode": "array", "tickvals": [escape(n) for n in axis.names],
        }  # fmt: skip
    return found


def _scene(chart: Chart) -> dict[str, Any]:
    first = next(iter(chart.choices.values()))[0]
    axes = {
        f"{name}axis": {"title": {"text": escape(axis.title)}}
        for name, axis in zip("xyz", (chart.x, *chart.y), strict=True)
    }
    if isinstance(first, Body):
        corners = [body.vertices_mm for body in next(iter(chart.choices.values())) if isinstance(body, Body)]
        size = np.ptp(np.vstack(corners), axis=0) * chart.stretch
        ratio = dict(zip("xyz", (size / size.max() * 2).tolist(), strict=True))
        return axes | {
            "aspectmode": "manual",
            "aspectratio": ratio,
            "camera": {"eye": {"x": -0.75, "y": -1.25, "z": 0.75}},
        }
    return axes | {
        "aspectmode": "manual",
        "aspectratio": {"x": 1.4, "y": 1, "z": 0.8},
        "camera": {"eye": {"x": -1.4, "y": -1.6, "z": 0.9}},
    }


def _drawn(part: Trace | Body | Relief, chart: Chart) -> dict[str, Any]:
    if isinstance(part, Body):
        return _body(part)
    if isinstance(part, Relief):
        return {
            "type": "surface", "x": packed(part.position_mm), "y": packed(part.force_n), "z": packed(part.values),
            "colorscale": "Viridis", "showscale": True, "colorbar": {"thickness": 12, "len": 0.6},
            "hovertemplate": "%{x:.4g} mm, %{y:.4g} N: %{z:.5g}<extra></extra>",
        }  # fmt: skip
    return _trace(part, chart)


def _body(body: Body) -> dict[str, Any]:
    x, y, z = body.vertices_mm.T
    i, j, k = body.triangles.T
    return {
        "type": "mesh3d", "name": escape(body.name), "showlegend": True, "color": body.colour, "flatshading": True,
        **{name: packed(values) for name, values in zip("xyzijk", (x, y, z, i, j, k), strict=True)},
        "lighting": {"ambient": 0.55, "diffuse": 0.7, "specular": 0.05}, "hoverinfo": "name",
    }  # fmt: skip


def _trace(part: Trace, chart: Chart) -> dict[str, Any]:
    axis = {"yaxis": f"y{part.row + 1}"} if part.row else {}
    common = {
        "name": escape(part.name),
        "showlegend": bool(part.name),
        "x": _values(part.x),
        "y": _values(part.y),
        **axis,
    }
    if part.kind == "bars":
        return common | {"type": "bar", "orientation": "h", "marker": {"color": part.colour}}
    if part.kind == "ranges":
        return common | _range(part)
    drawn = common | {
        "type": "scatter",
        "mode": _MODES[part.kind],
        "marker": {"color": part.colour, "symbol": part.symbol, "size": 8},
    }
    if part.kind == "line":
        drawn |= {"line": {"color": part.colour, "dash": part.dash, "width": 1.4}}
    if len(part.low):
        drawn["error_x"] = _spread(part, {"thickness": 1.5, "width": 4, "color": part.colour})
    if len(part.text):
        drawn |= {"text": [escape(t) for t in part.text], "hovertemplate": "%{y}: %{x:.4g}<br>%{text}<extra></extra>"}
        if not chart.y[0].names:
            drawn["hovertemplate"] = "%{text}<br>%{x:.4g}, %{y:.4g}<extra></extra>"
    return drawn


def _range(part: Trace) -> dict[str, Any]:
    """A broad stroke from the one end to the other."""
    return {
        "type": "scatter", "mode": "markers", "marker": {"color": part.colour, "symbol": "line-ns-open", "size": 9},
        "error_x": _spread(part, {"thickness": 9, "width": 0, "color": part.colour + "70"}),
        "hovertemplate": "%{y}: predicted %{x:.4g}<extra></extra>",
    }  # fmt: skip


def _spread(part: Trace, how: dict[str, Any]) -> dict[str, Any]:
    at, low, high = (np.asarray(values, float) for values in (part.x, part.low, part.high))
    return {"type": "data", "symmetric": False, "array": _values(high - at), "arrayminus": _values(at - low), **how}


def _values(values: Values) -> Any:
    if isinstance(values, np.ndarray):
        return packed(values)
    return [escape(v) if isinstance(v, str) else float(v) if isfinite(v) else None for v in values]


def packed(values: NDArray[Any] | Sequence[float]) -> dict[str, str]:
    """Numbers as Plotly's script takes them in fewest letters: single precision where that does, shape beside."""
    array = np.asarray(values)
    small = array.astype("<i4" if array.dtype.kind in "iu" else "<f8" if _fine(array) else "<f4")
    found = {"dtype": small.dtype.str[1:], "bdata": base64.b64encode(small.tobytes()).decode()}
    return found | ({"shape": ", ".join(map(str, array.shape))} if array.ndim > 1 else {})


def _fine(array: NDArray[Any]) -> bool:
    """Whether single precision would show: values that differ little for their size."""
    finite = array[np.isfinite(array)]
    return bool(finite.size and np.ptp(finite) < 1e-4 * np.abs(finite).max())
