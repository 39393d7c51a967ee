"""A simulated Handyscope with its bridge: phasors with the noise of its samples, in less time.

:class:`PhasorMeter` takes the place of driver and device. The driver itself is tested with a simulated ``libtiepie``,
which sees the specimen through the same :class:`Analyser`.

Noise is white: a current at the input of the bridge, half a step of each input's converter, and the converter's
rounding. A sum over N samples leaves of a white noise with deviation s the deviation s sqrt(2 / N) in each part of a
phasor.
"""

from dataclasses import dataclass

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.measure.lab.devices import Clock, DeviceFault, Identity, Readings, WrongDevice
from sensorgen.measure.lab.handyscope import Bridge
from sensorgen.measure.signal.waveform import multisine
from sensorgen.measure.virtual.plant import Plant

WINDOW_S, RATE_HZ, BITS = 0.01, 1e6, 14
RANGES_V = (0.2, 0.4, 0.8, 2.0, 4.0, 8.0, 20.0, 40.0, 80.0)
SERIAL = 28734
_NAME = "Handyscope HS5-540XM"
_ENDS = {"unplugged": f"Handyscope {SERIAL} was unplugged",
         "generator off": f"generator of Handyscope {SERIAL} has stopped"}  # fmt: skip
_TIMEOUT_S = 1.0
_LOSSES = 3  # calls of read() one after the other
INPUT_LSB = 0.5  # noise of an input


@dataclass(frozen=True)
class Analyser(Bridge):
    """Bridge, noise and clock between the specimen and the numbers.

    Attributes
    ----------
    noise_a : float
        Current noise at its input [A per root Hz].
    skew_ppm : float
        By which the sample clock is fast [1e-6].
    latency_s : float
        From the start to the first sample [s].
    seed : int
        Of the noise.
    """

    noise_a: float = 1e-10
    skew_ppm: float = 0.0
    latency_s: float = 0.02
    seed: int = 0

    def output_noise_v(self) -> float:
        """Deviation of a sample of the bridge's output [V]."""
        return self.noise_a * float(np.sqrt(RATE_HZ / 2)) * self.feedback_ohm


class Windows:
    """Times of consecutive windows by the run's clock."""

    def __init__(self, plant: Plant, clock: Clock, analyser: Analyser) -> None:
        self.plant, self.clock, self.count = plant, clock, 0
        self.begin = clock.now() + analyser.latency_s
        self.length_s = WINDOW_S / (1 + analyser.skew_ppm * 1e-6)

    def due(self) -> int:
        """Windows that have ended and were not taken."""
        return max(0, int((self.clock.now() - self.begin) / self.length_s + 1e-9) - self.count)

    def impedance(self, tones_hz: Real) -> Complex:
        """Impedance in the next window [ohm]."""
        self.plant.advance(self.begin + (self.count + 0.5) * self.length_s)
        self.count += 1
        return self.plant.impedance(tones_hz)


