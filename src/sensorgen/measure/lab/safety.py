"""Safety of a run: its impedances watched, and the rig made safe whatever has failed.

Means at rest and under a press, drift, short and open circuits, silence; actuator lifted, stage raised, motors off.
"""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import filterfalse
from math import inf, nan

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import SensorgenError
from sensorgen.measure.lab.devices import Actuator, Clock, DeviceFault, ImpedanceMeter, Readings, Stage
from sensorgen.measure.signal.presses import WINDOW_S


@dataclass
class Sweeps:
    """Rows with some frequencies missing are put together; whole rows, and those without any number, pass as they are.

    A row of several has the mean of their times; it waits until each of its frequencies was measured.
    """

    _row: Complex | None = None
    _times: list[float] = field(default_factory=list)
    _clipped: bool = False

    def whole(self, readings: Readings) -> Readings:
        """Rows that are whole now."""
        known = np.isfinite(readings.impedance_ohm)
        if (known.all(axis=1) | ~known.any(axis=1)).all():
            return readings
        rows = zip(readings.time_s.tolist(), readings.impedance_ohm, readings.clipped.tolist(), strict=True)
        whole = [row for each in rows for row in self._taken(*each)]
        return Readings.joined(whole, readings.impedance_ohm.shape[1], readings.lost)

    def _taken(self, time_s: float, row: Complex, clipped: bool) -> Iterator[Readings]:
        known = np.isfinite(row)
        if not known.all() and known.any():
            self._row = row if self._row is None else np.where(known, row, self._row)
            self._times.append(time_s)
            self._clipped |= clipped
            if not np.isfinite(self._row).all():
                return
            time_s, row, clipped = float(np.mean(self._times)), self._row, self._clipped
            self._row, self._times, self._clipped = None, [], False
        yield Readings(np.array([time_s]), row[None], np.array([clipped]))


SILENT_S = 5.0  # without a sound reading, a fault
_OPEN_F = 0.3e-12  # less than any specimen with its leads
_COURSE, _FEWEST_COURSE = 15, 5  # readings of which half have to say it
_FEW = 3  # readings, from which their noise can be told
_MOST = 1 << 14  # readings of a window, whatever the rate


@dataclass
class Watch:
    """Impedances of the last second, and what they say of specimen and instrument.

    Attributes
    ----------
    tones_hz : (m,) array
        Frequencies [Hz].
    latest_ohm : (m,) array
        The last sound reading; nan before [ohm].
    count, lost, clipped, invalid : int
        Readings so far, and of them lost, clipped and not finite.
    sound_s : float
        When a sound reading came last, by the run's clock [s].
    """

    tones_hz: Real
    latest_ohm: Complex = field(init=False)
    count: int = 0
    lost: int = 0
    clipped: int = 0
    invalid: int = 0
    sound_s: float = nan
    _recent: deque[tuple[float, Complex]] = field(default_factory=lambda: deque(maxlen=_MOST))
    _first_rest: Complex | None = None
    _course: deque[Complex] = field(default_factory=lambda: deque(maxlen=_COURSE))

    def __post_init__(self) -> None:
        self.latest_ohm = np.full(len(self.tones_hz), complex(nan, nan))

    def take(self, readings: Readings, now_s: float) -> None:
        """Take readings that came just now.

        Raises
        ------
        DeviceFault
            No sound reading for :data:`SILENT_S`.
        """
        sound = np.isfinite(readings.impedance_ohm).all(axis=1) & (readings.impedance_ohm != 0).all(axis=1)
        self.count += len(sound)
        self.lost += readings.lost
        self.clipped += int(np.count_nonzero(readings.clipped))
        self.invalid += int(np.count_nonzero(~sound))
        self._course.extend(readings.impedance_ohm[sound])
        for row in readings.impedance_ohm[sound & ~readings.clipped]:
            self.latest_ohm = row
            self._recent.append((now_s, row))
            self.sound_s = now_s
        while self._recent and self._recent[0][0] < now_s - WINDOW_S:
            self._recent.popleft()
        if now_s - self.sound_s > SILENT_S:
            what = "clipped" if readings.clipped.any() else "no"
            raise DeviceFault(f"impedance meter: {what} readings for {SILENT_S:g} s; check cables, range and specimen")

    def circuit(self) -> str:
        """Circuit fault of the specimen in half of the last readings: "short", "open", or "".

        At the lowest frequency an intact specimen is a capacitor: its reactance exceeds its resistance. At the highest,
        where the noise of a reading is least, an open circuit has a smaller capacitance than any specimen. Clipped
        readings count: a short drives more current than an input takes.
        """
        if len(self._course) < _FEWEST_COURSE:
            return ""
        admittance = 1 / np.array(self._course)
        middle: Complex = 1 / np.median(admittance.view(float), axis=0).view(complex)  # of real and imaginary part
        if not np.isfinite(middle).all():
            return ""
        low, high = complex(middle[np.argmin(self.tones_hz)]), int(np.argmax(self.tones_hz))
        if 1 / (2 * np.pi * self.tones_hz[high] * abs(middle[high])) < _OPEN_F:
            return "open"
        return "short" if low.real > -low.imag else ""

    def mean(self) -> Complex:
        """Mean over the last second; nan of nothing [ohm]."""
        if not self._recent:
            return np.full(len(self.tones_hz), complex(nan, nan))
        return np.asarray(np.mean([row for _, row in self._recent], axis=0))

    def noise(self) -> Real:
        """Standard error of real and imaginary part of the mean, relative to abs(Z), of each frequency; nan of few."""
        rows = np.array([row for _, row in self._recent])
        if len(rows) < _FEW:
            return np.full(len(self.tones_hz), nan)
        return np.asarray(rows.std(axis=0) / np.abs(rows.mean(axis=0)) / np.sqrt(2 * len(rows)))

    def drift(self) -> float:
        """Change of abs(Z) at rest since the first call, at the frequency where it is largest [-]."""
        now = np.abs(self.mean())
        if self._first_rest is None and np.isfinite(now).all():
            self._first_rest = now
        return 0.0 if self._first_rest is None else float(np.max(np.abs(now / self._first_rest - 1)))


