"""The thesis's own formulas for a cell's capacitance, as printed and as corrected, each by the number it has there.

They are kept to be compared with: the planner never takes them. Film and dielectric are taken to be of one material,
air of permittivity 1, as in the thesis. How far each is off stands in docs/cells.md.

Its geometry of a pressed cell (3.1.2) has no elasticity: air is purged from the gaps, every solid's volume kept. It is
a model of compression by sizes alone, for use with any capacitance model.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import asin, atan2, cos, hypot, log, sin
from typing import Any, TypeVar

from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design.shapes import rect, tri

SOURCE = "Thesis 3.2.1 and 3.2.2, Eqs. 3.24, 3.34, 3.35, 3.49 and 3.55"
COST = 0

_HALVINGS = 60  # of an angle: as far as doubles go

_P = TypeVar("_P", tri.Params, rect.Params)


def under_dielectric_f_per_m(p: tri.Params, eps_r: float) -> float:
    r"""Capacitance under one flank of a hanging dielectric triangle, per depth (Eq. 3.24).

    .. math:: C_{wd} = \frac{\varepsilon_0 \varepsilon_x}{\alpha} \ln \frac{\beta + \alpha w_d}{\beta}, \quad
              \alpha = (\varepsilon_x - 1)(\tan\gamma - \tan\theta), \quad \beta = t_1 + d

    Parameters
    ----------
    p : tri.Params
        Sizes.
    eps_r : float
        Relative permittivity of film and triangles, above 1 [-].

    Returns
    -------
    float
        Capacitance [F/m].
    """
    width, slopes = _flank(p)
    alpha = (eps_r - 1) * (slopes[0] - slopes[1])
    beta = (p.hang_height_mm + p.dielectric_mm) * M_PER_MM
    return EPS0_F_PER_M * eps_r / alpha * log((beta + alpha * width) / beta)


def under_cog_f_per_m(p: tri.Params, eps_r: float, printed: bool = False) -> float:
    r"""Capacitance under one flank of a cog, per depth (Eqs. 3.32 to 3.34).

    .. math:: C_{we} = \frac{\varepsilon_0 \varepsilon_x}{\alpha} \ln \frac{\beta + \alpha w_e}{\beta}, \quad
              \alpha = \varepsilon_x \tan\gamma - (\varepsilon_x - 1) \tan\theta, \quad \beta = d

    Parameters
    ----------
    p : tri.Params
        Sizes.
    eps_r : float
        Relative permittivity of film and triangles, above 1 [-].
    printed : bool
        Take alpha for the logarithm's denominator, as printed: a length over a number, here in metres.

    Returns
    -------
    float
        Capacitance [F/m]; as printed it is negative for every thin film.

    Raises
    ------
    OutOfRange
        The film has no thickness: the integral of 3.32 has no value.
    """
    width, slopes = _flank(p)
    alpha = eps_r * slopes[0] - (eps_r - 1) * slopes[1]
    beta = _film_m(p)
    return EPS0_F_PER_M * eps_r / alpha * log((beta + alpha * width) / (alpha if printed else beta))


def _film_m(p: tri.Params | rect.Params) -> float:
    """Thickness of the film [m]."""
    if p.dielectric_mm <= 0:
        raise OutOfRange("dielectric_mm is 0: the cogs touch the bottom electrode; expected a film")
    return p.dielectric_mm * M_PER_MM


def _flank(p: tri.Params) -> tuple[float, tuple[float, float]]:
    """Width of a flank [m], slope of the hanging and of the lower one [-]."""
    quarter = p.period_mm / 4
    return quarter * M_PER_MM, (p.hang_height_mm / quarter, p.lower_height_mm / quarter)


def triangles_f_per_m2(p: tri.Params, eps_r: float, printed: bool = False) -> float:
    """Capacitance of the triangular design per area, two flanks of each kind in a period (Eq. 3.35) [F/m2].

    Parameters
    ----------
    p : tri.Params
        Sizes.
    eps_r : float
        Relative permittivity of film and triangles, above 1 [-].
    printed : bool
        With Eq. 3.34 as printed.

    >>> f"{triangles_f_per_m2(tri.Params(dielectric_mm=0.1), 4.68) * 2e-3:.4g}"  # F/m and period
    '1.194e-10'
    """
    half = under_dielectric_f_per_m(p, eps_r) + under_cog_f_per_m(p, eps_r, printed)
    return 2 * half / (p.period_mm * M_PER_MM)


def strips_f_per_m2(p: rect.Params, eps_r: float, even: bool = True) -> float:
    """Capacitance of the rectangular design per area, columns side by side (Eq. 3.49) [F/m2].

    Parameters
    ----------
    p : rect.Params
        Sizes.
    eps_r : float
        Relative permittivity of film and strips, above 1 [-].
    even : bool
        Give all four strips of the upper layer a quarter of the period, which is the best reading of the single L in
        3.49 (its we, wd and wa then are the lower layer's air, dielectric and conductor); else each its own width.

    Raises
    ------
    OutOfRange
        The film has no thickness.
    """
    d, t1, t2 = _film_m(p), p.upper_height_mm * M_PER_MM, p.lower_height_mm * M_PER_MM
    own = {"etpu": p.etpu_width_mm, "air": p.air_width_mm, "x60": p.x60_width_mm}
    upper = dict.fromkeys(own, p.period_mm / 4) if even else own
    counts = {"etpu": 1, "air": 2, "x60": 1}
    reduced = {"etpu": 0.0, "air": eps_r, "x60": 1.0}  # thickness times permittivity over that of the layer
    total = 0.0
    for low in own:
        for high in own:
            over = 0.0 if low == "etpu" else reduced[low] * t2 + reduced[high] * t1
            total += counts[low] * own[low] * counts[high] * upper[high] / (d + over)
    return EPS0_F_PER_M * eps_r * total / p.period_mm**2


def bulging_f_per_m2(p: rect.Params, eps_r: float, press_mm: float = 0.0, printed: bool = True) -> float:
    r"""Capacitance of the rectangular design whose dielectric bulges as it is pressed (Eqs. 3.50 to 3.55) [F/m2].

    .. math:: C_r = C_{eq} + \frac{8}{16} \Delta C, \quad
              \Delta C = \frac{\varepsilon_0 \varepsilon_r\, w_e h_1}{(h_1 - \Delta h)^2} L, \quad h_1 = t_1 + t_2 + d

    Constant volume gives the square, which is printed as h1 - dh^2.

    Parameters
    ----------
    p : rect.Params
        Sizes.
    eps_r : float
        Relative permittivity [-].
    press_mm : float
        Compression of the stack, dh [mm].
    printed : bool
        Add the whole term as printed, which does not vanish at rest; else its increment.

    Raises
    ------
    OutOfRange
        The stack is pressed to nothing.
    """
    height = p.upper_height_mm + p.lower_height_mm + p.dielectric_mm
    if not 0 <= press_mm < height:
        raise OutOfRange(f"pressed by {press_mm:g} mm; expected 0 to less than the stack's {height:g} mm")
    strip = p.x60_width_mm * p.period_mm / 4  # the area of one dielectric column, L as in 3.49

    def term(press: float) -> float:
        return EPS0_F_PER_M * eps_r * strip * height / ((height - press) ** 2 * M_PER_MM) / p.period_mm**2

    return strips_f_per_m2(p, eps_r) + 8 / 16 * (term(press_mm) - (0.0 if printed else term(0.0)))


def swept(p: _P, press_mm: float) -> _P:
    """Sizes of a compressed cell.

    Parameters
    ----------
    p : tri.Params or rect.Params
        Sizes at rest.
    press_mm : float
        Displacement of the top [mm].

    Raises
    ------
    OutOfRange
        No air is left before that.
    """
    if not press_mm >= 0:
        raise OutOfRange(f"pressed by {press_mm:g} mm; expected 0 or more")
    work: Callable[[Any, float], Any] = _flattened if isinstance(p, tri.Params) else _widened
    pressed: _P = work(p, press_mm)
    return pressed


def stretch(rest: tri.Params | rect.Params, now: tri.Params | rect.Params) -> float:
    """Area of a cell over that at rest [-]: the triangular cell's period grows, as the flanks turn."""
    grown = now.period_mm / rest.period_mm
    return grown if isinstance(rest, tri.Params) else grown**2


def turned(p: tri.Params, turned_rad: float) -> tri.Params:
    """The triangular design with its flanks turned flatter at constant length, air purged, solids kept.

    Hanging flanks of length r keep it: base r cos, height r sin of their angle. The lower triangles and the film keep
    their areas per period. Hanging triangles keep theirs at 45 degrees to first order, as r^2 sin(2 phi) / 4 is
    greatest there. Per period, the sensor has become longer.

    Parameters
    ----------
    p : tri.Params
        Sizes at rest.
    turned_rad : float
        By how much the flanks are turned [rad].

    Raises
    ------
    OutOfRange
        The flanks would meet the lower triangles: all air is gone before.
    """
    quarter = p.period_mm / 4
    flank, angle = hypot(quarter, p.hang_height_mm), atan2(p.hang_height_mm, quarter) - turned_rad
    base = flank * cos(angle)
    lower, hang = p.lower_height_mm * quarter / base, flank * sin(angle)
    if not 0 < lower < hang:
        raise OutOfRange(f"turned by {turned_rad:g} rad: no air is left; expected less")
    return replace(
        p,
        period_mm=4 * base,
        hang_height_mm=hang,
        lower_height_mm=lower,
        dielectric_mm=p.dielectric_mm * quarter / base,
    )


def _flattened(p: tri.Params, press_mm: float) -> tri.Params:
    """Flanks turned until the top has its displacement."""
    quarter = p.period_mm / 4
    flank, angle = hypot(quarter, p.hang_height_mm), atan2(p.hang_height_mm, quarter)
    rest = p.hang_height_mm + p.dielectric_mm

    def down_mm(now: float) -> float:
        return rest - flank * sin(now) - p.dielectric_mm * quarter / (flank * cos(now))

    closed = 0.5 * asin(2 * p.lower_height_mm * quarter / flank**2)  # lower triangles as high as hanging ones
    if press_mm >= down_mm(closed):
        raise OutOfRange(f"pressed by {press_mm:g} mm: all air is gone at {down_mm(closed):.3g} mm; expected less")
    low, high = closed, angle
    for _ in range(_HALVINGS):  # the displacement is monotonic in the angle
        middle = 0.5 * (low + high)
        low, high = (middle, high) if down_mm(middle) > press_mm else (low, middle)
    return turned(p, angle - high)


def _widened(p: rect.Params, press_mm: float) -> rect.Params:
    """Both layers of strips compressed by the same ratio at constant volume; the film is confined."""
    strips = p.upper_height_mm + p.lower_height_mm
    solid = p.etpu_width_mm + p.x60_width_mm
    most = strips * (1 - solid / p.period_mm)
    if press_mm >= most:
        raise OutOfRange(f"pressed by {press_mm:g} mm: all air is gone at {most:.3g} mm; expected less")
    share = 1 - press_mm / strips
    return replace(
        p,
        etpu_width_mm=p.etpu_width_mm / share,
        x60_width_mm=p.x60_width_mm / share,
        air_width_mm=p.air_width_mm - 0.5 * solid * (1 / share - 1),
        upper_height_mm=p.upper_height_mm * share,
        lower_height_mm=p.lower_height_mm * share,
    )


def _swept(p: Any, eps_r: float, press_mm: float, formula: Callable[..., float]) -> float:
    """Formula on the sizes that 3.1.2 gives a pressed cell, per area of the sensor at rest [F/m2]."""
    q = swept(p, press_mm)
    return formula(q, eps_r) * stretch(p, q)


@dataclass(frozen=True)
class Named:
    """A formula that can be asked for by name.

    Attributes
    ----------
    shapes : tuple of str
        To which it applies.
    work : callable
        Of sizes and permittivity, and of ``press_mm`` where ``pressed`` [F/m2].
    pressed : bool
        Whether it applies to a pressed cell.
    """

    shapes: tuple[str, ...]
    work: Callable[..., float]
    pressed: bool = False

    def value_f_per_m2(self, p: Any, eps_r: float, press_mm: float = 0.0) -> float:
        """Capacitance per area for sizes, permittivity [-] and, where ``pressed``, compression [mm]."""
        return self.work(p, eps_r, press_mm) if self.pressed else self.work(p, eps_r)


_OWN_WIDTHS = partial(strips_f_per_m2, even=False)

NAMED = {
    "thesis-film-only": Named(("tri", "rect"), lambda p, eps_r: EPS0_F_PER_M * eps_r / _film_m(p)),
    "thesis-3.35": Named(("tri",), triangles_f_per_m2),
    "thesis-3.34-printed": Named(("tri",), partial(triangles_f_per_m2, printed=True)),
    "thesis-3.35-swept": Named(("tri",), partial(_swept, formula=triangles_f_per_m2), pressed=True),
    "thesis-3.49": Named(("rect",), strips_f_per_m2),
    "thesis-3.49-own-widths": Named(("rect",), _OWN_WIDTHS),
    "thesis-3.49-swept": Named(("rect",), partial(_swept, formula=_OWN_WIDTHS), pressed=True),
    "thesis-3.55": Named(("rect",), bulging_f_per_m2, pressed=True),
    "thesis-3.55-corrected": Named(("rect",), partial(bulging_f_per_m2, printed=False), pressed=True),
}
