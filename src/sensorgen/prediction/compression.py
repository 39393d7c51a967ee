"""Displacement and capacitance of a design's cell under pressure: results of ``sensorgen compress``."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Real, finite
from sensorgen.core.bounds import Interval
from sensorgen.core.display import Displayed
from sensorgen.core.document import Column, Part, Table
from sensorgen.core.errors import BadInput, MissingValue, NotInstalled, OutOfRange, SensorgenError
from sensorgen.design.body import Body
from sensorgen.design.design import Design
from sensorgen.design.tip import TOPS, WORDS, Tip
from sensorgen.design.values import assumed, of_all_materials, permittivities
from sensorgen.models import press2d, springs
from sensorgen.models.compression import curve_of
from sensorgen.models.press2d import BoundaryConditions
from sensorgen.prediction import capacitance_answer as at_rest
from sensorgen.prediction import mesh_ladder
from sensorgen.prediction.capacitance import Answer, Unpredictable, capacitance, is_plate
from sensorgen.prediction.compression_law import (
    case_of,
    closed_f_per_m2,
    elastic,
    gap_m,
    infill,
    law_of,
    like_infill,
    under_tops,
)
from sensorgen.prediction.mesh_ladder import Case, Estimate, PressedPiece, why_not_applicable
from sensorgen.prediction.plan import Level, Plan, PlanCandidate, cheapest, run_until_within
from sensorgen.prediction.rest_state import perfect_interfaces
from sensorgen.prediction.sensor_model import piece as piece_of
from sensorgen.prediction.sweep import Sweeper


@dataclass(frozen=True)
class ClosedForm:
    """A closed-form estimate of the displacement.

    Attributes
    ----------
    displacement_m : (n,) array
        Of the top, at every stress [m].
    boundary : dict of str to str
        Boundary conditions that the law assumes.
    doubts : tuple of str
        Limits of its validity.
    rises : tuple of (n,) array
        C'(p)/C'(0) - 1, by the law and by each within its error; none of springs [-].
    """

    displacement_m: NDArray[np.float64]
    boundary: dict[str, str]
    doubts: tuple[str, ...]
    rises: tuple[NDArray[np.float64], ...] = ()


def _springs(design: Design, piece: PressedPiece, stress_pa: Sequence[float]) -> ClosedForm:
    """Samples as springs side by side, for any scene."""
    scene, why = piece.scene, press2d.why_not_applicable(piece.scene)
    solids = elastic(design, scene)
    moduli = {n: s.youngs_modulus_pa / (1.0 if why else 1 - s.poisson_ratio**2) for n, s in solids.items()}
    boxes = all(p.is_box() for body in scene.bodies for p in body.pieces)
    meaning = (
        "at most this, at small strain under a stiff plate"
        if boxes
        else "an estimate: columns without their neighbours"
    )
    doubts = (
        f"displacement: {meaning}", "no capacitance under stress: springs have no outlines", *([why] if why else [])
    )  # fmt: skip
    return ClosedForm(springs.displacement_m(scene, moduli, stress_pa), {"top": "rigid"}, doubts)


PLATES = {"unconfined": "free", "bonded": "bonded to both electrodes"}


def law_name(design: Design, piece: PressedPiece) -> str:
    """Law in closed form of a solid plate, or of infill; "" of other cells, which are solved."""
    try:
        if len({b.terminal for b in piece.scene.bodies} - {""}) != 2:
            return ""
        known = _at_rest(design, piece)
        if is_plate(known, piece.scene):
            return "bonded"
        return "infill" if like_infill(design, piece) and infill(design, piece) else ""
    except SensorgenError:
        return ""


def _at_rest(design: Design, piece: PressedPiece) -> Answer:
    eps = {t.material: t.value for t in permittivities(design)}
    return capacitance(piece.scene, eps, model="columns", keep=False)


def _law(name: str, design: Design, piece: PressedPiece, stress_pa: Sequence[float]) -> ClosedForm:
    """A law of solid plates or of infill."""
    known = _at_rest(design, piece)
    if name in PLATES and not is_plate(known, piece.scene):
        raise BadInput(f"--model {name} applies to a solid plate, {design.shape} is none: try springs")
    mesh_ladder.refuse_crushing(
        stress_pa[-1], {n: taken.value for n, taken in of_all_materials(design, "youngs_modulus_pa").items()}
    )
    law, gap, stress = law_of(design, known, name, printed=piece), gap_m(piece.scene), np.asarray(stress_pa)
    with suppress(OutOfRange):  # of the softest, whose electrodes would touch
        strains = [each.capacitive_strain(stress)[0] for each in (law.compression, *law.others)]
        rises = tuple(strain / (1 - strain) for strain in strains)
        displacement_m = stress / law.compression.foundation_stiffness_pa_per_m(gap)
        doubts = (f"displacement: of the film between its electrodes, {law.compression.source}", *law.doubts)
        return ClosedForm(displacement_m, {"sides": PLATES.get(name, "as infill")}, doubts, rises)
    raise OutOfRange(f"{stress_pa[-1] / 1e3:g} kPa: by the softest law the electrodes touch; expected less")


CLOSED_FORMS: dict[str, Callable[[Design, PressedPiece, Sequence[float]], ClosedForm]] = {
    "springs": _springs, **{name: partial(_law, name) for name in (*PLATES, "infill")},
}  # fmt: skip
FIRST = "springs"  # applies to any scene: the default where no field can be solved


Step = Callable[[float], None]
ALL = (*mesh_ladder.MODELS, *CLOSED_FORMS)

COLUMNS = (
    Column("stress", "kPa", key="stress_kpa"), Column("displacement", "um", key="displacement_um"),
    Column("+/-", "um", key="displacement_error_um", digits=2),
    Column("rise of C", "F/m2", key="rise_f_per_m2", si=True),
    Column("+/-", "F/m2", key="rise_error_f_per_m2", digits=2, si=True),
    Column("C, lower", "F/m2", key="lower_f_per_m2", digits=7, si=True),
    Column("C, upper", "F/m2", key="upper_f_per_m2", digits=7, si=True),
)  # fmt: skip
HIDDEN = tuple(
    Column(k, key=k, hidden=True) for k in ("converged_kpa", "largest_rise_error", "model", "reached", "reason")
)

_PA_PER_KPA, _UM_PER_M = 1e3, 1e6
_OF_BOTH = "of the capacitance at rest plus its rise, whose error is an estimate from two meshes"
_NO_C = "displacement alone, no capacitance"
_MEASURE = "relative error of the rise of C, at the worst stress"


@dataclass(frozen=True)
class PressQuestion:
    """Question about a press.

    Attributes
    ----------
    stress_kpa : tuple of float
        Rising, 0 first [kPa].
    boundary : BoundaryConditions
        Base, period and contact.
    model : str
        One of ``ALL``, or "" for the first that applies to the scene.
    accuracy : float
        Largest relative error of the rise C(p) - C(0) at any stress; where infinite, the usual mesh is taken [-].
    check_mesh : bool
        Hold the displacement against the next coarser mesh.
    keep : bool
        Read cached solutions, and store new ones.
    sides : str
        "bonded": a plate follows the law of one that bulges at its edges; else ``boundary`` holds for it, too.
    tip : Tip or None
        What presses; the design's own if None.
    """

    stress_kpa: tuple[float, ...]
    boundary: BoundaryConditions
    model: str = ""
    accuracy: float = inf
    check_mesh: bool = False
    keep: bool = True
    sides: str = "bonded"
    tip: Tip | None = None


def boundary(sides: str, **others: str) -> BoundaryConditions:
    """Boundary conditions of a cell, by those of the sensor's sides; ``others`` are those of the contact."""
    return BoundaryConditions(*(("sliding", "free") if sides == "free" else ("bonded", "fixed")), **others)


