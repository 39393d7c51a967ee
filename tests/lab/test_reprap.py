"""Driver of the gantry over serial lines and HTTP, message by message, and every planted fault."""

import json
import re
from contextlib import suppress

import pytest
from serving import http_server, pseudo_terminal

from lab.spring_plant import SpringPlant
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.measure.lab import reprap
from sensorgen.measure.lab.devices import DeviceFault, RealClock, SimulatedClock, WrongDevice
from sensorgen.measure.lab.port import HttpPort, SerialPort, SimulatedPort, faults
from sensorgen.measure.virtual.mechanics import BY_DEVICE
from sensorgen.measure.virtual.reprap import RepRapFirmware

WAYS = ("serial", "http")


class SimulatedWeb:
    """HTTP to a simulator in this process."""

    def __init__(self, simulator, clock):
        self.address = f"simulated {type(simulator).__name__}"
        self._simulator, self._clock = simulator, clock

    def get(self, path, timeout_s):
        """Status and content of one GET request; a simulator that does not answer takes the whole time [s]."""
        with faults(self.address):
            try:
                return self._simulator.get(path, self._clock.now())
            except TimeoutError:
                self._clock.wait_until(self._clock.now() + timeout_s)
                raise


class Lab:
    """Gantry, simulator and plant on one simulated clock."""

    def __init__(self, way, **settings):
        self.clock, self.plant = SimulatedClock(), SpringPlant()
        self.plant.axes["z"] = [3.0, 3.0, 1.0]
        self.firmware = RepRapFirmware(self.plant)
        if way == "serial":
            link = reprap.SerialLink(SimulatedPort(self.firmware, self.clock), self.clock)
        else:
            link = reprap.WebLink(
                SimulatedWeb(self.firmware, self.clock), self.clock, settings.get("password", "reprap")
            )
        self.stage = reprap.RepRapStage(link, self.clock, reprap.Settings(**settings))

    def run(self, seconds):
        """Read at 20 Hz; the last place."""
        for _ in range(round(seconds * 20)):
            self.clock.wait_until(self.clock.now() + 0.05)
            place = self.stage.read()
        return place

    def home(self):
        """At its zero, raised."""
        self.stage.start()
        assert not self.run(12).moving
        return self

    def move(self):
        """Begin a move, and follow it."""
        self.stage.move(20.0, 10.0)
        return self.run(4.0)

    @property
    def sent(self):
        """G-code that has come, by either way."""
        from urllib.parse import unquote

        lines = [unquote(each.decode()).partition("gcode=")[2] or each.decode() for each in self.firmware.heard]
        return "\n".join(lines)


@pytest.mark.parametrize("way", WAYS)
def test_zero_is_found_with_the_actuator_raised_before_and_after(way):
    lab = Lab(way)
    lab.stage.start()
    heights = []
    while lab.run(0.05).moving:
        heights.append(lab.plant.axis("z")[0])
    assert max(heights[:80]) == pytest.approx(33, abs=0.6)  # by 30 mm, not knowing its height
    assert lab.plant.axis("z")[0] == 30
    place = lab.stage.read()
    assert (place.position_mm, place.height_mm, place.moving) == (0, 30, False)
    assert re.search(r"M115.*G91\nG1 H2 Z30 F600\nG90\nG28\n.*G90\nG1 Z30.000 F600.0", lab.sent, re.DOTALL)


@pytest.mark.parametrize("way", WAYS)
def test_a_move_is_begun_and_followed(way):
    lab = Lab(way, origin_mm=12.5, working_mm=4.0).home()
    lab.stage.move(40.0, 10.0)
    assert "G90\nG1 X52.500 F600.0" in lab.sent
    first = lab.run(1.0)
    assert first.moving
    assert -12 < first.position_mm < 40
    last = lab.run(6.0)
    assert (last.position_mm, last.moving) == (40, False)
    lab.stage.lower()
    assert lab.run(0.2).moving
    assert lab.run(4.0).height_mm == 0
    lab.stage.lift()
    assert lab.run(4.0).height_mm == 30


@pytest.mark.parametrize("way", WAYS)
def test_no_reading_waits_for_a_move_or_for_homing(way):
    lab = Lab(way)
    lab.stage.start()
    lab.clock.wait_until(lab.clock.now() + 4)
    for _ in range(100):
        before = lab.clock.now()
        assert lab.stage.read().moving
        assert lab.clock.now() == before


