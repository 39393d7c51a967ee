"""Readings at rest among others: what each reading under load is a ratio to, how old that is, and how noisy all are."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import BadInput
from sensorgen.prediction.calibration.baseline import Baseline, RestChange

LATEST = 64  # readings at rest that count, of those since the last press
FEWEST = 8  # differences of successive ones from which noise can be told
_MOST_STEPS = 4096
STALE_S = 15.0  # age from which on a reading at rest no longer stands for the specimen
NOISE = 1e-3  # of a reading's parts, relative to abs(Z), where it cannot


class Rest:
    """The latest readings at rest of a stream.

    Parameters
    ----------
    given : (k, m) array, optional
        Readings at rest that were taken apart [ohm]; those of the stream replace them.
    at_s : float
        When the last of them was taken [s]; nan if unknown, and then their age is never judged.
    baseline : Baseline, optional
        Reading at rest of the calibration, in the order of the readings' tones.

    Attributes
    ----------
    change : RestChange or None
        The first reading at rest that was of another sensor than the calibrated one, or of one that has changed.
    """

    def __init__(
        self, given: Complex | None = None, at_s: float = np.nan, baseline: Baseline | None = None
    ) -> None:  # fmt: skip
        self._baseline, self._changed = baseline, False
        self.change: RestChange | None = None
        self._latest: deque[tuple[float, Complex]] = deque(maxlen=LATEST)
        self._squares: deque[Real] = deque(maxlen=_MOST_STEPS)
        self._loaded = True  # since the latest reading at rest
        if given is not None:
            self._take(np.where(given == 0, np.nan, given), np.full(len(given), at_s))
            self._compare(*self.mean())
            self._loaded = True

    def ratios(self, impedance_ohm: Complex, rest: Mask, time_s: Real) -> tuple[Complex, Real, Mask]:
        """Ln of each reading over the readings at rest before it, the age of the last of them, and whether they differ.

        Parameters
        ----------
        impedance_ohm : (n, m) array
            Readings [ohm]; nan or 0 where none was measured.
        rest : (n,) array of bool
            Whether nothing was on the sensor.
        time_s : (n,) array
            Their times [s]; nan where unknown.

        Returns
        -------
        (n, m) array, (n,) array, (n,) array of bool
            Ratios, nan for readings at rest and before the first of them; ages [s], 0 where they are not judged; where
            the readings at rest are of another sensor than the baseline.
        """
        z = np.where(impedance_ohm == 0, np.nan, impedance_ohm)
        ratio, age, changed = np.full(z.shape, complex(np.nan, np.nan)), np.zeros(len(z)), np.zeros(len(z), bool)
        edges = np.flatnonzero(np.diff(rest.astype(np.int8))) + 1
        for start, end in zip([0, *edges.tolist()], [*edges.tolist(), len(z)], strict=True):
            if start == end:
                continue
            if rest[start]:
                self._take(z[start:end], time_s[start:end])
            else:
                if self._latest:
                    mean, count = self.mean()
                    if not self._loaded:
                        self._compare(mean, count)
                    with np.errstate(invalid="ignore"):
                        ratio[start:end] = np.log(z[start:end] / mean)
                    age[start:end] = np.nan_to_num(time_s[start:end] - self._latest[-1][0])
                    changed[start:end] = self._changed
                self._loaded = True
        return ratio, age, changed

    def _compare(self, mean: Complex, count: int) -> None:
        change = self._baseline.change(mean, self.noise() / count**0.5) if self._baseline else None
        self._changed = bool(change)
        self.change = self.change or (change if change else None)

    def _take(self, z: Complex, time_s: Real) -> None:
        """Readings at rest; the first ones after a press replace those before it."""
        before = [] if self._loaded or not self._latest else [self._latest[-1][1]]
        if self._loaded:
            self._latest.clear()
        self._loaded = False
        self._squares.extend(square for square in _scatter(np.array([*before, *z])) if np.isfinite(square).all())
        self._latest.extend(zip(time_s.tolist(), z, strict=True))

    def mean(self) -> tuple[Complex, int]:
        """Mean of the latest readings at rest (m,) [ohm], nan where none was measured, and their number.

        Those count that are no more than ``STALE_S`` older than the last one: the specimen wanders.
        """
        last = self._latest[-1][0]
        latest = np.array([z for t, z in self._latest if not t < last - STALE_S])
        known = np.isfinite(latest)
        with np.errstate(invalid="ignore"):
            return np.where(known, latest, 0).sum(0) / known.sum(0), len(latest)

    def __bool__(self) -> bool:
        """Test whether there is one."""
        return bool(self._latest)

    @property
    def tells_noise(self) -> bool:
        """True if there were enough of them."""
        return len(self._squares) >= FEWEST

    def noise(self) -> "Real | float":
        """Standard deviation of the parts of a reading at each tone (m,), by the scatter at rest; else ``NOISE``."""
        if not self.tells_noise:
            return NOISE
        found: Real = np.sqrt(np.mean(self._squares, axis=0))
        return found


def _scatter(z: Complex) -> Real:
    """Squares of the parts' scatter, relative, from one reading to the next (n - 1, m): a drift does not count."""
    step = np.diff(np.log(z), axis=0)
    return np.asarray(np.abs(step) ** 2 / 4)


def checked(tones_hz: Real, calibrated_hz: Real) -> NDArray[np.intp]:
    """Order of a file's tones in which they are the calibrated ones.

    Raises
    ------
    BadInput
        Those frequencies are not the calibrated ones.
    """
    same = np.isclose(np.asarray(tones_hz)[:, None], np.asarray(calibrated_hz), rtol=1e-6)
    if same.shape[0] != same.shape[1] or not (same.sum(0) == 1).all():
        said, expected = (", ".join(f"{f / 1e3:g}" for f in hz) for hz in (tones_hz, calibrated_hz))
        raise BadInput(f"readings at {said} kHz; expected {expected} kHz")
    return np.asarray(same.argmax(0))
