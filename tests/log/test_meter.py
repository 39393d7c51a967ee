"""Multimeters through VISA, simulated: what they say is logged in their own words, or told why not."""

import sys
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest

from sensorgen.core.errors import NotInstalled
from sensorgen.measure.lab import meters
from sensorgen.measure.lab.devices import DeviceFault
from sensorgen.measure.lab.port import VisaPort
from sensorgen.measure.log import Log

pytest.importorskip("pyvisa_sim")
HP, KEITHLEY = "GPIB0::22::INSTR", "GPIB0::16::INSTR"
FAILS = {
    "GPIB0::5::INSTR": r"is 'TEKTRONIX,TDS 2000,C34401A,1.0'; expected HP 34401A or Keithley 2000",
    "GPIB0::9::INSTR": "no answer from an instrument at 'GPIB0::9::INSTR': VI_ERROR_TMO .*Timeout",
    "GPIB0::17::INSTR": r"reports '-350,\"Queue overflow\"'",
    "GPIB0::18::INSTR": "answers 'about 650'; expected a resistance",
    "GPIB0::19::INSTR": "answers '.6.5000'; expected a resistance",
    "nonsense": "no answer from an instrument at 'nonsense'",
    "": "no answer from an instrument at ''",
}


@pytest.fixture(autouse=True)
def _simulated(monkeypatch):
    monkeypatch.setenv("PYVISA_LIBRARY", f"{Path(__file__).with_name('meters.yaml')}@sim")
    monkeypatch.setattr(meters, "TIMEOUT_S", 0.2)


def opened(address):
    """A meter, to be closed."""
    return closing(meters.Multimeter(VisaPort(address)))


@pytest.mark.parametrize(
    ("address", "wires", "said", "name"),
    [
        (HP, 4, "+6.48100000E+02", "HP 34401A (HEWLETT-PACKARD,34401A,0,10-5-2)"),
        ("ASRL1::INSTR", 2, "+6.50000000E+02", "HP 34401A (HEWLETT-PACKARD,34401A,0,10-5-2)"),
        (KEITHLEY, 4, "+1.29800000E+03", "Keithley 2000 (KEITHLEY INSTRUMENTS INC.,MODEL 2000,1234567,A20  /A02)"),
    ],
)
def test_both_meters_with_two_and_four_leads(address, wires, said, name):
    with opened(address) as found:
        assert (found.resistance(wires=wires), found.name) == (said, name)


@pytest.mark.parametrize(("address", "message"), FAILS.items())
def test_what_is_no_meter_or_does_not_answer_is_told(run, address, message, path):
    import re

    said = run("multimeter", "23 triX", "--visa", address or " ", "--axis", "y")
    assert said.code == 2
    if address:
        assert re.search(message, said.line), said.line
    assert not path.exists()


def test_a_reading_is_logged_with_the_meter_s_words_and_name(run, path):
    said = run("multimeter", "23 triX 2", "--visa", KEITHLEY, "--axis", "y", "--wires", "4", "--baked")
    assert (said.code, said.err) == (0, "")
    assert "Y 1.298 kohm, written '+1.29800000E+03'" in said.words
    with Log(path) as log:
        (row,) = log.readings()
    assert (row.y_ohm, row.z_ohm, row.y_words, row.source) == ((1298.0,), (), "+1.29800000E+03", KEITHLEY)
    assert row.instrument.startswith("Keithley 2000 (")
    assert row.baked is True
    assert not any("blank" in doubt for doubt in row.doubts)


def test_an_overload_is_infinite_and_no_number(run, path):
    said = run("multimeter", "23 triX", "--visa", "GPIB0::23::INSTR", "--axis", "z").words
    assert "Z OL, written '+9.90000000E+37'" in said
    with Log(path) as log:
        assert log.readings()[0].z_ohm == (float("inf"),)


