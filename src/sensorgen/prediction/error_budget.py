"""Error budget: the largest relative change of the impedance when each uncertain quantity moves to its ends.

Terms of the models are ``cell`` (bounds of the capacitance), ``compression`` (error of the law), ``boundary`` (boundary
and contact conditions of the cell), ``line`` (sections under the tip) and ``tip`` (profile of its pressure);
``slicer's walls`` is what slicers and line widths differ by, ``film thickness`` what the heights of two tools do,
``film a layer thinner`` a fault. Then come material values on which sources disagree, what leads, contacts and the
edge may add, and what a reading is exposed to beside the press: the design's ``effects``.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, product
from math import radians, tan

import numpy as np
import shapely

from sensorgen.checks import estimate, volumes
from sensorgen.checks.review import review
from sensorgen.core.arrays import Real
from sensorgen.core.errors import MissingValue, OutOfRange
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.effects import GUESS, Effects
from sensorgen.design.materials import PIEZORESISTANCE
from sensorgen.design.tip import EVEN, TOPS
from sensorgen.design.values import ENDS, MaterialValue, material_value, piezoresistance, resistivities, spread
from sensorgen.design.walls import rule, rules
from sensorgen.models import pressure
from sensorgen.models.compression import CapacitanceCurve, Compression, averaged, beyond
from sensorgen.models.pressure import PROFILES
from sensorgen.models.sensor import UNIFORM, Sensor
from sensorgen.prediction.compression_law import CLOSED_FORM, Law, gap_m
from sensorgen.prediction.query import NOISE, Load
from sensorgen.prediction.reference_load import Assumption, Dispersed, ReferenceLoad
from sensorgen.prediction.rest_state import added, permittivity_ratios
from sensorgen.prediction.results import Changes, ErrorBudget, Term
from sensorgen.prediction.sensor_model import RICHARDSON, SensorModel, piece
from sensorgen.scene.layers import drawn, united
from sensorgen.scene.scene import Scene

_NEAR = 1.01  # ratio of moduli that are not told apart
_MODEL = "model"
_BY_RATIO = 2.2  # relative deformation per Poisson's ratio below that taken [-]


def error_budget(
    model: SensorModel, load: Load, accuracy: float | None = None, otherwise: Sequence[Sensor | None] = (),
    films: Sequence[Sensor | None] = (), layer: Sequence[Sensor | None] = (), noise: float = NOISE,
    on_bench: tuple[float, float] = (1.0, 1.0),
) -> ErrorBudget:  # fmt: skip
    """The error budget of a load.

    Parameters
    ----------
    model : SensorModel
        That is loaded.
    load : Load
        Frequencies, force and position.
    accuracy : float, optional
        Wanted of abs(Z), relative [-].
    otherwise : sequence of Sensor or None
        The sensor as it may be printed otherwise; None where one is not known under pressure.
    films : sequence of Sensor or None
        The same with the thickest and the thinnest film.
    layer : sequence of Sensor or None
        The same with a film one layer thinner.
    noise : float
        Of a reading, relative to abs(Z) [-].
    on_bench : (float, float)
        Standard errors of force and position after known presses, over those of a perfect model [-].

    Raises
    ------
    OutOfRange
        A load that the sensor cannot take.
    """
    reference = ReferenceLoad(model.sensor, load, noise, on_bench)
    pressed = reference.force_n > 0
    assumptions = (
        *_models(model), *_print(model, otherwise, films, layer), *material_ends(model, reference),
        *(_exposed(model, reference) if pressed else ()),
    )  # fmt: skip
    terms = (*map(reference.term, assumptions), *(_read_off(model, reference) if pressed else ()))
    known = [term.changes for term in terms if term.changes]
    total = sum(known, Changes()) if len(known) == len(terms) else None
    return ErrorBudget(load.force_n, load.position_m, terms, total, any(t.at_least for t in terms), accuracy)


def _with_capacitances(model: SensorModel, values_f: Sequence[float]) -> list[Sensor]:
    per_m = model.sensor.capacitance_f_per_m / model.rest.capacitance.value
    return [replace(model.sensor, capacitance_f_per_m=per_m * value) for value in values_f]


def _models(model: SensorModel) -> Iterator[Assumption]:
    sensor, c = model.sensor, model.rest.capacitance
    of = partial(Assumption, kind="model", source=_MODEL)
    ends = _with_capacitances(model, (c.model.lower, c.model.upper))
    yield of("cell", f"capacitance between its bounds ({model.rest.answer.model})", sensors=ends)
    yield _law_error(sensor, model.law)
    yield _boundary(sensor, model.law)
    if sensor.profile == UNIFORM:
        yield of("line", "one section under the tip is exact", sensors=[sensor])
    else:
        finer = [replace(sensor, pieces=2 * sensor.pieces)]
        yield of("line", f"{sensor.pieces} sections under the tip", sensors=finer, factor=RICHARDSON)
    profiles = [replace(sensor, profile=name) for name in PROFILES if name != sensor.profile]
    yield of("tip", f"pressure distributed like {', '.join(s.profile for s in profiles)}", sensors=profiles)


def _law_error(sensor: Sensor, law: Law) -> Assumption:
    """Error of the law of compression itself."""
    why = "error of the law" if law.bounded else "law of a solid plate (B.49) on a cell with gaps: error unknown"
    if law.others and law.others[0].name != law.compression.name:
        why = f"{law.compression.name} or {law.others[0].name}"
    others = [replace(sensor, compression=o) for o in law.others] if law.bounded else None
    return Assumption("compression", why, "model", others, _MODEL)


def _boundary(sensor: Sensor, law: Law) -> Assumption:
    """Other boundary conditions: of the top of the cell, of faces in contact, and of its sides."""
    tops = [replace(sensor, compression=o) for o in (*law.tops.values(), *law.other_boundaries)]
    solid = not tops and law.bounded and law.compression.name in CLOSED_FORM
    more = ", faces that stick, or a cell free to widen" if law.other_boundaries else ": layers take both alike" * solid
    what, at_least = f"even pressure or a stiff plate on the top{more}", not solid and len(law.tops) < len(TOPS)
    return Assumption("boundary", what, "model", tops, _MODEL, at_least)


def _print(
    model: SensorModel, otherwise: Sequence[Sensor | None], films: Sequence[Sensor | None],
    layer: Sequence[Sensor | None],
) -> Iterator[Assumption]:  # fmt: skip
    """Walls, and the film's thickness: by the capacitance, and by the law of compression where that is known."""
    rest, cells, design = model.rest, model.body.cells, model.body.design
    if not model.body.is_drawn:
        turns = by_walls(design)
        what = f"line shapes or walls: {', '.join(cells.scenes)}{'; verdict by estimated walls' * bool(turns)}"
        ends = _ends(model, (rest.by_width.lower, rest.by_width.upper), otherwise)
        source = "slicers" if cells.tracks else "estimate"
        yield Assumption("slicer's walls", what, "print", ends, source, None in otherwise, turns=turns)
    if film := cells.film:
        ends = _ends(model, (rest.by_film.lower, rest.by_film.upper), films)
        what = f"heights of the tools differ by up to {film.error_mm:g} mm"
        yield _of_film("film thickness", what, design.machine.name, film.thinner, ends, films)
        ends = _ends(model, (rest.layer_thinner_f,) if film.layer_thinner else (), layer)
        what = f"by {design.layers.layer_mm:g} mm"
        yield _of_film("film a layer thinner", what, GUESS, film.layer_thinner, ends, layer)


