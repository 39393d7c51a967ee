"""Error budget: the largest relative change of the impedance when each uncertain quantity moves to its ends.

Terms of the models are ``cell`` (bounds of the capacitance), ``compression`` (error of the law), ``boundary`` (boundary
and contact conditions of the cell), ``line`` (sections under the tip) and ``tip`` (profile of its pressure);
``slicer's walls`` is what slicers and line widths differ by, ``film thickness`` what the heights of two tools do,
``film a layer thinner`` a fault. Then come material values on which sources disagree, what leads, contacts and the
edge may add, and what a reading is exposed to (:mod:`sensorgen.prediction.exposure`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

from sensorgen.design.design import Design
from sensorgen.design.effects import GUESS
from sensorgen.design.materials import PIEZORESISTANCE
from sensorgen.design.tip import TOPS
from sensorgen.design.values import ENDS, MaterialValue, material_value, piezoresistance, resistivities, spread
from sensorgen.models.pressure import PROFILES
from sensorgen.models.sensor import UNIFORM, Sensor
from sensorgen.prediction.compression_law import CLOSED_FORM
from sensorgen.prediction.exposure import exposed
from sensorgen.prediction.print_faults import CHANGE, by_walls
from sensorgen.prediction.query import NOISE, Load
from sensorgen.prediction.reference_load import ReferenceLoad
from sensorgen.prediction.rest_state import added, permittivity_ratios
from sensorgen.prediction.results import Changes, ErrorBudget, Term
from sensorgen.prediction.sensor_model import SensorModel
from sensorgen.scene.scene import Scene

_NEAR = 1.01  # ratio of moduli that are not told apart
_MODEL = "model"
_BY_RATIO = 2.2  # relative deformation per Poisson's ratio below that taken [-]
_RICHARDSON = 4 / 3  # of what halving changes, where errors fall by four


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
    terms = (
        *_models(model, reference), *_print(model, reference, otherwise, films, layer), *_materials(model, reference),
        *exposed(model, reference),
    )  # fmt: skip
    total = Changes()
    for term in terms:
        total = total + (term.changes or Changes())
    known = all(t.changes for t in terms)
    at_least = any(t.at_least for t in terms)
    return ErrorBudget(load.force_n, load.position_m, terms, total if known else None, at_least, accuracy)


def _with_capacitances(model: SensorModel, values_f: Sequence[float]) -> list[Sensor]:
    per_m = model.sensor.capacitance_f_per_m / model.rest.capacitance.value
    return [replace(model.sensor, capacitance_f_per_m=per_m * value) for value in values_f]


def _models(model: SensorModel, reference: ReferenceLoad) -> Iterator[Term]:
    sensor, law, c = model.sensor, model.law, model.rest.capacitance
    ends = _with_capacitances(model, (c.model.lower, c.model.upper))
    yield reference.term(
        "cell", f"capacitance between its bounds ({model.rest.answer.model})", "model", ends, source=_MODEL
    )
    why = "error of the law" if law.bounded else "law of a solid plate (B.49) on a cell with gaps: error unknown"
    if law.others and law.others[0].name != law.compression.name:
        why = f"{law.compression.name} or {law.others[0].name}"
    if law.bounded:
        others = [replace(sensor, compression=o) for o in law.others]
        yield reference.term("compression", why, "model", others, source=_MODEL)
    else:
        yield Term("compression", why, "model", None, source=_MODEL)
    tops = [replace(sensor, compression=o) for o in (*law.tops.values(), *law.other_boundaries)]
    solid = not tops and law.bounded and law.compression.name in CLOSED_FORM
    more = ", faces that stick, or a cell free to widen" if law.other_boundaries else ": layers take both alike" * solid
    what, at_least = f"even pressure or a stiff plate on the top{more}", not solid and len(law.tops) < len(TOPS)
    yield reference.term("boundary", what, "model", tops, at_least=at_least, source=_MODEL)
    if sensor.profile == UNIFORM:
        yield reference.term("line", "one section under the tip is exact", "model", [sensor], source=_MODEL)
    else:
        finer = [replace(sensor, pieces=2 * sensor.pieces)]
        why = f"{sensor.pieces} sections under the tip"
        yield reference.term("line", why, "model", finer, factor=_RICHARDSON, source=_MODEL)
    profiles = [replace(sensor, profile=name) for name in PROFILES if name != sensor.profile]
    what = f"pressure distributed like {', '.join(s.profile for s in profiles)}"
    yield reference.term("tip", what, "model", profiles, source=_MODEL)


def _print(
    model: SensorModel, reference: ReferenceLoad, otherwise: Sequence[Sensor | None], films: Sequence[Sensor | None],
    layer: Sequence[Sensor | None],
) -> Iterator[Term]:  # fmt: skip
    """Walls, and the film's thickness: by the capacitance, and by the law of compression where that is known."""
    rest, film, design = model.rest, model.body.cells.film, model.body.design
    if not model.body.is_drawn:
        turns = by_walls(design)
        what = (
            f"line shapes or walls: {', '.join(model.body.cells.scenes)}{'; verdict by estimated walls' * bool(turns)}"
        )
        values_f = rest.by_width.lower, rest.by_width.upper
        yield reference.term(
            "slicer's walls", what, "print", _ends(model, values_f, otherwise), at_least=None in otherwise,
            source="slicers" if model.body.cells.tracks else "estimate", turns=turns,
        )  # fmt: skip
    if film:
        by, machine = (rest.by_film.lower, rest.by_film.upper), design.machine.name
        what = f"heights of the tools differ by up to {film.error_mm:g} mm"
        yield _of_film(reference, "film thickness", what, machine, film.thinner, _ends(model, by, films), films)
        thinner = _ends(model, (rest.layer_thinner_f,) if film.layer_thinner else (), layer)
        what = f"by {design.layers.layer_mm:g} mm"
        yield _of_film(reference, "film a layer thinner", what, GUESS, film.layer_thinner, thinner, layer)