def test_leads_are_moved_by_a_person_between_y_and_z(run, path, monkeypatch):
    asked = []
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("click.pause", lambda text, err: asked.append(text))
    assert run("multimeter", "23 triX", "--visa", HP).code == 0
    assert asked == ["Leads to Y, then any key ...", "Leads to Z, then any key ..."]
    with Log(path) as log:
        assert (log.readings()[0].y_ohm, log.readings()[0].z_ohm) == ((650.0,), (650.0,))


def test_without_a_person_an_axis_is_needed_and_words_do_not_go_with_a_meter(run, path):
    assert "expected --axis y or --axis z" in run("multimeter", "23 triX", "--visa", HP).line
    assert "not both" in run("multimeter", "23 triX", "--visa", HP, "--y", "5").line
    assert "is no specimen's name" in run("multimeter", "23 trj", "--visa", "GPIB0::9::INSTR", "--axis", "y").line
    assert not path.exists()


def test_without_pyvisa_it_is_named(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyvisa", None)
    with pytest.raises(NotInstalled, match=r"pip install 'sensorgen\[lab\]'"):
        VisaPort(HP)


def test_a_meter_that_fails_is_let_go(monkeypatch):
    with pytest.raises(DeviceFault), opened("GPIB0::18::INSTR") as found:
        found.resistance(wires=2)
    with opened(HP) as found:
        assert found.resistance(wires=2)


def spoken(orders):
    """A VISA of one instrument, which writes down every order in turn."""

    class Port:
        def write_raw(self, order):
            orders.append(order.decode().strip())

        def read_raw(self):
            return {"*IDN?": b"HEWLETT-PACKARD,34401A,0,1\n", "SYST:ERR?": b"+0\n"}.get(orders[-1], b"+1.0E+03\n")

        def close(self):
            orders.append("closed")

    class Manager(Port):
        def open_resource(self, address):
            return Port()

    errors, resources = SimpleNamespace(Error=OSError), SimpleNamespace(MessageBasedResource=Port)
    return SimpleNamespace(ResourceManager=Manager, errors=errors, resources=resources)


@pytest.mark.parametrize(("address", "first"), [(HP, []), ("ASRL/dev/ttyUSB0::INSTR", ["SYST:REM"])])
def test_orders_come_in_the_order_that_the_manuals_ask_for(monkeypatch, address, first):
    orders = []
    monkeypatch.setitem(sys.modules, "pyvisa", spoken(orders))
    with opened(address) as found:
        found.resistance(wires=2)
    assert orders == [*first, "*IDN?", "*CLS", "MEAS:RES?", "SYST:ERR?", "closed", "closed"]


def test_a_meter_of_pymeasure_by_its_name(run, path):
    pytest.importorskip("pymeasure", reason="PyMeasure is not installed: pip install 'sensorgen[pymeasure]'")
    words = ["add", "23 triX 2", "--visa", "GPIB0::26::INSTR", "--axis", "y", "--wires", "4"]
    said = run(*words, "--meter", "pymeasure:Keithley2000", "--baked")
    assert (said.code, said.err) == (0, "")
    assert "Y 1.298 kohm, written '+1.29800000E+03'" in said.words
    with Log(path) as log:
        (row,) = log.readings()
    assert row.instrument == "Keithley2000 (KEITHLEY INSTRUMENTS INC.,MODEL 2000,1234567,A20  /A02)"
    assert "did you mean 'pymeasure:Keithley2000'" in run(*words, "--meter", "pymeasure:Keithley200").line


def test_a_meter_of_a_kind(run, path):
    words = ["add", "23 triX 2", "--visa", KEITHLEY, "--axis", "y"]
    assert "Y 1.3 kohm" in run(*words, "--meter", "keithley-2000").words
    assert "expected HP 34401A" in run(*words, "--meter", "hp-34401a").line
    assert (
        "is of the role impedance; expected one of hp-34401a, keithley-2000" in run(*words, "--meter", "hp-4284a").line
    )
    assert "--meter hp-34401a without --visa" in run("add", "23 triX 2", "--y", "5", "--meter", "hp-34401a").line
