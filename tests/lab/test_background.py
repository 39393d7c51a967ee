"""An impedance meter that is read beside the control loop."""

import threading
import time

import numpy as np
import pytest

from sensorgen.measure.lab import sessions
from sensorgen.measure.lab.devices import DeviceFault, Identity, Readings


class Slow:
    """Each answer waits until it is let go."""

    def __init__(self):
        self.go, self.calls, self.fault, self.asked = threading.Semaphore(0), [], None, False

    def identify(self):
        return Identity("slow")

    def start(self, tones_hz, voltage_v):
        self.calls.append("start")

    def read(self):
        self.asked = True
        self.go.acquire()
        if self.fault:
            raise self.fault
        self.calls.append("read")
        return Readings(np.array([1.0]), np.array([[2 + 1j, 3 + 1j]]), np.array([False]), 1)

    def stop(self):
        self.calls.append("stop")

    def close(self):
        self.calls.append("close")


def _until(condition):
    for _ in range(1000):
        if condition():
            return
        time.sleep(0.005)
    raise AssertionError


def test_a_read_never_waits_and_loses_nothing():
    meter = Slow()
    beside = sessions.Background(meter)
    beside.start(np.array([1e3, 1e4]), 1.0)
    assert beside.read().impedance_ohm.shape == (0, 2)
    for _ in range(3):
        meter.go.release()
    _until(lambda: meter.calls.count("read") == 3)
    _until(lambda: beside._found.qsize() == 3)
    found = beside.read()
    assert (len(found.time_s), found.impedance_ohm.shape, found.lost) == (3, (3, 2), 3)
    meter.go.release(10)
    beside.stop()
    beside.close()
    assert meter.calls[-2:] == ["stop", "close"]


def test_a_failure_of_the_meter_is_raised_in_the_loop():
    meter = Slow()
    meter.fault = DeviceFault("cable")
    beside = sessions.Background(meter)
    beside.start(np.array([1e3]), 1.0)
    meter.go.release()
    _until(lambda: beside._fault)
    with pytest.raises(DeviceFault, match="cable"):
        beside.read()
    beside.stop()


def test_a_meter_that_hangs_does_not_hold_up_the_end(monkeypatch):
    monkeypatch.setattr(sessions, "_LONGEST_S", 0.1)
    meter = Slow()
    beside = sessions.Background(meter)
    beside.start(np.array([1e3]), 1.0)
    _until(lambda: meter.asked)
    with pytest.raises(DeviceFault, match="no answer"):
        beside.stop()
    meter.go.release(10)
