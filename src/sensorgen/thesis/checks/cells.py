"""Capacitance of cells: 2.5 to 2.8, 2.10, 2.19 to 2.23, 3.5 to 3.55, 4.1, against columns and field solvers."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sensorgen import design as designs
from sensorgen import planner
from sensorgen.errors import MissingValue
from sensorgen.models import columns, thesis_cells
from sensorgen.scene import Body, Scene, box
from sensorgen.shapes import rect, tri
from sensorgen.thesis.checks._field import OMEGA, RHO_OHM_M
from sensorgen.thesis.verdicts import Part
from sensorgen.units import EPS0_F_PER_M, M_PER_MM

EPS_R = 4.68
_SHOWN = 3  # digits of them
ACCURACY = 1e-3  # of the field solvers' answers, against which 20 % show

_TRI = tri.Params(dielectric_mm=0.1)
_RECT = rect.Params(dielectric_mm=0.1)
_X_MM = np.array([0.05, 0.2, 0.35, 0.48])  # places under a flank
_VOLT = 1.0
_EPS = {"x60": EPS_R, "air": 1.0}  # the thesis takes air for vacuum
_GAUSS = 60  # points of a quadrature

Real = NDArray[np.float64]
Layer = tuple[str, float]  # material and thickness [mm]


def _piles(piles: Sequence[tuple[float, Sequence[Layer]]], depth_mm: float = 1.0) -> float:
    """Capacitance of columns side by side, each of a width [mm] and of layers from below, by our columns [F].

    The top electrode comes down to each of them, so that what stands in a column is what is named.
    """
    top = 1 + max(sum(thickness for _, thickness in layers) for _, layers in piles)
    end = sum(width for width, _ in piles)
    boxes: dict[str, list[tuple[float, ...]]] = {"x60": [], "top": []}
    left = 0.0
    for width, layers in piles:
        z = 0.1
        for material, thickness in layers:
            if material == "x60":
                boxes["x60"].append((left, left + width, 0.0, depth_mm, z, z + thickness))
            z += thickness
        boxes["top"].append((left, left + width, 0.0, depth_mm, z, top))
        left += width
    bodies = (
        Body("bottom_electrode", "etpu", (box(0, end, 0, depth_mm, 0, 0.1),), "bottom"),
        Body("film", "x60", tuple(box(*b) for b in boxes["x60"])),
        Body("top_electrode", "etpu", tuple(box(*b) for b in boxes["top"]), "top"),
    )
    return columns.capacitance(Scene(bodies, (end, depth_mm, top)), _EPS).lower


def _pile(*layers: Layer) -> float:
    """Capacitance per area of layers on one another [F/m2]."""
    return _piles([(1.0, layers)]) / M_PER_MM**2


def _flanks(p: tri.Params) -> tuple[Real, Real, Real, Real]:
    """Lower face of the hanging triangle and top of the lower one at places from its root, and both slopes [mm]."""
    quarter = p.period_mm / 4
    gamma, theta = p.hang_height_mm / quarter, p.lower_height_mm / quarter
    return _X_MM * gamma, _X_MM * theta, np.asarray(gamma), np.asarray(theta)


def _under_dielectric(p: tri.Params, x_mm: Real) -> Real:
    """Capacitance per area of the column at x from the middle between two apexes, of X60, air and X60 [F/m2]."""
    quarter = p.period_mm / 4
    found = []
    for x in x_mm:
        y1, y2 = x * p.hang_height_mm / quarter, x * p.lower_height_mm / quarter
        found.append(_pile(("x60", y2 + p.dielectric_mm), ("air", y1 - y2), ("x60", p.hang_height_mm - y1)))
    return np.array(found)


def _under_cog(p: tri.Params, x_mm: Real) -> Real:
    """The same under a cog, of X60 and air."""
    quarter = p.period_mm / 4
    found = []
    for x in x_mm:
        y1, y2 = x * p.hang_height_mm / quarter, x * p.lower_height_mm / quarter
        found.append(_pile(("x60", y2 + p.dielectric_mm), ("air", y1 - y2)))
    return np.array(found)


def plate(eps_r: float = EPS_R) -> list[Part]:
    """2.5, 2.7, 4.1, B.9, B.10: the plate of Table 3.1."""
    found = designs.make({"shape": "reference"})
    ours = columns.capacitance(found.in_use, {"x60": eps_r, "air": 1.0})
    p = found.params
    area = p.length_mm * p.width_mm * M_PER_MM**2
    printed = EPS0_F_PER_M * eps_r * area / (0.6 * M_PER_MM)
    return [Part("C", "F", (ours.lower + ours.upper) / 2, printed)]


def parallel() -> list[Part]:
    """2.10: two impedances side by side, under the cog and under the dielectric."""
    ours = 1 / (1j * OMEGA * thesis_cells.triangles_f_per_m2(_TRI, EPS_R) * _TRI.period_mm * M_PER_MM / 2)
    one, two = (1 / (1j * OMEGA * c) for c in (
        thesis_cells.under_dielectric_f_per_m(_TRI, EPS_R), thesis_cells.under_cog_f_per_m(_TRI, EPS_R)
    ))  # fmt: skip
    return [Part("Z_t of 1 m depth", "ohm", ours, one * two / (one + two))]


# A rung of the rectangular design, of 0.35 mm by 1 mm: layers from below, and the height of the cog in it.
_RUNGS: dict[int, tuple[tuple[Layer, ...], float]] = {
    1: ((("x60", 0.4), ("air", 0.3)), 0.0),
    2: ((("x60", 0.1), ("air", 0.3)), 0.3),
    3: ((("x60", 0.7),), 0.0),
    4: ((("x60", 0.1),), 0.6),
}
_WIDTH_MM = 0.35


def _reactance(layers: Sequence[Layer]) -> float:
    """Sum of 1/(omega C) of layers by 2.6 and 2.8 [ohm]."""
    area = _WIDTH_MM * 1.0 * M_PER_MM**2
    return sum(t * M_PER_MM / (OMEGA * EPS0_F_PER_M * _EPS[name] * area) for name, t in layers)


def _cog(height_mm: float) -> float:
    """Resistance of a cog by 2.9 [ohm]."""
    return RHO_OHM_M * height_mm / (_WIDTH_MM * 1.0 * M_PER_MM)


def rung(number: int) -> list[Part]:
    """2.19 to 2.22: reactances added to a resistance as though they were real."""
    layers, cog_mm = _RUNGS[number]
    ours = _cog(cog_mm) + 1 / (1j * OMEGA * _piles([(_WIDTH_MM, layers)]))
    printed = _cog(cog_mm) + _reactance(layers)
    return [Part(f"Z_{number}", "ohm", ours, complex(printed), _cog(cog_mm) - 1j * _reactance(layers))]


def rungs() -> list[Part]:
    """2.23: four impedances side by side, of cogs that do not resist."""
    z1, z2, z3, z4 = (-1j * _reactance(layers) for layers, _ in _RUNGS.values())
    ours = 1 / (1j * OMEGA * _piles([(_WIDTH_MM, layers) for layers, _ in _RUNGS.values()]))
    printed = z1 * z2 * z3 * z4 / (z1 * z2 * z3 + z2 * z3 * z4 + z1 * z2 * z4 + z1 * z3 * z4)
    return [Part("Z_r", "ohm", ours, printed)]


def _height_at(body: str, x_mm: float, lowest: bool) -> float:
    """Height of a body's lower or upper face over the film in the cross-section of our scene [mm]."""
    made = designs.make({"shape": "tri", "parameters": {"dielectric_mm": _TRI.dielectric_mm}})
    cuts = [point for prism in made.in_use.body(body).prisms for o in prism.cut("x", x_mm) for point in o]
    z = [point[1] for point in cuts]
    return (min(z) if lowest else max(z)) - _TRI.electrode_mm - _TRI.dielectric_mm


