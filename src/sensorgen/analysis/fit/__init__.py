"""Material values out of what was measured, as a new source that the next prediction can take.

Specimens are held back: the values come from the others, and the errors before and after are of those held back.
"""

from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import chain
from math import log, nan, sqrt

import numpy as np

from sensorgen.analysis.calibration import Bench, SpecimenEntries, known
from sensorgen.analysis.comparison import AllowedValues, Compared, Comparison, allowed, of_iteration, usable
from sensorgen.analysis.comparison.expected import Movable, Predicted, at_rest
from sensorgen.analysis.fit import estimates
from sensorgen.analysis.fit.estimates import Error, Fit, Fitted, Untold
from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.core.lazy import by_key
from sensorgen.design.body import Body, BodyOf
from sensorgen.design.design import Design
from sensorgen.measure.log import BenchRun, Log, Reading
from sensorgen.measure.log.notes import asked
from sensorgen.prediction import bodies
from sensorgen.prediction.rest_state import electrode_resistance

HELD_BACK = 0.25  # of the specimens
SEED = 23
STEPS = ("readings", "recordings", "values", "errors")
_ACROSS = Untold("resistivity_ohm_m across", "nothing was measured across the electrodes: R_Y and Re Z run along them")


_Which = tuple[int | None, Sequence[str]]  # iteration, or specimens


def fit(
    log: Log, iteration: int | None, seed: int = SEED, body_of: BodyOf = bodies.default_body,
    step: Callable[[str], None] = lambda _: None, bench: Bench | None = None, *, specimens: Sequence[str] = (),
    held_share: float = HELD_BACK,
) -> Fit:  # fmt: skip
    """Fit material values to the readings and recordings of an iteration or of specimens.

    Parameters
    ----------
    log : Log
        An open one.
    iteration : int or None
        Of the design; None where specimens are given.
    seed : int
        Of the split between specimens that are fitted to and specimens that are held back.
    body_of : callable
        Makes the body of a design that the readings are of.
    step : callable
        Called with each of ``STEPS``, and with the name of each design to predict, before it is done.
    bench : Bench, optional
        Its tip and force.
    specimens : sequence of str
        Specimens as written, in place of an iteration.
    held_share : float
        Share of the specimens that are held back [-].

    Raises
    ------
    BadInput
        Nothing of them in the log that a fit could use; no such specimen.
    """
    step("readings")
    specimens = asked(log, iteration, specimens)
    comparison = of_iteration(log, iteration, step, body_of, specimens=specimens)
    left_out = list(comparison.left_out)
    step("recordings")
    measured = list(_measured(log, (iteration, specimens), comparison, bench or Bench(), body_of, left_out))
    allowing = _allowing(comparison)
    unsound = frozenset(row.reading.specimen for row, _ in allowing if not usable(row))
    data = _FitData([(row.reading.specimen, reading) for row, reading in allowing if usable(row)], measured, unsound)
    names = sorted(data.specimens())
    if not names:
        of = ", ".join(specimens) or f"iteration {iteration}"
        raise BadInput(
            f"no readings of sound electrodes and no recordings of {of} in {str(log.path)!r}; "
            "expected some to fit to: sensorgen log list shows what there is"
        )
    apart, design = held_back(names, seed, held_share), next(iter(comparison.bodies.values())).design
    step("values")
    values, untold = _fitted(data.of(set(names) - apart), comparison, design, seed)
    step("errors")
    control = data.of(apart)
    errors = *_reading_errors(control, comparison, values), *_rest_errors(control, comparison, values)
    by_shape = by_key(
        (f"{row.reading.shape} {row.reading.words.axes}".strip(), (reading, usable(row))) for row, reading in allowing
    )
    electrodes = _electrodes(comparison)
    groups = tuple(estimates.by_group(by_shape if len(electrodes) == 1 else {}, electrodes[0]))
    return Fit(
        iteration, specimens, seed, tuple(values), tuple(untold), errors, len(names) - len(apart),
        tuple(sorted(apart)), tuple(left_out), _fingerprint(log, (iteration, specimens)), groups=groups,
    )  # fmt: skip


@dataclass(frozen=True)
class _FitData:
    """Measurements that a fit can use.

    Attributes
    ----------
    readings : sequence of (str, AllowedValues)
        The last reading along the electrodes of each specimen where these are sound.
    measured : sequence of (SpecimenEntries, str)
        Specimens that the bench or an LCR meter has measured, each with the name of its print.
    unsound : frozenset of str
        Specimens whose last reading along the electrodes is not of sound ones.
    """

    readings: Sequence[tuple[str, AllowedValues]]
    measured: Sequence[tuple[SpecimenEntries, str]]
    unsound: frozenset[str]

    def specimens(self) -> set[str]:
        """All specimens."""
        return {name for name, _ in self.readings} | {one.specimen for one, _ in self.measured}

    def of(self, specimens: Container[str]) -> "_FitData":
        """Data of some specimens."""
        readings = [each for each in self.readings if each[0] in specimens]
        measured = [each for each in self.measured if each[0].specimen in specimens]
        return _FitData(readings, measured, self.unsound)


def _measured(
    log: Log, which: _Which, comparison: Comparison, bench: Bench, body_of: BodyOf, left_out: list[tuple[str, str]]
) -> Iterator[tuple[SpecimenEntries, str]]:
    """Specimens that the bench or an LCR meter has measured, each with the name of its print."""
    prints: dict[str, str] = {}
    for row in (*log.about(BenchRun, *which), *comparison.alternating):
        prints[row.specimen] = row.batch or prints.get(row.specimen, "")
    for specimen, print_ in prints.items():
        try:
            if specimen not in comparison.names:
                raise BadInput(f"no design is known of {specimen}")
            one = known(log, specimen, bench, body_of=body_of)
        except SensorgenError as error:
            left_out.append((specimen, str(error)))
            continue
        left_out += [(specimen, note) for note in one.left_out]
        yield one, print_ or specimen


