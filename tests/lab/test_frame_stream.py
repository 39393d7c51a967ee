"""Frames as lines of text: the protocol by hand, lost bytes, wrong sizes, silence; on a pseudo-terminal and TCP."""

import numpy as np
import pytest
import serving
from served_frames import HERTZ, Device, lines, walker

from sensorgen.measure.lab import catalogue
from sensorgen.measure.lab.devices import DeviceFault, RealClock, SimulatedClock, WrongDevice
from sensorgen.measure.lab.frame_stream import FrameForm, FrameStream, checked, unchecked
from sensorgen.measure.lab.port import SimulatedPort

HEADER = b"sensorgen-frames 1 rows=2 columns=3 form=capacitance unit=pF frequency_hz=10000*2AF6AEB7\n"


def stream(*sent):
    """Driver of a device that sends lots, one after the other."""
    clock = SimulatedClock()
    driver = FrameStream(SimulatedPort(Device(sent), clock), clock)
    driver.identify()
    return driver, clock


def test_lines_are_those_of_the_protocol():
    """CRC-32 of 123456789 is CBF43926 in every catalogue of checksums."""
    assert checked("123456789") == b"123456789*CBF43926\n"
    assert unchecked(b"123456789*cbf43926\r\n") == "123456789"
    assert unchecked(b"123456780*CBF43926\n") is None
    assert unchecked(b"123456789") is None
    assert FrameForm(2, 3).header() == HEADER
    assert FrameForm.of("sensorgen-frames 1 rows=2 columns=3 form=siemens unit=pF frequency_hz=1e4") is None


def test_values_missing_and_saturated():
    driver, _ = stream(HEADER, checked("0,0.5,1,2,3,,!,6"))
    lot = driver.read()
    assert lot.time_s.tolist() == [0.5]
    farad = lot.siemens.imag[0] / (2 * np.pi * 1e4)
    assert np.nan_to_num(farad, nan=-1).ravel() == pytest.approx([1e-12, 2e-12, 3e-12, -1, -1, 6e-12])
    assert (lot.saturated, lot.lost, lot.damaged) == (1, 0, 0)
    complex_ = FrameForm(1, 1, "siemens", "n")
    driver, _ = stream(complex_.header(), checked("0,0,1.5,-2"))
    assert driver.read().siemens[0, 0, 0] == pytest.approx(1.5e-9 - 2e-9j)


def test_lost_bytes_cost_the_line_they_are_in():
    whole = lines(10)
    cut = [*whole[:3], whole[3][:9] + whole[4][15:], *whole[5:]]  # the end of one line and the begin of the next
    driver, _ = stream(HEADER, b"".join(cut[:4]), b"".join(cut[4:])[:37], b"".join(cut[4:])[37:])
    lots = [driver.read() for _ in range(3)]
    times = np.concatenate([lot.time_s for lot in lots])
    assert times == pytest.approx([0.0, 0.01, 0.02, 0.05, 0.06, 0.07, 0.08, 0.09])
    assert sum(lot.damaged for lot in lots) == 1
    assert sum(lot.lost for lot in lots) == 2


def test_a_device_that_begins_anew_goes_on():
    driver, _ = stream(HEADER, lines(3)[2], b"".join([HEADER, *lines(2)]))
    times = np.concatenate([driver.read().time_s for _ in range(2)])
    assert (np.diff(times) > 0).all()
    assert len(times) == 3


@pytest.mark.parametrize(
    ("sent", "words"),
    [
        (checked("7,0.1,1,2,3,4,5"), "'7' has 5 values; expected 6, a frame of 2 x 3"),
        (checked("7,0.1,1,2,3,4,5,x"), "frame '7': could not convert"),
        (checked("7,nan,1,2,3,4,5,6"), "frame '7': its time is 'nan'; expected seconds"),
        (FrameForm(3, 2).header(), "the array is now rows=3 columns=2 .* expected rows=2 columns=3 .*: begin anew"),
    ],
)
def test_a_whole_frame_that_is_wrong_ends_it(sent, words):
    driver, _ = stream(HEADER, sent)
    with pytest.raises(DeviceFault, match=words):
        driver.read()


def test_silence_and_noise_are_faults():
    driver, clock = stream(HEADER)
    driver.read()
    clock.wait_until(clock.now() + 2.5)
    with pytest.raises(DeviceFault, match="nothing for 2 s; check cable"):
        driver.read()
    driver, clock = stream(HEADER, b"\xff\x00" * 50 + b"\n")
    clock.wait_until(clock.now() + 2.5)
    with pytest.raises(DeviceFault, match="1 damaged lines for 2 s"):
        driver.read()
    with pytest.raises(WrongDevice, match="1 lines, none of them a header"):
        stream(b"hello\n")
    with pytest.raises(WrongDevice, match="sends nothing"):
        stream()
    driver, clock = stream(HEADER, b"x" * 200_000)  # without an end: not kept
    assert driver.read().damaged == 1
    assert driver._rest == b""


def test_a_simulated_device_sends_what_is_due_and_shows_faults():
    clock = SimulatedClock()
    sender = walker(100.0)
    driver = FrameStream(SimulatedPort(sender, clock), clock)
    driver.identify()
    clock.wait_until(0.5)
    lot = driver.read()
    assert lot.siemens.shape == (50, 2, 3)
    assert lot.time_s == pytest.approx(np.arange(50) / 100)
    sender.fault = "damaged"
    clock.wait_until(1.0)
    lot = driver.read()
    assert (lot.damaged, len(lot.time_s)) == (50, 0)
    sender.fault = "cut"
    with pytest.raises(DeviceFault, match="cable out"):
        driver.read()


def received(driver, count):
    clock, times = RealClock(), []
    until = clock.now() + 60
    while sum(map(len, times)) < count and clock.now() < until:
        times.append(driver.read().time_s)
        clock.wait_until(clock.now() + 0.005)
    return np.concatenate(times)


def test_real_lines():
    """On a pseudo-terminal by pyserial, and by TCP, both by their kind."""
    clock = RealClock()
    with serving.pseudo_terminal(walker(50.0), clock) as path:
        driver = catalogue.opened("frame-stream", path, {}, clock)
        assert driver.identify().model == "array of 2 x 3, capacitance"
        assert (driver.shape, driver.frequency_hz) == ((2, 3), HERTZ)
        assert len(received(driver, 10)) >= 10
        driver.close()
    with serving.tcp_server(walker(50.0, "siemens"), clock) as visa:
        host, port = visa.split("::")[1:3]
        driver = catalogue.opened("frame-stream", f"socket://{host}:{port}", {}, clock)
        assert driver.identify().model == "array of 2 x 3, siemens"
        assert len(received(driver, 10)) >= 10
    driver.close()
    for address in (f"socket://{host}:{port}", "socket://[", "nothing://a:1"):
        with pytest.raises(DeviceFault, match="check address"):
            catalogue.opened("frame-stream", address, {}, clock)
    assert catalogue.listed()["frame-stream"] == "array"
