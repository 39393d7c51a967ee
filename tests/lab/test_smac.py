"""Driver of the SMAC actuator, message by message against the public notes, and every planted fault."""

import math
from contextlib import suppress

import pytest
from serving import pseudo_terminal

from lab.spring_plant import SpringPlant
from sensorgen.core.errors import OutOfRange
from sensorgen.measure.lab import smac
from sensorgen.measure.lab.devices import DeviceFault, SimulatedClock, WrongDevice
from sensorgen.measure.lab.port import SerialPort, SimulatedPort
from sensorgen.measure.virtual.mechanics import BY_DEVICE
from sensorgen.measure.virtual.smac import SmacController

ASKED = b"32 R 0x1000\r32 R 0x11018\r"


class Lab:
    """Actuator, simulator and plant on one simulated clock."""

    def __init__(self, **settings):
        self.clock, self.plant = SimulatedClock(), SpringPlant()
        self.controller = SmacController(self.plant)
        port = SimulatedPort(self.controller, self.clock)
        self.actuator = smac.SmacActuator(port, self.clock, smac.Settings(**settings))

    def run(self, seconds):
        """Read at 100 Hz; the last reading."""
        for _ in range(round(seconds * 100)):
            self.clock.wait_until(self.clock.now() + 0.01)
            reading = self.actuator.read()
        return reading

    def push(self, force_n, seconds=1.0):
        """Press for a time; the last reading."""
        self.actuator.push(force_n)
        return self.run(seconds)

    def unheard(self, seconds):
        """Let time pass without a word from the computer."""
        self.clock.wait_until(self.clock.now() + seconds)
        self.controller.exchange(b"", self.clock.now())

    def home(self, limit_n=6.0):
        """At the upper end, with the motor on."""
        self.plant.extension_mm = 5.0
        self.actuator.start(limit_n)
        self.run(0.5)
        return self


class Wire:
    """A line that notes what is sent, and answers from a list."""

    address = "wire"

    def __init__(self, *answers):
        self.sent, self.answers = b"", list(answers)

    def write(self, data):
        self.sent += data

    def read_until(self, end, timeout_s):
        return self.answers.pop(0) if self.answers else b""

    def close(self):
        pass


def test_messages_are_those_of_the_note_serial():
    """SMAC's note "Serial Connect to PC/PLC": 0 R 0x6064, answer 0x20 W 0x6064 1234, motor off 0 W 0x6040 6."""
    clock = SimulatedClock()
    wire = Wire(b"0x20 W 0x6077 123\r", b"0x20 W 0x6064 998\r", b"0x20 W 0x6041 567\r")
    actuator = smac.SmacActuator(wire, clock, smac.Settings())
    reading = actuator.read()
    assert wire.sent == b"32 R 0x6077\r32 R 0x6064\r32 R 0x6041\r"
    assert reading.force_n == pytest.approx(123 * 0.0167 + 0.9)
    wire.sent = b""
    actuator.off()
    assert wire.sent == b"0 W 0x6040 6\r"


def test_values_may_be_hexadecimal_and_signed():
    """Programming guide 2.3.3: 0x02 W 0x6063 0x2130; object 0x2000 sub-index 4 chooses the base."""
    wire = Wire(b"0x20 W 0x6077 0xFFCA\r", b"0x20 W 0x006064 0xFFFFFFFE\r", b"\n0x20 W 0x6041 0x0237\r")
    reading = smac.SmacActuator(wire, SimulatedClock()).read()
    assert reading.force_n == pytest.approx(-54 * 0.0167 + 0.9)


def test_nothing_but_the_question_goes_to_another_device():
    lab = Lab()
    lab.controller.fault = "identity"
    with pytest.raises(WrongDevice, match="says device type 0x20192, maker 0x2E; expected"):
        lab.actuator.start(6.0)
    assert lab.controller.heard == ASKED.split(b"\r")[:-1]


def test_what_does_not_answer_is_asked_three_times_and_sent_nothing_else():
    lab = Lab()
    lab.controller.fault = "silent"
    with pytest.raises(DeviceFault, match="does not answer; check cable and power; expected an LCC-10"):
        lab.actuator.identify()
    assert b"\r".join([*lab.controller.heard, b""]) == 3 * ASKED


def test_homing_is_that_of_the_thesis_s_program():
    """MatlabForceControl.mlm of the public repository: method -1, speeds 10000 and 500, acceleration 10000."""
    lab = Lab().home()
    sent = b" ".join(lab.controller.heard)
    for each in (b"W 0x6098 -1", b"W 0x16099 10000", b"W 0x26099 500", b"W 0x609A 10000", b"W 0x12102 15000"):
        assert each in sent
    assert lab.actuator.read().position_mm == pytest.approx(0, abs=0.01)


