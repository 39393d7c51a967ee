"""A simulated laboratory for tests: drivers and simulators on one mechanism, whose own record judges a run."""

from dataclasses import dataclass
from functools import cache
from math import inf
from pathlib import Path
from typing import Any

from sensorgen.core.records import checked
from sensorgen.design.design import make
from sensorgen.measure.lab import catalogue, experiment, run
from sensorgen.measure.lab.devices import SimulatedClock
from sensorgen.measure.lab.safety import RunDevices
from sensorgen.measure.log import Log
from sensorgen.measure.log.bench import read_again
from sensorgen.measure.recording import joined_all
from sensorgen.measure.signal.presses import Pairs
from sensorgen.measure.signal.run import processed
from sensorgen.measure.virtual import mechanics
from sensorgen.measure.virtual.mechanics import FAULTS, FaultSchedule, Planted
from sensorgen.measure.virtual.specimen import PressedSpecimen, drawn

LIMIT_N = 7.0
CLEARANCE_MM, STROKE_MM = 10.0, 15.0  # a third of the usual ways: a raised stage is out of the piston's reach
QUICK = {"speed_mm_s": 100.0, "landing_mm_s": 20.0, "travel_mm_s": 100.0}
PLAN = [
    {"hold": {"position_mm": 30, "force_n": 4.0, "hold_s": 1.0, "rest_s": 2.0}},
    {"hold": {"position_mm": 70, "force_n": 2.0, "hold_s": 1.0, "rest_s": 2.0}},
]


@cache
def specimen() -> PressedSpecimen:
    """Solved once."""
    design = make({"shape": "reference"})
    return PressedSpecimen(design, drawn(design, 1))


def asked(**changes: Any) -> experiment.Experiment:
    """A short experiment."""
    return checked(experiment.Experiment, {"specimen": "24 SX60", "plan": PLAN, "approach": QUICK} | changes)


class Watched(FaultSchedule):
    """Faults, and when they struck and the tip was last down."""

    def __init__(self, planted: tuple[Planted, ...], mechanism: mechanics.VirtualRig) -> None:
        super().__init__(planted)
        self._mechanism, self.struck_s, self.last_down_s = mechanism, inf, -inf
        self._planted = len(planted)

    def update(self, time_s: float, force_n: float) -> None:
        super().update(time_s, force_n)
        if len(self._waiting) < self._planted:
            self.struck_s = min(self.struck_s, time_s)
        if force_n > 0:
            self.last_down_s = time_s

    def __bool__(self) -> bool:
        """Also when all have struck."""
        return True


@dataclass
class Laboratory:
    """Devices with their simulators."""

    clock: SimulatedClock
    mechanism: mechanics.VirtualRig
    rig: RunDevices
    simulators: dict[str, Any]
    watched: Watched


def laboratory(faults: tuple[Planted, ...] = (), **changes: float) -> Laboratory:
    """A new one, with faults planted."""
    clock = SimulatedClock()
    short = {"clearance_mm": CLEARANCE_MM, "stroke_mm": STROKE_MM}
    at = mechanics.VirtualRig(specimen(), mechanics.Mechanics(**short | {"force_limit_n": LIMIT_N} | changes))
    at.planted = watched = Watched(faults, at)
    settings = {"weight_n": at.mechanics.weight_n, "friction_n": at.mechanics.friction_n}
    made = {
        "actuator": catalogue.simulated("smac-lcc10", at, settings, clock),
        "stage": catalogue.simulated("reprapfirmware", at, {"lift_mm_s": 30.0, "clearance_mm": CLEARANCE_MM}, clock),
        "impedance": catalogue.simulated("handyscope-hs5", at, {}, clock),
    }
    for name, role in (("actuator", "actuator"), ("stage", "stage"), ("analyser", "impedance")):
        at.planted.attach(name, made[role].simulator)
    for each in faults:
        if each.at_s == 0.0:  # before the first message
            target = {"rig": at, "analyser": made["impedance"].simulator}
            target |= {role: made[role].simulator for role in ("actuator", "stage")}
            target[FAULTS[each.what].strikes].fault = FAULTS[each.what].sets
    rig = RunDevices(**{role: each.driver for role, each in made.items()})
    return Laboratory(clock, at, rig, {role: each.simulator for role, each in made.items()}, watched)


