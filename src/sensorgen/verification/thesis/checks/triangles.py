"""The triangular cell: 2.10, 3.5, 3.9 to 3.35, figures 3.1, 3.4 and 6.7, against columns and field solvers."""

from dataclasses import asdict, dataclass, replace

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design.shapes import tri
from sensorgen.models import columns, fem2d, thesis_cells
from sensorgen.scene.repetition import cell
from sensorgen.scene.sections import sections
from sensorgen.solvers.electrostatics.mesh import Cones
from sensorgen.solvers.electrostatics.plane import Plane
from sensorgen.solvers.electrostatics.triangles import triangles as cut
from sensorgen.verification.thesis.checks._columns import (
    EPS_R,
    FILM_MM,
    PERMITTIVITY,
    SHOWN,
    Layer,
    exact_f_per_m2,
    pile_f_per_m2,
)
from sensorgen.verification.thesis.checks._field import OMEGA
from sensorgen.verification.thesis.items import ItemPart, Parts

_CELL = tri.Params(dielectric_mm=FILM_MM)
_DESIGN = designs.make({"shape": "tri", "parameters": {"dielectric_mm": FILM_MM}})
_AREA_M2 = _CELL.length_mm * _CELL.width_mm * M_PER_MM**2
_QUARTER_MM = _CELL.period_mm / 4
_APEX_MM = 3 * _QUARTER_MM  # of the first hanging dielectric in our scene
_TAN_GAMMA, _TAN_THETA = _CELL.hang_height_mm / _QUARTER_MM, _CELL.lower_height_mm / _QUARTER_MM
_X_MM = np.array([0.05, 0.2, 0.35, 0.48])  # places under a flank, from its apex
_Y1_M, _Y2_M = _X_MM * _TAN_GAMMA * M_PER_MM, _X_MM * _TAN_THETA * M_PER_MM
_T_M, _D_M = _CELL.hang_height_mm * M_PER_MM, FILM_MM * M_PER_MM
_DISPLACED = EPS0_F_PER_M * EPS_R  # of a volt per metre in X60 [C/m2]
_VOLT = 1.0
_GAUSS = 24  # points of a quadrature


@dataclass(frozen=True)
class _Region:
    """Region under one flank of a hanging triangle: alpha and beta [m] as printed, and whether X60 hangs there."""

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

    def flank_f_per_m(self) -> float:
        """Of the whole flank: a quadrature of our columns [F/m]."""
        nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
        c = [pile_f_per_m2(self.layers(x)) for x in ((nodes + 1) / 2 * _QUARTER_MM).tolist()]
        return float(weights @ c) * _QUARTER_MM / 2 * M_PER_MM

    def formula(self) -> ItemPart:
        """Our copy of the thesis's formula, as corrected."""
        formula = thesis_cells.under_dielectric_f_per_m if self.hangs else thesis_cells.under_cog_f_per_m
        ours, printed = formula(_CELL, EPS_R), _logarithm(self, self.beta_m)
        return ItemPart("as kept in thesis_cells", "F/m", ours, printed, copied=True)

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
    cuts = (outline for prism in _DESIGN.in_use.body(body).pieces for outline in prism.cut("x", x_mm))
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


def upper_flank() -> Parts:
    """3.10: upper face of the gap."""
    yield ItemPart("y1", "m", _faces_mm()[0] * M_PER_MM, _Y1_M)


def lower_flank() -> Parts:
    """3.11: lower face of the gap."""
    yield ItemPart("y2", "m", _faces_mm()[1] * M_PER_MM, _Y2_M)


def gap() -> Parts:
    """3.20: height of the gap."""
    yield ItemPart("y1 - y2", "m", np.subtract(*_faces_mm()) * M_PER_MM, _X_MM * M_PER_MM * (_TAN_GAMMA - _TAN_THETA))


def voltage() -> Parts:
    """3.12, 3.13: fields by thicknesses add up to the voltage."""
    printed = _SOLID.displacement() * ((_T_M - _Y1_M + _FILM_M) / _DISPLACED + _GAP_M / EPS0_F_PER_M)
    yield ItemPart("V", "V", _VOLT, printed)


def field_in_air() -> Parts:
    """3.14, 3.15, at 1 V."""
    printed = _VOLT * EPS_R / ((_T_M - _Y1_M) + EPS_R * _GAP_M + _FILM_M)
    yield ItemPart("E_air", "V/m", _SOLID.displacement() / EPS0_F_PER_M, printed)


def displacement() -> Parts:
    """3.16 to 3.18: per area, at 1 V."""
    yield ItemPart("D", "C/m2", _SOLID.displacement(), _DISPLACED * _VOLT / ((_T_M + _D_M) + (EPS_R - 1) * _GAP_M))


def voltage_under_cog() -> Parts:
    """3.25, with air as medium 2 and X60 as 3."""
    yield ItemPart("V", "V", _VOLT, _COG.displacement() * (_GAP_M / EPS0_F_PER_M + _FILM_M / _DISPLACED))


def displacement_under_cog() -> Parts:
    """3.27 to 3.29."""
    yield ItemPart("D", "C/m2", _COG.displacement(), _DISPLACED * _VOLT / (EPS_R * _Y1_M + _D_M + (1 - EPS_R) * _Y2_M))


def logarithm_under_dielectric() -> Parts:
    """3.23, 3.24."""
    yield ItemPart("C_wd", "F/m", _SOLID.flank_f_per_m(), _logarithm(_SOLID, _SOLID.beta_m))
    yield _SOLID.formula()


