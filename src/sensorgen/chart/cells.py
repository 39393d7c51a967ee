"""Models of a cell's capacitance on scenes whose capacitance is known."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from sensorgen import design as designs
from sensorgen import planner
from sensorgen.chart.measured import Point, timed
from sensorgen.design import Design
from sensorgen.interval import Interval
from sensorgen.models import thesis_cells
from sensorgen.units import EPS0_F_PER_M, M_PER_MM

_LEAST_WIDTH = 1e-9  # that is asked of a model
_DEARER = 10.0  # by how much the next accuracy may cost more than the last


@dataclass(frozen=True)
class Standard:
    """A scene whose capacitance is known.

    Attributes
    ----------
    data : dict
        The design, as in its file.
    capacitance_f_per_m2 : float
        Per area of the sensor [F/m2].
    known_to : float
        Relative half-width of the bounds that it was computed with [-].
    """

    data: dict[str, Any]
    capacitance_f_per_m2: float
    known_to: float


def _film(shape: str, dielectric_mm: float) -> dict[str, Any]:
    return {"shape": shape, "parameters": {"dielectric_mm": dielectric_mm}}


# Relative permittivities 4.68 and 1.00059. tri: hp finite elements, agreeing with two other programs; rect: H1 and
# H(div) elements, agreeing with finite volumes; the plate is exact.
STANDARD = {
    "tri, 0.1 mm": Standard(_film("tri", 0.1), 1.5965204052211506e-10 / 2e-3, 9e-10),
    "tri, 0.2 mm": Standard(_film("tri", 0.2), 1.2851365895937111e-10 / 2e-3, 8e-10),
    "rect, 0.1 mm": Standard(_film("rect", 0.1), 8.123429165e-13 / 4e-6, 2.7e-5),
    "rect, 0.2 mm": Standard(_film("rect", 0.2), 4.852340605e-13 / 4e-6, 2.5e-5),
    "plate, 0.6 mm": Standard(_film("reference", 0.6), EPS0_F_PER_M * 4.68 / 0.6e-3, 1e-15),
}


def points(name: str, budget_s: float) -> list[Point]:
    """Measure every model that can speak of a scene.

    Parameters
    ----------
    name : str
        Of ``STANDARD``.
    budget_s : float
        A model is not asked for more where that would take longer, ten times the last one taken as a guess [s].
    """
    planner.load_solver()
    design = designs.make(STANDARD[name].data)
    return [*_formulas(name, design), *_bounds(name, design, budget_s)]


def _bounds(name: str, design: Design, budget_s: float) -> Iterator[Point]:
    """Every model with bounds, from coarse to fine."""
    eps = {t.material: t.value for t in planner.permittivities(design)}
    area = design.params.length_mm * design.params.width_mm * M_PER_MM**2
    for model, module in planner.capacitance_models().items():
        if module.unfit(design.in_use):
            continue
        for wanted, interval, seconds in _rungs(module.capacitance, (design.in_use, eps), module, budget_s):
            yield _point(name, model, wanted, interval.times(1 / area), True, seconds)


def _rungs(
    work: Callable[..., Interval], given: tuple[Any, ...], module: Any, budget_s: float
) -> Iterator[tuple[float | None, Interval, float]]:
    """Width that was asked for, bounds and seconds; each time for a decade less than was reached."""
    if not hasattr(module, "WIDTH"):
        yield (None, *timed(lambda: work(*given)))
        return
    wanted, last = 0.1, math.inf
    while wanted >= _LEAST_WIDTH * (1 - 1e-6):
        asked = wanted
        interval, seconds = timed(lambda asked=asked: work(*given, asked))  # type: ignore[misc]
        width = interval.width()
        if width >= last:
            return
        yield asked, interval, seconds
        if width > asked or seconds * _DEARER > budget_s or width == 0:
            return
        wanted, last = 10.0 ** math.ceil(math.log10(width) - 1), width


def _formulas(name: str, design: Design) -> Iterator[Point]:
    """The thesis's formulas for this shape."""
    eps = next(t.value for t in planner.permittivities(design) if t.material == "x60")
    for model, law in thesis_cells.NAMED.items():
        if design.shape in law.shapes:
            value, seconds = timed(lambda law=law: law.value_f_per_m2(design.params, eps))  # type: ignore[misc]
            yield _point(name, model, None, Interval(value, value), False, seconds)


def _point(scene: str, model: str, wanted: float | None, found: Interval, bounded: bool, seconds: float) -> Point:
    standard = STANDARD[scene]
    off = [abs(bound / standard.capacitance_f_per_m2 - 1) for bound in (found.lower, found.upper)]
    error = max(*off, standard.known_to)
    said = f"{found.lower:.9g} to {found.upper:.9g} F/m²" if bounded else f"{found.lower:.9g} F/m²"
    return Point(scene, model, error, seconds, said, bounded, wanted, found.lower, found.upper)
