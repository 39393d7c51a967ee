"""The devices of a rig: real ones at their addresses, or simulators that share one virtual specimen."""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, cast

from sensorgen.core.errors import BadInput, within
from sensorgen.design.design import Design
from sensorgen.measure.lab import catalogue
from sensorgen.measure.lab.devices import Clock, Meter, RealClock
from sensorgen.measure.lab.experiment import Device, Devices, Experiment
from sensorgen.measure.lab.meters import Multimeter
from sensorgen.measure.lab.port import VisaPort
from sensorgen.measure.lab.safety import RunDevices
from sensorgen.measure.virtual import mechanics

_HEARD = 1000  # messages that a simulator remembers
ROLES = ("actuator", "stage", "impedance")
SIMULATED = Devices(
    actuator=Device(kind="smac-lcc10"), stage=Device(kind="reprapfirmware"), impedance=Device(kind="handyscope-hs5")
)
"""The thesis's rig, where an experiment names no devices."""
_STRIKES: Mapping[str, mechanics.Strikes] = {
    "smac-lcc10": "actuator", "reprapfirmware": "stage", "handyscope-hs5": "analyser", "hp-4284a": "lcr-meter",
    "keysight-e4980a": "lcr-meter",
}  # fmt: skip


def real(devices: Devices, clock: Clock) -> RunDevices:
    """Drivers of real devices, which are sent nothing yet.

    Raises
    ------
    BadInput, UnknownName
        A kind that is not known or has another role, or a setting that it does not have; the message names the role.
    DeviceFault
        There is no such line.
    """
    return RunDevices(**_drivers(devices, lambda device: opened(device, clock)))


def simulated(experiment: Experiment, design: Design, clock: Clock) -> tuple[RunDevices, mechanics.VirtualRig]:
    """Drivers with simulators in this process, and the mechanism that they share, its faults planted.

    Raises
    ------
    BadInput, UnknownName
        As :func:`real`; a virtual specimen that cannot be; a fault of a device that is not in use; a kind without a
        simulator.
    """
    virtual = experiment.virtual or mechanics.VirtualSpecimen()
    devices = experiment.devices or SIMULATED
    with within("virtual"):
        _strike(virtual, devices)
        plant = mechanics.rig_of(virtual, design, experiment.pressing.length_mm * 1e-3)
        plant.specimen.blank  # noqa: B018 - solved now: one that cannot be is refused before the run begins

    def driver(device: Device) -> Any:
        settings = dict(device.settings)
        if device.kind == SIMULATED.actuator.kind:
            settings = {"weight_n": plant.mechanics.weight_n, "friction_n": plant.mechanics.friction_n} | settings
        of = catalogue.simulated(device.kind, plant, settings, clock)
        if hasattr(of.simulator, "heard"):  # every message so far: of an hour, tens of megabytes
            of.simulator.heard = deque(maxlen=_HEARD)
        if plant.planted and device.kind in _STRIKES:
            plant.planted.attach(_STRIKES[device.kind], of.simulator)
        return of.driver

    return RunDevices(**_drivers(devices, driver)), plant


def _drivers(devices: Devices, driver_of: Callable[[Device], Any]) -> dict[str, Any]:
    """Drivers by role; where one cannot be made, the others are closed."""
    drivers: dict[str, Any] = {}
    try:
        for role in ROLES:
            with within(f"devices.{role}"):
                _has_role(role, getattr(devices, role))
                drivers[role] = driver_of(getattr(devices, role))
    except BaseException:
        for driver in drivers.values():
            driver.close()
        raise
    return drivers


def _strike(virtual: mechanics.VirtualSpecimen, devices: Devices) -> None:
    """Refuse planted faults of devices that are not in use."""
    struck = {"rig", *(_STRIKES.get(getattr(devices, role).kind, "") for role in ROLES)}
    for one in virtual.faults:
        if mechanics.FAULTS[one.what].strikes not in struck:
            known = ", ".join(name for name, fault in mechanics.FAULTS.items() if fault.strikes in struck)
            raise BadInput(f"faults: {one.what!r} strikes a device that is not in use; expected one of {known}")


def check(devices: Mapping[str, Device]) -> None:
    """Refuse kinds of devices without opening any, by their roles; errors as :func:`real`."""
    for role, device in devices.items():
        with within(f"devices.{role}"):
            _has_role(role, device)


def opened(device: Device, clock: Clock) -> Any:
    """Driver of one real device; errors as :func:`real`."""
    return catalogue.opened(device.kind, device.address, device.settings, clock)


def meter(kind: str | None, address: str) -> Meter:
    """Driver of a multimeter at a VISA address, of a kind or of one that its answer names; errors as :func:`real`."""
    if kind is None:
        return Multimeter(VisaPort(address))
    _has_role("meter", Device(kind=kind))
    return cast(Meter, catalogue.opened(kind, address, {}, RealClock()))


def _has_role(role: str, device: Device) -> None:
    has = catalogue.kind(device.kind).role
    if has != role:
        known = [name for name, other in catalogue.roles().items() if other == role]
        raise BadInput(f"kind {device.kind!r} is of the role {has}; expected one of {', '.join(known)}")