def logarithm_under_cog() -> Parts:
    """3.33, 3.34: alpha stands for beta below the fraction."""
    yield ItemPart("C_we", "F/m", _COG.flank_f_per_m(), _logarithm(_COG, _COG.alpha), _logarithm(_COG, _COG.beta_m))
    yield _COG.formula()


def continuity() -> Parts:
    """3.9: the field in air from that in X60, and from the voltage that the X60 leaves to the air."""
    solid = _SOLID.displacement() / _DISPLACED
    yield ItemPart("E in air", "V/m", (_VOLT - solid * (_T_M - _Y1_M + _FILM_M)) / _GAP_M, EPS_R * solid)


def field_under_cog() -> Parts:
    """3.26: what 3.25 leaves for medium 2."""
    d = _COG.displacement()
    ours = (_VOLT - d / _DISPLACED * _FILM_M) / _GAP_M
    yield ItemPart("E2", "V/m", ours, d / EPS0_F_PER_M / EPS_R, d / EPS0_F_PER_M)


def alpha(under: str) -> Parts:
    """3.21, 3.30."""
    yield ItemPart("alpha", "", _UNDER[under].reduced()[0], _UNDER[under].alpha)


def beta(under: str) -> Parts:
    """3.22, 3.31."""
    yield ItemPart("beta", "m", _UNDER[under].reduced()[1], _UNDER[under].beta_m)


def integral(under: str) -> Parts:
    """3.19, 3.32, by quadrature."""
    region, width = _UNDER[under], _QUARTER_MM * M_PER_MM
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
    columns_under = _DISPLACED / (region.beta_m + region.alpha * (nodes + 1) / 2 * width)
    yield ItemPart("C", "F/m", region.flank_f_per_m(), float(np.sum(weights * columns_under) * width / 2))


def _half_f_per_m() -> float:
    """Half a period as drawn, one flank of each kind: of our columns [F/m]."""
    return columns.capacitance(_DESIGN.in_use, PERMITTIVITY).lower / _AREA_M2 * _CELL.period_mm / 2 * M_PER_MM


def parallel() -> Parts:
    """2.10, 2.13: impedances of both flanks by the corrected logarithms, side by side, per depth of 1 m."""
    one, two = (1 / (1j * OMEGA * _logarithm(region, region.beta_m)) for region in _UNDER.values())
    yield ItemPart("Z_t", "ohm", 1 / (1j * OMEGA * _half_f_per_m()), one * two / (one + two))


def whole() -> Parts:
    """3.35: columns agree with columns; the field that leaves the flanks sideways is not in them."""
    half = _CELL.period_mm / 2 * M_PER_MM
    printed = sum(_logarithm(region, region.beta_m) for region in _UNDER.values())
    formula = thesis_cells.triangles_f_per_m2(_CELL, EPS_R) * half
    yield ItemPart("C_tot of half a period, columns", "F/m", _half_f_per_m(), printed)
    yield ItemPart("of the exact cell", "F/m", exact_f_per_m2("tri") * half, printed, shown=SHOWN)
    yield ItemPart("as kept in thesis_cells", "F/m", formula, printed, copied=True)


def gauss() -> Parts:
    """3.5: flux through the electrode, by a solution whose flux has no sources, and by one whose field has no curl."""
    bounds = fem2d.capacitance(_DESIGN.in_use, PERMITTIVITY)
    yield ItemPart("charge by the flux over charge by the potential", "", 1.0, bounds.lower / bounds.upper)


def coarse() -> Parts:
    """Table 3.3: the cell on triangles of at most 1 mm, one across its film, with quadratic elements."""
    (section,) = sections(_DESIGN.in_use)
    few = cut(cell(section, _DESIGN.in_use.size_mm[2]))
    field = Plane(Cones(few, {}), 2)
    eps = np.array([PERMITTIVITY[material] for material, _ in few.regions])
    u = field.potential(eps)
    shares = [share for _, share in few.regions]
    c = EPS0_F_PER_M * float((eps * field.energies(u, u)) @ shares)
    exact = exact_f_per_m2("tri") * _AREA_M2 / (section.depth_mm * M_PER_MM)
    yield ItemPart("C on such a mesh over C of the exact cell", "", c / exact, shown=SHOWN)


def swept(rise_f: float, deepest_mm: float, depth_mm: float) -> Parts:
    """Figure 6.7: displacement for a rise of C, by the field on the geometry that 3.1.2 makes."""

    def c_f(press_mm: float) -> float:
        now = thesis_cells.swept(_CELL, press_mm)
        sizes = asdict(replace(now, length_mm=now.period_mm, width_mm=1.0))
        design = designs.make({"shape": "tri", "parameters": sizes})
        return fem2d.capacitance(design.in_use, PERMITTIVITY).upper * depth_mm

    rest, places = c_f(0.0), np.array([0.0, 0.05, 0.1, 0.15, 0.2])
    rises = [c_f(mm) - rest for mm in places.tolist()]
    down = float(np.interp(rise_f, rises, places, right=np.nan)) * M_PER_MM
    name = "displacement at which the cell has gained 1 pF"
    yield ItemPart(name, "m", down, deepest_mm * M_PER_MM, shown=SHOWN, limit=True)
    yield ItemPart("gain at 0.2 mm; all air is gone at 0.352 mm", "F", rises[-1], shown=SHOWN)
