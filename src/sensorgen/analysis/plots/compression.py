"""Displacement and capacitance of a cell over stress, as a figure."""

from sensorgen.analysis.plots.figure import BLUE, ORANGE, Axis, Curve, Figure, Panel
from sensorgen.prediction.compression import CompressionResult


def figure(result: CompressionResult) -> Figure:
    """Displacement and capacitance of a result over stress."""
    stress, displacement = result.stress_kpa, [d for d in result.displacement_um if d is not None]
    x = Axis("stress [kPa]", low=0.0)
    solved = stress[: len(displacement)]
    curve = (Curve("line", "", solved, displacement), Curve("points", "", solved, displacement))
    panels = [Panel(curve, x, Axis("displacement of the top [µm]", low=0.0))]
    bounds = {"lower bound": (result.lower_f_per_m2, BLUE, "triangle-up"),
              "upper bound": (result.upper_f_per_m2, ORANGE, "triangle-down")}  # fmt: skip
    at = [p for p, value in zip(stress, result.lower_f_per_m2, strict=True) if value is not None]
    if at:
        curves = tuple(
            Curve("points", name, at, [1e9 * c for c in values if c is not None], colour=colour, symbol=symbol)
            for name, (values, colour, symbol) in bounds.items()
        )
        panels.append(Panel(curves, x, Axis("capacitance [nF/m²]")))
    conditions = ", ".join(f"{key} {value}" for key, value in result.held.items())
    alt = "Displacement of the top and capacitance per area over stress."
    return Figure("compression", f"{result.model}: {conditions}", alt, {"": tuple(panels)}, columns=2)