def upper_flank() -> list[Part]:
    """3.10: height of the hanging triangle's face in our scene, from its apex at 1.5 mm."""
    ours = [_height_at("hanging_dielectric", 1.5 - x, lowest=True) for x in _X_MM]
    return [Part("y1", "mm", ours, _flanks(_TRI)[0])]


def lower_flank() -> list[Part]:
    """3.11: height of the lower triangle's face, whose foot is under that apex."""
    ours = [_height_at("film_and_lower", 1.5 - x, lowest=False) for x in _X_MM]
    return [Part("y2", "mm", ours, _flanks(_TRI)[1])]


def difference_of_flanks() -> list[Part]:
    """3.20."""
    (upper,), (lower,) = upper_flank(), lower_flank()
    _, _, gamma, theta = _flanks(_TRI)
    return [Part("y1 - y2", "mm", np.asarray(upper.ours) - np.asarray(lower.ours), _X_MM * (gamma - theta))]


def _fields() -> tuple[Real, Real, Real]:
    """Displacement of the columns under the dielectric by our model, for 1 V [C/m2], and both heights [m]."""
    y1, y2, _, _ = _flanks(_TRI)
    return _under_dielectric(_TRI, _X_MM) * _VOLT, y1 * M_PER_MM, y2 * M_PER_MM


