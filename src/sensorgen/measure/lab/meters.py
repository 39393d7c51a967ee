"""Drivers of meters with SCPI: multimeters HP 34401A and Keithley 2000, analysers HP 4284A and Keysight E4980A.

Multimeters: ``MEAS:RES?`` with two leads, ``MEAS:FRES?`` with four; both send 9.9E37 for an overload. PyMeasure's
classes send other commands, some before ``*IDN?``, and give numbers, not the meter's words, which the log keeps.

Analysers, one frequency after the other: ``FREQ``, ``TRIG``, and when the measurement's time is over ``FETC?``, which
answers resistance, reactance and a status (0 good; -1, 1, 2 no value, which reads 9.9E37; 3, 4 signal not as set).
``FREQ?`` says that the value is of this frequency, to which the nearest of the instrument's is set. Each frequency is a
row of its own, since a sweep of seven takes a second, in which a force changes. The level is an rms value for the
instrument. Sources: manual of the 4284A, chapters 7 to 9 (its times, without averaging); data sheet of the E4980A.

``FETC?`` is short for FETC:IMP?. The times of the E4980A are rounded up; one that takes longer answers later. Own code,
since the drivers of PyMeasure and QCoDeS block until a value is there, and each brings a framework.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import OutOfRange
from sensorgen.core.records import Strict
from sensorgen.measure.lab.devices import Clock, DeviceFault, Identity, Readings, WrongDevice
from sensorgen.measure.lab.port import Port

_READING = re.compile(r'[-+0-9.,E\s]*|[-+]?[0-9]+,".*"')  # numbers, or an entry of the list of errors
_STALE = 4


class ScpiInstrument:
    """Part that all drivers share.

    Parameters
    ----------
    port : Port
        VISA, or a simulator.
    timeout_s : float
        Of one answer [s].
    """

    def __init__(self, port: Port, timeout_s: float) -> None:
        self._port, self._timeout_s = port, timeout_s

    def close(self) -> None:
        """Give the connection back."""
        self._port.close()

    def _write(self, command: str) -> None:
        self._port.write(command.encode() + b"\n")

    def _query(self, command: str) -> str:
        """Answer to a command, without its end; DeviceFault if none comes in time, or one that does not end."""
        self._write(command)
        return self._answer(command)

    def _asked(self) -> str:
        """Answer to ``*IDN?``, after readings that a program which has died did not fetch."""
        answer = self._query("*IDN?")
        for _ in range(_STALE):
            if not _READING.fullmatch(answer):
                break
            answer = self._answer("*IDN?")
        return answer

    def _check(self, name: str) -> None:
        """Refuse an error of the instrument."""
        status = self._query("SYST:ERR?")
        if not re.match(r"[-+]?0\b", status):
            raise DeviceFault(f"{name} at {self._port.address} reports {status!r:.100}")

    def _answer(self, command: str) -> str:
        line = self._port.read_until(b"\n", self._timeout_s)
        if not line.endswith(b"\n"):
            so_far = f" to its end: {line!r:.60}" if line else ""
            raise DeviceFault(f"{self._port.address} does not answer {command}{so_far}; check cable and power")
        return line.decode("utf-8", "replace").strip()


def identity(model: str, answer: str) -> Identity:
    """Identity by an answer to ``*IDN?``."""
    serial, firmware = (*[field.strip() for field in answer.split(",")][2:4], "", "")[:2]
    return Identity(model, serial, firmware)


TIMEOUT_S = 10.0  # an autoranging reading takes up to three
KNOWN = {"34401A": "HP 34401A", "MODEL 2000": "Keithley 2000"}
_QUERY = {2: "MEAS:RES?", 4: "MEAS:FRES?"}
_NUMBER = re.compile(r"[-+]?[0-9]+(\.[0-9]*)?(E[-+]?[0-9]{1,3})?", re.IGNORECASE)


class Multimeter(ScpiInstrument):
    """Driver of a multimeter.

    Parameters
    ----------
    port : Port
        VISA, or a simulator.
    models : mapping of str to str
        Which are expected: model in the answer to ``*IDN?``, and its name.

    Attributes
    ----------
    name : str
        Name and full answer to ``*IDN?``, once identified.
    """

    def __init__(self, port: Port, models: Mapping[str, str] = KNOWN) -> None:
        super().__init__(port, TIMEOUT_S)
        self.name, self._models = "", models

    def identify(self) -> Identity:
        """Ask ``*IDN?``, and forget errors from before.

        Over RS-232, ``SYST:REM`` comes first: the 34401A accepts no other command before that.

        Raises
        ------
        WrongDevice
            Another instrument answers.
        """
        if self._port.address.upper().startswith("ASRL"):
            self._write("SYST:REM")
        answer = self._asked()
        fields = re.sub(r"\s*,\s*", ",", answer)
        name = next((name for model, name in self._models.items() if f",{model}," in fields.upper()), "")
        if not name:
            expected = " or ".join(self._models.values())
            raise WrongDevice(f"{self._port.address} is {answer!r:.80}; expected {expected}: or type it with --y, --z")
        self.name = f"{name} ({answer})"
        self._write("*CLS")
        return identity(name, answer)

    def resistance(self, *, wires: int) -> str:
        """One autoranged reading as the meter sends it, as ``+6.50000000E+02`` [ohm].

        Parameters
        ----------
        wires : int
            2, or 4 with sense leads.

        Raises
        ------
        DeviceFault
            No answer in time, an answer that is no number, or an error of the meter.
        """
        if not self.name:
            self.identify()
        reply = self._query(_QUERY[wires])
        if not _NUMBER.fullmatch(reply):
            raise DeviceFault(f"{self.name} at {self._port.address} answers {reply!r:.60}; expected a resistance")
        self._check(self.name)
        return reply


_ANSWER_S = 3.0
_OVERLOAD = 9e37
_GOOD, _SIGNAL = 0, (3, 4)  # measured, but the source was overloaded or its level not reached
_NEAR = 0.03  # relative, of a frequency; the 4284A has steps of up to 1.6 %
_NUMBERS = re.compile(r"\s*([-+][0-9.]+E[-+]?[0-9]+)\s*,\s*([-+][0-9.]+E[-+]?[0-9]+)\s*,\s*([-+]?[0-9])(?:\s*,.*)?")


@dataclass(frozen=True)
class Model:
    """Differences between the models.

    Attributes
    ----------
    name : str
        In the answer to ``*IDN?``.
    highest_hz : float
        Frequency [Hz]; the lowest is 20.
    times : dict of str to (float, float)
        Time of a measurement by aperture: a constant [s] and periods of the frequency.
    """

    name: str
    highest_hz: float
    times: dict[str, tuple[float, float]]


HP_4284A = Model("4284A", 1e6, {"SHOR": (0.04, 24), "MED": (0.19, 22), "LONG": (0.83, 22)})
E4980A = Model("E4980A", 2e6, {"SHOR": (0.016, 9), "MED": (0.1, 9), "LONG": (0.23, 8)})
LOWEST_HZ, LOWEST_V, HIGHEST_V = 20.0, 0.005, 2.0  # rms, without the option of 20 V


class LcrSettings(Strict):
    """Settings of the measurement.

    Attributes
    ----------
    aperture : str
        ``SHOR``, ``MED`` or ``LONG``.
    """

    aperture: Literal["SHOR", "MED", "LONG"] = "MED"


class LcrMeter(ScpiInstrument):
    """Driver of an analyser.

    Parameters
    ----------
    port : Port
        VISA, or a simulator.
    clock : Clock
        Of the run; the readings have its times.
    model : Model
        Which is expected.
    settings : Settings
        How it measures.
    """

    def __init__(self, port: Port, clock: Clock, model: Model, settings: LcrSettings | None = None) -> None:
        super().__init__(port, _ANSWER_S)
        self.model, self.settings, self._clock = model, settings or LcrSettings(), clock
        self._tones_hz: Real = np.empty(0)
        self._next = 0
        self._begin_s = math.nan
        self._known = False

    def identify(self) -> Identity:
        """Ask ``*IDN?``.

        Raises
        ------
        WrongDevice
            Another instrument answers.
        """
        answer = self._asked()
        fields = [field.strip() for field in answer.split(",")]
        if len(fields) < 2 or fields[1].upper() not in (self.model.name, f"{self.model.name}L"):
            raise WrongDevice(f"{self._port.address} is {answer!r:.80}; expected {self.model.name}")
        self._known = True
        return identity(f"{fields[0]} {fields[1]}", answer)

    def start(self, tones_hz: Real, voltage_v: float) -> None:
        """Begin to measure at (m,) frequencies with an amplitude, which is the rms level times the root of 2 [Hz], [V].

        Raises
        ------
        OutOfRange
            A frequency or level that the instrument does not have; nothing is sent then.
        DeviceFault
            It reports an error.
        """
        tones = np.asarray(tones_hz, float).ravel()
        if not (len(tones) and np.all((tones >= LOWEST_HZ) & (tones <= self.model.highest_hz))):
            raise OutOfRange(
                f"frequencies {', '.join(f'{f:g}' for f in tones)} Hz; expected {LOWEST_HZ:g} to"
                f" {self.model.highest_hz:g} Hz for {self.model.name}"
            )
        level = voltage_v / math.sqrt(2)
        if not LOWEST_V <= level <= HIGHEST_V:
            low, high = LOWEST_V * math.sqrt(2), HIGHEST_V * math.sqrt(2)
            raise OutOfRange(f"amplitude {voltage_v:g} V; expected {low:.3g} to {high:.3g} V for {self.model.name}")
        if not self._known:
            self.identify()
        for command in ("*CLS", "ABOR", "FUNC:IMP RX", f"VOLT {level:.4f}", f"APER {self.settings.aperture},1"):
            self._write(command)
        self._write("TRIG:SOUR BUS")
        self._write("INIT:CONT ON")
        self._check(self.model.name)
        self._tones_hz, self._next = tones, 0
        self._trigger()

    def read(self) -> Readings:
        """One row if a measurement has ended, with nan at the other frequencies.

        Raises
        ------
        DeviceFault
            No answer, or none with two numbers and a status, or a value of another frequency.
        """
        count = len(self._tones_hz)
        k = self._next
        if not count or self._clock.now() < self._begin_s + self._duration(k):
            return Readings.joined((), count)
        answer = self._query("FETC?")
        numbers = _NUMBERS.fullmatch(answer)
        if not numbers:
            raise DeviceFault(f"{self.model.name} at {self._port.address} answers {answer!r:.60}; expected R,X,STATUS")
        self._at(float(self._tones_hz[k]))
        resistance, reactance, status = float(numbers[1]), float(numbers[2]), int(numbers[3])
        sound = (status == _GOOD or status in _SIGNAL) and max(abs(resistance), abs(reactance)) < _OVERLOAD
        value = complex(resistance, reactance) if sound else None
        readings = Readings.of_tone(self._begin_s + self._duration(k) / 2, k, count, value, clipped=status != _GOOD)
        self._next = (k + 1) % count
        self._trigger()
        return readings

    def stop(self) -> None:
        """End the measurement, with the level at its lowest: it has no switch."""
        self._tones_hz = np.empty(0)
        self._write("ABOR")
        self._write("VOLT MIN")

    def _at(self, tone_hz: float) -> None:
        """Refuse a value of another frequency."""
        answer = self._query("FREQ?")
        try:
            off = abs(float(answer) / tone_hz - 1)
        except ValueError:
            off = math.inf
        if not off <= _NEAR:
            raise DeviceFault(
                f"{self.model.name} at {self._port.address} measures at {answer!r:.40} Hz, not {tone_hz:g} Hz"
            )

    def _trigger(self) -> None:
        self._write(f"FREQ {self._tones_hz[self._next]:.10g}")
        self._write("TRIG")
        self._begin_s = self._clock.now()

    def _duration(self, k: int) -> float:
        """Time of a measurement [s]."""
        constant, periods = self.model.times[self.settings.aperture]
        return constant + periods / float(self._tones_hz[k])
