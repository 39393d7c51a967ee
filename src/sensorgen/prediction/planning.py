"""Share an error tolerance on abs(Z) among cell, compression and line models, and run the least expensive of each.

The levels are the cell's capacitance, its compression, and the sections of the line under the tip. An error is its
effect on abs(Z) under one reference load; each level may use what the levels before it left of the tolerance.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, isinf

from sensorgen.core.errors import OutOfRange
from sensorgen.design.body import Body
from sensorgen.models.sensor import UNIFORM, Sensor
from sensorgen.prediction.capacitance import Answer, default_width, weighed
from sensorgen.prediction.compression_law import Law, LawOption, infill, nearest, options
from sensorgen.prediction.mesh_ladder import QUICK
from sensorgen.prediction.plan import Level, Plan, PlanCandidate, cheapest, run_until_within
from sensorgen.prediction.query import DEFAULT, FLAT, Load, Query, Tip
from sensorgen.prediction.reference_load import ReferenceLoad
from sensorgen.prediction.rest_state import rest_state
from sensorgen.prediction.sensor_model import SensorModel, build_sensor, piece, pressure_pa

ACCURACY = 1e-2  # of abs(Z), where none is asked for: material data are not that accurate
SECTIONS = (4, 8, 16, 32, 64, 128, 256)  # that a tip whose pressure is not uniform may be cut into
_NAMES = {f"line, {n} section{'s' * (n > 1)}": n for n in (1, *SECTIONS)}
_RICHARDSON = 4 / 3  # of what halving a section changes, where errors fall by four
_NUDGE = 0.01  # of the capacitance, to find its effect on abs(Z)
_WIDTH_OF_C, _ERROR_OF_Z = "relative width of C", "error of |Z|"


@dataclass(frozen=True)
class PredictionPlan:
    """A prediction that is planned and not yet run.

    Attributes
    ----------
    body, load, tip : Body, Load, Tip
        As given.
    options : function
        Laws of compression to choose from, by the answer for the capacitance.
    rough : SensorModel
        By closed-form models.
    by_capacitance : float
        Relative change of abs(Z) over that of the capacitance [-].
    plan : Plan
        What should meet the tolerance.
    """

    body: Body
    load: Load
    tip: Tip
    options: Callable[[Answer], list[LawOption]]
    rough: SensorModel
    by_capacitance: float
    plan: Plan


def sensor_model(body: Body, query: Query = DEFAULT) -> tuple[SensorModel, Plan]:
    """The line-sensor model behind a prediction, and its plan; raises SensorgenError where there is none."""
    return execute(plan(body, query.load(body.design), query.accuracy, query.law, query.tip_of(body.design)))


def rough_sensor(body: Body, law: str = "", tip: Tip = FLAT, force_n: float = 0.0) -> SensorModel:
    """The sensor by closed-form models, up to a force [N]; other parameters and errors as of :func:`plan`."""
    until_pa = pressure_pa(body, tip, force_n)
    return build_sensor(body, "" if law == "solved" else law, tip, rest=rest_state(body, inf), until_pa=until_pa)


def plan(body: Body, load: Load, accuracy: float | None = None, law: str = "", tip: Tip = FLAT) -> PredictionPlan:
    """Plan of an accuracy: by closed-form models, and by the expected errors of the others.

    Parameters
    ----------
    body : Body
        Drawn or printed.
    load : Load
        Under which abs(Z) is wanted.
    accuracy : float, optional
        Of abs(Z), relative, all levels together [-]; if not given ``ACCURACY``, without solving the compression of a
        cell in 3D, which takes from half a minute to several.
    law : str
        The only law of compression to use, or "".
    tip : Tip
        What presses.

    Raises
    ------
    OutOfRange
        An accuracy that is not above 0; a load that the sensor cannot take.
    Unpredictable, MissingValue, UnknownName, BadInput
        As :func:`sensorgen.prediction.sensor_model.build_sensor`.
    """
    if accuracy is not None and not accuracy > 0:
        raise OutOfRange(f"an accuracy of {accuracy:g}; expected a number above 0, as 1e-3")
    wanted, thorough = accuracy or ACCURACY, bool(accuracy or law == "solved")
    rough = rough_sensor(body, law, tip, load.force_n)
    until_pa = pressure_pa(body, tip, load.force_n)
    sensor = rough.sensor
    line = _expected(_line(sensor, load, wanted / 3))
    share = (wanted - min(_reach(line), wanted / 3)) / 2
    by_capacitance = _by_capacitance(sensor, load)
    printed = None if body.is_drawn else piece(body)

    def laws(answer: Answer) -> list[LawOption]:
        available = options(body.design, answer, law, printed=printed, tip=tip, until_pa=until_pa)
        return available if thorough else _inexpensive(available, body, answer, until_pa)

    width = min(wanted, 2 * share / by_capacitance, default_width(body.cells.first()))
    levels = (_cell(rough, width), _compression(laws(rough.rest.answer), sensor, load, share), line)
    at = f"|Z| at {load.force_n:g} N and {load.position_m * 1e3:g} mm, at the worst frequency"
    return PredictionPlan(body, load, tip, laws, rough, by_capacitance, Plan(wanted, at, levels))


def _inexpensive(
    available: list[LawOption], body: Body, answer: Answer, until_pa: float
) -> list[LawOption]:  # fmt: skip
    """Without cells in 3D: in their place infill's law, else the nearest prototype's, of unknown error."""
    spatial = [option for option in available if option.name.startswith("press3d")]
    if not spatial:
        return available
    name, remark = "nearest prototype", "compression of the nearest cell that was solved"
    law = infill(body.design, piece(body))
    if law:
        name, remark = law.compression.name, "compression of infill, between standing columns and flat levels"
    known = law or nearest(body.design, piece(body), answer, until_pa)
    remark += f": solving this cell takes some {spatial[0].seconds:.0f} s (predict --compression solved)"
    known = replace(known, doubts=(*known.doubts, remark))
    return [LawOption(name, 0.0, known, lambda: known)]


def execute(planned: PredictionPlan) -> tuple[SensorModel, Plan]:
    """Run a plan: the sensor within tolerance, or as accurate as the models allow; and the plan with its results.

    Raises
    ------
    SensorgenError
        As :func:`plan`; of the last law, where none can be found.
    """
    accuracy, load = planned.plan.accuracy, planned.load
    cell, compression, line = planned.plan.levels
    rest = rest_state(planned.body, cell.allowed)
    bounds = rest.answer.capacitance_f
    sensor = _scaled(planned.rough.sensor, rest.capacitance.value / planned.rough.sensor.capacitance_f())
    spent = _error(
        sensor, load, *(_scaled(sensor, end / rest.capacitance.value) for end in (bounds.lower, bounds.upper))
    )
    law, compression = run_until_within(
        replace(compression, allowed=_left(accuracy - spent - _reach(line), compression)),
        {option.name: option.find for option in planned.options(rest.answer)},
        lambda law: _error_of_law(sensor, load, replace(law, others=law.of_mesh or law.others)),
    )
    spent += max(_width(compression), _error_of_law(sensor, load, law) if law.of_mesh else 0.0)
    model = build_sensor(planned.body, _with_failures(law, compression), planned.tip, rest=rest)
    line = _line(model.sensor, load, _left(accuracy - spent, line), line)
    if model.sensor.profile != UNIFORM:
        model = replace(model, sensor=replace(model.sensor, pieces=_NAMES[line.chosen]))
    levels = (_results(cell, rest.answer), compression, line)
    return model, replace(planned.plan, levels=levels, width=spent + _width(line))


def _left(accuracy: float, level: Level) -> float:
    """Accuracy that the levels before left; where that is nothing, the planned one."""
    return accuracy if accuracy > 0 else level.allowed


def _by_capacitance(sensor: Sensor, load: Load) -> float:
    """Relative change of abs(Z) over that of the capacitance [-]."""
    changes = ReferenceLoad(sensor, load).change(_scaled(sensor, 1 + _NUDGE))
    return changes.magnitude / _NUDGE if changes else 1.0


def _scaled(sensor: Sensor, factor: float) -> Sensor:
    """A sensor with that many times the capacitance."""
    return replace(sensor, capacitance_f_per_m=sensor.capacitance_f_per_m * factor)


def _cell(rough: SensorModel, width: float) -> Level:
    """Models of the capacitance; the closed-form one has run already."""
    answer = rough.rest.answer
    candidates = tuple(
        replace(c, expected_width=answer.width(), expected_seconds=answer.seconds()) if c.model == answer.model else c
        for c in weighed(rough.body.cells.first(), width)
    )
    return Level("cell", _WIDTH_OF_C, width, candidates, cheapest(candidates, width))


def _results(cell: Level, answer: Answer) -> Level:
    candidates = answer.plan or (PlanCandidate(answer.model, width=answer.width()),)
    return replace(cell, candidates=candidates, chosen=answer.model)


def _compression(laws: list[LawOption], sensor: Sensor, load: Load, allowed: float) -> Level:
    candidates = tuple(PlanCandidate(o.name, _error_of_law(sensor, load, o.expected), o.seconds) for o in laws)
    first = cheapest(candidates, allowed)
    if all(isinf(c.reach()) for c in candidates):  # beyond the prototype's pressures, where the usual mesh serves most
        first = next((c.model for c in candidates if c.model in QUICK[:2]), first)
    return Level("compression", _ERROR_OF_Z, allowed, candidates, first)


def _with_failures(law: Law, level: Level) -> Law:
    """A law of unknown error says why no better one was found, of several meshes of one model once."""
    over = [(c.model.partition(",")[0], c.passed_over) for c in level.candidates if c.passed_over]
    failed = () if law.bounded else tuple(f"{model}: {why}" for model, why in dict.fromkeys(over))
    return replace(law, doubts=(*law.doubts, *failed))


def _error_of_law(sensor: Sensor, load: Load, law: Law) -> float:
    """Effect of a law's own error on abs(Z); infinite where it is unknown [-]."""
    if load.force_n == 0:
        return 0.0
    pressed = replace(sensor, compression=law.compression)
    return _error(pressed, load, *(replace(sensor, compression=other) for other in law.others)) if law.bounded else inf