_T_M, _D_M = _TRI.hang_height_mm * M_PER_MM, _TRI.dielectric_mm * M_PER_MM


def continuity() -> list[Part]:
    """3.9: the field in air from that in X60, and from the voltage that the X60 leaves to the air."""
    d, y1, y2 = _fields()
    solid = d / (EPS0_F_PER_M * EPS_R)
    left = (_VOLT - solid * (_T_M - y1 + y2 + _D_M)) / (y1 - y2)
    return [Part("E in air", "V/m", left, EPS_R * solid)]


def voltage() -> list[Part]:
    """3.12, 3.13: fields by thicknesses add up to the voltage."""
    d, y1, y2 = _fields()
    solid, air = d / (EPS0_F_PER_M * EPS_R), d / EPS0_F_PER_M
    return [Part("V", "V", _VOLT, solid * (_T_M - y1) + air * (y1 - y2) + solid * (y2 + _D_M))]


def field_in_air() -> list[Part]:
    """3.14, 3.15."""
    d, y1, y2 = _fields()
    printed = _VOLT * EPS_R / ((_T_M - y1) + EPS_R * (y1 - y2) + (y2 + _D_M))
    return [Part("E_air", "V/m", d / EPS0_F_PER_M, printed)]


def displacement() -> list[Part]:
    """3.16 to 3.18: displacement, charge and capacitance per area."""
    d, y1, y2 = _fields()
    printed = EPS0_F_PER_M * EPS_R * _VOLT / ((_T_M + _D_M) + (EPS_R - 1) * (y1 - y2))
    return [Part("D", "C/m2", d, printed)]


def _line_of(inverse: Real) -> tuple[float, float]:
    """Slope and start of a straight line through values at the places."""
    slope, start = np.polyfit(_X_MM * M_PER_MM, inverse, 1)
    return float(slope), float(start)


def alpha_under_dielectric() -> list[Part]:
    """3.21: slope of eps0 eps_x / C' over x."""
    _, _, gamma, theta = _flanks(_TRI)
    ours, _ = _line_of(EPS0_F_PER_M * EPS_R / _under_dielectric(_TRI, _X_MM))
    return [Part("alpha", "", ours, float((EPS_R - 1) * (gamma - theta)))]


def beta_under_dielectric() -> list[Part]:
    """3.22: its start."""
    _, ours = _line_of(EPS0_F_PER_M * EPS_R / _under_dielectric(_TRI, _X_MM))
    return [Part("beta", "m", ours, _T_M + _D_M)]


def alpha_under_cog() -> list[Part]:
    """3.30."""
    _, _, gamma, theta = _flanks(_TRI)
    ours, _ = _line_of(EPS0_F_PER_M * EPS_R / _under_cog(_TRI, _X_MM))
    return [Part("alpha", "", ours, float(EPS_R * gamma - (EPS_R - 1) * theta))]


