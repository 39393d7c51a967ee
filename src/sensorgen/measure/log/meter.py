"""Read resistances from a bench multimeter through VISA: HP (Agilent, Keysight) 34401A and Keithley 2000.

Both use SCPI: ``MEAS:RES?`` with two leads, ``MEAS:FRES?`` with four; both send 9.9E37 for an overload.
"""

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Self

from sensorgen.core.errors import InstrumentFailed, MissingValue

TIMEOUT_S = 10.0  # an autoranging reading takes up to three
KNOWN = {"34401A": "HP 34401A", "MODEL 2000": "Keithley 2000"}
_QUERY = {2: "MEAS:RES?", 4: "MEAS:FRES?"}
_NUMBER = re.compile(r"[-+]?[0-9]+(\.[0-9]*)?(E[-+]?[0-9]{1,3})?", re.IGNORECASE)


class Meter:
    """A multimeter at a VISA address; use it in a ``with`` statement.

    Parameters
    ----------
    address : str
        VISA resource: ``GPIB0::22::INSTR``, ``ASRL/dev/ttyUSB0::INSTR``, ``TCPIP::10.0.0.5::INSTR``.

    Raises
    ------
    MissingValue
        PyVISA is not installed.
    InstrumentFailed
        No instrument replies, or another instrument does.
    """

    def __init__(self, address: str) -> None:
        try:
            import pyvisa
        except ImportError:
            raise MissingValue("--visa needs PyVISA: pip install 'sensorgen[bench]'") from None
        self.address, self._visa = address, pyvisa
        self._resources: list[Any] = []
        try:
            with self._failures():
                self._port = self._connect()
                if address.upper().startswith("ASRL"):
                    self._port.write("SYST:REM")  # over RS-232 the 34401A accepts no other command before this
            reply = self._query("*IDN?")
            fields = re.sub(r"\s*,\s*", ",", reply.upper())
            name = next((name for model, name in KNOWN.items() if f",{model}," in fields), "")
            if not name:
                raise InstrumentFailed(
                    f"{address} is {reply!r:.80}; expected {' or '.join(KNOWN.values())}: or type it with --y, --z"
                )
            self.name = f"{name} ({reply})"
            with self._failures():
                self._port.write("*CLS")  # errors from before are not ours
        except BaseException:
            self._close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._close()

    def resistance(self, *, wires: int) -> str:
        """One autoranged reading as the meter sends it, as ``+6.50000000E+02`` [ohm].

        Parameters
        ----------
        wires : int
            2, or 4 with sense leads.

        Raises
        ------
        InstrumentFailed
            No reply in time, a reply that is no number, or an error of the meter.
        """
        reply = self._query(_QUERY[wires])
        if not _NUMBER.fullmatch(reply):
            raise InstrumentFailed(f"{self.name} at {self.address} answers {reply!r:.60}; expected a resistance")
        status = self._query("SYST:ERR?")
        if not re.match(r"[-+]?0\b", status):
            raise InstrumentFailed(f"{self.name} at {self.address} reports {status!r:.100}")
        return reply

    def _connect(self) -> Any:
        self._resources.append(manager := self._visa.ResourceManager())
        self._resources.append(port := manager.open_resource(self.address))
        if not isinstance(port, self._visa.resources.MessageBasedResource):
            raise ValueError("not the address of an instrument that takes commands, as GPIB0::22::INSTR")
        port.read_termination = port.write_termination = "\n"
        port.timeout = TIMEOUT_S * 1e3
        return port

    def _query(self, command: str) -> str:
        with (
            self._failures(),
            warnings.catch_warnings(action="ignore"),
        ):  # PyVISA's; a truncated reply is refused anyway
            return str(self._port.query(command)).strip()

    @contextmanager
    def _failures(self) -> Iterator[None]:
        """Translate errors of PyVISA to InstrumentFailed."""
        try:
            yield
        except (self._visa.errors.Error, OSError, ValueError) as error:
            reason = " ".join(str(error).split())
            raise InstrumentFailed(
                f"no answer from a meter at {self.address!r}: {reason:.200}; check address, cable and power"
            ) from None

    def _close(self) -> None:
        while self._resources:
            self._resources.pop().close()