def _of_film(
    name: str, what: str, source: str, thinnest: Scene | None, ends: Sequence[Sensor], known: Sequence[Sensor | None]
) -> Assumption:
    """A film at the ends of its thickness; CHANGE where none is left."""
    if thinnest is None:
        return Assumption(name, f"{what}: none is left", "print", ends, source, at_least=True, turns=CHANGE)
    return Assumption(name, what, "print", ends, source, at_least=None in known)


def _ends(model: SensorModel, values_f: Sequence[float], sensors: Sequence[Sensor | None]) -> list[Sensor]:
    return [*_with_capacitances(model, values_f), *(s for s in sensors if s)]


def material_ends(model: SensorModel, reference: ReferenceLoad) -> Iterator[Assumption]:
    """Uncertain values of materials and leads, of a sensor under the load of the reference."""
    design, sensor = model.body.design, model.sensor
    yield from _electrodes(design, sensor)
    yield from _stiffness(model, reference)
    for name, ratios in permittivity_ratios(design, model.body.cells.first()).items():
        value = next(v for v in model.rest.values if v.material == name and v.quantity == "relative_permittivity")
        low, high = spread(design, value)
        ends = [
            replace(
                sensor, capacitance_f_per_m=sensor.capacitance_f_per_m * ratio,
                compression=by_permittivity(sensor.compression, ratio),
            )
            for ratio in ratios
        ]  # fmt: skip
        yield Assumption(f"permittivity of {name}", f"{low:.3g} to {high:.3g}", "material", ends)
    by = model.rest.by_interface
    if by.lower < by.upper:
        ends = _with_capacitances(model, (by.lower, by.upper))
        yield Assumption("interfaces", "gap of the film's interfaces, as its source says", "material", ends)
    farad, ohm = added(model.body)
    what = f"leads and edge, {_range_text([(1e12 * farad.least, 1e12 * farad.most)])} pF"
    yield Assumption("lead capacitance", what, "leads", [replace(sensor, lead_f=end) for end in farad[1:]])
    what = f"leads and contacts, {_range_text([ohm[1:]])} ohm"
    yield Assumption("contact resistance", what, "leads", [replace(sensor, lead_ohm=end) for end in ohm[1:]])


