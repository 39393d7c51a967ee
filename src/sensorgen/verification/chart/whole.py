"""Whole predictions of a sensor, cell to line, against parts that are known from elsewhere."""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from sensorgen.core import cache
from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.prediction import bodies
from sensorgen.prediction.query import Query
from sensorgen.verification.apart import ModelAnswer
from sensorgen.verification.chart import cells, presses
from sensorgen.verification.chart.measured import ChartPoint, Ladder, SceneKind, climbed
from sensorgen.verification.design_chart import works
from sensorgen.verification.design_chart.questions import DIGITS, Reference, of_modulus
from sensorgen.verification.design_chart.results import composed

_FORCE_N = 5.0  # 50 kPa
_FILM = "0.1 mm"
STANDARD = {f"prediction of tri, {_FILM}": f"tri, {_FILM}"}


def points(name: str, budget_s: float) -> list[ChartPoint]:
    """Measure predictions from rough to accurate, nothing stored."""
    design = designs.make({"shape": "tri", "parameters": {"dielectric_mm": float(_FILM.removesuffix(" mm"))}})
    body, query = bodies.drawn(design), Query(force_n=_FORCE_N)
    cell, known = cells.STANDARD[STANDARD[name]](), presses.CELLS[_FILM]
    area_m2 = design.params.length_mm * design.params.width_mm * M_PER_MM**2
    rise = known.rise_pf_per_m[known.stress_kpa.index(50)] / known.rest_pf_per_m
    best = {
        "capacitance": [Reference("another program", "", (cell.capacitance_f_per_m2 * area_m2,), cell.known_to)],
        "compression": [Reference("two other programs", "", (rise,), known.known_to[1])],
    }
    (reference,) = composed(body, query, best)

    def judge(answer: ModelAnswer) -> tuple[float, str]:
        off = of_modulus(answer.value, reference.value)
        stated = f", {answer.stated:.2g} stated" if answer.stated is not None else ""
        return max(off, reference.doubt, DIGITS), f"off by {off:.2g}{stated}"

    def of(**more: object) -> Callable[[], ModelAnswer]:
        rough = bool(more.pop("rough", False))
        return partial(works.predicted, body, Query(force_n=_FORCE_N, **more), rough=rough)  # type: ignore[arg-type]

    ladders: Iterator[Ladder] = iter([
        ("predict: closed forms", [("", of(rough=True))]),
        ("predict: plate, free", [("", of(law="unconfined"))]),
        ("predict: default", [("", of())]),
        ("predict: accuracy", [(f"{a:g}, ", of(accuracy=a)) for a in (1e-1, 1e-2, 1e-3)]),
    ])  # fmt: skip
    with nothing_stored():
        return list(climbed(name, ladders, judge, budget_s))


@contextmanager
def nothing_stored() -> Iterator[None]:
    """Within it, no prediction is read from what was stored, and none is kept."""
    before = os.environ.get(cache.PLACE)
    with tempfile.TemporaryDirectory() as folder, cache.nothing_kept():
        os.environ[cache.PLACE] = folder
        try:
            yield
        finally:
            del os.environ[cache.PLACE]
            os.environ |= {} if before is None else {cache.PLACE: before}


def why_not_applicable(name: str) -> dict[str, str]:  # noqa: ARG001
    """Why single models do not apply to a scene: a prediction chooses among them."""
    return {}


KIND = SceneKind("abs(Z) of a sensor under a load", STANDARD, points, why_not_applicable)
