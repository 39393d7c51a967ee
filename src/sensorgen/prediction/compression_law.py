"""How the film of a design gives way, by the best that is known of its cell; and by how much that may be wrong.

A plate has two laws, free to give way sideways and bonded, which bracket it. A cell with gaps is solved once and for
all where it is a prototype's as drawn; any other one, as a printed cell, is solved when asked for, and kept.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import TYPE_CHECKING

from sensorgen.core.errors import OutOfRange, UnknownName
from sensorgen.core.units import M_PER_MM
from sensorgen.design.design import Design
from sensorgen.design.values import MaterialValue, film, of_all_materials, permittivities
from sensorgen.models import compression
from sensorgen.models.compression import Compression, Curve, curve_of
from sensorgen.prediction.capacitance import Answer, is_plate
from sensorgen.prediction.mesh_ladder import SAFETY, USUAL, Case, Piece, Rung, drawn, model_of, pressed, rungs
from sensorgen.scene.scene import Scene

if TYPE_CHECKING:
    from sensorgen.models.press2d import Elastic, Pressed

LAWS = ("unconfined", "bonded", "solved")
STRESS_PA = (0.0, 5e3, *(1e4 * k for k in range(1, 11)))  # 6 N on a tip of 10 x 10 mm are 60 kPa
_LANDING = f"feet land at no force to speak of: what C rises by up to {STRESS_PA[1] / 1e3:g} kPa is mostly their fall"
_SAME_RATIO = 1e-3  # of Poisson: 0.4999 and 0.5 make the same cell, 0.45 one that gives way by 11 % more
_ONSET = 0.25  # share by which a curve's onset is off at most, on films of 0.02 to 0.2 mm from 0.5 kPa on
_LIKE = {"press2d": "tri", "press3d": "rect"}  # prototypes that other cells are expected to be like


@dataclass(frozen=True)
class Law:
    """How a film gives way.

    Attributes
    ----------
    compression : Compression
        Thinning over stress.
    taken : tuple of MaterialValue
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
    taken: tuple[MaterialValue, ...]
    doubts: tuple[str, ...] = ()
    others: tuple[Compression, ...] = ()
    held: tuple[Compression, ...] = ()
    bounded: bool = True


def law_of(design: Design, answer: Answer, name: str = "", *, printed: Piece | None = None) -> Law:
    """The law of compression of a design, as well as it is known at once; for "solved", in a minute or two.

    Parameters
    ----------
    design : Design
        As drawn.
    answer : Answer
        Its unloaded capacitance.
    name : str
        One of ``LAWS``, or "" for the best that is known.
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
    moduli = of_all_materials(design, "youngs_modulus_pa")
    if is_plate(answer):
        return _plate(design, moduli, name, printed or drawn(design))
    if name == "bonded":
        raise OutOfRange(f"the law 'bonded' speaks of a solid plate; {design.shape} has gaps: expected 'unconfined'")
    known = None if printed else _stored(design, {n: t.value for n, t in moduli.items()})
    if known and name != "unconfined":
        return _cell(known, moduli)
    if name == "solved":
        return solved(design, printed)
    return _as_plate(design, moduli, "ask for the law 'solved', which takes from seconds to a minute")


@dataclass(frozen=True)
class Option:
    """A law that could be had.

    Attributes
    ----------
    name : str
        How it is found.
    seconds : float
        That it should take [s].
    expected : Law
        What it should be like, for what its error is worth.
    find : function
        The law itself; raises as :func:`solved`.
    """

    name: str
    seconds: float
    expected: Law
    find: Callable[[], Law]


def options(design: Design, answer: Answer, name: str = "", *, printed: Piece | None = None) -> list[Option]:
    """The laws that could be had of a design, the cheapest first; parameters and errors as of :func:`law_of`."""
    asked = name == "solved" and not is_plate(answer)
    at_once = law_of(design, answer, "" if asked else name, printed=printed)
    known = Option(at_once.compression.name, 0.0, at_once, lambda: at_once)
    if at_once.bounded or name == "unconfined":
        return [known]
    piece = printed or drawn(design)
    meshes = rungs(piece, model_of(piece), len(STRESS_PA) - 1)
    return [*([] if asked else [known]), *(_option(design, printed, rung) for rung in meshes)]


def _option(design: Design, printed: Piece | None, rung: Rung) -> Option:
    """A mesh of the cell; until it is solved, it is taken to rise as the nearest prototype does."""
    law = _cell(expected(design, rung), of_all_materials(design, "youngs_modulus_pa"))
    return Option(rung.name, rung.seconds, law, lambda: solved(design, printed, rung.level))


def expected(design: Design, rung: Rung) -> Curve:
    """What a mesh of an unknown cell should find: the curve of the prototype that it is nearest to."""
    modulus_pa = of_all_materials(design, "youngs_modulus_pa")[film(design)].value
    stiffer = max(modulus_pa / compression.PROTOTYPE_PA, 1 / compression.REACH)  # softer ones could not be extended
    return replace(compression.prototype(_LIKE[rung.model]).stiffer(stiffer), within=rung.rise)


def _stored(design: Design, youngs_modulus_pa: Mapping[str, float]) -> Curve | None:
    """The curve that was solved once and for all, if it was this cell's, of materials as near to incompressible."""
    known = compression.solved(design.shape, vars(design.params), youngs_modulus_pa)
    if not known:
        return None
    ratios = (taken.value for taken in of_all_materials(design, "poisson_ratio").values())
    return known if all(abs(ratio - compression.SOLVED_RATIO) < _SAME_RATIO for ratio in ratios) else None