@dataclass(frozen=True, kw_only=True)
class CompressionResult(Displayed):
    """Displacement and bounds of the capacitance per area over stress.

    Attributes
    ----------
    design, body : str
        Name of the design, and what of it.
    model : str or None
        That gave the values; None where none did.
    held : dict of str to str
        Boundary conditions.
    stress_kpa, displacement_um : tuple of float
        On the top [kPa], of the top [um]; None beyond the highest stress that was solved.
    rise_f_per_m2 : tuple of float or None
        Capacitance per area above that at rest, at each stress [F/m2].
    displacement_error_um, rise_error_f_per_m2 : tuple of float or None
        Estimated errors of both, of the mesh at an apex too; None where unknown.
    lower_f_per_m2, upper_f_per_m2 : tuple of float or None
        Bounds of the capacitance per area at each stress [F/m2]; None where unknown.
    converged_kpa : float or None
        Highest stress that was solved [kPa]; beyond it the capacitance lies between that one's and the closed cell's.
    faults, doubts : tuple of str
        Why the answer is not to be trusted; why its numbers are uncertain.
    bounds : str
        What the bounds hold.
    tops : mapping of str to tuple of float or None
        Rise under an even pressure and a stiff plate, of those that differ by more than the error [F/m2].
    accuracy : float or None
        Relative error of the rise that was asked for [-].
    largest_rise_error, largest_displacement_error : float or None
        The largest at any stress, relative [-].
    reached : bool or None
        Whether the accuracy is reached; None where none was asked for.
    plan : Plan or None
        Meshes, with what they reached.
    reason : str
        Why there is no answer, or "".
    """

    design: str
    body: str
    model: str | None = None
    held: dict[str, str] = field(default_factory=dict)
    stress_kpa: tuple[float, ...] = ()
    displacement_um: tuple[float | None, ...] = ()
    displacement_error_um: tuple[float | None, ...] = ()
    rise_f_per_m2: tuple[float | None, ...] = ()
    rise_error_f_per_m2: tuple[float | None, ...] = ()
    lower_f_per_m2: tuple[float | None, ...] = ()
    upper_f_per_m2: tuple[float | None, ...] = ()
    converged_kpa: float | None = None
    faults: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    bounds: str = ""
    tops: Mapping[str, tuple[float | None, ...]] = field(default_factory=dict)
    accuracy: float | None = None
    largest_rise_error: float | None = None
    largest_displacement_error: float | None = None
    reached: bool | None = None
    plan: Plan | None = None
    reason: str = ""

    def table(self) -> Table:
        """A row for each stress; one with the reason where there is no answer."""
        under = {name: self.tops.get(name, (None,) * len(self.stress_kpa)) for name in TOPS}
        columns = [
            Column(f"rise, {WORDS[name]}", "F/m2", key=f"rise_{name}_f_per_m2", si=True, hidden=name not in self.tops)
            for name in TOPS
        ]
        curve = zip(
            self.stress_kpa, self.displacement_um, self.displacement_error_um, self.rise_f_per_m2,
            self.rise_error_f_per_m2, self.lower_f_per_m2, self.upper_f_per_m2, *under.values(), strict=True,
        )  # fmt: skip
        reason = self.reason or "; ".join(self.faults)
        more = self.converged_kpa, self.largest_rise_error, self.model, self.reached, reason
        rows = curve if self.model else [(None,) * 9]
        return Table("compression", "", (*COLUMNS, *columns, *HIDDEN), tuple((*row, *more) for row in rows))

    def document(self) -> Iterator[Part]:
        """The curve, how the cell was held, and what is uncertain."""
        yield self.design
        yield self.table()
        errors = (("displacement", self.largest_displacement_error), ("rise of C", self.largest_rise_error))
        known = "".join(f"; {name} known to {error:.1%}" for name, error in errors if error is not None)
        target = "" if self.accuracy is None else f" (target {self.accuracy:.3g})"
        last_kpa = max(self.stress_kpa, default=0.0)
        bounds = f", bounds up to {last_kpa:.4g} kPa" if self.displacement_um[-1:] == (None,) else ""
        yield f"converged up to {self.converged_kpa:.4g} kPa{bounds}{known}{target}"
        yield from self.remarks()

    def explained(self) -> Iterator[Part]:
        """Meshes that were used, their cost and error."""
        yield from (*self.plan.document(), "") if self.plan else ()

    def remarks(self) -> Sequence[str]:
        """Remarks on how the cell was held, on faults of the answer, and on what is uncertain."""
        if self.model is None:
            return (f"no answer: {self.reason}",)
        return (
            f"{self.model}: {', '.join(f'{key} {value}' for key, value in self.held.items())}",
            f"body: {self.body}",
            *(f"fault: {fault}" for fault in self.faults),
            *(f"doubt: {doubt}" for doubt in self.doubts),
        )

    def problems(self) -> Sequence[str]:
        """Why it is not what was asked for."""
        if self.model is None:
            return (f"no answer: {self.reason}",)
        wrong = [f"not to be trusted: {fault}" for fault in self.faults]
        if self.reached is False:
            error = self.largest_rise_error
            best = "error unknown" if error is None else f"the rise of C is known to {error:.2g}"
            wrong.append(f"accuracy {self.accuracy:g} not reached: {best}")
        return wrong


