"""Devices that send frames: given lots, and a small walked array."""

import numpy as np

from sensorgen.measure.lab.frame_stream import checked
from sensorgen.measure.virtual.array import FrameSender
from sensorgen.prediction.array.readout import ArrayReadout

HERTZ = 10e3


class Device:
    """Device that sends the next lot whenever it is asked for more."""

    def __init__(self, lots):
        self.lots = list(lots)

    def exchange(self, data, time_s):
        return self.lots.pop(0) if self.lots else b""


def lines(count):
    return [checked(f"{k},{k / 100},1,2,3,4,5,6") for k in range(count)]


def walker(rate_hz, form="capacitance"):
    """Two rows and three columns of 1 to 6 pF, which rise by a tenth and fall."""
    rest = 2j * np.pi * HERTZ * np.arange(1, 7).reshape(2, 3) * 1e-12
    step = rest * (1 + 0.1 * np.sin(np.linspace(0, np.pi, 100)))[:, None, None]
    return FrameSender(rest, step, ArrayReadout(), rate_hz, form)
