"""Connections to devices: serial lines, VISA, HTTP, and simulators in this process that answer the same bytes.

A simulator is asked in turns: it is given the bytes that it receives and the time, and gives the bytes that it has sent
by then. Only the waiting for an answer lets a simulated clock pass, so that no thread is needed.
"""

import http.client
import urllib.parse
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, Protocol

from sensorgen.core.errors import BadInput, SensorgenError, library
from sensorgen.measure.lab.devices import Clock, DeviceFault, RealClock
from sensorgen.measure.virtual.plant import Simulator

_BLOCK = 4096  # bytes: over TCP pyserial only knows that some wait
_POLL_S = 0.005  # of the serial driver; half a period of the fastest control loop


class Port(Protocol):
    """A line to one device.

    Attributes
    ----------
    address : str
        For messages.
    """

    address: str

    def write(self, data: bytes) -> None:
        """Send; :class:`DeviceFault` if the line is cut."""

    def read_until(self, end: bytes, timeout_s: float) -> bytes:
        """Received bytes up to and including an end, fewer when the time is over [s]."""

    def close(self) -> None:
        """Give the line back; never raises."""


@contextmanager
def faults(address: str, what: str = "connection to {} failed", *also: type[Exception]) -> Iterator[None]:
    """Translate errors of a connection to DeviceFault."""
    kinds: tuple[type[Exception], ...] = (OSError, ValueError, TypeError, http.client.HTTPException, *also)
    try:
        yield
    except SensorgenError:
        raise
    except kinds as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise DeviceFault(f"{what.format(address)}: {reason:.200}; check address, cable and power") from None


class SerialPort:
    """A serial line of this computer: 8 data bits, no parity, one stop bit, no flow control; or one over TCP.

    Parameters
    ----------
    address : str
        ``/dev/ttyUSB0``, ``COM3``, ``socket://10.0.0.5:7000``.
    baud : int
        Bits per second.

    Raises
    ------
    NotInstalled
        pyserial is missing.
    DeviceFault
        There is no such line, or another program has it.
    """

    def __init__(self, address: str, baud: int) -> None:
        serial = library("serial", "serial lines need pyserial: pip install 'sensorgen[lab]'")
        self.address = address
        self._received, self._least = bytearray(), _BLOCK if "://" in address else 1
        with faults(address):
            self._line = serial.serial_for_url(address, baud, timeout=_POLL_S, write_timeout=1.0, exclusive=True)

    def write(self, data: bytes) -> None:
        """Send; DeviceFault if the line is cut."""
        with faults(self.address):
            self._line.write(data)

    def read_until(self, end: bytes, timeout_s: float) -> bytes:
        """Received bytes up to and including an end, fewer when the time is over [s]."""
        clock = RealClock()
        until = clock.now() + timeout_s
        with faults(self.address):
            while end not in self._received:
                waiting = self._line.in_waiting
                if not waiting and clock.now() >= until:
                    break
                self._received += self._line.read(max(waiting, self._least))
        return _taken(self._received, end)

    def close(self) -> None:
        """Give the line back."""
        with suppress(OSError):
            self._line.close()


class SimulatedPort:
    """A line to a simulator in this process.

    Parameters
    ----------
    simulator : Simulator
        The other end.
    clock : Clock
        Passes while an answer is waited for.
    step_s : float
        How often the simulator is asked while waiting [s].
    """

    def __init__(self, simulator: Simulator, clock: Clock, *, step_s: float = 1e-3) -> None:
        self.address = f"simulated {type(simulator).__name__}"
        self._simulator, self._clock, self._step_s = simulator, clock, step_s
        self._received = bytearray()

    def write(self, data: bytes) -> None:
        """Send; DeviceFault if the line is cut."""
        with faults(self.address):
            self._received += self._simulator.exchange(data, self._clock.now())

    def read_until(self, end: bytes, timeout_s: float) -> bytes:
        """Received bytes up to and including an end, fewer when the time is over [s]."""
        until = self._clock.now() + timeout_s
        while end not in self._received:
            with faults(self.address):
                self._received += self._simulator.exchange(b"", self._clock.now())
            if end in self._received or self._clock.now() >= until:
                break
            self._clock.wait_until(min(until, self._clock.now() + self._step_s))
        return _taken(self._received, end)

    def close(self) -> None:
        """Nothing to give back."""


def _taken(received: bytearray, end: bytes) -> bytes:
    """Take the first message out of the bytes that came; all of them where none is complete."""
    at = received.find(end)
    length = len(received) if at < 0 else at + len(end)
    message = bytes(received[:length])
    del received[:length]
    return message


class VisaPort:
    """An instrument at a VISA address, which ends its answers with a line feed.

    Parameters
    ----------
    address : str
        As ``GPIB0::22::INSTR``, ``ASRL/dev/ttyUSB0::INSTR``, ``TCPIP::10.0.0.5::INSTR``,
        ``TCPIP::10.0.0.5::5025::SOCKET``.

    Raises
    ------
    NotInstalled
        PyVISA is missing.
    DeviceFault
        No instrument is there.
    """

    def __init__(self, address: str) -> None:
        pyvisa = library("pyvisa", "VISA needs PyVISA: pip install 'sensorgen[lab]'")
        self.address, self._visa = address, pyvisa
        self._failures = partial(faults, repr(address), "no answer from an instrument at {}", pyvisa.errors.Error)
        self._resources: list[Any] = []
        try:
            with self._failures():
                self._resource = self._connect()
        except BaseException:
            self.close()
            raise

    def write(self, data: bytes) -> None:
        """Send."""
        with self._failures():
            self._resource.write_raw(data)

    def read_until(self, end: bytes, timeout_s: float) -> bytes:
        """One answer; DeviceFault if none comes in time [s]."""
        with self._failures(), warnings.catch_warnings(action="ignore"):  # PyVISA's; drivers refuse a truncated answer
            self._resource.timeout = timeout_s * 1e3
            return bytes(self._resource.read_raw()).rstrip(b"\r\n") + end

    def close(self) -> None:
        """Give the instrument back."""
        while self._resources:
            with suppress(Exception):  # whatever a VISA makes of a device that is gone
                self._resources.pop().close()

    def _connect(self) -> Any:
        self._resources.append(manager := self._visa.ResourceManager())
        self._resources.append(resource := manager.open_resource(self.address))
        if not isinstance(resource, self._visa.resources.MessageBasedResource):
            raise ValueError("not the address of an instrument that takes commands, as GPIB0::22::INSTR")
        resource.read_termination = resource.write_termination = "\n"
        return resource


class HttpPort:
    """A device in the local network.

    Parameters
    ----------
    address : str
        ``http://10.0.0.5``, with a port if it is not 80.

    Raises
    ------
    BadInput
        The address is none of HTTP.
    """

    def __init__(self, address: str) -> None:
        parts = urllib.parse.urlsplit(address)
        if parts.scheme != "http" or not parts.netloc:
            raise BadInput(f"address {address!r:.80}; expected one of HTTP, as http://10.0.0.5")
        self.address, self._host = address, parts.netloc

    def get(self, path: str, timeout_s: float) -> tuple[int, bytes]:
        """Status and content of one GET request; the firmware closes the connection after each."""
        with faults(self.address):
            line = http.client.HTTPConnection(self._host, timeout=timeout_s)
            try:
                line.request("GET", path)
                answer = line.getresponse()
                return answer.status, answer.read(1_000_000)
            finally:
                line.close()
