"""Force and position over the plane of R and X, one map per tone (figure 6.4 of the thesis)."""

from typing import TYPE_CHECKING

import numpy as np

from sensorgen.analysis.plots import panels
from sensorgen.analysis.plots.field import Field, Real, scale, tone

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

LINES = 7  # of constant force, and of constant position


def png(field: Field, of: str) -> bytes:
    """What R and X say of "position" or "force", as PNG.

    The plane is coloured where a press can lie. Lines of constant force and of constant position cross it: where they
    run together, R and X do not tell; where the map folds, two presses give the same R and X.
    """
    unit = {"position": "mm", "force": "N"}[of]
    figure, axes = panels.sheet(field, f"{of.capitalize()} from R and X\n{_legend(field)}")
    colour = np.broadcast_to(field.position_mm if of == "position" else field.force_n[:, None], field.folds().shape[1:])
    for k, panel in enumerate(axes):
        mesh = _plane(panel, field, k, colour)
        panel.set_title(tone(field.frequency_hz[k]), fontsize="medium")
    figure.colorbar(mesh, ax=axes, label=f"{of} [{unit}]", aspect=40, shrink=0.8)
    return panels.png(figure)


def _legend(field: Field) -> str:
    lines = {
        name: ", ".join(f"{values[k]:.3g}" for k in panels.chosen(values, LINES))
        for name, values in (("force", field.force_n), ("position", field.position_mm))
    }
    folds = "; red: folds" if field.folds().any() else ""
    return f"solid lines: {lines['force']} N; dashed: {lines['position']} mm{folds}"


def _plane(panel: "Axes", field: Field, k: int, colour: Real) -> "QuadMesh":
    r, x = field.values("resistance")[k], field.values("reactance")[k]
    (r_divisor, r_unit), (x_divisor, x_unit) = scale(r, "Ω"), scale(x, "Ω")
    r, x = r / r_divisor, x / x_divisor
    mesh = panel.pcolormesh(r, x, colour, shading="gouraud", cmap="viridis", rasterized=True)
    for j in panels.chosen(field.force_n, LINES):
        panel.plot(r[j], x[j], color="black", linewidth=0.5)
    for i in panels.chosen(field.position_mm, LINES):
        panel.plot(r[:, i], x[:, i], color="black", linewidth=0.5, linestyle=(0, (3, 2)))
    folded = field.folds()[k]
    panel.plot(r[folded], x[folded], ".", color="red", markersize=2)
    panel.ticklabel_format(useOffset=False)
    panel.locator_params("x", nbins=4)
    panel.locator_params("y", nbins=5)
    panel.set_xlabel(f"R [{r_unit}]")
    panel.set_ylabel(f"X [{x_unit}]")
    return mesh