def by_permittivity(law: Compression, ratio: float) -> Compression:
    """Law of a cell whose capacitance at rest a permittivity makes so many times as large.

    Where a gap in series closes, the relative rise is in proportion to C; a solid plate's stays. Solved: 1.25 times as
    large in tri for a C of 1.19, 1.05 in rect, whose gaps hardly close, for 1.33.
    """
    return law.scaled_rise(ratio) if isinstance(law, CapacitanceCurve) else law


def _electrodes(design: Design, sensor: Sensor) -> Iterator[Assumption]:
    """Resistivity and piezoresistance of both electrodes at once, where any is uncertain."""
    tracks = [spread(design, value) for value in resistivities(design).values()]
    if any(low < high for low, high in tracks):
        ends = [replace(sensor, resistivity_ohm_m=(a, b)) for a, b in zip(*tracks, strict=True)]
        yield Assumption("resistivity", f"of the electrodes, {_range_text(tracks)} ohm m", "material", ends)
    rises, given = [], piezoresistance(design)
    for end in ENDS:  # without a value for one electrode, it may be 0 there
        none = MaterialValue(design.slot(f"{end}_electrode")[0].name, PIEZORESISTANCE, 0.0, "")
        rises.append(spread(design, given.get(end, none)))
    if any(low < high for low, high in rises):
        ends = [replace(sensor, piezoresistance_per_pa=(a, b)) for a, b in zip(*rises, strict=True)]
        yield Assumption("piezoresistance", f"of the electrodes, {_range_text(rises)} 1/Pa", "material", ends)


