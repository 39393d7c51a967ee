"""Impedance analysers and multimeters: simulators on a plant, pyvisa-sim, and a TCP socket through pyvisa-py."""

import math
from pathlib import Path

import numpy as np
import pytest
from serving import tcp_server

from lab.spring_plant import SpringPlant
from sensorgen.core.errors import OutOfRange
from sensorgen.measure.lab import meters
from sensorgen.measure.lab.devices import DeviceFault, RealClock, SimulatedClock, WrongDevice
from sensorgen.measure.lab.port import SimulatedPort, VisaPort
from sensorgen.measure.virtual import scpi
from sensorgen.measure.virtual.mechanics import BY_DEVICE

TONES = np.array([1000.0, 1e5])
MODELS = {"hp-4284a": meters.HP_4284A, "keysight-e4980a": meters.E4980A}


class Lab:
    """Analyser, simulator and plant on one simulated clock."""

    def __init__(self, model="hp-4284a", aperture="SHOR"):
        self.clock, self.plant = SimulatedClock(), SpringPlant()
        self.instrument = scpi.SimulatedLcrMeter(self.plant, model)
        port = SimulatedPort(self.instrument, self.clock)
        self.meter = meters.LcrMeter(port, self.clock, MODELS[model], meters.LcrSettings(aperture=aperture))

    def started(self):
        self.meter.start(TONES, 1.0)
        return self

    def run(self, seconds):
        """Read at 100 Hz; everything that came."""
        rows = []
        for _ in range(round(seconds * 100)):
            self.clock.wait_until(self.clock.now() + 0.01)
            rows.append(self.meter.read())
        return rows


@pytest.mark.parametrize("model", MODELS)
def test_frequencies_are_measured_one_after_the_other(model):
    lab = Lab(model).started()
    rows = [each for each in lab.run(1.0) if len(each.time_s)]
    assert len(rows) >= 8
    z = np.concatenate([each.impedance_ohm for each in rows])
    assert np.array_equal(np.isnan(z[::2].real), np.tile([False, True], (len(z[::2]), 1)))
    assert np.nanmean(z, 0) == pytest.approx(lab.plant.impedance(TONES), rel=1e-5)
    assert not any(each.clipped.any() or each.lost for each in rows)
    assert lab.instrument.level_v == pytest.approx(1 / math.sqrt(2), abs=1e-4)


@pytest.mark.parametrize(("aperture", "least_s"), [("SHOR", 0.270), ("MED", 0.400), ("LONG", 1.040)])
def test_the_time_of_the_manual_is_waited_for_before_a_value_is_fetched(aperture, least_s):
    """Manual of the 4284A, page 9-23: at 100 Hz 270, 400 and 1040 ms; nothing is fetched, and no call waits, before."""
    lab = Lab(aperture=aperture)
    lab.meter.start(np.array([100.0]), 1.0)
    lab.run(least_s - 0.01)
    assert b"FETC?" not in lab.instrument.heard
    assert any(len(each.time_s) for each in lab.run(0.05))


def test_messages_are_in_the_order_of_the_manual():
    lab = Lab().started()
    lab.run(0.1)
    lab.meter.stop()
    assert b"\n".join(lab.instrument.heard).decode().splitlines() == [
        "*IDN?", "*CLS", "ABOR", "FUNC:IMP RX", "VOLT 0.7071", "APER SHOR,1", "TRIG:SOUR BUS", "INIT:CONT ON",
        "SYST:ERR?", "FREQ 1000", "TRIG", "FETC?", "FREQ?", "FREQ 100000", "TRIG", "ABOR", "VOLT MIN",
    ]  # fmt: skip
    assert not len(lab.meter.read().time_s)


@pytest.mark.parametrize(
    ("tones", "volt", "message"),
    [
        ([19.0], 1.0, "frequencies 19 Hz; expected 20 to 1e.06 Hz for 4284A"),
        ([1000.0, 2e6, float("nan")], 1.0, "expected 20 to 1e.06 Hz"),
        ([], 1.0, "expected 20"),
        ([1000.0], 3.0, "amplitude 3 V; expected 0.00707 to 2.83 V"),
    ],
)
def test_what_it_cannot_measure_is_refused_before_anything_is_sent(tones, volt, message):
    lab = Lab()
    with pytest.raises(OutOfRange, match=message):
        lab.meter.start(np.array(tones), volt)
    assert lab.instrument.heard == []


def test_nothing_but_the_question_goes_to_another_instrument():
    lab = Lab()
    lab.instrument.fault = "identity"
    with pytest.raises(WrongDevice, match=r"is 'TEKTRONIX,TDS 2000,0,1.0'; expected 4284A"):
        lab.meter.start(TONES, 1.0)
    assert lab.instrument.heard == [b"*IDN?"]


SEEN = {
    "silent": "does not answer FETC[?]; check cable and power",
    "hung": "does not answer FETC",
    "garbage": "expected R,X,STATUS",
    "truncated": "does not answer FETC. to its end: b",
    "cut": "failed: cable out",
    "stuck": r"measures at '1.00000E\+0[35]' Hz, not 1(000|00000) Hz",
}


