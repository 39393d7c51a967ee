r"""Parameter that explains the residuals best: one at a time, by least squares.

For every kind of measurement, the residual is :math:`r = \ln(\text{measured} / \text{predicted})`, of every reading or
frequency, complex where Z is. One parameter is moved for all of them until :math:`\sum |r|^2` is least; its share is
the part of that sum that it takes away.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from itertools import groupby
from math import exp, inf, log, nan, sqrt
from typing import Annotated, Any

import numpy as np

from sensorgen.analysis.comparison import Comparison
from sensorgen.analysis.comparison.expected import Movable, at_rest, moved, pressed
from sensorgen.analysis.comparison.measured import RecordedRun
from sensorgen.analysis.report.electrodes import usable
from sensorgen.core.arrays import Complex, Real
from sensorgen.core.document import Column
from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import M_PER_MM
from sensorgen.measure.signal.verdicts import INTACT_OHM, across_ohm

RESISTIVITY, PERMITTIVITY, MODULUS, FILM, LEAK = PARAMETERS = (
    "electrode resistivity", "film permittivity", "all moduli", "film thickness", "film leakage",
)  # fmt: skip
_FACTOR, _LEAK_S = (1e-2, 1e2), (1e-12, 1e3)
_GRID, _CLOSE = 31, 1e-6  # values of a parameter at first, and the step in its ln at last
_STEP = 1e-3
_OPEN = log(1e6)  # a larger factor is shown as this one: nothing is known
_FLAT = 1e-9  # share below which a parameter has no effect

Model = Callable[[str, float], Real | Complex]


@dataclass(frozen=True, eq=False)
class MeasurementKind:
    """A kind of measurement: ln of the measured values, real or complex, and of the predicted, one parameter moved.

    A leakage of 0 and a factor of 1 are the prediction itself.
    """

    name: str
    measured: Real | Complex
    model: Model


@dataclass(frozen=True)
class Explanation:
    """Effect of one parameter on one kind of measurement."""

    kind: Annotated[str, Column("measured")]
    parameter: Annotated[str, Column("parameter")]
    value: Annotated[float, Column("best value")]
    unit: Annotated[str, Column("unit", "", "factor to the prediction, or conductance of the whole film")]
    error: Annotated[float, Column("uncertain by a factor", "", "one standard error")]
    slope: Annotated[float, Column("slope", "", "root mean square of d ln(prediction) / d ln(parameter)")]
    share_percent: Annotated[float, Column("residual explained", "%", "of the sum of squares")]


def explanations(comparison: Comparison, recorded: Sequence[RecordedRun]) -> list[Explanation]:
    """All parameters for all kinds of measurements with two values or more, the best of each kind first."""
    kinds = [kind for kind in (*_resistances(comparison), *_impedances(comparison, recorded)) if len(kind.measured) > 1]
    return [
        one for kind in kinds
        for one in sorted((_explained(kind, p) for p in PARAMETERS), key=lambda one: -one.share_percent)
    ]  # fmt: skip


def sentences(explanations: Sequence[Explanation]) -> Iterator[str]:
    """The best parameter of each kind, and those that the readings cannot constrain."""
    for kind, of_kind in groupby(explanations, key=lambda e: e.kind):
        best = next(of_kind)
        if best.share_percent > 100 * _FLAT:
            by = f"of {best.value:.3g} S" if best.parameter == LEAK else f"scaled by {best.value:.3g}"
            share = f"{best.share_percent:.3g} % of the squared residuals"
            yield f"{kind.capitalize()}: {best.parameter} {by} explains {share}."
    constrained = {e.parameter for e in explanations if not e.share_percent <= 100 * _FLAT}
    others = [p for p in PARAMETERS if p not in constrained]
    if explanations and others:
        yield f"These readings cannot constrain {' or '.join(filter(None, (', '.join(others[:-1]), others[-1])))}."


def _resistances(comparison: Comparison) -> Iterator[MeasurementKind]:
    """Electrodes, and films up to what the meter can tell from an open circuit."""
    rows = (
        (v.ry_ohm, v.rz_ohm, row.expected_ohm.value, row.predicted.ry_ohm.value, v.leak_s, not row.evidence.touching)
        for row in usable(comparison) if row.predicted and row.predicted.ry_ohm and row.expected_ohm
        for v in (row.verdict,)
    )  # fmt: skip
    kind = np.dtype([(name, "f8") for name in ("y", "z", "expected", "alone", "leak")] + [("apart", "?")])
    known = np.fromiter(rows, kind)
    if len(known):
        yield MeasurementKind("electrode resistance", np.log(known["y"]), _along(known))
    both = known[(known["z"] > 0) & known["apart"]]
    if len(both):
        yield MeasurementKind("film resistance", np.log(np.minimum(both["z"], INTACT_OHM)), _across(both["alone"]))


def _along(known: Any) -> Model:
    """Ln of predicted readings along an electrode; a leakage is in addition to what was measured across the film."""
    leak, expected = np.nan_to_num(known["leak"], posinf=np.inf), np.log(known["expected"])
    measured = np.log(_carried(known["alone"], leak))

    def model(parameter: str, value: float) -> Real:
        more = np.log(_carried(known["alone"], leak + value)) - measured if parameter == LEAK else 0.0
        return np.asarray(expected + more + (log(value) if parameter == RESISTIVITY else 0.0))

    return model


def _carried(ohm: Real, leak_s: Real) -> Real:
    """Share of an electrode's resistance that a reading has, as of :func:`along_ohm` for arrays."""
    half = np.maximum(np.sqrt(ohm * leak_s / 2), _FLAT)
    return np.asarray((1 + np.tanh(half) / half) / 2)