def done(folder: Path, lab: Any, changes: dict[str, Any] | None = None, **extra: Any) -> run.RunResult:
    """Run the short experiment with some changes in a laboratory, or on anything with a clock and a rig."""
    with Log(folder / "log.db", create=True) as log:
        return run.run(asked(**changes or {}), clock=lab.clock, log=log, rig=lab.rig, simulated=True, **extra)


def outcome(folder: Path, faults: tuple[Planted, ...] = (), **changes: Any) -> tuple[run.RunResult, Laboratory]:
    """Run it with faults planted."""
    lab = laboratory(faults)
    return done(folder, lab, changes), lab


def pairs(log: Log) -> Pairs:
    """Presses of the only recording in a log."""
    (row,) = log.recordings()
    parts, rig = read_again(log, row)
    (beside,) = joined_all(next(parts), rig)
    return processed(beside.recording, beside).pairs


def left_alone(lab: Laboratory, seconds: float) -> float:
    """Leave the mechanism without commands; time until its tip was last down [s]."""
    begin = last = lab.clock.now()
    while lab.clock.now() < begin + seconds:
        lab.clock.wait_until(lab.clock.now() + 0.005)
        lab.simulators["actuator"].exchange(b"", lab.clock.now())
        last = lab.clock.now() if lab.mechanism.force_n > 0 else last
    return last - begin


def verdict(found: run.RunResult, lab: Laboratory, what: str) -> list[str]:
    """What is unsafe about the end of a run, by the mechanism's own record; and what is missing in its report."""
    at, wrong = lab.mechanism, []
    at.advance(lab.clock.now() + 10.0)
    known = "stage" in lab.rig.started  # before, the tip is as it was found
    if at.force_n > 0 or (known and at.tip_mm < 1.0):
        wrong.append(f"tip at {at.tip_mm:.2f} mm")
    held = "the motor holds it up" in " ".join(found.problems)
    if abs(at.motor_n) > 1e-3 and not held and what not in DEAF:
        wrong.append(f"motor at {at.motor_n:.2f} N")
    if held and not what.startswith(("stage", "rig stage")):
        wrong.append("motor left on")
    for each in at.violations:
        allowed = MOVED_S if what == "rig stage moves" and each.what == "sideways" else 0.01
        if each.duration_s > allowed + 1e-9:
            wrong.append(f"{each.what} for {each.duration_s:.3f} s, {each.value:.2f} N")
    if found.end not in ("fault", "rule") or not found.reason:
        wrong.append(f"ended as {found.end}: {found.reason}")
    if known and not found.tip_up:
        wrong.append("tip not reported up")
    return wrong


MOVED_S = 0.3
"""A stage that moves by itself at 2 mm/s is 0.2 mm off before it is seen, and then the tip needs time to lift."""
DEAF = ("actuator hung", "actuator cut", "actuator stuck", "rig jammed")
"""Faults after which the actuator's motor cannot be switched off from outside: the stage lifts."""
HARMLESS = ("actuator identity", "stage identity", "analyser in use", "analyser wrong device")
"""What a device says when it is asked who it is, which it is at the begin only: later it works on."""
MOMENTS = (*({"at_s": s} for s in (0.0, 0.1, 1.0, 4.2, 12.5)), {"at_force_n": 0.1}, {"at_force_n": 3.0})
"""Before the run asks who is there, homing of actuator and stage, first contact, between presses, landing, press."""
KINDS = [name for name, fault in FAULTS.items() if fault.strikes in ("actuator", "stage", "analyser", "rig")]
