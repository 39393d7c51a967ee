r"""Impedance at several tones at once with a TiePie Handyscope HS5 and an auto-balancing bridge.

The generator plays a multi-sine. Channel 1 samples the voltage of the specimen, channel 2 the output of the bridge,
which turns the current through the specimen into a voltage by its feedback R, C:

.. math:: Z = \frac{U_1}{I}, \quad I = \frac{U_2}{T}, \quad T = -g \frac{R}{1 + 2 \pi i f R C}

with the gain g of the bridge at each tone, 1 unless it was measured. Windows of whole periods of every tone are
demodulated as they come (:mod:`sensorgen.measure.signal.waveform`).

Generator and inputs run on one clock, so that the tones stay in their bins. The generator updates its output as often
as its memory allows, up to 240 times per sample: a coarse staircase has images around multiples of its rate, which a
capacitance conducts as well as the tones, and which sampling folds onto the tones. The bridge of the public program
TiePieLCR (martijnschouten/tiepielcr_gui) has 2610 ohm and 3.9 pF in its range of 370 uA/V. Calls and properties are
those of python-libtiepie (libtiepie-hw 1.2); ``python-libtiepie-bi`` brings the vendor's library, which needs
libusb-1.0.
"""

import warnings
from array import array
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from sensorgen.core import yamlfile
from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput, NotInstalled, OutOfRange
from sensorgen.core.records import Strict, checked
from sensorgen.measure.lab.devices import Clock, DeviceFault, Identity, Readings, WrongDevice
from sensorgen.measure.signal import waveform
from sensorgen.measure.signal.waveform import multisine

RATE_HZ = 1e6
DEMO = "demo"
_PRODUCT = 22  # PRODUCTID_HS5
_WINDOWS = 5  # of a block: the delay of a reading against the load of the USB port
_STEPS = (240, 120, 80, 60, 48, 40, 30, 24, 20, 16, 15, 12, 10, 8, 6, 5, 4, 3, 2, 1)  # per sample: divide 240 MHz
_TIMEOUT_S, _CHECK_S, _GAP_S = 1.0, 1.0, 0.25
_DRIFT = 1e-3  # of the two clocks, at most
_END = 0.999  # of the range: its highest code lies below it
_LOSSES = 3  # one after the other, without a block between them
_EXCITED = 0.05  # of a tone's amplitude: below it nothing drives the specimen


@dataclass(frozen=True)
class Bridge:
    """The bridge between specimen and channel 2.

    Attributes
    ----------
    feedback_ohm, feedback_f : float
        Feedback of its amplifier [ohm], [F].
    range_v : float
        Range of channel 2, either way [V].
    gain : tuple of (float, complex)
        Tone [Hz], and output over what R and C let expect; 1 at tones that are not named.
    """

    feedback_ohm: float = 2610.0
    feedback_f: float = 3.9e-12
    range_v: float = 0.8
    gain: tuple[tuple[float, complex], ...] = ()

    def gains(self, tones_hz: Real) -> Complex:
        """Gain of (m,) tones."""
        return np.array([dict(self.gain).get(float(f), 1.0) for f in tones_hz], complex)

    def transimpedance(self, tones_hz: Real) -> Complex:
        """Output over current, of (m,) tones [ohm]."""
        return np.asarray(-self.gains(tones_hz) / (1 / self.feedback_ohm + 2j * np.pi * tones_hz * self.feedback_f))


class _Gain(Strict):
    hz: float = Field(gt=0)
    gain: float = Field(gt=0, allow_inf_nan=False)
    phase_deg: float = Field(0.0, allow_inf_nan=False)


class _Gains(Strict):
    tones: list[_Gain] = Field(min_length=1)


def gains(path: Path) -> tuple[tuple[float, complex], ...]:
    """Gain of the bridge per tone from a calibration file.

    A known resistor in the specimen's place gives them: its value over the impedance that was measured. In YAML::

        tones:
          - {hz: 1100, gain: 1.002, phase_deg: -0.3}

    Raises
    ------
    BadInput
        A file that is none of these.
    """
    data = checked(_Gains, yamlfile.parse(yamlfile.text(path), path.name))
    return tuple((each.hz, each.gain * np.exp(1j * np.radians(each.phase_deg))) for each in data.tones)


