"""Models of a cell's capacitance on scenes whose capacitance is known."""

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
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
from sensorgen.verification.chart.measured import ChartPoint, timed

ASKED = "the capacitance of a cell at rest"
_LEAST_WIDTH = 1e-9  # that is asked of a model
_NO_PEERS = ("plate, 0.6 mm",)  # exact by all of them
_DEARER = 10.0  # by how much the next accuracy may cost more than the last


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
    for formula, law in thesis_cells.NAMED.items():
        if standard.shape in law.shapes:
            value, seconds = timed(partial(law.value_f_per_m2, standard.params, standard.permittivity["x60"]))
            label = f"thesis_cells: {formula.removeprefix('thesis-')}"
            measured.append(point(name, label, Interval(value, value), standard, seconds, bounded=False))
    for model, module in capacitance_models().items():
        if not module.why_not_applicable(standard.scene):
            given = (standard.scene, standard.permittivity)
            for wanted, interval, seconds in _rungs(module.capacitance, given, module, budget_s):
                measured.append(point(name, model, interval.times(1 / area), standard, seconds, wanted=wanted))
    for peer in () if name in _NO_PEERS else peers.FIELD:
        with suppress(ValueError):  # the scene is not for it
            for level, work in () if peers.missing(peer) else peers.levels(peer, standard.scene, standard.permittivity):
                value, seconds = timed(work)
                one = point(name, peer, Interval(value / area, value / area), standard, seconds, bounded=False)
                measured.append(replace(one, result=f"{level}{one.result}"))
                if seconds * _DEARER > budget_s:
                    break
    return measured


def why_not_applicable(name: str) -> dict[str, str]:
    """Why models of capacitance do not apply to a scene."""
    scene = STANDARD[name]().scene
    reasons = {model: module.why_not_applicable(scene) for model, module in capacitance_models().items()}
    only = "it has formulas of tri and rect alone"
    return {model: why for model, why in reasons.items() if why} | {"thesis_cells": only}


def _rungs(
    work: Callable[..., Interval], given: tuple[Any, ...], module: Any, budget_s: float
) -> Iterator[tuple[float | None, Interval, float]]:
    """Width that was asked for, bounds and seconds; each time for a decade less than was reached."""
    if math.inf == module.WIDTH:
        yield (None, *timed(lambda: work(*given)))
        return
    wanted, last = 0.1, math.inf
    while wanted >= _LEAST_WIDTH * (1 - 1e-6):
        asked = wanted
        try:
            interval, seconds = timed(lambda asked=asked: work(*given, asked))  # type: ignore[misc]
        except SensorgenError:  # doubles end here, or this order fails
            if last < math.inf:
                return
            wanted /= 10
            continue
        width = interval.width()
        if width >= last:
            return
        yield asked, interval, seconds
        if width > asked or seconds * _DEARER > budget_s or width == 0:
            return
        wanted, last = 10.0 ** math.ceil(math.log10(width) - 1), width


def point(
    scene: str, model: str, bounds: Interval, standard: KnownCapacitance, seconds: float, *,
    wanted: float | None = None, bounded: bool = True,
) -> ChartPoint:  # fmt: skip
    """Answer of a model per area, compared with the reference."""
    off = [abs(bound / standard.capacitance_f_per_m2 - 1) for bound in (bounds.lower, bounds.upper)]
    error = max(*off, standard.known_to)
    words = f"{bounds.lower:.9g} to {bounds.upper:.9g} F/m²" if bounded else f"{bounds.lower:.9g} F/m²"
    return ChartPoint(scene, model, error, seconds, words, bounded, wanted, bounds.lower, bounds.upper)
