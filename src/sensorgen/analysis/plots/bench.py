"""A run on the bench in pictures: readings over time, what presses change, and all sets on one scale.

Raw and filtered readings with the points before and under each press (figures 6.26 to 6.29 of the thesis), differences
as surfaces over force and position (6.30 to 6.32), and normalised differences (6.33); PNG, and a page for the mouse.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from sensorgen.analysis.plots import panels
from sensorgen.analysis.plots.field import tone
from sensorgen.analysis.plots.libraries import needed
from sensorgen.measure.recording.samples import Complex, Real
from sensorgen.measure.signal.presses import Pairs
from sensorgen.measure.signal.surfaces import Surface, normalised, surface

PARTS = {"resistance": ("R", "real"), "reactance": ("X", "imag")}
_DRAWN = 2000  # columns that a curve is cut into: each keeps its least and its largest value
_RAW, _FILTERED, _BEFORE, _PRESSED = "#b8c4ce", "#0072b2", "#009e73", "#d55e00"
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#555555")
_MARKS = "osv^D<>"


@dataclass(frozen=True, eq=False)
class Run:
    """What is drawn of a run.

    Attributes
    ----------
    name : str
        Of the specimen, or the file.
    tones_hz : (m,) array
        Tones [Hz].
    time_s, raw_ohm : (n,) and (n, m) array
        Readings that count [s], [ohm].
    filtered_s, filtered_ohm : (k,) and (k, m) array
        The same, filtered [s], [ohm].
    pairs : Pairs
        Before and under each press.
    """

    name: str
    tones_hz: Real
    time_s: Real
    raw_ohm: Complex
    filtered_s: Real
    filtered_ohm: Complex
    pairs: Pairs


def decimated(time_s: Real, values: Real, columns: int = _DRAWN) -> tuple[Real, Real]:
    """A curve with fewer points that looks the same: the least and the largest value of each stretch, in their order.

    Parameters
    ----------
    time_s, values : (n,) array
        The curve.
    columns : int
        Stretches that it is cut into.
    """
    good = np.isfinite(values)
    time_s, values = time_s[good], values[good]
    width = len(values) // columns
    if width < 3:
        return time_s, values
    whole = len(values) // width * width
    blocks = values[:whole].reshape(-1, width)
    ends = np.sort(np.column_stack([blocks.argmin(axis=1), blocks.argmax(axis=1)]), axis=1)
    keep = np.unique(np.concatenate([(ends + np.arange(len(blocks))[:, None] * width).ravel(), [len(values) - 1]]))
    return time_s[keep], values[keep]


def over_time(run: Run) -> bytes:
    """R and X of every tone over time, raw and filtered, with the points before and under each press, as PNG."""
    needed("matplotlib")
    from matplotlib.figure import Figure

    count = len(run.tones_hz)
    figure = Figure(figsize=(11, 0.9 + 1.5 * count), dpi=100, layout="constrained")
    grid = figure.subplots(count, 2, squeeze=False, sharex=True)
    for k, row in enumerate(grid):
        for axes, (symbol, part) in zip(row, PARTS.values(), strict=True):
            divisor, unit = _scale(getattr(run.raw_ohm, part)[:, k])
            for x, y, how in _curves(run, part, k):
                axes.plot(x, y / divisor, **how)
            axes.set_ylabel(f"{symbol} [{unit}]")
            axes.set_title(tone(run.tones_hz[k]), fontsize="small", loc="left", pad=2)
            axes.yaxis.set_major_formatter(panels.plain())
            axes.margins(x=0.01)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    handles, labels = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=4, frameon=False)
    figure.suptitle(_text(run.name), x=0.01, ha="left", fontsize="medium")
    return panels.png(figure)


def _curves(run: Run, part: str, k: int) -> list[tuple[Real, Real, dict[str, Any]]]:
    """Curves of one tone: x, y, and how they are drawn."""
    raw = decimated(run.time_s, getattr(run.raw_ohm, part)[:, k])
    smooth = decimated(run.filtered_s, getattr(run.filtered_ohm, part)[:, k])
    dots = {"linestyle": "none", "markersize": 3.5}
    before, pressed = (getattr(z, part)[:, k] for z in (run.pairs.before_ohm, run.pairs.pressed_ohm))
    return [
        (*raw, {"color": _RAW, "linewidth": 0.5, "label": "raw"}),
        (*smooth, {"color": _FILTERED, "linewidth": 1.0, "label": "filtered"}),
        (
            run.pairs.time_s,
            before,
            dots | {"marker": "o", "color": _BEFORE, "markerfacecolor": "none", "label": "before"},
        ),
        (run.pairs.time_s, pressed, dots | {"marker": ".", "color": _PRESSED, "markersize": 6, "label": "pressed"}),
    ]


def _text(name: str) -> str:
    """A name that is no formula: dollar signs stay dollar signs."""
    return name.replace("$", r"\$")


def _scale(values: Real) -> tuple[float, str]:
    """Divisor and unit in which values are easily read."""
    most = float(np.nanmax(np.abs(values), initial=0))
    return (1e6, "MΩ") if most >= 1e6 else (1e3, "kΩ") if most >= 1e3 else (1.0, "Ω") if most >= 1 else (1e-3, "mΩ")


def difference_surface(pairs: Pairs, part: str) -> Surface:
    """Differences of "resistance" or "reactance" by the presses, over force and position [ohm]."""
    return surface(pairs.force_n, pairs.position_mm, getattr(pairs.difference_ohm, PARTS[part][1]))


def surfaces(run: Run, part: str) -> bytes:
    """What presses change of "resistance" or "reactance", over force and position, one map per tone, as PNG.

    Raises
    ------
    BadInput
        As :func:`sensorgen.measure.signal.surfaces.surface`.
    """
    needed("matplotlib")
    from matplotlib.figure import Figure

    through, symbol = difference_surface(run.pairs, part), PARTS[part][0]
    count = len(run.tones_hz)
    columns = min(panels.COLUMNS, count)
    rows = -(-count // columns)
    figure = Figure(figsize=(0.6 + max(6.5, 3.1 * columns), 0.7 + 2.7 * rows), dpi=100, layout="constrained")
    figure.suptitle(f"{_text(run.name)}: change of the {part} by a press; dots: presses", fontsize="medium")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid[count:]:
        axes.set_axis_off()
    for k, axes in enumerate(grid[:count]):
        divisor, unit = _scale(through.values[..., k])
        shown = through.values[..., k] / divisor
        signed = bool(np.nanmin(shown) < 0 < np.nanmax(shown))
        limit = float(np.nanmax(np.abs(shown)))
        mesh = axes.pcolormesh(
            through.position_mm, through.force_n, shown, shading="nearest", rasterized=True,
            **({"cmap": "PuOr", "vmin": -limit, "vmax": limit} if signed else {"cmap": "viridis"}),
        )  # fmt: skip
        axes.plot(run.pairs.position_mm, run.pairs.force_n, ".", color="black", markersize=2)
        figure.colorbar(mesh, ax=axes, format=panels.plain())
        axes.set_title(f"Δ{symbol} [{unit}] at {tone(run.tones_hz[k])}", fontsize="medium")
        first, last = panels.outer(k, count)
        axes.set_ylabel("force F [N]" if first else "")
        axes.set_xlabel("position x [mm]" if last else "")
    return panels.png(figure)


def normalised_differences(runs: Mapping[str, Pairs], tones_hz: Real, *, together: bool = False) -> bytes:
    """Differences of several sets on one scale from 0 to 1, over force, R above X and one column per tone, as PNG.

    Parameters
    ----------
    runs : mapping of str to Pairs
        By the name of the set, all with the same tones.
    tones_hz : (m,) array
        Tones [Hz].
    together : bool
        As :func:`sensorgen.measure.signal.surfaces.normalised`.
    """
    needed("matplotlib")
    from matplotlib.figure import Figure

    count = len(tones_hz)
    figure = Figure(figsize=(1.0 + max(6.0, 1.75 * count), 5.2), dpi=100, layout="constrained")
    grid = figure.subplots(2, count, squeeze=False, sharex=True, sharey=True)
    for row, (symbol, part) in zip(grid, PARTS.values(), strict=True):
        scaled = normalised([getattr(pairs.difference_ohm, part) for pairs in runs.values()], together=together)
        for j, ((name, pairs), values) in enumerate(zip(runs.items(), scaled, strict=True)):
            for k, axes in enumerate(row):
                axes.plot(
                    pairs.force_n, values[:, k], _MARKS[j % 7], color=_COLOURS[j % 7], markersize=3, alpha=0.7,
                    label=_text(name) if k == 0 else None, markeredgewidth=0,
                )  # fmt: skip
        row[0].set_ylabel(f"Δ{symbol}, normalised")
    for k, axes in enumerate(grid[0]):
        axes.set_title(tone(tones_hz[k]), fontsize="medium")
    figure.supxlabel("force F [N]", fontsize="medium")
    handles, labels = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=min(6, len(labels)), frameon=False)
    return panels.png(figure)


def html(run: Run) -> str:
    """The run as a page: readings over time and surfaces of the differences, tone by tone; no network needed."""
    needed("plotly")
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    figure = make_subplots(
        rows=3, cols=2, row_heights=[0.27, 0.27, 0.46], vertical_spacing=0.07, horizontal_spacing=0.06,
        specs=[[{"colspan": 2}, None], [{"colspan": 2}, None], [{"type": "surface"}, {"type": "surface"}]],
    )  # fmt: skip
    through = {part: difference_surface(run.pairs, part) for part in PARTS}
    for k in range(len(run.tones_hz)):
        for row, (symbol, part) in enumerate(PARTS.values(), 1):
            for x, y, how in _curves(run, part, k):
                figure.add_trace(go.Scattergl(**_line(x, y, how, symbol, k == 0, row == 1)), row=row, col=1)
        for column, part in enumerate(PARTS, 1):
            figure.add_trace(go.Surface(**_turned(through[part], part, k)), row=3, col=column)
    _dress(figure, run)
    return str(figure.to_html(include_plotlyjs=True, div_id="run", config={"displaylogo": False, "responsive": True}))


def _line(x: Real, y: Real, how: Mapping[str, Any], symbol: str, shown: bool, first: bool) -> dict[str, Any]:
    dots = how.get("linestyle") == "none"
    hollow = "-open" if how.get("markerfacecolor") == "none" else ""
    return {
        "x": x, "y": y, "name": how["label"], "mode": "markers" if dots else "lines", "visible": shown,
        "legendgroup": how["label"], "showlegend": first, "hovertemplate": f"%{{x:.2f}} s, {symbol} %{{y:.6g}} Ω",
    } | ({"marker": {"color": how["color"], "size": 7, "symbol": f"circle{hollow}"}} if dots else
         {"line": {"color": how["color"], "width": how["linewidth"]}})  # fmt: skip


def _turned(through: Surface, part: str, k: int) -> dict[str, Any]:
    symbol = PARTS[part][0]
    return {
        "x": through.position_mm, "y": through.force_n, "z": through.values[..., k], "visible": k == 0,
        "showscale": False, "colorscale": "Viridis", "name": f"Δ{symbol}",
        "hovertemplate": f"force %{{y:.3g}} N, position %{{x:.4g}} mm<br>Δ{symbol} = %{{z:.5g}} Ω<extra></extra>",
    }  # fmt: skip


def _dress(figure: Any, run: Run) -> None:
    """Axes with their units, and the slider of tones."""
    names = [tone(f) for f in run.tones_hz]
    per_tone = len(figure.data) // len(names)
    count = len(figure.data)
    shown = [[i // per_tone == k for i in range(count)] for k in range(len(names))]
    steps = [
        {"label": name, "method": "restyle", "args": [{"visible": which}]}
        for name, which in zip(names, shown, strict=True)
    ]
    figure.update_xaxes(title_text="time [s]", row=2, col=1)
    figure.update_xaxes(matches="x", row=2, col=1)
    for row, (symbol, _) in enumerate(PARTS.values(), 1):
        figure.update_yaxes(title_text=f"{symbol} [Ω]", row=row, col=1)
    for scene, (symbol, _) in zip(("scene", "scene2"), PARTS.values(), strict=True):
        figure.update_layout({scene: {
            "xaxis_title": "position [mm]", "yaxis_title": "force [N]", "zaxis_title": f"Δ{symbol} [Ω]",
            "camera": {"eye": {"x": 1.6, "y": 1.6, "z": 1.0}, "center": {"x": 0, "y": 0, "z": -0.2}},
        }})  # fmt: skip
    figure.update_layout(
        title={"text": escape(run.name)}, height=1150, template="plotly_white", legend={"orientation": "h", "y": 1.03},
        margin={"t": 90}, sliders=[{"active": 0, "currentvalue": {"prefix": "tone "}, "steps": steps}],
    )  # fmt: skip


def schedule(steps: Sequence[Any], seconds: float) -> bytes:
    """The plan of a run: force over position in the order of the run, and force over time, as PNG."""
    needed("matplotlib")
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 3.6), dpi=100, layout="constrained")
    where, when = figure.subplots(1, 2, width_ratios=[1, 1.4])
    dots = where.scatter(
        [s.position_mm for s in steps], [s.force_n for s in steps], c=[s.press for s in steps], s=14, cmap="viridis"
    )
    figure.colorbar(dots, ax=where, label="press")
    where.set(xlabel="position x [mm]", ylabel="force F [N]")
    edges = [edge for s in steps for edge in _pulse(s.start_s, s.start_s + s.dwell_s, s.force_n)]
    x, y = zip((0.0, 0.0), *edges, (seconds, 0.0), strict=True)
    divisor, unit = (60.0, "min") if seconds > 600 else (1.0, "s")
    when.plot(np.array(x) / divisor, y, color=_FILTERED, linewidth=0.7)
    when.set(xlabel=f"time [{unit}]", ylabel="force F [N]")
    when.margins(x=0.01)
    return panels.png(figure)


def _pulse(start_s: float, end_s: float, force_n: float) -> list[tuple[float, float]]:
    return [(start_s, 0.0), (start_s, force_n), (end_s, force_n), (end_s, 0.0)]
