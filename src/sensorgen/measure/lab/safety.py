"""Make the rig safe, whatever has failed: lift the actuator, raise the stage, switch off."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import filterfalse
from math import inf

from sensorgen.core.errors import SensorgenError
from sensorgen.measure.lab.devices import Actuator, Clock, ImpedanceMeter, Stage

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
