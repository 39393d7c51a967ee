"""Speed against accuracy for one design: every model that applies to it, and other programs, timed in new processes."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import Any, ClassVar

import numpy as np

from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.values import film, permittivities
from sensorgen.models import CapacitanceModel, capacitance_models, thesis_cells
from sensorgen.models.compression import Plate
from sensorgen.models.press2d import BoundaryConditions, Elastic
from sensorgen.models.sensor import Sensor
from sensorgen.prediction import mesh_ladder, sensor_model
from sensorgen.prediction.capacitance import Answer, expected, is_plate
from sensorgen.prediction.compression_law import CLOSED_FORM, elastic, law_of
from sensorgen.prediction.mesh_ladder import PressedPiece
from sensorgen.prediction.query import Query
from sensorgen.prediction.rest_state import rest_state
from sensorgen.prediction.sensor_model import piece, rough_sensor
from sensorgen.scene.scene import Scene
from sensorgen.solvers.line.inputs import PressedLine, read
from sensorgen.verification import line_models, peers
from sensorgen.verification.apart import Runner, apart
from sensorgen.verification.chart import presses, works
from sensorgen.verification.chart.results import (
    DIGITS,
    OWN,
    Chart,
    Level,
    Question,
    Reference,
    Series,
    Values,
    best_of,
    measured,
    of_line,
    of_modulus,
)

KEYS = ("capacitance", "compression", "line", "prediction")
WIDTHS, WIDTHS_IN_3D = (1e-3, 1e-5, 1e-7), (1e-1, 1e-2, 1e-3, 1e-4)  # of the bounds of C, wanted
ACCURACIES = (1e-1, 1e-2, 1e-3)
_SPATIAL = 3  # cost of a field solve in space


@dataclass(frozen=True, kw_only=True)
class DesignChart(Chart):
    """Speed against accuracy for one design.

    Attributes
    ----------
    design, body : str
        Name, and what of it.
    force_n, position_m : float
        The load [N], [m].
    """

    design: str
    body: str
    force_n: float
    position_m: float

    ALT: ClassVar = (
        "Hollow: cold, in a new process with nothing stored. Filled: warm, solved once more in the same process. "
        "Dashed: Pareto front. Dotted: what the references are known to; no error is drawn below."
    )

    @property
    def title(self) -> str:
        """Title of its pictures."""
        return f"Speed and accuracy for {self.design}"

    def head(self) -> tuple[str, ...]:
        """Design and body, and the load."""
        return (f"{self.design}, {self.body}: {self.force_n:g} N at {self.position_m * 1e3:g} mm",)


def chart(
    body: Body, query: Query, keys: Sequence[str] = KEYS, *, budget_s: float = 10.0,
    step: Callable[[str], None] = lambda _: None, runner: Runner = apart,
) -> DesignChart:  # fmt: skip
    """Measure every model that applies to a body.

    Parameters
    ----------
    body : Body
        Drawn or printed.
    query : Query
        Frequencies and reference load.
    keys : sequence of str
        Of ``KEYS``; a prediction is compared with the best of capacitance and compression, which run for it too.
    budget_s, step, runner : float, callable, callable
        As of :func:`measured`.

    Raises
    ------
    SensorgenError
        Nothing can be predicted of the body.
    """
    needed = {*keys, *(KEYS[:2] if "prediction" in keys else ())}
    asked = (question for question in questions(body, query) if question.key in needed)
    whole, load = measured(asked, budget_s, step, runner).only(keys), query.load(body.design)
    return DesignChart(
        **vars(whole), design=body.design.name, body=body.provenance, force_n=load.force_n, position_m=load.position_m
    )


def questions(body: Body, query: Query) -> list[Question]:
    """Capacitance, compression, line and whole prediction of a body, under the reference load of a query.

    Raises
    ------
    SensorgenError
        Nothing can be predicted of it, as of a short; a load that the sensor cannot take.
    """
    load = query.load(body.design)
    sensor = sensor_model.rough_sensor(body, "", query.tip_of(body.design)).sensor
    stress_pa = float(sensor.stress_pa(load.force_n, load.position_m))
    return [
        _capacitance(body), _compression(body, stress_pa), _line(sensor, query, body), prediction(body, query),
    ]  # fmt: skip


def _capacitance(body: Body) -> Question:
    scene, count = body.cells.first(), body.cells.count or 1.0  # 0 where every cell has a rim
    eps, params = {v.material: v.value for v in permittivities(body.design)}, body.design.params
    area_m2 = params.length_mm * params.width_mm * M_PER_MM**2
    series = (
        *bounds(scene, lambda name, module: _bounds(name, module, scene, eps, count)),
        *formulas(body.design.shape, params, eps, film(body.design), area_m2), *programs(scene, eps, count),
    )  # fmt: skip
    return Question("capacitance", "capacitance at rest", "C at rest", series)


def bounds(scene: Scene, levels: Callable[[str, CapacitanceModel], Iterable[Level]]) -> Iterator[Series]:
    """Our models of the capacitance of a scene, each with its levels."""
    for name, module in capacitance_models().items():
        why = module.why_not_applicable(scene) or ""
        yield Series(name, OWN, () if why else levels(name, module), why)


def programs(scene: Scene, permittivity: Mapping[str, float], count: float) -> Iterator[Series]:
    """Programs of others that give the capacitance of that many cells."""
    for name in peers.FIELD:
        runs, why = peers.applicable(name, scene, permittivity)
        levels = tuple(
            (level.rstrip(", "), partial(works.peer, name, scene, permittivity, k, count), 0.0)
            for k, (level, _) in enumerate(runs)
        )
        yield Series(name, name, levels, why)


def _bounds(
    name: str, module: CapacitanceModel, scene: Scene, permittivity: Mapping[str, float], count: float
) -> Iterator[Level]:  # fmt: skip
    """Levels of one of our models by the width of its bounds; one alone where none can be asked for."""
    widths = (None,) if inf == module.WIDTH else WIDTHS if module.COST < _SPATIAL else WIDTHS_IN_3D
    for w in widths:
        work = partial(works.capacitance, name, scene, permittivity, w, count)
        yield (f"width {w:g}", work, expected(name, scene, w)[1] or 0.0) if w else ("", work, 0.0)


def formulas(
    shape: str, params: Any, permittivity: Mapping[str, float], material: str, area_m2: float
) -> Iterator[Series]:  # fmt: skip
    """Formulas of the thesis for the capacitance of an area of a shape."""
    for name, law in thesis_cells.NAMED.items():
        if shape in law.shapes:
            work = partial(works.formula, name, params, permittivity[material], area_m2)
            yield Series(f"thesis_cells: {name.removeprefix('thesis-')}", OWN, (("", work, 0.0),))


def _compression(body: Body, stress_pa: float) -> Question:
    rest, pressed = rest_state(body, inf).answer, piece(body)
    plate = is_plate(rest, pressed.scene)
    meshes = list(_meshes(body, pressed, stress_pa, plate=plate))
    series = (
        Series("springs", OWN, (), "it has a displacement and no capacitance"),
        *_laws(body, rest, pressed, stress_pa, plate=plate), *meshes,
    )  # fmt: skip
    references: tuple[Reference, ...] = ()
    if plate:
        ends = [works.rise_by_law(body, law, stress_pa).value[0].real for law in ("unconfined", "bonded")]
        middle = (ends[0] + ends[1]) / 2
        references = (Reference("between a free and a bonded plate", "laws", (middle,), abs(ends[0] / middle - 1)),)
    elif not all(each.why_not for each in meshes):
        references = _published(body, elastic(body.design, pressed.scene), stress_pa)
    asked = f"rise of C at {stress_pa / 1e3:.4g} kPa"
    return Question("compression", asked, asked, series, references)


def _laws(body: Body, rest: Answer, pressed: PressedPiece, stress_pa: float, *, plate: bool) -> Iterator[Series]:
    """Laws that solve no field, and the stored curve of a cell that is no plate."""
    for law in (*CLOSED_FORM, ""):
        try:
            law_here = law_of(body.design, rest, law, printed=None if body.is_drawn else pressed)
        except SensorgenError as error:
            yield Series(f"compression: {law}", OWN, (), str(error))
        else:
            if law or not (plate or not law_here.bounded):
                work = partial(works.rise_by_law, body, law, stress_pa)
                yield Series(f"compression: {law or 'stored curve'}", OWN, (("", work, 0.0),))


def _meshes(body: Body, pressed: PressedPiece, stress_pa: float, *, plate: bool) -> Iterator[Series]:
    """Finite elements."""
    eps = {v.material: v.value for v in permittivities(body.design)}
    for name in mesh_ladder.MODELS:
        why = mesh_ladder.why_not_applicable(pressed, name)
        if why or plate:
            yield Series(name, OWN, (), why or "a solid plate lies between its two laws, free and bonded")
            continue
        case = mesh_ladder.Case(pressed, name, elastic(body.design, pressed.scene), eps, BoundaryConditions())
        levels = tuple(
            (mesh.name.removeprefix(name).strip(", ") or "usual mesh",
             partial(works.rise_by_mesh, case, mesh.level, stress_pa, mesh.rise_error), mesh.seconds)
            for mesh in mesh_ladder.mesh_levels(pressed, name, 2)
        )  # fmt: skip
        yield Series(name, OWN, levels)


def _published(body: Body, solids: Mapping[str, Elastic], stress_pa: float) -> tuple[Reference, ...]:
    """Published answers of two other programs for this very cell under this pressure, if there are any."""
    soft = all(
        name in presses.SOLIDS and np.isclose(solid.youngs_modulus_pa, presses.SOLIDS[name].youngs_modulus_pa)
        for name, solid in solids.items()
    )
    for known in presses.CELLS.values() if soft and body.is_drawn and body.design.shape == "tri" else ():
        at = np.flatnonzero(np.isclose(np.array(known.stress_kpa) * 1e3, stress_pa))
        size = {name: getattr(body.design.params, name) for name in ("length_mm", "width_mm")}
        if len(at) and replace(known.params(), **size) == body.design.params:
            rise = known.rise_pf_per_m[at[0]] / known.rest_pf_per_m
            return (Reference("two other programs", "published", (rise,), known.known_to[1]),)
    return ()


def pressed_line(sensor: Sensor, query: Query, position_m: float) -> PressedLine:
    """The line of a sensor under a load, its film replaced by one of vacuum with the same capacitance."""
    stress = sensor.stress_pa(query.force_n, position_m)
    strain = float(sensor.compression.capacitive_strain(stress)[0])
    patch = sensor.patch(position_m)
    by_force = [float(rise * stress / query.force_n) for rise in sensor.piezoresistance_per_pa]
    length_m = float(patch.length_m)
    return PressedLine(
        length_m=sensor.length_m, width_m=sensor.width_m, top_thickness_m=sensor.electrode_m[0],
        bottom_thickness_m=sensor.electrode_m[1], top_resistivity_ohm_m=sensor.resistivity_ohm_m[0],
        bottom_resistivity_ohm_m=sensor.resistivity_ohm_m[1], eps_r=1.0,
        film_m=EPS0_F_PER_M * sensor.width_m / sensor.capacitance_f_per_m, frequency_hz=np.array(query.frequency_hz),
        force_n=query.force_n, modulus_pa=query.force_n / (sensor.width_m * length_m * strain),
        left_m=float(patch.left_m), tip_m=length_m, top_piezoresistance_per_n=by_force[0],
        bottom_piezoresistance_per_n=by_force[1], tan_delta=sensor.tan_delta, leak_s_per_m=sensor.leak_s_per_m,
    )  # fmt: skip


def exact(line: PressedLine) -> Values:
    """Impedance of a line at every frequency, in many digits [ohm]."""
    r, y, length = read(line).sections()
    return tuple(
        line_models.exact_impedance(
            [float(np.ravel(a)[0]) for a in r], [complex(np.ravel(a)[min(k, np.size(a) - 1)]) for a in y],
            [float(a) for a in length],
        )
        for k in range(np.size(line.frequency_hz))
    )  # fmt: skip


def _line(sensor: Sensor, query: Query, body: Body) -> Question:
    line = pressed_line(sensor, query, query.load(body.design).position_m)
    series = (
        Series("pressure", OWN, (), "a flat tip presses evenly"),
        *lines(line, line_models.LEVELS, partial(_why_no_line, sensor)),
    )
    known = (Reference("chain matrices in 220 digits", "decimal numbers", exact(line), DIGITS),)
    return Question("line", "pressed line", "Z of the line, |Z| and Re Z", series, known, of_line)


def lines(
    line: PressedLine, levels: Mapping[str, Sequence[Mapping[str, Any]]], why_not: Callable[[str], str]
) -> Iterator[Series]:  # fmt: skip
    """Models of lines, and programs of others, each with its levels or why it does not apply."""
    for name, each in levels.items():
        runs = tuple((line_models.words(how), partial(works.line, name, line, how), 0.0) for how in each)
        why = why_not(name)
        yield Series(name, name if name in line_models.PROGRAMS else OWN, () if why else runs, why)


def _why_no_line(sensor: Sensor, model: str) -> str:
    """Why a model of lines does not apply to a sensor, or ""."""
    lossy = sensor.tan_delta or sensor.leak_s_per_m
    if model == "sheet" and (lossy or any(sensor.piezoresistance_per_pa)):
        return "the film loses, or the tracks are piezoresistive"
    why = peers.missing(model) if model in line_models.PROGRAMS else ""
    return why or ("the film loses: its ladder has capacitors alone" if model == "ngspice" and lossy else "")


def prediction(body: Body, query: Query) -> Question:
    """Impedance of a sensor under the load of a query, by whole predictions from rough to accurate."""
    free, fine = replace(query, law="unconfined"), [(f"{a:g}", replace(query, accuracy=a)) for a in ACCURACIES]
    rough = ("", partial(works.predicted, body, query, rough=True), 0.0)
    series = [Series("predict: closed forms", OWN, (rough,))]
    for name, levels in (("plate, free", [("", free)]), ("default", [("", query)]), ("accuracy", fine)):
        runs = [(level, partial(works.predicted, body, asked), _seconds(body, asked)) for level, asked in levels]
        series.append(Series(f"predict: {name}", OWN, tuple(runs)))
    by = partial(composed, body, query)
    return Question("prediction", "whole prediction", "|Z| under the load", tuple(series), (), of_modulus, by)


def _seconds(body: Body, query: Query) -> float:
    """Expected time of a prediction [s]."""
    plan = sensor_model.plan(body, query.load(body.design), query.accuracy, query.law, query.tip_of(body.design)).plan
    chosen = (next(c for c in level.candidates if c.model == level.chosen) for level in plan.levels)
    return sum(c.expected_seconds or 0.0 for c in chosen)


def composed(body: Body, query: Query, best: Mapping[str, Sequence[Reference]]) -> Iterator[Reference]:
    """Impedance of a line in many digits, with the best capacitance and the best rise of the others."""
    model = rough_sensor(body, "", query.tip_of(body.design))
    load = query.load(body.design)
    query = replace(query, position_m=load.position_m)
    if not all(best[key] for key in KEYS[:2]):
        return
    c, rise = (best_of(best[key], OWN) for key in KEYS[:2])
    farad, rises = c.value[0].real, rise.value[0].real

    def z(farad: float, rises: float) -> Values:
        law = Plate("given", "", float(model.sensor.stress_pa(load.force_n, load.position_m)) * (1 + rises) / rises)
        sensor = replace(model.sensor, capacitance_f_per_m=farad / model.sensor.length_m, compression=law)
        return exact(pressed_line(sensor, query, load.position_m))

    value = z(farad, rises)
    doubt = of_modulus(z(farad * (1 + c.doubt), rises), value) + of_modulus(z(farad, rises * (1 + rise.doubt)), value)
    program = OWN if OWN in (c.program, rise.program) else "others"
    yield Reference(f"C by {c.name}, rise by {rise.name}, line in 220 digits", program, value, doubt)
