"""Readings at rest: that of the calibration, and those of a stream, to which readings under load are ratios.

Ratios to a fresh reading at rest do not depend on what has happened to R and C since, so that they show no broken
trace, no lifted edge and no other specimen: the reading at rest itself does.
"""

from collections import deque
from dataclasses import dataclass
from math import expm1, hypot

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Complex, Mask, Real
from sensorgen.core.errors import BadInput
from sensorgen.prediction.calibration.fitting import Posterior, rest_gain
from sensorgen.prediction.calibration.specimen import SpecimenModel
from sensorgen.prediction.inference import parts, slopes
from sensorgen.prediction.inverse.verdict import chi2_limit

SESSION_C, SESSION_R = 0.01, 0.03  # standard deviations of ln C and ln R from one session to another: guesses, some K
_LEADS = {"lead": 10.0, "stray": 2e-13}  # ohm and farad by which leads that are connected anew differ: guesses
_METER = 1e-3  # of abs(Z): the bench reads the same from one session to another
_SURE = 3.0  # standard deviations


@dataclass(frozen=True)
class RestChange:
    """Difference of a reading at rest from the one of the calibration.

    Attributes
    ----------
    ln_c, ln_r : float
        Of ln of capacitance and of resistance [-].
    usual_c, usual_r : float
        Largest differences that another session may make, with the errors of these [-].
    other : bool
        Nothing but R, C and leads has changed.
    """

    ln_c: float
    ln_r: float
    usual_c: float
    usual_r: float
    other: bool

    def __bool__(self) -> bool:
        """The specimen is not what was calibrated."""
        return abs(self.ln_c) > self.usual_c or abs(self.ln_r) > self.usual_r or self.other

    @property
    def words(self) -> str:
        """The change, and its likely causes."""
        c, r = (f"{expm1(min(x, 5.0)):+.0%}" for x in (self.ln_c, self.ln_r))
        usual_c, usual_r = (f"{expm1(min(x, 5.0)):.0%}" for x in (self.usual_c, self.usual_r))
        if self.ln_c < -self.usual_c:
            cause = "a broken trace, a lifted edge or another specimen"
        elif self.ln_c > self.usual_c:
            cause = "a load or moisture on it, or another specimen"
        else:
            cause = "another specimen, a bad contact or a leak"
        return f"C {c} (usual: {usual_c}) and R {r} ({usual_r}) at rest since the calibration: {cause}"


class Baseline:
    """Reading at rest of a calibrated specimen.

    Parameters
    ----------
    model : SpecimenModel
        Of the specimen.
    posterior : Posterior
        Of its calibration.
    gain : (m,) array, optional
        Ln of each tone's gain, by which the parameters and the reading at rest agree; None where the bench never read
        the specimen.
    """

    def __init__(self, model: SpecimenModel, posterior: Posterior, gain: Complex | None = None) -> None:
        at, m = posterior.at, len(model.frequency_hz)
        self._ln_z = model.rest(at) + (0.0 if gain is None else gain)
        by_parameter = slopes(lambda near: parts(model.rest(near)), at)

        def by(name: str) -> Real:
            return by_parameter[:, model.names.index(name)]

        leads = np.stack([by(name) * change / model.value(name, at) for name, change in _LEADS.items()], 1)
        self._weights = np.stack([by(name) / getattr(model.spread, name) for name in ("capacitance", "resistance")], 1)
        self._covariance = leads @ leads.T + _METER**2 * np.eye(2 * m)
        if gain is None:
            self._covariance += by_parameter @ posterior.covariance @ by_parameter.T + rest_gain(model)

    def change(self, z_ohm: Complex, noise: Real | float) -> RestChange:
        """Difference of a reading at rest.

        Parameters
        ----------
        z_ohm : (m,) array
            Mean reading with nothing on the sensor [ohm]; nan where none was measured.
        noise : (m,) array or float
            Standard deviation of its parts, relative [-].
        """
        columns = np.flatnonzero(np.tile(np.isfinite(z_ohm), 2))
        off = parts(np.log(z_ohm) - self._ln_z)[columns]
        covariance = self._covariance + np.diag(np.resize(noise, len(self._covariance)) ** 2)
        weights, inverse = self._weights[columns], np.linalg.inv(covariance[np.ix_(columns, columns)])
        variance = np.linalg.pinv(weights.T @ inverse @ weights)
        ln_cr = variance @ weights.T @ inverse @ off
        left = off - weights @ ln_cr
        usual_c, usual_r = (
            _SURE * hypot(session, float(variance[k, k]) ** 0.5) for k, session in enumerate((SESSION_C, SESSION_R))
        )
        other = float(left @ inverse @ left) > float(chi2_limit(np.array(max(len(columns) - 2, 0))))
        return RestChange(float(ln_cr[0]), float(ln_cr[1]), usual_c, usual_r, other)


LOADS_N = np.array([0.0, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0])  # that may lie on a sensor at rest
_USUAL_N = 1.0  # standard deviation of such a load: a guess
_BORDERS = np.arange(-4.0, 8.1, 0.25)  # of how far readings lie below that at rest, in standard deviations
_SHARES = 0.7 ** np.arange(14)  # of the readings
_OUTLIERS = 0.01  # share of the readings that may lie anywhere for other reasons


def load_probabilities(below: Real, by_load: Real, loaded: float) -> Real:
    r"""Probabilities of ``LOADS_N`` (k,) on the sensor at rest, by readings that lie below it: no force is negative.

    A reading of no force lies u standard deviations below one at rest under a load. The number of such readings, n, is
    unknown, and other small forces are evenly spread: how far readings lie below has the density
    :math:`n \varphi(b - u) + \lambda \Phi(u - b)`, so that readings without force alone show no load.

    Parameters
    ----------
    below : (n,) array
        How far readings lie below the one at rest, in standard deviations; nan where unknown.
    by_load : (k,) array
        How far one of no force does if that at rest is under each of ``LOADS_N``.
    loaded : float
        Probability of a load before.
    """
    from scipy.special import ndtr

    middle, width = (_BORDERS[1:] + _BORDERS[:-1]) / 2, np.diff(_BORDERS)
    count, _ = np.histogram(np.minimum(below[np.isfinite(below)], middle[-1]), _BORDERS)
    away = middle - np.minimum(by_load, middle[-1])[:, None]
    presses, zeros = width * ndtr(-away), width * np.exp(-(away**2) / 2) / np.sqrt(2 * np.pi)
    shares = count.sum() * np.append(0.0, _SHARES)[:, None, None]
    expected = shares[:, None] * zeros + shares[1:] * presses + _OUTLIERS * max(count.sum(), 1) / len(count)
    ln = (count * np.log(expected) - expected).sum(-1)
    none_or_some = np.where(shares, 1 / len(_SHARES), 1.0)  # as probable
    evidence = (none_or_some * np.exp(ln - ln.max())).sum((0, 1))
    before = np.exp(-((LOADS_N[1:] / _USUAL_N) ** 2) / 2) * np.gradient(LOADS_N[1:])
    chance = evidence * np.append(1 - loaded, loaded * before / before.sum())
    return np.asarray(chance / chance.sum())


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
        deviation: Real = np.sqrt(np.mean(self._squares, axis=0))
        return deviation


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
        given, expected = (", ".join(f"{f / 1e3:g}" for f in hz) for hz in (tones_hz, calibrated_hz))
        raise BadInput(f"readings at {given} kHz; expected {expected} kHz")
    return np.asarray(same.argmax(0))