def beta_under_cog() -> list[Part]:
    """3.31."""
    _, ours = _line_of(EPS0_F_PER_M * EPS_R / _under_cog(_TRI, _X_MM))
    return [Part("beta", "m", ours, _D_M)]


def _integral(alpha: float, beta_m: float) -> float:
    """Of eps0 eps_x / (beta + alpha x) over a flank, by quadrature [F/m]."""
    width = _TRI.period_mm / 4 * M_PER_MM
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
    x = (nodes + 1) / 2 * width
    return float(np.sum(weights * EPS0_F_PER_M * EPS_R / (beta_m + alpha * x)) * width / 2)


def integral_under_dielectric() -> list[Part]:
    """3.19."""
    _, _, gamma, theta = _flanks(_TRI)
    printed = _integral(float((EPS_R - 1) * (gamma - theta)), _T_M + _D_M)
    return [Part("C_wd", "F/m", thesis_cells.under_dielectric_f_per_m(_TRI, EPS_R), printed)]


def integral_under_cog() -> list[Part]:
    """3.32."""
    _, _, gamma, theta = _flanks(_TRI)
    printed = _integral(float(EPS_R * gamma - (EPS_R - 1) * theta), _D_M)
    return [Part("C_we", "F/m", thesis_cells.under_cog_f_per_m(_TRI, EPS_R), printed)]


def logarithm_under_dielectric() -> list[Part]:
    """3.23, 3.24."""
    _, _, gamma, theta = _flanks(_TRI)
    alpha, beta, width = float((EPS_R - 1) * (gamma - theta)), _T_M + _D_M, _TRI.period_mm / 4 * M_PER_MM
    printed = EPS0_F_PER_M * EPS_R / alpha * np.log((beta + alpha * width) / beta)
    return [Part("C_wd", "F/m", thesis_cells.under_dielectric_f_per_m(_TRI, EPS_R), float(printed))]


def logarithm_under_cog() -> list[Part]:
    """3.33, 3.34: alpha stands for beta below the fraction."""
    _, _, gamma, theta = _flanks(_TRI)
    alpha, width = float(EPS_R * gamma - (EPS_R - 1) * theta), _TRI.period_mm / 4 * M_PER_MM

    def over(denominator: float) -> float:
        return float(EPS0_F_PER_M * EPS_R / alpha * np.log((_D_M + alpha * width) / denominator))

    return [Part("C_we", "F/m", thesis_cells.under_cog_f_per_m(_TRI, EPS_R), over(alpha), over(_D_M))]


def _cog_fields() -> tuple[Real, Real, Real]:
    """As :func:`_fields`, under the cog."""
    y1, y2, _, _ = _flanks(_TRI)
    return _under_cog(_TRI, _X_MM) * _VOLT, y1 * M_PER_MM, y2 * M_PER_MM


def voltage_under_cog() -> list[Part]:
    """3.25, with air as medium 2 and X60 as 3."""
    d, y1, y2 = _cog_fields()
    air, solid = d / EPS0_F_PER_M, d / (EPS0_F_PER_M * EPS_R)
    return [Part("V", "V", _VOLT, air * (y1 - y2) + solid * (y2 + _D_M))]


def field_under_cog() -> list[Part]:
    """3.26: medium 2 of 3.25 is the air, so that it is E3 that is smaller."""
    d, y1, y2 = _cog_fields()
    air = d / EPS0_F_PER_M
    ours = (_VOLT - d / (EPS0_F_PER_M * EPS_R) * (y2 + _D_M)) / (y1 - y2)  # what 3.25 leaves for medium 2
    return [Part("E2", "V/m", ours, air / EPS_R, air)]


def displacement_under_cog() -> list[Part]:
    """3.27 to 3.29."""
    d, y1, y2 = _cog_fields()
    return [Part("D", "C/m2", d, EPS0_F_PER_M * EPS_R * _VOLT / (EPS_R * y1 + _D_M + (1 - EPS_R) * y2))]


