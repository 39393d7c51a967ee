"""Figures as PNG and SVG by matplotlib, without a display, the same to the byte every time."""

from collections.abc import Iterator, Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.analysis.plots.figure import GREY, SYMBOLS, Axis, BodyTriangles, Curve, Figure, Map, Panel, needed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis as AxisOf
    from matplotlib.figure import Figure as Drawn

_PANEL_IN = ((8.4, 3.0), (5.2, 3.0), (4.4, 3.0), (2.85, 2.7))  # by the number of columns
_ROW_IN, _FRAME_IN, _MARGIN_IN = 0.17, 1.3, 0.6
_MARKERS = dict(zip(SYMBOLS, "osD^vPx<>", strict=True))
_STYLES = {"solid": "-", "dash": "--", "dot": ":"}
_EXTEND = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
_ROUNDING = 1e-6  # of the span: less is no other colour
# Names and remarks are text and no formulas; SVG keeps letters as letters, and no random names.
_HOW: Any = {"text.parse_math": False, "svg.fonttype": "none", "svg.hashsalt": "sensorgen", "font.size": 9}


def png(figure: Figure) -> bytes:
    """All choices of a figure in one picture.

    Raises
    ------
    MissingValue
        Matplotlib is not installed.
    """
    return _written(figure, tuple(p for panels in figure.choices.values() for p in panels), figure.title, "png")


def whole(figure: Figure) -> "Drawn":
    """All choices of a figure as matplotlib has them; errors as of :func:`png`."""
    needed("matplotlib")
    import matplotlib as mpl

    with mpl.rc_context(_HOW):
        return drawn(figure, tuple(p for panels in figure.choices.values() for p in panels), figure.title)


def first(of: object, figures: Sequence[Figure]) -> "Drawn":
    """The first of a result's figures as matplotlib has it; TypeError where it has none."""
    if not figures:
        raise TypeError(f"this {type(of).__name__} has nothing to draw")
    return whole(figures[0])


def files(figure: Figure) -> Iterator[tuple[str, bytes]]:
    """Name and content of a figure's files: each of its choices as PNG and as SVG."""
    for k, (choice, panels) in enumerate(figure.choices.items()):
        safe = "".join(c if c.isascii() and (c.isalnum() or c in ".-_") else "-" for c in choice)[:60]
        stem = f"{figure.key}-{k + 1}-{safe}" if figure.chooser else figure.key
        for kind in ("png", "svg"):
            yield f"{stem}.{kind}", _written(figure, panels, ": ".join(filter(None, (figure.title, choice))), kind)


def _written(figure: Figure, panels: Sequence[Panel], title: str, kind: str) -> bytes:
    needed("matplotlib")
    import matplotlib as mpl

    target = BytesIO()
    how = {"Software": None} if kind == "png" else {"Date": None, "Creator": None}
    with mpl.rc_context(_HOW):
        drawn(figure, panels, title).savefig(target, format=kind, metadata=how)
    return target.getvalue()


def drawn(figure: Figure, panels: Sequence[Panel], title: str = "") -> "Drawn":
    """Panels of a figure as matplotlib has them.

    Parameters
    ----------
    figure : Figure
        How they are arranged.
    panels : sequence of Panel
        Of one of its choices, or of all.
    title : str
        Over all of them.
    """
    from matplotlib.figure import Figure as Drawn

    columns = min(figure.columns, len(panels))
    wide, tall = _PANEL_IN[min(columns, len(_PANEL_IN)) - 1]
    rows = [panels[k : k + columns] for k in range(0, len(panels), columns)]
    heights = [max(_height_in(panel, tall) for panel in row) for row in rows]
    width = max(_MARGIN_IN + columns * wide + 1.6 * figure.beside, 6.5)
    canvas = Drawn(figsize=(width, _FRAME_IN + sum(heights)), dpi=100, layout="constrained")
    canvas.suptitle(title, fontsize="large", x=0.01, ha="left", wrap=True)
    how: Any = {"projection": "3d"} if panels[0].solid else {}
    grid = canvas.subplots(len(rows), columns, squeeze=False, height_ratios=heights, subplot_kw=how).ravel().tolist()
    for axes in grid[len(panels) :]:
        axes.set_axis_off()
    for k, (axes, panel) in enumerate(zip(grid, panels, strict=False)):
        _panel(axes, panel, figure)
        _titled(axes, panel, panels[k + columns : k + columns + 1], panels[k - 1 : k] if k % columns else ())
    if not figure.beside:
        _legend(canvas, grid)
    return canvas


