"""The rectangular cell: 3.36 to 3.54, figures 3.6, 3.7 and 6.10, against columns and field solvers."""

from dataclasses import asdict, replace

from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design.shapes import rect, tri
from sensorgen.models import columns as every_column
from sensorgen.models import thesis_cells
from sensorgen.verification.thesis.checks._columns import (
    EPS_R,
    FILM_MM,
    PERMITTIVITY,
    SHOWN,
    Layer,
    exact_f_per_m2,
    pile_f_per_m2,
    piles_f,
)
from sensorgen.verification.thesis.items import ItemPart, Parts, table

_CELL = rect.Params(dielectric_mm=FILM_MM)
_AREA_M2 = (_CELL.period_mm * M_PER_MM) ** 2
_D, _T1, _T2 = FILM_MM, _CELL.upper_height_mm, _CELL.lower_height_mm
_STRAIN = 1e-3

# Thickness of X60 that 3.39 to 3.47 give a column, by what lies in its lower and in its upper layer [mm].
_PRINTED_MM = {
    "air": {"etpu": EPS_R * _T2 + _D, "x60": EPS_R * _T2 + _T1 + _D, "air": EPS_R * (_T1 + _T2) + _D},
    "x60": {"etpu": _T2 + _D, "x60": _T1 + _T2 + _D, "air": EPS_R * _T1 + _T2 + _D},
    "etpu": {"etpu": _D, "x60": _D, "air": _D},
}


def columns(below: str, above: str = "") -> Parts:
    """3.39 to 3.48: one column over a kind of lower strip, or all, per area."""
    for name in [above] if above else _PRINTED_MM[below]:
        over: list[Layer] = [(below, _T2), *([(name, _T1)] if name != "etpu" else [])] if below != "etpu" else []
        printed = EPS0_F_PER_M * EPS_R / (_PRINTED_MM[below][name] * M_PER_MM)
        yield ItemPart(f"{name} over {below}", "F/m2", pile_f_per_m2([("x60", _D), *over]), printed)


def in_series() -> Parts:
    """3.37, 3.38: two dielectrics on one another, the second of air."""
    h1, h2 = 0.1, 0.3
    one, two = EPS0_F_PER_M * EPS_R, EPS0_F_PER_M
    ours = pile_f_per_m2([("x60", h1), ("air", h2)])
    yield ItemPart("C per area by 3.37", "F/m2", ours, 1 / (h1 * M_PER_MM / one + h2 * M_PER_MM / two))
    yield ItemPart("C per area by 3.38", "F/m2", ours, one * two / ((one * h2 + two * h1) * M_PER_MM))


def _summed_f(upper_mm: dict[str, float]) -> float:
    """3.49, its widths those of the lower strips, and its L those of the upper ones [F]."""
    lower = {"air": 2 * _CELL.air_width_mm, "x60": _CELL.x60_width_mm, "etpu": _CELL.etpu_width_mm}
    counts = {"etpu": 1, "x60": 1, "air": 2}
    over = sum(
        lower[below] * upper_mm[above] * counts[above] / thickness
        for below, row in _PRINTED_MM.items()
        for above, thickness in row.items()
    )
    return EPS0_F_PER_M * EPS_R * over * M_PER_MM


_OWN_MM = {"air": _CELL.air_width_mm, "x60": _CELL.x60_width_mm, "etpu": _CELL.etpu_width_mm}
_EVEN_MM = dict.fromkeys(_OWN_MM, _CELL.period_mm / 4)  # the best reading of one L for strips of different widths


def _columns_f(cell: rect.Params = _CELL) -> float:
    """Columns of a cell as drawn [F]."""
    sizes = asdict(replace(cell, length_mm=cell.period_mm, width_mm=cell.period_mm))
    design = designs.make({"shape": "rect", "parameters": sizes})
    return every_column.capacitance(design.in_use, PERMITTIVITY).lower


def sixteen_columns() -> Parts:
    """3.36, figure 3.6: the sum over the lower strips, each of the upper ones with its own width."""
    formula = thesis_cells.strips_f_per_m2(_CELL, EPS_R, even=False) * _AREA_M2
    yield ItemPart("C_eq", "F", _columns_f(), _summed_f(_OWN_MM))
    yield ItemPart("as kept in thesis_cells", "F", formula, _summed_f(_OWN_MM), copied=True)


