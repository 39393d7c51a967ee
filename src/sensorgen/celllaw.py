"""How the film of a design gives way, by the best that is known of its cell; and by how much that may be wrong.

A plate has two laws, free to give way sideways and bonded, which bracket it. A cell with gaps is solved once and for
all where it is a prototype's as drawn; any other one, as a printed cell, is solved when asked for, and kept.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from hashlib import sha256
from itertools import takewhile
from json import dumps
from typing import TYPE_CHECKING, Any

from sensorgen import cached
from sensorgen.design import Design
from sensorgen.errors import OutOfRange, SensorgenError, UnknownName
from sensorgen.models import compression
from sensorgen.models.compression import Compression, Curve
from sensorgen.planner import Answer, Taken, is_plate, permittivities
from sensorgen.scene import Scene
from sensorgen.units import M_PER_MM

if TYPE_CHECKING:
    from sensorgen.models.press2d import Fineness, Pressed
    from sensorgen.models.press3d import Pieces

LAWS = ("unconfined", "bonded", "solved")
STRESS_PA = (0.0, 5e3, *(1e4 * k for k in range(1, 11)))  # 6 N on a tip of 10 x 10 mm are 60 kPa
_LEAST = 0.006  # of the rise: what mesh levels, penalties and a second discretisation agree to at best
_LANDING = f"feet land at no force to speak of: what C rises by up to {STRESS_PA[1] / 1e3:g} kPa is mostly their fall"
_SAME_RATIO = 1e-3  # of Poisson: 0.4999 and 0.5 make the same cell, 0.45 one that gives way by 11 % more
_COARSER = 1.5  # mesh that a solution is compared with, by its edges


@dataclass(frozen=True)
class Piece:
    """What is pressed of a sensor: a scene with its support gone, and the period of its pattern, if it has one [mm]."""

    scene: Scene
    period_mm: float | None


def drawn(design: Design) -> Piece:
    """The whole sensor as drawn."""
    return Piece(design.in_use, getattr(design.params, "period_mm", None))


@dataclass(frozen=True)
class Law:
    """How a film gives way.

    Attributes
    ----------
    compression : Compression
        Thinning over stress.
    taken : tuple of Taken
        Moduli that it rests on.
    doubts : tuple of str
        Why it is to be taken with care.
    others : tuple of Compression
        As good as it within its own error: of the mesh, or the other law of a plate.
    held : tuple of Compression
        The same cell held or touched otherwise.
    bounded : bool
        Whether its error is known: not where a cell with gaps is taken for a plate.
    """

    compression: Compression
    taken: tuple[Taken, ...]
    doubts: tuple[str, ...] = ()
    others: tuple[Compression, ...] = ()
    held: tuple[Compression, ...] = ()
    bounded: bool = True


def law_of(design: Design, answer: Answer, name: str = "", *, solve: bool = False, printed: Piece | None = None) -> Law:
    """The law of compression of a design.

    Parameters
    ----------
    design : Design
        As drawn.
    answer : Answer
        Its unloaded capacitance.
    name : str
        One of ``LAWS``, or "" for the best that is known.
    solve : bool
        Whether "" may take seconds to solve a cell that is not known.
    printed : Piece, optional
        What is printed of it; as drawn where not given.

    Raises
    ------
    UnknownName, OutOfRange
        No such law; or a law that does not speak of this shape.
    MissingValue, BadInput
        For "solved": no modulus or Poisson's ratio, no NGSolve, a cell that is no prism.
    """
    if name not in ("", *LAWS):
        raise UnknownName("law of compression", name, LAWS)
    moduli = values(design, "youngs_modulus_pa")
    if is_plate(answer):
        return _plate(design, moduli, name, printed or drawn(design))
    if name == "bonded":
        raise OutOfRange(f"the law 'bonded' speaks of a solid plate; {design.shape} has gaps: expected 'unconfined'")
    stiff = {n: t.value for n, t in moduli.items()}
    known = None if printed else _stored(design, stiff)
    if known and name != "unconfined":
        return _cell(known, moduli)
    if name == "solved":
        return solved(design, printed)
    if solve and not name:
        try:
            return solved(design, printed)
        except SensorgenError as error:
            return _as_plate(design, moduli, str(error))
    return _as_plate(design, moduli, "ask for the law 'solved', which takes a minute or two")


def _stored(design: Design, youngs_modulus_pa: Mapping[str, float]) -> Curve | None:
    """The curve that was solved once and for all, if it was this cell's, of materials as near to incompressible."""
    known = compression.solved(design.shape, vars(design.params), youngs_modulus_pa)
    if not known:
        return None
    ratios = (taken.value for taken in values(design, "poisson_ratio").values())
    return known if all(abs(ratio - compression.SOLVED_RATIO) < _SAME_RATIO for ratio in ratios) else None


