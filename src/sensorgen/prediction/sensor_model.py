"""The line-sensor model of a body: what the line needs, in numbers, by the least expensive models within a tolerance.

The tolerance on abs(Z) is shared among levels: the cell's capacitance, its compression, and the sections of the line
under the tip. An error is its effect on abs(Z) under one reference load; each level may use what the levels before it
left of the tolerance.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import accumulate
from math import inf, isinf

from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.values import ENDS, MaterialValue, lead_ranges, of_all_materials, piezoresistance
from sensorgen.design.values import film as film_of
from sensorgen.models import pressure
from sensorgen.models.sensor import UNIFORM, Sensor
from sensorgen.prediction.capacitance import Answer, default_width, weighed
from sensorgen.prediction.compression_law import Law, LawOption, gap_m, infill, law_of, nearest, options
from sensorgen.prediction.mesh_ladder import QUICK, PressedPiece
from sensorgen.prediction.plan import Level, Plan, PlanCandidate, cheapest, run_until_within
from sensorgen.prediction.query import DEFAULT, FLAT, Load, Query, Tip
from sensorgen.prediction.reference_load import ReferenceLoad
from sensorgen.prediction.rest_state import Lost, RestState, lost, rest_state
from sensorgen.scene.scene import SLIVER_MM, Scene
from sensorgen.scene.sections import square_to
from sensorgen.scene.slabs import is_open

_PEAK = 1.5  # pressure in the middle of a parabola over its mean; of a Hertzian one 4 / pi [-]


@dataclass(frozen=True)
class SensorModel:
    """A body's sensor in numbers, and what they rest on.

    Attributes
    ----------
    body : Body
        Drawn or printed.
    sensor : Sensor
        With the best value of the capacitance.
    rest : RestState
        Capacitance with its range, and resistivities.
    law : Law
        How the cell deforms under pressure, and its error.
    lost : Lost
        Dielectric losses, as far as the design sets them.
    piezoresistance : mapping of str to MaterialValue
        Rise of the electrodes' resistivity with pressure, where a value is known.
    """

    body: Body
    sensor: Sensor
    rest: RestState
    law: Law
    lost: Lost
    piezoresistance: Mapping[str, MaterialValue]

    @property
    def values(self) -> tuple[MaterialValue, ...]:
        """Material values, each once."""
        values = (*self.rest.values, *self.piezoresistance.values(), *self.lost.taken, *self.law.taken)
        return tuple(dict.fromkeys(values))

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why its numbers are to be taken with care."""
        return (*self.rest.doubts, *self.law.doubts, *self.lost.doubts)


def piece(body: Body) -> PressedPiece:
    """Piece of a body to press: its most likely cell, and the period of the pattern."""
    return PressedPiece(body.cells.first(), body.cells.period_mm)


def pressure_pa(body: Body, tip: Tip, force_n: float) -> float:
    """Largest pressure under a tip, a round one all touching [Pa]."""
    area_m2 = tip.length_m * body.design.params.width_mm * M_PER_MM
    return force_n / area_m2 * (1.0 if tip.profile == "uniform" else _PEAK)


def build_sensor(
    body: Body, law: str | Law = "", tip: Tip = FLAT, *, rest: RestState | None = None, until_pa: float = 0.0
) -> SensorModel:  # fmt: skip
    """The line-sensor model of a body.

    Parameters
    ----------
    body : Body
        Drawn or printed.
    law : str or Law
        Of compression: one of :data:`sensorgen.prediction.query.LAWS`, or "" for the best that is known
        without solving a field; or itself.
    tip : Tip
        What presses.
    rest : RestState, optional
        What :func:`sensorgen.prediction.rest_state.rest_state` says, if it is at hand.
    until_pa : float
        Pressure up to which the law is wanted, if more than usual [Pa].

    Raises
    ------
    Unpredictable, MissingValue
        As :func:`sensorgen.prediction.rest_state.rest_state`.
    UnknownName, OutOfRange
        As :func:`sensorgen.prediction.compression_law.law_of`; a radius that is not above 0.
    BadInput
        A radius of a flat tip.
    """
    rest = rest or rest_state(body)
    if reason := _no_line(body, rest):
        raise OutOfRange(reason)
    p, gone, rises = body.design.params, lost(body.design), piezoresistance(body.design)
    (lead_f, *_), (lead_ohm, *_) = lead_ranges(body.design)
    pressed = piece(body)
    if not isinstance(law, Law):
        printed = None if body.is_drawn else pressed
        law = law_of(body.design, rest.answer, law, printed=printed, tip=tip, until_pa=until_pa)
    sensor = Sensor(
        length_m=p.length_mm * M_PER_MM,
        width_m=p.width_mm * M_PER_MM,
        electrode_m=_thickness_m(body, rest),
        resistivity_ohm_m=rest.resistivity_ohm_m,
        capacitance_f_per_m=rest.capacitance.value / (p.length_mm * M_PER_MM),
        compression=law.compression,
        tip_m=tip.length_m,
        profile=tip.profile,
        contact=None if tip.radius_m is None else _contact(body, law, pressed, tip.profile, tip.radius_m),
        tan_delta=gone.tan_delta,
        leak_s_per_m=gone.leak_s / (p.length_mm * M_PER_MM),
        piezoresistance_per_pa=tuple(rises[end].value if end in rises else 0.0 for end in ENDS),  # type: ignore[arg-type]
        lead_ohm=lead_ohm,
        lead_f=lead_f,
    )
    return SensorModel(body, sensor, rest, law, gone, rises)


