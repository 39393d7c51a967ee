"""Maps over the outline of an array."""

from math import isnan, nan
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.analysis.plots import static
from sensorgen.analysis.plots.figure import GREY, Axis, Curve, Figure, Map, Panel
from sensorgen.core.arrays import Real

if TYPE_CHECKING:
    from sensorgen.design.arrays import ArrayLayout
    from sensorgen.prediction.array.frames import PressureMaps
    from sensorgen.prediction.array.study import ArrayStudy


def png(study: "ArrayStudy") -> bytes:
    """Standard errors of pressure over the outline, and crosstalk where it is known, as PNG.

    Crossings that are not determined are left white.
    """
    layout = study.model.layout
    shown = np.where(study.determined, study.sigma_kpa, np.nan)
    panels = [panel(layout, shown, "standard error [kPa]", f"one frame at {study.pressure_kpa:g} kPa")]
    if study.crosstalk is not None:
        panels.append(panel(layout, np.where(study.determined, study.crosstalk, np.nan), "crosstalk [-]", "crosstalk"))
    alt = "Standard error of the pressure at every crossing, over the outline; crosstalk beside it."
    return static.png(Figure("array", f"{study.model.design.name}, {study.readout.kind}", alt, {"": tuple(panels)},
                             columns=len(panels)))  # fmt: skip


def maps(pressures: "PressureMaps", true: "Real | None" = None) -> bytes:
    """The heaviest frame's pressures as PNG, the true ones beside them where these are known."""
    return static.png(figure(pressures, true))


def figure(pressures: "PressureMaps", true: "Real | None" = None, name: str = "map", title: str = "") -> Figure:
    """The heaviest frame's pressures, and the true ones beside them where these are known.

    What is not determined is left white, never drawn as no pressure.
    """
    k, layout = pressures.heaviest(), pressures.model.layout
    time_s = float(pressures.time_s[k])
    shown = {f"frame {k + 1}" if isnan(time_s) else f"frame at {time_s:g} s": pressures.pressure_kpa[k]}
    if true is not None:
        shown = {"true": np.where(pressures.model.here, true[k], np.nan)} | shown
    most = max(float(np.nanmax(values, initial=1.0)) for values in shown.values())
    panels = [panel(layout, values, "pressure [kPa]", of, most) for of, values in shown.items()]
    alt = "Pressure at every crossing over the outline, the true one beside it where it is known."
    return Figure(name, title or pressures.model.design.name, alt, {"": tuple(panels)}, columns=len(panels))


def course(pressures: "PressureMaps", true: "Real", name: str, title: str) -> Figure:
    """Total force over time and the trace of the centre of pressure, recovered and true on the same crossings."""
    layout, area = pressures.model.layout, pressures.model.pitch_area_m2
    newtons = np.where(np.isfinite(pressures.pressure_kpa), true * 1e3 * area, 0.0)
    total = newtons.sum((1, 2))
    with np.errstate(invalid="ignore"):
        x, y = newtons.sum(1) @ layout.x_mm / total, newtons.sum(2) @ layout.y_mm / total
    force, (own_x, own_y) = pressures.force_n[0], pressures.centre_mm
    panels = [
        Panel(
            (
                Curve("line", "true", one[0], one[1], colour=GREY, dash="dash"),
                Curve("line", "recovered", other[0], other[1]),
            ),
            Axis(across), Axis(up),
        )
        for one, other, across, up in (
            ((pressures.time_s, total), (pressures.time_s, force), "time [s]", "force [N]"),
            ((x, y), (own_x, own_y), "centre x [mm]", "centre y [mm]"),
        )
    ]  # fmt: skip
    alt = "Total force over time and centre of pressure, recovered and true."
    return Figure(name, title, alt, {"": tuple(panels)}, columns=2)


def panel(layout: "ArrayLayout", values: Real, label: str, title: str, most: float = nan) -> Panel:
    """One map of a value of every crossing, with the outline of the print."""
    import shapely

    x, y = shapely.get_coordinates(layout.footprint.exterior).T
    (length, width), edge = layout.size_mm, layout.params.margin_mm
    ends = (Axis("x [mm]", low=-edge, high=length + edge), Axis("y [mm]", low=-edge, high=width + edge))
    drawn = Map(np.array(layout.x_mm), np.array(layout.y_mm), values, label, low=0.0, high=most)
    return Panel((drawn, Curve("line", "", x, y, colour=GREY)), *ends, title=title, equal=True)
