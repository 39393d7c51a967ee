"""Readings for a calibration: known presses out of recordings, and meters' of electrodes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import hypot, isfinite
from math import log as ln
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sensorgen.analysis.comparison import Comparison, allowed, of_iteration
from sensorgen.core.arrays import Complex, Real
from sensorgen.core.errors import BadInput, SensorgenError, within
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import BodyOf
from sensorgen.measure import accuracy
from sensorgen.measure.immittance import NEVER_NEGATIVE, pair, quantity_of
from sensorgen.measure.log import BenchRun, Log, Reading
from sensorgen.measure.log.bench import read_again
from sensorgen.measure.recording import joined_all
from sensorgen.measure.signal.presses import Pairs
from sensorgen.measure.signal.run import processed
from sensorgen.prediction.calibration.fitting import Data, MeterReadings
from sensorgen.prediction.calibration.rest import checked
from sensorgen.prediction.calibration.specimen import Presses, no_presses
from sensorgen.prediction.inference import NORMAL_90, whitening
from sensorgen.prediction.query import TONES_HZ

_LEAST_ERROR = 3e-4  # of a mean at rest: from one recording to the next it differs by more than its noise
_UNMEASURED = 1e3  # standard deviation of what was never measured [-]
_SHORTEST_S = 0.1  # of a hold: its logarithm counts


def known_presses(log: Log, name: str, rows: Sequence[BenchRun]) -> tuple[Data, Real, list[str]]:
    """Presses of known force and position, the tones, and what was left out.

    Parameters
    ----------
    log : Log
        An open one.
    name : str
        Of the specimen.
    rows : sequence of BenchRun
        Its recordings.

    Raises
    ------
    BadInput
        No recording that can be used; recordings of different tones.
    """
    if not rows:
        raise BadInput(
            f"the log has no recording of {name}; expected one: sensorgen log bench {name!r} LCR_FILE RIG_FILE"
        )
    runs, left_out = list[_Run](), list[str]()
    for row in rows:
        try:
            runs += _runs(log, row, left_out)
        except SensorgenError as error:
            left_out.append(f"recording {row.number} left out: {error}")
    if not runs:
        raise BadInput(f"{name}: none of {len(rows)} recordings can be used: {'; '.join(left_out)[:500]}")
    with within(f"{name}: recordings at different tones; name those to use, --recording"):
        alike = [run.ordered(checked(run.tones_hz, runs[0].tones_hz)) for run in runs]
    return _data(alike), runs[0].tones_hz, left_out


@dataclass(frozen=True, eq=False)
class _Run:
    """Tones of a recording, its known presses, and its mean reading at rest with that one's relative error."""

    tones_hz: Real
    pairs: Pairs | None
    rest_ohm: Complex
    noise: Real

    def ordered(self, order: NDArray[np.intp]) -> "_Run":
        """The run with its tones in an order."""
        columns = ("before_ohm", "pressed_ohm", "difference_ohm", "error_ohm")
        pairs = self.pairs and replace(self.pairs, **{name: getattr(self.pairs, name)[:, order] for name in columns})
        return _Run(self.tones_hz[order], pairs, self.rest_ohm[order], self.noise[order])


def _runs(log: Log, row: BenchRun, left_out: list[str]) -> Iterator[_Run]:
    """Runs of a recording; notes on what is left out of them."""
    parts, rig = read_again(log, row)
    for part in parts:
        for recording, with_rig in zip(
            part, joined_all(part, rig) if rig is not None else [None] * len(part), strict=True
        ):
            result = processed(recording, with_rig, remove_drift=False)
            left_out += [f"recording {row.number}: {note}" for note in result.left_out]
            pairs = result.pairs if result.by_force else None
            if with_rig is not None and np.isnan(with_rig.clocks.offset_error_s):
                left_out.append(f"recording {row.number}: {with_rig.clocks.words()}")
                pairs = pairs if np.isfinite(recording.clock.epoch_s) else None
            yield _Run(recording.tones_hz, pairs, *_rest(result.rest_ohm()))


def nothing_recorded() -> Data:
    """Of a specimen that was never on the bench: no press, nothing known at the tones of the thesis's multi-sine."""
    m = len(TONES_HZ)
    return Data.unread(no_presses(), np.zeros(m), rest_noise=np.full(m, _UNMEASURED))


def _rest(z: Complex) -> tuple[Complex, Real]:
    """Mean of readings with nothing on the sensor, and its relative standard error."""
    if not len(z):
        raise BadInput("no reading at rest; expected one or more")
    mean = z.mean(axis=0)
    return mean, np.maximum(z.std(axis=0) / np.abs(mean) / np.sqrt(2 * len(z)), _LEAST_ERROR)


def _data(runs: Sequence[_Run]) -> Data:
    weight = np.array([1 / run.noise**2 for run in runs])
    rest = np.einsum("km,km->m", weight, [np.log(run.rest_ohm) for run in runs]) / weight.sum(0)
    rest_noise, pairs = 1 / np.sqrt(weight.sum(0)), [run.pairs for run in runs if run.pairs is not None]
    if not pairs:
        return Data.unread(no_presses(), np.zeros(len(rest)), rest, rest_noise)

    def all_of(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(one, name) for one in pairs])

    force, position, peak = (all_of(name) for name in ("force_n", "position_mm", "peak_n"))
    known = np.isfinite(force) & np.isfinite(position)
    before, pressed, error = (all_of(name)[known] for name in ("before_ohm", "pressed_ohm", "error_ohm"))
    decades = np.log10(np.maximum(all_of("hold_s"), _SHORTEST_S))
    presses = Presses(force, position * M_PER_MM, 1 - force / np.maximum(peak, force), decades).rows(known)
    noise = np.abs(error) / np.abs(before) / np.sqrt(2)
    means = np.sqrt((1 / all_of("samples")).sum(-1))[known]
    single = np.median(noise / means[:, None], axis=0) * np.sqrt(1.1) if len(noise) else None  # over ten at rest
    return Data(presses, np.log(pressed / before), noise, rest, rest_noise, single)


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
    left_out = list[str]()
    measured = [each for one in counted for each in _alternating(one, left_out)]
    return _meter(measured, _ln_resistance(comparison, counted, resistivity_ohm_m)), counted, left_out


def _ln_resistance(
    comparison: Comparison, readings: Sequence[Reading], resistivity_ohm_m: float
) -> tuple[float, float] | None:
    """Mean of ln of the resistivities that readings allow over the predicted one, and its standard deviation."""
    numbers = {one.number for one in readings}
    ranges = [
        each for row in comparison.direct if row.predicted and row.reading.number in numbers
        and (each := allowed(row, comparison.bodies[row.predicted.design]))
    ]  # fmt: skip
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
