"""Kinds of devices by name, those of installed packages included, and how each is opened.

A package brings a kind of its own by an entry point of the group ``sensorgen.devices`` that names a :class:`Kind`::

    [project.entry-points."sensorgen.devices"]
    acme-press = "acme.lab:PRESS"

No package is imported before one of its kinds is asked for.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from pydantic import Field

from sensorgen.core.errors import BadInput, NotInstalled, UnknownName, within
from sensorgen.core.records import Line, Strict, checked
from sensorgen.measure.lab.devices import PYMEASURE, Actuator, Clock, FrameMeter, ImpedanceMeter, Meter, Role, Stage
from sensorgen.measure.virtual.plant import Plant

GROUP = "sensorgen.devices"
Device = Actuator | Stage | ImpedanceMeter | Meter | FrameMeter


@dataclass(frozen=True)
class Simulated:
    """A driver, and the simulator at the other end of its line.

    Attributes
    ----------
    driver : Device
        As for a real device.
    simulator : object
        With the attribute ``fault``.
    """

    driver: Device
    simulator: Any


@dataclass(frozen=True)
class Kind:
    """A kind of devices.

    Attributes
    ----------
    role : str
        Which protocol of :mod:`sensorgen.measure.lab.devices` its driver has.
    settings : type
        Record of the settings of one device.
    open : callable
        Driver from address, settings and clock; sends nothing.
    simulate : callable, optional
        Driver and simulator from plant, settings and clock.
    """

    role: Role
    settings: type[Strict]
    open: Callable[[str, Any, Clock], Device]
    simulate: Callable[[Plant, Any, Clock], Simulated] | None = None


class HandyscopeSettings(Strict):
    """Bridge of a Handyscope: feedback [ohm], [F], range of its output [V], and file of its gain per tone."""

    feedback_ohm: Annotated[float, Field(gt=0)] = 2610.0
    feedback_f: Annotated[float, Field(ge=0)] = 3.9e-12
    range_v: Annotated[float, Field(gt=0, le=80)] = 0.8
    gains: Line = ""


def names() -> list[str]:
    """Every kind that is known here.

    Raises
    ------
    BadInput
        Two packages have a kind of the same name, or one has the name of a kind that comes along.
    """
    return sorted([*_KINDS, *_installed()])


def listed() -> dict[str, str]:
    """Every kind with its role, those of PyMeasure included, or how to get them."""
    from sensorgen.measure.lab import pymeasure_meters

    try:
        return roles() | {name: role for name, (role, _) in pymeasure_meters.roles().items()}
    except NotInstalled as error:
        return roles() | {f"{PYMEASURE}CLASS": str(error)}


def roles() -> dict[str, str]:
    """Every kind with its role, or why it cannot be used, without those of PyMeasure."""
    by_name = dict[str, str]()
    for name in names():
        try:
            by_name[name] = kind(name).role
        except BadInput as error:
            by_name[name] = f"cannot be used: {error}"
    return by_name


def kind(name: str) -> Kind:
    """A kind by its name.

    Raises
    ------
    UnknownName
        Nothing goes by that name; the nearest one is offered.
    BadInput
        The package that brings it is damaged.
    """
    if name in _KINDS:
        return _KINDS[name]()
    if name.startswith(PYMEASURE):
        from sensorgen.measure.lab import pymeasure_meters

        role, driver = pymeasure_meters.meter(name)
        return Kind(role, pymeasure_meters.Settings, driver)
    point = _installed().get(name)
    if point is None:
        raise UnknownName("kind of device", name, names())
    try:
        loaded = point.load()
    except Exception as error:  # whatever somebody else's package makes of it
        raise BadInput(
            f"kind of device {name!r}: {point.value!r} cannot be loaded ({error}); repair or uninstall it"
        ) from None
    if not isinstance(loaded, Kind):
        raise BadInput(f"kind of device {name!r}: {point.value!r} is no {Kind.__module__}.Kind; repair or uninstall it")
    return loaded


def opened(name: str, address: str, settings: Mapping[str, Any], clock: Clock) -> Device:
    """Driver of a real device, which is sent nothing yet.

    Parameters
    ----------
    name : str
        Kind.
    address : str
        Serial line, URL, VISA resource or serial number.
    settings : mapping
        Of this device, as in the experiment's file.
    clock : Clock
        Of the run.

    Raises
    ------
    BadInput
        A setting that its kind does not have, or another type of value; or an address of another sort.
    DeviceFault
        There is no such line.
    """
    of = kind(name)
    return of.open(address, _settings(of, name, settings), clock)


def simulated(name: str, plant: Plant, settings: Mapping[str, Any], clock: Clock) -> Simulated:
    """Driver with a simulator in this process.

    Raises
    ------
    BadInput
        As :func:`opened`; or the kind has no simulator.
    """
    of = kind(name)
    if of.simulate is None:
        raise BadInput(f"kind of device {name!r} has no simulator")
    return of.simulate(plant, _settings(of, name, settings), clock)


def _settings(of: Kind, name: str, settings: Mapping[str, Any]) -> Strict:
    with within(f"settings of {name}"):
        return checked(of.settings, settings)


def _installed() -> dict[str, Any]:
    """Entry points of installed packages."""
    from importlib.metadata import entry_points

    try:
        points = list(entry_points(group=GROUP))
    except Exception as error:  # whatever a damaged package makes of it
        raise BadInput(f"entry points of installed packages cannot be read ({error}); repair or uninstall it") from None
    by_name: dict[str, Any] = {}
    for point in points:
        other = by_name.get(point.name)
        if point.name in _KINDS or (other and other.value != point.value):
            raise BadInput(
                f"entry point {point.value!r}: there is another kind of device {point.name!r}; uninstall one"
            )
        by_name[point.name] = point
    return by_name


def _at_port(
    role: Role, settings: type[Strict], driver: Callable[[Any, Clock, Any], Device], port: Callable[[str, Any], Any],
    simulator: Callable[[Plant, Any], Any],
) -> Kind:  # fmt: skip
    """A kind whose driver has a port: of a device, or of a simulator."""
    from sensorgen.measure.lab.port import SimulatedPort

    def simulate(plant: Plant, given: Any, clock: Clock) -> Simulated:
        far_end = simulator(plant, given)
        return Simulated(driver(SimulatedPort(far_end, clock), clock, given), far_end)

    return Kind(role, settings, lambda address, given, clock: driver(port(address, given), clock, given), simulate)


def _smac() -> Kind:
    from sensorgen.measure.lab import port, smac
    from sensorgen.measure.virtual.smac import SmacController

    return _at_port(
        "actuator", smac.Settings, smac.SmacActuator, lambda address, _: port.SerialPort(address, smac.BAUD),
        lambda plant, given: SmacController(
            plant, newton_per_unit=given.newton_per_unit, mm_per_count=given.mm_per_count
        ),
    )  # fmt: skip


def _reprap() -> Kind:
    from sensorgen.measure.lab import port, reprap
    from sensorgen.measure.virtual.reprap import RepRapFirmware

    def at(address: str, given: reprap.Settings) -> port.HttpPort | port.SerialPort:
        return port.HttpPort(address) if "://" in address else port.SerialPort(address, given.baud)

    return _at_port(
        "stage", reprap.Settings, reprap.stage, at, lambda plant, given: RepRapFirmware(plant, password=given.password)
    )


def _handyscope() -> Kind:
    from pathlib import Path

    from sensorgen.measure.lab import handyscope
    from sensorgen.measure.virtual.handyscope import Analyser, PhasorMeter

    def simulate(plant: Plant, given: HandyscopeSettings, clock: Clock) -> Simulated:
        far_end = PhasorMeter(plant, clock, Analyser(given.feedback_ohm, given.feedback_f, given.range_v))
        return Simulated(far_end, far_end)

    def real(address: str, given: HandyscopeSettings, clock: Clock) -> Device:
        gains = handyscope.gains(Path(given.gains)) if given.gains else ()
        bridge = handyscope.Bridge(given.feedback_ohm, given.feedback_f, given.range_v, gains)
        return handyscope.Handyscope(address, clock, bridge=bridge)

    return Kind("impedance", HandyscopeSettings, real, simulate)


def _scpi(name: str) -> Kind:
    from sensorgen.measure.lab import meters, port
    from sensorgen.measure.virtual import scpi

    def at(address: str, _: Strict) -> port.VisaPort:
        return port.VisaPort(address)

    model = {"hp-4284a": meters.HP_4284A, "keysight-e4980a": meters.E4980A}.get(name)
    if model:
        return _at_port(
            "impedance", meters.LcrSettings, lambda line, clock, given: meters.LcrMeter(line, clock, model, given),
            at, lambda plant, _: scpi.SimulatedLcrMeter(plant, name),
        )  # fmt: skip
    key = {"hp-34401a": "34401A", "keithley-2000": "MODEL 2000"}[name]
    return _at_port(
        "meter", Strict, lambda line, *_: meters.Multimeter(line, {key: meters.KNOWN[key]}), at,
        lambda plant, _: scpi.SimulatedMultimeter(plant, name),
    )  # fmt: skip


def _frames() -> Kind:
    from sensorgen.measure.lab import frame_stream, port

    def real(address: str, given: frame_stream.StreamSettings, clock: Clock) -> Device:
        return frame_stream.FrameStream(port.SerialPort(address, given.baud), clock)

    return Kind("array", frame_stream.StreamSettings, real)


_KINDS: dict[str, Callable[[], Kind]] = {
    "smac-lcc10": _smac,
    "reprapfirmware": _reprap,
    "handyscope-hs5": _handyscope,
    "frame-stream": _frames,
    **{name: partial(_scpi, name) for name in ("hp-4284a", "keysight-e4980a", "hp-34401a", "keithley-2000")},
}