def _legend(canvas: "Drawn", grid: Sequence[Any]) -> None:
    """Every name once, under the panels."""
    handles = [axes.get_legend_handles_labels() for axes in grid]
    named = {label: handle for pair in handles for handle, label in zip(*pair, strict=True)}
    if named:
        ncols = min(len(named), 6 if canvas.get_figwidth() > 9 else 4)
        canvas.legend(named.values(), named.keys(), loc="outside lower left", ncols=ncols, frameon=False)


def _height_in(panel: Panel, tall: float) -> float:
    return 0.6 + _ROW_IN * len(panel.y.names) if panel.y.names else 4.0 if panel.solid else tall


def _titled(axes: "Axes", panel: Panel, below: Sequence[Panel], before: Sequence[Panel]) -> None:
    """Titles of the axes: across under the last panel of those alike, upwards at the first one."""
    if panel.solid:
        axes.set(xlabel=panel.x.title, ylabel=panel.y.title, zlabel=panel.z.title)
        return
    axes.set_xlabel("" if below and below[0].x.title == panel.x.title else panel.x.title)
    alike = before and before[0].y.title == panel.y.title and type(before[0].content[0]) is type(panel.content[0])
    axes.set_ylabel("" if alike else panel.y.title)


_SCALES = {False: "linear", True: "log"}


def _panel(axes: "Axes", panel: Panel, figure: Figure) -> None:
    if panel.title:
        axes.set_title(panel.title, fontsize="medium")
    if panel.solid:
        _bodies(axes, [body for body in panel.content if isinstance(body, BodyTriangles)], figure)
        return
    axes.set(xscale=_SCALES[panel.x.log], yscale=_SCALES[panel.y.log])
    left = np.zeros(max(1, len(panel.y.names)))
    for part in panel.content:
        if isinstance(part, Map):
            _map(axes, part, part.label if part.label not in panel.title else "")
        elif isinstance(part, Curve):
            _curve(axes, part, panel.y.names, left)
    _dressed(axes, panel)
    if figure.beside:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.03), frameon=False, fontsize="small", handletextpad=0.2)


def _dressed(axes: "Axes", panel: Panel) -> None:
    """Ends and ticks of the axes."""
    if panel.y.names:
        axes.set_yticks(range(len(panel.y.names)), panel.y.names)
        axes.set_ylim(len(panel.y.names) - 0.4, -0.6)
    for axis, about, limit in ((axes.xaxis, panel.x, axes.set_xlim), (axes.yaxis, panel.y, axes.set_ylim)):
        if not about.names:
            limit(*(None if end != end else end for end in (about.low, about.high)))
            _ticks(axis, about)
    if panel.equal:
        axes.set_aspect("equal")
    if not any(isinstance(part, Map) for part in panel.content):
        axes.grid(alpha=0.3)
        axes.set_axisbelow(True)


