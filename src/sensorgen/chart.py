"""Speed against accuracy: every model of a cell's capacitance on every standard scene, timed and held against truth.

Times are the processor's, imports left out, so that a busy machine shows nearly what an idle one does.
"""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sensorgen import design as designs
from sensorgen import planner
from sensorgen.design import Design
from sensorgen.interval import Interval
from sensorgen.models import thesis_cells
from sensorgen.units import EPS0_F_PER_M, M_PER_MM

_LEAST_WIDTH = 1e-9  # that is asked of a model
_QUICK_S = 0.3  # runs shorter than this are repeated, and the median counts
_REPEATS = 5
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


@dataclass(frozen=True)
class Point:
    """What one model gave on one scene.

    Attributes
    ----------
    scene, model : str
        Names.
    wanted : float or None
        Width of the bounds that was asked for [-]; None where the model cannot be asked.
    lower_f_per_m2, upper_f_per_m2 : float
        Its bounds; equal for a formula that gives none [F/m2].
    bounded : bool
        Whether the truth must lie between them.
    error : float
        Relative distance from what is known, of the bound that is further off; no less than the reference's own [-].
    seconds : float
        Time of the processor [s].
    front : bool
        Whether nothing is quicker and at least as near.
    """

    scene: str
    model: str
    wanted: float | None
    lower_f_per_m2: float
    upper_f_per_m2: float
    bounded: bool
    error: float
    seconds: float
    front: bool = False


def points(scenes: Sequence[str], budget_s: float, started: Callable[[str], None]) -> list[Point]:
    """Measure every model on the scenes that are named.

    Parameters
    ----------
    scenes : sequence of str
        Of ``STANDARD``.
    budget_s : float
        A model is not asked for more where that would take longer, ten times the last one taken as a guess [s].
    started : callable
        Called with each scene's name before it is measured.
    """
    planner.load_solver()
    found = []
    for name in scenes:
        started(name)
        design = designs.make(STANDARD[name].data)
        here = [*_formulas(name, design), *_bounds(name, design, budget_s)]
        found += _with_front(here)
    return found


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
        yield (None, *_timed(lambda: work(*given)))
        return
    wanted, last = 0.1, math.inf
    while wanted >= _LEAST_WIDTH * (1 - 1e-6):
        asked = wanted
        interval, seconds = _timed(lambda asked=asked: work(*given, asked))  # type: ignore[misc]
        width = interval.width()
        if width >= last:
            return
        yield asked, interval, seconds
        if width > asked or seconds * _DEARER > budget_s or width == 0:
            return
        wanted, last = 10.0 ** math.ceil(math.log10(width) - 1), width


def _timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """What some work gives, and the processor's time for it: the median of several runs of quick work [s]."""
    taken: list[float] = []
    while len(taken) < _REPEATS and sum(taken) < _QUICK_S:
        start = time.process_time()
        found = work()
        taken.append(time.process_time() - start)
    return found, sorted(taken)[len(taken) // 2]


def _formulas(name: str, design: Design) -> Iterator[Point]:
    """The thesis's formulas for this shape."""
    eps = next(t.value for t in planner.permittivities(design) if t.material == "x60")
    for model, (shape, formula) in thesis_cells.NAMED.items():
        if shape == design.shape:
            value, seconds = _timed(lambda formula=formula: formula(design.params, eps))  # type: ignore[misc]
            yield _point(name, model, None, Interval(value, value), False, seconds)


def _point(scene: str, model: str, wanted: float | None, found: Interval, bounded: bool, seconds: float) -> Point:
    standard = STANDARD[scene]
    off = [abs(bound / standard.capacitance_f_per_m2 - 1) for bound in (found.lower, found.upper)]
    error = max(*off, standard.known_to)
    return Point(scene, model, wanted, found.lower, found.upper, bounded, error, seconds)


def _with_front(found: Sequence[Point]) -> list[Point]:
    """Points by time, those marked than which none is quicker and at least as near."""
    ordered, best = [], math.inf
    for point in sorted(found, key=lambda p: (p.seconds, p.error)):
        ordered.append(replace(point, front=point.error < best))
        best = min(best, point.error)
    return ordered
