"""Frames of an array as lines of text over a serial line or TCP: the protocol, and its driver.

Every line ends with a line feed. Behind its last ``*`` stands a checksum of what is before: CRC-32 as of zlib, eight
hexadecimal digits. ::

    sensorgen-frames 1 rows=2 columns=3 form=capacitance unit=pF frequency_hz=10000*2AF6AEB7
    17,1.700,5.61,5.57,,!,5.60,5.58*DF7A7EA3

The header names the array. A device sends it when it is asked by a line ``sensorgen-frames?``; one that does not listen
sends it every ten seconds. A frame has its counter, its time [s] and the readings, row by row: capacitances, or with
``form=siemens`` real and imaginary part of each; nothing where one is missing, ``!`` where it is saturated. Units are F
or S, with or without m, u, n, p, f or a. Bytes that are lost cost the line in which they were: the counter says how
many frames.
"""

import re
import zlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import inf, isfinite, isnan, nan

import numpy as np

from sensorgen.core.arrays import Complex
from sensorgen.core.records import Strict
from sensorgen.measure.lab.devices import Clock, DeviceFault, FrameLot, Identity, WrongDevice
from sensorgen.measure.lab.port import Port

QUESTION = b"sensorgen-frames?\n"
_HEADER = re.compile(
    r"sensorgen-frames 1 rows=(\d{1,4}) columns=(\d{1,4}) form=(capacitance|siemens) unit=([munpfa]?)([FS]) "
    r"frequency_hz=([0-9.e+]{1,20})"
)
_PREFIXES = {"": 1.0, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12, "f": 1e-15, "a": 1e-18}
_UNITS = {"capacitance": "F", "siemens": "S"}
_SATURATED = "!"
_CHARACTERS = 32  # of a value, at most
_ASKED_S, _SILENT_S = 12.0, 2.0  # until a header, and between two frames
_AT_ONCE = 64  # lines of one call
_GAP_S = 1e-3  # before the first frame of a device that has begun anew


class StreamSettings(Strict):
    """Bits per second of a serial line; USB devices without a converter ignore it."""

    baud: int = 2_000_000


@dataclass(frozen=True)
class FrameForm:
    """Form of the frames.

    Attributes
    ----------
    rows, columns : int
        Of the array.
    form : str
        "capacitance" or "siemens".
    prefix : str
        Of the unit.
    frequency_hz : float
        Of the readings [Hz].
    """

    rows: int
    columns: int
    form: str = "capacitance"
    prefix: str = "p"
    frequency_hz: float = 10e3

    @classmethod
    def of(cls, text: str) -> "FrameForm | None":
        """Form by a header without its checksum; None of any other line."""
        match = _HEADER.fullmatch(text)
        if match is None or _UNITS[match[3]] != match[5]:
            return None
        with suppress(ValueError):
            if 0 < (frequency_hz := float(match[6])) < inf:
                return cls(int(match[1]), int(match[2]), match[3], match[4], frequency_hz)
        return None

    @property
    def count(self) -> int:
        """Values of a frame."""
        return self.rows * self.columns * (2 if self.form == "siemens" else 1)

    def header(self) -> bytes:
        """The header's line."""
        unit = self.prefix + _UNITS[self.form]
        return checked(
            f"sensorgen-frames 1 rows={self.rows} columns={self.columns} form={self.form} unit={unit} "
            f"frequency_hz={self.frequency_hz:.12g}"
        )

    def frame(self, counter: int, time_s: float, siemens: Complex) -> bytes:
        """Line of a frame: nothing where a reading is nan, ``!`` where it is infinite."""
        if self.form == "siemens":
            values = np.stack([siemens.real, siemens.imag], -1)
        else:
            values = siemens.imag / (2 * np.pi * self.frequency_hz)
        numbers = (values / _PREFIXES[self.prefix]).ravel().tolist()
        words = (f"{v:.7g}" if isfinite(v) else "" if isnan(v) else _SATURATED for v in numbers)
        return checked(",".join([str(counter), f"{time_s:.6f}", *words]))

    def siemens(self, words: Sequence[str]) -> Complex:
        """Readings by the words of a frame, (m, n) [S]; nan where one is missing or saturated."""
        values = _PREFIXES[self.prefix] * np.array([nan if word in ("", _SATURATED) else float(word) for word in words])
        if self.form == "siemens":
            siemens = values[0::2] + 1j * values[1::2]
        else:
            siemens = np.full(values.shape, complex(nan, nan))
            siemens.imag = 2 * np.pi * self.frequency_hz * values
        return siemens.reshape(self.rows, self.columns)


def checked(text: str) -> bytes:
    r"""A line with its checksum.

    >>> checked("1,0.010000,5.61")
    b'1,0.010000,5.61*320CD69B\n'
    """
    return f"{text}*{zlib.crc32(text.encode()):08X}\n".encode()


