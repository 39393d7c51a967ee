"""A simulated module ``libtiepie``, with the functions that the driver uses and one device.

It plays what is loaded into its generator: the tones are found in the waveform.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.measure.lab.devices import Clock
from sensorgen.measure.virtual.handyscope import BITS, INPUT_LSB, RANGES_V, RATE_HZ, SERIAL, WINDOW_S, Analyser, Windows
from sensorgen.measure.virtual.plant import Plant

KEPT = 100  # windows that the device keeps before it loses samples


class Gone(Exception):
    """Any error of the simulated library."""


@dataclass
class _Channel:
    enabled: bool = False
    coupling: int = 0
    range: float = 8.0
    ranges: tuple[float, ...] = RANGES_V


class _Part:
    """Part that oscilloscope and generator share."""

    def __init__(self, owner: "SimulatedScope") -> None:
        self._owner = owner

    @property
    def is_removed(self) -> bool:
        return self._owner.fault == "unplugged"

    def _present(self) -> None:
        if self.is_removed:
            raise Gone("Object gone")


class _Generator(_Part):
    signal_type = mode = frequency_mode = 0
    output_value_max, data_length_max = 12.0, 262_144  # samples: the smallest model's
    offset = frequency = amplitude = 0.0
    output_enable = False

    def __init__(self, owner: "SimulatedScope") -> None:
        super().__init__(owner)
        self._started = False
        self._data = np.zeros(0, np.float32)

    def set_data(self, data: Any) -> None:
        self._present()
        self._data = np.asarray(data, np.float32)

    def start(self) -> None:
        self._present()
        self._started = True

    def stop(self) -> None:
        self._present()
        self._started = False

    @property
    def is_running(self) -> bool:
        self._present()
        return self._started and self._owner.fault != "generator off"

    def tones(self) -> tuple[Real, Complex]:
        """Frequencies [Hz] and phasors [V] of what it plays."""
        if not (self._started and self.output_enable and len(self._data)):
            return np.zeros(0), np.zeros(0, complex)
        spectrum = 2 / len(self._data) * np.fft.rfft(self._data)
        at = np.flatnonzero(np.abs(spectrum) > 1e-4 * np.abs(spectrum).max())
        return at * self.frequency / len(self._data), spectrum[at] * self.amplitude


class _Oscilloscope(_Part):
    measure_mode = 0
    resolutions = (8, 12, BITS)
    resolution = 8
    sample_rate = 0.0
    record_length = 0

    def __init__(self, owner: "SimulatedScope") -> None:
        super().__init__(owner)
        self.channels = (_Channel(), _Channel())
        self._kept: deque[np.ndarray[Any, Any]] = deque()
        self._windows: Windows | None = None

    def start(self) -> None:
        self._present()
        self._tones, volts = self._owner.generator.tones()
        self._voltage = volts
        angles = 2 * np.pi * np.outer(self._tones, np.arange(round(WINDOW_S * RATE_HZ)) / RATE_HZ)
        self._waves = np.concatenate([np.cos(angles), -np.sin(angles)]).astype(np.float32)
        self._excitation = self._wave(volts)
        self._kept.clear()
        self._overflow = False
        owner = self._owner
        self._windows = Windows(owner.plant, owner.clock, owner.analyser)

    def stop(self) -> None:
        self._present()
        self._windows = None

    @property
    def is_data_overflow(self) -> bool:
        self._present()
        return self._overflow or self._owner.fault == "data loss"

    @property
    def is_data_ready(self) -> bool:
        self._present()
        if self._windows and self._owner.fault not in ("hung", "data loss"):
            for _ in range(min(self._windows.due(), 2 * KEPT)):
                self._kept.append(self._sampled(self._windows))
        if len(self._kept) > KEPT:
            self._overflow = True
            self._kept.clear()
        return len(self._kept) * WINDOW_S * RATE_HZ >= max(self.record_length, 1)

    def get_data_numpy(self) -> np.ndarray[Any, Any]:
        self._present()
        return np.concatenate(
            [self._kept.popleft() for _ in range(round(self.record_length / WINDOW_S / RATE_HZ))], axis=1
        )

    def _wave(self, phasors: Complex) -> np.ndarray[Any, Any]:
        """Samples of a window."""
        parts = np.concatenate([phasors.real, phasors.imag]).astype(np.float32)
        return np.asarray(np.einsum("k,kn->n", parts, self._waves))  # not matmul, which would begin threads

    def _sampled(self, windows: Windows) -> np.ndarray[Any, Any]:
        """Both channels in the next window."""
        owner, analyser = self._owner, self._owner.analyser
        impedance = windows.impedance(self._tones)
        both = np.stack(
            [self._excitation, self._wave(analyser.transimpedance(self._tones) * self._voltage / impedance)]
        )
        steps = np.array([2 * channel.range / 2**self.resolution for channel in self.channels], np.float32)
        noise = np.hypot(INPUT_LSB * steps, [0.0, analyser.output_noise_v()]).astype(np.float32)
        if owner.fault in ("silent", "generator off"):
            both *= 0
        both[1] *= 1e4 if owner.fault == "clipped" else 1
        both += noise[:, None] * owner.noise.standard_normal(both.shape, np.float32)
        codes = np.clip(np.round(both / steps[:, None]), -(2 ** (self.resolution - 1)), 2 ** (self.resolution - 1) - 1)
        both = (codes * steps[:, None]).astype(np.float32)
        return np.full_like(both, np.nan) if owner.fault == "nan" else both


class _Item:
    """The device in the list."""

    def __init__(self, owner: "SimulatedScope") -> None:
        wrong = owner.fault == "wrong device"
        self._owner, self.serial_number = owner, SERIAL
        self.name, self.product_id = ("Handyscope HS3-100", 13) if wrong else ("Handyscope HS5-540XM", 22)

    def can_open(self, _kind: int) -> bool:
        return self._owner.fault != "in use"

    def open_oscilloscope(self) -> _Oscilloscope:
        self._owner.opened = True
        return self._owner.oscilloscope

    def open_generator(self) -> _Generator:
        self._owner.opened = True
        return self._owner.generator


class _Devices:
    """The list of devices."""

    def __init__(self, owner: "SimulatedScope") -> None:
        self._owner = owner

    def update(self) -> None:
        """Nothing to look for."""

    def __iter__(self) -> Iterator[_Item]:
        return iter([] if self._owner.fault == "unplugged" else [_Item(self._owner)])


@dataclass
class SimulatedScope:
    """The part of the module ``libtiepie`` that the driver uses, with one device, serial number 28734.

    A second of samples is kept for the reader; then samples are lost, as the device reports.

    Attributes
    ----------
    plant : Plant
        The specimen at the device's leads.
    clock : Clock
        Of the run.
    analyser : Analyser
        Bridge, noise and clock.
    fault : str
        "", or one of ``FAULTS``; it acts while it is set.
    opened : bool
        Whether the device was opened.
    """

    plant: Plant
    clock: Clock
    analyser: Analyser = field(default_factory=Analyser)
    fault: str = ""
    opened: bool = False

    DEVICETYPE_OSCILLOSCOPE, DEVICETYPE_GENERATOR = 1, 2
    ST_ARBITRARY, FM_SAMPLERATE, GM_CONTINUOUS, MM_STREAM, CK_DCV = 32, 2, 1, 1, 1

    def __post_init__(self) -> None:
        self.noise = np.random.default_rng(self.analyser.seed)
        self.device_list, self.library = _Devices(self), SimpleNamespace(version="simulated")
        self.exceptions = SimpleNamespace(LibTiePieException=Gone, ObjectGoneError=Gone)
        self.oscilloscope, self.generator = _Oscilloscope(self), _Generator(self)
