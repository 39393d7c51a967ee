"""Watch the impedances of a run: means at rest and under a press, drift, short and open circuits, silence."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import nan

import numpy as np

from sensorgen.core.arrays import Complex, Real
from sensorgen.measure.lab.devices import DeviceFault, Readings
from sensorgen.measure.signal.presses import WINDOW_S


@dataclass
class Sweeps:
    """Rows with some frequencies missing are put together; whole rows, and those without any number, pass as they are.

    A row of several has the mean of their times; it waits until each of its frequencies was measured.
    """

    _row: Complex | None = None
    _times: list[float] = field(default_factory=list)
    _clipped: bool = False

    def whole(self, readings: Readings) -> Readings:
        """Rows that are whole now."""
        known = np.isfinite(readings.impedance_ohm)
        if (known.all(axis=1) | ~known.any(axis=1)).all():
            return readings
        rows = zip(readings.time_s.tolist(), readings.impedance_ohm, readings.clipped.tolist(), strict=True)
        whole = [row for each in rows for row in self._taken(*each)]
        return Readings.joined(whole, readings.impedance_ohm.shape[1], readings.lost)

    def _taken(self, time_s: float, row: Complex, clipped: bool) -> Iterator[Readings]:
        known = np.isfinite(row)
        if not known.all() and known.any():
            self._row = row if self._row is None else np.where(known, row, self._row)
            self._times.append(time_s)
            self._clipped |= clipped
            if not np.isfinite(self._row).all():
                return
            time_s, row, clipped = float(np.mean(self._times)), self._row, self._clipped
            self._row, self._times, self._clipped = None, [], False
        yield Readings(np.array([time_s]), row[None], np.array([clipped]))


SILENT_S = 5.0  # without a sound reading, a fault
_OPEN_F = 0.3e-12  # less than any specimen with its leads
_COURSE, _FEWEST_COURSE = 15, 5  # readings of which half have to say it
_FEW = 3  # readings, from which their noise can be told
_MOST = 1 << 14  # readings of a window, whatever the rate


def circuit(tones_hz: Real, impedance_ohm: Complex) -> str:
    """Circuit fault of a specimen, by its (m,) impedances: "short", "open", or "".

    At the lowest frequency an intact specimen is a capacitor: its reactance exceeds its resistance. At the highest,
    where the noise of a reading is least, an open circuit has a smaller capacitance than any specimen.
    """
    if not np.isfinite(impedance_ohm).all():
        return ""
    low, high = complex(impedance_ohm[np.argmin(tones_hz)]), int(np.argmax(tones_hz))
    if 1 / (2 * np.pi * tones_hz[high] * abs(impedance_ohm[high])) < _OPEN_F:
        return "open"
    return "short" if low.real > -low.imag else ""


@dataclass
class Watch:
    """Impedances of the last second, and what they say of specimen and instrument.

    Attributes
    ----------
    tones_hz : (m,) array
        Frequencies [Hz].
    latest_ohm : (m,) array
        The last sound reading; nan before [ohm].
    count, lost, clipped, invalid : int
        Readings so far, and of them lost, clipped and not finite.
    sound_s : float
        When a sound reading came last, by the run's clock [s].
    """

    tones_hz: Real
    latest_ohm: Complex = field(init=False)
    count: int = 0
    lost: int = 0
    clipped: int = 0
    invalid: int = 0
    sound_s: float = nan
    _recent: deque[tuple[float, Complex]] = field(default_factory=lambda: deque(maxlen=_MOST))
    _first_rest: Complex | None = None
    _course: deque[Complex] = field(default_factory=lambda: deque(maxlen=_COURSE))

    def __post_init__(self) -> None:
        self.latest_ohm = np.full(len(self.tones_hz), complex(nan, nan))

    def take(self, readings: Readings, now_s: float) -> None:
        """Take readings that came just now.

        Raises
        ------
        DeviceFault
            No sound reading for :data:`SILENT_S`.
        """
        sound = np.isfinite(readings.impedance_ohm).all(axis=1) & (readings.impedance_ohm != 0).all(axis=1)
        self.count += len(sound)
        self.lost += readings.lost
        self.clipped += int(np.count_nonzero(readings.clipped))
        self.invalid += int(np.count_nonzero(~sound))
        self._course.extend(readings.impedance_ohm[sound])
        for row in readings.impedance_ohm[sound & ~readings.clipped]:
            self.latest_ohm = row
            self._recent.append((now_s, row))
            self.sound_s = now_s
        while self._recent and self._recent[0][0] < now_s - WINDOW_S:
            self._recent.popleft()
        if now_s - self.sound_s > SILENT_S:
            what = "clipped" if readings.clipped.any() else "no"
            raise DeviceFault(f"impedance meter: {what} readings for {SILENT_S:g} s; check cables, range and specimen")

    def circuit(self) -> str:
        """Circuit fault of the specimen in half of the last readings: "short", "open", or "".

        Clipped readings count: a short drives more current than an input takes.
        """
        if len(self._course) < _FEWEST_COURSE:
            return ""
        admittance = 1 / np.array(self._course)
        middle: Complex = np.median(admittance.view(float), axis=0).view(complex)  # of real and imaginary part
        return circuit(self.tones_hz, np.asarray(1 / middle))

    def mean(self) -> Complex:
        """Mean over the last second; nan of nothing [ohm]."""
        if not self._recent:
            return np.full(len(self.tones_hz), complex(nan, nan))
        return np.asarray(np.mean([row for _, row in self._recent], axis=0))

    def noise(self) -> Real:
        """Standard error of real and imaginary part of the mean, relative to abs(Z), of each frequency; nan of few."""
        rows = np.array([row for _, row in self._recent])
        if len(rows) < _FEW:
            return np.full(len(self.tones_hz), nan)
        return np.asarray(rows.std(axis=0) / np.abs(rows.mean(axis=0)) / np.sqrt(2 * len(rows)))

    def drift(self) -> float:
        """Change of abs(Z) at rest since the first call, at the frequency where it is largest [-]."""
        now = np.abs(self.mean())
        if self._first_rest is None and np.isfinite(now).all():
            self._first_rest = now
        return 0.0 if self._first_rest is None else float(np.max(np.abs(now / self._first_rest - 1)))
