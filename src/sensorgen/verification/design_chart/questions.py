"""Quantities of a design: models and other programs that give them, and their references."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import inf

import numpy as np

from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design.body import Body
from sensorgen.design.design import Design
from sensorgen.design.values import film, permittivities
from sensorgen.models import CapacitanceModel, capacitance_models, thesis_cells
from sensorgen.models.press2d import BoundaryConditions, Elastic
from sensorgen.models.sensor import Sensor
from sensorgen.prediction import mesh_ladder, sensor_model
from sensorgen.prediction.capacitance import Answer, expected, is_plate
from sensorgen.prediction.compression_law import CLOSED_FORM, elastic, law_of
from sensorgen.prediction.mesh_ladder import PressedPiece
from sensorgen.prediction.query import Query
from sensorgen.prediction.rest_state import rest_state
from sensorgen.prediction.sensor_model import piece
from sensorgen.scene.scene import Scene
from sensorgen.solvers.line.inputs import PressedLine, read
from sensorgen.verification import line_models, peers
from sensorgen.verification.apart import Work
from sensorgen.verification.design_chart import works

OWN = "sensorgen"
WIDTHS, WIDTHS_IN_3D = (1e-3, 1e-5, 1e-7), (1e-1, 1e-2, 1e-3, 1e-4)  # of the bounds of C, wanted
ACCURACIES = (1e-1, 1e-2, 1e-3)
DIGITS = 2.0**-52
_SPATIAL = 3  # cost of a field solve in space

Level = tuple[str, Work, float]


@dataclass(frozen=True)
class Series:
    """A model, or another program, with its levels from coarse to fine; or why it does not apply.

    Attributes
    ----------
    model, program : str
        Name, and the program that it is of.
    levels : tuple of (str, callable, float)
        Words; work that gives an answer, of a module; expected time, 0 where unknown [s].
    why_not : str
        Why it has no levels.
    """

    model: str
    program: str
    levels: tuple[Level, ...]
    why_not: str = ""


@dataclass(frozen=True)
class Reference:
    """Value that answers are compared with.

    Attributes
    ----------
    name, program : str
        In words, and the program that it is of.
    value : tuple of complex
        The answer.
    doubt : float
        Relative error of it [-].
    """

    name: str
    program: str
    value: tuple[complex, ...]
    doubt: float


@dataclass(frozen=True)
class Question:
    """A quantity of a design.

    Attributes
    ----------
    key, title, asked : str
        Name, title of its panel, and the quantity in words.
    series : tuple of Series
        Models and programs.
    references : tuple of Reference
        Those that are known before anything runs.
    measure : callable
        From an answer and a reference to their relative distance.
    """

    key: str
    title: str
    asked: str
    series: tuple[Series, ...]
    references: tuple[Reference, ...]
    measure: Callable[[tuple[complex, ...], tuple[complex, ...]], float]


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
        _capacitance(body), _compression(body, stress_pa), _line(sensor, query, body), _prediction(body, query),
    ]  # fmt: skip


def _capacitance(body: Body) -> Question:
    scene, count = body.cells.first(), body.cells.count or 1.0  # 0 where every cell has a rim
    eps = {v.material: v.value for v in permittivities(body.design)}
    series = []
    for name, module in capacitance_models().items():
        why = module.why_not_applicable(scene) or ""
        levels = () if why else tuple(_bounds(name, module, scene, eps, count))
        series.append(Series(name, OWN, levels, why))
    series += _formulas(body.design, eps)
    for name in peers.FIELD:
        runs, why = peers.applicable(name, scene, eps)
        levels = tuple(
            (level.rstrip(", "), partial(works.peer, name, scene, eps, k, count), 0.0)
            for k, (level, _) in enumerate(runs)
        )
        series.append(Series(name, name, levels, why))
    return Question("capacitance", "capacitance at rest", "C at rest", tuple(series), (), largest)


def _bounds(
    name: str, module: CapacitanceModel, scene: Scene, permittivity: Mapping[str, float], count: float
) -> Iterator[Level]:  # fmt: skip
    """Levels of one of our models by the width of its bounds; one alone where none can be asked for."""
    widths = (None,) if inf == module.WIDTH else WIDTHS if module.COST < _SPATIAL else WIDTHS_IN_3D
    for w in widths:
        work = partial(works.capacitance, name, scene, permittivity, w, count)
        yield (f"width {w:g}", work, expected(name, scene, w)[1] or 0.0) if w else ("", work, 0.0)


def _formulas(design: Design, permittivity: Mapping[str, float]) -> Iterator[Series]:
    """Formulas of the thesis for the shape of a design."""
    area_m2 = design.params.length_mm * design.params.width_mm * M_PER_MM**2
    for name, law in thesis_cells.NAMED.items():
        if design.shape in law.shapes:
            work = partial(works.formula, name, design.params, permittivity[film(design)], area_m2)
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
    elif any(each.levels for each in meshes):
        references = _published(body, elastic(body.design, pressed.scene), stress_pa)
    asked = f"rise of C at {stress_pa / 1e3:.4g} kPa"
    return Question("compression", asked, asked, series, references, largest)


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
    from sensorgen.verification.chart import presses

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


def exact(line: PressedLine) -> tuple[complex, ...]:
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
    series = [Series("pressure", OWN, (), "a flat tip presses evenly")]
    for name, levels in line_models.LEVELS.items():
        why = _why_no_line(name, sensor)
        runs = tuple((line_models.words(how), partial(works.line, name, line, how), 0.0) for how in levels)
        series.append(Series(name, name if name in line_models.PROGRAMS else OWN, () if why else runs, why))
    known = (Reference("chain matrices in 220 digits", "decimal numbers", exact(line), DIGITS),)
    return Question("line", "pressed line", "Z of the line, |Z| and Re Z", tuple(series), known, of_line)


def _why_no_line(model: str, sensor: Sensor) -> str:
    """Why a model of lines does not apply to a sensor, or ""."""
    lossy = sensor.tan_delta or sensor.leak_s_per_m
    if model == "sheet" and (lossy or any(sensor.piezoresistance_per_pa)):
        return "the film loses, or the tracks are piezoresistive"
    why = peers.missing(model) if model in line_models.PROGRAMS else ""
    return why or ("the film loses: its ladder has capacitors alone" if model == "ngspice" and lossy else "")


def _prediction(body: Body, query: Query) -> Question:
    free, fine = replace(query, law="unconfined"), [(f"{a:g}", replace(query, accuracy=a)) for a in ACCURACIES]
    rough = ("", partial(works.predicted, body, query, rough=True), 0.0)
    series = [Series("predict: closed forms", OWN, (rough,))]
    for name, levels in (("plate, free", [("", free)]), ("default", [("", query)]), ("accuracy", fine)):
        runs = [(level, partial(works.predicted, body, asked), _seconds(body, asked)) for level, asked in levels]
        series.append(Series(f"predict: {name}", OWN, tuple(runs)))
    return Question("prediction", "whole prediction", "|Z| under the load", tuple(series), (), of_modulus)


def _seconds(body: Body, query: Query) -> float:
    """Expected time of a prediction [s]."""
    plan = sensor_model.plan(body, query.load(body.design), query.accuracy, query.law, query.tip_of(body.design)).plan
    chosen = (next(c for c in level.candidates if c.model == level.chosen) for level in plan.levels)
    return sum(c.expected_seconds or 0.0 for c in chosen)


def largest(answer: tuple[complex, ...], known: tuple[complex, ...]) -> float:
    """Largest relative distance [-]."""
    return max(abs(a / b - 1) for a, b in zip(answer, known, strict=True))


def of_line(answer: tuple[complex, ...], known: tuple[complex, ...]) -> float:
    """The larger one of abs(Z) and of Re Z by itself, at the worst frequency [-]."""
    return max(line_models.differences(answer, known))


def of_modulus(answer: tuple[complex, ...], known: tuple[complex, ...]) -> float:
    """Of abs(Z), at the worst frequency [-]."""
    return max(abs(abs(a) / abs(b) - 1) for a, b in zip(answer, known, strict=True))
