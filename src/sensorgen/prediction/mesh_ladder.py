"""A piece of a sensor under pressure by finite elements, on mesh levels of increasing fineness.

The error of a mesh is estimated from the next coarser one, whose triangles are larger everywhere, at an apex too.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import lru_cache, partial
from importlib import import_module
from itertools import pairwise
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np

from sensorgen.core import cache as cached
from sensorgen.core.arrays import Real
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.design.design import Design
from sensorgen.prediction.capacitance import points
from sensorgen.scene.scene import Scene
from sensorgen.scene.sections import overlap

if TYPE_CHECKING:
    from sensorgen.models.press2d import BoundaryConditions, Elastic, Fineness, Pressed
    from sensorgen.models.press3d import BrickCounts

MODELS = ("press2d", "press3d", "press_round")
QUICK = ("press2d", "press_round", "press3d")
USUAL = 0  # default mesh level; those below it are coarser
COARSEST = -2  # level that serves for comparison only
ROUGH = -3  # the same with triangles at an apex as large as elsewhere: small ones fold, and are replaced one by one
_TIMES = {-3: 2.0, -2: 2.0, -1: 1.5, USUAL: 1.0, 1: 0.7, 2: 0.5}  # size of triangles by level, over the usual one [-]
SAFETY = 2.0  # error that is expected over the measured one of another cell [-]
_SHARP = 1.2  # the same of the default mesh in the plane, where gaps end in an apex: bench/rise_errors.py [-]
_BLUNT = 3.85  # the same where they do not, as in prints: corners carry more [-]
_FURTHER = 2.0  # error of pressures beyond the coarser mesh's last one, over the largest below [-]
_GRID, _ORDER = 1.25, 2  # safety factor and order of the grid convergence index (Roache 1994); 1.8 to 2.2 was seen [-]
_AT_APEX = 8.0  # added error where triangles at an apex are as large as the displacement, over that without apex [-]
_AT_APEX_POWER = 2  # of their size over the displacement
VERIFIED = 7.5e-3  # error of the rise below which nothing is stated: other programs agree with this one to 0.6 % [-]
_OF_DISPLACEMENT = 0.6  # error of the displacement over that of the rise, as expected [-]
_PIECES_ORDER = 2  # power of the number of pieces with which the mesh's error falls, as another program shows it [-]
_DOUBT = 0.5  # error of where two meshes lead, over how far that is beyond the finer one; 0.25 was seen [-]
COARSE = (0.0, 0.25, 0.5, 1.0)  # pressures at which a coarse mesh serves, over the last one [-]
_BENT = 5e-3  # change of such a curve where its second load is left out, at most: others are 2e-3 off then [-]
_ARRAYS = ("stress_pa", "displacement_m", "volume_ratio", "penetration", "imbalance")
_TUPLES = ("faults", "doubts", "carried", "apex_m")
_MEASURED_LOADS = 11  # under which expected times were measured, besides the one of 0

Data = dict[str, Any]


@dataclass(frozen=True)
class PressedPiece:
    """The part of a sensor that is pressed: a scene without support, and the period of its pattern, if any [mm]."""

    scene: Scene
    period_mm: float | None


def drawn(design: Design) -> PressedPiece:
    """The whole sensor as drawn."""
    return PressedPiece(design.in_use, getattr(design.params, "period_mm", None))


@dataclass(frozen=True)
class Case:
    """A piece with its materials and boundary conditions.

    Attributes
    ----------
    piece : PressedPiece
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

    piece: PressedPiece
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
def why_not_applicable(piece: PressedPiece, model: str) -> str | None:
    """Why a model does not apply to a piece, or None."""
    reason: str | None = import_module(f"sensorgen.models.{model}").why_not_applicable(piece.scene)
    return reason


def model_of(piece: PressedPiece, *, quick: bool = False) -> str:
    """The first of ``MODELS``, or of ``QUICK``, that applies to a piece; where none does, the first of all."""
    order = QUICK if quick else MODELS
    return next((model for model in order if not why_not_applicable(piece, model)), MODELS[0])