def answer(body: Body, asked: PressQuestion, *, step: Step | None = None) -> CompressionResult:
    """Displacement and bounds of the capacitance per area over stress.

    Parameters
    ----------
    body : Body
        Drawn or printed.
    asked : PressQuestion
        Stresses, boundary conditions and accuracy.
    step : callable, optional
        Called with every stress that is reached [Pa].

    Raises
    ------
    MissingValue
        A modulus, a Poisson's ratio or a permittivity that no source gives, or no mesher
        where ``asked`` names a model that needs it (NotInstalled); else springs answer.
    BadInput, OutOfRange
        As :func:`sensorgen.models.press2d.press`; other electrodes than two, sides that a bonded base holds, a
        stress above the least modulus; an accuracy of springs, or one that is not above 0.
    """
    try:
        if asked.accuracy < inf:
            return _within(body, asked, step)
        model = _model(body, asked)
        if model in CLOSED_FORMS:
            return _closed_form(body, asked, model)
        case = _case(body, asked)
        estimate = _estimated(case, asked, mesh_ladder.USUAL, step)
        if asked.check_mesh:
            finer = _estimated(case, asked, mesh_ladder.USUAL + 1, step)
            estimate = replace(finer, found=press2d.compared(estimate.found, finer.found))
        return _result(body, case, estimate, asked)
    except NotInstalled as error:
        if asked.model:
            raise
        return _unsolved(body, asked, str(error))