def test_before_its_end_is_found_the_piston_counts_as_out():
    lab = Lab()
    lab.plant.extension_mm = 20.0
    lab.actuator.start(6.0)
    assert lab.run(0.05).position_mm == 50.0
    with pytest.raises(DeviceFault, match="has not found its upper end"):
        lab.actuator.push(1.0)
    assert lab.run(1.0).position_mm == pytest.approx(0, abs=0.01)


def test_force_mode_presses_with_the_force_less_the_weight():
    lab = Lab().home()
    reading = lab.push(3.0)
    assert lab.plant.force_n == pytest.approx(3.0, abs=0.0167)
    assert reading.force_n == pytest.approx(3.0, abs=0.0167)
    assert reading.position_mm == pytest.approx(21.5, abs=0.02)


def test_friction_is_overcome_by_the_current_and_subtracted_from_the_reading():
    lab = Lab(friction_n=0.3).home()
    lab.push(3.0)
    assert lab.plant.motor_n == pytest.approx(3.0 - 0.9 + 0.3, abs=0.02)
    assert lab.actuator.read().force_n == pytest.approx(3.0, abs=0.02)
    assert lab.push(2.0).force_n == pytest.approx(2.0, abs=0.02)
    assert lab.plant.motor_n == pytest.approx(2.0 - 0.9 - 0.3, abs=0.02)


def test_a_soft_landing_ends_at_its_force():
    lab = Lab().home()
    lab.actuator.move(30.0, 10.0, 0.5)
    reading = lab.run(4.0)
    assert lab.plant.force_n == pytest.approx(0.5, abs=0.02)
    assert 20 < reading.position_mm < 21
    lab.push(4.0)
    assert lab.plant.force_n == pytest.approx(4.0, abs=0.02)
    lab.actuator.lift()
    assert lab.run(1.0).position_mm == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize("limit", [0.5, 6.0])
def test_the_controller_itself_keeps_the_limit(limit):
    """A runaway motor goes to its limit: with the piston's weight it is the limit of the run."""
    lab = Lab().home(limit)
    lab.controller.fault = "runaway"
    for _ in range(100):
        lab.unheard(0.01)
        assert lab.plant.force_n <= limit
    assert lab.plant.force_n == pytest.approx(limit, abs=0.02)


@pytest.mark.parametrize("limit", [0.0, math.nan, 17.7])
def test_limits_that_the_motor_cannot_keep_are_refused_before_anything_is_sent(limit):
    lab = Lab()
    with pytest.raises(OutOfRange, match="limit of force"):
        lab.actuator.start(limit)
    assert lab.controller.heard == []


def test_set_points_beyond_limit_and_stroke_are_refused_before_anything_is_sent():
    lab = Lab().home(2.0)
    before = len(lab.controller.heard)
    with pytest.raises(OutOfRange, match=r"force 2.1 N; the limit is 2 N"):
        lab.actuator.push(2.1)
    with pytest.raises(OutOfRange, match=r"50.1 mm at 5 mm/s; expected 0 to 50 mm"):
        lab.actuator.move(50.1, 5.0, 1.0)
    assert len(lab.controller.heard) == before


SEEN = {
    "silent": "does not answer; check cable and power; motor off was sent",
    "hung": "does not answer; check cable and power; motor off was sent",
    "garbage": r"answers b'\\xfe\?~.*; expected 0x20 W OBJECT VALUE; motor off was sent",
    "identity": None,  # asked once
    "truncated": "which does not end; motor off was sent",
    "echo": "sends its question back: b'32 R 0x6071",
    "cut": "failed: cable out",
    "error": r"reports error 0x2201 \(I2T current\)",
    "stuck": "does not follow: set 6, measured 126 per mille",
    "runaway": "does not follow: set 6, measured 305 per mille",
}


def test_every_fault_of_the_simulator_is_tried():
    assert set(SEEN) == set(BY_DEVICE["actuator"])


@pytest.mark.parametrize("fault", [name for name, message in SEEN.items() if message])
def test_a_planted_fault_is_seen(fault):
    lab = Lab().home()
    lab.push(3.0, 0.5)
    lab.controller.fault = fault
    with pytest.raises(DeviceFault, match=SEEN[fault]):
        lab.push(1.0)
    if "motor off" in SEEN[fault]:
        assert lab.controller.heard[-1] == b"0 W 0x6040 6"


def test_a_target_that_is_not_taken_is_seen():
    lab = Lab().home()
    lab.controller._plant.switch(on=False)
    lab.controller._objects[0x6041] = 0x40
    with pytest.raises(DeviceFault, match="is off by itself: status word 0x0040"):
        lab.actuator.move(10.0, 5.0, 1.0)


def test_a_set_point_that_is_not_taken_is_seen():
    lab = Lab().home()
    lab.actuator.push(1.0)
    lab.controller._objects[0x6071] = 77
    with pytest.raises(DeviceFault, match=r"did not take object 0x6071: set 6, now 77"):
        lab.actuator.read()


