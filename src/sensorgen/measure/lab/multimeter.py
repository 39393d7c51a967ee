"""Resistances from a bench multimeter: HP (Agilent, Keysight) 34401A and Keithley 2000.

Both use SCPI: ``MEAS:RES?`` with two leads, ``MEAS:FRES?`` with four; both send 9.9E37 for an overload. PyMeasure's
classes send other commands, some before ``*IDN?``, and give numbers, not the meter's words, which the log keeps.
"""

import re
from collections.abc import Mapping

from sensorgen.measure.lab import scpi
from sensorgen.measure.lab.devices import DeviceFault, Identity, WrongDevice
from sensorgen.measure.lab.port import Port

TIMEOUT_S = 10.0  # an autoranging reading takes up to three
KNOWN = {"34401A": "HP 34401A", "MODEL 2000": "Keithley 2000"}
_QUERY = {2: "MEAS:RES?", 4: "MEAS:FRES?"}
_NUMBER = re.compile(r"[-+]?[0-9]+(\.[0-9]*)?(E[-+]?[0-9]{1,3})?", re.IGNORECASE)


class Multimeter(scpi.ScpiInstrument):
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
        said = self._asked()
        fields = re.sub(r"\s*,\s*", ",", said)
        name = next((name for model, name in self._models.items() if f",{model}," in fields.upper()), "")
        if not name:
            expected = " or ".join(self._models.values())
            raise WrongDevice(f"{self._port.address} is {said!r:.80}; expected {expected}: or type it with --y, --z")
        self.name = f"{name} ({said})"
        self._write("*CLS")
        return scpi.identity(name, said)

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
