"""R, X and their sensitivities as maps over position and force, one per tone (figures 6.1 to 6.3 of the thesis)."""

from typing import TYPE_CHECKING

import numpy as np

from sensorgen.analysis.plots import panels
from sensorgen.analysis.plots.field import QUANTITIES, Field, Real, scale, tone

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

_EXTEND = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
_ROUNDING = 1e-6  # of the span: less is no other colour


def png(field: Field, name: str) -> bytes:
    """One of ``QUANTITIES`` for every tone, as PNG.

    The colours span the presses where the whole tip rests on the sensor; beyond them, the colour bar ends in a point.
    """
    quantity = QUANTITIES[name]
    figure, axes = panels.sheet(field, quantity.title)
    values, inside = field.values(name), field.on_sensor()
    for k, panel in enumerate(axes):
        divisor, unit = scale(values[k][:, inside], quantity.unit)
        shown = values[k] / divisor
        mesh = _map(panel, field, shown, shown[:, inside])
        limits = mesh.get_clim()
        least = _ROUNDING * (limits[1] - limits[0])
        extend = _EXTEND[bool(shown.min() < limits[0] - least), bool(shown.max() > limits[1] + least)]
        figure.colorbar(mesh, ax=panel, extend=extend, ticks=panels.levels(*limits), format=panels.plain())
        panel.set_title(f"{quantity.symbol} [{unit}] at {tone(field.frequency_hz[k])}", fontsize="medium")
        first, last = panels.outer(k, len(axes))
        panel.set_ylabel("force F [N]" if first else "")
        panel.set_xlabel("position x [mm]" if last else "")
    return panels.png(figure)


def _map(panel: "Axes", field: Field, shown: Real, inside: Real) -> "QuadMesh":
    low, high = float(inside.min()), float(inside.max())
    signed = low < 0 < high
    if signed:
        low, high = -max(-low, high), max(-low, high)
    mesh = panel.pcolormesh(
        field.position_mm, field.force_n, shown, shading="nearest", vmin=low, vmax=high,
        cmap="PuOr" if signed else "viridis", rasterized=True,
    )  # fmt: skip
    lines = panels.levels(low, high)
    if len(lines) and np.ptp(shown) > 0:
        panel.contour(field.position_mm, field.force_n, shown, levels=lines, colors="black", linewidths=0.4, alpha=0.6)
    return mesh
