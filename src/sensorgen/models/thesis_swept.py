"""The thesis's geometry of a pressed cell: no elasticity, air purged from the gaps, every solid's volume kept (3.1.2).

A model of compression by sizes alone, for use with any capacitance model. Its error against solved compression is in
docs/cells.md.
"""

from collections.abc import Callable
from dataclasses import replace
from math import asin, atan2, cos, hypot, sin
from typing import Any, TypeVar, cast

from sensorgen.core.errors import OutOfRange
from sensorgen.design.shapes import rect, tri

SOURCE = "Thesis 3.1.2 and figures 6.7 and 6.10"
COST = 0
NAME = "thesis-3.1.2"
SHAPES = ("tri", "rect")

_HALVINGS = 60  # of an angle: as far as doubles go


_P = TypeVar("_P", tri.Params, rect.Params)


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
    ways: dict[type, Callable[[Any, float], Any]] = {tri.Params: _flattened, rect.Params: _widened}
    return cast(_P, ways[type(p)](p, press_mm))


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