def _across(alone: Real) -> Model:
    """Ln of predicted readings across a film, once for electrodes that are alike: many readings are of few designs."""
    distinct, of = np.unique(alone, return_inverse=True)

    def model(parameter: str, value: float) -> Real:
        leak = value if parameter == LEAK else 0.0
        return np.asarray(np.log([min(across_ohm(ohm, leak), INTACT_OHM) for ohm in distinct.tolist()])[of])

    return model


def _impedances(comparison: Comparison, recorded: Sequence[RecordedRun]) -> Iterator[MeasurementKind]:
    """Z at rest, and its change under load, where a line can be made of the design."""
    known: list[tuple[RecordedRun, Movable]] = []
    loaded, changes = list[tuple[RecordedRun, Movable]](), list[Complex]()
    for run in recorded:
        name = comparison.names.get(run.entry.specimen)
        if name is not None and np.isfinite(run.rest_ohm).all():
            of = comparison.movable[name]
            with suppress(SensorgenError):
                _ = of.model.sensor
                known.append((run, of))
                if run.pairs is not None:
                    loaded.append((run, of))
                    changes.append(np.log(run.pairs.pressed_ohm / run.pairs.before_ohm).ravel())
    if known:
        rest = np.concatenate([np.log(run.rest_ohm) for run, _ in known])
        yield MeasurementKind("impedance at rest", rest, partial(_modelled, known, loaded=False))
    if loaded:
        yield MeasurementKind("impedance under load", np.concatenate(changes), partial(_modelled, loaded, loaded=True))


def _modelled(known: Sequence[tuple[RecordedRun, Movable]], parameter: str, value: float, *, loaded: bool) -> Complex:
    """Ln Z of recordings at rest, or its change under load, with one parameter moved."""
    parts = []
    for run, of in known:
        sensor, f = moved(of.model.sensor, **_moves(of, parameter, value)), run.tones_hz
        if loaded and run.pairs is not None:
            stiffness = value if parameter == MODULUS else 1.0
            where = run.pairs.force_n, run.pairs.position_mm * M_PER_MM
            parts.append(pressed(sensor, f, *where, stiffness).ravel())
        else:
            parts.append(at_rest(sensor, f))
    return np.concatenate(parts)


def _moves(of: Movable, parameter: str, value: float) -> dict[str, float]:
    """Properties of a sensor that a parameter moves."""
    if parameter in (PERMITTIVITY, FILM):
        factors, curve = of.by_permittivity if parameter == PERMITTIVITY else of.by_film
        return {"capacitance": exp(float(np.interp(log(value), factors, curve)))}
    return {RESISTIVITY: {"resistivity": value}, LEAK: {"leak_s": value}}.get(parameter, {})


def _explained(kind: MeasurementKind, parameter: str) -> Explanation:
    start, unit = (0.0, "S") if parameter == LEAK else (1.0, "factor")
    low, high = np.log(_LEAK_S if parameter == LEAK else _FACTOR)

    @cache
    def left(at: float) -> float:
        try:
            residual = kind.measured - kind.model(parameter, exp(at))
            return float(np.vdot(residual, residual).real)
        except SensorgenError:  # loads that a film so soft cannot bear
            return inf

    grid = np.linspace(low, high, _GRID).tolist()
    at, step, before = min(grid[::-1], key=left), grid[1] - grid[0], left(log(start) if start else -inf)  # no plateau
    while step > _CLOSE:
        step /= 2
        at = min((max(at - step, low), at, min(at + step, high)), key=left)
    least = left(at)
    share = 1 - least / before if 0 < before < inf else 0.0
    if share < _FLAT:
        slope = _slope(kind, parameter, log(start)) if start else 0.0
        return Explanation(kind.name, parameter, start, unit, nan, slope, 0.0)
    slope, count = _slope(kind, parameter, at), len(kind.measured)
    error = sqrt(least / max(count - 1, 1) / count) / slope if slope else inf
    return Explanation(kind.name, parameter, exp(at), unit, float(np.exp(min(error, _OPEN))), slope, 100 * share)


def _slope(kind: MeasurementKind, parameter: str, at: float) -> float:
    ends: list[Real] = [np.asarray(kind.model(parameter, exp(at + sign * _STEP))) for sign in (-1, 1)]
    return float(np.sqrt(np.mean(np.abs((ends[1] - ends[0]) / (2 * _STEP)) ** 2)))
