"""Models of a cell's capacitance on scenes whose capacitance is known."""

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from typing import Any

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design import design as designs
from sensorgen.models import capacitance_models, thesis_cells
from sensorgen.verification import peers
from sensorgen.verification.chart import exact
from sensorgen.verification.chart.exact import KnownCapacitance
from sensorgen.verification.chart.measured import ChartPoint, Level, climb

ASKED = "the capacitance of a cell at rest"
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
    "coaxial line": exact.coaxial,
    "eccentric cylinders": exact.eccentric,
    "stripline": exact.stripline,
    "interdigital, half space": exact.interdigital,
}


def points(name: str, budget_s: float) -> list[ChartPoint]:
    """Measure every model that applies to a scene.

    Parameters
    ----------
    name : str
        Of ``STANDARD``.
    budget_s : float
        A model is not asked for more where that would take longer, estimated as ten times the last one [s].
    """
    standard = STANDARD[name]()
    area, measured = standard.scene.size_mm[0] * standard.scene.size_mm[1] * M_PER_MM**2, []
    for model, module in capacitance_models().items():
        if not module.why_not_applicable(standard.scene):
            for wanted, bounds, seconds in climb(_widths(module, standard), budget_s):
                measured.append(point(name, model, bounds.times(1 / area), standard, seconds, wanted=wanted))
    for model, levels, per in _unbounded(name, standard, area):
        for level, value, seconds in climb(levels, budget_s):
            one = Interval(value / per, value / per)
            measured.append(point(name, model, one, standard, seconds, bounded=False, level=level))
    return measured


def why_not_applicable(name: str) -> dict[str, str]:
    """Why models of capacitance do not apply to a scene."""
    scene = STANDARD[name]().scene
    reasons = {model: module.why_not_applicable(scene) for model, module in capacitance_models().items()}
    only = "it has formulas of tri and rect alone"
    return {model: why for model, why in reasons.items() if why} | {"thesis_cells": only}


def _unbounded(name: str, standard: KnownCapacitance, area_m2: float) -> Iterator[tuple[str, list[Level], float]]:
    """Formulas of the thesis, then programs of others; their levels, and the area that they give a value for [m2]."""
    for formula, law in thesis_cells.NAMED.items():
        if standard.shape in law.shapes:
            work = partial(law.value_f_per_m2, standard.params, standard.permittivity["x60"])
            yield f"thesis_cells: {formula.removeprefix('thesis-')}", [("", work)], 1.0
    for peer in () if name in _NO_PEERS else peers.FIELD:
        yield peer, peers.applicable(peer, standard.scene, standard.permittivity)[0], area_m2


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


def point(
    scene: str, model: str, bounds: Interval, standard: KnownCapacitance, seconds: float, *,
    wanted: float | None = None, bounded: bool = True, level: str = "",
) -> ChartPoint:  # fmt: skip
    """Answer of a model per area, compared with the reference."""
    off = [abs(bound / standard.capacitance_f_per_m2 - 1) for bound in (bounds.lower, bounds.upper)]
    error = max(*off, standard.known_to)
    words = f"{bounds.lower:.9g} to {bounds.upper:.9g} F/m²" if bounded else f"{bounds.lower:.9g} F/m²"
    return ChartPoint(scene, model, error, seconds, level + words, bounded, wanted, bounds.lower, bounds.upper)
