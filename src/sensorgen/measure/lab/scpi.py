"""Questions to instruments with SCPI, one line each."""

import re

from sensorgen.measure.lab.devices import DeviceFault
from sensorgen.measure.lab.port import Port

_READING = re.compile(r'[-+0-9.,E\s]*|[-+]?[0-9]+,".*"')  # numbers, or an entry of the list of errors
_STALE = 4


def write(port: Port, command: str) -> None:
    """Send a command."""
    port.write(command.encode() + b"\n")


def query(port: Port, command: str, timeout_s: float) -> str:
    """Answer to a command, without its end.

    Raises
    ------
    DeviceFault
        None in time [s], or one that does not end.
    """
    write(port, command)
    return _answer(port, command, timeout_s)


def identity(port: Port, timeout_s: float) -> str:
    """Answer to ``*IDN?``, after readings that a program which has died did not fetch."""
    said = query(port, "*IDN?", timeout_s)
    for _ in range(_STALE):
        if not _READING.fullmatch(said):
            break
        said = _answer(port, "*IDN?", timeout_s)
    return said


def _answer(port: Port, command: str, timeout_s: float) -> str:
    line = port.read_until(b"\n", timeout_s)
    if not line.endswith(b"\n"):
        said = f" to its end: {line!r:.60}" if line else ""
        raise DeviceFault(f"{port.address} does not answer {command}{said}; check cable and power")
    return line.decode("utf-8", "replace").strip()
