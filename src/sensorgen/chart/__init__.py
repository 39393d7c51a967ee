"""Speed against accuracy: every model on every standard scene, timed and held against the truth.

Times are the processor's, imports left out, so that a busy machine shows nearly what an idle one does.
"""

from collections.abc import Callable, Sequence

from sensorgen.chart import cells, lines, presses
from sensorgen.chart.measured import Point, with_front

_KINDS = (cells, presses, lines)
SCENES = tuple(name for kind in _KINDS for name in kind.STANDARD)


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
        kind = next(kind for kind in _KINDS if name in kind.STANDARD)
        found += with_front(kind.points(name, budget_s))
    return found