def _exact(shape: str) -> float:
    """Capacitance per area of a default cell between close bounds, the mean of both [F/m2]."""
    made = designs.make({"shape": shape, "parameters": {"dielectric_mm": 0.1}})
    eps = {taken.material: taken.value for taken in planner.permittivities(made)}
    found = planner.capacitance(made.in_use, eps, ACCURACY)
    if not found.reached():
        raise MissingValue(f"no solver here comes as near as {ACCURACY:g}: pip install 'sensorgen[fem]'")
    area = made.params.length_mm * made.params.width_mm * M_PER_MM**2
    return (found.capacitance_f.lower + found.capacitance_f.upper) / 2 / area


def triangles() -> list[Part]:
    """3.35: columns agree with columns; the field that leaves the flanks sideways is not in them."""
    half = _TRI.period_mm / 2 * M_PER_MM
    printed = thesis_cells.under_dielectric_f_per_m(_TRI, EPS_R) + thesis_cells.under_cog_f_per_m(_TRI, EPS_R)
    made = designs.make({"shape": "tri", "parameters": {"dielectric_mm": _TRI.dielectric_mm}})
    area = _TRI.length_mm * _TRI.width_mm * M_PER_MM**2
    ours = columns.capacitance(made.in_use, _EPS).lower / area
    return [
        Part("C_tot of half a period, columns", "F/m", ours * half, printed),
        Part("of the exact cell", "F/m", _exact("tri") * half, printed, shown=_SHOWN),
    ]


def _strip(below: str, above: str, printed: float) -> Part:
    """One of the sixteen columns of the rectangular cell: what is in its lower and its upper layer."""
    layers: list[Layer] = [("x60", _RECT.dielectric_mm)]
    if below != "etpu":
        layers.append((below, _RECT.lower_height_mm))
        layers += [(above, _RECT.upper_height_mm)] if above != "etpu" else []
    return Part(f"{above} over {below}", "F/m2", _pile(*layers), EPS0_F_PER_M * EPS_R / (printed * M_PER_MM))


def strips(below: str) -> list[Part]:
    """3.39 to 3.48: columns over one strip of the lower layer, per area of the column."""
    d, t1, t2, e = _RECT.dielectric_mm, _RECT.upper_height_mm, _RECT.lower_height_mm, EPS_R
    printed = {
        "air": {"etpu": e * t2 + d, "x60": e * t2 + t1 + d, "air": e * (t1 + t2) + d},
        "x60": {"etpu": t2 + d, "x60": t1 + t2 + d, "air": e * t1 + t2 + d},
        "etpu": {"etpu": d, "x60": d, "air": d},
    }
    return [_strip(below, above, thickness) for above, thickness in printed[below].items()]


def strip(below: str, above: str) -> list[Part]:
    """One of them."""
    return [part for part in strips(below) if part.name == f"{above} over {below}"]


def in_series_by_thickness() -> list[Part]:
    """3.37, 3.38: two dielectrics on one another, the second of air."""
    h1, h2 = 0.1, 0.3
    one, two = EPS0_F_PER_M * EPS_R, EPS0_F_PER_M
    ours = _pile(("x60", h1), ("air", h2))
    return [
        Part("C per area by 3.37", "F/m2", ours, 1 / (h1 * M_PER_MM / one + h2 * M_PER_MM / two)),
        Part("C per area by 3.38", "F/m2", ours, one * two / ((one * h2 + two * h1) * M_PER_MM)),
    ]


