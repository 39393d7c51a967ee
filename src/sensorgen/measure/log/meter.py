"""Resistances from a bench multimeter through VISA: HP (Agilent, Keysight) 34401A and Keithley 2000.

Both speak SCPI: ``MEAS:RES?`` with two leads, ``MEAS:FRES?`` with four, and both send 9.9E37 for an overload.
"""

import re
import warnings
from types import TracebackType
from typing import Any, Self

from sensorgen.core.errors import InstrumentFailed, MissingValue

TIMEOUT_S = 10.0  # an autoranging reading takes up to three
KNOWN = {"34401A": "HP 34401A", "MODEL 2000": "Keithley 2000"}
_ASK = {2: "MEAS:RES?", 4: "MEAS:FRES?"}
_NUMBER = re.compile(r"[-+]?[0-9]+(\.[0-9]*)?(E[-+]?[0-9]{1,3})?", re.IGNORECASE)


class Meter:
    """A multimeter at a VISA address, open from ``with`` to its end.

    Parameters
    ----------
    address : str
        As VISA has it: ``GPIB0::22::INSTR``, ``ASRL/dev/ttyUSB0::INSTR``, ``TCPIP::10.0.0.5::INSTR``.

    Raises
    ------
    MissingValue
        PyVISA is not installed.
    InstrumentFailed
        Nothing answers there, or it is another instrument.
    """

    def __init__(self, address: str) -> None:
        self.address, self._visa = address, _pyvisa()
        self._failures = (self._visa.errors.Error, OSError, ValueError)
        self._open: list[Any] = []
        try:
            self._port = self._connected()
            if address.upper().startswith("ASRL"):
                self._tell("SYST:REM")  # over RS-232 the 34401A takes no orders before this
            self.name = self._checked_name()
            self._tell("*CLS")  # whatever went wrong before is not ours
        except BaseException:
            self._close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._close()

    def resistance(self, *, wires: int) -> str:
        """One reading in the meter's own words, as ``+6.50000000E+02`` [ohm]; autoranged.

        Parameters
        ----------
        wires : int
            2, or 4 with sense leads.

        Raises
        ------
        InstrumentFailed
            No answer in time, an answer that is no number, or the meter reports an error.
        """
        answer = self._ask(_ASK[wires])
        if not _NUMBER.fullmatch(answer):
            raise InstrumentFailed(f"{self.name} at {self.address} answers {answer!r:.60}; expected a resistance")
        said = self._ask("SYST:ERR?")
        if not re.match(r"[-+]?0\b", said):
            raise InstrumentFailed(f"{self.name} at {self.address} reports {said!r:.100}")
        return answer

    def _connected(self) -> Any:
        try:
            self._open.append(manager := self._visa.ResourceManager())
            self._open.append(port := manager.open_resource(self.address))
            if not isinstance(port, self._visa.resources.MessageBasedResource):
                raise ValueError("not the address of an instrument that takes orders, as GPIB0::22::INSTR")
            port.read_termination = port.write_termination = "\n"
            port.timeout = TIMEOUT_S * 1e3
            return port
        except self._failures as error:
            raise self._failed(error) from None

    def _checked_name(self) -> str:
        said = self._ask("*IDN?")
        name = next((name for word, name in KNOWN.items() if f",{word}," in re.sub(r"\s*,\s*", ",", said.upper())), "")
        if not name:
            raise InstrumentFailed(
                f"{self.address} is {said!r:.80}; expected {' or '.join(KNOWN.values())}: or type it with --y, --z"
            )
        return f"{name} ({said})"

    def _ask(self, question: str) -> str:
        try:
            with warnings.catch_warnings(action="ignore"):  # of PyVISA: an answer that is cut short is refused anyway
                return str(self._port.query(question)).strip()
        except self._failures as error:
            raise self._failed(error) from None

    def _tell(self, order: str) -> None:
        try:
            self._port.write(order)
        except self._failures as error:
            raise self._failed(error) from None

    def _failed(self, error: Exception) -> InstrumentFailed:
        said = " ".join(str(error).split())
        return InstrumentFailed(
            f"no answer from a meter at {self.address!r}: {said:.200}; check address, cable and power"
        )

    def _close(self) -> None:
        while self._open:
            self._open.pop().close()


def _pyvisa() -> Any:
    try:
        import pyvisa
    except ImportError:
        raise MissingValue("--visa needs PyVISA: pip install 'sensorgen[bench]'") from None
    return pyvisa