class PhasorMeter:
    """The readings of driver and simulated device without the samples between them.

    Phasors of each window get the noise that white noise leaves in them. A window is clipped if the waveform of the
    output would leave its range; its impedance is not distorted.

    Parameters
    ----------
    plant : Plant
        The specimen at the device's leads.
    clock : Clock
        Of the run.
    analyser : Analyser, optional
        Bridge, noise and clock; the readings are corrected by the true gain of the bridge.

    Attributes
    ----------
    fault : str
        Planted fault, or ""; it acts while it is set.
    """

    def __init__(self, plant: Plant, clock: Clock, analyser: Analyser | None = None) -> None:
        self.fault = ""
        self._plant, self._clock, self._analyser = plant, clock, analyser or Analyser()
        self._noise = np.random.default_rng(self._analyser.seed)
        self._windows: Windows | None = None

    def identify(self) -> Identity:
        """Name and number of the device that is simulated."""
        if self.fault == "wrong device":
            raise WrongDevice(f"device {SERIAL} is a Handyscope HS3-100; expected a Handyscope HS5; nothing was sent")
        if self.fault in ("unplugged", "in use"):
            raise DeviceFault(f"Handyscope {SERIAL} is {self.fault}")
        return Identity(_NAME, str(SERIAL), "simulated phasors")

    def start(self, tones_hz: Real, voltage_v: float) -> None:
        """Begin to measure."""
        self.identify()
        analyser = self._analyser
        self._tones = np.atleast_1d(np.asarray(tones_hz, float))
        self._voltage = voltage_v * multisine(self._tones, RATE_HZ, round(WINDOW_S * RATE_HZ)).amplitude
        self._transimpedance = analyser.transimpedance(self._tones)
        self._windows = Windows(self._plant, self._clock, analyser)
        self._heard, self._losses = self._clock.now(), 0
        ranges = [next(r for r in RANGES_V if r >= peak) for peak in (voltage_v, analyser.range_v)]
        steps = np.array([2 * limit / 2**BITS for limit in ranges])
        samples = np.hypot(np.hypot(INPUT_LSB, 1 / np.sqrt(12)) * steps, [0.0, analyser.output_noise_v()])
        self._deviation_v, self._limit_v = samples * np.sqrt(2 / (WINDOW_S * RATE_HZ)), ranges[1]

    def _due(self, windows: Windows, now: float) -> tuple[int, int]:
        """Windows to measure, and those that are lost; raises what a fault makes of it."""
        if self.fault in _ENDS:
            raise DeviceFault(_ENDS[self.fault])
        if self.fault == "hung" and now - self._heard > _TIMEOUT_S:
            raise DeviceFault(f"no samples from Handyscope {SERIAL} for {now - self._heard:.1f} s")
        loses = self.fault == "data loss"
        self._losses = self._losses + 1 if loses else 0
        if self._losses > _LOSSES:
            raise DeviceFault(f"Handyscope {SERIAL} loses samples again and again")
        count = 0 if self.fault == "hung" else windows.due()
        return (0, count) if loses else (count, 0)

    def read(self) -> Readings:
        """The windows that have ended since the last call."""
        if self._windows is None:
            raise DeviceFault(f"Handyscope {SERIAL} does not measure; start it first")
        now = self._clock.now()
        count, lost = self._due(self._windows, now)
        self._windows.count += lost
        first = self._windows.count
        windows = [self._measured(self._windows.impedance(self._tones)) for _ in range(count)]
        if count:
            self._heard = now
        impedance = np.array([z for z, _ in windows]).reshape(count, len(self._tones))
        clipped = np.array([beyond for _, beyond in windows], bool)
        return Readings(np.asarray((first + np.arange(count) + 0.5) * WINDOW_S), impedance, clipped, lost)

    def stop(self) -> None:
        """End the measurement."""
        self._windows = None

    close = stop

    def _measured(self, impedance: Complex) -> tuple[Complex, bool]:
        """One window's impedance with noise, and whether it is clipped."""
        if self.fault in ("nan", "silent"):
            return np.full(len(self._tones), complex(np.nan, np.nan)), False
        output = self._transimpedance * self._voltage / impedance
        noise = self._noise.standard_normal((2, 2, len(self._tones)))
        noisy = (noise[0] + 1j * noise[1]) * self._deviation_v[:, None]
        measured = (self._voltage + noisy[0]) / (output + noisy[1]) * self._transimpedance
        return measured, self.fault == "clipped" or self._beyond(output)

    def _beyond(self, output: Complex) -> bool:
        """Test whether the waveform of the output leaves its range."""
        if np.abs(output).sum() < self._limit_v:
            return False
        wave = multisine(self._tones, RATE_HZ, round(WINDOW_S * RATE_HZ))
        spectrum = np.fft.rfft(wave.samples)
        bins = np.round(self._tones * WINDOW_S).astype(int)
        shaped = np.zeros_like(spectrum)
        shaped[bins] = spectrum[bins] / np.abs(spectrum[bins]) * output * len(wave.samples) / 2
        return bool(np.abs(np.fft.irfft(shaped, len(wave.samples))).max() >= self._limit_v)
