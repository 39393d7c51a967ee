"""Motions of the rig: lift, travel, rest, land and press, and the checks before the first press.

By periods of the control loop, 100 times a second: read, check, set, record, obey.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, isfinite, nan
from typing import Protocol

import numpy as np

from sensorgen.core.arrays import Complex
from sensorgen.core.errors import within
from sensorgen.measure.lab.devices import Clock, DeviceFault, Extension, Identity, Place
from sensorgen.measure.lab.experiment import AVERAGED_S, DonePress, Experiment, PlannedPress
from sensorgen.measure.lab.guardian import Guardian
from sensorgen.measure.lab.live import Controls, Sample
from sensorgen.measure.lab.recorder import Recorder
from sensorgen.measure.lab.safety import RAISED_MM, UP_MM, Ended, RunDevices, Sweeps, Watch

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
    guardian: Guardian | None = None
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
        self.recorder.state(0.0 if free or not isfinite(self.set_n) else self.set_n, self.known_place_mm, force)

    @property
    def known_place_mm(self) -> float:
        """Place that the stage was sent to; 0 before [mm]."""
        return self.wanted_mm if isfinite(self.wanted_mm) else 0.0

    def _show(self) -> None:
        if self.view is None:
            return
        force, set_n = (self.extension.force_n, self.set_n) if isfinite(self.set_n) else (0.0, 0.0)
        predicted = None
        if self.predicted and isfinite(self.set_n) and force > 0:
            predicted = self.predicted(force, self.known_place_mm, self.rest_ohm)
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


_STUCK_S, _TRAVEL_S, _LAND_S = 0.5, 120.0, 60.0  # a piston that rises not at all; longest move and landing
_ABOVE_MM, _EARLY_MM = 1.5, 3.0  # where the soft landing begins, and how far from the last one it may end
_REST_S, _STILL_MM = 0.15, 0.02  # the tip has landed once it moves less than this in that time
_THERE_MM = 0.05  # of the place
_LOOK_S = 0.05  # from one reading of the moving stage to the next


def lift(loop: Loop) -> None:
    """Lift the tip, and return when it is up.

    Raises
    ------
    DeviceFault
        The piston does not come up.
    """
    loop.set_n = nan
    loop.rig.actuator.lift()
    loop.period()
    before, since = loop.extension.position_mm, loop.clock.now()
    while not loop.extension.position_mm <= UP_MM:
        loop.period()
        at, now = loop.extension.position_mm, loop.clock.now()
        if at < before - UP_MM:
            before, since = at, now
        if now - since > _STUCK_S:
            raise DeviceFault(f"actuator: at {at:.2f} mm it does not come up, {_STUCK_S:g} s after the command")
    loop.down_mm, loop.up_s = nan, loop.clock.now()


def travel(loop: Loop, place_mm: float) -> None:
    """Move the stage along the specimen: tip up by the actuator's own reading, and the stage raised.

    Raised, so that the piston reaches nothing even if it falls meanwhile.

    Raises
    ------
    DeviceFault
        The tip is down, or the stage not raised; the stage does not arrive.
    """
    settle(loop, "at rest")
    lowered = loop.place.height_mm < loop.rig.working_mm + RAISED_MM if isfinite(loop.rig.working_mm) else False
    if lowered and abs(loop.place.position_mm - place_mm) < _THERE_MM:
        loop.wanted_mm = place_mm
        return
    low, high = loop.experiment.limits.travel_mm
    if not low <= place_mm <= high:
        raise DeviceFault(f"stage: {place_mm:g} mm is beyond limits.travel_mm, {low:g} to {high:g} mm")
    loop.rig.stage.lift()
    settle(loop, "raised")
    loop.extension = loop.rig.actuator.read()
    if not loop.extension.position_mm <= UP_MM:
        raise DeviceFault(f"actuator: at {loop.extension.position_mm:.2f} mm, not up: no move along the specimen")
    if isfinite(loop.rig.working_mm) and loop.place.height_mm < loop.rig.working_mm + RAISED_MM:
        raise DeviceFault(
            f"stage: at a height of {loop.place.height_mm:.2f} mm, not raised: no move along the specimen"
        )
    loop.wanted_mm = place_mm
    loop.rig.stage.move(place_mm, loop.experiment.approach.travel_mm_s)
    settle(loop, f"at {place_mm:g} mm")
    if abs(loop.place.position_mm - place_mm) > _THERE_MM:
        raise DeviceFault(f"stage: at {loop.place.position_mm:.3f} mm instead of {place_mm:.3f} mm")
    loop.rig.stage.lower()
    settle(loop, "lowered")
    loop.rig.working_mm = loop.place.height_mm


def settle(loop: Loop, where: str) -> None:
    """Wait until the stage rests; a tip that falls meanwhile is a fault."""
    until = loop.clock.now() + _TRAVEL_S
    loop.travels = True
    loop.wait(_LOOK_S)
    while loop.read_stage().moving:
        loop.wait(_LOOK_S)
        if loop.clock.now() > until:
            raise DeviceFault(f"stage: not {where} after {_TRAVEL_S:g} s")
    loop.travels = False


def land(loop: Loop) -> None:
    """Bring the tip down gently, and return when it rests on the specimen.

    Raises
    ------
    DeviceFault
        It finds nothing down to the deepest position, or something far above where it landed last.
    """
    approach, deepest, begun = loop.experiment.approach, loop.experiment.limits.deepest_mm, loop.clock.now()
    loop.read_stage()
    if loop.place.moving or loop.place.height_mm > loop.rig.working_mm + RAISED_MM:
        raise DeviceFault("stage: moving or raised; expected it at rest and lowered before a landing")
    if isfinite(loop.contact_mm):
        above = max(loop.contact_mm - _ABOVE_MM, 0.0)
        loop.rig.actuator.move(above, approach.speed_mm_s, approach.contact_n)
        while loop.extension.position_mm < above - _STILL_MM and not _rests(loop, begun):
            loop.period()
    loop.rig.actuator.move(deepest, approach.landing_mm_s, approach.contact_n)
    begun = loop.clock.now()
    while not _rests(loop, begun):
        loop.period()
    at = loop.extension.position_mm
    if at <= UP_MM:
        raise DeviceFault(f"actuator: still at {at:.2f} mm after the command to land; check motor and power")
    if at > deepest - _STILL_MM:
        raise DeviceFault(f"no contact down to {at:.2f} mm (limits.deepest_mm); check specimen, place and height")
    if loop.contact_mm - at > _EARLY_MM:  # never of the first contact, which is nan before
        raise DeviceFault(f"contact at {at:.2f} mm, {loop.contact_mm - at:.1f} mm above the last; is something there?")
    loop.down_mm = loop.contact_mm = at


def _rests(loop: Loop, begun_s: float) -> bool:
    """Test whether the piston has come to rest: the same position for a while."""
    now, at = loop.clock.now(), loop.extension.position_mm
    if now - begun_s > _LAND_S:
        raise DeviceFault(f"actuator: still on its way down after {_LAND_S:g} s, at {at:.2f} mm")
    until = now + _REST_S
    while loop.clock.now() < until:
        loop.period()
        if abs(loop.extension.position_mm - at) > _STILL_MM:
            return False
    return True


def press(loop: Loop, step: PlannedPress) -> DonePress:
    """Rest, land, follow the course of the force, and lift.

    The rest counts from the last lift on; at least what is averaged of it is at the place of the press.
    """
    loop.message = f"rest before press {step.number}"
    loop.wait(max(step.rest_s - (loop.clock.now() - loop.up_s), AVERAGED_S))
    before, noise = loop.watch.mean(), loop.watch.noise()
    loop.rest_ohm = before
    drift, allowed = loop.watch.drift(), loop.experiment.stop.drift
    if allowed and drift > allowed:
        raise Ended("rule", f"stop.drift: abs(Z) at rest has changed by {drift:.2%}; {allowed:.2%} are allowed")
    loop.message = f"press {step.number}, {step.kind}"
    land(loop)
    begun = loop.clock.now()
    while (time_s := loop.clock.now() - begun) < step.seconds:
        loop.set_n = step.force_at(time_s)
        loop.period()
    pressed = DonePress(step, before, loop.watch.mean(), np.hypot(noise, loop.watch.noise()))
    lift(loop)
    loop.presses += 1
    return pressed


def pause(loop: Loop) -> None:
    """Lift the tip and wait until somebody lets the run go on."""
    loop.recorder.journal.note("paused", step=loop.step)
    loop.message = "paused"
    lift(loop)
    settle(loop, "at rest")
    while loop.paused:
        loop.period()
    loop.recorder.journal.note("resumed", step=loop.step)


_UP_S = 15.0  # to the upper end, with homing
_GENTLE = 8.0  # times the force of the contact: limit of the actuator until the contact is known
_FIRST_S, _FIRST_REST_S = 10.0, 1.0  # until the first sound reading, and from then on


def identified(rig: RunDevices) -> dict[str, Identity]:
    """Ask every device what it is; nothing else is sent to any before all have answered.

    Raises
    ------
    DeviceFault
        One does not answer, or is another device.
    """
    identities = {}
    for role, device in (("actuator", rig.actuator), ("stage", rig.stage), ("impedance", rig.impedance)):
        with within(role):
            identities[role] = device.identify()
    return identities


def prepared(loop: Loop, middle_mm: float) -> None:
    """Zero the rig, check the specimen at rest, and find the height of the contact with a small force.

    Until then the actuator's own limit is a small one, too.

    Parameters
    ----------
    loop : Loop
        With devices that have been identified.
    middle_mm : float
        Place of the first contact [mm].

    Raises
    ------
    DeviceFault
        A device that fails; no contact.
    Ended
        The specimen is short or open.
    """
    rig, experiment = loop.rig, loop.experiment
    loop.message = "lifting the tip"
    rig.started.add("actuator")
    _started(loop, min(experiment.limits.force_n, _GENTLE * experiment.approach.contact_n))
    loop.message = "zero of the stage"
    rig.started.add("stage")
    rig.stage.start()
    settle(loop, "at its zero")
    loop.message = "first impedances"
    rig.started.add("impedance")
    rig.impedance.start(np.array(experiment.readout.tones_hz), experiment.readout.voltage_v)
    _first_readings(loop)
    loop.message = "looking for the contact"
    travel(loop, middle_mm)
    land(loop)
    lift(loop)
    _started(loop, experiment.limits.force_n)
    loop.recorder.journal.note("contact", position_mm=loop.contact_mm, place_mm=middle_mm)


def _started(loop: Loop, limit_n: float) -> None:
    """Give the actuator its limit of force, and wait until it is at its upper end."""
    loop.homed = False
    loop.rig.actuator.start(limit_n)
    until = loop.clock.now() + _UP_S
    loop.period()
    while not loop.extension.position_mm <= UP_MM:
        loop.period()
        if loop.clock.now() > until:
            raise DeviceFault(f"actuator: not at its upper end {_UP_S:g} s after its start")
    loop.homed = True


def _first_readings(loop: Loop) -> None:
    """Wait for a second of readings, in which the loop's rules look for short and open circuits."""
    until = loop.clock.now() + _FIRST_S
    while np.isnan(loop.watch.latest_ohm).any():
        loop.period()
        if loop.clock.now() > until:
            raise DeviceFault(f"impedance meter: no sound reading in {_FIRST_S:g} s; check cables, range and specimen")
    loop.wait(_FIRST_REST_S)