def _failed(body: Body, reason: str) -> CompressionResult:
    return CompressionResult(design=body.design.name, body=body.provenance, reason=reason)


sweep = Sweeper(answer, _failed, refused=(BadInput, MissingValue, OutOfRange, Unpredictable))


def planned(body: Body, asked: PressQuestion) -> Plan:
    """Plan of an accuracy, before anything is pressed; parameters and errors as of :func:`answer`."""
    if not asked.accuracy > 0:
        raise OutOfRange(f"an accuracy of {asked.accuracy:g}; expected a number above 0, as 1e-2")
    piece = piece_of(body)
    model = _model(body, asked)
    if model in (*PLATES, "infill"):
        raise BadInput(
            f"an accuracy of C, which follows the law {model}, a closed form, between its bounds: leave out "
            "--accuracy, or solve one of unlimited cells with --sides symmetric"
        )
    if model in CLOSED_FORMS:
        why = f"--model {model}" if asked.model else why_not_applicable(piece, mesh_ladder.MODELS[0])
        raise BadInput(f"an accuracy of C, and {why}: {model} tells {_NO_C}; leave out --accuracy")
    passed_over = [
        PlanCandidate(name, passed_over=f"--model {model}" if asked.model else _unfit(piece, name))
        for name in ALL if name != model
    ]  # fmt: skip
    meshes = mesh_ladder.mesh_levels(piece, model, len(asked.stress_kpa) - 1)
    reach = [PlanCandidate(mesh.name, max(mesh.rise_error, mesh_ladder.VERIFIED), mesh.seconds) for mesh in meshes]
    candidates = (*passed_over, *reach)
    level = Level("compression", _MEASURE, asked.accuracy, candidates, cheapest(candidates, asked.accuracy))
    return Plan(asked.accuracy, f"the rise of C up to {asked.stress_kpa[-1]:g} kPa", (level,))


def _unfit(piece: PressedPiece, name: str) -> str:
    """Why a model is not the one of a piece whose capacitance is to reach an accuracy."""
    if name in CLOSED_FORMS:
        return _NO_C
    return why_not_applicable(piece, name) or "the model before it applies to the cell"


