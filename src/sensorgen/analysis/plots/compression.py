"""Displacement and capacitance of a cell over stress, as a figure."""

from collections.abc import Mapping
from typing import Any

from sensorgen.analysis.plots import static
from sensorgen.analysis.plots.figure import BLUE, ORANGE, Axis, Curve, Figure, Panel


def png(data: Mapping[str, Any]) -> bytes:
    """A picture of what :func:`sensorgen.prediction.compression.answer` found, as PNG.

    Parameters
    ----------
    data : mapping
        Its answer.
    """
    stress, displacement = data["stress_kpa"], data["displacement_um"]
    x = Axis("stress [kPa]", low=0.0)
    curve = (Curve("line", "", stress, displacement), Curve("points", "", stress, displacement))
    panels = [Panel(curve, x, Axis("displacement of the top [µm]", low=0.0))]
    bounds = {"lower bound": (data["lower_f_per_m2"], BLUE, "triangle-up"),
              "upper bound": (data["upper_f_per_m2"], ORANGE, "triangle-down")}  # fmt: skip
    known = [k for k, value in enumerate(data["lower_f_per_m2"]) if value is not None]
    if known:
        at = [stress[k] for k in known]
        curves = tuple(
            Curve("points", name, at, [1e9 * values[k] for k in known], colour=colour, symbol=symbol)
            for name, (values, colour, symbol) in bounds.items()
        )
        panels.append(Panel(curves, x, Axis("capacitance [nF/m²]")))
    held = ", ".join(f"{key} {value}" for key, value in data["held"].items())
    alt = "Displacement of the top and capacitance per area over stress."
    return static.png(Figure("compression", f"{data['model']}: {held}", alt, {"": tuple(panels)}, columns=2))