def _ticks(axis: "AxisOf", about: Axis) -> None:
    """Whole numbers: no offset at the end of the axis, no powers of ten in TeX on a logarithmic one."""
    from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

    if not about.log:
        axis.set_major_formatter(ScalarFormatter(useOffset=False))
        return
    low, high = axis.get_view_interval()
    between = (1.0, 2.0, 3.0, 5.0, 7.0) if high < 10 * low else (1.0, 2.0, 5.0) if high < 1e3 * low else (1.0,)
    axis.set_major_locator(LogLocator(subs=between))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def _curve(axes: "Axes", curve: Curve, names: tuple[str, ...], left: Any) -> None:
    x = np.asarray(curve.x, float)
    at = {name: k for k, name in enumerate(names)}
    y: Any = [at[str(name)] for name in curve.y] if names else np.asarray(curve.y, float)
    label = curve.name or "_nolegend_"
    if curve.kind == "bars":
        axes.barh(y, x, left=left[y], color=curve.colour, label=label)
        left[y] += x
    elif curve.kind == "ranges":
        axes.hlines(y, curve.low, curve.high, color=GREY, alpha=0.5, lw=6, label=label)
        axes.plot(x, y, "|", color="0.3", ms=7)
    elif curve.kind == "line":
        axes.plot(x, y, _STYLES[curve.dash], color=curve.colour, lw=1, label=label)
    else:
        _points(axes, curve, x, y, label)


def _points(axes: "Axes", curve: Curve, x: Any, y: Any, label: str) -> None:
    """Points with their intervals, if they have any."""
    if len(curve.low):
        axes.hlines(y, curve.low, curve.high, color=curve.colour, lw=1.2)
    marker, size = _MARKERS[curve.symbol.removesuffix("-open")], 5 if len(x) < 200 else 3
    face = "none" if curve.symbol.endswith("-open") else curve.colour
    axes.plot(x, y, linestyle="", marker=marker, color=curve.colour, ms=size, mfc=face, label=label)


def _map(axes: "Axes", part: Map, label: str) -> None:
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.ticker import ScalarFormatter

    low, high = part.span
    norm = LogNorm(low, high) if part.log else Normalize(low, high)
    how: Any = {"norm": norm, "cmap": "PuOr" if part.signed else "viridis_r" if part.log else "viridis"}
    if part.values.ndim == 1:
        mesh: Any = axes.scatter(part.x, part.y, c=part.values, s=14, **how)
    else:
        shading: Any = "gouraud" if part.x.ndim == 2 else "nearest"
        mesh = axes.pcolormesh(part.x, part.y, part.values, shading=shading, rasterized=True, **how)
        axes.set_facecolor("0.85")  # where it is undefined
    least = 0.0 if part.log else _ROUNDING * (high - low)
    smallest, largest = part.extent
    extend = _EXTEND[smallest < low - least, largest > high + least]
    shown = "{x:g}" if part.log else ScalarFormatter(useOffset=False)
    bar = axes.figure.colorbar(mesh, ax=axes, extend=extend, format=shown, label=label)
    _contours(axes, part, bar)


def _contours(axes: "Axes", part: Map, bar: Any) -> None:
    """Levels within the map, the first of them solid; also in the bar of a logarithmic one."""
    smallest, largest = part.extent
    colour, width, alpha, others = ("white", 1.4, 1.0, "dashed") if part.log else ("black", 0.4, 0.6, "solid")
    for k, level in enumerate(part.levels):
        if smallest < level < largest:
            style = others if k else "solid"
            axes.contour(part.x, part.y, part.values, levels=[level], colors=colour, linestyles=style, linewidths=width,
                         alpha=alpha)  # fmt: skip
            if part.log:
                bar.ax.axhline(level, color=colour, linestyle=style)


def _bodies(axes: Any, bodies: Sequence[BodyTriangles], figure: Figure) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    faces = np.concatenate([body.vertices_mm[body.triangles] for body in bodies])
    colours = [body.colour for body in bodies for _ in body.triangles]
    axes.add_collection3d(Poly3DCollection(faces, facecolors=colours, shade=True, rasterized=True))
    for body in bodies:
        axes.plot([], [], [], "s", color=body.colour, label=body.name)
    low, high = faces.min(axis=(0, 1)), faces.max(axis=(0, 1))
    for axis, least, most in zip("xyz", low, high, strict=True):
        getattr(axes, f"set_{axis}lim")(least, most, view_margin=0)
    axes.set_box_aspect((high - low) * figure.stretch, zoom=1.4)
    axes.view_init(elev=30, azim=-65)