def _plate(design: Design, moduli: Mapping[str, Taken], name: str, piece: Piece) -> Law:
    """Free or bonded, the other one being as good as it."""
    if name == "solved":
        raise OutOfRange(f"{design.shape} is a solid plate: expected the law 'unconfined' or 'bonded'")
    soft = moduli[film(design)]
    free = compression.unconfined(soft.value)
    tied = compression.bonded(soft.value, design.params.width_mm * M_PER_MM, gap_m(piece.scene))
    if name == "bonded":
        return Law(tied, (soft,), others=(free,))
    return Law(
        free, (soft,), ("a plate free to give way sideways: bonded to its electrodes it would be stiffer",), (tied,)
    )


def _as_plate(design: Design, moduli: Mapping[str, Taken], why: str) -> Law:
    soft = moduli[film(design)]
    doubt = f"{design.shape} taken to give way as a free solid plate of {soft.material} (B.49): its cell was not solved"
    return Law(compression.unconfined(soft.value), (soft,), (f"{doubt}; {why}",), bounded=False)


def _cell(found: Curve, moduli: Mapping[str, Taken], doubts: tuple[str, ...] = ()) -> Law:
    """A solved cell: its rise known to a share, and what other ways to hold it would make of it."""
    others = tuple(found.rising(1 + sign * found.within) for sign in (-1, 1))
    held = tuple(found.rising(1 + change) for change in found.held)
    return Law(found, tuple(moduli.values()), doubts, others, held)


def solved(design: Design, printed: Piece | None = None, **held: str) -> Law:
    """The law of a cell by finite elements, or from the cache.

    Parameters
    ----------
    design : Design
        As drawn.
    printed : Piece, optional
        What is printed of it; as drawn where not given.
    **held : str
        How it is held and touched, as of :class:`sensorgen.models._press.support.Held`.

    Raises
    ------
    MissingValue, BadInput, OutOfRange
        No modulus or Poisson's ratio, no NGSolve; a cell that is no prism; a solution that is not to be trusted.
    """
    moduli, ratios = values(design, "youngs_modulus_pa"), values(design, "poisson_ratio")
    eps = {t.material: t.value for t in permittivities(design)}
    solids = {name: (moduli[name].value, ratios[name].value) for name in moduli}
    refuse_crushing(STRESS_PA[-1], {name: t.value for name, t in moduli.items()})
    piece = printed or drawn(design)
    cell = sha256(dumps(asdict(piece), sort_keys=True).encode()).hexdigest()
    question = {"what": "compression", "cell": cell, "solids": solids, "permittivity": eps, "held": held}
    found = cached.answer(question | {"stress_pa": STRESS_PA}, lambda: _pressed(piece, solids, eps, held))
    doubts = tuple(found["doubts"])
    if found["stress_pa"][-1] < STRESS_PA[-1]:
        doubts = (*doubts, f"the solution of the cell ended at {found['stress_pa'][-1] / 1e3:.3g} kPa")
    curve = compression.curve("solved", found["source"], found["stress_pa"], found["ratio"])
    held_else = compression.held_of(found["of"])
    curve = replace(curve, within=found["within"], held=held_else, moved_m=found["moved_m"])
    return _cell(curve, {**moduli, **{f"{n}'s ratio": t for n, t in ratios.items()}}, doubts)


