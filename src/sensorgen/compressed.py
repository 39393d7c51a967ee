"""How a design's cell gives way under stress, as plain data: what ``sensorgen compress`` answers."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from sensorgen import cached
from sensorgen.asprinted.compared import Printed
from sensorgen.asprinted.pressed import piece as printed_piece
from sensorgen.asprinted.pressed import width_by
from sensorgen.celllaw import Piece, drawn, refuse_crushing
from sensorgen.design import Design
from sensorgen.errors import BadInput, OutOfRange
from sensorgen.models import press2d, press3d, springs
from sensorgen.models.press2d import Elastic, Fineness, Held
from sensorgen.models.press3d import Pieces
from sensorgen.planner import permittivities
from sensorgen.scene import Scene

__all__ = ["MODELS", "Held", "answer", "stresses_kpa"]

Data = dict[str, Any]
MODELS = ("press2d", "press3d", "springs")

_PA_PER_KPA, _UM_PER_M = 1e3, 1e6
_OF_OUTLINES = "of the capacitance of the deformed outlines as computed; the outlines' own error is not in them"


def answer(
    design: Design,
    stress_kpa: Sequence[float],
    held: Held,
    model: str = "",
    *,
    check_mesh: bool = False,
    keep: bool = True,
    step: Callable[[float], None] | None = None,
    printed: Printed | None = None,
) -> Data:
    """Displacement and bounds of the capacitance per area over stress.

    Parameters
    ----------
    design : Design
        Its support is taken to be gone.
    stress_kpa : sequence of float
        Rising, 0 first [kPa].
    held : Held
        Base, period, top and contact.
    model : str
        One of ``MODELS``, or "" for the first that can speak of the scene.
    check_mesh : bool
        Solve on a finer mesh too, and compare.
    keep : bool
        Take an answer that is known from before, and keep a new one.
    step : callable, optional
        Told every stress that is reached [Pa].
    printed : Printed, optional
        What is printed of it, to be pressed in place of the drawing.

    Raises
    ------
    MissingValue
        A modulus, a Poisson's ratio or a permittivity that no source gives, or no mesher.
    BadInput, OutOfRange
        As :func:`sensorgen.models.press2d.press`; other electrodes than two, sides that a bonded base holds, a
        stress above the least modulus.
    """
    piece = printed_piece(design, printed) if printed else drawn(design)
    found = _answer(design, piece, stress_kpa, held, model, check_mesh=check_mesh, keep=keep, step=step)
    return found | {"printed": width_by(printed)} if printed else found


def _answer(
    design: Design,
    piece: Piece,
    stress_kpa: Sequence[float],
    held: Held,
    model: str,
    *,
    check_mesh: bool,
    keep: bool,
    step: Callable[[float], None] | None,
) -> Data:
    solids = _solids(design, piece.scene)
    asked = [_PA_PER_KPA * kpa for kpa in stress_kpa]
    name = model or next(m for m, refuses in _UNFIT.items() if not refuses(piece.scene))
    if name == "springs":
        return _springs(piece.scene, solids, asked)
    _refuse_unpressable(piece.scene, held)
    refuse_crushing(asked[-1], {name: solid.youngs_modulus_pa for name, solid in solids.items()})
    permittivity = {t.material: t.value for t in permittivities(design)}
    press, cell = _PRESSED[name](piece)

    def work() -> Data:
        found: press2d.Pressed = press(solids, asked, permittivity, held, step=step)
        if check_mesh:
            finer = (Pieces() if name == "press3d" else Fineness()).finer()
            found = press2d.compared(found, press(solids, asked, permittivity, held, finer, step=step))
        return _plain(found, name, held)

    if not keep:
        return work()
    question = {
        "compress": cell,
        "model": name,
        "solids": {name: [s.youngs_modulus_pa, s.poisson_ratio] for name, s in solids.items()},
        "permittivity": permittivity,
        "stress_pa": asked,
        "held": vars(held),
        "check_mesh": check_mesh,
    }
    known: Data = cached.answer(question, work)
    return known


def _refuse_unpressable(scene: Scene, held: Held) -> None:
    """Refuse what would be answered, but not as it was asked."""
    ends = sorted({body.terminal for body in scene.bodies if body.terminal})
    if ends != ["bottom", "top"]:
        raise BadInput(
            f"a cell with electrodes {', '.join(ends) or 'of no kind'}: expected two, bottom and top, whose "
            "capacitance a press changes; --model springs tells the displacement alone"
        )
    if held.period == "free" and held.base == "bonded":
        raise BadInput("sides that give way over a base that is bonded cannot: expected base 'sliding' with them")


def _in_2d(piece: Piece) -> tuple[Callable[..., press2d.Pressed], str]:
    cell = press2d.cell(piece.scene, piece.period_mm)
    return partial(press2d.press, cell), repr(cell)


def _in_3d(piece: Piece) -> tuple[Callable[..., press2d.Pressed], str]:
    cell = press3d.cell(piece.scene)
    return partial(press3d.press, cell), cell.written()


_PRESSED = {"press2d": _in_2d, "press3d": _in_3d}
_UNFIT: dict[str, Callable[[Scene], str | None]] = {
    "press2d": press2d.unfit,
    "press3d": press3d.unfit,
    "springs": lambda _: None,
}


def _solids(design: Design, scene: Scene) -> dict[str, Elastic]:
    used = design.used()
    loaded = {name: design.material(name) for name in sorted({body.material for body in scene.bodies})}
    return {
        name: Elastic(m.value("youngs_modulus_pa", used[name]).value, m.value("poisson_ratio", used[name]).value)
        for name, m in loaded.items()
    }


def _plain(found: press2d.Pressed, model: str, held: Held) -> Data:
    bounds = found.capacitance_f_per_m2
    return {
        "model": model,
        "held": dict(vars(held)),
        "stress_kpa": [p / _PA_PER_KPA for p in found.stress_pa.tolist()],
        "displacement_um": [d * _UM_PER_M for d in found.displacement_m.tolist()],
        "lower_f_per_m2": [c.lower if c else None for c in bounds],
        "upper_f_per_m2": [c.upper if c else None for c in bounds],
        "converged_kpa": found.converged_pa / _PA_PER_KPA,
        "faults": list(found.faults),
        "doubts": list(found.doubts),
        "bounds": _OF_OUTLINES,
    }


def _springs(scene: Scene, solids: Mapping[str, Elastic], stress_pa: Sequence[float]) -> Data:
    """What springs of columns know: a displacement, and no capacitance."""
    why = press2d.unfit(scene)
    plane = why is None
    moduli = {name: s.youngs_modulus_pa / ((1 - s.poisson_ratio**2) if plane else 1.0) for name, s in solids.items()}
    moved = springs.displacement_m(scene, moduli, stress_pa)
    boxes = all(prism.is_box() for body in scene.bodies for prism in body.prisms)
    said = "at most this, at small strain under a stiff plate" if boxes else "a guess: columns that know no neighbours"
    return {
        "model": "springs",
        "held": {"top": "rigid"},
        "stress_kpa": [p / _PA_PER_KPA for p in stress_pa],
        "displacement_um": (moved * _UM_PER_M).tolist(),
        "lower_f_per_m2": [None] * len(stress_pa),
        "upper_f_per_m2": [None] * len(stress_pa),
        "converged_kpa": stress_pa[-1] / _PA_PER_KPA,
        "faults": [],
        "doubts": [f"displacement: {said}", "no capacitance: springs do not know outlines", *([why] if why else [])],
        "bounds": "none",
    }


def stresses_kpa(found: Sequence[float]) -> tuple[float, ...]:
    """Stresses with 0 before them where it is not the first [kPa].

    >>> stresses_kpa((50.0, 100.0)), stresses_kpa((0.0, 10.0))
    ((0.0, 50.0, 100.0), (0.0, 10.0))
    """
    whole = tuple(found) if found[0] == 0 else (0.0, *found)
    if len(whole) < 2:
        raise OutOfRange("--stress 0: expected a stress above 0, as in 0:100:10")
    return whole
