"""Models of compression on triangular cells whose way under stress other programs have solved.

The error is the largest one over the loads, of the displacement of the top, or of the rise of the capacitance.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.errors import MissingValue
from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design.shapes import tri
from sensorgen.models import compression, fem2d, press2d, press3d, springs, thesis_cells
from sensorgen.models.press2d import Elastic, Fineness
from sensorgen.scene.scene import Fill, Scene
from sensorgen.solvers.contact import mesher
from sensorgen.verification.chart.results import Ladder, Question, Step, of_scene, own

_EPS = {"x60": 4.68, "air": 1.00059}
SOLIDS = {"x60": Elastic(6e6, 0.4999), "etpu": Elastic(22e6, 0.4999)}
_WIDTH_M = 10e-3  # of the sensor, for a film that is bonded

_MISSING = "the mesher is not installed (extra fem), or the load was not reached"

# Coarse to fine: sizes at the apex, at corners and far from both, and how they grow.
_MESHES = (Fineness(2.8e-3, 0.2, 0.4, 1.0), Fineness(1.4e-3, 0.1, 0.3, 0.7), Fineness())


@dataclass(frozen=True)
class KnownCell:
    """A cell's way under stress: neo-Hookean, without friction, base and period fixed; two programs, four meshes.

    Attributes
    ----------
    film_mm : float
        Of the cell [mm].
    stress_kpa, down_um, rise_pf_per_m : tuple of float
        Loads [kPa]; displacement of the top [um] and rise of the capacitance per depth of a period [pF/m].
    known_to : (float, float)
        Of both, their largest relative error [-].
    rest_pf_per_m : float
        Capacitance at rest [pF/m].
    """

    film_mm: float
    stress_kpa: tuple[float, ...]
    down_um: tuple[float, ...]
    rise_pf_per_m: tuple[float, ...]
    known_to: tuple[float, float]
    rest_pf_per_m: float

    def params(self) -> tri.Params:
        """Sizes at rest."""
        return tri.Params(dielectric_mm=self.film_mm)

    def stress_pa(self) -> Real:
        """Loads [Pa]."""
        return np.array(self.stress_kpa) * 1e3

    def height_m(self) -> float:
        """Between the electrodes [m]."""
        return (self.params().hang_height_mm + self.film_mm) * M_PER_MM


CELLS = {
    "0.1 mm": KnownCell(
        0.1, (10, 50, 100), (6.1323, 20.6592, 33.1181), (11.215, 33.711, 52.508), (4.1e-3, 6.5e-3), 159.65204
    ),
    "0.2 mm": KnownCell(
        0.2, (10, 50, 100), (6.5427, 22.5202, 36.4366), (6.641, 20.352, 32.043), (4.3e-3, 6.1e-3), 128.513659
    ),
}  # fmt: skip

_DOWN, _RISE = "top down", "rise of C"
STANDARD = {f"tri pressed, {film}: {what}": (film, what) for what in (_DOWN, _RISE) for film in CELLS}


def question(name: str) -> Question:
    """Way of the top [um], or rise of the capacitance [pF/m], at every load."""
    film, what = STANDARD[name]
    known, rise = CELLS[film], what == _RISE
    reasons = {"press2d": _MISSING, "press3d": press3d.why_not_applicable(_scene(known)) or ""}
    reasons |= (
        {"springs": "it has a displacement and no capacitance"} if rise
        else {"thesis_cells": "the displacement is what 3.1.2 is given"}
    )  # fmt: skip
    ladders, values = (_rise(known), known.rise_pf_per_m) if rise else (_down(known), known.down_um)
    return of_scene(name, "compression of a cell", own(ladders, reasons), values, known.known_to[rise])


def _down(known: KnownCell) -> Iterator[Ladder]:
    """Displacement of the top by each model, in um."""
    for law in _laws(known):
        yield f"compression: {law.name}", [("", partial(_by_law, known, law, rise=False))]
    plane = {name: s.youngs_modulus_pa / (1 - s.poisson_ratio**2) for name, s in SOLIDS.items()}
    yield "springs", [("", lambda: 1e6 * springs.displacement_m(_scene(known), plane, list(known.stress_pa())))]
    yield "press2d", _levels(known, None)


def _rise(known: KnownCell) -> Iterator[Ladder]:
    """Rise of the capacitance by each model, in pF/m."""
    for law in _laws(known):
        yield f"compression: {law.name}", [("", partial(_by_law, known, law, rise=True))]
    by_hand = {"formula 3.35": lambda q: thesis_cells.triangles_f_per_m2(q, _EPS["x60"]), "field": _field_f_per_m2}
    for name, work in by_hand.items():
        yield f"thesis_cells: 3.1.2, {name}", [("displacement given", partial(_swept, known, work))]
    yield "press2d", _levels(known, _EPS)


def _laws(known: KnownCell) -> tuple[compression.Plate, ...]:
    """The film as a plate; the solved curves of :mod:`sensorgen.models.compression` are the reference here."""
    modulus = SOLIDS["x60"].youngs_modulus_pa
    return compression.unconfined(modulus), compression.bonded(modulus, _WIDTH_M, known.film_mm * M_PER_MM)


def _by_law(known: KnownCell, law: compression.Plate, *, rise: bool) -> Real:
    strain = law.capacitive_strain(known.stress_pa())[0]
    return np.asarray(known.rest_pf_per_m * (1 / (1 - strain) - 1) if rise else 1e6 * strain * known.height_m())


def _scene(known: KnownCell) -> Scene:
    return designs.make({"shape": "tri", "parameters": {"dielectric_mm": known.film_mm}}).in_use


def has_mesher() -> bool:
    """True where the mesher of pressed cells is installed; it is loaded then."""
    try:
        mesher.check()
    except MissingValue:
        return False
    return True


def _levels(known: KnownCell, permittivity: dict[str, float] | None) -> list[Step]:
    """Finite elements from coarse to fine."""
    return [
        (f"triangles of {1e3 * mesh.apex_mm:g} µm at the apex", partial(_pressed, known, permittivity, mesh))
        for mesh in _MESHES if has_mesher()
    ]  # fmt: skip


def _pressed(known: KnownCell, permittivity: dict[str, float] | None, mesh: Fineness) -> Real | None:
    """Displacement [um], or with permittivities the rise [pF/m]; None where not the whole load was reached."""
    cell, stress = press2d.cell(_scene(known), known.params().period_mm), [0.0, *known.stress_pa()]
    pressed = press2d.press(cell, SOLIDS, stress, permittivity, fineness=mesh)
    if pressed.converged_pa != stress[-1]:
        return None
    if permittivity is None:
        return 1e6 * pressed.displacement_m[1:]
    if None in pressed.capacitance_f_per_m2:
        return None  # too coarse for a field
    per_area = np.array([c.middle() for c in pressed.capacitance_f_per_m2 if c])
    return np.asarray(1e12 * (per_area - per_area[0])[1:] * known.params().period_mm * M_PER_MM)


def _swept(known: KnownCell, work: Callable[[tri.Params], float]) -> Real:
    """Rise per depth of a period of sizes that are changed by hand to each displacement, in pF/m."""
    sizes = [thesis_cells.swept(known.params(), um * 1e-3) for um in (0.0, *known.down_um)]
    value = np.array([work(q) * q.period_mm * M_PER_MM for q in sizes])
    return np.asarray(1e12 * (value[1:] - value[0]))


def _field_f_per_m2(p: tri.Params) -> float:
    scene = tri.scene(tri.Params(**{**vars(p), "length_mm": p.period_mm, "width_mm": 1.0}), Fill())
    return fem2d.capacitance(scene, _EPS, 1e-4).middle() / (p.period_mm * M_PER_MM**2)