def _error(sensor: Sensor, load: Load, *others: Sensor, factor: float = 1.0) -> float:
    """Largest relative difference of abs(Z) to other sensors; infinite where one cannot take the load [-]."""
    try:
        changes = ReferenceLoad(sensor, load).change(*others, factor=factor)
    except OutOfRange:
        return inf
    return changes.magnitude if changes else inf


def _line(sensor: Sensor, load: Load, allowed: float, expected: Level | None = None) -> Level:
    """Sections under the tip until there are enough: one where its pressure is uniform, which is exact."""
    before = {c.model: c for c in expected.candidates} if expected else {}
    candidates: list[PlanCandidate] = []
    for name, pieces in _NAMES.items():
        enough = candidates and (candidates[-1].width or 0.0) <= allowed
        if (pieces == 1) is (sensor.profile == UNIFORM) and not enough:
            begun = time.perf_counter()
            cut = replace(sensor, pieces=pieces)
            error = 0.0 if pieces == 1 else _error(cut, load, replace(cut, pieces=2 * pieces), factor=_RICHARDSON)
            seconds = time.perf_counter() - begun
            candidates.append(replace(before.get(name, PlanCandidate(name)), width=error, seconds=seconds))
    return Level("line", _ERROR_OF_Z, allowed, tuple(candidates), candidates[-1].model)


def _expected(level: Level) -> Level:
    """Results for a rough sensor, as what to expect."""
    return replace(level, candidates=tuple(PlanCandidate(c.model, c.width, c.seconds) for c in level.candidates))


def _reach(level: Level) -> float:
    """Expected error of the chosen candidate [-]."""
    return next(c.reach() for c in level.candidates if c.model == level.chosen)


def _width(level: Level) -> float:
    """Error that the chosen candidate reached [-]."""
    return next(c.width or 0.0 for c in level.candidates if c.model == level.chosen)
