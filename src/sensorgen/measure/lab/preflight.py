"""Before the first press: who is there, zeros, contact found gently, specimen neither short nor open."""

import numpy as np

from sensorgen.core.errors import within
from sensorgen.measure.lab import press
from sensorgen.measure.lab.devices import DeviceFault, Identity
from sensorgen.measure.lab.loop import Loop
from sensorgen.measure.lab.safety import UP_MM, RunDevices

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
    found = {}
    for role, device in (("actuator", rig.actuator), ("stage", rig.stage), ("impedance", rig.impedance)):
        with within(role):
            found[role] = device.identify()
    return found


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
    press.settle(loop, "at its zero")
    loop.message = "first impedances"
    rig.started.add("impedance")
    rig.impedance.start(np.array(experiment.readout.tones_hz), experiment.readout.voltage_v)
    _first_readings(loop)
    loop.message = "looking for the contact"
    press.travel(loop, middle_mm)
    press.land(loop)
    press.lift(loop)
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
