"""Identifiability: how precisely a sensor's impedance determines force and position, and what would improve it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import OutOfRange
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.identifiability import changes, frequencies
from sensorgen.prediction.identifiability.fisher import (
    Bounds,
    Setup,
    Slopes,
    bearable,
    bounds,
    shares,
    slopes,
    standard_errors,
    undefined,
)
from sensorgen.prediction.identifiability.results import (
    ErrorMap,
    ErrorSummary,
    FrequencyInformation,
    Identifiability,
    ReferencePress,
    StandardErrors,
    Stiffest,
    cartesian,
    finite,
)
from sensorgen.prediction.identifiability.verdict import Required, bracket, required, verdict
from sensorgen.prediction.query import FORCE_N, NOISE

HIGHEST_HZ = 1e6  # assumed of the bridge; its oscilloscope (TiePie HS5-540) reaches far more
LIGHT_N = 1.0  # smaller forces do not count in the shares of presses that are known
MAP_FORCES, MAP_POSITIONS = 7, 21


def identify(
    sensor: Sensor,
    frequency_hz: Sequence[float],
    noise: float = NOISE,
    *,
    force_n: float = FORCE_N,
    position_m: float | None = None,
    highest_hz: float = HIGHEST_HZ,
    stiffest: Sensor | None = None,
    assumed: str = "",
) -> Identifiability:
    """Cramer-Rao bounds of force and position, which frequencies carry the information, and what would improve them.

    Parameters
    ----------
    sensor : Sensor
        That is pressed.
    frequency_hz : sequence of float
        Frequencies of the readings [Hz].
    noise : float
        Standard deviation of Re Z and of Im Z at each frequency, each, relative to abs(Z) [-].
    force_n : float
        Reference force, and the greatest of the map [N].
    position_m : float
        Centre of the tip; the middle of the sensor unless given [m].
    highest_hz : float
        Highest frequency of the instrument [Hz].
    stiffest : Sensor
        The same sensor by its stiffest law of compression, where ``sensor`` has the softest (a plate).
    assumed : str
        Assumption on the law of compression of a cell that was not solved; the verdict is then conditional.

    Raises
    ------
    OutOfRange
        No frequency; a noise that is not above 0; a press that the sensor cannot take.

    Notes
    -----
    Force is *sensed* where its standard error (:mod:`sensorgen.prediction.identifiability.fisher`) is a tenth of the
    force or less, a press *located* where it is the tip's length or less; a quantity is not sensed where the error is
    that of a uniform distribution (range over the root of 12), and "roughly" in between.
    """
    setup = replace(_setup(sensor, frequency_hz, noise, force_n, position_m, highest_hz), assumed=assumed)
    found = slopes(sensor, setup.frequency_hz, force_n, setup.position_m)
    limits, need, reason = bounds(found, noise), required(setup), undefined(setup, found)
    tried = changes.most_helpful(setup, need)
    together = changes.together(setup, tried) if tried else None
    stiff = setup.on(stiffest).bounds() if stiffest else None
    stress = sensor.stress_pa(force_n, setup.position_m)
    strain = float(sensor.compression.capacitive_strain(stress)[0])
    calibrated, uncalibrated = _on_a_bench(setup)
    return Identifiability(
        **vars(standard_errors(limits)),
        noise=noise,
        press=ReferencePress(force_n, setup.position_m, sensor.tip_m, float(stress), strain),
        corner_frequency_hz=sensor.corner_frequency_hz() if sensor.resistance_ohm() else None,
        required=need.errors(),
        reason=reason,
        assumed=assumed or None,
        senses_force=None if assumed else need.force(float(limits.force_n)),
        locates=None if assumed else need.position(float(limits.position_m)),
        verdict=verdict(setup, limits, need, reason),
        stiffest=Stiffest(**vars(standard_errors(stiff)), verdict=bracket(limits, stiff, need)) if stiff else None,
        frequencies=_frequencies(setup, found),
        map=_map(setup, need),
        best_frequencies=frequencies.best(setup, found, need),
        advised_frequencies=frequencies.advised(setup, need),
        changes=tuple(one.result() for one in tried),
        changes_together=standard_errors(together) if together else None,
        calibrated=calibrated,
        uncalibrated=uncalibrated,
    )


def _on_a_bench(setup: Setup) -> tuple[StandardErrors, StandardErrors] | tuple[None, None]:
    """Errors of a specimen, with a calibration and without."""
    from sensorgen.prediction.calibration.outlook import outlook

    found = outlook(setup.sensor, np.array(setup.frequency_hz), setup.noise, setup.force_n, setup.position_m)
    if found is None:
        return None, None
    with_, without = (
        StandardErrors(sigma_force_n=_told(f), sigma_position_m=_told(x)) for f, x in (ends.tolist() for ends in found)
    )
    return with_, without


def _told(error: float) -> float | None:
    """A standard error to four digits, the same on every machine; None of an infinite one."""
    return float(f"{error:.4g}") if np.isfinite(error) else None


def _setup(
    sensor: Sensor, given: Sequence[float], noise: float, force_n: float, position_m: float | None, highest_hz: float
) -> Setup:
    frequency_hz = tuple(float(f) for f in given)
    if not frequency_hz:
        raise OutOfRange("no frequencies to read the sensor at: expected at least one frequency")
    for name, value in (("noise", noise), ("the instrument's highest frequency", highest_hz)):
        if not 0 < value < np.inf:
            raise OutOfRange(f"{name} is {value:g}; expected a number above 0")
    centre = sensor.length_m / 2 if position_m is None else position_m
    return Setup(sensor, frequency_hz, noise, force_n, centre, max(highest_hz, *frequency_hz))


def _frequencies(setup: Setup, found: Slopes) -> tuple[FrequencyInformation, ...]:
    z = setup.sensor.impedance(np.array(setup.frequency_hz), setup.force_n, setup.position_m)
    of_force, of_position = shares(found)
    return tuple(
        FrequencyInformation(
            frequency_hz=f,
            magnitude_ohm=float(abs(z[k])),
            by_force_ohm_per_n=cartesian(by_force * z[k]),
            by_position_ohm_per_m=cartesian(by_position * z[k]),
            relative_by_force_per_n=cartesian(by_force),
            relative_by_position_per_m=cartesian(by_position),
            share_of_force_information=finite(of_force[k]),
            share_of_position_information=finite(of_position[k]),
        )
        for k, (f, by_force, by_position) in enumerate(zip(setup.frequency_hz, *found, strict=True))
    )


def surface(setup: Setup, force_n: Real, position_m: Real) -> Bounds:
    """Bounds over forces (rows, [N]) and positions (columns, [m]); nan where undefined or the electrodes touch."""
    force, place = np.broadcast_arrays(force_n[:, None], position_m)
    valid = bearable(setup.sensor, force, place)
    found = slopes(setup.sensor, setup.frequency_hz, np.where(valid, force, 0.0), place)
    return Bounds(*(np.where(valid, value, np.nan) for value in bounds(found, setup.noise)))


def _map(setup: Setup, need: Required) -> ErrorMap:
    force = np.linspace(0.0, setup.force_n, MAP_FORCES)
    place = np.linspace(0.0, setup.sensor.length_m, MAP_POSITIONS)
    limits = surface(setup, force, place)
    pressed = force != 0
    rows_n, rows_m = (
        tuple(tuple(finite(value) for value in row) for row in sigma) for sigma in (limits.force_n, limits.position_m)
    )
    return ErrorMap(
        force_n=tuple(force.tolist()),
        position_m=tuple(place.tolist()),
        sigma_force_n=rows_n,
        sigma_position_m=rows_m,
        doubt=setup.sensor.compression.doubt(float(setup.sensor.stress_pa(force[:, None], place).max())),
        of_force=_summary(limits.force_n[pressed], need.force_n, force[pressed], place),
        of_position=_summary(limits.position_m[pressed], need.position_m, force[pressed], place),
    )


def _summary(sigma: Real, serves: float, force_n: Real, position_m: Real) -> ErrorSummary:
    if np.isnan(sigma).all():
        return ErrorSummary(None, None, None, None, LIGHT_N, 0.0)
    row, column = np.unravel_index(np.nanargmax(sigma), sigma.shape)
    counted = np.abs(force_n) >= min(LIGHT_N, np.abs(force_n).max())
    return ErrorSummary(
        median=float(np.nanmedian(sigma)),
        worst=float(sigma[row, column]),
        worst_force_n=float(force_n[row]),
        worst_position_m=float(position_m[column]),
        from_force_n=float(np.abs(force_n[counted]).min()),
        share_known=float(np.mean(sigma[counted] <= serves)),
    )
