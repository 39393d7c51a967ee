"""Models of compression on triangular cells whose way under stress other programs have solved.

The error is the largest one over the loads, of the displacement of the top, or of the rise of the capacitance.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.errors import MissingValue
from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.design.shapes import tri
from sensorgen.models import compression, fem2d, press2d, press3d, springs, thesis_cells, thesis_swept
from sensorgen.models.press2d import Elastic, Fineness
from sensorgen.scene.scene import Fill, Scene
from sensorgen.solvers.contact.mesh import netgen
from sensorgen.verification.chart.measured import Point, timed

Real = NDArray[np.float64]

_EPS = {"x60": 4.68, "air": 1.00059}
_SOLIDS = {"x60": Elastic(6e6, 0.4999), "etpu": Elastic(22e6, 0.4999)}
ASKED = "compression of a cell"
_WIDTH_M = 10e-3  # of the sensor, for a film that is bonded

_MISSING = "the mesher is not installed (extra fem), or the load was not reached"

# Coarse to fine: sizes at the apex, at corners and far from both, and how they grow.
_MESHES = (Fineness(2.8e-3, 0.2, 0.4, 1.0), Fineness(1.4e-3, 0.1, 0.3, 0.7), Fineness())


@dataclass(frozen=True)
class Known:
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
    "0.1 mm": Known(
        0.1, (10, 50, 100), (6.1323, 20.6592, 33.1181), (11.215, 33.711, 52.508), (4.1e-3, 6.5e-3), 159.65204
    ),
    "0.2 mm": Known(
        0.2, (10, 50, 100), (6.5427, 22.5202, 36.4366), (6.641, 20.352, 32.043), (4.3e-3, 6.1e-3), 128.513659
    ),
}  # fmt: skip

_DOWN, _RISE = "top down", "rise of C"
STANDARD = {f"tri pressed, {film}: {what}": (film, what) for what in (_DOWN, _RISE) for film in CELLS}


def points(name: str, budget_s: float) -> list[Point]:
    """Measure every model of compression on one cell.

    Parameters
    ----------
    name : str
        Of ``STANDARD``.
    budget_s : float
        A finer mesh is not tried where that would take longer, estimated as ten times the last one [s].
    """
    film, what = STANDARD[name]
    known = CELLS[film]
    found = _down(known, budget_s) if what == _DOWN else _rise(known, budget_s)
    expected = known.down_um if what == _DOWN else known.rise_pf_per_m
    floor = known.known_to[what != _DOWN]
    return [_point(name, model, said, value, expected, floor, seconds) for model, said, value, seconds in found]


def why_not_applicable(name: str) -> dict[str, str]:
    """Why models of compression do not apply to a scene."""
    film, what = STANDARD[name]
    said = {"press3d": press3d.why_not_applicable(_scene(CELLS[film])) or "", "press2d": _MISSING}
    if what == _DOWN:
        return said | {"thesis_swept": "the displacement is what it is given"}
    return said | {"springs": "it has a displacement and no capacitance"}


Found = Iterator[tuple[str, str, Real, float]]


def _down(known: Known, budget_s: float) -> Found:
    """Displacement of the top by each model, in um."""
    for name, law in _laws(known).items():
        value, seconds = timed(lambda law=law: law.capacitive_strain(known.stress_pa())[0] * known.height_m())  # type: ignore[misc]
        yield f"compression: {name}", "", 1e6 * value, seconds
    plane = {name: s.youngs_modulus_pa / (1 - s.poisson_ratio**2) for name, s in _SOLIDS.items()}
    value, seconds = timed(lambda: springs.displacement_m(_scene(known), plane, list(known.stress_pa())))
    yield "springs", "", 1e6 * value, seconds
    for said, pressed, seconds in _pressed(known, budget_s):
        yield "press2d", said, 1e6 * pressed.displacement_m[1:], seconds


def _rise(known: Known, budget_s: float) -> Found:
    """Rise of the capacitance by each model, in pF/m."""
    for name, law in _laws(known).items():
        value, seconds = timed(lambda law=law: 1 / (1 - law.capacitive_strain(known.stress_pa())[0]) - 1)  # type: ignore[misc]
        yield f"compression: {name}", "", known.rest_pf_per_m * value, seconds
    by_hand = {"thesis_swept: formula 3.35": _swept_formula, "thesis_swept: field": _swept_field}
    for name, work in by_hand.items():
        value, seconds = timed(partial(work, known))
        yield name, "displacement given, ", 1e12 * (value[1:] - value[0]), seconds
    for said, pressed, seconds in _pressed(known, budget_s, _EPS):
        if None in pressed.capacitance_f_per_m2:
            continue  # too coarse for a field
        per_area = np.array([c.middle() for c in pressed.capacitance_f_per_m2 if c])
        rise = (per_area - per_area[0])[1:] * known.params().period_mm * M_PER_MM
        yield "press2d", said, 1e12 * rise, seconds


def _laws(known: Known) -> dict[str, compression.Plate]:
    """The film as a plate; the solved curves of :mod:`sensorgen.models.compression` are the reference here."""
    modulus = _SOLIDS["x60"].youngs_modulus_pa
    laws = compression.unconfined(modulus), compression.bonded(modulus, _WIDTH_M, known.film_mm * M_PER_MM)
    return {law.name: law for law in laws}


def _scene(known: Known) -> Scene:
    return designs.make({"shape": "tri", "parameters": {"dielectric_mm": known.film_mm}}).in_use


def has_mesher() -> bool:
    """Whether the mesher of cells that are pressed is installed; it is loaded then."""
    try:
        netgen()
    except MissingValue:
        return False
    return True


def _pressed(
    known: Known, budget_s: float, permittivity: dict[str, float] | None = None
) -> Iterator[tuple[str, press2d.Pressed, float]]:
    """Finite elements from coarse to fine, where the whole load was reached."""
    cell = press2d.cell(_scene(known), known.params().period_mm)
    stress = [0.0, *known.stress_pa()]
    for mesh in _MESHES if has_mesher() else ():
        found, seconds = timed(lambda mesh=mesh: press2d.press(cell, _SOLIDS, stress, permittivity, fineness=mesh))  # type: ignore[misc]
        if found.converged_pa == stress[-1]:
            yield f"triangles of {1e3 * mesh.apex_mm:g} µm at the apex, ", found, seconds
        if 10 * seconds > budget_s:
            return


def _swept(known: Known, work: Callable[[tri.Params], float]) -> Real:
    """Per depth of a period, at rest and at each displacement, of sizes that are changed by hand [F/m]."""
    presses: Sequence[float] = (0.0, *(um * 1e-3 for um in known.down_um))
    sizes = [thesis_swept.swept(known.params(), press) for press in presses]
    return np.array([work(q) * q.period_mm * M_PER_MM for q in sizes])


def _swept_formula(known: Known) -> Real:
    return _swept(known, lambda q: thesis_cells.triangles_f_per_m2(q, _EPS["x60"]))


def _swept_field(known: Known) -> Real:
    return _swept(known, _field_f_per_m2)


def _field_f_per_m2(p: tri.Params) -> float:
    scene = tri.scene(tri.Params(**{**vars(p), "length_mm": p.period_mm, "width_mm": 1.0}), Fill())
    return fem2d.capacitance(scene, _EPS, 1e-4).middle() / (p.period_mm * M_PER_MM**2)


def _point(
    scene: str, model: str, said: str, value: Real, expected: Sequence[float], floor: float, seconds: float
) -> Point:
    off = value / np.array(expected) - 1
    worst = off[np.argmax(np.abs(off))]
    return Point(scene, model, max(float(abs(worst)), floor), seconds, f"{said}off by {worst:+.2%} at most")
