"""The rectangular cell: 3.36 to 3.54, figures 2.14, 3.5, 3.6 and 3.7, against columns and field solvers."""

from dataclasses import replace

from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design.shapes import rect
from sensorgen.models import thesis_cells
from sensorgen.verification.thesis.checks._columns import (
    EPS_R,
    FILM_MM,
    SHOWN,
    Layer,
    exact_f_per_m2,
    pile_f_per_m2,
)
from sensorgen.verification.thesis.verdicts import Part

_CELL = rect.Params(dielectric_mm=FILM_MM)
_AREA_M2 = (_CELL.period_mm * M_PER_MM) ** 2
_D, _T1, _T2 = FILM_MM, _CELL.upper_height_mm, _CELL.lower_height_mm
_PRESS_MM = 0.05

# Thickness of X60 that 3.39 to 3.47 give a column, by what lies in its lower and in its upper layer [mm].
_PRINTED_MM = {
    "air": {"etpu": EPS_R * _T2 + _D, "x60": EPS_R * _T2 + _T1 + _D, "air": EPS_R * (_T1 + _T2) + _D},
    "x60": {"etpu": _T2 + _D, "x60": _T1 + _T2 + _D, "air": EPS_R * _T1 + _T2 + _D},
    "etpu": {"etpu": _D, "x60": _D, "air": _D},
}


def columns(below: str, above: str = "") -> list[Part]:
    """3.39 to 3.48: one column over a kind of lower strip, or all, per area."""
    found = []
    for name in [above] if above else _PRINTED_MM[below]:
        over: list[Layer] = [(below, _T2), *([(name, _T1)] if name != "etpu" else [])] if below != "etpu" else []
        printed = EPS0_F_PER_M * EPS_R / (_PRINTED_MM[below][name] * M_PER_MM)
        found.append(Part(f"{name} over {below}", "F/m2", pile_f_per_m2([("x60", _D), *over]), printed))
    return found


def in_series() -> list[Part]:
    """3.37, 3.38: two dielectrics on one another, the second of air."""
    h1, h2 = 0.1, 0.3
    one, two = EPS0_F_PER_M * EPS_R, EPS0_F_PER_M
    ours = pile_f_per_m2([("x60", h1), ("air", h2)])
    return [
        Part("C per area by 3.37", "F/m2", ours, 1 / (h1 * M_PER_MM / one + h2 * M_PER_MM / two)),
        Part("C per area by 3.38", "F/m2", ours, one * two / ((one * h2 + two * h1) * M_PER_MM)),
    ]


def sixteen_columns() -> list[Part]:
    """3.36: the sum over the lower strips, by 3.49, its widths those of these and its L a quarter of the period."""
    widths = {"air": 2 * _CELL.air_width_mm, "x60": _CELL.x60_width_mm, "etpu": _CELL.etpu_width_mm}
    counts = {"etpu": 1, "x60": 1, "air": 2}
    over = sum(
        widths[below] * counts[above] / thickness
        for below, row in _PRINTED_MM.items()
        for above, thickness in row.items()
    )
    printed_f = EPS0_F_PER_M * EPS_R * _CELL.period_mm / 4 * M_PER_MM * over
    return [Part("C_eq", "F", thesis_cells.strips_f_per_m2(_CELL, EPS_R) * _AREA_M2, printed_f)]


def whole() -> list[Part]:
    """3.49: the formula, and its cell."""
    (summed,) = sixteen_columns()
    return [summed, replace(summed, name="of the exact cell", ours=exact_f_per_m2("rect") * _AREA_M2, shown=SHOWN)]


def _bulged() -> tuple[float, float]:
    """How many times the dielectric's term grows when pressed, by our model; and its height [-], [mm]."""
    rest = thesis_cells.strips_f_per_m2(_CELL, EPS_R)
    pressed, free = (thesis_cells.bulging_f_per_m2(_CELL, EPS_R, dh) - rest for dh in (_PRESS_MM, 0.0))
    return pressed / free, _T1 + _T2 + _D


def constant_volume() -> list[Part]:
    """3.50 to 3.52: the bulge that keeps the area of the cross-section, and what it does to a plate's capacitance."""
    times, h1 = _bulged()
    we = _CELL.x60_width_mm
    bulge = _PRESS_MM * we / (h1 - _PRESS_MM)
    return [
        Part("area after / before", "", 1.0, (we + bulge) * (h1 - _PRESS_MM) / (we * h1)),
        Part("capacitance after / before", "", times, (we + bulge) / (h1 - _PRESS_MM) / (we / h1)),
    ]


def bulging_term() -> list[Part]:
    """3.53: the square belongs to the bracket. Lengths are in metres: as printed, that matters."""
    times, h1_mm = _bulged()
    h1, dh = h1_mm * M_PER_MM, _PRESS_MM * M_PER_MM
    return [Part("capacitance after / before", "", times, h1 / (h1 - dh**2), (h1 / (h1 - dh)) ** 2)]


def bulging() -> list[Part]:
    """3.54: what it adds to a cell that nothing presses."""
    ours, printed = (thesis_cells.bulging_f_per_m2(_CELL, EPS_R, 0.0, printed=way) for way in (False, True))
    return [Part("C_r at rest", "F/m2", ours, printed)]
