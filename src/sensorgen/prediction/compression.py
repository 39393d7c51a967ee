"""Displacement and capacitance of a design's cell under pressure: results of ``sensorgen compress``."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import takewhile
from math import inf
from typing import Any

import numpy as np

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput, NotInstalled, OutOfRange
from sensorgen.design.body import Body
from sensorgen.design.design import Design
from sensorgen.design.values import permittivities
from sensorgen.models import press2d
from sensorgen.models.press2d import BoundaryConditions, Pressed
from sensorgen.prediction import capacitance_answer as bounds
from sensorgen.prediction import closed_form_compression as closed_form
from sensorgen.prediction.compression_law import elastic, expected
from sensorgen.prediction.mesh_ladder import (
    MODELS,
    SAFETY,
    USUAL,
    Case,
    MeshLevel,
    Piece,
    mesh_levels,
    pressed,
    why_not_applicable,
)
from sensorgen.prediction.plan import Candidate, Level, Plan, cheapest, plain, run_until_within
from sensorgen.prediction.sensor_model import piece
from sensorgen.scene.scene import Scene

__all__ = ["ALL", "Asked", "BoundaryConditions", "answer", "planned", "stresses_kpa"]

Data = dict[str, Any]
Step = Callable[[float], None]
Told = tuple[Pressed, tuple[float, ...]]
ALL = (*MODELS, *closed_form.MODELS)

_PA_PER_KPA, _UM_PER_M = 1e3, 1e6
_OF_OUTLINES = "of the capacitance of the deformed outlines as computed; the outlines' own error is not in them"
_OF_ALL = "of the capacitance of the deformed outlines, plus the difference from the next coarser mesh: an estimate"
_NO_C = "displacement alone, no capacitance"
_MEASURE = "bounds of C apart, at the worst stress"
_BRACKET = {"press2d": 3.4e-4, "press3d": 2e-3}  # how far the outlines' own bounds are apart, on prototypes [-]


@dataclass(frozen=True)
class Asked:
    """What is asked about a press.

    Attributes
    ----------
    stress_kpa : tuple of float
        Rising, 0 first [kPa].
    boundary : BoundaryConditions
        Base, period, top and contact.
    model : str
        One of ``ALL``, or "" for the first that applies to the scene.
    accuracy : float
        How far the bounds of the capacitance may be apart at every stress, relative to their middle, the outlines' own
        error in them; where infinite, the usual mesh is taken, without an error [-].
    check_mesh : bool
        Hold the displacement against the next coarser mesh.
    keep : bool
        Read cached solutions, and store new ones.
    """

    stress_kpa: tuple[float, ...]
    boundary: BoundaryConditions
    model: str = ""
    accuracy: float = inf
    check_mesh: bool = False
    keep: bool = True


def answer(body: Body, asked: Asked, *, step: Step | None = None) -> Data:
    """Displacement and bounds of the capacitance per area over stress.

    Parameters
    ----------
    body : Body
        Drawn or printed.
    asked : Asked
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
    design, pressed = body.design, piece(body)
    of = {"body": body.provenance}
    try:
        return _answer(design, pressed, asked, step) | of
    except NotInstalled as error:
        if asked.model:
            raise
        return _unsolved(design, pressed, asked, str(error)) | _at_rest(body, asked) | of


def _answer(design: Design, piece: Piece, asked: Asked, step: Step | None) -> Data:
    if asked.accuracy < inf:
        return _as_near(design, piece, asked, step)
    if _model(piece, asked) in closed_form.MODELS:
        return _closed_form(design, piece, asked)
    case = _case(design, piece, asked)
    found = _pressed(case, asked, USUAL, step)
    if asked.check_mesh:
        found = press2d.compared(found, _pressed(case, asked, USUAL + 1, step))
    return _plain(found, case)


def planned(body: Body, asked: Asked) -> Plan:
    """What an accuracy takes, before anything is pressed; parameters and errors as of :func:`answer`."""
    return _planned(body.design, piece(body), asked)