@pytest.mark.parametrize("fault", ["error", "silent", "runaway", ""])
def test_after_a_fault_the_piston_is_lifted_and_the_motor_switched_off(fault):
    lab = Lab().home()
    lab.push(3.0, 0.5)
    lab.controller.fault = fault
    with suppress(DeviceFault):
        lab.run(0.1)
    lab.controller.fault = "" if fault == "runaway" else fault
    lab.actuator.lift()
    lab.unheard(1.5)
    assert lab.plant.extension_mm == 0
    lab.actuator.off()
    assert not lab.plant.on


def test_a_piston_that_is_being_lifted_is_not_let_fall_by_a_silent_controller():
    """It obeys, but cannot be heard: reading fails, and the motor stays on until it is switched off."""
    lab = Lab().home()
    lab.push(3.0, 0.5)
    lab.controller.fault = "silent"
    with pytest.raises(DeviceFault, match="motor off was sent"):
        lab.run(0.1)
    assert not lab.plant.on
    lab.actuator.lift()
    with pytest.raises(DeviceFault, match=r"check cable and power$"):
        lab.run(0.1)
    lab.unheard(1.0)
    assert (lab.plant.extension_mm, lab.plant.on) == (0, True)


@pytest.mark.parametrize("state", ["pushing", "landing", "homing", "off", "error"])
def test_another_process_lifts_from_any_state_on_a_line_opened_anew(state):
    """Without having asked anything, as it may not be answered."""
    lab = Lab()
    if state == "homing":
        lab.plant.extension_mm = 20.0
        lab.actuator.start(6.0)
    else:
        lab.home()
        lab.actuator.move(30.0, 10.0, 1.0) if state == "landing" else lab.actuator.push(3.0)
        lab.run(2.5)
    if state == "off":
        lab.actuator.off()
    if state == "error":
        lab.controller.fault = "error"
    other = smac.SmacActuator(SimulatedPort(lab.controller, lab.clock), lab.clock)
    other.lift()
    lab.unheard(1.5)
    assert (lab.plant.extension_mm, lab.plant.on) == (0, True)
    other.off()
    assert not lab.plant.on


def test_a_homing_that_does_not_end_is_a_fault():
    lab = Lab()
    lab.plant.extension_mm = 5.0
    lab.controller.fault = "stuck"
    lab.actuator.start(6.0)
    with pytest.raises(DeviceFault, match=r"reports error 0x8613 \(homing took too long\)"):
        lab.run(20)


def test_messages_that_come_unasked_are_passed_over_and_errors_raised():
    """Programming guide: the status word is sent when it changes; note Reset Error: 0x11003 when an error occurs."""
    words = [b"0x20 W 0x6041 1591\r", b"0x20 W 0x6077 1\r", b"0x20 W 0x6064 2\r", b"0x20 W 0x6041 567\r"]
    assert smac.SmacActuator(Wire(*words), SimulatedClock()).read().force_n == pytest.approx(0.9167)
    with pytest.raises(DeviceFault, match=r"0x7306 \(encoder wire\)"):
        smac.SmacActuator(Wire(b"0x20 W 0x11003 29446\r"), SimulatedClock()).read()


@pytest.mark.parametrize("line", [b"0x20 W 6x 1\r", b"\r", b"0x20 R 0x6064 1\r", b"0x20 W 0x6064 1"])
def test_garbage_is_no_value(line):
    with pytest.raises(DeviceFault, match=r"motor|expected"):
        smac.SmacActuator(Wire(*9 * [line, b""]), SimulatedClock()).read()


def test_the_same_bytes_over_a_pseudo_terminal():
    """Over pyserial, with the real clock; every reading waits for its own answers."""
    pytest.importorskip("serial")
    from sensorgen.measure.lab.devices import RealClock

    clock, plant = RealClock(), SpringPlant(extension_mm=1.0)
    plant.time_s = clock.now()
    controller = SmacController(plant)
    with pseudo_terminal(controller, clock) as path:
        actuator = smac.SmacActuator(SerialPort(path, smac.BAUD), clock, smac.Settings(timeout_s=5.0))
        assert actuator.identify().serial == "4711"
        actuator.start(6.0)
        while actuator.read().position_mm > 1:
            pass
        actuator.push(2.0)
        while plant.force_n < 1.9:
            actuator.read()
        actuator.close()
        again = smac.SmacActuator(SerialPort(path, smac.BAUD), clock)
        again.lift()
        while plant.extension_mm:
            pass
        again.off()
        while plant.on:
            pass
        again.close()
        first = SerialPort(path, smac.BAUD)
        with pytest.raises(DeviceFault, match="lock"):
            SerialPort(path, smac.BAUD)
        first.close()
    with pytest.raises(DeviceFault, match="connection to /dev/nothing failed"):
        SerialPort("/dev/nothing", smac.BAUD)