def _no_line(body: Body, rest: RestState) -> str:
    """Why electrodes that do not cover the sensor are no line of equal cells, or ""."""
    scene = body.cells.first()
    if set(rest.resistance) != set(ENDS):
        return "an electrode does not run from end to end: the sensor at rest is predicted, not its response"
    if _has_air_layer(body.design.in_use):
        return "what lies above a layer of air is held by nothing: the sensor at rest is predicted, not its response"
    if not is_open(scene):
        return ""
    ends = [replace(scene, bodies=tuple(b for b in scene.bodies if b.terminal == end)) for end in ENDS]
    if all(len(square_to(electrode, "x")) == 1 for electrode in ends):
        return ""
    return "an electrode changes along the sensor: the sensor at rest is predicted, not its response"


def _has_air_layer(scene: Scene) -> bool:
    """Test whether some height between the lowest and the highest place of a scene is air all over."""
    spans = sorted(p.span("z") for _, p in scene.pieces)
    tops = accumulate((high for _, high in spans), max)
    return any(low - top > SLIVER_MM for (low, _), top in zip(spans[1:], tops, strict=False))


def _thickness_m(body: Body, rest: RestState) -> tuple[float, float]:
    """Of plates that have the electrodes' resistance, cogs included [m]."""
    p = body.design.params
    thickness_m = [
        rho * p.length_mm / (p.width_mm * rest.resistance[end].value) if rho else p.electrode_mm * M_PER_MM
        for end, rho in zip(ENDS, rest.resistivity_ohm_m, strict=True)
    ]
    return thickness_m[0], thickness_m[1]


def _contact(body: Body, law: Law, pressed: PressedPiece, profile: str, radius_m: float) -> pressure.RoundContact:
    """Growth of a round tip's contact: on the film as a thick body, or on the cell as a foundation of springs."""
    if profile == "hertz":
        soft = film_of(body.design)
        modulus, ratio = (of_all_materials(body.design, q)[soft].value for q in ("youngs_modulus_pa", "poisson_ratio"))
        return pressure.hertz(radius_m, modulus / (1 - ratio**2))
    if profile == "parabola":
        return pressure.bed(radius_m, law.compression.foundation_stiffness_pa_per_m(gap_m(pressed.scene)))
    raise BadInput(
        f"a tip with a pressure like a {profile!r} one is flat and has no radius; expected hertz or parabola"
    )


ACCURACY = 1e-2  # of abs(Z), where none is asked for: material data are not that accurate
SECTIONS = (4, 8, 16, 32, 64, 128, 256)  # that a tip whose pressure is not uniform may be cut into
_NAMES = {f"line, {n} section{'s' * (n > 1)}": n for n in (1, *SECTIONS)}
RICHARDSON = 4 / 3  # of what halving a section changes, where errors fall by four
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
    plan : Plan
        What should meet the tolerance.
    """

    body: Body
    load: Load
    tip: Tip
    options: Callable[[Answer], list[LawOption]]
    rough: SensorModel
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
    share = (wanted - min(line.choice.reach(), wanted / 3)) / 2
    changes = ReferenceLoad(sensor, load).change(_scaled(sensor, 1 + _NUDGE))
    by_capacitance = changes.magnitude / _NUDGE if changes else 1.0
    printed = None if body.is_drawn else piece(body)

    def laws(answer: Answer) -> list[LawOption]:
        available = options(body.design, answer, law, printed=printed, tip=tip, until_pa=until_pa)
        return available if thorough else _inexpensive(available, body, answer, until_pa)

    width = min(wanted, 2 * share / by_capacitance, default_width(body.cells.first()))
    levels = (_cell(rough, width), _compression(laws(rough.rest.answer), sensor, load, share), line)
    at = f"|Z| at {load.force_n:g} N and {load.position_m * 1e3:g} mm, at the worst frequency"
    return PredictionPlan(body, load, tip, laws, rough, Plan(wanted, at, levels))


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
        replace(compression, allowed=_left(accuracy - spent - line.choice.reach(), compression)),
        {option.name: option.find for option in planned.options(rest.answer)},
        lambda law: _error_of_law(sensor, load, replace(law, others=law.of_mesh or law.others)),
    )
    spent += max((compression.choice.width or 0.0), _error_of_law(sensor, load, law) if law.of_mesh else 0.0)
    model = build_sensor(planned.body, _with_failures(law, compression), planned.tip, rest=rest)
    line = _line(model.sensor, load, _left(accuracy - spent, line), line)
    if model.sensor.profile != UNIFORM:
        model = replace(model, sensor=replace(model.sensor, pieces=_NAMES[line.chosen]))
    tried = rest.answer.plan or (PlanCandidate(rest.answer.model, width=rest.answer.width()),)
    levels = (replace(cell, candidates=tried, chosen=rest.answer.model), compression, line)
    return model, replace(planned.plan, levels=levels, width=spent + (line.choice.width or 0.0))


def _left(accuracy: float, level: Level) -> float:
    """Accuracy that the levels before left; where that is nothing, the planned one."""
    return accuracy if accuracy > 0 else level.allowed


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
            error = 0.0 if pieces == 1 else _error(cut, load, replace(cut, pieces=2 * pieces), factor=RICHARDSON)
            seconds = time.perf_counter() - begun
            candidates.append(replace(before.get(name, PlanCandidate(name)), width=error, seconds=seconds))
    return Level("line", _ERROR_OF_Z, allowed, tuple(candidates), candidates[-1].model)


def _expected(level: Level) -> Level:
    """Results for a rough sensor, as what to expect."""
    return replace(level, candidates=tuple(PlanCandidate(c.model, c.width, c.seconds) for c in level.candidates))
