"""Live view of a run: what it measures now, and the commands of whoever watches."""

import queue
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Complex, Real

COMMANDS = ("pause", "resume", "abort")
_WAITING = 16  # commands that may wait; further ones are dropped


@dataclass(frozen=True, eq=False)
class Sample:
    """State of a run at one moment.

    Attributes
    ----------
    time_s : float
        Since the begin of the run [s].
    step, steps : int
        Number of the current step, from 1 on, and of all.
    message : str
        What the run does, in a few words.
    force_n, set_force_n : float
        Force on the specimen, and the force that is asked for [N].
    position_mm : float
        Place of the tip along the specimen [mm].
    impedance_ohm : (m,) array
        At each tone; nan where there is none [ohm].
    predicted_ohm : (m,) array, optional
        What the prediction expects at this force and place [ohm].
    """

    time_s: float
    step: int
    steps: int
    message: str
    force_n: float
    set_force_n: float
    position_mm: float
    impedance_ohm: Complex
    predicted_ohm: Complex | None = None


class LiveView:
    """The live page of a run; use it in a ``with`` statement.

    Parameters
    ----------
    title : str
        What runs: the specimen and the plan.
    tones_hz : (m,) array
        Tones of the impedance meter [Hz].

    Attributes
    ----------
    url : str
        Address of the page, with the secret token that every request needs.
    """

    def __init__(self, title: str, tones_hz: ArrayLike) -> None:
        self.title, self.url = title, ""
        self.tones_hz: Real = np.atleast_1d(np.asarray(tones_hz, float))
        self._commands: queue.Queue[str] = queue.Queue(_WAITING)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def update(self, sample: Sample) -> None:
        """Show a sample; takes microseconds, whether anybody watches or not."""

    def commands(self) -> list[str]:
        """Commands since the last call, in their order: "pause", "resume", "abort"."""
        given = []
        while not self._commands.empty():
            given.append(self._commands.get_nowait())
        return given

    def close(self) -> None:
        """End the page; never raises."""
