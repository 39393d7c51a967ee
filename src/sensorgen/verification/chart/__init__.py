"""Speed against accuracy: every model on every standard scene, timed and compared with a reference.

Times are the processor's, imports left out, so that a busy machine shows nearly what an idle one does.
"""

from collections.abc import Callable, Iterator, Sequence
from types import ModuleType

from sensorgen import models
from sensorgen.core import plugins as registry
from sensorgen.verification.chart import blocks, cells, lines, membrane, networks, presses, readback, rounds
from sensorgen.verification.chart.measured import Point, Silent, with_front

KINDS = (cells, presses, blocks, membrane, rounds, lines, readback, networks)
SCENES = tuple(name for kind in KINDS for name in kind.STANDARD)


def points(scenes: Sequence[str], budget_s: float, started: Callable[[str], None]) -> list[Point]:
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
    found = []
    for name in scenes:
        started(name)
        found += with_front(kind_of(name).points(name, budget_s))
    return found


def silent(scenes: Sequence[str], found: Sequence[Point]) -> list[Silent]:
    """Models that gave nothing, scene by scene, and why.

    Parameters
    ----------
    scenes : sequence of str
        Of ``SCENES``.
    found : sequence of Point
        What the others gave there.
    """
    return [one for name in scenes for one in _silent(name, [p for p in found if p.scene == name])]


def kind_of(scene: str) -> ModuleType:
    """The module that measures a scene."""
    return next(kind for kind in KINDS if scene in kind.STANDARD)


def _silent(scene: str, found: Sequence[Point]) -> Iterator[Silent]:
    spoke, kind = {p.model.partition(":")[0] for p in found}, kind_of(scene)
    refused = kind.why_not_applicable(scene)
    for name in models.names():
        if name not in spoke:
            yield Silent(scene, name, refused.get(name) or f"{_about(name)} Not {kind.ASKED}.")


def _about(name: str) -> str:
    """Scenes that a model applies to."""
    return (registry.load(models, name).__doc__ or "").strip().partition("\n")[0]