def _model(body: Body, asked: PressQuestion) -> str:
    piece = piece_of(body)
    usual = asked.sides == "bonded" and asked.boundary.period == "fixed"
    law = law_name(body.design, piece) if usual and not asked.model and not asked.check_mesh else ""
    return (
        law or asked.model or next((name for name in mesh_ladder.MODELS if not why_not_applicable(piece, name)), FIRST)
    )


def _within(body: Body, asked: PressQuestion, step: Step | None) -> CompressionResult:
    """The first mesh within tolerance, from the expected one upwards; the best where none is."""
    plan, case = planned(body, asked), _case(body, asked)
    find = {
        mesh.name: partial(_estimated, case, asked, mesh.level, step)
        for mesh in mesh_ladder.mesh_levels(case.piece, case.model, len(asked.stress_kpa) - 1)
    }
    estimate, level = run_until_within(plan.levels[0], find, _rise_error)
    return replace(
        _result(body, case, estimate, asked),
        accuracy=asked.accuracy,
        reached=_rise_error(estimate) <= asked.accuracy,
        plan=replace(plan, levels=(level,)),
    )


def _rise_error(estimate: Estimate) -> float:
    """Largest relative error of the rise; infinite where the solution is not to be trusted [-]."""
    return inf if estimate.found.faults else estimate.relative()[1]


def _case(body: Body, asked: PressQuestion) -> Case:
    """Case to press; refuses one that would be answered, but not as it was asked."""
    piece = piece_of(body)
    ends = sorted({body.terminal for body in piece.scene.bodies if body.terminal})
    if ends != ["bottom", "top"]:
        raise BadInput(
            f"a cell with electrodes {', '.join(ends) or 'of no kind'}: expected two, bottom and top, whose "
            "capacitance a press changes; --model springs tells the displacement alone"
        )
    if asked.boundary.period == "free" and asked.boundary.base == "bonded":
        raise BadInput("free sides over a bonded base are not possible: expected base 'sliding' with them")
    return case_of(body.design, piece, _model(body, asked), asked.tip or body.design.tip.tip(), asked.boundary)


def _estimated(case: Case, asked: PressQuestion, level: int, step: Step | None) -> Estimate:
    stress_pa = [_PA_PER_KPA * kpa for kpa in asked.stress_kpa]
    return mesh_ladder.estimated(case, stress_pa, level, keep=asked.keep, step=step)


def _result(body: Body, case: Case, estimate: Estimate, asked: PressQuestion) -> CompressionResult:
    """In the units of results; the capacitance begins with that of the sensor at rest, as all predictions have it.

    The rise of a sensor of whole and broken periods, of which one was pressed, is scaled by what both differ at rest.
    """
    from sensorgen.solvers.contact.cell import BLOCK

    solution, tip = estimate.found, asked.tip or body.design.tip.tip()
    rest, factor = _known_at_rest(body, asked, solution.capacitance_f_per_m2[0])
    rise, off = factor * estimate.rise_f_per_m2, factor * estimate.rise_error_f_per_m2
    lower, upper = (rise - off + rest.lower, rise + off + rest.upper) if rest else (nan + rise, nan + rise)
    errors = (inf, inf) if solution.faults else estimate.relative()
    displacement_error, rise_error = (error if error < inf else None for error in errors)
    result = CompressionResult(
        design=body.design.name, body=body.provenance, model=case.model,
        held=vars(case.boundary) | ({"top": tip.material} if BLOCK in case.solids else {}),
        stress_kpa=tuple(p / _PA_PER_KPA for p in solution.stress_pa.tolist()),
        displacement_um=tuple(d * _UM_PER_M for d in solution.displacement_m.tolist()),
        displacement_error_um=_known(_UM_PER_M * estimate.displacement_error_m),
        rise_f_per_m2=_known(rise), rise_error_f_per_m2=_known(off),
        lower_f_per_m2=_known(lower), upper_f_per_m2=_known(upper),
        converged_kpa=solution.converged_pa / _PA_PER_KPA, faults=solution.faults, bounds=_OF_BOTH,
        doubts=(*solution.doubts, *_assumed(body.design)),
        largest_rise_error=rise_error, largest_displacement_error=displacement_error,
        tops=dict(_under_tops(body, case, estimate, tip)),
    )  # fmt: skip
    return _further(result, replace(case, piece=piece_of(body)), estimate, asked, rest, factor)


