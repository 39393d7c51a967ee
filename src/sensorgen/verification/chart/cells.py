"""Models of a cell's capacitance on scenes whose capacitance is known: solved ones, and closed forms of textbooks.

Textbook scenes lie between a lower and an upper electrode. Their symmetry planes without an electrode are walls of next
to no permittivity on the lower electrode, or under the upper one. Circles are drawn with straight lines that keep their
mean radius.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from math import acosh, asinh, cos, log, pi, sin, tan, tanh
from typing import Any

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design import design as designs
from sensorgen.scene.scene import Body, Outline, Prism, Scene, box
from sensorgen.verification.apart import ModelAnswer
from sensorgen.verification.chart import design, works
from sensorgen.verification.chart.results import OWN, Level, Question, Series, of_scene

PERMITTIVITY = {"air": 1.0, "wall": 1e-10}
CORNERS = 24  # of a quarter of a circle

_PLATE_MM = 0.1  # thickness of electrodes and walls
_FLOOR_MM = 2 * _PLATE_MM


@dataclass(frozen=True)
class KnownCapacitance:
    """A scene whose capacitance is known.

    Attributes
    ----------
    scene : Scene
        As models see it.
    permittivity : mapping of str to float
        Of its dielectrics and of "air" [-].
    capacitance_f_per_m2 : float
        Per area of the sensor [F/m2].
    known_to : float
        Relative half-width of its reference: of textbook scenes what straight lines in place of arcs, a lid in place
        of infinity, and walls that are no mirrors cost [-].
    shape, params : str, Params or None
        What it was made from, for formulas of one shape.
    """

    scene: Scene
    permittivity: Mapping[str, float]
    capacitance_f_per_m2: float
    known_to: float
    shape: str = ""
    params: Any = None


def _exact(scene: Scene, capacitance_f_per_m: float, known_to: float) -> KnownCapacitance:
    """A scene by its capacitance per depth [F/m]."""
    return KnownCapacitance(scene, PERMITTIVITY, capacitance_f_per_m / (scene.size_mm[0] * M_PER_MM), known_to)


def coaxial(corners: int = CORNERS) -> KnownCapacitance:
    r"""A quarter of a coaxial line of radii 1 and 2 mm.

    .. math:: C = \frac{2 \pi \varepsilon_0}{\ln(b / a)}
    """
    low = _above([(0.0, 0.0), *_arc(0.0, 1.0, 0.0, 0.5, corners)])
    high = _above([*_arc(0.0, 2.0, 0.0, 0.5, corners), (0.0, 2.2), (2.2, 2.2), (2.2, 0.0)])
    return _exact(_scene(low, high, 2.2, 2.2), 0.5 * pi * EPS0_F_PER_M / log(2), 2e-5)


def eccentric(corners: int = CORNERS) -> KnownCapacitance:
    r"""Half of a line of radii 1 and 2 mm whose axes are 0.5 mm apart.

    .. math:: C = \frac{2 \pi \varepsilon_0}{\operatorname{arcosh}((a^2 + b^2 - e^2) / (2 a b))}
    """
    low = _above(_arc(2.7, 1.0, 0.0, 1.0, 2 * corners))
    high = _above([(4.4, 0.0), *_arc(2.2, 2.0, 0.0, 1.0, 2 * corners), (0.0, 0.0), (0.0, 2.2), (4.4, 2.2)])
    return _exact(_scene(low, high, 4.4, 2.2), pi * EPS0_F_PER_M / acosh((5 - 0.25) / 4), 2e-5)


def stripline() -> KnownCapacitance:
    r"""The upper half of a strip w = 1 mm wide, without thickness, midway between plates b = 1 mm apart.

    .. math:: C = 4 \varepsilon_0 \frac{K(k)}{K(k')}, \quad k = \tanh\frac{\pi w}{2 b}
    """
    low = Body("low", "etpu", (box(3.5, 4.5, 0, 1, _PLATE_MM, _FLOOR_MM), box(0, 8.0, 0, 1, 0, _PLATE_MM)), "bottom")
    roof = _FLOOR_MM + 0.5
    high = Body("high", "etpu", (box(0, 8, 0, 1, roof, roof + _PLATE_MM),), "top")
    wall = Body("wall", "wall", tuple(box(a, b, 0, 1, _PLATE_MM, _FLOOR_MM) for a, b in ((0, 3.5), (4.5, 8))))
    exact = 2 * EPS0_F_PER_M * _ratio(tanh(pi / 2))
    return _exact(Scene((low, wall, high), (8.0, 1.0, roof + _PLATE_MM)), exact, 1e-7)


def interdigital() -> KnownCapacitance:
    r"""Fingers of no thickness that fill half of their plane, on a half space: from one's middle to the next one's.

    .. math:: C = \tfrac{1}{2} \varepsilon_0 \frac{K(k)}{K(k')}, \quad k = \sin\frac{\pi s}{2}

    Igreja and Dias, Sens. Actuators A 112, 291 (2004). The next finger is on a lid 4 pitches up, under a wall.
    """
    roof = _FLOOR_MM + 8.0
    low = Body("low", "etpu", (box(0, 0.5, 0, 1, _PLATE_MM, _FLOOR_MM), box(0, 2.0, 0, 1, 0, _PLATE_MM)), "bottom")
    high = Body(
        "high", "etpu", (box(1.5, 2, 0, 1, _PLATE_MM + 0.05, _FLOOR_MM), box(0, 2, 0, 1, roof, roof + _PLATE_MM)), "top"
    )
    walls = box(0.5, 1.5, 0, 1, _PLATE_MM, _FLOOR_MM), box(1.5, 2, 0, 1, _PLATE_MM, _PLATE_MM + 0.05)
    under_lid = box(0, 2, 0, 1, roof - _PLATE_MM, roof)
    scene = Scene((low, Body("wall", "wall", (*walls, under_lid)), high), (2.0, 1.0, roof + _PLATE_MM))
    return _exact(scene, 0.5 * EPS0_F_PER_M * _ratio(sin(pi / 4)), 1e-7)


def _arc(middle: float, radius: float, start: float, stop: float, corners: int) -> Iterator[tuple[float, float]]:
    """Corners of an arc, counter-clockwise; angles in half turns. Sides between them have the arc's mean radius."""
    half = 0.5 * pi * (stop - start) / corners
    outer = radius * half / (cos(half) * asinh(tan(half)))
    for k in range(corners + 1):
        angle = pi * (start + (stop - start) * k / corners)
        yield middle + outer * cos(angle), outer * sin(angle)


def _above(points: Iterable[tuple[float, float]]) -> Outline:
    """Raised onto the floor."""
    return tuple((round(x, 12), round(z, 12) + _FLOOR_MM) for x, z in points)


def _scene(low: Outline, high: Outline, length_mm: float, height_mm: float) -> Scene:
    """Two conductors over a wall that covers the whole floor."""
    bodies = (
        Body("low", "etpu", (Prism("y", low, 0, 1), box(0, length_mm, 0, 1, 0, _PLATE_MM)), "bottom"),
        Body("wall", "wall", (box(0, length_mm, 0, 1, _PLATE_MM, _FLOOR_MM),)),
        Body("high", "etpu", (Prism("y", high, 0, 1),), "top"),
    )
    return Scene(bodies, (length_mm, 1.0, height_mm + _FLOOR_MM))


def _ratio(k: float) -> float:
    """K(k) / K(k'), complete elliptic integrals of the first kind."""
    from scipy.special import ellipk, ellipkm1

    return float(ellipk(k * k) / ellipkm1(k * k))


_LEAST_WIDTH = 1e-9  # that is asked of a model
_NO_PEERS = ("plate, 0.6 mm",)  # exact by all of them


def _designed(shape: str, dielectric_mm: float, capacitance_f_per_m2: float, known_to: float) -> KnownCapacitance:
    design = designs.make({"shape": shape, "parameters": {"dielectric_mm": dielectric_mm}})
    return KnownCapacitance(design.in_use, _EPS, capacitance_f_per_m2, known_to, shape, design.params)


# tri: hp finite elements, agreeing with two other programs; rect: H1 and H(div) elements, agreeing with finite volumes;
# the others are exact.
_EPS = {"x60": 4.68, "air": 1.00059}
STANDARD: dict[str, Callable[[], KnownCapacitance]] = {
    "tri, 0.1 mm": lambda: _designed("tri", 0.1, 1.5965204052211506e-10 / 2e-3, 9e-10),
    "tri, 0.2 mm": lambda: _designed("tri", 0.2, 1.2851365895937111e-10 / 2e-3, 8e-10),
    "rect, 0.1 mm": lambda: _designed("rect", 0.1, 8.123429165e-13 / 4e-6, 2.7e-5),
    "rect, 0.2 mm": lambda: _designed("rect", 0.2, 4.852340605e-13 / 4e-6, 2.5e-5),
    "plate, 0.6 mm": lambda: _designed("reference", 0.6, EPS0_F_PER_M * _EPS["x60"] / 0.6e-3, 1e-15),
    "coaxial line": coaxial,
    "eccentric cylinders": eccentric,
    "stripline": stripline,
    "interdigital, half space": interdigital,
}


def question(name: str) -> Question:
    """Capacitance of a scene per area, by every model that applies to it and by programs of others [F/m2]."""
    standard = STANDARD[name]()
    scene, eps = standard.scene, standard.permittivity
    per_m2 = 1 / (scene.size_mm[0] * scene.size_mm[1] * M_PER_MM**2)

    def levels(_: str, module: Any) -> Iterator[Level]:
        for wanted, bounds in _widths(module, standard):
            yield f"width {wanted:g}" if wanted else "", partial(_per_area, bounds, per_m2), 0.0

    formulas = list(design.formulas(standard.shape, standard.params, eps, "x60", 1.0))
    only = Series("thesis_cells", OWN, (), "it has formulas of tri and rect alone")
    others = () if name in _NO_PEERS else design.programs(scene, eps, per_m2)
    series = (*design.bounds(scene, levels), *(formulas or (only,)), *others)
    known, known_to = standard.capacitance_f_per_m2, standard.known_to
    return of_scene(name, "the capacitance of a cell at rest", series, known, known_to)


def _per_area(bounds: Callable[[], Interval | None], per_m2: float) -> ModelAnswer:
    return works.bounded(interval, per_m2) if (interval := bounds()) else ModelAnswer(())


def _widths(module: Any, standard: KnownCapacitance) -> Iterator[tuple[float | None, Callable[[], Interval | None]]]:
    """Widths to ask a model for, each a decade less than was reached, and the work that gives bounds [F]."""
    given, reached = (standard.scene, standard.permittivity), dict[float, float]()
    if math.inf == module.WIDTH:
        yield None, partial(module.capacitance, *given)
        return

    def bounds(wanted: float, last: float) -> Interval | None:
        with suppress(SensorgenError):  # doubles end here, or this order fails
            interval: Interval = module.capacitance(*given, wanted)
            reached[wanted] = interval.width()
            return interval if interval.width() < last else None
        return None

    wanted, last = 0.1, math.inf
    while wanted >= _LEAST_WIDTH * (1 - 1e-6):
        yield wanted, partial(bounds, wanted, last)
        if wanted in reached:
            last = reached[wanted]
            if last > wanted or last == 0:
                return
            wanted = 10.0 ** (math.ceil(math.log10(last)) - 1)
        elif reached:
            return
        else:
            wanted /= 10
