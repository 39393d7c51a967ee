"""Meters of PyMeasure: what they answer and what its own classes make of it, by PyMeasure's test protocol."""

import subprocess
import sys
import warnings

import numpy as np
import pytest

from sensorgen.core.errors import BadInput, OutOfRange, UnknownName
from sensorgen.measure.lab import catalogue, rigs
from sensorgen.measure.lab.devices import DeviceFault, SimulatedClock, WrongDevice
from sensorgen.measure.lab.experiment import Device

pytest.importorskip("pymeasure", reason="PyMeasure is not installed: pip install 'sensorgen[pymeasure]'")
from pymeasure.adapters import ProtocolAdapter
from pymeasure.test import expected_protocol

from sensorgen.measure.lab import pymeasure_meters

NO_ERROR = ("SYST:ERR?", '+0,"No error"')
HP = ("*IDN?", "HEWLETT-PACKARD,34401A,0,10-5-2")
KEITHLEY = ("*IDN?", "KEITHLEY INSTRUMENTS INC.,MODEL 2000,1234567,A20  /A02")
E4980 = ("*IDN?", "Keysight Technologies,E4980A,MY46412345,A.06.16")
OLD = ("*IDN?", "HEWLETT-PACKARD,4284A,2940J01234,REV01.20")
READ = "+6.50000000E+02"
METERS = {
    ("HP34401A", 2): [HP, ('FUNC "RES"', None), ("READ?", READ), NO_ERROR],
    ("HP34401A", 4): [HP, ('FUNC "FRES"', None), ("READ?", READ), NO_ERROR],
    ("Keithley2000", 2): [KEITHLEY, (":CONF:RES", None), (":READ?", READ), NO_ERROR],
    ("Keithley2000", 4): [KEITHLEY, (":CONF:FRES", None), (":READ?", READ), NO_ERROR],
    ("Agilent34410A", 2): [
        ("*IDN?", "Agilent Technologies,34410A,MY47000001,2.35"), ("MEAS:RES? DEF,DEF", READ), NO_ERROR,
    ],
    ("Agilent34450A", 4): [
        ("*IDN?", "Keysight Technologies,34450A,MY1,1"), NO_ERROR, (":configure:FRES", None), (":READ?", READ),
        NO_ERROR,
    ],
    ("HP3478A", 4): [("F4", "+6.50000E+2")],
}  # fmt: skip


def driver(name, pairs):
    """Driver at PyMeasure's test protocol, and that protocol."""
    adapter = ProtocolAdapter(pairs)
    return catalogue.opened(f"pymeasure:{name}", adapter, {}, SimulatedClock()), adapter


def spoken(adapter):
    """True where all of a protocol was spoken."""
    return adapter._index == len(adapter.comm_pairs)


@pytest.mark.parametrize(("name", "wires"), METERS)
def test_a_multimeter_reads_what_its_class_reads(name, wires):
    pairs = METERS[name, wires]
    meter, adapter = driver(name, pairs)
    assert float(meter.resistance(wires=wires)) == 650.0
    assert spoken(adapter)
    assert meter.name.startswith(name)


def test_the_readings_are_those_of_the_class():
    """One protocol, spoken by PyMeasure's class alone, then through the driver."""
    kind = pymeasure_meters.roles()["pymeasure:AgilentE4980"][1]
    sent = [
        ("FORM ASC", None), ("FUNCtion:IMPedance:TYPE RX", None), ("TRIG:SOUR BUS", None), (":VOLT:LEV 0.707107", None),
        (":FREQ:CW 1000", None), (":FREQ:CW 1000", None), ("TRIG:IMM", None),
        (":FETCH?", "+8.12500E+02,-1.59155E+05,+0"),
    ]  # fmt: skip
    with warnings.catch_warnings(action="ignore"), expected_protocol(kind, sent) as alone:
        alone.mode, alone.trigger_source, alone.ac_voltage = "RX", "BUS", 0.5**0.5
        alone.frequency = 1000.0
        alone.frequency = 1000.0
        alone.write("TRIG:IMM")
        value = complex(*alone.impedance)
    meter, adapter = driver("AgilentE4980", [E4980, *sent])
    assert meter.identify().serial == "MY46412345"
    meter.start(np.array([1000.0]), 1.0)
    assert meter.read().impedance_ohm.tolist() == [[value]] == [[812.5 - 159155j]]
    assert spoken(adapter)


