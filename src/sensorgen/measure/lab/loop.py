"""One period of the control loop, 100 times a second: read, check, set, record, obey."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, isfinite, nan
from typing import Protocol

import numpy as np

from sensorgen.core.arrays import Complex
from sensorgen.measure.lab.devices import Clock, DeviceFault, Extension, Place
from sensorgen.measure.lab.experiment import Experiment
from sensorgen.measure.lab.live import Controls, Sample
from sensorgen.measure.lab.recorder import Recorder
from sensorgen.measure.lab.safety import UP_MM, Ended, RunDevices
from sensorgen.measure.lab.watch import Sweeps, Watch

PERIOD_S = 0.01
_STAGE, _RIG_ROW, _VIEW = 10, 4, 5  # periods from one reading, row or picture to the next
_SUNK_MM = 3.0  # deeper than the landing: something gave way
_BESIDE_MM = 0.2  # of the place, tip down
_FOLLOW_N, _FOLLOW_SHARE, _FOLLOW_S = 1.5, 0.3, 1.0  # measured force against the set one
_FREE_MM = 0.3  # above the landing
_DEEP_MM = 0.5  # beyond the deepest position


class RunView(Protocol):
    """Display of a run, as :class:`sensorgen.measure.lab.live.LiveView`."""

    def update(self, sample: Sample) -> None:
        """Show a sample."""

    def commands(self) -> list[str]:
        """Commands since the last call."""


class Alive(Protocol):
    """Guard that lifts the tip without a sign of life, as :class:`sensorgen.measure.lab.guardian.Guardian`."""

    def arm(self) -> None:
        """From now on."""

    def disarm(self) -> None:
        """No longer: the tip is up."""

    def beat(self) -> None:
        """Tell; raise :class:`DeviceFault` where it has died."""


class Paused(Exception):
    """Somebody asked for a pause; the step begins anew after it."""


Predicted = Callable[[float, float, Complex], Complex]
"""Expected impedances by force, place and what was read at rest [N], [mm], (m,) [ohm] -> (m,) [ohm]."""


@dataclass
class Loop:
    """The control loop and what it knows.

    Attributes
    ----------
    rig, clock, recorder, experiment, controls, watch
        What it works with.
    view, guardian, predicted
        Optional: what shows the run, what lifts the tip when the run dies, and what the specimen should read.
    extension, place
        The last readings of actuator and stage.
    set_n : float
        Set force; nan while the piston is moved by position [N].
    down_mm : float
        Extension at which the tip landed; nan while it is up [mm].
    up_s : float
        When it was last lifted [s].
    contact_mm : float
        Extension of the last landing; nan before the first [mm].
    wanted_mm : float
        Place that the stage was sent to [mm].
    rest_ohm : (m,) array
        Mean at rest before the press [ohm].
    step, steps, message
        For the view.
    paused, pausable : bool
        Whether a pause was asked for, and whether now is the time for it.
    travels : bool
        Whether the stage was sent somewhere, and has not come to rest.
    homed : bool
        Whether the actuator has found its upper end: before, its positions mean nothing.
    late : int
        Periods that began more than one period late.
    presses : int
        Presses that were done.
    """

    rig: RunDevices
    clock: Clock
    recorder: Recorder
    experiment: Experiment
    controls: Controls
    watch: Watch
    view: RunView | None = None
    guardian: Alive | None = None
    predicted: Predicted | None = None
    extension: Extension = field(default=Extension(nan, nan, nan))
    place: Place = field(default=Place(nan, nan, nan, moving=False))
    set_n: float = nan
    down_mm: float = nan
    up_s: float = -inf
    contact_mm: float = nan
    wanted_mm: float = nan
    rest_ohm: Complex = field(default_factory=lambda: np.full(1, complex(nan, nan)))
    step: int = 0
    steps: int = 0
    message: str = ""
    paused: bool = False
    pausable: bool = False
    travels: bool = False
    homed: bool = False
    late: int = 0
    presses: int = 0
    count: int = 0
    sweeps: Sweeps = field(default_factory=Sweeps)
    _follows_s: float = nan
    begun_s: float = field(init=False)
    _last_s: float = field(init=False)
    _operator_s: float = field(init=False)

    def __post_init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Time counts from now on."""
        self.begun_s = self._last_s = self._operator_s = self.clock.now()

    @property
    def down(self) -> bool:
        """True if the tip has landed."""
        return isfinite(self.down_mm)

    def beat(self) -> None:
        """Tell the guardian, if there is one, that the run lives."""
        if self.guardian:
            self.guardian.beat()

    def period(self) -> None:
        """Wait for the next period and do what belongs to it.

        Raises
        ------
        DeviceFault
            A device that fails, or readings that leave the limits.
        Ended
            A rule, or somebody, ends the run.
        Paused
            Somebody asked for a pause.
        """
        self._wait()
        self.beat()
        if "actuator" in self.rig.started:
            self.extension = self.rig.actuator.read()
            if wrong := self._wrong():  # is lifted at once, in the same period
                self.rig.actuator.lift()
                raise DeviceFault(f"{wrong}: lifted")
            if isfinite(self.set_n):
                self.rig.actuator.push(self.set_n)
        if "stage" in self.rig.started and self.count % _STAGE == 0:
            self.read_stage()
        if "impedance" in self.rig.started:
            readings = self.sweeps.whole(self.rig.impedance.read())
            self.recorder.readings(readings)
            self.watch.take(readings, self.clock.now())
        if self.count % _RIG_ROW == 0:
            self._record()
        if self.count % _VIEW == 0:
            self._show()
            self._obey()
            self._rules()
        self.count += 1

    def wait(self, seconds: float) -> None:
        """Go on for a while [s]."""
        until = self.clock.now() + seconds
        while self.clock.now() < until:
            self.period()

    def read_stage(self) -> Place:
        """Read the stage, and check that it rests while the tip is down."""
        self.place = self.rig.stage.read()
        if not (isfinite(self.place.position_mm) and isfinite(self.place.height_mm)):
            raise DeviceFault("stage: a place that is no number; check its connection")
        beside = abs(self.place.position_mm - self.wanted_mm) > _BESIDE_MM
        if self.extension.position_mm > UP_MM and self.down and (self.place.moving or beside):
            state = "moving" if self.place.moving else "at rest"
            raise DeviceFault(
                f"stage: {state} at {self.place.position_mm:.2f} mm with the tip down at {self.wanted_mm:.2f} mm"
            )
        return self.place

    def _wait(self) -> None:
        due = self._last_s + PERIOD_S
        self.clock.wait_until(due)
        now = self.clock.now()
        if now - self._last_s > self.experiment.limits.dead_man_s:
            raise DeviceFault(f"run: stood still for {now - self._last_s:.2f} s, longer than limits.dead_man_s")
        self.late += now - due > PERIOD_S
        self._last_s = due if now - due < PERIOD_S else now

    def _wrong(self) -> str:
        """Fault of the actuator's reading, or ""."""
        at, limits, now = self.extension, self.experiment.limits, self.clock.now()
        if not isfinite(at.force_n + at.position_mm):
            return "actuator: a force or position that is no number"
        if at.force_n > limits.force_n:
            return f"force {at.force_n:.2f} N is above the limit of {limits.force_n:g} N"
        if self.travels and at.position_mm > 2 * UP_MM:
            return f"actuator: the tip has fallen to {at.position_mm:.2f} mm while the stage moved"
        deepest = min(limits.deepest_mm + _DEEP_MM, self.down_mm + _SUNK_MM if self.down else inf)
        if self.homed and at.position_mm > deepest:
            return f"actuator: at {at.position_mm:.2f} mm, deeper than {deepest:.2f} mm"
        if not abs(at.force_n - self.set_n) >= _FOLLOW_N + _FOLLOW_SHARE * self.set_n:  # or none is set: nan
            self._follows_s = now
        if now - self._follows_s > _FOLLOW_S:
            return f"actuator: {at.force_n:.2f} N instead of {self.set_n:.2f} N for {_FOLLOW_S:g} s"
        return ""

    def _record(self) -> None:
        """A row of the rig; free of the specimen there is no force on it, whatever friction makes the motor do."""
        free = not self.down or self.extension.position_mm < self.down_mm - _FREE_MM
        force = nan if free else self.extension.force_n
        self.recorder.state(0.0 if free or not isfinite(self.set_n) else self.set_n, self._known_place(), force)

    def _known_place(self) -> float:
        return self.wanted_mm if isfinite(self.wanted_mm) else 0.0

    def _show(self) -> None:
        if self.view is None:
            return
        force, set_n = (self.extension.force_n, self.set_n) if isfinite(self.set_n) else (0.0, 0.0)
        predicted = None
        if self.predicted and isfinite(self.set_n) and force > 0:
            predicted = self.predicted(force, self._known_place(), self.rest_ohm)
        self.view.update(
            Sample(
                self.clock.now() - self.begun_s, self.step, self.steps, self.message, force,
                set_n, self.place.position_mm, self.watch.latest_ohm, predicted,
            )
        )  # fmt: skip

    def _obey(self) -> None:
        for command in self.controls.commands():
            self._operator_s = self.clock.now()
            if command == "abort":
                raise Ended("abort", f"ended by {self.controls.signal or 'the operator'}")
            if command in ("pause", "resume"):
                self.paused = command == "pause"
        operator = self.experiment.limits.operator_min
        if operator and self.clock.now() - self._operator_s > operator * 60:
            raise Ended("abort", f"no sign of the operator for {operator:g} min (limits.operator_min)")
        if self.paused and self.pausable:
            raise Paused

    def _rules(self) -> None:
        stop, now = self.experiment.stop, self.clock.now()
        if stop.minutes and now - self.begun_s > stop.minutes * 60:
            raise Ended("rule", f"stop.minutes: {stop.minutes:g} min have passed")
        circuit = self.watch.circuit()
        if circuit == "open":
            raise DeviceFault("specimen: open circuit; check the cables to it")
        if circuit and stop.short:
            raise Ended("rule", "stop.short: at the lowest frequency the specimen conducts")
