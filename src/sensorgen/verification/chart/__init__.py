"""Speed against accuracy: every model on every standard scene, timed and compared with a reference.

Times are the processor's, imports left out, so that a busy machine shows nearly what an idle one does.
"""

from collections.abc import Callable, Sequence

from sensorgen import models
from sensorgen.core import lazy as registry
from sensorgen.verification.chart import cells, elastic, lines, networks, presses, whole
from sensorgen.verification.chart.measured import ChartPoint, SceneKind, SilentModel, with_front

KINDS = (
    cells.KIND, presses.KIND, elastic.BLOCK, elastic.MEMBRANE, elastic.ROUND, lines.LINE, lines.INVERSION,
    networks.KIND, whole.KIND,
)  # fmt: skip
SCENES = tuple(name for kind in KINDS for name in kind.scenes)


def points(scenes: Sequence[str], budget_s: float, started: Callable[[str], None]) -> list[ChartPoint]:
    """Measure every model on the scenes that are named.

    Parameters
    ----------
    scenes : sequence of str
        Of ``SCENES``.
    budget_s : float
        A model is not asked for more where that would take longer [s].
    started : callable
        Called with each scene's name before it is measured.
    """
    measured = []
    for name in scenes:
        started(name)
        measured += with_front(kind_of(name).points(name, budget_s))
    return measured


def silent(scenes: Sequence[str], answers: Sequence[ChartPoint]) -> list[SilentModel]:
    """Models that gave nothing, scene by scene, and why.

    Parameters
    ----------
    scenes : sequence of str
        Of ``SCENES``.
    found : sequence of ChartPoint
        What the others gave there.
    """
    spoke = {(p.scene, p.model.partition(":")[0]) for p in answers}
    refused = {scene: kind_of(scene).why_not_applicable(scene) for scene in scenes}
    return [
        SilentModel(scene, name, refused[scene].get(name) or _unasked(name, kind_of(scene).asked))
        for scene in scenes for name in models.names() if (scene, name) not in spoke
    ]  # fmt: skip


def _unasked(name: str, asked: str) -> str:
    """Scenes that a model applies to, and the question that is none of its own."""
    return f"{(registry.load(models, name).__doc__ or '').strip().partition(chr(10))[0]} Not {asked}."


def kind_of(scene: str) -> SceneKind:
    """Kind of a scene, which measures it."""
    return next(kind for kind in KINDS if scene in kind.scenes)