def _allowing(comparison: Comparison) -> list[tuple[Compared, AllowedValues]]:
    """The last reading along the electrodes of each specimen, and what it allows."""
    each = ((row, allowed(row, comparison.bodies[row.predicted.design])) for row in comparison.rows if row.predicted)
    return [*{row.reading.specimen: (row, reading) for row, reading in each if reading}.values()]


def held_back(names: Sequence[str], seed: int, share: float = HELD_BACK) -> frozenset[str]:
    """A share of the specimens, a quarter if not given, drawn by a seed; none of fewer than four.

    >>> len(held_back("abcdefgh", 23))
    2
    """
    count = round(share * len(names)) if len(names) >= 4 else 0
    drawn = np.random.default_rng(seed).permutation(len(names))[:count]
    return frozenset(sorted(names)[k] for k in drawn.tolist())


def _fitted(
    data: _FitData, comparison: Comparison, design: Design, seed: int
) -> tuple[list[Fitted], list[Untold]]:  # fmt: skip
    """All values and all that stays open; of two values of one quantity the one that is known better."""
    fits = [
        estimates.of_specimen(one, print_, comparison.movable[comparison.names[one.specimen]])
        for one, print_ in data.measured
    ]
    electrodes, film = _electrodes(comparison), design.slot("film")[0].name
    readings, by_ac = dict(data.readings), estimates.along(fits, data.unsound)
    along = [*(readings | by_ac).values()]
    mixed = f"electrodes of {' and '.join(electrodes)}: not determined which was measured; fit those of one alone"
    one = estimates.resistivity(along, electrodes[0], 1 if by_ac else estimates.LEAST)
    results = [
        one if len(electrodes) == 1 else Untold(f"{estimates.RESISTIVITY} along", mixed),
        *([estimates.leak([*readings.values()], film, seed)] if readings else []),
        *estimates.values(fits),
    ]
    best = dict[tuple[str, str], Fitted]()
    for one in results:
        if isinstance(one, Fitted):
            before = best.get((one.material, one.quantity), one)
            best[one.material, one.quantity] = min(one, before, key=lambda value: value.high / value.low)
    open_ = {u.parameter: u for u in reversed(results) if isinstance(u, Untold) and not _is_told(u, best)}
    return list(best.values()), [_ACROSS, *open_.values()]


def _electrodes(comparison: Comparison) -> list[str]:
    """Materials of all electrodes."""
    parts = ("top_electrode", "bottom_electrode")
    return sorted({body.design.slot(part)[0].name for body in comparison.bodies.values() for part in parts})


def _is_told(untold: Untold, values: Iterable[tuple[str, str]]) -> bool:
    """Test whether a value of this quantity was found by other data."""
    return any(quantity.startswith(untold.parameter.split()[0]) for _, quantity in values)


def with_values(body: Body, values: Sequence[Fitted]) -> Body:
    """A body with fitted values in place of those of its sources."""
    own = by_key((value.material, (value.quantity, value.value)) for value in values)
    return body.with_values({material: dict(of) for material, of in own.items()})


def _reading_errors(data: _FitData, comparison: Comparison, values: Sequence[Fitted]) -> Iterator[Error]:
    """Residuals of what a fit could have used of some specimens, before and after it."""
    residuals, after = list[tuple[float, float]](), dict[str, Predicted]()
    specimens = dict(data.readings)
    for row in comparison.rows:
        of = row.predicted
        if of is None or row.reading.specimen not in specimens or not (row.evidence.ry_ohm and usable(row)):
            continue
        if of.design not in after:  # of all quantities its resistance alone is compared
            body = with_values(comparison.bodies[of.design], values)
            fitted = electrode_resistance(body, list(of.prediction.resistance))
            after[of.design] = replace(of, prediction=replace(of.prediction, resistance=fitted))
        expected = after[of.design].along_ohm(row.across_ohm)
        residuals.append((row.residual, log(row.verdict.ry_ohm / expected.value) if expected else nan))
    yield from _error("R_Y", residuals)


def _rest_errors(data: _FitData, comparison: Comparison, values: Sequence[Fitted]) -> Iterator[Error]:
    residuals = list[tuple[float, float]]()
    for one, _ in data.measured:
        if not one.recorded:
            continue
        of = comparison.movable[comparison.names[one.specimen]]
        sensors = [each.model.sensor for each in (of, Movable(with_values(of.body, values)))]
        both = [np.abs(one.data.rest - at_rest(sensor, one.model.frequency_hz)) for sensor in sensors]
        residuals += np.stack(both, 1).tolist()
    yield from _error("Z at rest", residuals)


def _error(observable: str, residuals: Sequence[tuple[float, float]]) -> Iterator[Error]:
    """Root mean squares before and after a fit, of residuals that are known; nothing without any."""
    if residuals:
        with np.errstate(invalid="ignore"):
            squares = np.where(np.isfinite(residuals), residuals, nan) ** 2
        before, after = (sqrt(np.nanmean(column)) if np.isfinite(column).any() else nan for column in squares.T)
        yield Error(observable, len(residuals), before, after)


def _fingerprint(log: Log, which: _Which) -> str:
    """SHA-256 of what was fitted to."""
    readings = (f"{r.uid} {r.specimen} {r.y_ohm} {r.z_ohm} {r.quantity} {r.value}" for r in log.about(Reading, *which))
    recordings = (f"{run.uid} {run.file} {run.rig_file}" for run in log.about(BenchRun, *which))
    return sha256("\n".join(chain(readings, recordings)).encode()).hexdigest()