def unchecked(line: bytes) -> str | None:
    """Text of a line whose checksum is right; None of any other."""
    text, star, crc = line.rstrip(b"\r\n").rpartition(b"*")
    return text.decode("ascii", "replace") if star and crc.upper() == b"%08X" % zlib.crc32(text) else None


class FrameStream:
    """Driver of a device with that protocol.

    Parameters
    ----------
    port : Port
        Serial line, TCP, or a simulator.
    clock : Clock
        By which silence is noticed.

    Attributes
    ----------
    shape : (int, int)
        Rows and columns, once identified.
    frequency_hz : float
        Of the readings, once identified [Hz].
    """

    def __init__(self, port: Port, clock: Clock) -> None:
        self.shape, self.frequency_hz = (0, 0), nan
        self._port, self._clock, self._form = port, clock, FrameForm(0, 0)
        self._rest, self._longest = b"", 1 << 16
        self._counter, self._time_s, self._offset_s, self._heard_s = -1, nan, 0.0, clock.now()

    def identify(self) -> Identity:
        """Ask for the header, and wait for it; WrongDevice where none comes."""
        self._port.write(QUESTION)
        until, lines, form = self._clock.now() + _ASKED_S, 0, None
        while form is None and (left := until - self._clock.now()) > 0:
            for line in self._whole(self._port.read_until(b"\n", left)):
                lines, form = lines + 1, FrameForm.of(unchecked(line) or "")
        if form is None:
            received = f"{lines} lines, none of them a header with its checksum" if lines else "nothing"
            raise WrongDevice(
                f"{self._port.address} sends {received}; expected 'sensorgen-frames 1 rows=...': check address, baud "
                "and protocol"
            )
        self._form, self.shape, self.frequency_hz = form, (form.rows, form.columns), form.frequency_hz
        self._longest, self._heard_s = form.count * _CHARACTERS + 100, self._clock.now()
        return Identity(f"array of {form.rows} x {form.columns}, {form.form}")

    def read(self) -> FrameLot:
        """Frames since the last call; none is an answer.

        Raises
        ------
        DeviceFault
            Nothing has come for two seconds, a whole frame has another number of values, or the array changes.
        """
        times, frames = list[float](), list[Complex]()
        lost = damaged = saturated = 0
        for _ in range(_AT_ONCE):
            if not (part := self._port.read_until(b"\n", 0.0)):
                break
            for line in self._whole(part):
                text = unchecked(line)
                if text is None:
                    damaged += 1
                    continue
                self._heard_s = self._clock.now()
                if (form := FrameForm.of(text)) == self._form:
                    continue
                if form:
                    new, old = (of.header().decode().partition("*")[0].partition(" 1 ")[2] for of in (form, self._form))
                    raise DeviceFault(f"{self._port.address}: the array is now {new}; expected {old}: begin anew")
                missing, siemens, clipped = self._frame(text.split(","))
                lost, saturated = lost + missing, saturated + clipped
                times.append(self._time_s)
                frames.append(siemens)
        if self._clock.now() - self._heard_s > _SILENT_S:
            heard = f"{damaged} damaged lines" if damaged else "nothing"
            raise DeviceFault(f"{self._port.address}: {heard} for {_SILENT_S:g} s; check cable, power and baud")
        return FrameLot(np.array(times), np.array(frames).reshape(-1, *self.shape), lost, damaged, saturated)

    def _frame(self, words: list[str]) -> tuple[int, Complex, int]:
        """Number of frames missing before one, its readings, and how many are saturated."""
        form = self._form
        if len(words) != form.count + 2:
            raise DeviceFault(
                f"{self._port.address}: {words[0]!r:.60} has {len(words) - 2} values; expected {form.count}, a frame "
                f"of {form.rows} x {form.columns} crossings"
            )
        try:
            counter, time_s = int(words[0]), float(words[1]) + self._offset_s
            siemens = form.siemens(words[2:])
            if not isfinite(time_s):
                raise ValueError(f"its time is {words[1]!r:.20}; expected seconds")
        except ValueError as error:
            raise DeviceFault(f"{self._port.address}: frame {words[0]!r:.20}: {error}") from None
        missing = counter - self._counter - 1 if self._counter >= 0 else 0
        if time_s <= self._time_s:  # the device has begun anew: its frames go on where they were
            missing, shift = 0, self._time_s - time_s + _GAP_S
            self._offset_s, time_s = self._offset_s + shift, time_s + shift
        self._counter, self._time_s = counter, time_s
        return max(missing, 0), siemens, words.count(_SATURATED)

    def _whole(self, part: bytes) -> list[bytes]:
        """Lines that are complete; what is longer than any is dropped as damaged."""
        *lines, self._rest = (self._rest + part).split(b"\n")
        if len(self._rest) > self._longest:
            lines, self._rest = [*lines, self._rest[:8]], b""
        return lines

    def close(self) -> None:
        """Give the line back."""
        self._port.close()
