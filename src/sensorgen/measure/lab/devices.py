"""Devices of the laboratory: what a run asks of each, and its time, real or simulated.

No method waits for longer than a message takes: what takes time, a move or a sweep, is begun by one call and followed
by ``read``, once in every period of the control loop. Before a device has said that it is the expected one, a driver
sends it nothing but that question. Any failure is a :class:`DeviceFault`.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import InstrumentFailed


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


PYMEASURE = "pymeasure:"  # begin of the kinds that are classes of PyMeasure
Role = Literal["actuator", "stage", "impedance", "meter", "array"]


class DeviceFault(InstrumentFailed):
    """A device that does not answer, answers nonsense, or reports an error."""


class WrongDevice(DeviceFault):
    """Something answers, but it is not the expected device; it was sent no command."""


@dataclass(frozen=True)
class Identity:
    """Identity by the device's own words.

    Attributes
    ----------
    model : str
        Maker and model.
    serial, firmware : str
        Its number and version; "" if it does not say.
    """

    model: str
    serial: str = ""
    firmware: str = ""

    def words(self) -> str:
        """All that is known, for people."""
        return " ".join(filter(None, (self.model, self.serial, self.firmware)))


@dataclass(frozen=True)
class Extension:
    """A reading of the actuator.

    Attributes
    ----------
    time_s : float
        By the run's clock [s].
    force_n : float
        Force of the tip on what is below it, by the motor's current and the weight of the piston [N].
    position_mm : float
        How far the piston is out, downwards from its upper end [mm].
    """

    time_s: float
    force_n: float
    position_mm: float


class AnyDevice(Protocol):
    """Device of any role."""

    def identify(self) -> Identity:
        """Ask what it is; :class:`WrongDevice` if it is another."""

    def close(self) -> None:
        """Give the connection back; never raises."""


class Actuator(AnyDevice, Protocol):
    """Presses the tip down, by force or to a position. Forces are those on the specimen, downwards positive."""

    def start(self, limit_n: float) -> None:
        """Set the device's own limit of force, switch the motor on, and begin to go to the upper end [N]."""

    def move(self, position_mm: float, speed_mm_s: float, force_n: float) -> None:
        """Begin to go to a position with at most a force: the soft landing [mm], [mm/s], [N]."""

    def push(self, force_n: float) -> None:
        """Press with a force, from now on [N]."""

    def read(self) -> Extension:
        """Force and position now."""

    def lift(self) -> None:
        """Begin to go to the upper end, whatever was before."""

    def off(self) -> None:
        """Switch the motor off."""


@runtime_checkable
class SelfLifting(Protocol):
    """An actuator whose controller lifts the tip by itself, as when both computer and guardian have stopped."""

    def watch(self, seconds: float) -> None:
        """Load that into the controller: from the next start on the tip goes up if nothing is read for a time [s]."""


@dataclass(frozen=True)
class Place:
    """A reading of the stage.

    Attributes
    ----------
    time_s : float
        By the run's clock [s].
    position_mm : float
        Of the tip's centre along the specimen [mm].
    height_mm : float
        By which the actuator is raised [mm].
    moving : bool
        Whether a move has not ended yet.
    """

    time_s: float
    position_mm: float
    height_mm: float
    moving: bool


class Stage(AnyDevice, Protocol):
    """Carries the actuator along the specimen, and raises it."""

    def start(self) -> None:
        """Begin to find its own zero; the actuator is raised first."""

    def move(self, position_mm: float, speed_mm_s: float) -> None:
        """Begin to go to a place; never while the tip is down, which is the run's duty [mm], [mm/s]."""

    def lower(self) -> None:
        """Begin to lower the actuator to its working height."""

    def lift(self) -> None:
        """Begin to raise the actuator, so far that its piston reaches nothing."""

    def read(self) -> Place:
        """Place now, and whether it moves."""

    def stop(self) -> None:
        """Stop at once, as far as the device can."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Impedances since the last call.

    Attributes
    ----------
    time_s : (n,) array
        Middle of each, by the instrument's clock, from any moment on [s].
    impedance_ohm : (n, m) array
        At m frequencies; nan where there is none [ohm].
    clipped : (n,) array
        Whether an input was beyond its range.
    lost : int
        How many are missing before the first.
    """

    time_s: Real
    impedance_ohm: Complex
    clipped: Mask
    lost: int = 0

    @classmethod
    def joined(cls, parts: "Sequence[Readings]", tones: int, lost: int = 0) -> "Readings":
        """Several as one, or none, at a number of frequencies; ``lost`` beside those of the parts."""
        nothing = cls(np.empty(0), np.empty((0, tones), complex), np.empty(0, bool))
        columns = ("time_s", "impedance_ohm", "clipped")
        times, z, clipped = (np.concatenate([getattr(part, name) for part in (nothing, *parts)]) for name in columns)
        return cls(times, z, clipped, lost + sum(part.lost for part in parts))

    @classmethod
    def of_tone(cls, time_s: float, k: int, tones: int, value_ohm: complex | None, *, clipped: bool) -> "Readings":
        """One row of a meter that measures one frequency after the other: frequency ``k``, nan at the others."""
        row = np.full((1, tones), complex(math.nan, math.nan))
        if value_ohm is not None:
            row[0, k] = value_ohm
        return cls(np.array([time_s]), row, np.array([clipped]))


class ImpedanceMeter(AnyDevice, Protocol):
    """Measures the impedance at several frequencies, again and again."""

    def start(self, tones_hz: Real, voltage_v: float) -> None:
        """Begin to measure at (m,) frequencies with an amplitude [Hz], [V]."""

    def read(self) -> Readings:
        """Readings since the last call; nothing is an answer."""

    def stop(self) -> None:
        """End the measurement and switch the output off."""


@dataclass(frozen=True, eq=False)
class FrameLot:
    """Frames of an array since the last call.

    Attributes
    ----------
    time_s : (k,) array
        By the device, rising [s].
    siemens : (k, m, n) array
        Readings; of capacitances alone the real part is nan [S].
    lost, damaged : int
        Frames that are missing, and lines that were no message.
    saturated : int
        Readings beyond the device's range.
    """

    time_s: Real
    siemens: Complex
    lost: int = 0
    damaged: int = 0
    saturated: int = 0


class FrameMeter(AnyDevice, Protocol):
    """Reads all crossings of an array, again and again.

    Attributes
    ----------
    shape : (int, int)
        Rows and columns, once identified.
    frequency_hz : float
        Of the readings, once identified [Hz].
    """

    shape: tuple[int, int]
    frequency_hz: float

    def read(self) -> FrameLot:
        """Frames since the last call; none is an answer."""


class Meter(AnyDevice, Protocol):
    """Measures a resistance.

    Attributes
    ----------
    name : str
        Model and full identity, once identified.
    """

    name: str

    def resistance(self, *, wires: int) -> str:
        """One reading as the meter sends it, with 2 leads or 4 [ohm]."""
