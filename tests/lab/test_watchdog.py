"""The actuator's own controller lifts the tip when run and guardian have ended together, or the computer sleeps."""

import pytest
from fakes import FakeActuator, fake_lab
from laboratory import PLAN, done, laboratory, left_alone

from lab.spring_plant import SpringPlant
from sensorgen.core.errors import BadInput
from sensorgen.measure.lab import run, smac
from sensorgen.measure.lab.devices import DeviceFault, SimulatedClock
from sensorgen.measure.lab.port import SimulatedPort
from sensorgen.measure.virtual.smac import SmacController


class Unwatched(FakeActuator):
    """Another maker's."""

    watch = None


class Killed(BaseException):
    """Run and guardian end at once: no sign of life is sent any more."""


def killed_while_pressing(lab, folder, monkeypatch, **extra):
    """A run that ends without a word at 3 N, as by SIGKILL: nothing of it is carried out any more."""
    read = type(lab.rig.actuator).read

    def dies(actuator):
        if lab.mechanism.force_n > 3.0:
            raise Killed
        return read(actuator)

    monkeypatch.setattr(type(lab.rig.actuator), "read", dies)
    monkeypatch.setattr(run.safety, "made_safe", lambda *_: (_ for _ in ()).throw(Killed))
    with pytest.raises(Killed):
        done(folder, lab, **extra)
    assert lab.mechanism.force_n > 2.9


def test_the_tip_is_up_two_seconds_after_the_last_sign(tmp_path, monkeypatch):
    lab = laboratory()
    killed_while_pressing(lab, tmp_path, monkeypatch)
    assert left_alone(lab, 4.0) < 2.0
    assert lab.mechanism.extension_mm == 0
    assert lab.mechanism.violations == []


def test_without_it_the_tip_stays_down(tmp_path, monkeypatch):
    """The fault that it is for, planted."""
    lab = laboratory()
    killed_while_pressing(lab, tmp_path, monkeypatch, watchdog=False)
    assert left_alone(lab, 4.0) > 3.9
    assert lab.mechanism.force_n > 2.9


def test_a_computer_that_slept_finds_the_tip_up_and_ends_the_run():
    clock, plant = SimulatedClock(), SpringPlant(extension_mm=5.0)
    controller = SmacController(plant)
    actuator = smac.SmacActuator(SimulatedPort(controller, clock), clock)
    actuator.watch(1.5)
    actuator.start(6.0)
    for _ in range(100):
        clock.wait_until(clock.now() + 0.01)
        actuator.read()
    actuator.push(3.0)
    for _ in range(300):
        clock.wait_until(clock.now() + 0.01)
        actuator.read()
    assert plant.force_n == pytest.approx(3.0, abs=0.02)
    for _ in range(60):  # asleep
        clock.wait_until(clock.now() + 0.1)
        controller.exchange(b"", clock.now())
    assert plant.extension_mm == 0
    with pytest.raises(DeviceFault, match=r"its watchdog lifted it, unread for 1\.5 s"):
        actuator.read()
    actuator.lift()
    assert actuator.read().position_mm == 0


def test_commands_are_coded_as_in_the_makers_file():
    """MatlabForceControl.mlm of the public repository, line by line; the return from its system macros."""
    assert smac._command(0x6071, 0) == 0x0060712000000000
    assert smac._command(0x6060, 1) == 0x0060601000000001
    assert smac._command(0x6040, 0x1F) == 0x006040200000001F
    assert smac._command(0x6071, -174) == 0x006071200000FF52
    assert smac._RETURN == 0x022C044000000000


def test_the_program_is_written_once_and_nobody_elses_is_replaced():
    clock, plant = SimulatedClock(), SpringPlant()
    controller = SmacController(plant)
    smac.SmacActuator(SimulatedPort(controller, clock), clock).watch(1.5)
    writes = sum(b"W 0x32C05" in line for line in controller.heard)
    assert writes == 9
    smac.SmacActuator(SimulatedPort(controller, clock), clock).watch(1.5)
    assert sum(b"W 0x32C05" in line for line in controller.heard) == writes  # its memory wears
    smac.SmacActuator(SimulatedPort(controller, clock), clock, smac.Settings(weight_n=2.0)).watch(1.5)
    assert sum(b"W 0x32C05" in line for line in controller.heard) == 2 * writes
    controller._macros[59, 0] = 0x0D2C0240000007D0
    with pytest.raises(DeviceFault, match="macro 59 has another program"):
        smac.SmacActuator(SimulatedPort(controller, clock), clock).watch(1.5)


def test_an_actuator_that_cannot_watch_is_refused_above_a_newton(tmp_path):
    lab = fake_lab()
    lab.rig.actuator = Unwatched(lab.mechanism, lab.clock)
    with pytest.raises(BadInput, match=r"limits.force_n: 7 N, .* no watchdog: .* up to 1 N, or --no-watchdog"):
        done(tmp_path, lab)
    assert done(tmp_path, lab, {"plan": PLAN[:1]}, watchdog=False).end == "done"