def modulus_range(model: SensorModel) -> tuple[float, float, str]:
    """Least and largest factor on all moduli at once that any material may have, Poisson's ratio included; in words.

    A cell whose ratio is lower by 0.05 deforms by 11 % more (two meshes of tri 0.1, 0.4999 and 0.45).
    """
    design, used, softest, stiffest, parts = model.body.design, model.body.design.used(), 1.0, 1.0, []
    for value in model.law.taken:
        if value.quantity != "youngs_modulus_pa":
            continue
        e, nu = (
            material_value(design.material(value.material), used[value.material], quantity)
            for quantity in ("youngs_modulus_pa", "poisson_ratio")
        )
        (low, high), (least, most) = spread(design, e), spread(design, nu)
        if model.law.compression.name in CLOSED_FORM:  # of plates: Young's modulus alone
            least = most = nu.value
        softest = min(softest, low / value.value / (1 + _BY_RATIO * (nu.value - least)))
        stiffest = max(stiffest, high / value.value * (1 + _BY_RATIO * (most - nu.value)))
        ratio = f", Poisson's ratio {least:.4g} to {most:.4g}" if least < most else ""
        parts.append(f"{value.material} {low / 1e6:.3g} to {high / 1e6:.3g} MPa{ratio}")
    return softest, stiffest, ", ".join(parts)


def _stiffness(model: SensorModel, reference: ReferenceLoad) -> Iterator[Assumption]:
    """All moduli at once, scaled by the largest change that any of them may have."""
    sensor, (softest, stiffest, what) = model.sensor, modulus_range(model)
    if softest < stiffest:
        least = _least_modulus(sensor, softest, reference)
        ends = [replace(sensor, compression=sensor.compression.scaled_modulus(factor)) for factor in (least, stiffest)]
        beyond = f": below {least:.2g} of it the load exceeds the compression law" if least > softest else ""
        yield Assumption("stiffness", what + beyond, "material", ends, at_least=least > softest)


def _least_modulus(sensor: Sensor, softest: float, reference: ReferenceLoad) -> float:
    """Factor of the modulus above which the load is within the law: ``softest``, or a per cent above the limit."""
    law = sensor.compression
    low, high = softest, 1.0
    if reference.change(replace(sensor, compression=law.scaled_modulus(low))):
        return low
    while high / low > _NEAR:
        middle = (low * high) ** 0.5
        bearable = reference.change(replace(sensor, compression=law.scaled_modulus(middle)))
        low, high = (low, middle) if bearable else (middle, high)
    return high


def _range_text(ranges: Sequence[tuple[float, float]]) -> str:
    low, high = min(a for a, _ in ranges), max(b for _, b in ranges)
    return " to ".join(f"{float(f'{end:.3g}'):g}" for end in (low, high))


_EDGE = 0.45  # of the width: farthest that a tip is pressed off the middle


def _exposed(model: SensorModel, reference: ReferenceLoad) -> Iterator[Assumption]:
    """Assumptions about a reading beside the press."""
    effects = model.body.design.effects
    parts = _drift(effects, model.sensor), _memory(effects, reference), _tip(model, reference), _first_layer(model)
    return (one for one in chain(*parts) if one.sensors is None or one.sensors)


def _read_off(model: SensorModel, reference: ReferenceLoad) -> Iterator[Term]:
    """Errors of the meter, and of the person who notes the press."""
    effects = model.body.design.effects
    if effects.meter:
        gain = Changes(*(effects.meter,) * 5)  # the same at rest: the press is read as it is
        what = f"{effects.meter:.2g} of every reading"
        yield Term("meter's gain", what, "meter", gain, source=effects.source("meter"))
    if effects.meter_circuit:
        circuit, what = reference.other_circuit(), "C, R and D of one circuit taken for those of the other"
        yield Term(
            "meter: series or parallel", what, "meter", circuit, source=effects.source("meter_circuit"),
            turns=reference.turns(circuit),
        )  # fmt: skip
    if effects.person_n or effects.person_mm:
        press = Changes(force_n=effects.person_n, position_m=effects.person_mm * M_PER_MM)
        what = f"press noted {effects.person_n:g} N and {effects.person_mm:g} mm off"
        source = effects.source("person_n", "person_mm")
        yield Term("person", what, "person", press, source=source, turns=reference.turns(press))


