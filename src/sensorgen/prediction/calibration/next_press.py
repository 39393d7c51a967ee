"""The next press of a calibration, by sequential optimal design.

A press of known force and place, held for a known time, some of them after a higher force, has a ratio of readings with
the slopes J by the parameters and the covariance S. It changes the covariance C of the parameters to

.. math:: C' = C - C J^T (S + J C J^T)^{-1} J C

in the model linearised at the posterior's mean, whatever it will read. The aim ``values`` minimises the determinant of
C' among the specimen's values, all other parameters integrated out (D_s-optimality; Atkinson, Donev and Tobias, Optimum
Experimental Designs, 2007, chapter 10); the aim ``presses`` minimises the variance that C' leaves in the ratios of
presses anywhere, over their own (V-optimality), which is what an inversion needs.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.calibration import fitting
from sensorgen.prediction.calibration.specimen import Presses, SpecimenModel, spread_at
from sensorgen.prediction.inference import cramer_rao, whitening

PRESSES = 30
_STEP = 1e-3  # of the force and of the length, for differences
_PARALLEL = 1e-6  # sine of the angle between their slopes, below which force and position are not told apart
_GOLDEN, _SILVER = 0.6180339887498949, 0.7548776662466927  # spread presses evenly over force, place and course


def outlook(
    sensor: Sensor, frequency_hz: Real, noise: float, force_n: float, position_m: float
) -> tuple[Real, Real] | None:
    """Standard errors of force and position [N], [m]: after ``PRESSES`` known presses, and without a calibration.

    Parameters
    ----------
    sensor : Sensor
        As predicted.
    frequency_hz : (m,) array
        Tones [Hz].
    noise : float
        Of the parts of a reading, relative to abs(Z) [-].
    force_n, position_m : float
        The press [N], [m].

    Returns
    -------
    (2,) array, (2,) array, or None
        Infinite where a quantity is not identifiable; None without a force, and where the sensor cannot be calibrated,
        as under a tip whose pressure is not uniform.
    """
    if not force_n > 0:
        return None
    try:
        model = SpecimenModel(sensor, frequency_hz, spread_at(sensor))
        sigma = np.full(len(model.frequency_hz), noise * 1.1**0.5)
        before = fitting.prior(model, sigma)
        return _errors(model, _planned(model, before, force_n), force_n, position_m), _errors(
            model, before, force_n, position_m
        )
    except SensorgenError:
        return None


def _planned(model: SpecimenModel, before: fitting.Posterior, force_n: float) -> fitting.Posterior:
    """Knowledge after presses up to a force, all over the strip, half of them after a higher one."""
    k: Real = np.arange(1.0, PRESSES + 1)
    length, half = model.sensor.length_m, model.sensor.tip_m / 2
    presses = Presses(
        force_n * (0.05 + 0.95 * k / PRESSES), half + (length - 2 * half) * (k * _GOLDEN % 1),
        np.where(k % 2 == 0, 0.3, 0.0), -0.5 + 2 * (k * _SILVER % 1),
    )  # fmt: skip
    data = fitting.Data.unread(presses, before.noise, rest_noise=before.noise / PRESSES**0.5)
    usual = fitting.usual_components(model)
    known = fitting.information(model, data, before.at, usual) + before.information
    scatter, wander, _ = usual.tolist()
    return replace(
        before, covariance=np.asarray(np.linalg.inv(known)), scatter=scatter, wander_c=wander, wander_r=wander,
        presses=PRESSES,
    )  # fmt: skip


def _errors(model: SpecimenModel, known: fitting.Posterior, force_n: float, position_m: float) -> Real:
    force = force_n * np.array([1 - _STEP, 1, 1 + _STEP])
    place = np.clip(position_m + model.sensor.length_m * np.array([-_STEP, 0, _STEP]), 0, model.sensor.length_m)
    mean, covariance = fitting.readings(model, known, force, place)
    at = mean.reshape(3, 3, -1)
    slopes = np.stack([(at[2, 1] - at[0, 1]) / (force[2] - force[0]), (at[1, 2] - at[1, 0]) / (place[2] - place[0])])
    by_force, by_position = slopes @ whitening(covariance[4]).T
    return np.asarray(np.nan_to_num(cramer_rao(by_force, by_position, _PARALLEL)[:2], nan=np.inf))


VALUES = ("resistance", "capacitance", "rise", "force offset", "position offset", "hysteresis", "creep")
"""Parameters that the aim ``values`` asks for."""
AIMS = ("values", "presses")
_FORCES, _PLACES, _HOLDS = 6, 17, 3  # tried
_HALTON = 200  # presses that stand for all


@dataclass(frozen=True)
class PossiblePresses:
    """Presses that are possible.

    Attributes
    ----------
    force_n : (float, float)
        Least and largest force [N].
    position_m : (float, float)
        Least and largest position of the tip's centre [m].
    hold_s : (float, float)
        Shortest and longest time at the force before it counts [s].
    """

    force_n: tuple[float, float]
    position_m: tuple[float, float]
    hold_s: tuple[float, float]

    def __post_init__(self) -> None:
        """Refuse ranges that hold nothing."""
        for name, (low, high) in vars(self).items():
            if not 0 <= low <= high < np.inf or (name != "position_m" and not low > 0):
                raise BadInput(f"{name} from {low:g} to {high:g}; expected two positive numbers that rise")


@dataclass(frozen=True)
class KnownPress:
    """A press.

    Attributes
    ----------
    force_n, position_m : float
        Force, and position of the tip's centre [N], [m].
    peak_n : float
        Force from which it is reached by unloading; the force itself if none [N].
    hold_s : float
        Time at the force before it counts [s].
    """

    force_n: float
    position_m: float
    peak_n: float
    hold_s: float


@dataclass(frozen=True, eq=False)
class NextPress:
    """Choice of presses for a specimen on a bench.

    Attributes
    ----------
    model : SpecimenModel
        Of the specimen.
    within : PossiblePresses
        Presses that are possible.
    noise : (m,) array
        Standard deviation of the real and imaginary part of a press's ratio, a mean over its readings [-].
    aim : str
        One of ``AIMS``.
    """

    model: SpecimenModel
    within: PossiblePresses
    noise: Real
    aim: str = "values"

    def __post_init__(self) -> None:
        """Refuse another aim."""
        if self.aim not in AIMS:
            raise BadInput(f"aim {self.aim!r:.40}; expected {' or '.join(AIMS)}")

    @cached_property
    def tried(self) -> Presses:
        """Presses among which one is chosen: up to the largest force from below and from above."""
        (low, high), (near, far), (short, long) = self.within.force_n, self.within.position_m, self.within.hold_s
        axes = np.meshgrid(
            np.geomspace(low, high, _FORCES), np.linspace(near, far, _PLACES), [0.0, 1.0],
            np.linspace(np.log10(short), np.log10(long), _HOLDS), indexing="ij",
        )  # fmt: skip
        force, position, above, decades = (axis.ravel() for axis in axes)
        once = (above == 0) | (force < high)  # nothing is above the largest
        return Presses(force, position, above * (1 - force / high), decades).rows(once)

    @cached_property
    def _everywhere(self) -> Presses:
        """Presses evenly spread over force, place, unloading and time."""
        from scipy.stats import qmc

        share = qmc.Halton(4, scramble=False).random(_HALTON + 1)[1:].T
        (low, high), (near, far), hold = self.within.force_n, self.within.position_m, np.log10(self.within.hold_s)
        force = low + (high - low) * share[0]
        unloading = np.maximum(2 * share[2] - 1, 0) * (1 - force / high)
        return Presses(force, near + (far - near) * share[1], unloading, hold[0] + (hold[1] - hold[0]) * share[3])

    def best(self, known: fitting.Posterior) -> KnownPress:
        """The most informative next press."""
        k = int(np.argmin(self.left(known, self.tried)))
        force, position, unloading, decades = (float(column[k]) for column in vars(self.tried).values())
        return KnownPress(force, position, force / (1 - unloading), 10**decades)

    def left(self, known: fitting.Posterior, presses: Presses) -> Real:
        """Uncertainty of the aim that each of n presses would leave, (n,); the less the better [-]."""
        c, slopes = known.covariance, self.model.slopes(known.at, presses)
        gain = slopes @ c  # (n, 2 m, p)
        of_ratios = self._noise(known, presses) + gain @ slopes.transpose(0, 2, 1)
        less = gain.transpose(0, 2, 1) @ np.linalg.solve(of_ratios, gain)
        if self.aim == "values":
            which = [self.model.names.index(name) for name in VALUES]
            return np.asarray(np.linalg.slogdet((c - less)[:, which][:, :, which])[1])
        return np.asarray(np.einsum("ab,nab->n", self._weight(known), c - less))

    def _weight(self, known: fitting.Posterior) -> Real:
        """Factor from a covariance to the mean variance of ratios anywhere, over their own."""
        slopes = self.model.slopes(known.at, self._everywhere)
        own = np.linalg.inv(self._noise(known, self._everywhere))
        return np.asarray(np.einsum("nia,nij,njb->ab", slopes, own, slopes, optimize=True) / len(slopes))

    def _noise(self, known: fitting.Posterior, presses: Presses) -> Real:
        return fitting.covariances(self.model, known.at, fitting.Data.unread(presses, self.noise), known.components)