def test_frequencies_of_an_lcr_meter_come_one_after_the_other():
    pairs = [
        OLD, ("FUNC:IMP RX", None), ("TRIG:SOUR BUS", None), ("VOLT:LEV 0.353553", None), ("FREQ 1000", None),
        ("FREQ 100000", None), ("FREQ 1000", None), ("*TRG", "+1.00000E+03,-1.59155E+05,+0"), ("FREQ 100000", None),
        ("*TRG", "+9.90000E+37,+9.90000E+37,+1"), ("TRIG:SOUR HOLD", None), ("VOLT:LEV 0.005", None),
    ]  # fmt: skip
    meter, adapter = driver("Agilent4284A", pairs)
    meter.start(np.array([1e3, 1e5]), 0.5)
    first, second = meter.read(), meter.read()
    assert first.impedance_ohm[0, 0] == 1000 - 159155j
    assert np.isnan(first.impedance_ohm[0, 1])
    assert np.isnan(second.impedance_ohm).all()
    assert (first.clipped[0], second.clipped[0]) == (False, True)
    meter.stop()
    assert spoken(adapter)


OTHERS = {
    "AgilentE4980": "TEKTRONIX,TDS 4980,C1,1.0", "Keithley2000": "TEKTRONIX,TDS 2000,0,1.0",
    "HP34401A": "HEWLETT-PACKARD,4284A,34401,1", "Agilent34450A": "KEITHLEY,MODEL 34450,1,1",
}  # fmt: skip


@pytest.mark.parametrize(("name", "said"), OTHERS.items())
def test_nothing_but_the_question_goes_to_another_instrument(name, said):
    """PyMeasure's AgilentE4980 and Agilent34450A send something when they are made."""
    meter, adapter = driver(name, [("*IDN?", said)])
    with pytest.raises(WrongDevice, match=rf"is '{said}'; expected {name}"):
        meter.identify()
    assert spoken(adapter)


def test_a_relative_of_a_class_is_named_in_its_settings():
    pairs = [("*IDN?", "Agilent Technologies,34411A,MY4,2.35"), ("MEAS:FRES? DEF,DEF", READ), NO_ERROR]
    found = catalogue.opened("pymeasure:Agilent34410A", ProtocolAdapter(pairs), {"model": "34411A"}, SimulatedClock())
    assert found.resistance(wires=4) == READ


def test_what_a_meter_reports_is_a_fault_and_an_overload_none():
    meter, _ = driver("HP34401A", [*METERS["HP34401A", 2][:3], ("SYST:ERR?", '-350,"Queue overflow"')])
    with pytest.raises(DeviceFault, match=r"reports \[-350.0, .*Queue overflow"):
        meter.resistance(wires=2)
    meter, _ = driver("HP34401A", [*METERS["HP34401A", 2][:2], ("READ?", "+9.90000000E+37"), NO_ERROR])
    assert meter.resistance(wires=2) == "+9.90000000E+37"
    meter, _ = driver("HP34401A", [*METERS["HP34401A", 2][:2], ("READ?", "about 650")])
    with pytest.raises(DeviceFault, match=r"HP34401A at .*check address, cable and power"):
        meter.resistance(wires=2)


def test_what_a_class_cannot_is_refused():
    meter, _ = driver("KeithleyDAQ6510", [("*IDN?", "KEITHLEY INSTRUMENTS,MODEL DAQ6510,04,1.7.3")])
    with pytest.raises(OutOfRange, match="reads with 2 leads only; expected --wires 2"):
        meter.resistance(wires=4)
    pairs = [OLD, ("FUNC:IMP RX", None), ("TRIG:SOUR BUS", None)]
    meter, _ = driver("Agilent4284A", pairs)
    with pytest.raises(OutOfRange, match=r"Agilent4284A of PyMeasure: .*3.5.* not in range .*0.005"):
        meter.start(np.array([1e3]), 5.0)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("pymeasure:Agilent4284", "unknown meter of PyMeasure.*; did you mean 'pymeasure:Agilent4284A'"),
        ("pymeasure:Keithley2400", "unknown meter of PyMeasure.*Known: pymeasure:Agilent34410A, .*KeithleyDMM6500"),
    ],
)  # fmt: skip
def test_a_wrong_name_is_refused_with_the_nearest(name, message):
    """A Keithley 2400 is a source: no meter."""
    with pytest.raises(UnknownName, match=message):
        catalogue.opened(name, "GPIB0::1::INSTR", {}, SimulatedClock())


def test_roles_are_kept():
    with pytest.raises(BadInput, match="'pymeasure:HP34401A' is of the role meter; expected one of"):
        rigs.check({"impedance": Device(kind="pymeasure:HP34401A")})
    rigs.check({"impedance": Device(kind="pymeasure:AgilentE4980")})


def test_an_address_where_nothing_is():
    with pytest.raises(DeviceFault, match="Keithley2000 at GPIB0::9::INSTR: "):
        catalogue.opened("pymeasure:Keithley2000", "GPIB0::9::INSTR", {}, SimulatedClock()).identify()


def test_commands_without_such_a_meter_do_not_import_it():
    code = (
        "import sys\nfrom sensorgen.measure.lab import catalogue, rigs\n"
        "catalogue.names(); [catalogue.kind(name) for name in catalogue.names()]\n"
        "print([name for name in sys.modules if name.startswith('pymeasure')])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