def mesh_levels(piece: PressedPiece, model: str, loads: int) -> list[MeshLevel]:
    """The mesh levels of a model, coarsest first.

    Parameters
    ----------
    piece : PressedPiece
        That is pressed.
    model : str
        One of ``MODELS``.
    loads : int
        Pressures above 0 that are asked for.
    """
    reached, share = points(model, piece.scene), loads / _MEASURED_LOADS
    area = _area_error(model)
    return [
        MeshLevel(_name(model, level), model, level, SAFETY * rise + area, (seconds + before) * share)
        for level, ((_, before), (rise, seconds)) in enumerate(pairwise(reached), COARSEST + 1)
    ]


def _name(model: str, level: int) -> str:
    """Name of a mesh: triangles by their size over the usual one, bricks by the number that a box is cut into."""
    if level == USUAL:
        return model
    if model == "press3d":
        return f"{model}, {level:+d} piece{'s' * (abs(level) > 1)}"
    return f"{model}, mesh x {_TIMES[level]:g}"


def _area_error(model: str) -> float:
    """Error of the rise, and of the displacement, by a round cell in place of a square one [-]."""
    from sensorgen.models import press_round

    return press_round.AREA_ERROR if model == "press_round" else 0.0


def fineness(model: str, level: int) -> "Fineness | BrickCounts":
    """The mesh of a level: triangles of another size, or boxes of more or fewer pieces."""
    if model == "press3d":
        from sensorgen.models import press3d  # with SciPy, which sections do without

        pieces = press3d.BrickCounts()
        return replace(pieces, pieces=pieces.pieces + level)
    from sensorgen.models import press2d, press_round

    usual = press_round.USUAL if model == "press_round" else press2d.Fineness()
    size = usual.scaled(_TIMES[level])
    return replace(size, apex_mm=size.coarse_mm) if level == ROUGH else size


def _size(model: str, level: int) -> float:
    """Size of the elements over those of the usual mesh; infinite where there is no such mesh."""
    if model != "press3d":
        return _TIMES[level]
    from sensorgen.models import press3d

    usual = press3d.BrickCounts().pieces
    return usual / (usual + level) if usual + level > 0 else inf


def coarsest(model: str) -> int:
    """Level of the coarsest mesh that there is."""
    return COARSEST if model != "press3d" else USUAL if _size(model, USUAL - 1) == inf else USUAL - 1


