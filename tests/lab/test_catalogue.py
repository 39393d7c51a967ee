"""Kinds of devices: those that come along, those of other packages, and their settings."""

from importlib.metadata import EntryPoint

import pytest

from lab.spring_plant import SpringPlant
from sensorgen.core.errors import BadInput, NotInstalled, UnknownName
from sensorgen.core.records import Strict
from sensorgen.measure.lab import catalogue
from sensorgen.measure.lab.devices import DeviceFault, SimulatedClock

ROLES = {
    "smac-lcc10": "actuator", "reprapfirmware": "stage", "hp-4284a": "impedance", "keysight-e4980a": "impedance",
    "hp-34401a": "meter", "keithley-2000": "meter",
}  # fmt: skip


class Force(Strict):
    """Settings of a kind of another package."""

    gain: float = 1.0


OWN = catalogue.Kind("meter", Force, lambda address, settings, clock: (address, settings.gain))


@pytest.fixture
def installed(monkeypatch):
    """Entry points of packages."""

    def make(*pairs):
        points = [EntryPoint(name, value, catalogue.GROUP) for name, value in pairs]
        monkeypatch.setattr("importlib.metadata.entry_points", lambda group: points if group == catalogue.GROUP else [])

    return make


@pytest.mark.parametrize(("name", "role"), ROLES.items())
def test_each_kind_has_a_driver_and_a_simulator_that_know_each_other(name, role):
    made = catalogue.simulated(name, SpringPlant(), {}, SimulatedClock())
    assert catalogue.kind(name).role == role
    assert made.driver.identify().model
    made.driver.close()


def test_settings_reach_simulator_and_driver():
    clock = SimulatedClock()
    plant = SpringPlant()
    made = catalogue.simulated("smac-lcc10", plant, {"newton_per_unit": 0.02, "node": 32.0}, clock)
    made.driver.start(4.0)
    clock.wait_until(0.5)
    made.driver.read()
    made.driver.push(3.0)
    clock.wait_until(1.0)
    assert made.driver.read().force_n == pytest.approx(3.0, abs=0.02)
    assert plant.force_n == pytest.approx(3.0, abs=0.02)


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("smac-lcc10", {"wieght_n": 1}, "settings of smac-lcc10: unknown key 'wieght_n'; did you mean 'weight_n'"),
        ("smac-lcc10", {"weight_n": -1}, "weight_n is -1; expected 0 or more"),
        ("reprapfirmware", {"baud": 57600.5}, "baud is 57600.5; expected a whole number"),
        ("hp-4284a", {"aperture": "MEDIUM"}, "aperture is 'MEDIUM'; expected 'SHOR', 'MED' or 'LONG'"),
        ("hp-34401a", {"wires": 2}, "unknown key 'wires'"),
    ],
)
def test_settings_are_those_of_the_kind(name, settings, message):
    with pytest.raises(BadInput, match=message):
        catalogue.simulated(name, SpringPlant(), settings, SimulatedClock())
    with pytest.raises(BadInput, match=message):
        catalogue.opened(name, "/dev/nothing", settings, SimulatedClock())


def test_an_unknown_kind_is_answered_with_the_nearest():
    with pytest.raises(UnknownName, match="unknown kind of device 'smac-lcc11'; did you mean 'smac-lcc10'"):
        catalogue.opened("smac-lcc11", "", {}, SimulatedClock())


@pytest.mark.parametrize("name", ["smac-lcc10", "reprapfirmware"])
def test_a_line_that_is_not_there_is_reported(name):
    pytest.importorskip("serial")
    with pytest.raises(DeviceFault, match="connection to /dev/nothing failed"):
        catalogue.opened(name, "/dev/nothing", {}, SimulatedClock())


@pytest.mark.parametrize("name", ["smac-lcc10", "hp-4284a"])
def test_a_missing_library_is_named(monkeypatch, name):
    for module in ("serial", "pyvisa"):
        monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(NotInstalled, match=r"pip install 'sensorgen\[lab\]'"):
        catalogue.opened(name, "/dev/ttyUSB0", {}, SimulatedClock())


def test_a_package_brings_a_kind_of_its_own(installed):
    installed(("acme-meter", f"{__name__}:OWN"))
    assert "acme-meter" in catalogue.names()
    found = EntryPoint.load
    try:
        EntryPoint.load = lambda self: OWN
        assert catalogue.opened("acme-meter", "COM3", {"gain": 2.5}, SimulatedClock()) == ("COM3", 2.5)
        with pytest.raises(BadInput, match="settings of acme-meter: unknown key 'gian'; did you mean 'gain'"):
            catalogue.opened("acme-meter", "COM3", {"gian": 2}, SimulatedClock())
        with pytest.raises(BadInput, match="'acme-meter' has no simulator"):
            catalogue.simulated("acme-meter", SpringPlant(), {}, SimulatedClock())
    finally:
        EntryPoint.load = found


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ([("acme", "nothing_of_the_kind:KIND")], "'nothing_of_the_kind:KIND' cannot be loaded"),
        ([("acme", "math:pi")], "'math:pi' is no sensorgen.measure.lab.catalogue.Kind"),
        ([("smac-lcc10", "math:pi")], "there is another kind of device 'smac-lcc10'"),
        ([("acme", "math:pi"), ("acme", "math:e")], "there is another kind of device 'acme'"),
    ],
)
def test_damaged_packages_are_named(installed, pairs, message):
    installed(*pairs)
    with pytest.raises(BadInput, match=message):
        catalogue.opened("acme", "", {}, SimulatedClock())


def test_all_kinds_are_listed_with_their_roles(installed):
    installed(("acme", "math:pi"))
    listed = catalogue.listed()
    assert listed["acme"].startswith("cannot be used: kind of device 'acme': 'math:pi' is no ")
    assert ROLES.items() <= listed.items()
    assert any(name.startswith("pymeasure:") for name in listed)  # its meters, or how to get them
