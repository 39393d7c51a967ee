"""One page to turn and to ask: surfaces of R, X and their slopes, and the way back, tone by tone; no network needed."""

from typing import Any

import numpy as np

from sensorgen.analysis.plots.field import QUANTITIES, Field, Real, tone

_GRID = (
    ("resistance", "resistance-by-force", "resistance-by-position"),
    ("reactance", "reactance-by-force", "reactance-by-position"),
)
_INVERSE = {"position": "position [mm]", "force": "force [N]"}
_PLANES = ((0.0, 0.4), (0.56, 0.96))  # where the two lie across the page
_WHERE = "force %{y:g} N, position %{x:g} mm"


def html(field: Field) -> str:
    """The page; its script is inside, once, and a slider chooses the tone."""
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

    figure = make_subplots(
        rows=3, cols=3, row_heights=[0.35, 0.35, 0.3], vertical_spacing=0.06, horizontal_spacing=0.02,
        specs=[[{"type": "surface"}] * 3] * 2 + [[{"type": "xy"}, {"type": "xy"}, None]],
        subplot_titles=[_title(name) for row in _GRID for name in row],
    )  # fmt: skip
    for k in range(len(field.frequency_hz)):
        for row, names in enumerate(_GRID, 1):
            for column, name in enumerate(names, 1):
                figure.add_trace(go.Surface(**_surface(field, name, k)), row=row, col=column)
        for column, of in enumerate(_INVERSE, 1):
            figure.add_trace(go.Scattergl(**_plane(field, of, k, column)), row=3, col=column)
    _dress(figure, field)
    return str(
        figure.to_html(include_plotlyjs=True, div_id="predict", config={"displaylogo": False, "responsive": True})
    )


def _title(name: str) -> str:
    where = ", the whole tip on the sensor" if name.endswith("position") else ""
    return f"{QUANTITIES[name].symbol} [{QUANTITIES[name].unit}]{where}"


def _surface(field: Field, name: str, k: int) -> dict[str, Any]:
    values, inside, quantity = field.values(name)[k], field.on_sensor(), QUANTITIES[name]
    if name.endswith("position"):  # at the ends the slope is another one, so large that it hides this one
        values = np.where(inside, values, np.nan)
    return {
        "x": field.position_mm, "y": field.force_n, "z": values, "visible": k == 0, "showscale": False,
        "colorscale": "Viridis", "name": quantity.symbol,
        "hovertemplate": f"{_WHERE}<br>{quantity.symbol} = %{{z:.7g}} {quantity.unit}<extra></extra>",
    }  # fmt: skip


def _plane(field: Field, of: str, k: int, column: int) -> dict[str, Any]:
    at, force = np.meshgrid(field.position_mm, field.force_n)
    where: Real = np.column_stack([force.ravel(), at.ravel()])
    return {
        "x": field.values("resistance")[k].ravel(), "y": field.values("reactance")[k].ravel(), "mode": "markers",
        "customdata": where, "visible": k == 0, "showlegend": False, "name": of,
        "marker": {
            "size": 4, "color": where[:, 1 if of == "position" else 0], "colorscale": "Viridis",
            "colorbar": {
                "title": _INVERSE[of], "x": _PLANES[column - 1][1] + 0.01, "len": 0.3, "y": 0.13, "thickness": 12,
            },
        },
        "hovertemplate": "R = %{x:.7g} Ω, X = %{y:.7g} Ω<br>force %{customdata[0]:g} N, position %{customdata[1]:g} mm"
        "<extra></extra>",
    }  # fmt: skip


def _dress(figure: Any, field: Field) -> None:
    """Axes with their units, and the slider."""
    per_tone = sum(map(len, _GRID)) + len(_INVERSE)
    names = [tone(f) for f in field.frequency_hz]
    steps = [
        {
            "label": name,
            "method": "restyle",
            "args": [{"visible": [j // per_tone == k for j in range(per_tone * len(names))]}],
        }
        for k, name in enumerate(names)
    ]
    figure.update_scenes(
        xaxis_title_text="x [mm]", yaxis_title_text="F [N]", zaxis_title_text="",
        camera_eye={"x": -1.5, "y": -1.7, "z": 1.0},
    )  # fmt: skip
    for column, place in enumerate(_PLANES, 1):
        figure.update_xaxes(title_text="R [Ω]", domain=place, row=3, col=column)
        figure.update_yaxes(title_text="X [Ω]", row=3, col=column)
    figure.update_layout(
        title={"text": "What the sensor answers to a press"},
        sliders=[{"active": 0, "steps": steps, "currentvalue": {"prefix": "tone: "}, "y": 0, "pad": {"t": 50}}],
        height=1250, template="plotly_white", margin={"l": 50, "r": 30, "t": 90, "b": 60},
    )  # fmt: skip
