"""How the film of a design gives way, by the best that is known of its cell; and by how much that may be wrong.

A plate has two laws, free to give way sideways and bonded, which bracket it. A cell with gaps is solved once and for
all where it is a prototype's; any other one is solved when asked for, and kept.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from hashlib import sha256
from json import dumps
from typing import TYPE_CHECKING, Any

from sensorgen import cached
from sensorgen.design import Design
from sensorgen.errors import OutOfRange, SensorgenError, UnknownName
from sensorgen.models import compression
from sensorgen.models.compression import Compression, Curve
from sensorgen.planner import Answer, Taken, is_plate, permittivities
from sensorgen.units import M_PER_MM

if TYPE_CHECKING:
    from sensorgen.models.press2d import Fineness, Pressed
    from sensorgen.models.press3d import Pieces

LAWS = ("unconfined", "bonded", "solved")
STRESS_PA = (0.0, 5e3, *(1e4 * k for k in range(1, 11)))  # 6 N on a tip of 10 x 10 mm are 60 kPa
_LEAST = 0.006  # of the rise: what mesh levels, penalties and a second discretisation agree to at best
_COARSER = 1.5  # mesh that a solution is compared with, by its edges


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


def law_of(design: Design, answer: Answer, name: str = "", *, solve: bool = False) -> Law:
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

    Raises
    ------
    UnknownName, OutOfRange
        No such law; or a law that does not speak of this shape.
    MissingValue, BadInput
        For "solved": no modulus or Poisson's ratio, no NGSolve, a cell that is no prism.
    """
    if name not in ("", *LAWS):
        raise UnknownName("law of compression", name, LAWS)
    moduli = _values(design, "youngs_modulus_pa")
    if is_plate(answer):
        return _plate(design, moduli, name)
    if name == "bonded":
        raise OutOfRange(f"the law 'bonded' speaks of a solid plate; {design.shape} has gaps: expected 'unconfined'")
    known = compression.solved(design.shape, vars(design.params), {n: t.value for n, t in moduli.items()})
    if known and name != "unconfined":
        return _cell(known, moduli)
    if name == "solved":
        return solved(design)
    if solve and not name:
        try:
            return solved(design)
        except SensorgenError as error:
            return _as_plate(design, moduli, str(error))
    return _as_plate(design, moduli, "ask for the law 'solved', which takes a minute or two")


def _plate(design: Design, moduli: Mapping[str, Taken], name: str) -> Law:
    """Free or bonded, the other one being as good as it."""
    if name == "solved":
        raise OutOfRange(f"{design.shape} is a solid plate: expected the law 'unconfined' or 'bonded'")
    film = moduli[_film(design)]
    free = compression.unconfined(film.value)
    tied = compression.bonded(film.value, design.params.width_mm * M_PER_MM, _gap_m(design))
    if name == "bonded":
        return Law(tied, (film,), others=(free,))
    return Law(
        free, (film,), ("a plate free to give way sideways: bonded to its electrodes it would be stiffer",), (tied,)
    )


def _as_plate(design: Design, moduli: Mapping[str, Taken], why: str) -> Law:
    film = moduli[_film(design)]
    doubt = f"{design.shape} taken to give way as a free solid plate of {film.material} (B.49): its cell was not solved"
    return Law(compression.unconfined(film.value), (film,), (f"{doubt}; {why}",), bounded=False)


def _cell(found: Curve, moduli: Mapping[str, Taken], doubts: tuple[str, ...] = ()) -> Law:
    """A solved cell: its rise known to a share, and what other ways to hold it would make of it."""
    others = tuple(found.rising(1 + sign * found.within) for sign in (-1, 1))
    held = tuple(found.rising(1 + change) for change in found.held)
    return Law(found, tuple(moduli.values()), doubts, others, held)


def solved(design: Design, **held: str) -> Law:
    """The law of a cell by finite elements, or from the cache.

    Parameters
    ----------
    design : Design
        As drawn.
    **held : str
        How it is held and touched, as of :class:`sensorgen.models._press.support.Held`.

    Raises
    ------
    MissingValue, BadInput, OutOfRange
        No modulus or Poisson's ratio, no NGSolve; a cell that is no prism; a solution that is not to be trusted.
    """
    moduli, ratios = _values(design, "youngs_modulus_pa"), _values(design, "poisson_ratio")
    eps = {t.material: t.value for t in permittivities(design)}
    solids = {name: (moduli[name].value, ratios[name].value) for name in moduli}
    scene = sha256(dumps(asdict(design.in_use), sort_keys=True).encode()).hexdigest()
    question = {"what": "compression", "scene": scene, "solids": solids, "permittivity": eps, "held": held}
    found = cached.answer(question | {"stress_pa": STRESS_PA}, lambda: _pressed(design, solids, eps, held))
    doubts: tuple[str, ...] = ()
    if found["stress_pa"][-1] < STRESS_PA[-1]:
        doubts = (f"the solution of the cell ended at {found['stress_pa'][-1] / 1e3:.3g} kPa",)
    curve = compression.curve("solved", found["source"], found["stress_pa"], found["ratio"])
    curve = replace(curve, within=found["within"], held=compression.held_of(found["of"]))
    return _cell(curve, {**moduli, **{f"{n}'s ratio": t for n, t in ratios.items()}}, doubts)


def _pressed(
    design: Design, solids: Mapping[str, tuple[float, float]], eps: Mapping[str, float], given: Mapping[str, str]
) -> dict[str, Any]:
    """The curve of a cell on two meshes, as plain data; as far as it converged."""
    from sensorgen.models import press2d, press3d

    elastic = {name: press2d.Elastic(*pair) for name, pair in solids.items()}
    held, stress = press2d.Held(**given), list(STRESS_PA)
    flat = press2d.unfit(design.in_use) is None or press3d.unfit(design.in_use) is not None
    press, coarse = _flat(design) if flat else _boxes(design)
    found = press(elastic, stress, eps, held)
    if 0 < found.converged_pa < stress[-1]:
        stress = [p for p in stress if p <= found.converged_pa]
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
    }


def _flat(design: Design) -> tuple[Callable[..., "Pressed"], "Fineness"]:
    """How to press a cross-section, and a coarser mesh."""
    from sensorgen.models import press2d

    cell, fine = press2d.cell(design.in_use, getattr(design.params, "period_mm", None)), press2d.Fineness()
    coarse = replace(fine, corner_mm=_COARSER * fine.corner_mm, coarse_mm=_COARSER * fine.coarse_mm)
    return partial(press2d.press, cell), coarse


def _boxes(design: Design) -> tuple[Callable[..., "Pressed"], "Pieces"]:
    """How to press a scene of boxes, and a coarser mesh."""
    from sensorgen.models import press3d

    return partial(press3d.press, press3d.cell(design.in_use)), press3d.Pieces().coarser()


def _film(design: Design) -> str:
    return design.materials.dielectric.partition("@")[0]


def _gap_m(design: Design) -> float:
    """Distance of the electrodes of a plate [m]."""
    spans = {
        end: [p.span("z") for b in design.in_use.bodies if b.terminal == end for p in b.prisms]
        for end in ("top", "bottom")
    }
    return (min(low for low, _ in spans["top"]) - max(high for _, high in spans["bottom"])) * M_PER_MM


def _values(design: Design, quantity: str) -> dict[str, Taken]:
    """A quantity of every material in the sensor."""
    used, names = design.used(), sorted({body.material for body in design.in_use.bodies})
    found = {name: design.material(name).value(quantity, used[name]) for name in names}
    return {name: Taken(name, quantity, value.value, value.source) for name, value in found.items()}
