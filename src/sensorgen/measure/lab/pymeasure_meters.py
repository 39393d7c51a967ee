"""LCR meters and multimeters of PyMeasure by the names of their classes, as ``pymeasure:Keithley2000``.

Each value is the class's own: of an LCR meter its trigger's answer in the mode RX, of a multimeter its reading in the
mode of two or four leads, without a fixed range. ``*IDN?`` comes before whatever a class sends when it is made. Meters
older than SCPI cannot be asked what they are.
"""

import math
import pkgutil
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache, partial
from importlib import import_module
from typing import Any

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import OutOfRange, UnknownName, library
from sensorgen.core.records import Line, Strict
from sensorgen.measure.lab import meters
from sensorgen.measure.lab.devices import PYMEASURE, Clock, DeviceFault, Identity, Readings, Role, WrongDevice
from sensorgen.measure.lab.port import faults

_HP = ("agilent", "hewlett-packard", "hp", "keysight")
_FUNCTION = {2: "RES", 4: "FRES"}
_READS = {2: ("measure_R2W", "resistance"), 4: ("measure_R4W", "resistance_4w")}
_OVERLOAD_OHM = 9.9e9  # 9.9999E9 of the 3478A, 9.9E37 of SCPI; beyond the range of each
_LOWEST_V = 0.005  # rms


class Settings(Strict):
    """Settings of a meter: its model in the answer to ``*IDN?``; the number in the name of its class if not given."""

    model: Line = ""


@cache
def roles() -> dict[str, tuple[Role, Any]]:
    """Role and class of each of PyMeasure's LCR meters and multimeters by its name.

    Raises
    ------
    NotInstalled
        PyMeasure is missing.
    """
    instruments = library("pymeasure.instruments", "meters of PyMeasure need it: pip install 'sensorgen[pymeasure]'")
    by_name: dict[str, tuple[Role, Any]] = {}
    for package in pkgutil.iter_modules(instruments.__path__, f"{instruments.__name__}."):
        with suppress(Exception), warnings.catch_warnings(action="ignore"):  # a maker whose own library is missing
            kinds = vars(import_module(package.name)).items()
            classes = ((name, kind) for name, kind in kinds if isinstance(kind, type))
            by_name |= {
                PYMEASURE + name: (as_what, kind)
                for name, kind in classes
                if issubclass(kind, instruments.Instrument) and (as_what := _role(dir(kind)))
            }
    return dict(sorted(by_name.items()))


def _role(names: list[str]) -> Role | None:
    """Role of a class by the names in it; of none that somebody has to switch a source on for."""
    if {"frequency", "ac_voltage", "trigger_source"} <= {*names}:
        return "impedance"
    sources = any(name.startswith(("source", "enable_source")) for name in names)
    return None if sources or not {*_READS[2]} & {*names} else "meter"


def _way(kind: Any, wires: int) -> tuple[dict[str, str], str]:
    """Settings and name of a class's reading by 2 leads or 4; "" where it has none."""
    functions = getattr(kind, "FUNCTIONS", getattr(kind, "MODES", {}))
    for name, word in functions.items():
        if word == _FUNCTION[wires]:
            function = hasattr(kind, "function_")
            return {"function_" if function else "mode": name}, "reading" if function else "resistance"
    return {}, next((name for name in _READS[wires] if hasattr(kind, name)), "")


def meter(name: str) -> tuple[Role, Callable[[Any, Settings, Clock], "PyMeasureMultimeter | PyMeasureLcrMeter"]]:
    """Role of a meter, and its driver by address, settings and clock; it connects when it is asked what it is.

    Raises
    ------
    UnknownName
        PyMeasure has no such meter.
    """
    if name not in roles():
        raise UnknownName("meter of PyMeasure", name, roles())
    role, kind = roles()[name]
    return role, partial(PyMeasureLcrMeter if role == "impedance" else PyMeasureMultimeter, kind)


