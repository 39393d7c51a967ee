r"""Which parameter explains the residuals best: one at a time, by least squares.

For every kind of measurement, the residual is :math:`r = \ln(\text{measured} / \text{predicted})`, of every reading or
tone, complex where Z is. One parameter p is moved for all of them until :math:`\sum |r|^2` is least; its share is what
that takes away of it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import exp, inf, log, nan, sqrt

import numpy as np

from sensorgen.analysis.comparison import Comparison
from sensorgen.analysis.comparison.leaky import across_ohm, along_ohm
from sensorgen.analysis.comparison.moved import Movable, at_rest, moved, pressed
from sensorgen.analysis.comparison.runs import Run
from sensorgen.analysis.report.specimens import usable
from sensorgen.analysis.report.tables import Column, Table, table
from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import M_PER_MM
from sensorgen.measure.recording.samples import Complex, Real
from sensorgen.measure.signal.verdicts import INTACT_OHM

PARAMETERS = {
    "rho": "resistivity of the electrodes", "eps_r": "permittivity of the film's material", "E": "all moduli",
    "d": "film thickness", "leak": "leak of the whole film",
}  # fmt: skip
_FACTOR, _LEAK_S = (1e-2, 1e2), (1e-12, 1e3)
_GRID = 31
_STEP = 1e-3
_OPEN = log(1e6)  # a factor beyond is told as this one: nothing is known
_FLAT = 1e-9  # share below which a parameter does nothing

Model = Callable[[str, float], Complex]


@dataclass(frozen=True, eq=False)
class Kind:
    """A kind of measurement: ln of what was measured, and of what is predicted with one parameter moved.

    A leak of 0 and a factor of 1 are the prediction itself.
    """

    name: str
    measured: Complex
    model: Model


@dataclass(frozen=True)
class Explanation:
    """What one parameter does for one kind of measurement.

    Attributes
    ----------
    kind, parameter : str
        Which.
    value, error : float
        The best: a factor [-], or the leak [S]; and its standard error as a factor [-].
    slope : float
        Root mean square of d ln(prediction) / d ln(parameter) there [-].
    share : float
        Of the residuals' sum of squares that it takes away [-].
    """

    kind: str
    parameter: str
    value: float
    error: float
    slope: float
    share: float


def explanations(found: Comparison, recorded: Sequence[Run]) -> list[Explanation]:
    """All parameters for all kinds of measurements that there are."""
    kinds = [*_resistances(found), *_impedances(found, recorded)]
    return [_explained(kind, parameter) for kind in kinds for parameter in PARAMETERS]


def _resistances(found: Comparison) -> Iterator[Kind]:
    """R_Y, and R_Z up to what the meter can tell from an open circuit."""
    rows = usable(found)
    middles = [row.predicted.ry_ohm.middle() for row in rows if row.predicted and row.predicted.ry_ohm]
    if rows:
        yield Kind("R_Y", np.log([row.verdict.ry_ohm for row in rows]).astype(complex), _along(middles))
    both = [k for k, row in enumerate(rows) if row.verdict.rz_ohm > 0 and not row.evidence.touching]
    if both:
        measured = np.log([min(rows[k].verdict.rz_ohm, INTACT_OHM) for k in both])
        yield Kind("R_Z", measured.astype(complex), _across([middles[k] for k in both]))


def _along(middles: Sequence[float]) -> Model:
    return _of_electrodes(
        middles,
        lambda ohm, parameter, value: along_ohm(
            ohm * (value if parameter == "rho" else 1.0), value if parameter == "leak" else 0.0
        ),
    )


def _across(middles: Sequence[float]) -> Model:
    return _of_electrodes(
        middles,
        lambda ohm, parameter, value: min(across_ohm(ohm, value if parameter == "leak" else 0.0), INTACT_OHM),
    )


def _of_electrodes(middles: Sequence[float], law: Callable[[float, str, float], float]) -> Model:
    """What a law makes of all electrodes, once for those that are alike: many readings are of few designs."""
    distinct, of = np.unique(middles, return_inverse=True)
    return lambda parameter, value: np.log([complex(law(ohm, parameter, value)) for ohm in distinct.tolist()])[of]


def _impedances(found: Comparison, recorded: Sequence[Run]) -> Iterator[Kind]:
    """Z at rest, and what presses change of it, where a line can be made of the design."""
    known: list[tuple[Run, Movable]] = []
    for run in recorded:
        of = Movable(found.designs[found.names[run.entry.specimen]]) if run.entry.specimen in found.names else None
        try:
            if of is not None and np.isfinite(run.rest_ohm).all():
                _ = of.model.sensor
                known.append((run, of))
        except SensorgenError:
            continue
    if known:
        yield Kind("Z at rest", np.concatenate([np.log(run.rest_ohm) for run, _ in known]), _rest(known))
    presses = [(run, of) for run, of in known if run.pairs is not None]
    if presses:
        measured = [np.log(r.pairs.pressed_ohm / r.pairs.before_ohm).ravel() for r, _ in presses if r.pairs]
        yield Kind("presses", np.concatenate(measured), _presses(presses))


def _rest(known: Sequence[tuple[Run, Movable]]) -> Model:
    return lambda parameter, value: np.concatenate(
        [at_rest(moved(of.model.sensor, **_moves(of, parameter, value)), run.recording.tones_hz) for run, of in known]
    )


def _presses(known: Sequence[tuple[Run, Movable]]) -> Model:
    def of_run(run: Run, of: Movable, parameter: str, value: float) -> Complex:
        sensor = moved(of.model.sensor, **_moves(of, parameter, value))
        assert run.pairs is not None  # noqa: S101 - chosen so
        stiffness = value if parameter == "E" else 1.0
        return pressed(
            sensor, run.recording.tones_hz, run.pairs.force_n, run.pairs.position_mm * M_PER_MM, stiffness
        ).ravel()

    return lambda parameter, value: np.concatenate([of_run(run, of, parameter, value) for run, of in known])


def _moves(of: Movable, parameter: str, value: float) -> dict[str, float]:
    """What a parameter moves of a sensor."""
    if parameter in ("eps_r", "d"):
        factors, curve = of.by_permittivity if parameter == "eps_r" else of.by_film
        return {"capacitance": exp(float(np.interp(log(value), factors, curve)))}
    return {"rho": {"resistivity": value}, "leak": {"leak_s": value}}.get(parameter, {})


def _explained(kind: Kind, parameter: str) -> Explanation:
    from scipy.optimize import minimize_scalar

    start = 0.0 if parameter == "leak" else 1.0
    low, high = np.log(_LEAK_S if parameter == "leak" else _FACTOR)

    def left(at: float) -> float:
        try:
            return float((np.abs(kind.measured - kind.model(parameter, exp(at))) ** 2).sum())
        except SensorgenError:  # presses that a film so soft cannot bear
            return inf

    before = float((np.abs(kind.measured - kind.model(parameter, start)) ** 2).sum())
    grid = np.linspace(low, high, _GRID)
    sums = [left(at) for at in grid]
    best = int(np.argmin(sums))
    around = grid[max(best - 1, 0)], grid[min(best + 1, _GRID - 1)]
    done = minimize_scalar(left, bounds=around, method="bounded", options={"xatol": 1e-7})
    at, least = min((float(done.x), float(done.fun)), (float(grid[best]), sums[best]), key=lambda pair: pair[1])
    share = 1 - least / before if before > 0 else 0.0
    if share < _FLAT:
        return Explanation(kind.name, parameter, start, nan, _slope(kind, parameter, log(start)) if start else 0.0, 0.0)
    slope = _slope(kind, parameter, at)
    count = len(kind.measured)
    error = sqrt(least / max(count - 1, 1) / count) / slope if slope else inf
    return Explanation(kind.name, parameter, exp(at), float(np.exp(min(error, _OPEN))), slope, share)


def _slope(kind: Kind, parameter: str, at: float) -> float:
    ends: list[Real] = [np.asarray(kind.model(parameter, exp(at + sign * _STEP))) for sign in (-1, 1)]
    return float(np.sqrt(np.mean(np.abs((ends[1] - ends[0]) / (2 * _STEP)) ** 2)))


def table_of(found: Sequence[Explanation]) -> Table:
    """A row for each, the best of its kind first."""
    order = list(dict.fromkeys(e.kind for e in found))
    rows = [
        (e.kind, e.parameter, PARAMETERS[e.parameter], e.value, "S" if e.parameter == "leak" else "factor",
         e.error, e.slope, 100 * e.share)
        for e in sorted(found, key=lambda e: (order.index(e.kind), -e.share))
    ]  # fmt: skip
    columns = (
        Column("measured"), Column("parameter"), Column("what"), Column("best value"), Column("as"),
        Column("uncertain by a factor", "", "one standard error"), Column("slope", "", "rms d ln prediction / d ln p"),
        Column("residual taken away", "%", "of the sum of squares"),
    )  # fmt: skip
    return table("explained", "What one parameter, moved for all specimens at once, takes away", columns, rows)


def sentences(found: Sequence[Explanation]) -> Iterator[str]:
    """The best parameter of each kind, and those that nothing tells of."""
    for kind in dict.fromkeys(e.kind for e in found):
        best = max((e for e in found if e.kind == kind), key=lambda e: e.share)
        if best.share > _FLAT:
            by = f"{best.value:.3g} S" if best.parameter == "leak" else f"a factor of {best.value:.3g}"
            yield (
                f"{kind}: {PARAMETERS[best.parameter]} explains most; {by} takes {100 * best.share:.3g} % of the "
                "squared residuals away."
            )
    silent = [p for p in PARAMETERS if all(e.share <= _FLAT for e in found if e.parameter == p)]
    if silent and found:
        yield f"Nothing that was measured depends on {', '.join(PARAMETERS[p] for p in silent)}."
