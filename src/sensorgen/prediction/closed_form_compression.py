"""Closed-form displacement under pressure; error unknown unless stated."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import BadInput
from sensorgen.design.design import Design
from sensorgen.design.values import film, of_all_materials, permittivities
from sensorgen.models import press2d, springs
from sensorgen.prediction.capacitance import capacitance, is_plate
from sensorgen.prediction.compression_law import elastic, gap_m, law_of
from sensorgen.prediction.mesh_ladder import Piece, refuse_crushing


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
    """

    displacement_m: NDArray[np.float64]
    boundary: dict[str, str]
    doubts: tuple[str, ...]


def _springs(design: Design, piece: Piece, stress_pa: Sequence[float]) -> ClosedForm:
    """Columns as springs side by side, for any scene."""
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


def _plate(name: str, design: Design, piece: Piece, stress_pa: Sequence[float]) -> ClosedForm:
    """A law of solid plates, with rigid electrodes."""
    known = capacitance(piece.scene, {t.material: t.value for t in permittivities(design)}, model="columns", keep=False)
    between = {body.material for body in piece.scene.bodies if not body.terminal}
    if not is_plate(known, piece.scene) or between != {film(design)}:
        raise BadInput(f"--model {name} applies to a solid plate of one material, {design.shape} is none: try springs")
    refuse_crushing(
        stress_pa[-1], {n: taken.value for n, taken in of_all_materials(design, "youngs_modulus_pa").items()}
    )
    law, gap = law_of(design, known, name, printed=piece).compression, gap_m(piece.scene)
    displacement_m = np.asarray(stress_pa) / law.foundation_stiffness_pa_per_m(gap)
    doubts = (
        f"displacement: of the film between stiff electrodes, {law.source}",
        "no capacitance under stress: sensorgen predict gives it by this law",
    )
    return ClosedForm(
        displacement_m, {"sides": "free" if name == "unconfined" else "bonded to both electrodes"}, doubts
    )


MODELS: dict[str, Callable[[Design, Piece, Sequence[float]], ClosedForm]] = {
    "springs": _springs,
    "unconfined": partial(_plate, "unconfined"),
    "bonded": partial(_plate, "bonded"),
}
FIRST = "springs"  # applies to any scene: the default where no field can be solved