def whole() -> Parts:
    """3.49: the formula, and its cell."""
    printed, formula = _summed_f(_EVEN_MM), thesis_cells.strips_f_per_m2(_CELL, EPS_R) * _AREA_M2
    yield ItemPart("C_eq, columns of their own widths", "F", _columns_f(), printed)
    yield ItemPart("of the exact cell", "F", exact_f_per_m2("rect") * _AREA_M2, printed, shown=SHOWN)
    yield ItemPart("as kept in thesis_cells", "F", formula, printed, copied=True)


def _hooke() -> tuple[float, float]:
    """Width and height of a strip that is pressed a little, its long side held, over those at rest [-]."""
    nu = table("3.2")["x60"]["poisson_ratio"]
    return 1 + nu / (1 - nu) * _STRAIN, 1 - _STRAIN


def _gain() -> float:
    """By how much a strip's capacitance grows that Hooke's law widens: of our columns [-]."""
    wide, high = _hooke()
    we, h1 = _CELL.x60_width_mm, _T1 + _T2 + _D
    return piles_f([(we * wide, [("x60", h1 * high)])]) / piles_f([(we, [("x60", h1)])]) - 1


def _kept(dh_mm: float) -> float:
    """Growth of the dielectric's term, as thesis_cells keeps it [-]."""
    rest = thesis_cells.strips_f_per_m2(_CELL, EPS_R)
    pressed, free = (thesis_cells.bulging_f_per_m2(_CELL, EPS_R, dh) - rest for dh in (dh_mm, 0.0))
    return pressed / free - 1


def constant_volume() -> Parts:
    """3.50 to 3.52: the bulge that keeps the area of the cross-section, against Hooke's law."""
    wide, high = _hooke()
    bulge = _STRAIN / (1 - _STRAIN)  # 3.51
    printed = (1 + bulge) / (1 - _STRAIN) - 1
    yield ItemPart("change of area over the strain", "", (wide * high - 1) / _STRAIN, 0.0, scale=1.0)
    yield ItemPart("bulge over width", "", wide - 1, bulge)
    yield ItemPart("gain of capacitance", "", _gain(), printed)
    yield ItemPart("gain as kept in thesis_cells", "", _kept(_STRAIN * (_T1 + _T2 + _D)), printed, copied=True)


def bulging_term() -> Parts:
    """3.53: the square belongs to the bracket. Lengths are in metres: as printed, that matters."""
    h1 = (_T1 + _T2 + _D) * M_PER_MM
    dh = h1 * _STRAIN
    yield ItemPart("gain of capacitance", "", _gain(), h1 / (h1 - dh**2) - 1, (h1 / (h1 - dh)) ** 2 - 1)


def bulging() -> Parts:
    """3.54: what it adds to a cell that nothing presses: columns of their own widths have no such term."""
    area_mm2 = _CELL.x60_width_mm * _CELL.period_mm / 4
    added = 8 / 16 * EPS0_F_PER_M * EPS_R * area_mm2 / (_T1 + _T2 + _D) * M_PER_MM
    rest = _summed_f(_EVEN_MM)
    formula = [thesis_cells.bulging_f_per_m2(_CELL, EPS_R, 0.0, printed=way) * _AREA_M2 for way in (False, True)]
    yield ItemPart("C_r at rest, strips of their own widths", "F", _columns_f(), _summed_f(_OWN_MM) + added)
    yield ItemPart("as kept in thesis_cells, corrected and not", "F", formula, [rest, rest + added], copied=True)


def turned_out(rise_f: float, press_mm: float) -> Parts:
    """Figure 6.10: what the strips gain that 3.1.2 makes lower and wider, by columns of these."""
    now = thesis_cells.swept(_CELL, press_mm)
    rise = _columns_f(now) - _columns_f()
    yield ItemPart("gain by 5 µm, a cell of 2 mm by 2 mm", "F", rise, rise_f, shown=SHOWN)
    square = rise / _CELL.period_mm**2
    yield ItemPart("gain by 5 µm, the square of 1 mm that 6.1.2 names", "F", square, rise_f, shown=SHOWN)


def volumes() -> Parts:
    """2.4.1: X60 and cogs of both designs per area: of a triangle half its box, of a strip its share of the period."""
    cell = tri.Params(dielectric_mm=FILM_MM)
    x60 = (cell.hang_height_mm + cell.lower_height_mm) / 2 + FILM_MM
    cogs = cell.hang_height_mm / 2
    layers = (_T1 + _T2) / _CELL.period_mm
    more = x60 / (layers * _CELL.x60_width_mm + _D)
    yield ItemPart("X60 of the triangular design over that of the rectangular one", "", more, 1.0)
    yield ItemPart("cogs, likewise", "", cogs / (layers * _CELL.etpu_width_mm), 1.0)