def load() -> Any:
    """Import the vendor's library.

    Raises
    ------
    NotInstalled
        It is missing, or its parts do not fit together.
    """
    try:
        with warnings.catch_warnings(action="ignore"):  # of udev, which identify() reports if nothing is found
            import libtiepie
            import libtiepie.exceptions
    except ModuleNotFoundError:
        raise NotInstalled("a Handyscope needs TiePie's library: pip install 'sensorgen[lab]'") from None
    except (OSError, AttributeError) as error:
        raise NotInstalled(
            f"TiePie's library cannot be loaded ({error}); it needs the system's libusb-1.0 (apt install libusb-1.0-0),"
            " and python-libtiepie-bi alone: pip uninstall python-libtiepie python-libtiepie-bi,"
            " then pip install python-libtiepie-bi"
        ) from None
    return libtiepie


class Handyscope:
    """A Handyscope HS5 with a bridge: :class:`sensorgen.measure.lab.devices.ImpedanceMeter`.

    ``read`` takes only blocks that are complete. The first block, in which bridge and specimen settle, is left out.
    Time is counted in samples; only the length of a gap, when samples were lost, is by the computer's clock.
    Readings are nan at tones whose voltage is missing on channel 1, below 5 % of what the generator plays.

    Parameters
    ----------
    address : str
        Serial number, or "demo": the vendor's simulated device, whose inputs do not depend on its generator.
    clock : Clock
        For time-outs and gaps.
    bridge : Bridge
        Between the specimen and channel 2.
    library : module, optional
        Something with the functions of ``libtiepie`` that are used here: a simulator.

    Raises
    ------
    BadInput
        An address that is no serial number.
    """

    def __init__(self, address: str, clock: Clock, *, bridge: Bridge | None = None, library: Any = None) -> None:
        if address != DEMO and not address.isdecimal():
            raise BadInput(f"address {address!r} of a Handyscope; expected its serial number, or {DEMO!r}")
        self.address, self.bridge = address, bridge or Bridge()
        self._clock, self._library = clock, library
        self._identity: Identity | None = None
        self._scope: Any = None
        self._generator: Any = None
        self._running = False

    def identify(self) -> Identity:
        """Find it in the list of devices and open it.

        Raises
        ------
        WrongDevice
            The serial number is that of another product, which is not opened.
        DeviceFault
            It is not there, or another program uses it.
        NotInstalled
            The vendor's library is missing.
        """
        if self._identity:
            return self._identity
        self._library = self._library or load()
        with self._faults():
            item = self._found()
            if item.product_id != _PRODUCT:
                raise WrongDevice(
                    f"device {self.address} is a {item.name}; expected a Handyscope HS5; nothing was sent"
                )
            both = (self._library.DEVICETYPE_OSCILLOSCOPE, self._library.DEVICETYPE_GENERATOR)
            if not all(item.can_open(kind) for kind in both):
                raise DeviceFault(f"{item.name} {self.address} is in use; close the other program that uses it")
            self._scope, self._generator = item.open_oscilloscope(), item.open_generator()
            version = self._library.library.version
            self._identity = Identity(str(item.name), str(item.serial_number), f"library {version}")
        return self._identity

    def start(self, tones_hz: Real, voltage_v: float) -> None:
        """Begin to play and to measure.

        Parameters
        ----------
        tones_hz : (m,) array
            Whole hertz below half of 1 MHz [Hz].
        voltage_v : float
            Peak of the multi-sine [V].

        Raises
        ------
        OutOfRange
            A voltage or tones that the device does not have.
        DeviceFault
            It is not there, or refuses a setting.
        """
        self.identify()
        self._tones = np.atleast_1d(np.asarray(tones_hz, float))
        self._window = waveform.window_samples(RATE_HZ, self._tones)
        self._transimpedance = self.bridge.transimpedance(self._tones)
        with self._faults():
            self._play(voltage_v)
            self._listen(voltage_v)
            self._scope.start()
        self._running, self._losses, self._settled = True, 0, False
        self._begin = self._heard = self._polled = self._checked = self._clock.now()
        self._count, self._least, self._late = 0, 0.0, 0.0  # samples; least lag so far; lag beyond it [s]

    def read(self) -> Readings:
        """Readings since the last call.

        Raises
        ------
        DeviceFault
            Unplugged, silent for a second, generator stopped, or samples lost again and again.
        """
        if not self._running:
            raise DeviceFault(f"Handyscope {self.address} does not measure; start it first")
        parts: list[Readings] = []
        with self._faults():
            self._alive()
            if self._scope.is_data_overflow:
                self._restart()
            while self._scope.is_data_ready:
                parts.append(self._demodulated(np.asarray(self._scope.get_data_numpy())))
        lost = self._missing(heard=bool(parts))
        if parts and not self._settled:
            self._settled, parts = True, parts[1:]
        readings, gap_s = Readings.joined(parts, len(self._tones), lost), lost * self._window / RATE_HZ
        return replace(readings, time_s=readings.time_s + gap_s)

    def stop(self) -> None:
        """End the measurement and switch the generator off."""
        self._running = False
        if self._scope is not None:
            with self._faults():
                self._generator.stop()
                self._generator.output_enable = False
                self._scope.stop()

    def close(self) -> None:
        """Stop, and give the device back; never raises."""
        for switch in (lambda: self._generator.stop(), lambda: self._scope.stop(), self._dark):
            with suppress(Exception):
                switch()
        self._running, self._scope, self._generator, self._identity = False, None, None, None

    def _dark(self) -> None:
        self._generator.output_enable = False

    def _found(self) -> Any:
        """Entry in the list of devices."""
        devices = self._library.device_list
        if self.address == DEMO:
            return devices.get_item_by_serial_number(devices.create_demo_device(_PRODUCT))
        devices.update()
        there = list(devices)
        for item in there:
            if str(item.serial_number) == self.address:
                return item
        others = ", ".join(f"{item.name} {item.serial_number}" for item in there) or "none; check cable and power"
        raise DeviceFault(
            f"no Handyscope {self.address} here; devices: {others} (on Linux a udev rule must allow access:"
            " install-tiepie-udev.sh)"
        )

    def _play(self, voltage_v: float) -> None:
        """Load the multi-sine into the generator and start it."""
        generator, library = self._generator, self._library
        generator.signal_type = library.ST_ARBITRARY
        generator.mode = library.GM_CONTINUOUS
        generator.frequency_mode = library.FM_SAMPLERATE
        steps = next((n for n in _STEPS if n * self._window <= generator.data_length_max), 1)
        wave = multisine(self._tones, steps * RATE_HZ, steps * self._window)
        self._amplitude = wave.amplitude * voltage_v
        if not 0 < voltage_v <= generator.output_value_max:
            raise OutOfRange(f"voltage {voltage_v:g} V; the generator has up to {generator.output_value_max:g} V")
        generator.frequency = steps * RATE_HZ
        generator.amplitude, generator.offset = voltage_v, 0.0
        generator.set_data(array("f", wave.samples.astype(np.float32).tobytes()))
        played = generator.frequency
        if abs(played / (steps * RATE_HZ) - 1) > 1e-9 or abs(generator.amplitude / voltage_v - 1) > 0.02:
            raise DeviceFault(
                f"generator plays {played:g} samples/s at {generator.amplitude:g} V; expected {steps * RATE_HZ:g}"
                f" samples/s at {voltage_v:g} V"
            )
        generator.output_enable = True
        generator.start()

    def _listen(self, voltage_v: float) -> None:
        """Set both inputs up for streaming."""
        scope, library = self._scope, self._library
        scope.measure_mode = library.MM_STREAM
        for bits in sorted(scope.resolutions, reverse=True):  # 16 has rates of its own
            scope.resolution, scope.sample_rate = bits, RATE_HZ
            if scope.sample_rate == RATE_HZ:
                break
        scope.record_length = _WINDOWS * self._window
        if scope.sample_rate != RATE_HZ or scope.record_length != _WINDOWS * self._window:
            raise DeviceFault(
                f"device samples at {scope.sample_rate:g} Hz in blocks of {scope.record_length};"
                f" expected {RATE_HZ:g} Hz in blocks of {_WINDOWS * self._window}"
            )
        self._ranges = []
        for channel, peak in zip(scope.channels, (voltage_v, self.bridge.range_v), strict=True):
            channel.enabled, channel.coupling = True, library.CK_DCV
            channel.range = next((r for r in sorted(channel.ranges) if r >= peak), max(channel.ranges))
            self._ranges.append(float(channel.range))

    def _alive(self) -> None:
        """Check that the device is there and the generator still plays, once a second."""
        if self._scope.is_removed:
            raise DeviceFault(f"Handyscope {self.address} was unplugged")
        now = self._clock.now()
        if now - self._polled > _TIMEOUT_S:  # the reader was away, not the device
            self._heard = now
        self._polled = now
        if now - self._checked >= _CHECK_S:
            self._checked = now
            if not self._generator.is_running:
                raise DeviceFault(f"generator of Handyscope {self.address} has stopped")

    def _restart(self) -> None:
        """Begin the stream again after a loss."""
        self._losses += 1
        if self._losses > _LOSSES:
            raise DeviceFault(
                f"Handyscope {self.address} loses samples again and again: the computer or its USB port is too slow"
            )
        self._scope.stop()
        self._scope.start()

    def _missing(self, *, heard: bool) -> int:
        """Windows lost before the blocks of this call, by the time by which the samples lag behind the clock.

        Of a loss that the device does not report, as the vendor's simulated one, only the lag is a sign: if it exceeds
        the least so far by a quarter of a second twice, since one call may have been late itself.
        """
        now = self._clock.now()
        if not heard:
            if now - self._heard > _TIMEOUT_S:
                raise DeviceFault(f"no samples from Handyscope {self.address} for {now - self._heard:.1f} s")
            return 0
        lag = now - self._begin - self._count / RATE_HZ
        self._least = min(self._least + _DRIFT * (now - self._heard), lag) if self._settled else lag
        late = lag - self._least
        sure = late if self._losses else min(late, self._late)
        lost = max(round(sure * RATE_HZ / self._window), 1 if self._losses else 0)
        if not self._losses and sure <= _GAP_S:
            lost = 0
        self._late = late
        self._count += lost * self._window
        self._heard, self._losses = now, 0
        return lost

    def _demodulated(self, block: np.ndarray[Any, Any]) -> Readings:
        """Impedances of the windows of a block."""
        windows = block.reshape(2, -1, self._window)  # one by one: BLAS would begin threads for more, and wait for them
        phasors = [[waveform.phasors(each, RATE_HZ, self._tones, self._window)[0] for each in some] for some in windows]
        voltage, output = np.array(phasors)
        with np.errstate(all="ignore"):
            impedance = voltage / output * self._transimpedance
        impedance[~(np.abs(voltage) > _EXCITED * self._amplitude) | ~np.isfinite(impedance)] = np.nan
        clipped = [
            waveform.clipped(signal, _END * limit, self._window, len(voltage))
            for signal, limit in zip(block, self._ranges, strict=True)
        ]
        middles = np.asarray((self._count + (np.arange(len(voltage)) + 0.5) * self._window) / RATE_HZ)
        self._count += block.shape[1]
        return Readings(middles, impedance, clipped[0] | clipped[1])

    @contextmanager
    def _faults(self) -> Iterator[None]:
        """Translate errors of the vendor's library."""
        try:
            yield
        except self._library.exceptions.LibTiePieException as error:
            gone = isinstance(error, self._library.exceptions.ObjectGoneError)
            cause = "was unplugged" if gone else f"reports: {error.args[-1]}"
            raise DeviceFault(f"Handyscope {self.address} {cause}") from None