def refuse_crushing(stress_pa: float, youngs_modulus_pa: Mapping[str, float]) -> None:
    """Refuse a stress above the least modulus [Pa], by material: it would be reached in no time that anyone waits."""
    softest = min(youngs_modulus_pa, key=lambda name: youngs_modulus_pa[name])
    if stress_pa > youngs_modulus_pa[softest]:
        raise OutOfRange(
            f"{stress_pa / 1e3:g} kPa on {softest} of {youngs_modulus_pa[softest] / 1e3:g} kPa (Young's modulus): "
            "expected a stress up to the least modulus"
        )


def _pressed(
    piece: Piece, solids: Mapping[str, tuple[float, float]], eps: Mapping[str, float], given: Mapping[str, str]
) -> dict[str, Any]:
    """The curve of a cell on two meshes, as plain data; as far as it converged and its capacitance is known."""
    from sensorgen.models import press2d, press3d

    elastic = {name: press2d.Elastic(*pair) for name, pair in solids.items()}
    held, stress = press2d.Held(**given), list(STRESS_PA)
    flat = press2d.unfit(piece.scene) is None or press3d.unfit(piece.scene) is not None
    press, coarse = _flat(piece) if flat else _boxes(piece)
    found = press(elastic, stress, eps, held)
    if 0 < _reach_pa(found) < stress[-1]:
        stress = [p for p in stress if p <= _reach_pa(found)]
        found = press(elastic, stress, eps, held)
    curve = press2d.curve_of(found)
    other = press2d.curve_of(press(elastic, stress, eps, held, coarse))
    rises = zip(curve.ratio[1:], other.ratio[1:], strict=False)
    within = max(abs((b - 1) / (a - 1) - 1) for a, b in rises)
    return {
        "source": curve.source,
        "stress_pa": curve.stress_pa,
        "ratio": curve.ratio,
        "within": max(within, _LEAST),
        "of": "tri" if flat else "rect",
        "moved_m": float(found.displacement_m[-1]) - found.fall_m,
        "doubts": [*found.doubts, *([_LANDING] if found.fall_m else [])],
    }


def _reach_pa(found: "Pressed") -> float:
    """Highest pressure up to which every capacitance is known; 0 where only that at rest is [Pa]."""
    pairs = zip(found.stress_pa.tolist(), found.capacitance_f_per_m2, strict=True)
    return max((p for p, _ in takewhile(lambda pair: pair[1] is not None, pairs)), default=0.0)


def _flat(piece: Piece) -> tuple[Callable[..., "Pressed"], "Fineness"]:
    """How to press a cross-section, and a coarser mesh."""
    from sensorgen.models import press2d

    cell, fine = press2d.cell(piece.scene, piece.period_mm), press2d.Fineness()
    coarse = replace(fine, corner_mm=_COARSER * fine.corner_mm, coarse_mm=_COARSER * fine.coarse_mm)
    return partial(press2d.press, cell), coarse


def _boxes(piece: Piece) -> tuple[Callable[..., "Pressed"], "Pieces"]:
    """How to press a scene of boxes, and a coarser mesh."""
    from sensorgen.models import press3d

    return partial(press3d.press, press3d.cell(piece.scene)), press3d.Pieces().coarser()


def film(design: Design) -> str:
    """Name of the material between the electrodes."""
    return design.materials.dielectric.partition("@")[0]


def gap_m(scene: Scene) -> float:
    """Distance of the electrodes' plates, whatever stands on them [m]."""
    spans = {
        end: [p.span("z") for b in scene.bodies if b.terminal == end for p in b.prisms] for end in ("top", "bottom")
    }
    return (max(low for low, _ in spans["top"]) - min(high for _, high in spans["bottom"])) * M_PER_MM


def values(design: Design, quantity: str) -> dict[str, Taken]:
    """A quantity of every material in the sensor."""
    used, names = design.used(), sorted({body.material for body in design.in_use.bodies})
    found = {name: design.material(name).value(quantity, used[name]) for name in names}
    return {name: Taken(name, quantity, value.value, value.source) for name, value in found.items()}