def _further(
    result: CompressionResult, case: Case, estimate: Estimate, asked: PressQuestion, rest: Interval | None,
    factor: float,
) -> CompressionResult:  # fmt: skip
    """A result up to all stresses asked for: beyond the last that was solved by bounds, as laws of compression are.

    As it is where its solution has other faults than that it ended, and where the closed cell is unknown.
    """
    more = [kpa for kpa in asked.stress_kpa if kpa * _PA_PER_KPA > estimate.found.converged_pa * (1 + 1e-9)]
    last_f, least_f = result.upper_f_per_m2[-1], result.lower_f_per_m2[-1]
    sound = estimate.found.sound()
    is_sound = not sound.faults and sound.converged_pa == estimate.found.converged_pa
    if not (more and is_sound and rest and last_f and least_f):
        return result
    try:
        most_f = np.array([max(last_f, factor * closed_f_per_m2(case, _PA_PER_KPA * kpa)) for kpa in more])
        own = curve_of(sound)
    except (ValueError, OutOfRange):
        return result
    last_kpa, slope = estimate.found.converged_pa / _PA_PER_KPA, own.slope_per_pa[-1] * rest.middle() * _PA_PER_KPA
    rise = (result.rise_f_per_m2[-1] or 0.0) + slope * (np.array(more) - last_kpa)
    rise = np.minimum(rise, most_f - rest.upper)
    off = np.maximum(rise + rest.lower - least_f, most_f - rise - rest.upper)
    none = (None,) * len(more)
    doubt = (
        f"from {last_kpa:.4g} to {more[-1]:.4g} kPa the cell was not solved: C lies between that at {last_kpa:.4g} kPa "
        "and that of the closed cell"
    )
    return replace(
        result,
        stress_kpa=(*result.stress_kpa, *more),
        displacement_um=(*result.displacement_um, *none),
        displacement_error_um=(*result.displacement_error_um, *none),
        rise_f_per_m2=(*result.rise_f_per_m2, *rise.tolist()),
        rise_error_f_per_m2=(*result.rise_error_f_per_m2, *off.tolist()),
        lower_f_per_m2=(*result.lower_f_per_m2, *(least_f for _ in more)),
        upper_f_per_m2=(*result.upper_f_per_m2, *most_f.tolist()),
        tops={name: (*values, *none) for name, values in result.tops.items()},
        faults=(), doubts=(doubt, *result.doubts), largest_rise_error=float((off / rise).max()),
    )  # fmt: skip


def _known_at_rest(body: Body, asked: PressQuestion, first: Interval | None) -> tuple[Interval | None, float]:
    """Capacitance at rest per area, and its ratio to the ``first`` of a pressed period: 1 where both may be equal."""
    try:
        rest = at_rest.answer(body, at_rest.CapacitanceQuestion(keep=asked.keep))
    except Unpredictable:
        return first, 1.0
    if not first or rest.lower_f_per_m2 is None or rest.upper_f_per_m2 is None:
        return first, 1.0
    known = Interval(rest.lower_f_per_m2, rest.upper_f_per_m2)
    apart = known.upper < first.lower or first.upper < known.lower
    return known, known.middle() / first.middle() if apart else 1.0


def _under_tops(
    body: Body, case: Case, estimate: Estimate, tip: Tip
) -> Iterator[tuple[str, tuple[float | None, ...]]]:  # fmt: skip
    """Rise of C under an even pressure and a stiff plate, where it differs by more than the error."""
    try:
        own = curve_of(estimate.found.sound())
        laws = under_tops(body.design, piece_of(body), case.model, tip, own, case.boundary)
    except SensorgenError:
        return
    stress, at_rest = estimate.found.stress_pa, estimate.found.capacitance_f_per_m2[0]
    at_rest_f_per_m2 = at_rest.middle() if at_rest else nan
    for name, law in laws.items():
        strain = law.capacitive_strain(np.minimum(stress, law.stress_pa[-1]))[0]
        rise = np.where(stress <= law.stress_pa[-1], at_rest_f_per_m2 * strain / (1 - strain), nan)
        if name != tip.block and (abs(rise - estimate.rise_f_per_m2) > estimate.rise_error_f_per_m2).any():
            yield name, _known(rise)