def _planned(design: Design, piece: Piece, asked: Asked) -> Plan:
    if not asked.accuracy > 0:
        raise OutOfRange(f"an accuracy of {asked.accuracy:g}; expected a number above 0, as 1e-2")
    model = _model(piece, asked)
    if model in closed_form.MODELS:
        why = f"--model {model}" if asked.model else why_not_applicable(piece, MODELS[0])
        raise BadInput(f"an accuracy of C, and {why}: {model} tells {_NO_C}; leave out --accuracy")
    others = [Candidate(name, passed_over=_reason(piece, name, asked.model)) for name in ALL if name != model]
    meshes = [_candidate(design, asked, mesh) for mesh in _mesh_levels(piece, model, asked)]
    candidates = (*others, *meshes)
    level = Level(
        "compression", _MEASURE, asked.accuracy, candidates, cheapest(candidates, asked.accuracy)
    )  # fmt: skip
    return Plan(asked.accuracy, f"C up to {asked.stress_kpa[-1]:g} kPa", (level,))


def _model(piece: Piece, asked: Asked) -> str:
    return asked.model or next((name for name in MODELS if not why_not_applicable(piece, name)), closed_form.FIRST)


def _mesh_levels(piece: Piece, model: str, asked: Asked) -> list[MeshLevel]:
    return mesh_levels(piece, model, len(asked.stress_kpa) - 1)


def _reason(piece: Piece, name: str, forced: str) -> str:
    if forced:
        return f"--model {forced}"
    return (
        _NO_C
        if name in closed_form.MODELS
        else why_not_applicable(piece, name) or "the model before it applies to the cell"
    )


def _candidate(design: Design, asked: Asked, mesh: MeshLevel) -> Candidate:
    """A mesh, with the error expected where the cell rises like a prototype."""
    curve = expected(design, mesh)
    share = float(curve.capacitive_strain(np.minimum(asked.stress_kpa[-1] * _PA_PER_KPA, curve.stress_pa[-1]))[0])
    return Candidate(mesh.name, _BRACKET[mesh.model] + 2 * mesh.rise_error * share, mesh.seconds)


def _as_near(design: Design, piece: Piece, asked: Asked, step: Step | None) -> Data:
    """The first mesh within tolerance, from the expected one upwards; the best where none is."""
    plan = _planned(design, piece, asked)
    case = _case(design, piece, asked)
    find = {mesh.name: partial(_told, case, asked, mesh, step) for mesh in _mesh_levels(piece, case.model, asked)}
    (found, off), level = run_until_within(plan.levels[0], find, lambda answer: _width(*answer))
    data = _plain(_widened(found, off), case) | {"bounds": _OF_ALL}
    return data | {
        "accuracy": asked.accuracy,
        "relative_width": _width(found, off) if _width(found, off) < inf else None,
        "reached": _width(found, off) <= asked.accuracy,
        "plan": plain(replace(plan, levels=(level,))),
    }


def _told(case: Case, asked: Asked, mesh: MeshLevel, step: Step | None) -> Told:
    """A case on one mesh, and the share by which each capacitance may be off for it [-]."""
    fine, coarse = (_pressed(case, asked, level, step) for level in (mesh.level, mesh.level - 1))
    rises, others = (_rises(found) for found in (fine, coarse))
    off = [max(mesh.rise_error * a, SAFETY * abs(a - b)) / (1 + a) for a, b in zip(rises, others, strict=False)]
    return fine, tuple(off)


def _rises(found: Pressed) -> list[float]:
    """By how much each capacitance is above the first, as far as they are known [-]."""
    known = [c.middle() for c in takewhile(bool, found.capacitance_f_per_m2) if c]
    return [c / known[0] - 1 for c in known]


def _widened(found: Pressed, off: Sequence[float]) -> Pressed:
    """The same, its bounds moved outwards by a share of their middle; none where no share is known."""
    bounds = (
        Interval(c.lower - share * c.middle(), c.upper + share * c.middle()) if c else None
        for c, share in zip(found.capacitance_f_per_m2, off, strict=False)
    )
    missing = (None,) * (len(found.capacitance_f_per_m2) - len(off))
    return replace(found, capacitance_f_per_m2=(*bounds, *missing))


def _width(found: Pressed, off: Sequence[float]) -> float:
    """How far the widened bounds are apart at worst; infinite where one is not known, or not to be trusted [-]."""
    widened = _widened(found, off).capacitance_f_per_m2
    return max((c.width() if c else inf for c in widened), default=inf) if not found.faults else inf


