"""The guardian by itself: whom it lifts, whom it leaves alone, and what it reports."""

import json
import os
import signal

import pytest

from sensorgen.measure.lab import guardian
from sensorgen.measure.lab.devices import DeviceFault, Place
from sensorgen.measure.lab.experiment import Device

DEVICES = {role: Device(kind="smac-lcc10", address="/nowhere") for role in ("actuator", "stage")}


class Driver:
    """Notes what it is asked; some calls fail."""

    def __init__(self, *failing):
        self.calls, self._failing = [], failing

    def _call(self, name):
        self.calls.append(name)
        if name in self._failing:
            raise DeviceFault(f"no answer to {name}")

    def identify(self):
        self._call("identify")

    def lift(self):
        self._call("lift")

    def off(self):
        self._call("off")

    def read(self):
        self._call("read")
        return Place(0.0, 0.0, 30.0, moving=self.calls.count("read") < 3)


@pytest.fixture
def quick(monkeypatch):
    for name, value in {"_TRIES_S": 0.2, "_UP_S": 0.01, "_RAISE_S": 0.3, "_AGAIN_S": 0.01}.items():
        monkeypatch.setattr(guardian, name, value)

    def rescue(actuator, stage):
        made = {"actuator": actuator, "stage": stage}
        monkeypatch.setattr(
            guardian.rigs, "opened", lambda device, _: made[next(r for r, d in DEVICES.items() if d is device)]
        )
        found = guardian.Rescue(DEVICES)
        found.run()
        return found.outcome

    return rescue


def test_both_are_lifted_and_the_motor_goes_off_when_the_stage_is_up(quick):
    actuator, stage = Driver(), Driver()
    assert quick(actuator, stage) == {"actuator": "lifted, motor off", "stage": "raised"}
    assert (actuator.calls, stage.calls[:2]) == (["lift", "off"], ["identify", "lift"])


@pytest.mark.parametrize("failing", ["identify", "lift", "read"])
def test_the_motor_holds_the_piston_where_the_stage_fails(quick, failing):
    actuator = Driver()
    found = quick(actuator, Driver(failing))
    assert found == {"actuator": "lifted, motor on", "stage": f"no answer to {failing}"}
    assert actuator.calls == ["lift"]


def test_the_stage_is_raised_where_the_actuator_fails(quick):
    assert quick(Driver("lift"), Driver()) == {"actuator": "no answer to lift", "stage": "raised"}


def _report(folder):
    file = folder / guardian.REPORT
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


@pytest.mark.parametrize(("armed", "released", "rescues", "roles"), [
    (False, False, 0, ["actuator"]),
    (True, True, 0, ["actuator"]),
    (True, False, 1, []),
    pytest.param(True, False, 1, ["actuator"], marks=pytest.mark.nightly),  # tries for ten seconds to open its line
])  # fmt: skip
def test_it_lifts_when_the_pipe_closes_while_it_is_armed(tmp_path, armed, released, rescues, roles):
    devices = {role: Device(kind="smac-lcc10", address=str(tmp_path / "none")) for role in roles}
    watcher = guardian.Guardian(guardian.Orders(devices=devices, dead_man_s=5.0, folder=str(tmp_path)))
    if armed:
        watcher.arm()
        watcher.beat()
    if released:
        watcher.disarm()
    watcher.close()
    reports = _report(tmp_path)
    assert len(reports) == rescues
    assert [each["reason"] for each in reports] == ["the run has died"] * rescues
    for each in reports:
        assert list(each["devices"]) == roles
        assert all("connection to" in told for told in each["devices"].values())


def test_a_dead_guardian_is_noticed(tmp_path):
    watcher = guardian.Guardian(guardian.Orders(devices={}, dead_man_s=5.0, folder=str(tmp_path)))
    os.kill(watcher._process.pid, signal.SIGKILL)
    watcher._process.wait(10)
    with pytest.raises(DeviceFault, match="guardian: it has died"):
        watcher.beat()
    watcher.close()