def _assumed(design: Design) -> Iterator[str]:
    """Values of the cell that no source gives, with their ranges; and interfaces that are left out."""
    elastic = (of_all_materials(design, q).values() for q in ("youngs_modulus_pa", "poisson_ratio"))
    values = (*chain.from_iterable(elastic), *permittivities(design))
    return chain(assumed(design, values), perfect_interfaces(design))


def _known(values: Real) -> tuple[float | None, ...]:
    """Values as JSON holds them: None where one is not finite."""
    return tuple(finite(values))


def _closed_form(body: Body, asked: PressQuestion, model: str) -> CompressionResult:
    """Displacement, and of a plate or infill the capacitance, by a law that solves no field."""
    estimate = CLOSED_FORMS[model](body.design, piece_of(body), [_PA_PER_KPA * kpa for kpa in asked.stress_kpa])
    unknown = np.full(len(asked.stress_kpa), nan)
    rise = off = lower = upper = unknown
    if estimate.rises:
        rest = at_rest.answer(body, at_rest.CapacitanceQuestion(keep=asked.keep))
        ends = rest.lower_f_per_m2 or nan, rest.upper_f_per_m2 or nan
        rises = np.array(estimate.rises)
        rise, off = sum(ends) / 2 * rises[0], sum(ends) / 2 * abs(rises - rises[0]).max(0)
        lower, upper = ends[0] * (1 + rises.min(0)), ends[1] * (1 + rises.max(0))
    return CompressionResult(
        design=body.design.name, body=body.provenance, model=model, held=estimate.boundary, stress_kpa=asked.stress_kpa,
        displacement_um=tuple((estimate.displacement_m * _UM_PER_M).tolist()), displacement_error_um=_known(unknown),
        rise_f_per_m2=_known(rise), rise_error_f_per_m2=_known(off), lower_f_per_m2=_known(lower),
        upper_f_per_m2=_known(upper), converged_kpa=asked.stress_kpa[-1],
        doubts=(*estimate.doubts, *_assumed(body.design)),
        bounds="of the capacitance, by the law between its bounds" if estimate.rises else "none",
    )  # fmt: skip


def _unsolved(body: Body, asked: PressQuestion, why: str) -> CompressionResult:
    """Without the library for fields: a closed-form estimate, the capacitance at rest, and no accuracy."""
    result = _closed_form(body, asked, FIRST)
    rest = at_rest.answer(body, at_rest.CapacitanceQuestion(keep=asked.keep))
    unknown = (None,) * (len(asked.stress_kpa) - 1)
    result = replace(
        result, doubts=(*result.doubts, f"not solved: {why}"), lower_f_per_m2=(rest.lower_f_per_m2, *unknown),
        upper_f_per_m2=(rest.upper_f_per_m2, *unknown),
        bounds=f"of the capacitance at rest, by {rest.model}; none under stress",
    )  # fmt: skip
    if asked.accuracy == inf:
        return result
    plan = planned(body, asked)
    (level,) = plan.levels
    candidates = tuple(replace(c, passed_over=c.passed_over or why) for c in level.candidates)
    plan = replace(plan, levels=(replace(level, chosen="", candidates=candidates),))
    return replace(result, accuracy=asked.accuracy, reached=False, plan=plan)


def stresses_kpa(given_kpa: Sequence[float]) -> tuple[float, ...]:
    """Stresses with 0 before them where it is not the first [kPa].

    >>> stresses_kpa((50.0, 100.0)), stresses_kpa((0.0, 10.0))
    ((0.0, 50.0, 100.0), (0.0, 10.0))
    """
    whole = tuple(given_kpa) if given_kpa[0] == 0 else (0.0, *given_kpa)
    if len(whole) < 2:
        raise OutOfRange("--stress 0: expected a stress above 0, as in 0:100:10")
    return whole