def _case(design: Design, piece: Piece, asked: Asked) -> Case:
    _refuse_unpressable(piece.scene, asked.boundary)
    permittivity = {t.material: t.value for t in permittivities(design)}
    return Case(piece, _model(piece, asked), elastic(design, piece.scene), permittivity, asked.boundary)


def _pressed(case: Case, asked: Asked, level: int, step: Step | None) -> Pressed:
    stress_pa = [_PA_PER_KPA * kpa for kpa in asked.stress_kpa]
    return pressed(case, stress_pa, level, keep=asked.keep, step=step)


def _refuse_unpressable(scene: Scene, boundary: BoundaryConditions) -> None:
    """Refuse what would be answered, but not as it was asked."""
    ends = sorted({body.terminal for body in scene.bodies if body.terminal})
    if ends != ["bottom", "top"]:
        raise BadInput(
            f"a cell with electrodes {', '.join(ends) or 'of no kind'}: expected two, bottom and top, whose "
            "capacitance a press changes; --model springs tells the displacement alone"
        )
    if boundary.period == "free" and boundary.base == "bonded":
        raise BadInput("free sides over a bonded base are not possible: expected base 'sliding' with them")


def _plain(found: Pressed, case: Case) -> Data:
    bounds = found.capacitance_f_per_m2
    return {
        "model": case.model,
        "held": dict(vars(case.boundary)),
        "stress_kpa": [p / _PA_PER_KPA for p in found.stress_pa.tolist()],
        "displacement_um": [d * _UM_PER_M for d in found.displacement_m.tolist()],
        "lower_f_per_m2": [c.lower if c else None for c in bounds],
        "upper_f_per_m2": [c.upper if c else None for c in bounds],
        "converged_kpa": found.converged_pa / _PA_PER_KPA,
        "faults": list(found.faults),
        "doubts": list(found.doubts),
        "bounds": _OF_OUTLINES,
    }


def _closed_form(design: Design, piece: Piece, asked: Asked) -> Data:
    """What a law knows that solves no field: a displacement, and no capacitance."""
    name, unknown = _model(piece, asked), [None] * len(asked.stress_kpa)
    found = closed_form.MODELS[name](design, piece, [_PA_PER_KPA * kpa for kpa in asked.stress_kpa])
    return {
        "model": name,
        "held": found.boundary,
        "stress_kpa": list(asked.stress_kpa),
        "displacement_um": (found.displacement_m * _UM_PER_M).tolist(),
        "lower_f_per_m2": unknown,
        "upper_f_per_m2": unknown,
        "converged_kpa": asked.stress_kpa[-1],
        "faults": [],
        "doubts": list(found.doubts),
        "bounds": "none",
    }


def _unsolved(design: Design, piece: Piece, asked: Asked, why: str) -> Data:
    """Without the library for fields: a closed-form estimate, and no accuracy."""
    data = _closed_form(design, piece, replace(asked, model=closed_form.FIRST))
    data["doubts"] += [f"not solved: {why}"]
    if asked.accuracy == inf:
        return data
    plan = _planned(design, piece, asked)
    levels = tuple(_unasked(level, why) for level in plan.levels)
    missed = {"accuracy": asked.accuracy, "relative_width": None, "reached": False}
    return data | missed | {"plan": plain(replace(plan, levels=levels))}


def _unasked(level: Level, why: str) -> Level:
    return replace(
        level, chosen="", candidates=tuple(replace(c, passed_over=c.passed_over or why) for c in level.candidates)
    )


def _at_rest(body: Body, asked: Asked) -> Data:
    """The capacitance at rest, which takes no mesher."""
    found = bounds.answer(body, bounds.Asked(keep=asked.keep))
    unknown = [None] * (len(asked.stress_kpa) - 1)
    ends = {key: [found[key], *unknown] for key in ("lower_f_per_m2", "upper_f_per_m2")}
    return ends | {"bounds": f"of the capacitance at rest, by {found['model']}; none under stress"}


def stresses_kpa(found: Sequence[float]) -> tuple[float, ...]:
    """Stresses with 0 before them where it is not the first [kPa].

    >>> stresses_kpa((50.0, 100.0)), stresses_kpa((0.0, 10.0))
    ((0.0, 50.0, 100.0), (0.0, 10.0))
    """
    whole = tuple(found) if found[0] == 0 else (0.0, *found)
    if len(whole) < 2:
        raise OutOfRange("--stress 0: expected a stress above 0, as in 0:100:10")
    return whole
