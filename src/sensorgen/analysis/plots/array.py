"""Maps over the outline of an array."""

from math import isnan, nan
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.analysis.plots import pages
from sensorgen.analysis.plots.figure import GREY, Axis, Curve, Figure, Map, Panel
from sensorgen.core.arrays import Real

_MEDIANS = 3.0  # standard errors beyond this many medians have one colour

if TYPE_CHECKING:
    from sensorgen.design.arrays import ArrayLayout
    from sensorgen.prediction.array.frames import PressureMaps
    from sensorgen.prediction.array.study import ArrayStudy


def resolution(study: "ArrayStudy", name: str = "array", title: str = "") -> Figure:
    """Standard errors of pressure over the outline, crosstalk where it is known; what is not determined is white."""
    layout = study.model.layout
    shown = np.where(study.determined, study.sigma_kpa, np.nan)
    known = shown[study.determined]
    most = min(float(known.max(initial=0.0)), _MEDIANS * float(np.median([*known, 0.0])))
    panels = [panel(layout, shown, "standard error [kPa]", f"one frame at {study.pressure_kpa:g} kPa", most or nan)]
    if study.crosstalk is not None:
        values = np.where(study.determined, study.crosstalk, np.nan)
        worst = min(1.0, np.nanmax(values, initial=0.0)) or nan
        panels.append(panel(layout, values, "crosstalk [-]", "crosstalk", worst))
    alt = "Standard error of the pressure at every crossing, over the outline; crosstalk beside it."
    words = title or f"{study.model.design.name}, {study.readout.kind}"
    return Figure(name, words, alt, {"": tuple(panels)}, columns=len(panels))


def page(study: "ArrayStudy", found: "PressureMaps", true: "Real") -> bytes:
    """Page of a resolution study: as printed, with a broken row and a shorted crossing, and a foot beside its truth."""
    from sensorgen.core.document import Facts, Table
    from sensorgen.prediction.array.study import study as again

    row = study.model.layout.rows[len(study.model.layout.rows) // 2]
    middle = (row.first + row.last) // 2 + 1
    faults = {"broken": f"{row.name}:{middle}", "short": f"{row.name}c{middle}"}
    figures = [resolution(study)]
    for name, fault in faults.items():
        with_fault = again(study.model, study.readout, study.pressure_kpa, [*study.faults, fault])
        figures.append(resolution(with_fault, name, f"with the fault {fault}"))
    figures.append(figure(found, true, "foot", "a foot: simulated frame at its heaviest, true and recovered"))
    sections = [pages.PageSection(figures=tuple(figures))]
    parts = list(study.document())
    words = [f"{key}: {value}" for part in parts if isinstance(part, Facts) for key, value in part.rows]
    words += [part for part in parts if isinstance(part, str) and part]
    sections.append(pages.PageSection(parts=tuple(part for part in parts if isinstance(part, Table))))
    return pages.page(f"Resolution of {study.model.design.name}", words, sections).encode()


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
    """Total force over time and the trace of the centre of pressure, recovered and true."""
    layout, newtons = pressures.model.layout, true * 1e3 * pressures.model.pitch_area_m2
    total = newtons.sum((1, 2))
    with np.errstate(invalid="ignore"):
        x, y = newtons.sum(1) @ layout.x_mm / total, newtons.sum(2) @ layout.y_mm / total
    force, (own_x, own_y, *_) = pressures.force_n[0], pressures.centre_mm
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
    """One map of a value of every crossing, with the outline of the sensing area."""
    import shapely

    edge = layout.params.margin_mm
    x0, y0, x1, y1 = layout.sensing.bounds
    ends = (Axis("x [mm]", low=x0 - edge, high=x1 + edge), Axis("y [mm]", low=y0 - edge, high=y1 + edge))
    drawn = Map(np.array(layout.x_mm), np.array(layout.y_mm), values, label, low=0.0, high=most)
    rings = shapely.get_rings(shapely.get_parts(layout.sensing))
    ways = (shapely.get_coordinates(ring).T for ring in rings)
    outline = [Curve("line", "", x, y, colour=GREY) for x, y in ways]
    return Panel((drawn, *outline), *ends, title=title, equal=True)
