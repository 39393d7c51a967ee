"""Speed against accuracy on standard scenes: every model, timed in this process and compared with known values.

Times are the processor's, imports left out, so that a busy machine shows nearly what an idle one does.
"""

import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

from sensorgen import models
from sensorgen.core import cache
from sensorgen.core import lazy as registry
from sensorgen.verification.apart import Runner, here
from sensorgen.verification.chart import cells, elastic, lines, networks, presses, whole
from sensorgen.verification.chart.question import Question
from sensorgen.verification.chart.results import Chart, Silent, measured

SCENES: dict[str, Callable[[], Question]] = {
    name: partial(question, name) for scenes, question in (
        (cells.STANDARD, cells.question), (presses.STANDARD, presses.question), (elastic.BLOCKS, elastic.of_block),
        (elastic.MEMBRANE, elastic.of_membrane), (elastic.ROUND, elastic.of_round), (lines.STANDARD, lines.question),
        (lines.INVERSION, lines.inversion), (networks.STANDARD, networks.question), (whole.STANDARD, whole.question),
    ) for name in scenes
}  # fmt: skip


def chart(
    scenes: Sequence[str], budget_s: float, step: Callable[[str], None] = lambda _: None, runner: Runner = here
) -> Chart:  # fmt: skip
    """Measure every model on the scenes of ``SCENES`` that are named, as in :func:`measured`, nothing stored."""
    with _nothing_stored():
        answers = measured((SCENES[name]() for name in scenes), budget_s, step, runner)
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