def _printed_strips() -> float:
    """3.49, its widths those of the lower strips and its L a quarter of the period [F]."""
    d, t1, t2 = (v * M_PER_MM for v in (_RECT.dielectric_mm, _RECT.upper_height_mm, _RECT.lower_height_mm))
    we, wd, wa = (v * M_PER_MM for v in (_RECT.air_width_mm, _RECT.x60_width_mm, _RECT.etpu_width_mm))
    one = EPS0_F_PER_M * EPS_R * _RECT.period_mm / 4 * M_PER_MM
    over_air = 2 * we / (EPS_R * t2 + d) + 2 * we / (EPS_R * t2 + t1 + d) + 4 * we / (EPS_R * (t1 + t2) + d)
    over_x60 = wd / (t2 + d) + wd / (t1 + t2 + d) + 2 * wd / (EPS_R * t1 + t2 + d)
    return one * (over_air + over_x60 + 4 * wa / d)


def sixteen_columns() -> list[Part]:
    """3.36: the sum over the lower strips."""
    area = (_RECT.period_mm * M_PER_MM) ** 2
    return [Part("C_eq", "F", thesis_cells.strips_f_per_m2(_RECT, EPS_R) * area, _printed_strips())]


def rectangles() -> list[Part]:
    """3.49: the formula, and the cell that it speaks of."""
    area = (_RECT.period_mm * M_PER_MM) ** 2
    return [*sixteen_columns(), Part("of the exact cell", "F", _exact("rect") * area, _printed_strips(), shown=_SHOWN)]


_PRESS_MM = 0.05


def _bulged() -> tuple[float, float]:
    """How many times the dielectric's term grows when pressed, by our model; and its height [-], [mm]."""
    height = _RECT.upper_height_mm + _RECT.lower_height_mm + _RECT.dielectric_mm
    rest = thesis_cells.strips_f_per_m2(_RECT, EPS_R)
    pressed, free = (thesis_cells.bulging_f_per_m2(_RECT, EPS_R, dh) - rest for dh in (_PRESS_MM, 0.0))
    return pressed / free, height


def constant_volume() -> list[Part]:
    """3.50 to 3.52: the bulge that keeps the area of the cross-section, and what it does to a plate's capacitance."""
    times, h1 = _bulged()
    we = _RECT.x60_width_mm
    bulge = _PRESS_MM * we / (h1 - _PRESS_MM)
    return [
        Part("area after / before", "", 1.0, (we + bulge) * (h1 - _PRESS_MM) / (we * h1)),
        Part("capacitance after / before", "", times, (we + bulge) / (h1 - _PRESS_MM) / (we / h1)),
    ]


def bulging_term() -> list[Part]:
    """3.53: the square belongs to the bracket; lengths in metres, as printed they would matter."""
    times, h1_mm = _bulged()
    h1, dh = h1_mm * M_PER_MM, _PRESS_MM * M_PER_MM
    return [Part("capacitance after / before", "", times, h1 * h1 / (h1 - dh**2) / h1, (h1 / (h1 - dh)) ** 2)]


def bulging() -> list[Part]:
    """3.54: what it adds to a cell that nothing presses."""
    ours, printed = (thesis_cells.bulging_f_per_m2(_RECT, EPS_R, 0.0, printed=way) for way in (False, True))
    return [Part("C_r at rest", "F/m2", ours, printed)]


def swept() -> list[Part]:
    """Figure 6.7: the geometry whose flanks are turned flatter, by our columns."""
    angles = (0.0, 0.1, 0.2)
    turned = [thesis_cells.swept(replace(_TRI), angle) for angle in angles]
    return [Part("C/A at 0, 0.1 and 0.2 rad", "F/m2", [thesis_cells.triangles_f_per_m2(p, EPS_R) for p in turned])]


def tri_sizes(**said: float) -> list[Part]:
    """Figures 2.12 and 3.4: sizes of the triangular cell as the text has them [mm]."""
    return [Part(_words(name), "mm", float(getattr(_TRI, name)), value) for name, value in said.items()]


def rect_sizes(**said: float) -> list[Part]:
    """Figures 2.14, 3.5 and 3.6: sizes of the rectangular cell [mm]."""
    return [Part(_words(name), "mm", float(getattr(_RECT, name)), value) for name, value in said.items()]


def _words(size: str) -> str:
    """A parameter's name without its unit."""
    return size.removesuffix("_mm").replace("_", " ")