def _drift(e: Effects, sensor: Sensor) -> Iterator[Assumption]:
    """Drift of permittivity and resistivity since the reading at rest, and their dispersion."""
    causes = ("temperature", "k", "K"), ("humidity", "percent", "% of humidity")
    for quantity, (cause, unit, words) in product(("permittivity", "resistivity"), causes):
        keys = f"{quantity}_per_{unit}", f"{cause}_{unit}"
        per, change = (getattr(e, key) for key in keys)
        factors = [1 + sign * per * change for sign in (-1, 1) if per * change]
        if quantity == "permittivity":
            ends = [replace(sensor, capacitance_f_per_m=sensor.capacitance_f_per_m * factor) for factor in factors]
        else:
            top, bottom = sensor.resistivity_ohm_m
            ends = [replace(sensor, resistivity_ohm_m=(top * factor, bottom * factor)) for factor in factors]
        what = f"{per * change:.2g} by {change:g} {words} since the reading at rest"
        yield Assumption(f"{quantity}, {cause}", what, "drift", ends, e.source(*keys), since_rest=True)
    n, m = e.permittivity_dispersion, e.resistivity_dispersion
    dispersed = [Dispersed(**vars(sensor), permittivity_power=n, resistivity_power=m)] if n or m else []
    source = e.source("permittivity_dispersion", "resistivity_dispersion")
    yield Assumption("dispersion", f"permittivity as f^-{n:g}, resistivity as f^-{m:g}", "drift", dispersed, source)


def _memory(e: Effects, reference: ReferenceLoad) -> Iterator[Assumption]:
    """Memory of the film: of a higher load, and of the time under this one."""
    for name, share, when in (
        ("hysteresis", e.hysteresis, "after a higher load"), ("creep", e.creep, "under a load that lasts"),
    ):  # fmt: skip
        ends = _with_law(reference, lambda _: np.ones(1), 1 + share) if share else []
        what = f"rise of C {share:.2g} larger {when}"
        yield Assumption(name, what, "drift", ends, e.source(name), since_rest=True)


def _tip(model: SensorModel, reference: ReferenceLoad) -> Iterator[Assumption]:
    """Piezoresistance under the tip; uneven pressure across the sensor: a tip off the middle, or tilted."""
    e, width_m, of = model.body.design.effects, model.sensor.width_m, partial(Assumption, since_rest=True)
    if not model.piezoresistance:
        per_pa = e.piezoresistance / reference.stress_pa()
        changed = [replace(model.sensor, piezoresistance_per_pa=(s * per_pa, s * per_pa)) for s in (-1, 1) if per_pa]
        what = f"resistivity under the tip {e.piezoresistance:g} lower or higher"
        yield of("piezoresistance", what, "drift", changed, e.source("piezoresistance"))
    if e.off_middle_mm:
        across = pressure.off_middle(min(e.off_middle_mm * M_PER_MM / width_m, _EDGE))
        ends, what = _with_law(reference, lambda _: across), f"by {e.off_middle_mm:g} mm across"
        yield of("tip off the middle", what, "tip", ends, e.source("off_middle_mm"))
    if e.tilt_deg and model.body.design.tip.block != EVEN:
        ends = _tilted(model, reference, tan(radians(e.tilt_deg)) * width_m)
        ended = len(ends or ()) > 1
        what = f"by {e.tilt_deg:g} degrees across{': its edge presses beyond the compression law' * ended}"
        yield of("tip tilted", what, "tip", ends, e.source("tilt_deg"), at_least=ended)


