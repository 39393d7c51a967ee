"""Readings at rest among others: what each reading under load is a ratio to, how old that is, and how noisy all are."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import BadInput

LATEST = 64  # readings at rest that count, of those since the last press
FEWEST = 8  # from which noise can be told
NOISE = 1e-3  # of a reading's parts, relative to abs(Z), where it cannot


class Rest:
    """The latest readings at rest of a stream.

    Parameters
    ----------
    given : (k, m) array, optional
        Readings at rest that were taken apart [ohm].
    at_s : float
        When the last of them was taken [s]; nan if unknown, and then their age is never judged.
    """

    def __init__(self, given: Complex | None = None, at_s: float = np.nan) -> None:
        self._latest: deque[Complex] = deque(given if given is not None else (), maxlen=LATEST)
        self._at_s, self._timed, self._was = at_s, not np.isnan(at_s), True
        self._squares: list[Real] = [] if given is None else list(_scatter(np.asarray(given)))

    def ratios(self, impedance_ohm: Complex, rest: Mask, time_s: Real) -> tuple[Complex, Real]:
        """Ln of each reading over the reading at rest before it, and the age of that.

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
        (n, m) array, (n,) array
            Ratios, nan for readings at rest and before the first of them; ages [s], 0 where they are not judged.
        """
        z = np.where(impedance_ohm == 0, np.nan, impedance_ohm)
        ratio, age = np.full(z.shape, complex(np.nan, np.nan)), np.zeros(len(z))
        edges = np.flatnonzero(np.diff(rest.astype(np.int8))) + 1
        for start, end in zip([0, *edges.tolist()], [*edges.tolist(), len(z)], strict=True):
            if start == end:
                continue
            if rest[start]:
                if not self._was:
                    self._latest.clear()
                self._latest.extend(z[start:end])
                self._squares.extend(_scatter(z[start:end]))
                self._at_s, self._timed = float(time_s[end - 1]), not np.isnan(time_s[end - 1])
            elif self._latest:
                with np.errstate(invalid="ignore"):
                    ratio[start:end] = np.log(z[start:end] / np.nanmean(np.array(self._latest), axis=0))
                if self._timed:
                    age[start:end] = time_s[start:end] - self._at_s
            self._was = bool(rest[start])
        return ratio, age

    def noise(self) -> "Real | float":
        """Standard deviation of a ratio's parts at each tone (m,), by the scatter at rest; ``NOISE`` of too few."""
        squares = [square for square in self._squares if np.isfinite(square).all()]
        if len(squares) < FEWEST:
            return float(NOISE * np.sqrt(1.1))
        found: Real = np.sqrt(np.mean(squares, axis=0) * 1.1)
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
        raise BadInput(f"readings at {said} kHz; the specimen was calibrated at {expected} kHz: expected those")
    return np.asarray(same.argmax(0))
