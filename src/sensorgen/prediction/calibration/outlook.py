"""Outlook on a press after a calibration, before there is a specimen."""

from dataclasses import replace

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import SensorgenError
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.calibration.fitting import Data, Posterior, information, prior, usual_components
from sensorgen.prediction.calibration.inversion import readings
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
        before = prior(model, sigma)
        return _errors(model, _planned(model, before, force_n), force_n, position_m), _errors(
            model, before, force_n, position_m
        )
    except SensorgenError:
        return None


def _planned(model: SpecimenModel, before: Posterior, force_n: float) -> Posterior:
    """Knowledge after presses up to a force, all over the strip, half of them after a higher one."""
    k: Real = np.arange(1.0, PRESSES + 1)
    length, half = model.sensor.length_m, model.sensor.tip_m / 2
    presses = Presses(
        force_n * (0.05 + 0.95 * k / PRESSES), half + (length - 2 * half) * (k * _GOLDEN % 1),
        np.where(k % 2 == 0, 0.3, 0.0), -0.5 + 2 * (k * _SILVER % 1),
    )  # fmt: skip
    data = Data.unread(presses, before.noise, rest_noise=before.noise / PRESSES**0.5)
    usual = usual_components(model)
    known = information(model, data, before.at, usual) + before.information
    scatter, wander, _ = usual.tolist()
    return replace(
        before, covariance=np.asarray(np.linalg.inv(known)), scatter=scatter, wander_c=wander, wander_r=wander,
        presses=PRESSES,
    )  # fmt: skip


def _errors(model: SpecimenModel, known: Posterior, force_n: float, position_m: float) -> Real:
    force = force_n * np.array([1 - _STEP, 1, 1 + _STEP])
    place = np.clip(position_m + model.sensor.length_m * np.array([-_STEP, 0, _STEP]), 0, model.sensor.length_m)
    mean, covariance = readings(model, known, force, place)
    at = mean.reshape(3, 3, -1)
    slopes = np.stack([(at[2, 1] - at[0, 1]) / (force[2] - force[0]), (at[1, 2] - at[1, 0]) / (place[2] - place[0])])
    by_force, by_position = slopes @ whitening(covariance[4]).T
    return np.asarray(np.nan_to_num(cramer_rao(by_force, by_position, _PARALLEL)[:2], nan=np.inf))