class _Meter:
    """Part that both have: connection, identity, faults.

    Parameters
    ----------
    kind : type
        Class of PyMeasure.
    address : str or Adapter
        VISA resource.
    settings : Settings
        Of this meter.
    clock : Clock
        Of the run.

    Attributes
    ----------
    name : str
        Model and full answer to ``*IDN?``, once identified.
    """

    def __init__(self, kind: Any, address: Any, settings: Settings, clock: Clock) -> None:
        self.name = ""
        self._kind, self._address, self._settings, self._clock = kind, address, settings, clock
        self._open = ExitStack()
        self._meter: Any = None

    def identify(self) -> Identity:
        """Connect, and ask ``*IDN?`` where the class is one of SCPI.

        Raises
        ------
        WrongDevice
            Another instrument answers.
        DeviceFault
            None is there.
        """
        model = self._kind.__name__

        def write(meter: Any, command: str, **how: Any) -> None:
            if not self.name:
                self._ask(meter)
            self._kind.write(meter, command, **how)

        with self._faults():
            self._meter = type(model, (self._kind,), {"write": write})(self._address)
            if not self.name:
                self._ask(self._meter)
        return meters.identity(model, self.name.rstrip(")"))

    def _ask(self, meter: Any) -> None:
        """Ask a meter that was sent nothing yet."""
        model = self._kind.__name__
        self._open.callback(meter.adapter.close)
        if not self._scpi():
            self.name = model
            return
        self._kind.write(meter, "*IDN?")
        answer = str(meter.read()).strip()
        if not self._is(answer):
            raise WrongDevice(f"{self._address} is {answer!r:.80}; expected {model}, or name yours in settings.model")
        self.name = f"{model} ({answer})"

    def _scpi(self) -> bool:
        from pymeasure.instruments import SCPIMixin

        return issubclass(self._kind, SCPIMixin)

    def _is(self, answer: str) -> bool:
        """Test whether an answer to ``*IDN?`` is that of the class: its maker, and the number in its name."""
        maker = self._kind.__module__.split(".")[2]
        number = self._settings.model or re.sub(r"\D*", "", self._kind.__name__, count=1)
        return answer.lower().startswith(_HP if maker in _HP else maker) and number in "".join(answer.split(",")[1:2])

    def close(self) -> None:
        """Give the connection back."""
        with suppress(Exception):  # whatever a VISA makes of a device that is gone
            self._open.close()

    @contextmanager
    def _faults(self) -> Iterator[None]:
        """Translate errors of PyMeasure, PyVISA or the VISA library, each of many kinds, to DeviceFault."""
        where = f"{self._kind.__name__} at {self._address}"
        with warnings.catch_warnings(action="ignore"), faults(where, "{}", Exception):
            yield


class PyMeasureMultimeter(_Meter):
    """A multimeter; a :class:`sensorgen.measure.lab.devices.Meter`."""

    def resistance(self, *, wires: int) -> str:
        """One reading, as ``+6.50000000E+02`` [ohm]; an overload as 9.9E37.

        Raises
        ------
        OutOfRange
            A class without readings by four leads.
        DeviceFault
            No answer, none that is a number, or an error of the meter.
        """
        if self._meter is None:
            self.identify()
        kind, meter = self._kind, self._meter
        settings, name = _way(kind, wires)
        if not name:
            raise OutOfRange(f"{kind.__name__} of PyMeasure reads with 2 leads only; expected --wires 2")
        with self._faults():
            for setting, value in settings.items():
                setattr(meter, setting, value)
            if not settings and hasattr(kind, "measure_resistance"):
                meter.measure_resistance()
            ohm = float(getattr(meter, name))
            error = meter.next_error if self._scpi() else [0]
        if math.isnan(ohm) or int(error[0]):
            raise DeviceFault(f"{self.name} at {self._address} answers {ohm:g} and reports {error!r:.100}")
        return f"{ohm:+.8E}" if abs(ohm) < _OVERLOAD_OHM else "+9.90000000E+37"


class PyMeasureLcrMeter(_Meter):
    """An LCR meter, one frequency after the other; a :class:`sensorgen.measure.lab.devices.ImpedanceMeter`."""

    def start(self, tones_hz: Real, voltage_v: float) -> None:
        """Begin to measure at (m,) frequencies with an amplitude, the rms level times the root of 2 [Hz], [V].

        Raises
        ------
        OutOfRange
            A frequency or level that the class refuses.
        DeviceFault
            No answer.
        """
        if self._meter is None:
            self.identify()
        self._tones_hz, self._next = np.asarray(tones_hz, float).ravel(), 0
        with self._faults():
            setattr(self._meter, "impedance_mode" if hasattr(self._kind, "impedance_mode") else "mode", "RX")
            self._meter.trigger_source = "BUS"
            try:
                self._meter.ac_voltage = voltage_v / math.sqrt(2)
                for hz in self._tones_hz.tolist():
                    self._meter.frequency = hz
            except ValueError as error:
                raise OutOfRange(f"{self._kind.__name__} of PyMeasure: {error}") from None

    def read(self) -> Readings:
        """One row, which is waited for, with nan at the other frequencies.

        Raises
        ------
        DeviceFault
            No answer, or none with two numbers.
        """
        begin, k = self._clock.now(), self._next
        with self._faults():
            self._meter.frequency = float(self._tones_hz[k])
            if hasattr(self._kind, "trigger"):
                resistance, reactance, *status = self._meter.trigger()
            else:
                self._meter.write("TRIG:IMM")
                resistance, reactance, *status = self._meter.impedance
        good = not any(status[:1]) and max(abs(resistance), abs(reactance)) < _OVERLOAD_OHM
        value, middle = complex(resistance, reactance) if good else None, (begin + self._clock.now()) / 2
        self._next = (k + 1) % len(self._tones_hz)
        return Readings.of_tone(middle, k, len(self._tones_hz), value, clipped=not good)

    def stop(self) -> None:
        """End the measurement, with the level at its lowest: it has no switch."""
        with self._faults():
            self._meter.trigger_source = "HOLD"
            self._meter.ac_voltage = _LOWEST_V
