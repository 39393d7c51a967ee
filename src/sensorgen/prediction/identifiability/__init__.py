"""The identifiability card: what a sensor's impedance tells of force and position, and what would make it tell more."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import OutOfRange
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.identifiability import changes, tones
from sensorgen.prediction.identifiability.fisher import (
    Bounds,
    Real,
    Setup,
    Slopes,
    bearable,
    bounds,
    shares,
    slopes,
    undefined,
)
from sensorgen.prediction.identifiability.verdict import Required, bracket, required, verdict

NOISE = 1e-3
FORCE_N = 6.0  # thesis 5.2: presses of 0 to 6 N
HIGHEST_HZ = 1e6  # assumed of the bridge; its oscilloscope (TiePie HS5-540) gives far more
LIGHT_N = 1.0  # presses from here on are counted as located or not
MAP_FORCES, MAP_POSITIONS = 7, 21


def card(
    sensor: Sensor,
    frequency_hz: Sequence[float],
    noise: float = NOISE,
    *,
    force_n: float = FORCE_N,
    position_m: float | None = None,
    highest_hz: float = HIGHEST_HZ,
    stiffest: Sensor | None = None,
    assumed: str = "",
) -> dict[str, Any]:
    """What impedance tells of force and position, as plain data in SI units; None where a number is undefined.

    Parameters
    ----------
    sensor : Sensor
        What is pressed.
    frequency_hz : sequence of float
        Tones [Hz].
    noise : float
        Standard deviation of Re Z and of Im Z at each tone, each, as a share of abs(Z) [-].
    force_n : float
        The press that numbers are stated for, and the greatest of the map [N].
    position_m : float
        Its place; the middle unless given [m].
    highest_hz : float
        Highest tone that the instrument can give [Hz].
    stiffest : Sensor
        The same sensor by its stiffest law of compression, where ``sensor`` has the softest (a plate).
    assumed : str
        What is taken for granted of how the film gives way, where nobody solved it; the verdict then hangs on it.

    Raises
    ------
    OutOfRange
        No tone; a noise that is not above 0; a press that the sensor cannot take.

    Notes
    -----
    Cramer-Rao bounds (:mod:`sensorgen.prediction.identifiability.fisher`). Force is *sensed* where its
    standard error is a tenth of the press or less, a press *located* where it is a tip's length or less;
    a quantity is not sensed where the error is
    that of a blind guess (range over the root of 12), and "roughly" in between.
    """
    setup = replace(_setup(sensor, frequency_hz, noise, force_n, position_m, highest_hz), assumed=assumed)
    found = slopes(sensor, setup.frequency_hz, force_n, setup.position_m)
    limits, need, reason = bounds(found, noise), required(setup), undefined(setup, found)
    advised = changes.most_helpful(setup, need)
    stiff = setup.on(stiffest).bounds() if stiffest else None
    return {
        "noise": noise,
        "press": _press(setup),
        "corner_frequency_hz": sensor.corner_frequency_hz() if sensor.resistance_ohm() else None,
        "required": {"sigma_force_n": need.force_n, "sigma_position_m": need.position_m},
        **_sigma(limits),
        "reason": reason,
        "assumed": assumed or None,
        "senses_force": None if assumed else need.force(float(limits.force_n)),
        "locates": None if assumed else need.position(float(limits.position_m)),
        "verdict": verdict(setup, limits, need, reason),
        "stiffest": stiff and {**_sigma(stiff), "verdict": bracket(limits, stiff, need)},
        "tones": _tones(setup, found),
        "map": _map(setup, need),
        "best_tones": tones.best(setup, found, need),
        "advised_tones": tones.advised(setup, need),
        "changes": [tried.as_dict() for tried in advised],
        "changes_together": _together(setup, advised),
    }


def _setup(
    sensor: Sensor, given: Sequence[float], noise: float, force_n: float, position_m: float | None, highest_hz: float
) -> Setup:
    frequency_hz = tuple(float(f) for f in given)
    if not frequency_hz:
        raise OutOfRange("no tones to read the sensor by: expected at least one frequency")
    for name, value in (("noise", noise), ("the instrument's highest frequency", highest_hz)):
        if not 0 < value < np.inf:
            raise OutOfRange(f"{name} is {value:g}; expected a number above 0")
    place = sensor.length_m / 2 if position_m is None else position_m
    return Setup(sensor, frequency_hz, noise, force_n, place, max(highest_hz, *frequency_hz))


def _press(setup: Setup) -> dict[str, float]:
    stress = setup.sensor.stress_pa(setup.force_n, setup.position_m)
    return {
        "force_n": setup.force_n,
        "position_m": setup.position_m,
        "tip_m": setup.sensor.tip_m,
        "stress_pa": float(stress),
        "thinning": float(setup.sensor.compression.capacitive_strain(stress)[0]),
    }


def _tones(setup: Setup, found: Slopes) -> list[dict[str, Any]]:
    z = setup.sensor.impedance(np.array(setup.frequency_hz), setup.force_n, setup.position_m)
    of_force, of_position = shares(found)
    return [
        {
            "frequency_hz": f,
            "magnitude_ohm": float(abs(z[k])),
            "by_force_ohm_per_n": _parts(found.by_force_per_n[k] * z[k]),
            "by_position_ohm_per_m": _parts(found.by_position_per_m[k] * z[k]),
            "relative_by_force_per_n": _parts(found.by_force_per_n[k]),
            "relative_by_position_per_m": _parts(found.by_position_per_m[k]),
            "share_of_force_information": _number(of_force[k]),
            "share_of_position_information": _number(of_position[k]),
        }
        for k, f in enumerate(setup.frequency_hz)
    ]


def surface(setup: Setup, force_n: Real, position_m: Real) -> Bounds:
    """Bounds over forces (rows, [N]) and positions (columns, [m]); nan where undefined or the film is pressed flat."""
    force, place = np.broadcast_arrays(force_n[:, None], position_m)
    taken = bearable(setup.sensor, force, place)
    found = slopes(setup.sensor, setup.frequency_hz, np.where(taken, force, 0.0), place)
    return Bounds(*(np.where(taken, value, np.nan) for value in bounds(found, setup.noise)))


def _map(setup: Setup, need: Required) -> dict[str, Any]:
    force = np.linspace(0.0, setup.force_n, MAP_FORCES)
    place = np.linspace(0.0, setup.sensor.length_m, MAP_POSITIONS)
    limits = surface(setup, force, place)
    pressed = force != 0
    return {
        "force_n": force.tolist(),
        "position_m": place.tolist(),
        "sigma_force_n": _rows(limits.force_n),
        "sigma_position_m": _rows(limits.position_m),
        "doubt": setup.sensor.compression.doubt(float(setup.sensor.stress_pa(force[:, None], place).max())),
        "of_force": _summary(limits.force_n[pressed], need.force_n, force[pressed], place),
        "of_position": _summary(limits.position_m[pressed], need.position_m, force[pressed], place),
    }


def _summary(sigma: Real, serves: float, force_n: Real, position_m: Real) -> dict[str, Any]:
    """Median and worst of standard errors over presses, and the share known well enough from ``LIGHT_N`` on."""
    if np.isnan(sigma).all():
        return {"median": None, "worst": None, "worst_at": None, "from_force_n": LIGHT_N, "share_known": 0.0}
    row, column = np.unravel_index(np.nanargmax(sigma), sigma.shape)
    counted = np.abs(force_n) >= min(LIGHT_N, np.abs(force_n).max())
    return {
        "median": float(np.nanmedian(sigma)),
        "worst": float(sigma[row, column]),
        "worst_at": {"force_n": float(force_n[row]), "position_m": float(position_m[column])},
        "from_force_n": float(np.abs(force_n[counted]).min()),
        "share_known": float(np.mean(sigma[counted] <= serves)),
    }


def _together(setup: Setup, advised: list[changes.Tried]) -> dict[str, float | None] | None:
    limits = changes.together(setup, advised) if advised else None
    return limits and _sigma(limits)


def _sigma(limits: Bounds) -> dict[str, float | None]:
    return {
        "sigma_force_n": _number(limits.force_n),
        "sigma_position_m": _number(limits.position_m),
        "correlation": _number(limits.correlation),
    }


def _parts(value: complex) -> dict[str, float]:
    return {"re": float(value.real), "im": float(value.imag)}


def _number(value: float | NDArray[Any]) -> float | None:
    return None if np.isnan(value) else float(value)


def _rows(values: Real) -> list[list[float | None]]:
    return [[_number(value) for value in row] for row in values]
