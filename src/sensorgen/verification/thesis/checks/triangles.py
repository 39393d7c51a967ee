"""The triangular cell: 3.9 to 3.35, figures 2.12, 3.4 and 6.7, against columns and field solvers."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design.shapes import tri
from sensorgen.models import columns, thesis_cells, thesis_swept
from sensorgen.verification.thesis.checks._columns import (
    EPS_R,
    FILM_MM,
    PERMITTIVITY,
    SHOWN,
    Layer,
    exact_f_per_m2,
    pile_f_per_m2,
)
from sensorgen.verification.thesis.verdicts import Part

Real = NDArray[np.float64]

_CELL = tri.Params(dielectric_mm=FILM_MM)
_DESIGN = designs.make({"shape": "tri", "parameters": {"dielectric_mm": FILM_MM}})
_QUARTER_MM = _CELL.period_mm / 4
_APEX_MM = 3 * _QUARTER_MM  # of the first hanging dielectric in our scene
_TAN_GAMMA, _TAN_THETA = _CELL.hang_height_mm / _QUARTER_MM, _CELL.lower_height_mm / _QUARTER_MM
_X_MM = np.array([0.05, 0.2, 0.35, 0.48])  # places under a flank, from its apex
_Y1_M, _Y2_M = _X_MM * _TAN_GAMMA * M_PER_MM, _X_MM * _TAN_THETA * M_PER_MM
_T_M, _D_M = _CELL.hang_height_mm * M_PER_MM, FILM_MM * M_PER_MM
_DISPLACED = EPS0_F_PER_M * EPS_R  # of a volt per metre in X60 [C/m2]
_VOLT = 1.0
_GAUSS = 60  # points of a quadrature
_TURNED_RAD = (0.0, 0.1, 0.2)


@dataclass(frozen=True)
class _Region:
    """What lies under one flank of a hanging triangle: alpha and beta [m] as printed, and whether X60 hangs there."""

    alpha: float
    beta_m: float
    hangs: bool

    def layers(self, x_mm: float) -> list[Layer]:
        """From below, at a place."""
        y1, y2 = x_mm * _TAN_GAMMA, x_mm * _TAN_THETA
        above: list[Layer] = [("x60", _CELL.hang_height_mm - y1)] if self.hangs else []
        return [("x60", y2 + FILM_MM), ("air", y1 - y2), *above]

    def displacement(self) -> Real:
        """Of our columns at the places, at 1 V [C/m2]."""
        return np.array([pile_f_per_m2(self.layers(x)) * _VOLT for x in _X_MM.tolist()])

    def model_f_per_m(self) -> float:
        """Our formula for the whole flank [F/m]."""
        formula = thesis_cells.under_dielectric_f_per_m if self.hangs else thesis_cells.under_cog_f_per_m
        return formula(_CELL, EPS_R)

    def reduced(self) -> tuple[float, float]:
        """Slope and start [m] of eps0 eps_x / C' over x, of our columns."""
        slope, start = np.polyfit(_X_MM * M_PER_MM, _DISPLACED * _VOLT / self.displacement(), 1)
        return float(slope), float(start)


_UNDER = {
    "dielectric": _Region((EPS_R - 1) * (_TAN_GAMMA - _TAN_THETA), _T_M + _D_M, hangs=True),
    "cog": _Region(EPS_R * _TAN_GAMMA - (EPS_R - 1) * _TAN_THETA, _D_M, hangs=False),
}


def _height_mm(body: str, x_mm: float, *, lowest: bool) -> float:
    """Height of a body's lower or upper face over the film in the cross-section of our scene [mm]."""
    cuts = (outline for prism in _DESIGN.in_use.body(body).prisms for outline in prism.cut("x", x_mm))
    z = [height for outline in cuts for _, height in outline]
    return (min(z) if lowest else max(z)) - _CELL.electrode_mm - FILM_MM


def _faces_mm() -> tuple[Real, Real]:
    """Both faces of the air gap at the places, in our scene."""
    upper = [_height_mm("hanging_dielectric", _APEX_MM - x, lowest=True) for x in _X_MM.tolist()]
    lower = [_height_mm("film_and_lower", _APEX_MM - x, lowest=False) for x in _X_MM.tolist()]
    return np.array(upper), np.array(lower)


def _logarithm(region: _Region, denominator: float) -> float:
    """Capacitance of the flank with any denominator in the logarithm [F/m]."""
    top = region.beta_m + region.alpha * _QUARTER_MM * M_PER_MM
    return float(_DISPLACED / region.alpha * np.log(top / denominator))