@pytest.mark.parametrize("fault", SEEN)
def test_a_planted_fault_is_seen(fault):
    lab = Lab().started()
    lab.run(0.5)
    lab.instrument.fault = fault
    with pytest.raises(DeviceFault, match=SEEN[fault]):
        lab.run(1.0)


def test_readings_that_a_program_which_has_died_did_not_fetch_are_passed_over():
    lab = Lab().started()
    lab.clock.wait_until(1.0)
    port = SimulatedPort(lab.instrument, lab.clock)
    for command in (b"FETC?\n", b"FREQ?\n", b"SYST:ERR?\n"):
        port.write(command)
    other = meters.LcrMeter(port, lab.clock, meters.HP_4284A)
    assert other.identify().serial == "2940J01234"
    other.start(TONES, 1.0)
    lab.clock.wait_until(2.0)
    assert len(other.read().time_s) == 1


def test_an_error_of_the_instrument_is_reported():
    lab = Lab()
    lab.instrument.fault = "error"
    with pytest.raises(DeviceFault, match=r"4284A at .* reports '-350,\"Queue overflow\"'"):
        lab.meter.start(TONES, 1.0)


def test_an_overload_is_clipped_and_no_number():
    """Status 1: bridge unbalanced, value 9.9E37."""
    lab = Lab().started()
    lab.instrument.fault = "overload"
    rows = [each for each in lab.run(0.5) if len(each.time_s)]
    assert all(each.clipped.all() for each in rows[1:])
    assert np.isnan(np.concatenate([each.impedance_ohm for each in rows[1:]])).all()


def test_every_fault_of_the_simulators_is_tried():
    assert {*SEEN, "error", "overload", "identity"} == set(BY_DEVICE["lcr-meter"])


@pytest.fixture
def _sim(monkeypatch):
    pytest.importorskip("pyvisa_sim")
    monkeypatch.setenv("PYVISA_LIBRARY", f"{Path(__file__).with_name('analysers.yaml')}@sim")


@pytest.mark.usefixtures("_sim")
def test_an_analyser_of_pyvisa_sim():
    clock = SimulatedClock()
    meter = meters.LcrMeter(VisaPort("GPIB0::17::INSTR"), clock, meters.HP_4284A, meters.LcrSettings(aperture="SHOR"))
    assert meter.identify().serial == "2940J01234"
    meter.start(TONES, 1.0)
    clock.wait_until(0.1)
    assert meter.read().impedance_ohm[0, 0] == 1000 - 159155j
    meter.stop()
    meter.close()
    wrong = meters.LcrMeter(VisaPort("GPIB0::18::INSTR"), clock, meters.HP_4284A)
    with pytest.raises(WrongDevice, match="Keysight Technologies,E4980A"):
        wrong.start(TONES, 1.0)
    wrong.close()


def test_an_analyser_on_a_tcp_socket(monkeypatch):
    """pyvisa-py, the plant behind it, by the real clock."""
    pytest.importorskip("pyvisa_py")
    monkeypatch.setenv("PYVISA_LIBRARY", "@py")
    clock, plant = RealClock(), SpringPlant()
    plant.time_s = clock.now()
    instrument = scpi.SimulatedLcrMeter(plant)
    with tcp_server(instrument, clock) as address:
        meter = meters.LcrMeter(VisaPort(address), clock, meters.HP_4284A, meters.LcrSettings(aperture="SHOR"))
        meter.start(TONES, 1.0)
        rows = []
        while len(rows) < 4:
            found = meter.read()
            rows += [found] if len(found.time_s) else []
            clock.wait_until(clock.now() + 0.005)
        meter.stop()
        meter.close()
    z = np.concatenate([each.impedance_ohm for each in rows])
    assert np.nanmean(z, 0) == pytest.approx(plant.impedance(TONES), rel=1e-5)


@pytest.mark.parametrize(("model", "name"), [("hp-34401a", "HP 34401A"), ("keithley-2000", "Keithley 2000")])
def test_a_simulated_multimeter(model, name):
    clock, plant = SimulatedClock(), SpringPlant()
    instrument = scpi.SimulatedMultimeter(plant, model)
    meter = meters.Multimeter(SimulatedPort(instrument, clock))
    assert meter.identify().model == name
    assert float(meter.resistance(wires=4)) == 650
    assert float(meter.resistance(wires=2)) == 651
    assert clock.now() == pytest.approx(1.0, abs=0.01)
    instrument.fault = "overload"
    assert float(meter.resistance(wires=2)) == 9.9e37


@pytest.mark.parametrize("fault", ["silent", "hung", "garbage", "identity", "truncated", "cut", "error"])
def test_a_planted_fault_of_a_multimeter_is_seen(fault):
    instrument = scpi.SimulatedMultimeter(SpringPlant(), "hp-34401a")
    meter = meters.Multimeter(SimulatedPort(instrument, SimulatedClock()))
    if fault not in ("identity", "cut"):
        meter.identify()
    instrument.fault = fault
    with pytest.raises(DeviceFault):
        meter.resistance(wires=2)
    assert instrument.heard[1:] == [] or fault != "identity"