@pytest.mark.parametrize("way", WAYS)
def test_an_emergency_stop_acts_at_once_and_asks_for_a_reset(way):
    lab = Lab(way).home()
    lab.stage.move(200.0, 10.0)
    lab.run(2.0)
    lab.stage.stop()
    here = lab.plant.axis("x")[0]
    with pytest.raises(DeviceFault, match="is halted: after an emergency stop reset it or send M999"):
        lab.run(1.0)
    assert lab.plant.axis("x") == (here, False)
    assert here < 30


@pytest.mark.parametrize("way", WAYS)
def test_nothing_but_the_question_goes_to_another_device(way):
    lab = Lab(way)
    lab.firmware.fault = "identity"
    said = "FIRMWARE_NAME: Marlin" if way == "serial" else "answers rr_connect with 404"
    with pytest.raises(WrongDevice, match=f"{said}.*expected RepRapFirmware"):
        lab.stage.start()
    assert lab.firmware.heard == [b"M115" if way == "serial" else b"/rr_connect?password=reprap"]


def test_answers_to_a_program_that_has_died_are_not_those_to_this_one():
    """It died while homing: the firmware answers M115 when the zeros are found, each time that it was asked."""
    lab = Lab("serial").home()
    lab.stage.move(100.0, 10.0)
    lab.firmware.exchange(b'M409 K"state.status"\nG28\nM409 K"state.status"\n', lab.clock.now())
    stage = reprap.RepRapStage(reprap.SerialLink(SimulatedPort(lab.firmware, lab.clock), lab.clock), lab.clock)
    for _ in range(3):
        with pytest.raises(DeviceFault, match="asked M115, answers"):
            stage.identify()
    while lab.plant.axis("z")[0] or lab.plant.axis("x")[0]:
        with suppress(DeviceFault):
            stage.identify()
    assert stage.identify().firmware == "3.5.3"
    stage.lift()
    lab.stage = stage
    assert lab.run(4.0).height_mm == 30


def test_older_firmware_has_no_object_model():
    class Old:
        address = "old"

        def identify(self):
            return "FIRMWARE_NAME: RepRapFirmware for Duet FIRMWARE_VERSION: 1.26 ELECTRONICS: Duet 0.6"

    with pytest.raises(WrongDevice, match="expected RepRapFirmware 3 or later"):
        reprap.RepRapStage(Old(), SimulatedClock()).identify()


@pytest.mark.parametrize("way", WAYS)
def test_moves_before_homing_are_refused_by_the_firmware_and_reported(way):
    lab = Lab(way)
    lab.stage.identify()
    lab.stage.move(5.0, 10.0)
    with pytest.raises(DeviceFault, match="Error: G1: insufficient axes homed"):
        lab.run(1.0)


@pytest.mark.parametrize(("place", "speed"), [(600.0, 10.0), (float("nan"), 10.0), (5.0, 0.0)])
def test_impossible_moves_are_refused_before_anything_is_sent(place, speed):
    lab = Lab("serial")
    with pytest.raises(OutOfRange, match="expected within 500 mm"):
        lab.stage.move(place, speed)
    assert lab.firmware.heard == []


SEEN = {
    "silent": {"serial": r"does not answer .M409 K\"state.status\".* in 2 s", "http": "timed out"},
    "hung": {"serial": "does not answer 'G90' in 2 s", "http": "timed out"},
    "garbage": {"serial": "expected JSON of the object model", "http": "expected JSON"},
    "truncated": {"serial": r"does not answer 'G90' in 2 s \(received b'o", "http": "expected JSON"},
    "cut": {"serial": "failed: cable out", "http": "failed: no route to host"},
    "error": {"serial": "'G1 X20.000 F600.0' with 'Error:", "http": "replies 'Error: G1: insufficient axes homed'"},
}


def test_every_fault_of_the_simulator_is_tried():
    assert {*SEEN, "stuck", "identity"} == set(BY_DEVICE["stage"])


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("fault", SEEN)
def test_a_planted_fault_is_seen(way, fault):
    lab = Lab(way).home()
    if fault == "silent" and way == "serial":
        lab.run(0.5)
    lab.firmware.fault = fault
    with pytest.raises(DeviceFault, match=SEEN[fault][way]):
        lab.run(4.0) if fault == "silent" and way == "serial" else lab.move()


