"""The triangular cell: 3.9 to 3.35, figures 2.12, 3.4 and 6.7, against columns and field solvers."""

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
    made = designs.make({"shape": "tri", "parameters": {"dielectric_mm": FILM_MM}})
    cuts = (outline for prism in made.in_use.body(body).prisms for outline in prism.cut("x", x_mm))
    z = [height for outline in cuts for _, height in outline]
    return (min(z) if lowest else max(z)) - _CELL.electrode_mm - FILM_MM


def _faces_mm() -> tuple[Real, Real]:
    """Both faces of the air gap at the places, in our scene."""
    upper = [_height_mm("hanging_dielectric", _APEX_MM - x, lowest=True) for x in _X_MM.tolist()]
    lower = [_height_mm("film_and_lower", _APEX_MM - x, lowest=False) for x in _X_MM.tolist()]
    return np.array(upper), np.array(lower)


def upper_flank() -> list[Part]:
    """3.10."""
    return [Part("y1", "m", _faces_mm()[0] * M_PER_MM, _Y1_M)]


def lower_flank() -> list[Part]:
    """3.11."""
    return [Part("y2", "m", _faces_mm()[1] * M_PER_MM, _Y2_M)]


def gap() -> list[Part]:
    """3.20."""
    upper, lower = _faces_mm()
    return [Part("y1 - y2", "m", (upper - lower) * M_PER_MM, _X_MM * M_PER_MM * (_TAN_GAMMA - _TAN_THETA))]


def continuity() -> list[Part]:
    """3.9: the field in air from that in X60, and from the voltage that the X60 leaves to the air."""
    solid = _UNDER["dielectric"].displacement() / _DISPLACED
    left = (_VOLT - solid * (_T_M - _Y1_M + _Y2_M + _D_M)) / (_Y1_M - _Y2_M)
    return [Part("E in air", "V/m", left, EPS_R * solid)]


def voltage() -> list[Part]:
    """3.12, 3.13: fields by thicknesses add up to the voltage."""
    d = _UNDER["dielectric"].displacement()
    solid, air = d / _DISPLACED, d / EPS0_F_PER_M
    return [Part("V", "V", _VOLT, solid * (_T_M - _Y1_M) + air * (_Y1_M - _Y2_M) + solid * (_Y2_M + _D_M))]


def field_in_air() -> list[Part]:
    """3.14, 3.15."""
    printed = _VOLT * EPS_R / ((_T_M - _Y1_M) + EPS_R * (_Y1_M - _Y2_M) + (_Y2_M + _D_M))
    return [Part("E_air", "V/m", _UNDER["dielectric"].displacement() / EPS0_F_PER_M, printed)]


def displacement() -> list[Part]:
    """3.16 to 3.18: displacement, charge and capacitance per area, at 1 V."""
    printed = _DISPLACED * _VOLT / ((_T_M + _D_M) + (EPS_R - 1) * (_Y1_M - _Y2_M))
    return [Part("D", "C/m2", _UNDER["dielectric"].displacement(), printed)]


def voltage_under_cog() -> list[Part]:
    """3.25, with air as medium 2 and X60 as 3."""
    d = _UNDER["cog"].displacement()
    return [Part("V", "V", _VOLT, d / EPS0_F_PER_M * (_Y1_M - _Y2_M) + d / _DISPLACED * (_Y2_M + _D_M))]


def field_under_cog() -> list[Part]:
    """3.26: what 3.25 leaves for medium 2."""
    d = _UNDER["cog"].displacement()
    ours = (_VOLT - d / _DISPLACED * (_Y2_M + _D_M)) / (_Y1_M - _Y2_M)
    return [Part("E2", "V/m", ours, d / EPS0_F_PER_M / EPS_R, d / EPS0_F_PER_M)]


def displacement_under_cog() -> list[Part]:
    """3.27 to 3.29."""
    printed = _DISPLACED * _VOLT / (EPS_R * _Y1_M + _D_M + (1 - EPS_R) * _Y2_M)
    return [Part("D", "C/m2", _UNDER["cog"].displacement(), printed)]


def alpha(under: str) -> list[Part]:
    """3.21, 3.30."""
    region = _UNDER[under]
    return [Part("alpha", "", region.reduced()[0], region.alpha)]


def beta(under: str) -> list[Part]:
    """3.22, 3.31."""
    region = _UNDER[under]
    return [Part("beta", "m", region.reduced()[1], region.beta_m)]


def integral(under: str) -> list[Part]:
    """3.19, 3.32, by quadrature."""
    region, width = _UNDER[under], _QUARTER_MM * M_PER_MM
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
    columns_under = _DISPLACED / (region.beta_m + region.alpha * (nodes + 1) / 2 * width)
    return [Part("C", "F/m", region.model_f_per_m(), float(np.sum(weights * columns_under) * width / 2))]


def _logarithm(region: _Region, denominator: float) -> float:
    """Capacitance with any denominator in the logarithm [F/m]."""
    top = region.beta_m + region.alpha * _QUARTER_MM * M_PER_MM
    return float(_DISPLACED / region.alpha * np.log(top / denominator))


def logarithm_under_dielectric() -> list[Part]:
    """3.23, 3.24."""
    region = _UNDER["dielectric"]
    return [Part("C_wd", "F/m", region.model_f_per_m(), _logarithm(region, region.beta_m))]


def logarithm_under_cog() -> list[Part]:
    """3.33, 3.34: alpha stands for beta below the fraction."""
    region = _UNDER["cog"]
    printed, corrected = (_logarithm(region, denominator) for denominator in (region.alpha, region.beta_m))
    return [Part("C_we", "F/m", region.model_f_per_m(), printed, corrected)]


def whole() -> list[Part]:
    """3.35: columns agree with columns; the field that leaves the flanks sideways is not in them."""
    half = _CELL.period_mm / 2 * M_PER_MM
    printed = sum(_logarithm(region, region.beta_m) for region in _UNDER.values())
    made = designs.make({"shape": "tri", "parameters": {"dielectric_mm": FILM_MM}})
    area = _CELL.length_mm * _CELL.width_mm * M_PER_MM**2
    ours = columns.capacitance(made.in_use, PERMITTIVITY).lower / area * half
    both = thesis_cells.triangles_f_per_m2(_CELL, EPS_R) * half
    return [
        Part("C_tot of half a period, columns", "F/m", ours, printed),
        Part("by our formula", "F/m", both, printed),
        Part("of the exact cell", "F/m", exact_f_per_m2("tri") * half, printed, shown=SHOWN),
    ]


def swept() -> list[Part]:
    """Figure 6.7: the geometry whose flanks are turned flatter, by our formula."""
    turned = [thesis_swept.turned(_CELL, angle) for angle in _TURNED_RAD]
    found = [thesis_cells.triangles_f_per_m2(p, EPS_R) for p in turned]
    return [Part("C/A, turned by 0, 0.1 and 0.2 rad", "F/m2", found)]


def sizes(**said: float) -> list[Part]:
    """Figure 2.12: sizes as the text has them [mm]."""
    return [Part(n.removesuffix("_mm").replace("_", " "), "mm", float(getattr(_CELL, n)), v) for n, v in said.items()]
