"""Time of a run: real, or simulated, which passes as fast as the computer follows."""

import time
from dataclasses import dataclass
from typing import Protocol


class Clock(Protocol):
    """Clock of a run and its devices."""

    def now(self) -> float:
        """Time since any moment; never goes back [s]."""

    def epoch(self) -> float:
        """Time since 1970, as files have it [s]."""

    def wait_until(self, time_s: float) -> None:
        """Return at a time of :meth:`now`, at once if it is past [s]."""


class RealClock:
    """The computer's."""

    def now(self) -> float:
        """Time since the computer's start [s]."""
        return time.monotonic()

    def epoch(self) -> float:
        """Time since 1970 [s]."""
        return time.time()

    def wait_until(self, time_s: float) -> None:
        """Sleep until a time."""
        left = time_s - self.now()
        if left > 0:
            time.sleep(left)


@dataclass
class SimulatedClock:
    """Time that passes only where somebody waits.

    Attributes
    ----------
    time_s : float
        Since the begin [s].
    epoch_s : float
        Time since 1970 at the begin [s].
    """

    time_s: float = 0.0
    epoch_s: float = 1.7e9

    def now(self) -> float:
        """Time since the begin [s]."""
        return self.time_s

    def epoch(self) -> float:
        """Time since 1970 [s]."""
        return self.epoch_s + self.time_s

    def wait_until(self, time_s: float) -> None:
        """Let the time pass."""
        self.time_s = max(self.time_s, time_s)
