"""Quantities of a prediction, each with its range: gap, capacitance, resistance, impedance, sensitivity, resolution."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial
from itertools import product
from math import inf, isfinite, isnan, nan, pi, prod, tan
from operator import add
from typing import Any

import numpy as np

from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.errors import MissingValue, OutOfRange, SensorgenError
from sensorgen.core.units import M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.design import Design
from sensorgen.design.effects import Effects
from sensorgen.design.tip import WORDS
from sensorgen.design.values import ASSUMED, ENDS, MaterialValue, assumed, lead_ranges
from sensorgen.models import line, refusal
from sensorgen.models.compression import Compression
from sensorgen.models.sensor import Sensor
from sensorgen.prediction import rest_state as resting
from sensorgen.prediction.capacitance import Unpredictable
from sensorgen.prediction.compression_law import CLOSED_FORM, at_a_few_pressures
from sensorgen.prediction.error_budget import by_permittivity, error_budget, material_ends, modulus_range
from sensorgen.prediction.identifiability.fisher import Setup
from sensorgen.prediction.identifiability.identify import identify
from sensorgen.prediction.plan import Plan
from sensorgen.prediction.query import FORCE_N, Load, Query
from sensorgen.prediction.reference_load import ReferenceLoad
from sensorgen.prediction.results import SCHEMA, Impedance, Narrowing, Prediction, UnderTop
from sensorgen.prediction.sensor_model import SensorModel, build_sensor, piece, sensor_model
from sensorgen.scene.slabs import is_open

WIDE = 3.0  # upper over lower end, from which on a measurement is advised
_METER, _PRESS = 1.02, 1.1  # upper over lower end of what a meter, and what a known weight, leave of what they measure
MULTIMETER, LCR = "multimeter, four wires", "LCR meter at rest, open leads subtracted"
WEIGHT, GCODE = "known weight on it", "G-code (sensorgen slice)"
_REMOVES = {  # causes by what they no longer count after
    MULTIMETER: ("resistivity", "contact resistance"),
    LCR: ("permittivity", "lead capacitance"),
    WEIGHT: ("law", "width", "film", "stiffness"),
    GCODE: ("width",),
}


def narrowings(
    prediction: Prediction, body: Body, of_force: Mapping[str, Interval], of_position: Mapping[str, Interval]
) -> Iterator[Narrowing]:
    """Measurements for all ranges that span more than ``WIDE``.

    Parameters
    ----------
    prediction : Prediction
        With its ranges.
    body : Body
        That is predicted: of G-code, there is none to narrow it.
    of_force, of_position : mapping of str to Interval
        Ends of the resolutions by each cause [N], [m].
    """
    for end, r in prediction.resistance.items():
        yield from _narrowing(f"{end} electrode", r, {MULTIMETER: _METER, GCODE: _without_print(r)}, body)
    if c := prediction.capacitance:
        yield from _narrowing("capacitance", c, {LCR: _METER, GCODE: _without_print(c)}, body)
    if s := prediction.sensitivity:
        yield from _narrowing("sensitivity", s, {WEIGHT: _PRESS, GCODE: _without_print(s)}, body)
    for name, resolution, causes in (
        ("force resolution", prediction.force_resolution, of_force),
        ("position resolution", prediction.position_resolution, of_position),
    ):
        if resolution:
            left = {
                by: prod(_factor(part) for cause, part in causes.items() if not cause.startswith(removed))
                for by, removed in _REMOVES.items()
            }
            yield from _narrowing(name, resolution, left, body)


def _narrowing(name: str, of: Bounds, left: Mapping[str, float], body: Body) -> Iterator[Narrowing]:
    now = _factor(of)
    possible = {by: factor for by, factor in left.items() if by != GCODE or body.kind == "estimated"}
    if now > WIDE and possible:
        best = min(possible, key=possible.__getitem__)
        yield Narrowing(name, best, now, min(possible[best], now))


def _factor(of: Bounds | Interval) -> float:
    return of.upper / of.lower if of.lower > 0 and isfinite(of.upper) else inf


def _without_print(of: Bounds) -> float:
    return _factor(of) / _factor(of.print)


Otherwise = tuple[Sequence[Sensor | None], Sequence[Sensor | None]]  # by other walls; with other films

_ASSUMED = "the cell was not solved, and is taken to deform as a solid plate"
_PA_PER_KPA = 1e3
_UNITS = {"force_resolution": "N", "position_resolution": "m", "sensitivity": "1/kPa"}
_SAME = 0.05  # capacitances that differ by less are not told apart: solving takes seconds


def prediction(body: Body, query: Query) -> Prediction:
    """Prediction of a body, computed now; parameters and errors as of :mod:`sensorgen.prediction.evaluate`."""
    design, load = body.design, query.load(body.design)
    result = Prediction(
        SCHEMA, design.name, design.id(), body.provenance, "not predicted", load.force_n, load.position_m
    )  # fmt: skip
    try:
        result = replace(result, gap=_gap(body))
        model, plan, reason = _model(body, query)
        rest = model.rest if model else resting.rest_state(body)
        result = _at_rest(replace(result, status="predicted", reason=reason), body, rest, query.frequency_hz)
    except SensorgenError as error:  # no model applies, a value is missing, an electrode or a tool path is interrupted
        touches = result.gap is not None and result.gap.value == 0
        with suppress(SensorgenError):  # as a resistivity that is missing
            result = replace(result, resistance=resting.electrode_resistance(body))
        return replace(result, status="short" if touches else "not predicted", reason=str(error))
    values, doubts = (model.values, model.doubts) if model else (rest.values, rest.doubts)
    result = replace(result, plan=plan, values=values, assumptions=tuple(_assumptions(body, model)), doubts=doubts)
    return _at_load(result, model, load, query) if model else result


def _model(body: Body, query: Query) -> tuple[SensorModel | None, Plan | None, str]:
    """The sensor and its plan; or why there is none, where the body can be predicted at rest alone."""
    try:
        return *sensor_model(body, query), ""
    except (Unpredictable, MissingValue):
        raise
    except SensorgenError as error:
        return None, None, str(error)


def _gap(body: Body) -> Bounds | None:
    gaps = [gap * M_PER_MM for gap in body.cells.gap_mm.values()]
    if inf in gaps:
        return None
    error = body.cells.film.error_mm * M_PER_MM if body.cells.film else 0.0
    by_print = Interval(max(min(gaps) - error, 0.0), max(gaps) + error)
    if gaps[0] == 0:
        exact = Interval(0.0, 0.0)
        return Bounds(0.0, by_print.lower, by_print.upper, "m", exact, by_print, exact, certified=True)
    return Bounds.of(gaps[0], "m", print=by_print, certified=True)


def _at_rest(result: Prediction, body: Body, rest: resting.RestState, frequency_hz: tuple[float, ...]) -> Prediction:
    """Capacitance, resistance, corner frequency and impedance without a load."""
    gone, (farad, ohm), c = resting.lost(body.design), resting.added(body), rest.capacitance
    resistance = {end: r.plus(*ohm) for end, r in rest.resistance.items()}
    if set(resistance) != set(ENDS):
        return replace(result, capacitance=c.plus(*farad), resistance=resistance)
    r = _of_line(rest.resistance["top"], rest.resistance["bottom"], add, "ohm")
    dispersion = body.design.effects.permittivity_dispersion
    return replace(
        result, capacitance=c.plus(*farad), resistance=resistance,
        corner_frequency=_of_line(r, c, line.corner_frequency_hz, "Hz"),
        impedance=tuple(_impedance(f, r, c, gone, (farad, ohm), dispersion) for f in frequency_hz),
    )  # fmt: skip


def impedance_at(prediction: Prediction, frequency_hz: float, gone: resting.Lost) -> Impedance | None:
    """Impedance at rest of a predicted sensor at any frequency; None where it is no line of two electrodes."""
    if prediction.capacitance is None or set(prediction.resistance) != set(ENDS):
        return None
    c, ends = prediction.capacitance, [prediction.resistance[end] for end in ENDS]
    leads = _beyond(c), _beyond(ends[0])
    whole = _of_line(ends[0].alone(), ends[1].alone(), add, "ohm")
    return _impedance(frequency_hz, whole, c.alone(), gone, leads, Effects().permittivity_dispersion)


def parallel_range_f(prediction: Prediction, frequency_hz: float) -> Interval:
    """Ends of the parallel capacitance at rest, of a line at the ends of its resistances and its capacitance [F]."""
    omega, c = 2 * pi * frequency_hz, prediction.capacitance or Bounds.of(0.0, "F")
    ohms = [sum(getattr(r, end) for r in prediction.resistance.values()) for end in ("lower", "upper")]
    lines = (line.cascade([r], [np.array([1j * omega * f])], [1.0])[0] for r in ohms for f in (c.lower, c.upper))
    values = [float((1 / z).imag / omega) for z in lines]
    return Interval(min(values), max(values))


def _beyond(quantity: Bounds) -> resting.Added:
    """Least and most that leads may add to the value of a quantity."""
    ends = quantity.leads or Interval(quantity.value, quantity.value)
    return resting.Added(0.0, ends.lower - quantity.value, ends.upper - quantity.value)


def _of_line(r: Bounds, c: Bounds, of: Callable[[float, float], float], unit: str) -> Bounds:
    """A quantity of the unloaded line: at the ends of what two others, as resistance and capacitance, may be."""

    def ends(ohm: Interval, farad: Interval) -> Interval:
        values = [of(*pair) for pair in product((ohm.lower, ohm.upper), (farad.lower, farad.upper))]
        return Interval(min(values), max(values))

    whole = ends(Interval(r.lower, r.upper), Interval(c.lower, c.upper))
    return Bounds(
        of(r.value, c.value), whole.lower, whole.upper, unit,
        ends(r.model, c.model), ends(r.print, c.print), ends(r.material, c.material), r.certified and c.certified,
    )  # fmt: skip


def _impedance(
    frequency_hz: float, r: Bounds, c: Bounds, gone: resting.Lost, leads: tuple[resting.Added, resting.Added],
    dispersion: float = 0.0,
) -> Impedance:  # fmt: skip
    """Of the unloaded line at one frequency, at the end of its leads; r and c of the whole sensor.

    A permittivity that falls as f^-n loses tan(n pi / 2) at least: the best value has none, the range up to that, and
    up to the largest loss tangent that the dielectric may have.
    """
    omega, (lead_f, lead_ohm) = 2 * pi * frequency_hz, leads

    @cache  # the same line at the end of other leads
    def own(ohm: float, farad: float, n: float, tangent: float) -> complex:
        lossy = 1j + tangent + tan(n * pi / 2)
        admittance = omega * farad * (frequency_hz / resting.LOWEST_HZ) ** -n * lossy + gone.leak_s
        return complex(line.cascade([ohm], [np.array([admittance])], [1.0])[0])

    def z(
        ohm: float, farad: float, parallel: float = lead_f.value, series: float = lead_ohm.value, n: float = 0.0,
        tangent: float = gone.tan_delta,
    ) -> complex:  # fmt: skip
        alone = own(ohm, farad, n, tangent)
        return series + alone / (1 + 1j * omega * parallel * alone)

    by_leads = list(product(lead_f[1:], lead_ohm[1:]))
    rest = list(product((r.lower, r.upper), (c.lower, c.upper)))
    losses = [*product((0.0, dispersion), (gone.tan_delta, gone.largest_tangent))]
    ends = [z(*of, *by, *loss) for of in rest for by in by_leads for loss in losses]
    alone = [z(r.value, c.value, *by) for by in by_leads]

    def part(name: str) -> Bounds:
        known = _of_line(r, c, lambda ohm, farad: float(getattr(z(ohm, farad), name)), "ohm")
        over, by = ([float(getattr(one, name)) for one in many] for many in (ends, alone))
        lossy = [float(getattr(z(r.value, c.value, n=n, tangent=tangent), name)) for n, tangent in losses]
        material = Interval(min(known.material.lower, *lossy), max(known.material.upper, *lossy))
        low, high = min(known.lower, *over), max(known.upper, *over)
        return replace(known, lower=low, upper=high, material=material, leads=Interval(min(by), max(by)))

    return Impedance(frequency_hz, part("real"), part("imag"))


def _at_load(result: Prediction, model: SensorModel, load: Load, query: Query) -> Prediction:
    """Sensitivity, resolution and error budget at the reference load; or why there are none."""
    law = model.law
    stiffest = (
        replace(model.sensor, compression=law.others[0])
        if law.compression.name == "unconfined" and law.bounded
        else None
    )
    load = replace(load, force_n=load.force_n or FORCE_N)
    try:
        known = identify(
            model.sensor, load.frequency_hz, query.noise, force_n=load.force_n, position_m=load.position_m,
            stiffest=stiffest, assumed=_unknown(model),
        )  # fmt: skip
        others: Otherwise = ([None], [None])
        layer: list[Sensor | None] = []
        if law.bounded:
            (*films,) = _other_films(model, load, query)
            others, layer = (list(_printed_otherwise(model, load, query)), films[:2]), films[2:]
        beyond = law.compression.doubt(float(model.sensor.stress_pa(load.force_n, load.position_m)))
        pressed = (beyond, query.few_periods(model.body.design), _free_sides(model.body))
        result = replace(
            result, identifiability=known, sensitivity=_sensitivity(model, load, query, others),
            doubts=(*result.doubts, *filter(None, pressed)),
            budget=error_budget(
                model, query.load(model.body.design), query.accuracy, *others, layer, query.noise, known.bench_ratio()
            ),
        )  # fmt: skip
        return _with_tops(_resolution(result, model, load, query, others), model, load, query)
    except SensorgenError as error:
        return replace(result, reason=str(error))


def _unknown(model: SensorModel) -> str:
    """Reason for a conditional verdict: a law of unknown error, or values that no source gives; or ""."""
    lacking = [f"{v.quantity} of {v.material}" for v in model.values if v.source == ASSUMED]
    if not model.law.bounded:
        return _ASSUMED
    return f"no source gives {' and '.join(lacking)}, assumed within a range" if lacking else ""


def _free_sides(body: Body) -> str:
    """That the law of compression holds for a cell of a larger sensor."""
    if not is_open(body.cells.first()):
        return ""
    return "compressed as a cell that its neighbours hold: the sides of this sensor are free, so that it deforms more"


def _printed_otherwise(model: SensorModel, load: Load, query: Query) -> Iterator[Sensor | None]:
    """Sensors by the ways to print it that have the least and the largest capacitance; None where one is not known."""
    body = model.body
    at_rest: list[tuple[float, Body, resting.RestState]] = [(model.sensor.capacitance_f(), body, model.rest)]
    for rule in list(body.cells.scenes)[1:]:
        with suppress(SensorgenError):  # as of a short, which the prediction tells by itself
            other = body.printed_otherwise(rule)
            rest = resting.rest_state(other, ranges=False)
            at_rest.append((rest.capacitance.value, other, rest))
    ends: dict[int, tuple[Body, resting.RestState]] = {}
    for end in (min, max):
        value = end(c for c, *_ in at_rest)
        ends |= next({id(other): (other, rest)} for c, other, rest in at_rest if abs(c / value - 1) < _SAME)
    yield from (_pressed(*pick, model, load, query) for pick in ends.values() if pick[0] is not body)


def _other_films(model: SensorModel, load: Load, query: Query) -> Iterator[Sensor | None]:
    """Sensors with the thickest and the thinnest film, and one a layer thinner; None where it is not known so."""
    body, rest, film = model.body, model.rest, model.body.cells.film
    films = ((film.thicker, rest.by_film.lower), (film.thinner, rest.by_film.upper),
             (film.layer_thinner, rest.layer_thinner_f)) if film else ()  # fmt: skip
    for scene, farad in films:
        if scene is None:
            yield None
            continue
        cells = replace(body.cells, scenes={"film": scene}, film=None)
        other = replace(body, make=lambda cells=cells: cells)  # type: ignore[misc]
        at_rest = replace(rest, capacitance=replace(rest.capacitance, value=farad))
        yield _pressed(other, at_rest, model, load, query)


def _pressed(other: Body, rest: resting.RestState, model: SensorModel, load: Load, query: Query) -> Sensor | None:
    """Another body's sensor, its law at a few pressures or in the model's closed form; None where it is not known."""
    tip, name = query.tip_of(other.design), model.law.compression.name
    pressure_pa = float(model.sensor.stress_pa(load.force_n, load.position_m))
    closed_form = name * (name in CLOSED_FORM)
    law = at_a_few_pressures(other.design, piece(other), rest.answer, pressure_pa, closed_form, tip=tip)
    return build_sensor(other, law, tip, rest=rest).sensor if law else None


def _with_tops(result: Prediction, model: SensorModel, load: Load, query: Query) -> Prediction:
    """Widen ranges by an even pressure and a stiff plate, and list these where they differ by more than the error.

    Under another top the relative errors are those under the tip.
    """
    tip = query.tip_of(model.body.design)
    own = {name: bounds for name in _UNITS if (bounds := getattr(result, name)) and bounds.value}
    others = (
        _under_top(name, law, own, model, load, query)
        for name, law in sorted(model.law.tops.items())
        if name != tip.block
    )
    first, known = UnderTop(tip.material, **own), result.identifiability
    if known:
        first = replace(first, calibrated=known.calibrated, typical=known.map.typical())
    tops = [first, *filter(None, others)]
    wider: dict[str, Any] = {}
    apart = False
    for key, bounds in own.items():
        under = [getattr(top, key).value for top in tops]
        apart |= not bounds.model.lower <= min(under) <= max(under) <= bounds.model.upper
        wider[key] = Bounds.of(
            bounds.value, bounds.unit, model=_compounded(bounds.value, [bounds.model, _range(under)]),
            print=bounds.print, material=bounds.material, certified=bounds.certified, open=bounds.open,
        )  # fmt: skip
    return replace(result, **wider, tops=tuple(tops) if apart else ())


def _under_top(
    name: str, law: Compression, own: Mapping[str, Bounds], model: SensorModel, load: Load, query: Query
) -> UnderTop | None:  # fmt: skip
    """Numbers under another top; None where it cannot take the load."""
    sensor = replace(model.sensor, compression=law)
    try:
        known = identify(
            sensor, load.frequency_hz, query.noise, force_n=load.force_n, position_m=load.position_m,
            assumed=_unknown(model),
        )  # fmt: skip
        values = known.sigma_force_n, known.sigma_position_m, _mean_slope(law, _range_pa(sensor, load, query))
    except OutOfRange:
        return None
    ratios = {key: value and value / own[key].value for key, value in zip(_UNITS, values, strict=True) if key in own}
    if None in ratios.values():
        return None
    under = {key: own[key].times(ratio, _UNITS[key]) for key, ratio in ratios.items() if ratio}
    return UnderTop(WORDS[name], **under, calibrated=known.calibrated, typical=known.map.typical())


def _sensitivity(model: SensorModel, load: Load, query: Query, others: Otherwise) -> Bounds:
    """(C(p) / C(q) - 1) / (p - q); of the reference load from rest unless the query has pressures [1/kPa]."""
    of = partial(_mean_slope, range_pa=_range_pa(model.sensor, load, query))
    value, laws = of(model.law.compression), _by_materials(model)
    by_print = [_range([value, *(of(s.compression) if s else nan for s in sensors)]) for sensors in others]
    return Bounds.of(
        value, "1/kPa", model=_span(value, of, model.law.others), material=_span(value, of, laws),
        print=_compounded(value, by_print),
        open="upper" if any(refusal(OutOfRange, of, law) for law in laws) else "",
    )  # fmt: skip


def _range_pa(sensor: Sensor, load: Load, query: Query) -> tuple[float, float]:
    """Pressures between which the sensitivity is stated [Pa]."""
    low_kpa, high_kpa = query.range_kpa or (0.0, float(sensor.stress_pa(load.force_n, load.position_m)) / _PA_PER_KPA)
    return _PA_PER_KPA * low_kpa, _PA_PER_KPA * high_kpa


def _mean_slope(law: Compression, range_pa: tuple[float, float]) -> float:
    """Relative rise of the capacitance between two pressures, over their difference [1/kPa]."""
    low, high = law.capacitive_strain(np.array(range_pa))[0].tolist()
    return float(((1 - low) / (1 - high) - 1) / (range_pa[1] - range_pa[0]) * _PA_PER_KPA)


def _resolution(result: Prediction, model: SensorModel, load: Load, query: Query, others: Otherwise) -> Prediction:
    """Standard errors of force and position from one reading, with what they are of sensors within the errors."""
    errors = partial(_errors, load=load, query=query)
    own, law = errors(model.sensor), model.law
    by_law = [errors(replace(model.sensor, compression=other)) for other in law.others] if law.bounded else [(nan, nan)]
    by_print = [[errors(sensor) for sensor in sensors] for sensors in others]
    values = list(material_ends(model, ReferenceLoad(model.sensor, load)))
    by_value = [[errors(sensor) for sensor in ends.sensors or ()] for ends in values]

    def of(which: int, unit: str) -> tuple[Bounds | None, dict[str, Interval]]:
        value = own[which]
        if isnan(value):
            return None, {}

        def spread_of(each: Sequence[tuple[float, float]]) -> Interval:
            return _range([value, *(e[which] for e in each)])

        by_cause = {ends.name: spread_of(each) for ends, each in zip(values, by_value, strict=True)}
        by_cause |= {"law": spread_of(by_law), **dict(zip(("width", "film"), map(spread_of, by_print), strict=True))}

        def compounded(*kinds: str) -> Interval:
            return _compounded(value, (by_cause[ends.name] for ends in values if ends.kind in kinds))

        whole = Bounds.of(
            value, unit, model=by_cause["law"], print=_compounded(value, (by_cause["width"], by_cause["film"])),
            material=compounded("material"), leads=compounded("leads"),
            open="lower" if any(ends.at_least for ends in values) else "",  # softer: more is resolved
        )  # fmt: skip
        return whole, by_cause

    (force, of_force), (position, of_position) = of(0, "N"), of(1, "m")
    result = replace(result, force_resolution=force, position_resolution=position)
    return replace(result, narrowing=tuple(narrowings(result, model.body, of_force, of_position)))


def _errors(sensor: Sensor | None, load: Load, query: Query) -> tuple[float, float]:
    """Standard errors of force and position [N], [m]; NaN where the sensor is not known under pressure."""
    if sensor is None:
        return nan, nan
    press = Setup(sensor, load.frequency_hz, query.noise, load.force_n, load.position_m)
    force, position, _ = press.bounds()
    return float(force), float(position)


def _compounded(value: float, parts: Iterable[Interval]) -> Interval:
    """Ranges of several causes, each at its worst: their relative changes multiply."""
    parts = list(parts)
    return Interval(value * prod(p.lower / value for p in parts), value * prod(p.upper / value for p in parts))


def _range(values: Sequence[float]) -> Interval:
    """Lowest and highest; all that is possible where one is not known."""
    return Interval(0.0, inf) if any(map(isnan, values)) else Interval(min(values), max(values))


def _span(value: float, of: Callable[[Compression], float], laws: Iterable[Compression]) -> Interval:
    """Lowest and highest over other laws of compression, those left out that the pressure is beyond."""
    return _range([value, *(of(law) for law in laws if refusal(OutOfRange, of, law) is None)])


def _by_materials(model: SensorModel) -> list[Compression]:
    """The law of compression with moduli and permittivities at the ends of their ranges."""
    ratios = resting.permittivity_ratios(model.body.design, model.body.cells.first()).values()
    of_c = [1.0, prod(low for low, _ in ratios), prod(high for _, high in ratios)]
    factors = {1.0, *modulus_range(model)[:2]}
    return [by_permittivity(model.law.compression.scaled_modulus(k), ratio) for k in factors for ratio in of_c]


def _ranges_assumed(design: Design, values: Iterable[MaterialValue]) -> Iterator[str]:
    """Ranges in place of values that no source gives, and of leads."""
    yield from assumed(design, values)
    farad, ohm = lead_ranges(design)
    yield (
        f"leads of {1e12 * farad[1]:.3g} to {1e12 * farad[2]:.3g} pF, with contacts {ohm[1]:.4g} to {ohm[2]:.4g} ohm: "
        "'leads' of the design states them"
    )


def _stripes(design: Design) -> Iterator[str]:
    """Infill that an estimate of the print has as stripes, and that is none."""
    from sensorgen.checks.estimate import lines

    for name, of in lines(design).items():
        if of.infill < 1 and of.pattern != "rectilinear":
            yield (
                f"{of.pattern} infill of {name} as stripes of its share, one above the other or crossed, both within "
                "the range; G-code states where its lines lie"
            )


def _assumptions(body: Body, model: SensorModel | None) -> Iterator[str]:
    """Assumptions of the model."""
    if is_open(body.cells.first()):
        yield "electrodes are equipotential for the capacitance, and the fringe at their edges is in free air"
    else:
        yield "electrodes are equipotential for the capacitance; the fringe at the sensor's edge is in the range alone"
    if body.kind == "estimated":
        yield from _stripes(body.design)
    yield "electrode resistance from end face to end face, cogs included"
    yield from _ranges_assumed(body.design, model.values if model else ())
    if not body.is_drawn:
        yield "contacts between extruded lines cost no resistance: no source gives their resistivity"
    gone = resting.lost(body.design)
    given = " and ".join(f"{t.quantity} of {t.material}" for t in gone.taken)
    unknown = f"a loss tangent of up to {resting.LARGEST_TANGENT:g} in the range of Z alone: no source gives it"
    if not gone.taken:
        yield f"no leak, and {unknown}"
    else:
        yield f"dielectric losses: {given} as given{f', else {unknown}' * (gone.largest_tangent > gone.tan_delta)}"
    rises = model.piezoresistance if model else {}
    if not rises:
        yield "resistivity under the tip as elsewhere: no source says how it changes with pressure"
    for end, value in rises.items():
        yield (
            f"resistivity of the {end} electrode rises with pressure by {value.value:g} 1/Pa "
            f"({value.material}, {value.source})"
        )
