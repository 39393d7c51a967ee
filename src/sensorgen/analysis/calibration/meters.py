"""Readings of meters for a calibration: resistance along an electrode, AC quantities between the electrodes."""

from collections.abc import Iterator, Sequence
from math import hypot, isfinite
from math import log as ln
from typing import NamedTuple

import numpy as np

from sensorgen.analysis.comparison import of_iteration
from sensorgen.analysis.comparison.allowed import AllowedValues, allowed
from sensorgen.core.arrays import Complex, Real
from sensorgen.design.body import BodyOf
from sensorgen.measure import accuracy
from sensorgen.measure.immittance import NEVER_NEGATIVE, pair, quantity_of
from sensorgen.measure.log import Log, Reading
from sensorgen.prediction.calibration.fitting import MeterReadings
from sensorgen.prediction.inference import whitening
from sensorgen.prediction.inverse.verdict import NORMAL_90

_R, _X = 0.05, 0.02  # a specimen's resistance and reactance differ by as much from session to session [-]
_UNKNOWN = 0.01  # of abs(Z): standard uncertainty of a meter that nothing is known of
_FINEST = 1e-6  # relative uncertainty below which no meter is
_OF_R = ("R", "Rp", "G", "D", "Q")  # quantities that follow the resistance, where no pair makes an impedance
_LN = 0.3  # relative uncertainty up to which a value's logarithm is taken


def readings_of(
    log: Log, name: str, body_of: BodyOf, resistivity_ohm_m: float
) -> tuple[MeterReadings | None, list[Reading], list[str]]:  # fmt: skip
    """Readings of a specimen in the state that it was last read in, baked or not; those that count; what does not.

    Parameters
    ----------
    log : Log
        An open one.
    name : str
        Of the specimen.
    body_of : callable
        Makes the body of a design.
    resistivity_ohm_m : float
        As predicted [ohm m].
    """
    logged = [one for one in log.entries(Reading, specimen=name) if one.value or one.y_ohm or one.z_ohm]
    if not logged:
        return None, [], []
    state = logged[-1].baked
    counted = [one for one in logged if one.baked == state]
    comparison = of_iteration(log, None, body_of=body_of, specimens=[name])
    numbers = {one.number for one in counted}
    ranges = [
        each for row in comparison.direct if row.predicted and row.reading.number in numbers
        and (each := allowed(row, comparison.bodies[row.predicted.design]))
    ]  # fmt: skip
    left_out = list[str]()
    measured = [each for one in counted for each in _alternating(one, left_out)]
    return _meter(measured, _ln_resistance(ranges, resistivity_ohm_m)), counted, left_out


def _ln_resistance(ranges: Sequence[AllowedValues], resistivity_ohm_m: float) -> tuple[float, float] | None:
    """Mean of ln of resistivities over the predicted one, and its standard deviation."""
    if not ranges:
        return None
    low, high = (float(np.mean([getattr(each, end) for each in ranges])) for end in ("low", "high"))
    return (low + high) / 2 - ln(resistivity_ohm_m), hypot((high - low) / 2 / NORMAL_90, _R)


class _Measured(NamedTuple):
    """A quantity at one frequency, and what is uncertain of it."""

    quantity: str
    frequency_hz: float
    value: float
    error: float  # standard uncertainty of the measurement
    by_r: float  # change with the resistance's from session to session
    by_x: float  # with the reactance's


def _alternating(reading: Reading, left_out: list[str]) -> Iterator[_Measured]:
    """AC quantities that a capacitor can have: of a pair and more, the pair."""
    for f in sorted(set(reading.frequency_hz)):
        at = accuracy.at_frequency(reading, f)
        z = at.z_ohm
        if at.impedances and z is not None and not (z.real > 0 > z.imag):
            what = "a negative resistance" if z.real <= 0 else "no capacitor"
            left_out.append(f"reading {reading.number} at {f:g} Hz left out: {what} (X = {z.imag:.3g} ohm)")
            continue
        for quantity in pair(at.values) or at.values:
            if one := _quantity(at, quantity, f):
                yield one


def _quantity(at: accuracy.At, quantity: str, frequency_hz: float) -> _Measured | None:
    """A quantity with what is uncertain of it; None where its value or uncertainty is none that a capacitor has."""
    value, error = vars(at.value(quantity)).values()
    if not isfinite(value) or value == 0 or (value < 0 and quantity in NEVER_NEGATIVE):
        return None
    by_r, by_x, unknown = _changes(at, quantity, value, frequency_hz)
    if at.meter is None and not at.stated.get(quantity):  # repeats alone do not say what is common to them
        error = hypot(np.nan_to_num(error), unknown)
    error = max(error if isfinite(error) else unknown, _FINEST * abs(value))
    whole = np.isfinite([error, by_r, by_x]).all()
    return _Measured(quantity, frequency_hz, value, error, by_r, by_x) if whole else None


def _changes(at: accuracy.At, quantity: str, value: float, frequency_hz: float) -> tuple[float, float, float]:
    """Changes from session to session, by resistance and by reactance, and the uncertainty of an unknown meter."""
    z = at.z_ohm
    if not at.impedances or z is None:
        of_r = quantity in _OF_R
        return abs(value) * _R * of_r, abs(value) * _X * (not of_r), abs(value) * _UNKNOWN
    ends = quantity_of(quantity, [z, z + _R * z.real, z + 1j * _X * z.imag], frequency_hz)
    by_r, by_x = (ends[1:] - ends[0]).tolist()
    return by_r, by_x, accuracy.uncertainty(_UNKNOWN, quantity, value, z)


def _meter(measured: Sequence[_Measured], ln_resistance: tuple[float, float] | None) -> MeterReadings | None:
    if not measured and not ln_resistance:
        return None
    value, error, by_r, by_x = (np.array([one[k] for one in measured], float) for k in range(2, 6))
    magnitude = np.array([one.quantity in NEVER_NEGATIVE for one in measured], bool)
    as_ln = magnitude & (value > 0) & (np.hypot(error, np.hypot(by_r, by_x)) < _LN * value)
    unit = np.where(as_ln, np.abs(value), 1.0)

    def scaled(values: Real) -> Real:
        return np.where(as_ln, np.log(np.where(as_ln, np.maximum(values, 1e-300), 1.0)), values)

    def observed(z: Complex) -> Real:
        columns = [quantity_of(one.quantity, z[..., k], one.frequency_hz) for k, one in enumerate(measured)]
        return scaled(np.stack(columns, -1)) if columns else np.empty((*z.shape[:-1], 0))

    covariance = np.diag((error / unit) ** 2) + sum(np.outer(by, by) for by in (by_r / unit, by_x / unit))
    frequency_hz = np.array([one.frequency_hz for one in measured])
    return MeterReadings(frequency_hz, observed, scaled(value), whitening(covariance), ln_resistance)
