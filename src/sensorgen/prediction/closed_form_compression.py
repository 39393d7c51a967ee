"""Closed-form displacement under pressure; error unknown unless stated."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput, OutOfRange, SensorgenError
from sensorgen.design.design import Design
from sensorgen.design.values import film, of_all_materials, permittivities
from sensorgen.models import press2d, springs
from sensorgen.prediction.capacitance import Answer, capacitance, is_plate
from sensorgen.prediction.compression_law import elastic, gap_m, infill, law_of
from sensorgen.prediction.mesh_ladder import PressedPiece, refuse_crushing


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
    said = (
        "at most this, at small strain under a stiff plate"
        if boxes
        else "an estimate: columns without their neighbours"
    )
    doubts = (
        f"displacement: {said}", "no capacitance under stress: springs have no outlines", *([why] if why else [])
    )  # fmt: skip
    return ClosedForm(springs.displacement_m(scene, moduli, stress_pa), {"top": "rigid"}, doubts)


PLATES = {"unconfined": "free", "bonded": "bonded to both electrodes"}


def law_name(design: Design, piece: PressedPiece) -> str:
    """Law in closed form of a plate of one material, or of infill; "" of other cells, which are solved."""
    try:
        if piece.period_mm is not None or len({b.terminal for b in piece.scene.bodies} - {""}) != 2:
            return ""
        known = _at_rest(design, piece)
        if is_plate(known, piece.scene):
            return "bonded" if _between(piece) == {film(design)} else ""
        return "infill" if infill(design, piece) else ""
    except SensorgenError:
        return ""


def _at_rest(design: Design, piece: PressedPiece) -> Answer:
    eps = {t.material: t.value for t in permittivities(design)}
    return capacitance(piece.scene, eps, model="columns", keep=False)


def _between(piece: PressedPiece) -> set[str]:
    return {body.material for body in piece.scene.bodies if not body.terminal}


def _law(name: str, design: Design, piece: PressedPiece, stress_pa: Sequence[float]) -> ClosedForm:
    """A law of solid plates or of infill."""
    known = _at_rest(design, piece)
    if name in PLATES and (not is_plate(known, piece.scene) or _between(piece) != {film(design)}):
        raise BadInput(f"--model {name} applies to a solid plate of one material, {design.shape} is none: try springs")
    refuse_crushing(
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


MODELS: dict[str, Callable[[Design, PressedPiece, Sequence[float]], ClosedForm]] = {
    "springs": _springs, **{name: partial(_law, name) for name in (*PLATES, "infill")},
}  # fmt: skip
FIRST = "springs"  # applies to any scene: the default where no field can be solved
