"""Identifiability: how precisely a sensor's impedance determines force and position, and what would improve it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import OutOfRange
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.identifiability import changes, fisher, frequencies, results, verdict
from sensorgen.prediction.identifiability.fisher import LeastErrors, Setup
from sensorgen.prediction.identifiability.results import Identifiability, StandardErrors, cartesian, finite
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
    slopes = fisher.slopes(sensor, setup.frequency_hz, force_n, setup.position_m)
    limits, need, reason = fisher.bounds(slopes, noise), verdict.required(setup), fisher.undefined(setup, slopes)
    helpful = changes.most_helpful(setup, need)
    together = changes.together(setup, helpful) if helpful else None
    stiff = setup.on(stiffest).bounds() if stiffest else None
    calibrated, uncalibrated = _on_a_bench(setup)
    return Identifiability(
        **vars(fisher.standard_errors(limits)), noise=noise, press=_press(setup),
        corner_frequency_hz=sensor.corner_frequency_hz() if sensor.resistance_ohm() else None,
        required=need.errors(), reason=reason, assumed=assumed or None,
        senses_force=None if assumed else need.force(float(limits.force_n)),
        locates=None if assumed else need.position(float(limits.position_m)),
        verdict=verdict.verdict(setup, limits, need, reason),
        stiffest=results.Stiffest(
            **vars(fisher.standard_errors(stiff)), verdict=verdict.bracket(limits, stiff, need)
        ) if stiff else None,
        frequencies=_frequencies(setup, slopes), map=_map(setup, need),
        best_frequencies=frequencies.best(setup, slopes, need), advised_frequencies=frequencies.advised(setup, need),
        changes=tuple(one.result() for one in helpful),
        changes_together=fisher.standard_errors(together) if together else None,
        calibrated=calibrated, uncalibrated=uncalibrated,
    )  # fmt: skip


def _press(setup: Setup) -> results.ReferencePress:
    sensor = setup.sensor
    stress = sensor.stress_pa(setup.force_n, setup.position_m)
    strain = float(sensor.compression.capacitive_strain(stress)[0])
    return results.ReferencePress(setup.force_n, setup.position_m, sensor.tip_m, float(stress), strain)


def _on_a_bench(setup: Setup) -> tuple[StandardErrors, StandardErrors] | tuple[None, None]:
    """Errors of a specimen, with a calibration and without."""
    from sensorgen.prediction.calibration.outlook import outlook

    errors = outlook(setup.sensor, np.array(setup.frequency_hz), setup.noise, setup.force_n, setup.position_m)
    if errors is None:
        return None, None
    calibrated, uncalibrated = (
        StandardErrors(sigma_force_n=_rounded(force), sigma_position_m=_rounded(position))
        for force, position in np.array(errors).tolist()
    )
    return calibrated, uncalibrated


def _rounded(error: float) -> float | None:
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


def _frequencies(setup: Setup, slopes: fisher.Slopes) -> tuple[results.FrequencyInformation, ...]:
    z = setup.sensor.impedance(np.array(setup.frequency_hz), setup.force_n, setup.position_m)
    columns = (setup.frequency_hz, z, *slopes, *fisher.shares(slopes))
    return tuple(
        results.FrequencyInformation(
            f, float(abs(ohm)), cartesian(a * ohm), cartesian(b * ohm), cartesian(a), cartesian(b), finite(of_force),
            finite(of_position),
        )
        for f, ohm, a, b, of_force, of_position in zip(*columns, strict=True)
    )  # fmt: skip


def surface(setup: Setup, force_n: Real, position_m: Real) -> LeastErrors:
    """Bounds over forces (rows, [N]) and positions (columns, [m]); nan where undefined or the electrodes touch."""
    force, place = np.broadcast_arrays(force_n[:, None], position_m)
    valid = fisher.bearable(setup.sensor, force, place)
    slopes = fisher.slopes(setup.sensor, setup.frequency_hz, np.where(valid, force, 0.0), place)
    return LeastErrors(*(np.where(valid, value, np.nan) for value in fisher.bounds(slopes, setup.noise)))


def _map(setup: Setup, need: verdict.Required) -> results.ErrorMap:
    force = np.linspace(0.0, setup.force_n, MAP_FORCES)
    place = np.linspace(0.0, setup.sensor.length_m, MAP_POSITIONS)
    limits = surface(setup, force, place)
    pressed = force != 0
    rows_n, rows_m = (
        tuple(tuple(finite(value) for value in row) for row in sigma) for sigma in (limits.force_n, limits.position_m)
    )
    doubt = setup.sensor.compression.doubt(float(setup.sensor.stress_pa(force[:, None], place).max()))
    summaries = (
        _summary(sigma[pressed], serves, force[pressed], place)
        for sigma, serves in ((limits.force_n, need.force_n), (limits.position_m, need.position_m))
    )
    return results.ErrorMap(tuple(force.tolist()), tuple(place.tolist()), rows_n, rows_m, doubt, *summaries)


def _summary(sigma: Real, serves: float, force_n: Real, position_m: Real) -> results.ErrorSummary:
    if np.isnan(sigma).all():
        return results.ErrorSummary(None, None, None, None, LIGHT_N, 0.0)
    row, column = np.unravel_index(np.nanargmax(sigma), sigma.shape)
    counted = np.abs(force_n) >= min(LIGHT_N, np.abs(force_n).max())
    return results.ErrorSummary(
        float(np.nanmedian(sigma)), float(sigma[row, column]), float(force_n[row]), float(position_m[column]),
        from_force_n=float(np.abs(force_n[counted]).min()), share_known=float(np.mean(sigma[counted] <= serves)),
    )  # fmt: skip