_SOLID, _COG = _UNDER["dielectric"], _UNDER["cog"]
_FILM_M, _GAP_M = _Y2_M + _D_M, _Y1_M - _Y2_M  # X60 below the air, and the air, at the places
EQUATIONS: dict[str, Callable[[], list[Part]]] = {
    # 3.10, 3.11, 3.20: faces of the gap
    "upper_flank": lambda: [Part("y1", "m", _faces_mm()[0] * M_PER_MM, _Y1_M)],
    "lower_flank": lambda: [Part("y2", "m", _faces_mm()[1] * M_PER_MM, _Y2_M)],
    "gap": lambda: [
        Part("y1 - y2", "m", np.subtract(*_faces_mm()) * M_PER_MM, _X_MM * M_PER_MM * (_TAN_GAMMA - _TAN_THETA))
    ],
    # 3.12, 3.13: fields by thicknesses add up to the voltage; 3.14, 3.15; 3.16 to 3.18: per area, at 1 V
    "voltage": lambda: [
        Part("V", "V", _VOLT, _SOLID.displacement() * ((_T_M - _Y1_M + _FILM_M) / _DISPLACED + _GAP_M / EPS0_F_PER_M))
    ],
    "field_in_air": lambda: [
        Part("E_air", "V/m", _SOLID.displacement() / EPS0_F_PER_M,
             _VOLT * EPS_R / ((_T_M - _Y1_M) + EPS_R * _GAP_M + _FILM_M))
    ],
    "displacement": lambda: [
        Part("D", "C/m2", _SOLID.displacement(), _DISPLACED * _VOLT / ((_T_M + _D_M) + (EPS_R - 1) * _GAP_M))
    ],
    # 3.25, with air as medium 2 and X60 as 3; 3.27 to 3.29
    "voltage_under_cog": lambda: [
        Part("V", "V", _VOLT, _COG.displacement() * (_GAP_M / EPS0_F_PER_M + _FILM_M / _DISPLACED))
    ],
    "displacement_under_cog": lambda: [
        Part("D", "C/m2", _COG.displacement(), _DISPLACED * _VOLT / (EPS_R * _Y1_M + _D_M + (1 - EPS_R) * _Y2_M))
    ],
    # 3.23, 3.24; 3.33, 3.34: alpha stands for beta below the fraction
    "logarithm_under_dielectric": lambda: [
        Part("C_wd", "F/m", _SOLID.model_f_per_m(), _logarithm(_SOLID, _SOLID.beta_m))
    ],
    "logarithm_under_cog": lambda: [
        Part("C_we", "F/m", _COG.model_f_per_m(), _logarithm(_COG, _COG.alpha), _logarithm(_COG, _COG.beta_m))
    ],
    # Figure 6.7: the geometry whose flanks are turned flatter, by our formula
    "swept": lambda: [
        Part("C/A, turned by 0, 0.1 and 0.2 rad", "F/m2",
             [thesis_cells.triangles_f_per_m2(thesis_swept.turned(_CELL, angle), EPS_R) for angle in _TURNED_RAD])
    ],
}  # fmt: skip


def continuity() -> list[Part]:
    """3.9: the field in air from that in X60, and from the voltage that the X60 leaves to the air."""
    solid = _SOLID.displacement() / _DISPLACED
    return [Part("E in air", "V/m", (_VOLT - solid * (_T_M - _Y1_M + _FILM_M)) / _GAP_M, EPS_R * solid)]


def field_under_cog() -> list[Part]:
    """3.26: what 3.25 leaves for medium 2."""
    d = _COG.displacement()
    ours = (_VOLT - d / _DISPLACED * _FILM_M) / _GAP_M
    return [Part("E2", "V/m", ours, d / EPS0_F_PER_M / EPS_R, d / EPS0_F_PER_M)]


def alpha(under: str) -> list[Part]:
    """3.21, 3.30."""
    return [Part("alpha", "", _UNDER[under].reduced()[0], _UNDER[under].alpha)]


def beta(under: str) -> list[Part]:
    """3.22, 3.31."""
    return [Part("beta", "m", _UNDER[under].reduced()[1], _UNDER[under].beta_m)]


def integral(under: str) -> list[Part]:
    """3.19, 3.32, by quadrature."""
    region, width = _UNDER[under], _QUARTER_MM * M_PER_MM
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
    columns_under = _DISPLACED / (region.beta_m + region.alpha * (nodes + 1) / 2 * width)
    return [Part("C", "F/m", region.model_f_per_m(), float(np.sum(weights * columns_under) * width / 2))]


def whole() -> list[Part]:
    """3.35: columns agree with columns; the field that leaves the flanks sideways is not in them."""
    half = _CELL.period_mm / 2 * M_PER_MM
    printed = sum(_logarithm(region, region.beta_m) for region in _UNDER.values())
    area = _CELL.length_mm * _CELL.width_mm * M_PER_MM**2
    ours = columns.capacitance(_DESIGN.in_use, PERMITTIVITY).lower / area * half
    both = thesis_cells.triangles_f_per_m2(_CELL, EPS_R) * half
    return [
        Part("C_tot of half a period, columns", "F/m", ours, printed),
        Part("by our formula", "F/m", both, printed),
        Part("of the exact cell", "F/m", exact_f_per_m2("tri") * half, printed, shown=SHOWN),
    ]
