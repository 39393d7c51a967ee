"""How a design's cell gives way under stress, as plain data: what ``sensorgen compress`` answers."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from sensorgen import cached
from sensorgen.design import Design
from sensorgen.errors import OutOfRange
from sensorgen.models import press2d, springs
from sensorgen.models.press2d import Elastic, Fineness, Held

__all__ = ["MODELS", "Held", "answer", "stresses_kpa"]

Data = dict[str, Any]
MODELS = ("press2d", "springs")

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
        One of ``MODELS``, or "" for the finite elements where they can speak of the scene, else springs.
    check_mesh : bool
        Solve on a finer mesh too, and compare.
    keep : bool
        Take an answer that is known from before, and keep a new one.
    step : callable, optional
        Told every stress that is reached [Pa].

    Raises
    ------
    MissingValue
        A modulus, a Poisson's ratio or a permittivity that no source gives, or no mesher.
    BadInput, OutOfRange
        As :func:`sensorgen.models.press2d.press`.
    """
    solids = _solids(design)
    asked = [_PA_PER_KPA * kpa for kpa in stress_kpa]
    if (model or _cheapest(design)) == "springs":
        return _springs(design, solids, asked)
    cell = press2d.cell(design.in_use, _period_mm(design))
    permittivity = _permittivity(design)

    def work() -> Data:
        found = press2d.press(cell, solids, asked, permittivity, held, step=step)
        if check_mesh:
            finer = press2d.press(cell, solids, asked, permittivity, held, Fineness().finer(), step=step)
            found = press2d.compared(found, finer)
        return _plain(found, held)

    if not keep:
        return work()
    question = {
        "compress": repr(cell),
        "solids": {name: [s.youngs_modulus_pa, s.poisson_ratio] for name, s in solids.items()},
        "permittivity": permittivity,
        "stress_pa": asked,
        "held": vars(held),
        "check_mesh": check_mesh,
    }
    found: Data = cached.answer(question, work)
    return found


def _cheapest(design: Design) -> str:
    return MODELS[press2d.unfit(design.in_use) is not None]


def _period_mm(design: Design) -> float | None:
    found: float | None = getattr(design.params, "period_mm", None)
    return found


def _solids(design: Design) -> dict[str, Elastic]:
    used = design.used()
    loaded = {name: design.material(name) for name in sorted({body.material for body in design.in_use.bodies})}
    return {
        name: Elastic(m.value("youngs_modulus_pa", used[name]).value, m.value("poisson_ratio", used[name]).value)
        for name, m in loaded.items()
    }


def _permittivity(design: Design) -> dict[str, float]:
    used = design.used() | {"air": ""}
    names = {body.material for body in design.in_use.bodies if not body.terminal} | {"air"}
    return {name: design.material(name).value("relative_permittivity", used[name]).value for name in sorted(names)}


def _plain(found: press2d.Pressed, held: Held) -> Data:
    bounds = found.capacitance_f_per_m2
    return {
        "model": "press2d",
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


def _springs(design: Design, solids: Mapping[str, Elastic], stress_pa: Sequence[float]) -> Data:
    """What springs of columns know: a displacement, and no capacitance."""
    why = press2d.unfit(design.in_use)
    plane = why is None
    moduli = {name: s.youngs_modulus_pa / ((1 - s.poisson_ratio**2) if plane else 1.0) for name, s in solids.items()}
    moved = springs.displacement_m(design.in_use, moduli, stress_pa)
    boxes = all(prism.is_box() for body in design.in_use.bodies for prism in body.prisms)
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