def _of_film(
    reference: ReferenceLoad, name: str, what: str, source: str, thinnest: Scene | None, ends: Sequence[Sensor],
    known: Sequence[Sensor | None],
) -> Term:  # fmt: skip
    """A film at the ends of its thickness; CHANGE where none is left."""
    what += "" if thinnest else ": none is left"
    at_least = thinnest is None or None in known
    turns = "" if thinnest else CHANGE
    return reference.term(name, what, "print", ends, at_least=at_least, source=source, turns=turns)


def _ends(model: SensorModel, values_f: Sequence[float], sensors: Sequence[Sensor | None]) -> list[Sensor]:
    return [*_with_capacitances(model, values_f), *(s for s in sensors if s)]


def _materials(model: SensorModel, reference: ReferenceLoad) -> Iterator[Term]:
    for ends in material_ends(model, reference):
        yield reference.term(ends.name, ends.what, ends.kind, ends.sensors, at_least=ends.at_least)


class Ends(NamedTuple):
    """An uncertain value of a material or of the leads, and the sensor with it at its ends."""

    name: str
    what: str
    sensors: Sequence[Sensor]
    at_least: bool = False
    kind: Literal["material", "leads"] = "material"


def material_ends(model: SensorModel, reference: ReferenceLoad) -> Iterator[Ends]:
    """Uncertain values of materials and leads, of a sensor under the load of the reference."""
    design, sensor = model.body.design, model.sensor
    tracks = [spread(design, value) for value in resistivities(design).values()]
    if any(low < high for low, high in tracks):
        ends = [replace(sensor, resistivity_ohm_m=(a, b)) for a, b in zip(*tracks, strict=True)]
        what = f"of the electrodes, {_range_text(tracks)} ohm m"
        yield Ends("resistivity", what, ends)
    rises = [_piezoresistance_range(design, end) for end in ENDS]
    if any(low < high for low, high in rises):
        ends = [replace(sensor, piezoresistance_per_pa=(a, b)) for a, b in zip(*rises, strict=True)]
        what = f"of the electrodes, {_range_text(rises)} 1/Pa"
        yield Ends("piezoresistance", what, ends)
    yield from _stiffness(model, reference)
    for name, ratios in permittivity_ratios(design, model.body.cells.first()).items():
        value = next(v for v in model.rest.values if v.material == name and v.quantity == "relative_permittivity")
        low, high = spread(design, value)
        ends = [replace(sensor, capacitance_f_per_m=sensor.capacitance_f_per_m * ratio) for ratio in ratios]
        yield Ends(f"permittivity of {name}", f"{low:.3g} to {high:.3g}", ends)
    farad, ohm = added(model.body)
    ends = [replace(sensor, lead_f=end) for end in farad[1:]]
    yield Ends("lead capacitance", f"leads and edge, {_range_text([(1e12 * farad.least, 1e12 * farad.most)])} pF", ends,
               kind="leads")  # fmt: skip
    ends = [replace(sensor, lead_ohm=end) for end in ohm[1:]]
    yield Ends("contact resistance", f"leads and contacts, {_range_text([ohm[1:]])} ohm", ends, kind="leads")


def _piezoresistance_range(design: Design, end: str) -> tuple[float, float]:
    """Without a value for one electrode, it may be 0 there."""
    material, _ = design.slot(f"{end}_electrode")
    value = piezoresistance(design).get(end, MaterialValue(material.name, PIEZORESISTANCE, 0.0, ""))
    return spread(design, value)


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


def _stiffness(model: SensorModel, reference: ReferenceLoad) -> Iterator[Ends]:
    """All moduli at once, scaled by the largest change that any of them may have."""
    sensor, (softest, stiffest, what) = model.sensor, modulus_range(model)
    if softest < stiffest:
        least = _least_modulus(sensor, softest, reference)
        ends = [replace(sensor, compression=sensor.compression.scaled_modulus(factor)) for factor in (least, stiffest)]
        beyond = f": below {least:.2g} of it the load exceeds the compression law" if least > softest else ""
        yield Ends("stiffness", what + beyond, ends, at_least=least > softest)


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
