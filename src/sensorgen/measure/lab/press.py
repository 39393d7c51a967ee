"""Motions of the rig: lift, travel, rest, land and press, by periods; and the checks before the first press."""

from math import isfinite, nan

import numpy as np

from sensorgen.core.errors import within
from sensorgen.measure.lab.devices import DeviceFault, Identity
from sensorgen.measure.lab.experiment import AVERAGED_S, DonePress, PlannedPress
from sensorgen.measure.lab.loop import Loop
from sensorgen.measure.lab.safety import RAISED_MM, UP_MM, Ended, RunDevices

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
