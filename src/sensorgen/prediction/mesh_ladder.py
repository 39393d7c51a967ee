"""A piece of a sensor under pressure by finite elements, on a ladder of meshes each finer than the one before.

What a mesh is worth is told by the next coarser one: solutions are kept, so that a finer answer costs one mesh more.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
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
    from sensorgen.models.press2d import Elastic, Fineness, Held, Pressed
    from sensorgen.models.press3d import Pieces

MODELS = ("press2d", "press3d")
USUAL = 0  # level of the mesh that is taken where nothing is said; those below it are coarser
COARSEST = -2  # level that others are held against only
_TIMES = {-2: 2.0, -1: 1.5, USUAL: 1.0, 1: 0.7, 2: 0.5}  # size of triangles by level, over the usual one [-]
SAFETY = 2.0  # times that two meshes differ, or that one was off where it was measured; 1.8 times were found
_ARRAYS = ("stress_pa", "displacement_m", "volume_ratio", "penetration", "imbalance")
_MEASURED_LOADS = 11  # under which expected times were measured, besides the one of 0

Data = dict[str, Any]


@dataclass(frozen=True)
class Piece:
    """What is pressed of a sensor: a scene with its support gone, and the period of its pattern, if it has one [mm]."""

    scene: Scene
    period_mm: float | None


def drawn(design: Design) -> Piece:
    """The whole sensor as drawn."""
    return Piece(design.in_use, getattr(design.params, "period_mm", None))


@dataclass(frozen=True)
class Case:
    """A piece, what it is made of, and how it is held.

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
    held : Held
        Base, period, top and contact.
    """

    piece: Piece
    model: str
    solids: "Mapping[str, Elastic]"
    permittivity: Mapping[str, float]
    held: "Held"


@dataclass(frozen=True)
class Rung:
    """A mesh of a case, and what it should be worth.

    Attributes
    ----------
    name, model : str
        The model, and how much finer or coarser than usual its mesh is; the model alone.
    level : int
        0 for the usual mesh, above it finer.
    rise : float
        Share by which the rise of the capacitance should be off [-].
    seconds : float
        That it should take, with the coarser mesh it is held against [s].
    """

    name: str
    model: str
    level: int
    rise: float
    seconds: float


@lru_cache(maxsize=16)
def why_not_applicable(piece: Piece, model: str) -> str | None:
    """Why a model cannot speak of a piece, or None."""
    said: str | None = import_module(f"sensorgen.models.{model}").why_not_applicable(piece.scene)
    return said


def model_of(piece: Piece) -> str:
    """The first of ``MODELS`` that can speak of a piece; the first of all, which says why not, where none can."""
    return next((model for model in MODELS if not why_not_applicable(piece, model)), MODELS[0])


def rungs(piece: Piece, model: str, loads: int) -> list[Rung]:
    """The meshes of a model, coarsest first.

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
        Rung(_name(model, level), model, level, SAFETY * rise, (seconds + before) * share)
        for level, ((_, before), (rise, seconds)) in enumerate(pairwise(points), COARSEST + 1)
    ]


def _name(model: str, level: int) -> str:
    """How a mesh is called: triangles by their size over the usual one, bricks by how many a box is cut into."""
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
    step: Callable[[float], None] | None = None,
) -> "Pressed":  # fmt: skip
    """A case under rising pressure on one mesh, or what is known of it from before; without the deformed outlines.

    Parameters
    ----------
    case : Case
        What is pressed.
    stress_pa : sequence of float
        From 0 on and rising [Pa].
    level : int
        Of the mesh.
    keep : bool
        Take a solution that is known, and keep a new one.
    step : callable, optional
        Told every pressure that is reached [Pa].

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
    press, cell = _press(case)

    def work() -> Data:
        return _plain(press(case.solids, stress, case.permittivity, case.held, mesh, step=step))

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
        "held": vars(case.held),
    }
    return _of_plain(cached.answer(question, work))


def _press(case: Case) -> "tuple[Callable[..., Pressed], str]":
    """How to press a case, and all of its cell as text."""
    from sensorgen.models import press2d, press3d

    if case.model == "press3d":
        boxes = press3d.cell(case.piece.scene)
        return partial(press3d.press, boxes), boxes.written()
    cell = press2d.cell(case.piece.scene, case.piece.period_mm)
    return partial(press2d.press, cell), repr(cell)


def _plain(found: "Pressed") -> Data:
    data = {f.name: getattr(found, f.name) for f in fields(found)}
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
    """Refuse a stress above the least modulus [Pa], by material: it would be reached in no time that anyone waits."""
    softest = min(youngs_modulus_pa, key=lambda name: youngs_modulus_pa[name])
    if stress_pa > youngs_modulus_pa[softest]:
        raise OutOfRange(
            f"{stress_pa / 1e3:g} kPa on {softest} of {youngs_modulus_pa[softest] / 1e3:g} kPa (Young's modulus): "
            "expected a stress up to the least modulus"
        )
