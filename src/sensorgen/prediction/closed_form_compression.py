"""How far a top comes down, by laws that solve no field: at once, and of no known error where none is told."""

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
class Guess:
    """A displacement that no field was solved for.

    Attributes
    ----------
    displacement_m : (n,) array
        Of the top, at every stress [m].
    held : dict of str to str
        How the law takes the piece to be held.
    doubts : tuple of str
        What it is worth.
    """

    displacement_m: NDArray[np.float64]
    held: dict[str, str]
    doubts: tuple[str, ...]


def _springs(design: Design, piece: Piece, stress_pa: Sequence[float]) -> Guess:
    """Columns as springs side by side, for any scene."""
    scene, why = piece.scene, press2d.why_not_applicable(piece.scene)
    solids = elastic(design, scene)
    moduli = {n: s.youngs_modulus_pa / (1.0 if why else 1 - s.poisson_ratio**2) for n, s in solids.items()}
    boxes = all(prism.is_box() for body in scene.bodies for prism in body.prisms)
    said = "at most this, at small strain under a stiff plate" if boxes else "a guess: columns that know no neighbours"
    doubts = (
        f"displacement: {said}", "no capacitance under stress: springs do not know outlines", *([why] if why else [])
    )  # fmt: skip
    return Guess(springs.displacement_m(scene, moduli, stress_pa), {"top": "rigid"}, doubts)


def _plate(name: str, design: Design, piece: Piece, stress_pa: Sequence[float]) -> Guess:
    """A law of solid plates, its electrodes taken to be stiff."""
    known = capacitance(piece.scene, {t.material: t.value for t in permittivities(design)}, model="columns", keep=False)
    between = {body.material for body in piece.scene.bodies if not body.terminal}
    if not is_plate(known) or between != {film(design)}:
        raise BadInput(f"--model {name} speaks of a solid plate of one material, {design.shape} is none: try springs")
    refuse_crushing(
        stress_pa[-1], {n: taken.value for n, taken in of_all_materials(design, "youngs_modulus_pa").items()}
    )
    law, gap = law_of(design, known, name, printed=piece).compression, gap_m(piece.scene)
    moved_m = np.asarray(stress_pa) / law.bed_pa_per_m(gap)
    doubts = (
        f"displacement: of the film between stiff electrodes, {law.source}",
        "no capacitance under stress: sensorgen predict tells what the law makes of it",
    )
    return Guess(moved_m, {"sides": "free" if name == "unconfined" else "bonded to both electrodes"}, doubts)


MODELS: dict[str, Callable[[Design, Piece, Sequence[float]], Guess]] = {
    "springs": _springs,
    "unconfined": partial(_plate, "unconfined"),
    "bonded": partial(_plate, "bonded"),
}
FIRST = "springs"  # that is asked where no field can be solved: it speaks of any scene
