"""What meters said of a specimen: resistance along an electrode, AC quantities between the electrodes."""

from collections.abc import Iterator, Sequence
from math import hypot, isfinite
from math import log as ln
from typing import NamedTuple

import numpy as np

from sensorgen.analysis.comparison import of_iteration
from sensorgen.analysis.comparison.allowed import allowed
from sensorgen.core.arrays import Complex, Real
from sensorgen.design.body import BodyOf
from sensorgen.measure import accuracy
from sensorgen.measure.immittance import NEVER_NEGATIVE, pair, quantity_of
from sensorgen.measure.log import Log, Reading
from sensorgen.prediction.calibration.fitting import Meter
from sensorgen.prediction.inverse.verdict import NORMAL_90

_R, _X = 0.05, 0.02  # a specimen's resistance and reactance differ by as much from session to session [-]
_UNKNOWN = 0.01  # of abs(Z): standard uncertainty of a meter that nothing is known of
_LN = 0.3  # relative uncertainty up to which a value's logarithm is taken


def readings_of(log: Log, name: str, body_of: BodyOf, resistivity_ohm_m: float) -> tuple[Meter | None, list[Reading]]:
    """Readings of a specimen in the state that it was last read in, baked or not; and those that count.

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
    logged = list(log.entries(Reading, specimen=name))
    if not logged:
        return None, []
    state = logged[-1].baked
    counted = [one for one in logged if one.baked == state]
    found = of_iteration(log, None, body_of=body_of, specimens=[name])
    numbers = {one.number for one in counted}
    ranges = [
        each for row in found.direct if row.predicted and row.reading.number in numbers
        and (each := allowed(row, found.bodies[row.predicted.design]))
    ]  # fmt: skip
    ln_resistance = None
    if ranges:
        low, high = (float(np.mean([getattr(each, end) for each in ranges])) for end in ("low", "high"))
        ln_resistance = (low + high) / 2 - ln(resistivity_ohm_m), hypot((high - low) / 2 / NORMAL_90, _R)
    return _meter([said for one in counted for said in _alternating(one)], ln_resistance), counted


class _Said(NamedTuple):
    """A quantity at one frequency, and what is uncertain of it."""

    quantity: str
    frequency_hz: float
    value: float
    error: float  # standard uncertainty of the measurement
    by_r: float  # change with the resistance's from session to session
    by_x: float  # with the reactance's


def _alternating(reading: Reading) -> Iterator[_Said]:
    """AC quantities that a passive specimen can have: of a pair and more, the pair."""
    for f in sorted(set(reading.frequency_hz)):
        at = accuracy.at_frequency(reading, f)
        z = at.z_ohm
        for quantity in pair(at.values) or at.values:
            value, error = vars(at.value(quantity)).values()
            if value == 0 or (value < 0 and quantity in NEVER_NEGATIVE):
                continue
            if z is None:
                by_r, by_x = abs(value) * _R, 0.0
                error = error if isfinite(error) else abs(value) * _UNKNOWN
            else:
                ends = quantity_of(quantity, [z, z + _R * z.real, z + 1j * _X * z.imag], f)
                by_r, by_x = (ends[1:] - ends[0]).tolist()
                error = error if isfinite(error) else accuracy.uncertainty(_UNKNOWN, quantity, value, z)
            yield _Said(quantity, f, value, error, by_r, by_x)


def _meter(said: Sequence[_Said], ln_resistance: tuple[float, float] | None) -> Meter | None:
    if not said and not ln_resistance:
        return None
    value, error, by_r, by_x = (np.array([one[k] for one in said], float) for k in range(2, 6))
    as_ln = (value > 0) & (np.hypot(error, np.hypot(by_r, by_x)) < _LN * value)
    unit = np.where(as_ln, np.abs(value), 1.0)

    def scaled(values: Real) -> Real:
        return np.where(as_ln, np.log(np.where(as_ln, np.maximum(values, 1e-300), 1.0)), values)

    def observed(z: Complex) -> Real:
        columns = [quantity_of(one.quantity, z[..., k], one.frequency_hz) for k, one in enumerate(said)]
        return scaled(np.stack(columns, -1)) if columns else np.empty((*z.shape[:-1], 0))

    covariance = np.diag((error / unit) ** 2) + sum(np.outer(by, by) for by in (by_r / unit, by_x / unit))
    root = np.linalg.inv(np.linalg.cholesky(covariance))
    return Meter(np.array([one.frequency_hz for one in said]), observed, scaled(value), root, ln_resistance)