def pressed(
    case: Case, stress_pa: Sequence[float], level: int = USUAL, *, keep: bool = True,
    step: Callable[[float], None] | None = None,
) -> "Pressed":  # fmt: skip
    """A case under increasing pressure on one mesh, computed or from the cache.

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
    }
    return _of_plain(cached.answer(question, work))


@dataclass(frozen=True)
class Estimate:
    """A solution, and by how much its values may be off.

    Attributes
    ----------
    found : Pressed
        The solution.
    displacement_error_m : (n,) array
        At each pressure [m]; infinite where the coarser mesh has no value.
    rise_f_per_m2, rise_error_f_per_m2 : (n,) array
        Capacitance above that of the unloaded cell [F/m2], NaN where unknown, and its error.
    """

    found: "Pressed"
    displacement_error_m: Real
    rise_f_per_m2: Real
    rise_error_f_per_m2: Real

    def relative(self) -> tuple[float, float]:
        """Largest relative errors of displacement and rise under load; infinite where one is unknown [-]."""
        down = np.where(self.found.displacement_m > 0, self.found.displacement_m, np.nan)[1:]
        pairs = (self.displacement_error_m[1:], down), (self.rise_error_f_per_m2[1:], self.rise_f_per_m2[1:])
        off, rise = (
            float(np.nan_to_num(abs(error / value), nan=inf, posinf=inf).max(initial=0.0)) for error, value in pairs
        )
        return off, rise


def estimated(
    case: Case, stress_pa: Sequence[float], level: int = USUAL, *, keep: bool = True,
    step: Callable[[float], None] | None = None, sound: bool = False,
) -> Estimate:  # fmt: skip
    """A case on one mesh with its errors, from the next coarser mesh at some of the pressures.

    Parameters
    ----------
    case, stress_pa, level, keep, step
        As of :func:`pressed`.
    sound : bool
        Only the part of the solution in which every check holds.

    Raises
    ------
    MissingValue, BadInput, OutOfRange
        As :func:`pressed`.
    """
    if smooth := _smooth(case, stress_pa, level, keep=keep, step=step):
        fine, coarse = smooth
    else:
        fine = pressed(case, stress_pa, level, keep=keep, step=step)
        fine = fine.sound() if sound else fine
        coarse = _coarser(case, fine, stress_pa, level, keep=keep)
    coarse = coarse.some(np.flatnonzero(np.isin(coarse.stress_pa, fine.stress_pa)).tolist())
    return (_limit if case.model == "press3d" else _errors)(case, fine, coarse, level)


def few(stress_pa: Sequence[float]) -> list[float]:
    """Those of some pressures, rising from 0, that are nearest to ``COARSE`` [Pa]."""
    loads = np.asarray(stress_pa)
    return [float(loads[k]) for k in sorted({int(abs(loads - share * loads[-1]).argmin()) for share in COARSE})]


def _smooth(
    case: Case, stress_pa: Sequence[float], level: int, *, keep: bool, step: Callable[[float], None] | None
) -> "tuple[Pressed, Pressed] | None":
    """Solution at the last pressure alone, continued to the others by the curve of the next coarser mesh, the second.

    None where faces touch, or the curve bends too much for that.
    """
    loads = few(stress_pa)
    if not len(COARSE) == len(loads) < len(stress_pa) or not _may_be_smooth(case, level):
        return None
    coarse = pressed(case, loads, level - 1, keep=keep)
    if coarse.faults or coarse.penetration.any():
        return None
    some = np.divide(loads[1:], loads[-1])
    secants = np.column_stack([coarse.displacement_m, _rise(coarse)[0]])[1:] / some[:, None]
    (quarter, half, whole), share = secants, (1 - some[1]) / (1 - some[0])
    if np.abs((share * quarter + (1 - share) * whole) / half - 1).max() > _BENT:
        return None
    fine = pressed(case, [0.0, stress_pa[-1]], level, keep=keep, step=step)
    if fine.faults or fine.penetration.any():
        return None
    at = np.divide(stress_pa, stress_pa[-1])
    curve = np.polyfit(some, secants / whole, len(some) - 1)
    shares = at[:, None] * (np.vander(at, len(some)) @ curve)
    (first, last), loaded = _ends(fine), [1] * (len(stress_pa) - 1)
    bounds = first + shares[:, 1:] * (last - first)
    continued = replace(
        fine.some([0, *loaded]),  # with the checks of the last pressure, which are the worst
        stress_pa=np.array(stress_pa), displacement_m=shares[:, 0] * fine.displacement_m[-1],
        capacitance_f_per_m2=tuple(Interval(*pair) for pair in bounds.tolist()),
    )  # fmt: skip
    return continued, coarse


def _may_be_smooth(case: Case, level: int) -> bool:
    """Test whether there is a coarser mesh, and no point in which solids touch as drawn: gaps close from there on."""
    from sensorgen.models import press2d
    from sensorgen.solvers.contact.mesh import pinches

    if case.model == "press2d":
        return not pinches(press2d.cell(case.piece.scene, case.piece.period_mm))
    return case.model == "press3d" and _size(case.model, level - 1) < inf


def _coarser(case: Case, fine: "Pressed", stress_pa: Sequence[float], level: int, *, keep: bool) -> "Pressed":
    """Solution on the next coarser mesh at some pressures of a finer one; unloaded where there is no such mesh."""
    if len(fine.stress_pa) == 1 or _size(case.model, level - 1) == inf:
        return fine.some([0])
    some = few(fine.stress_pa.tolist())
    with suppress(cached.Unknown), cached.only_known():
        if keep:  # the level before was not accurate enough: it is stored
            known = pressed(case, stress_pa, level - 1).sound()
            whole = known.stress_pa[-1] >= some[-1]
            return known.some(np.flatnonzero(np.isin(known.stress_pa, some)).tolist()) if whole else known
    coarse = pressed(case, some, level - 1, keep=keep).sound()
    if coarse.stress_pa[-1] < some[-1]:  # shorter steps
        coarse = pressed(case, [float(p) for p in fine.stress_pa], level - 1, keep=keep).sound()
    return coarse


def limit(fine: "Pressed", coarse: "Pressed", pieces: int) -> Estimate:
    """Extrapolate displacement and rise from two meshes of boxes (Richardson), to pieces without end.

    Bounds of the field are as wide as on the finer mesh. An error is infinite above the coarser mesh's last pressure,
    and where both meshes are one.

    Parameters
    ----------
    fine, coarse : Pressed
        With ``pieces`` and with one piece less; the coarser one at some of the pressures, 0 among them.
    pieces : int
        2 or more.

    Notes
    -----
    The rise is nearer than the capacitance: one mesh is deformed, so that its bounds err alike before and after. Half
    of the difference of their rises counts as the field's error.
    """
    n, at = len(fine.stress_pa), np.searchsorted(fine.stress_pa, coarse.stress_pa)
    following = np.searchsorted(at, np.arange(n))  # the next shared pressure
    further = (pieces - 1) ** _PIECES_ORDER / (pieces**_PIECES_ORDER - (pieces - 1) ** _PIECES_ORDER)
    down = fine.displacement_m - fine.fall_m
    rises, others = (ends - ends[0] for ends in map(_ends, (fine, coarse)))
    same = np.array_equal(fine.displacement_m[at], coarse.displacement_m)
    ways, errors = [], []
    for own, other in ((down, coarse.displacement_m - coarse.fall_m), (rises.mean(axis=1), others.mean(axis=1))):
        shares = further * (1 - np.divide(other[1:], own[at][1:]))
        ways.append(np.append(np.append(0.0, shares), shares[-1:])[following] * own if shares.size else 0.0 * own)
        doubts = np.append(np.append(0.0, abs(shares)), np.inf)[following]
        errors.append(np.where(np.arange(n), np.inf if same else _DOUBT * doubts * abs(own), 0.0))
    shifted = tuple(
        Interval(c.lower + way, c.upper + way) if c else None
        for c, way in zip(fine.capacitance_f_per_m2, ways[1].tolist(), strict=True)
    )
    extrapolated = replace(fine, displacement_m=fine.displacement_m + ways[0], capacitance_f_per_m2=shifted)
    field = abs(np.diff(rises)[:, 0]) / 2
    return Estimate(extrapolated, errors[0], rises.mean(axis=1) + ways[1], errors[1] + field)


def _limit(case: Case, fine: "Pressed", coarse: "Pressed", level: int) -> Estimate:
    """Where two meshes of boxes lead, with at least the error that this has on other cells."""
    from sensorgen.models import press3d

    ahead = limit(fine, coarse, press3d.BrickCounts().pieces + level)
    least = max(_expected(case, level), VERIFIED)
    down = ahead.found.displacement_m - fine.fall_m
    moved = np.maximum(ahead.displacement_error_m, _OF_DISPLACEMENT * least * down)
    rises = np.maximum(ahead.rise_error_f_per_m2, least * np.abs(ahead.rise_f_per_m2))
    return Estimate(ahead.found, moved, ahead.rise_f_per_m2, rises)


def _expected(case: Case, level: int) -> float:
    """Error of the rise that a mesh has on other cells [-]."""
    return next(mesh.rise_error for mesh in mesh_levels(case.piece, case.model, 1) if mesh.level == level)


def _errors(case: Case, fine: "Pressed", coarse: "Pressed", level: int) -> Estimate:
    """Grid convergence index of two meshes, but at least the error that such a mesh has on other cells.

    Differences of two meshes scatter, and are small by chance at some loads: what was seen at a lower load counts on.
    """
    n = len(fine.stress_pa)
    (rise, spread), (other, _) = _rise(fine), _rise(coarse)
    at = np.searchsorted(fine.stress_pa, coarse.stress_pa)
    factor = _GRID / ((_size(case.model, level - 1) / _size(case.model, level)) ** _ORDER - 1)
    down = fine.displacement_m - fine.fall_m
    # Between two shared pressures the larger share of both
    following = np.searchsorted(at, np.arange(n))
    preceding = np.searchsorted(at, np.arange(n), side="right") - 1
    index = []
    for value, apart in ((down, coarse.displacement_m - coarse.fall_m - down[at]), (rise, other - rise[at])):
        with np.errstate(divide="ignore", invalid="ignore"):
            share = factor * np.maximum.accumulate(np.abs(apart)) / np.abs(value[at])
            known = share[1:][np.isfinite(share[1:])]
            share = np.append(share, _FURTHER * known.max() if known.size else inf)
            share[0] = 0.0
            index.append(np.maximum(share[preceding], share[following]) * np.abs(value))
    # At least
    apex = np.array(fine.apex_m) if fine.apex_m else np.zeros(n)
    small = _AT_APEX * (apex / np.where(down > 0, down, np.inf)) ** _AT_APEX_POWER
    area = _area_error(case.model)
    least = max(_safety(case, bool(fine.apex_m), level) / SAFETY * (_expected(case, level) - area), VERIFIED) * (
        1 + small
    )
    moved = np.maximum(index[0], _OF_DISPLACEMENT * least * down) + area * down
    rises = np.maximum(index[1], least * np.abs(rise)) + spread + area * np.abs(rise)
    moved[0] = rises[0] = 0.0
    return Estimate(fine, moved, rise, rises)


def _safety(case: Case, apex: bool, level: int) -> float:
    """Stated error over the expected one; solids in layers of one plan have no corner [-]."""
    plans = {(p.span("x"), p.span("y")) for body in case.piece.scene.bodies for p in body.pieces}
    if case.model != "press2d" or len(plans) < 2 or (apex and level != USUAL):
        return SAFETY
    return _SHARP if apex else _BLUNT


def _ends(solution: "Pressed") -> Real:
    """Bounds of the capacitance at each pressure (n, 2) [F/m2]; NaN where unknown."""
    bounds = [(c.lower, c.upper) if c else (np.nan, np.nan) for c in solution.capacitance_f_per_m2]
    return np.array(bounds).reshape(-1, 2)


def _rise(solution: "Pressed") -> tuple[Real, Real]:
    """Rise of the capacitance, and by how much its field's bounds leave it open [F/m2].

    Where the field is meshed anew, bounds are independent; on one mesh they err alike before and after.
    """
    lower, upper = _ends(solution).T
    middle = (lower + upper) / 2
    width = upper - lower
    alike = np.array(solution.carried) if solution.carried else np.zeros(len(middle), bool)
    return middle - middle[:1], np.where(alike, abs(width - width[:1]), width + width[:1]) / 2


def _press(case: Case) -> "tuple[Callable[..., Pressed], str]":
    """The solver of a case, and its cell as text."""
    scene = case.piece.scene
    if case.model == "press_round":
        from sensorgen.models import press_round

        return partial(press_round.press, scene), repr([(b.material, b.terminal, b.pieces) for b in scene.bodies])
    if case.model == "press3d":
        from sensorgen.models import press3d

        boxes = press3d.cell(case.piece.scene)
        return partial(press3d.press, boxes), boxes.written()
    from sensorgen.models import press2d

    cell = press2d.cell(case.piece.scene, case.piece.period_mm)
    return partial(press2d.press, cell), repr(cell)


def _plain(solution: "Pressed") -> Data:
    """As JSON holds it."""
    data = vars(solution)
    bounds = [[c.lower, c.upper] if c else None for c in solution.capacitance_f_per_m2]
    lists = {name: getattr(solution, name).tolist() for name in _ARRAYS}
    return data | lists | {"capacitance_f_per_m2": bounds}


def _of_plain(data: Data) -> "Pressed":
    from sensorgen.models.press2d import Pressed

    bounds = tuple(Interval(*pair) if pair else None for pair in data["capacitance_f_per_m2"])
    words = {name: tuple(data[name]) for name in _TUPLES}
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
