"""Kinds of devices by name, those of installed packages included, and how each is opened.

A package brings a kind of its own by an entry point of the group ``sensorgen.devices`` that names a :class:`Kind`::

    [project.entry-points."sensorgen.devices"]
    acme-press = "acme.lab:PRESS"

No package is imported before one of its kinds is asked for.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field

from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.core.records import Line, Strict, checked
from sensorgen.measure.lab.clock import Clock
from sensorgen.measure.lab.devices import Actuator, ImpedanceMeter, Meter, Stage
from sensorgen.measure.virtual.plant import Plant

GROUP = "sensorgen.devices"
Device = Actuator | Stage | ImpedanceMeter | Meter


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

    role: Literal["actuator", "stage", "impedance", "meter"]
    settings: type[Strict]
    open: Callable[[str, Any, Clock], Device]
    simulate: Callable[[Plant, Any, Clock], Simulated] | None = None


class NoSettings(Strict):
    """A kind without settings."""


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
    point = _installed().get(name)
    if point is None:
        raise UnknownName("kind of device", name, names())
    try:
        found = point.load()
    except Exception as error:  # whatever somebody else's package makes of it
        raise BadInput(
            f"kind of device {name!r}: {point.value!r} cannot be loaded ({error}); repair or uninstall it"
        ) from None
    if not isinstance(found, Kind):
        raise BadInput(f"kind of device {name!r}: {point.value!r} is no {Kind.__module__}.Kind; repair or uninstall it")
    return found


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
    found = kind(name)
    return found.open(address, _settings(found, name, settings), clock)


def simulated(name: str, plant: Plant, settings: Mapping[str, Any], clock: Clock) -> Simulated:
    """Driver with a simulator in this process.

    Raises
    ------
    BadInput
        As :func:`opened`; or the kind has no simulator.
    """
    found = kind(name)
    if found.simulate is None:
        raise BadInput(f"kind of device {name!r} has no simulator")
    return found.simulate(plant, _settings(found, name, settings), clock)


def _settings(found: Kind, name: str, settings: Mapping[str, Any]) -> Strict:
    try:
        return checked(found.settings, settings)
    except BadInput as error:
        raise BadInput(f"settings of {name}: {error}") from None


def _installed() -> dict[str, Any]:
    """Entry points of installed packages."""
    from importlib.metadata import entry_points

    try:
        points = list(entry_points(group=GROUP))
    except Exception as error:  # whatever a damaged package makes of it
        raise BadInput(f"entry points of installed packages cannot be read ({error}); repair or uninstall it") from None
    found: dict[str, Any] = {}
    for point in points:
        other = found.get(point.name)
        if point.name in _KINDS or (other and other.value != point.value):
            raise BadInput(
                f"entry point {point.value!r}: there is another kind of device {point.name!r}; uninstall one"
            )
        found[point.name] = point
    return found


def _smac() -> Kind:
    from sensorgen.measure.lab import smac
    from sensorgen.measure.lab.port import SerialPort, SimulatedPort
    from sensorgen.measure.virtual.smac import SmacController

    def simulate(plant: Plant, settings: smac.Settings, clock: Clock) -> Simulated:
        made = SmacController(plant, newton_per_unit=settings.newton_per_unit, mm_per_count=settings.mm_per_count)
        return Simulated(smac.Actuator(SimulatedPort(made, clock), clock, settings), made)

    def real(address: str, settings: smac.Settings, clock: Clock) -> Device:
        return smac.Actuator(SerialPort(address, smac.BAUD), clock, settings)

    return Kind("actuator", smac.Settings, real, simulate)


def _reprap() -> Kind:
    from sensorgen.measure.lab import reprap
    from sensorgen.measure.lab.port import HttpPort, SerialPort, SimulatedPort
    from sensorgen.measure.virtual.reprap import RepRapFirmware

    def simulate(plant: Plant, settings: reprap.Settings, clock: Clock) -> Simulated:
        made = RepRapFirmware(plant, password=settings.password)
        return Simulated(reprap.Stage(reprap.SerialLink(SimulatedPort(made, clock), clock), clock, settings), made)

    def real(address: str, settings: reprap.Settings, clock: Clock) -> Device:
        link: reprap.Link
        if "://" in address:
            link = reprap.WebLink(HttpPort(address), clock, settings.password)
        else:
            link = reprap.SerialLink(SerialPort(address, settings.baud), clock)
        return reprap.Stage(link, clock, settings)

    return Kind("stage", reprap.Settings, real, simulate)


def _handyscope() -> Kind:
    from pathlib import Path

    from sensorgen.measure.lab import handyscope
    from sensorgen.measure.virtual.handyscope import Analyser, PhasorMeter

    def simulate(plant: Plant, settings: HandyscopeSettings, clock: Clock) -> Simulated:
        made = PhasorMeter(plant, clock, Analyser(settings.feedback_ohm, settings.feedback_f), range_v=settings.range_v)
        return Simulated(made, made)

    def real(address: str, settings: HandyscopeSettings, clock: Clock) -> Device:
        gains = handyscope.gains(Path(settings.gains)) if settings.gains else ()
        bridge = handyscope.Bridge(settings.feedback_ohm, settings.feedback_f, settings.range_v, gains)
        return handyscope.Handyscope(address, clock, bridge=bridge)

    return Kind("impedance", HandyscopeSettings, real, simulate)


def _lcr(name: str) -> Kind:
    from sensorgen.measure.lab import lcr_meter
    from sensorgen.measure.lab.port import SimulatedPort, VisaPort
    from sensorgen.measure.virtual import scpi

    model = {"hp-4284a": lcr_meter.HP_4284A, "keysight-e4980a": lcr_meter.E4980A}[name]

    def simulate(plant: Plant, settings: lcr_meter.Settings, clock: Clock) -> Simulated:
        made = scpi.LcrMeter(plant, name)
        return Simulated(lcr_meter.LcrMeter(SimulatedPort(made, clock), clock, model, settings), made)

    def real(address: str, settings: lcr_meter.Settings, clock: Clock) -> Device:
        return lcr_meter.LcrMeter(VisaPort(address), clock, model, settings)

    return Kind("impedance", lcr_meter.Settings, real, simulate)


def _multimeter(name: str) -> Kind:
    from sensorgen.measure.lab import multimeter
    from sensorgen.measure.lab.port import SimulatedPort, VisaPort
    from sensorgen.measure.virtual import scpi

    key = {"hp-34401a": "34401A", "keithley-2000": "MODEL 2000"}[name]
    models = {key: multimeter.KNOWN[key]}

    def simulate(plant: Plant, _: NoSettings, clock: Clock) -> Simulated:
        made = scpi.Multimeter(plant, name)
        return Simulated(multimeter.Multimeter(SimulatedPort(made, clock), models), made)

    def real(address: str, _: NoSettings, _clock: Clock) -> Device:
        return multimeter.Multimeter(VisaPort(address), models)

    return Kind("meter", NoSettings, real, simulate)


_KINDS: dict[str, Callable[[], Kind]] = {
    "smac-lcc10": _smac,
    "reprapfirmware": _reprap,
    "handyscope-hs5": _handyscope,
    "hp-4284a": lambda: _lcr("hp-4284a"),
    "keysight-e4980a": lambda: _lcr("keysight-e4980a"),
    "hp-34401a": lambda: _multimeter("hp-34401a"),
    "keithley-2000": lambda: _multimeter("keithley-2000"),
}
