"""Speed against accuracy on standard scenes: every model, timed in this process and compared with known values.

Times are the processor's, imports left out, so that a busy machine shows nearly what an idle one does.
"""

import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

from sensorgen import models
from sensorgen.core import cache
from sensorgen.core import lazy as registry
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import make
from sensorgen.prediction.bodies import drawn
from sensorgen.prediction.query import Query
from sensorgen.verification.apart import Runner, here
from sensorgen.verification.chart import cells, design, elastic, lines, networks, presses
from sensorgen.verification.chart.results import Chart, Question, Reference, Silent, measured


def _prediction(name: str) -> Question:
    """Impedance of a sensor under 50 kPa, by whole predictions, against parts that are known from elsewhere [ohm]."""
    sensor = make({"shape": "tri", "parameters": {"dielectric_mm": 0.1}})
    body, query = drawn(sensor), Query(force_n=5.0)
    cell, known = cells.STANDARD["tri, 0.1 mm"](), presses.CELLS["0.1 mm"]
    area_m2 = sensor.params.length_mm * sensor.params.width_mm * M_PER_MM**2
    rise = known.rise_pf_per_m[known.stress_kpa.index(50)] / known.rest_pf_per_m
    best = {
        "capacitance": [Reference("another program", "", (cell.capacitance_f_per_m2 * area_m2,), cell.known_to)],
        "compression": [Reference("two other programs", "", (rise,), known.known_to[1])],
    }
    asked, references = "abs(Z) of a sensor under a load", tuple(design.composed(body, query, best))
    return replace(design.prediction(body, query), key=name, title=name, asked=asked, references=references)


SCENES: dict[str, Callable[[str], Question]] = {
    **dict.fromkeys(cells.STANDARD, cells.question),
    **dict.fromkeys(presses.STANDARD, presses.question),
    **dict.fromkeys(elastic.BLOCKS, elastic.of_block),
    **dict.fromkeys(elastic.MEMBRANE, elastic.of_membrane),
    **dict.fromkeys(elastic.ROUND, elastic.of_round),
    **dict.fromkeys(lines.STANDARD, lines.question),
    **dict.fromkeys(lines.INVERSION, lines.inversion),
    **networks.STANDARD,
    "prediction of tri, 0.1 mm": _prediction,
}


def chart(
    scenes: Sequence[str], budget_s: float, step: Callable[[str], None] = lambda _: None, runner: Runner = here
) -> Chart:  # fmt: skip
    """Measure every model on the scenes of ``SCENES`` that are named, as in :func:`measured`, nothing stored."""
    with _nothing_stored():
        answers = measured((SCENES[name](name) for name in scenes), budget_s, step, runner)
    told = {(p.question, p.model.partition(":")[0]) for p in answers.points}
    told |= {(s.question, s.model.partition(":")[0]) for s in answers.silent}
    unasked = (Silent(scene, name, _unasked(name, asked)) for scene, asked in answers.asked.items()
               for name in models.names() if (scene, name) not in told)  # fmt: skip
    return replace(answers, unasked=tuple(unasked))


def _unasked(name: str, asked: str) -> str:
    """Scenes that a model applies to, and the question that is none of its own."""
    return f"{(registry.load(models, name).__doc__ or '').strip().partition(chr(10))[0]} Not {asked}."


@contextmanager
def _nothing_stored() -> Iterator[None]:
    """Within it, no prediction is read from what was stored."""
    before = os.environ.get(cache.PLACE)
    with tempfile.TemporaryDirectory() as folder:
        os.environ[cache.PLACE] = folder
        try:
            yield
        finally:
            del os.environ[cache.PLACE]
            os.environ |= {} if before is None else {cache.PLACE: before}