@pytest.mark.parametrize("way", WAYS)
def test_a_stage_that_does_not_move_never_counts_as_arrived(way):
    lab = Lab(way).home()
    lab.firmware.fault = "stuck"
    lab.stage.move(20.0, 10.0)
    assert lab.run(5.0).moving


def test_a_session_that_has_ended_is_opened_again():
    """It ends after 8 s without a request: status 401."""
    lab = Lab("http").home()
    lab.clock.wait_until(lab.clock.now() + 9)
    lab.stage.move(20.0, 10.0)
    assert lab.run(3.0).position_mm == 20
    connects = [each for each in lab.firmware.heard if each.startswith(b"/rr_connect")]
    assert len(connects) == 2


def test_a_wrong_password_and_a_firmware_without_sessions_are_reported():
    with pytest.raises(DeviceFault, match="the password is wrong"):
        Lab("http", password="other").stage.identify()

    class Full:
        address = "full"

        def get(self, path, timeout_s):
            return 200, b'{"err":2}'

    with pytest.raises(DeviceFault, match="no free session: close other browsers"):
        reprap.WebLink(Full(), SimulatedClock(), "reprap").identify()


def test_short_of_memory_is_waited_for_but_not_for_ever():
    """Status 503 of the wiki page."""
    lab = Lab("http").home()
    web = lab.stage._link._web
    get, web.get = web.get, lambda path, timeout_s: (503, b"")
    for _ in range(5):
        lab.run(0.05)
    with pytest.raises(DeviceFault, match="short of memory again and again"):
        lab.run(0.2)
    web.get = get


def test_a_full_buffer_is_reported():
    lab = Lab("http").home()
    with pytest.raises(DeviceFault, match="its buffer is full"):
        lab.stage._link.send("M117 " + "x" * 2000)


def test_the_simulator_answers_as_the_firmware_does():
    """Firmware by its source: answers end with ok; M114 gives the end of the queue; G28 and M400 hold up all after."""
    lab = Lab("serial").home()
    firmware, clock = lab.firmware, lab.clock
    assert firmware.exchange(b"G1 X10 F600\n", clock.now()) == b"ok\n"
    assert firmware.exchange(b"M114\n", clock.now()).startswith(b"X:10.000 Y:0.000 Z:30.000 E:0.000 Count")
    assert json.loads(firmware.exchange(b'M409 K"state.status"\n', clock.now()).partition(b"\n")[0])["result"] == "busy"
    assert firmware.exchange(b"M400\nM114\n", clock.now()) == b""
    assert firmware.exchange(b"", clock.now() + 1.1).count(b"ok\n") == 2
    assert firmware.exchange(b"M112\nM999\nG1 X5\n", clock.now() + 2).endswith(b"insufficient axes homed\nok\n")


def there_and_back(link, clock, plant):
    """By the real clock: homed, and moved by 2 mm."""
    stage = reprap.RepRapStage(link, clock, reprap.Settings(clearance_mm=0.5, lift_mm_s=50))
    stage.start()
    for go in (lambda: stage.move(2.0, 100.0), stage.close):
        while stage.read().moving:
            clock.wait_until(clock.now() + 0.02)
        go()
    assert plant.axis("x")[0] == 2


def test_the_same_bytes_over_a_pseudo_terminal():
    pytest.importorskip("serial")
    clock, plant = RealClock(), SpringPlant()
    plant.time_s = clock.now()
    with pseudo_terminal(RepRapFirmware(plant), clock) as path:
        there_and_back(reprap.SerialLink(SerialPort(path, reprap.BAUD), clock), clock, plant)


def test_the_same_requests_over_http():
    clock, plant = RealClock(), SpringPlant()
    plant.time_s = clock.now()
    firmware = RepRapFirmware(plant)
    with http_server(firmware, clock) as address:
        there_and_back(reprap.WebLink(HttpPort(address), clock, "reprap"), clock, plant)
    assert firmware.heard[-1] == b"/rr_disconnect"
    with pytest.raises(DeviceFault, match="failed"):
        HttpPort(address).get("/rr_model", 1.0)


@pytest.mark.parametrize("address", ["10.0.0.5", "ftp://10.0.0.5", "http://"])
def test_an_address_is_one_of_http(address):
    with pytest.raises(BadInput, match="expected one of HTTP"):
        HttpPort(address)
