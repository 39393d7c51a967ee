"""Drivers of instruments with SCPI: questions of one line each, identity and errors."""

import re

from sensorgen.measure.lab.devices import DeviceFault, Identity
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
        said = self._query("*IDN?")
        for _ in range(_STALE):
            if not _READING.fullmatch(said):
                break
            said = self._answer("*IDN?")
        return said

    def _check(self, name: str) -> None:
        """Refuse an error of the instrument."""
        status = self._query("SYST:ERR?")
        if not re.match(r"[-+]?0\b", status):
            raise DeviceFault(f"{name} at {self._port.address} reports {status!r:.100}")

    def _answer(self, command: str) -> str:
        line = self._port.read_until(b"\n", self._timeout_s)
        if not line.endswith(b"\n"):
            said = f" to its end: {line!r:.60}" if line else ""
            raise DeviceFault(f"{self._port.address} does not answer {command}{said}; check cable and power")
        return line.decode("utf-8", "replace").strip()


def identity(model: str, said: str) -> Identity:
    """Identity by an answer to ``*IDN?``."""
    serial, firmware = (*[field.strip() for field in said.split(",")][2:4], "", "")[:2]
    return Identity(model, serial, firmware)
