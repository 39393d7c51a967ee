"""A piece of a sensor under pressure by finite elements, on mesh levels of increasing fineness.

The error of a mesh is estimated from the next coarser one; solutions are kept, so that refinement costs one mesh more.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.core import cache as cached
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.design.design import Design
from sensorgen.prediction import cost_model as expectations
from sensorgen.scene.scene import Scene
from sensorgen.scene.sections import overlap

if TYPE_CHECKING:
    from sensorgen.models.press2d import BoundaryConditions, Elastic, Fineness, Pressed
    from sensorgen.models.press3d import Pieces

MODELS = ("press2d", "press3d")
USUAL = 0  # default mesh level; those below it are coarser
COARSEST = -2  # level that serves for comparison only
_TIMES = {-2: 2.0, -1: 1.5, USUAL: 1.0, 1: 0.7, 2: 0.5}  # size of triangles by level, over the usual one [-]
SAFETY = 2.0  # error bound over the difference of two meshes, or over a measured error; 1.8 was observed
_ARRAYS = ("stress_pa", "displacement_m", "volume_ratio", "penetration", "imbalance")
_MEASURED_LOADS = 11  # under which expected times were measured, besides the one of 0

Data = dict[str, Any]


@dataclass(frozen=True)
class Piece:
    """The part of a sensor that is pressed: a scene without support, and the period of its pattern, if any [mm]."""

    scene: Scene
    period_mm: float | None


def drawn(design: Design) -> Piece:
    """The whole sensor as drawn."""
    return Piece(design.in_use, getattr(design.params, "period_mm", None))


@dataclass(frozen=True)
class Case:
    """A piece with its materials and boundary conditions.

    Attributes
    ----------
    piece : Piece
        That is pressed.
    model : str
        One of ``MODELS``.
    solids : mapping of str to Elastic
        By material.
    permittivity : mapping of str to float
        By material, with "air" [-].
    boundary : BoundaryConditions
        Base, period, top and contact.
    """

    piece: Piece
    model: str
    solids: "Mapping[str, Elastic]"
    permittivity: Mapping[str, float]
    boundary: "BoundaryConditions"


@dataclass(frozen=True)
class MeshLevel:
    """A mesh of a case, with its expected error and cost.

    Attributes
    ----------
    name, model : str
        The model with the fineness of its mesh; the model alone.
    level : int
        0 for the usual mesh, above it finer.
    rise_error : float
        Expected relative error of the rise of the capacitance [-].
    seconds : float
        Expected time, with the coarser mesh that it is compared with [s].
    """

    name: str
    model: str
    level: int
    rise_error: float
    seconds: float


@lru_cache(maxsize=16)
def why_not_applicable(piece: Piece, model: str) -> str | None:
    """Why a model does not apply to a piece, or None."""
    said: str | None = import_module(f"sensorgen.models.{model}").why_not_applicable(piece.scene)
    return said


def model_of(piece: Piece) -> str:
    """The first of ``MODELS`` that applies to a piece; where none does, the first of all."""
    return next((model for model in MODELS if not why_not_applicable(piece, model)), MODELS[0])


def mesh_levels(piece: Piece, model: str, loads: int) -> list[MeshLevel]:
    """The mesh levels of a model, coarsest first.

    Parameters
    ----------
    piece : Piece
        That is pressed.
    model : str
        One of ``MODELS``.
    loads : int
        Pressures above 0 that are asked for.
    """
    points = expectations.points(model, piece.scene)
    share = loads / _MEASURED_LOADS
    return [
        MeshLevel(_name(model, level), model, level, SAFETY * rise, (seconds + before) * share)
        for level, ((_, before), (rise, seconds)) in enumerate(pairwise(points), COARSEST + 1)
    ]


def _name(model: str, level: int) -> str:
    """Name of a mesh: triangles by their size over the usual one, bricks by the number that a box is cut into."""
    if level == USUAL:
        return model
    if model == "press2d":
        return f"press2d, mesh x {_TIMES[level]:g}"
    return f"{model}, {level:+d} piece{'s' * (abs(level) > 1)}"


def fineness(model: str, level: int) -> "Fineness | Pieces":
    """The mesh of a level: triangles of another size, or boxes of more or fewer pieces along each axis."""
    from sensorgen.models import press2d, press3d

    if model == "press3d":
        pieces = press3d.Pieces()
        return replace(pieces, pieces=pieces.pieces + level)
    return press2d.Fineness().scaled(_TIMES[level])


def pressed(
    case: Case, stress_pa: Sequence[float], level: int = USUAL, *, keep: bool = True,
    step: Callable[[float], None] | None = None, enough: float = 1.0, apex: float = 1.0,
) -> "Pressed":  # fmt: skip
    """A case under increasing pressure on one mesh, computed or from the cache; without the deformed outlines.

    Parameters
    ----------
    case : Case
        What is pressed.
    stress_pa : sequence of float
        From 0 on and rising [Pa].
    level : int
        Of the mesh.
    keep : bool
        Use the cache.
    step : callable, optional
        Called with every pressure that is reached [Pa].
    enough, apex : float
        Of a cross-section, as of :func:`sensorgen.models.press2d.press` [-].

    Raises
    ------
    MissingValue, BadInput, OutOfRange
        As :func:`sensorgen.models.press2d.press` and :func:`sensorgen.models.press3d.press`; a stress above the least
        modulus; bodies that overlap.
    """
    overlaps = overlap(case.piece.scene)
    if overlaps:
        raise BadInput(f"{overlaps}; expected each place to belong to one body")
    refuse_crushing(stress_pa[-1], {name: solid.youngs_modulus_pa for name, solid in case.solids.items()})
    mesh, stress = fineness(case.model, level), list(stress_pa)
    press, cell = _press(case, enough, apex)

    def work() -> Data:
        return _plain(press(case.solids, stress, case.permittivity, case.boundary, mesh, step=step))

    if not keep:
        return _of_plain(work())
    question = {
        "what": "pressed",
        "cell": cell,
        "model": case.model,
        "mesh": asdict(mesh),
        "solids": {name: [s.youngs_modulus_pa, s.poisson_ratio] for name, s in case.solids.items()},
        "permittivity": dict(case.permittivity),
        "stress_pa": stress,
        "held": vars(case.boundary),
    } | ({"enough": enough, "apex": apex} if enough < 1 else {})
    return _of_plain(cached.answer(question, work))


def _press(case: Case, enough: float, apex: float) -> "tuple[Callable[..., Pressed], str]":
    """The solver of a case, and its cell as text."""
    from sensorgen.models import press2d, press3d

    if case.model == "press3d":
        boxes = press3d.cell(case.piece.scene)
        return partial(press3d.press, boxes), boxes.written()
    cell = press2d.cell(case.piece.scene, case.piece.period_mm)
    return partial(press2d.press, cell, enough=enough, apex=apex), repr(cell)


def _plain(found: "Pressed") -> Data:
    """As JSON holds it."""
    data = vars(found)
    bounds = [[c.lower, c.upper] if c else None for c in found.capacitance_f_per_m2]
    lists = {name: getattr(found, name).tolist() for name in _ARRAYS}
    return data | lists | {"capacitance_f_per_m2": bounds, "outlines": []}


def _of_plain(data: Data) -> "Pressed":
    from sensorgen.models.press2d import Pressed

    bounds = tuple(Interval(*pair) if pair else None for pair in data["capacitance_f_per_m2"])
    words = {name: tuple(data[name]) for name in ("faults", "doubts", "outlines")}
    arrays = {name: np.asarray(data[name], float) for name in _ARRAYS}
    return Pressed(**(data | words | arrays | {"capacitance_f_per_m2": bounds}))


def refuse_crushing(stress_pa: float, youngs_modulus_pa: Mapping[str, float]) -> None:
    """Refuse a stress above the least Young's modulus [Pa], by material: it would take too long to reach."""
    softest = min(youngs_modulus_pa, key=lambda name: youngs_modulus_pa[name])
    if stress_pa > youngs_modulus_pa[softest]:
        raise OutOfRange(
            f"{stress_pa / 1e3:g} kPa on {softest} of {youngs_modulus_pa[softest] / 1e3:g} kPa (Young's modulus): "
            "expected a stress up to the least modulus"
        )