UP_MM = 1.0  # of its upper end, within which the piston counts as up
RAISED_MM = 1.0  # above its working height, from which on the stage counts as raised, when it has come to rest
_FALLEN_MM, _HELD_S = 1.0, 1.0  # what a piston falls without a motor, if it falls, and in which time it shows
_LIFT_S, _DEAF_S, _POLL_S, _AGAIN_S = 15.0, 4.0, 0.05, 0.5  # for both; for the actuator when the stage is up


class Ended(Exception):
    """The end of a run before its plan's.

    Parameters
    ----------
    end : str
        "fault", "rule" or "abort".
    reason : str
        For people.
    """

    def __init__(self, end: str, reason: str) -> None:
        super().__init__(reason)
        self.end = end


@dataclass
class RunDevices:
    """Devices of a run.

    Attributes
    ----------
    actuator, stage, impedance
        The devices.
    started : set of str
        Roles of those that were sent more than the question what they are.
    working_mm : float
        Height of the stage at which the tip reaches the specimen; infinite until it was lowered [mm].
    """

    actuator: Actuator
    stage: Stage
    impedance: ImpedanceMeter
    started: set[str] = field(default_factory=set)
    working_mm: float = inf


@dataclass
class _Attempts:
    """Calls of devices of which each is made whatever happened to the one before; problems without repetition."""

    beat: Callable[[], None]
    problems: list[str] = field(default_factory=list)

    def __call__(self, what: str, call: Callable[[], object]) -> bool:
        """Test whether it worked."""
        with suppress(SensorgenError):  # a dead guardian must not keep the tip down
            self.beat()
        try:
            call()
        except Exception as error:  # also errors of a driver's own must not keep the tip down
            kind = "" if isinstance(error, SensorgenError) else f"{type(error).__name__}: "
            problem = f"{what}: {kind}{error}"
            if problem not in self.problems:
                self.problems.append(problem)
            return False
        return True


def made_safe(rig: RunDevices, clock: Clock, beat: Callable[[], None] = lambda: None) -> tuple[bool, tuple[str, ...]]:
    """Lift the actuator, raise the stage, and switch the motor off; devices that were never started are left alone.

    Parameters
    ----------
    rig : RunDevices
        The devices.
    clock : Clock
        The run's.
    beat : callable
        Sign of life, called between any two messages.

    Returns
    -------
    up : bool
        Whether actuator or stage said that the tip is up, or nothing had been started.
    problems : tuple of str
        What failed meanwhile.
    """
    attempt = _Attempts(beat)
    safe = _lift(rig, clock, attempt)
    if "actuator" in rig.started:
        attempt("motor off", rig.actuator.off)
        if safe.get("actuator") and not safe.get("stage"):
            _held(rig, clock, attempt)
    up = any(safe.values()) or not safe
    return up, tuple(attempt.problems)


def _lift(rig: RunDevices, clock: Clock, attempt: _Attempts) -> dict[str, bool]:
    """Lift by both, again where one does not follow; which of them say that the tip is up."""
    until, again = clock.now() + _LIFT_S, -inf
    up: dict[str, bool] = {role: False for role in ("actuator", "stage") if role in rig.started}

    def look_actuator() -> None:
        up["actuator"] = rig.actuator.read().position_mm <= UP_MM

    def look_stage() -> None:
        place = rig.stage.read()
        up["stage"] = not place.moving and (rig.working_mm == inf or place.height_mm >= rig.working_mm + RAISED_MM)

    lifts = {"actuator": rig.actuator.lift, "stage": rig.stage.lift}
    looks = {"actuator": look_actuator, "stage": look_stage}
    while not all(up.values()) and clock.now() < (until if not up.get("stage") else until - _LIFT_S + _DEAF_S):
        down = list(filterfalse(up.get, up))
        if clock.now() >= again:
            again = clock.now() + _AGAIN_S
            for role in down:
                attempt(f"lift of the {role}", lifts[role])
        clock.wait_until(clock.now() + _POLL_S)
        for role in down:
            attempt(role, looks[role])
    return up


def _held(rig: RunDevices, clock: Clock, attempt: _Attempts) -> None:
    """See that friction holds the piston up, where the stage does not keep it away; else its motor has to."""
    fallen = False

    def look() -> None:
        nonlocal fallen
        fallen = rig.actuator.read().position_mm > UP_MM + _FALLEN_MM

    until = clock.now() + _HELD_S
    while not fallen and clock.now() < until:
        clock.wait_until(clock.now() + _POLL_S)
        attempt("actuator", look)
    if fallen:
        attempt("lift of the actuator", rig.actuator.lift)
        attempt.problems.append(
            "the stage is not raised, and the piston falls when its motor is off: the motor holds it up; secure the "
            "piston before you switch it off"
        )


def close(rig: RunDevices) -> tuple[str, ...]:
    """Switch the impedance meter off, and give all connections back; what failed."""
    attempt = _Attempts(lambda: None)
    if "impedance" in rig.started:
        attempt("impedance meter off", rig.impedance.stop)
    for device in (rig.actuator, rig.stage, rig.impedance):
        device.close()
    return tuple(attempt.problems)