def _first_layer(model: SensorModel) -> Iterator[Assumption]:
    """A bottom electrode thinner than drawn: its first layer squeezed, or the bed uneven."""
    e, (top, bottom) = model.body.design.effects, model.sensor.electrode_m
    for key, least_mm, name in (
        ("squeezed_mm", e.squeezed_mm, "first layer squeezed"), ("bed_mm", e.bed_mm, "bed uneven"),
    ):  # fmt: skip
        thinner = bottom - least_mm * M_PER_MM
        ends = None if thinner <= 0 else [replace(model.sensor, electrode_m=(top, thinner))] if least_mm else []
        what = f"by {least_mm:g} mm: bottom electrode thinner"
        turns = by_first_layer(model.body.design, least_mm) if least_mm else ""
        yield Assumption(name, what, "print", ends, e.source(key), turns=turns)


def _with_law(
    reference: ReferenceLoad, shares: Callable[[float], Real], scale: float = 1.0
) -> list[Sensor] | None:  # fmt: skip
    """The sensor with the rise of its parts at uneven pressures, times a scale; None beyond the law of a plate.

    Beyond the law of a cell, whose gaps close: with no further rise, and with one by its last slope.
    """
    sensor, mean_pa = reference.sensor, reference.stress_pa()
    try:
        laws = [averaged(law, shares, mean_pa) for law in beyond(sensor.compression, mean_pa, shares)]
    except OutOfRange:
        return None
    return [replace(sensor, compression=law.scaled_rise(scale)) for law in laws]


def _tilted(model: SensorModel, reference: ReferenceLoad, difference_m: float) -> list[Sensor] | None:
    """Under a tip that is held so many metres lower at one side; None where it is not known how the film yields."""
    design, tip = model.body.design, model.body.design.tip.tip()
    block = tip.height_m / design.material(tip.block).value("youngs_modulus_pa").value if tip.soft else 0.0
    try:
        film_pa_per_m = model.sensor.compression.foundation_stiffness_pa_per_m(gap_m(piece(model.body).scene))
    except (MissingValue, OutOfRange):
        return None
    rise_pa = difference_m / (1 / film_pa_per_m + block)
    return _with_law(reference, lambda mean_pa: pressure.tilted(rise_pa, mean_pa))


CHANGE, PRINT = "CHANGE", "PRINT"


def by_walls(design: Design) -> str:
    """Verdict with the walls of other slicers: CHANGE where they lose a body, PRINT where these alone do; else ""."""
    own, others = rule("prusa", design.walls), rules(design.profile.walls)
    lost = {walls: _loses(design, walls) for walls in dict.fromkeys((own, *others))}
    if not lost[own]:
        return CHANGE if any(lost.values()) else ""
    return PRINT if any(not lost[w] and review(design, walls=w).verdict != CHANGE for w in lost) else ""


def _loses(design: Design, walls: str) -> bool:
    """Test whether a body is not printed at all in some layer, which the design does not waive."""
    scene = design.printed
    layers = estimate.layers(scene, design.machine, design.layers, walls, estimate.lines(design))
    found = design.waived(volumes.findings(volumes.rows(scene, layers), scene))
    return any(f.severity == "error" and not f.waiver for f in found)


def by_first_layer(design: Design, thinner_mm: float) -> str:
    """Verdict with a first layer thinner by a length [mm]: CHANGE where none is left, or electrodes in it touch.

    A line keeps its area, so that its sides move out by w t / (2 (h - t)); within an electrode they have no room.
    """
    scene, quality = design.printed, design.layers
    first = drawn(scene, quality.boundaries_mm(scene.size_mm[2]))[0]
    left_mm = first.height_mm - thinner_mm
    if left_mm <= 0:
        return CHANGE
    aside_mm = design.machine.line_mm() * thinner_mm / (2 * left_mm)
    ends = {b.terminal: [first.region(c.name) for c in scene.bodies if c.terminal == b.terminal] for b in scene.bodies}
    spread = [shapely.buffer(united(parts), aside_mm) for terminal, parts in ends.items() if terminal]
    area_mm2 = sum(region.area for region in spread) - shapely.union_all(spread).area
    return CHANGE if area_mm2 > 1e-9 else ""