def _plate(design: Design, moduli: Mapping[str, MaterialValue], name: str, piece: Piece) -> Law:
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


def _as_plate(design: Design, moduli: Mapping[str, MaterialValue], why: str) -> Law:
    soft = moduli[film(design)]
    doubt = f"{design.shape} taken to give way as a free solid plate of {soft.material} (B.49): its cell was not solved"
    return Law(compression.unconfined(soft.value), (soft,), (f"{doubt}; {why}",), bounded=False)


def _cell(found: Curve, moduli: Mapping[str, MaterialValue], doubts: tuple[str, ...] = ()) -> Law:
    """A solved cell: rise and onset known to a share, and what other ways to hold it would make of it."""
    others = tuple(replace(found.rising(1 + sign * found.within), onset=1 + sign * _ONSET) for sign in (-1, 1))
    held = tuple(found.rising(1 + change) for change in found.held)
    return Law(found, tuple(moduli.values()), doubts, others, held)


def solved(design: Design, printed: Piece | None = None, level: int = USUAL, **held: str) -> Law:
    """The law of a cell by finite elements on one mesh, held against the next coarser one.

    Parameters
    ----------
    design : Design
        As drawn.
    printed : Piece, optional
        What is printed of it; as drawn where not given.
    level : int
        Of the mesh, as of :func:`sensorgen.prediction.mesh_ladder.pressed`.
    **held : str
        How it is held and touched, as of :class:`sensorgen.solvers.contact.support.Held`.

    Raises
    ------
    MissingValue, BadInput, OutOfRange
        No modulus or Poisson's ratio, no NGSolve; a cell that is no prism; a solution that is not to be trusted.
    """
    from sensorgen.models.press2d import Held

    moduli, ratios = of_all_materials(design, "youngs_modulus_pa"), of_all_materials(design, "poisson_ratio")
    piece = printed or drawn(design)
    model = model_of(piece)
    eps = {t.material: t.value for t in permittivities(design)}
    case = Case(piece, model, elastic(design, piece.scene), eps, Held(**held))
    found = _as_far(case, level)
    curve = curve_of(found)
    other = curve_of(pressed(case, curve.stress_pa, level - 1))
    rises = zip(curve.ratio[1:], other.ratio[1:], strict=False)
    least = next(rung.rise for rung in rungs(piece, model, 1) if rung.level == level)
    curve = replace(
        curve,
        within=max(least, *(SAFETY * abs((b - 1) / (a - 1) - 1) for a, b in rises)),
        held=compression.prototype(_LIKE[model]).held,
        moved_m=float(found.displacement_m[-1]) - found.fall_m,
    )
    doubts = (*found.doubts, *([_LANDING] if found.fall_m else []), *_short(curve))
    return _cell(curve, {**moduli, **{f"{n}'s ratio": t for n, t in ratios.items()}}, doubts)


def _as_far(case: Case, level: int) -> "Pressed":
    """A case pressed as far as it converges and its capacitance is known."""
    found = pressed(case, STRESS_PA, level)
    reach = _reach_pa(found)
    return pressed(case, [p for p in STRESS_PA if p <= reach], level) if 0 < reach < STRESS_PA[-1] else found


def _reach_pa(found: "Pressed") -> float:
    """Highest pressure up to which every capacitance is known; 0 where only that at rest is [Pa]."""
    pairs = zip(found.stress_pa.tolist(), found.capacitance_f_per_m2, strict=True)
    return max((p for p, _ in takewhile(lambda pair: pair[1] is not None, pairs)), default=0.0)


def _short(curve: Curve) -> list[str]:
    last = curve.stress_pa[-1]
    return [f"the solution of the cell ended at {last / 1e3:.3g} kPa"] if last < STRESS_PA[-1] else []


def elastic(design: Design, scene: Scene) -> "dict[str, Elastic]":
    """How each material of a scene gives way."""
    from sensorgen.models.press2d import Elastic

    used = design.used()
    loaded = {name: design.material(name) for name in sorted({body.material for body in scene.bodies})}
    return {
        name: Elastic(m.value("youngs_modulus_pa", used[name]).value, m.value("poisson_ratio", used[name]).value)
        for name, m in loaded.items()
    }


def gap_m(scene: Scene) -> float:
    """Distance of the electrodes' plates, whatever stands on them [m]."""
    spans = {
        end: [p.span("z") for b in scene.bodies if b.terminal == end for p in b.prisms] for end in ("top", "bottom")
    }
    return (max(low for low, _ in spans["top"]) - min(high for _, high in spans["bottom"])) * M_PER_MM
