"""Simulated instruments with SCPI on a plant: impedance analysers 4284A and E4980A, multimeters 34401A and 2000.

Written from their manuals, but without the drivers.
"""

import numpy as np

from sensorgen.measure.virtual.plant import Plant, Simulator

IDENTITIES = {
    "hp-4284a": "HEWLETT-PACKARD,4284A,2940J01234,REV01.20",
    "keysight-e4980a": "Keysight Technologies,E4980A,MY46412345,A.06.16",
    "hp-34401a": "HEWLETT-PACKARD,34401A,0,10-5-2",
    "keithley-2000": "KEITHLEY INSTRUMENTS INC.,MODEL 2000,1234567,A20  /A02",
}
_HIGHEST_HZ = {"hp-4284a": 1e6, "keysight-e4980a": 2e6}
_TIMES = {"SHOR": (0.03, 24), "MED": (0.18, 22), "LONG": (0.82, 22)}  # constant [s] and periods: manual of the 4284A


class _Instrument(Simulator):
    """Part that all instruments share.

    Attributes
    ----------
    fault : str
        Planted fault, or "". ``stuck``: settings are not taken; ``error``: an entry in its list of
        errors; ``overload``: what it measures is beyond its range.
    heard : list of bytes
        Every line that has come.
    """

    def __init__(self, plant: Plant, model: str) -> None:
        super().__init__(plant)
        self._model = model
        self._later: list[tuple[float, str]] = []
        self._errors: list[str] = []

    def _step(self) -> None:
        while self._later and self._later[0][0] <= self._now_s:  # in the order of the questions
            self._out += self._spoilt(self._later.pop(0)[1].encode() + b"\n")

    def _take(self, line: bytes) -> None:
        """One line: a common command, or one of this instrument."""
        command, _, value = line.decode("ascii", "replace").strip().partition(" ")
        command, time_s = command.upper(), self._now_s
        if command == "*IDN?":
            answer = "TEKTRONIX,TDS 2000,0,1.0" if self.fault == "identity" else IDENTITIES[self._model]
            self._later.append((time_s, answer))
        elif command == "*CLS":
            self._errors.clear()
        elif command == "SYST:ERR?":
            planted = ['-350,"Queue overflow"'] if self.fault == "error" else []
            self._later.append((time_s, (planted or self._errors or ['+0,"No error"'])[0]))
            self._errors[:1] = []
        elif not self._own(command, value, time_s):
            self._errors.append('-113,"Undefined header"')

    def _own(self, command: str, value: str, time_s: float, /) -> bool:
        """Test whether this instrument has a command."""
        raise NotImplementedError


class SimulatedLcrMeter(_Instrument):
    """A 4284A or an E4980A: measures what the plant has when it is triggered, and answers when its time is over."""

    def __init__(self, plant: Plant, model: str = "hp-4284a") -> None:
        super().__init__(plant, model)
        self.level_v = 1.0
        self._frequency_hz = 1000.0
        self._function, self._aperture, self._source = "CPD", "MED", "INT"
        self._ready_s = np.inf
        self._data = ""

    def _own(self, command: str, value: str, time_s: float, /) -> bool:
        if command in ("FETC?", "FETC:IMP?"):
            if self._data:
                self._later.append((max(time_s, self._ready_s), self._data))
            else:
                self._errors.append('-230,"Data corrupt or stale"')
        elif command == "FREQ?":
            self._later.append((time_s, f"{self._frequency_hz:.5E}"))
        elif command in ("TRIG", "*TRG"):
            self._trigger(time_s)
        elif command == "ABOR":
            self._data = ""
        else:
            return self._set(command, value)
        return True

    def _set(self, command: str, value: str) -> bool:
        """One setting."""
        if command == "FREQ":
            if not 20 <= float(value) <= _HIGHEST_HZ[self._model]:
                self._errors.append('-222,"Data out of range"')
            elif self.fault != "stuck":
                self._frequency_hz = float(value)
        elif command == "VOLT":
            self.level_v = 0.005 if value == "MIN" else float(value)
        elif command == "FUNC:IMP":
            self._function = value
        elif command == "APER":
            self._aperture = value.partition(",")[0]
        elif command == "TRIG:SOUR":
            self._source = value
        return command in ("FREQ", "VOLT", "FUNC:IMP", "APER", "TRIG:SOUR", "INIT:CONT")

    def _trigger(self, time_s: float) -> None:
        """Measure once; ignored unless the bus is the source."""
        if self._source != "BUS":
            self._errors.append('-211,"Trigger ignored"')
            return
        z = complex(self._plant.impedance(np.array([self._frequency_hz]))[0])
        pair = {"RX": (z.real, z.imag), "ZTR": (abs(z), float(np.angle(z)))}.get(self._function)
        constant, periods = _TIMES[self._aperture]
        self._ready_s = time_s + constant + periods / self._frequency_hz
        if pair is None or self.fault == "overload" or not np.isfinite(z):
            self._data = "+9.90000E+37,+9.90000E+37,+1"
        else:
            self._data = f"{pair[0]:+.5E},{pair[1]:+.5E},+0"


class SimulatedMultimeter(_Instrument):
    """A 34401A or a Keithley 2000."""

    def _own(self, command: str, _: str, time_s: float, /) -> bool:
        wires = {"MEAS:RES?": 2, "MEAS:FRES?": 4}.get(command)
        if wires:
            ohm = self._plant.resistance(wires=wires)
            beyond = self.fault == "overload" or not ohm < 100e6
            self._later.append((time_s + 0.5, "+9.90000000E+37" if beyond else f"{ohm:+.8E}"))
        return wires is not None or command == "SYST:REM"
