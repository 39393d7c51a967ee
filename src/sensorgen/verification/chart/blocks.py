"""Models of compression on bodies of known displacement under pressure.

A block follows closed forms; a strip that is bonded to stiff plates, and rect pressed lightly, were solved by another
program to the digits that are given. The error is the largest one over the loads.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.models import compression, press2d, press3d, springs
from sensorgen.models.compression import Plate
from sensorgen.models.press2d import Elastic, Fineness
from sensorgen.models.press3d import BoundaryConditions, BrickCounts, Pressed
from sensorgen.scene.scene import Body, Scene, box
from sensorgen.verification.chart.measured import DIGITS, ChartPoint, Ladder, climbed, relative
from sensorgen.verification.chart.presses import has_mesher

ASKED = "displacement of the top of a body"
_RUBBER = Elastic(6e6, 0.5)
_STRETCHES = np.array([0.97, 0.9, 0.8])  # along the load, of blocks
_BLOCK_MM, _STRIP_MM, _HALF_MM = 1.2, 10.0, 0.3  # heights of block and half strip, width of the strip
_FLOOR_MM, _HARD = 0.1, 1e6  # under the strip, and its modulus over that of rubber
_RECT_M = 6.65e-8  # 6.42, 6.51 and 6.54 on meshes of 0.3, 0.2 and 0.17 mm, order 3, small strain [m]
_BONDED = 92.456  # modulus over E of an incompressible strip 10 x 0.6 mm, order 6 and 60 cells along it
_MESHES = (Fineness(4e-3, 0.2, 0.4, 1.0), Fineness(), Fineness().finer())
_PIECES = (1, 2, 3)


@dataclass(frozen=True)
class KnownBlock:
    """A body whose way under pressure is known.

    Attributes
    ----------
    scene, period_mm : Scene, float or None
        What is pressed, and its period [mm].
    solids : dict of str to Elastic
        By material.
    boundary : BoundaryConditions
        Boundary and contact conditions.
    stress_pa, down_m : array
        Loads [Pa] and displacement of its top [m].
    known_to : float
        Its relative error [-].
    laws : tuple of Plate
        Models that apply to it.
    height_m : float
        Of the film that they take it for [m].
    plane, columns : bool
        Whether it is held along its depth; whether each of its columns reaches its top.
    """

    scene: Scene
    period_mm: float | None
    solids: dict[str, Elastic]
    boundary: BoundaryConditions
    stress_pa: Real
    down_m: Real
    known_to: float
    laws: tuple[Plate, ...]
    height_m: float
    plane: bool = True
    columns: bool = True


def _block(stress_over_mu: Callable[[Real], Real], *, plane: bool) -> KnownBlock:
    scene = designs.make({"shape": "reference"}).in_use
    stress = _RUBBER.youngs_modulus_pa / 3 * stress_over_mu(_STRETCHES)
    height = _BLOCK_MM * M_PER_MM
    laws = (compression.unconfined(_RUBBER.youngs_modulus_pa),)
    solids, boundary = dict.fromkeys(("x60", "etpu"), _RUBBER), BoundaryConditions("sliding", "free")
    return KnownBlock(scene, None, solids, boundary, stress, (1 - _STRETCHES) * height, DIGITS, laws, height, plane)


def block() -> KnownBlock:
    r"""A block that widens along x only, incompressible neo-Hookean: :math:`\sigma = \mu (b^{-3} - b)`."""
    return _block(lambda b: b**-3 - b, plane=True)


def free_block() -> KnownBlock:
    r"""Block that widens along x and y: :math:`\sigma = \mu (b^{-2} - b)`."""
    return _block(lambda b: b**-2 - b, plane=False)


def strip() -> KnownBlock:
    """The lower half of a strip between stiff plates to which it is bonded, in slices that are narrow at its sides."""
    cuts = 0.5 * _STRIP_MM * (1 + np.sin(np.linspace(-0.5, 0.5, 17) * np.pi)) + 0.5
    cuts, top = cuts.round(6).tolist(), _FLOOR_MM + _HALF_MM
    bodies = (
        Body("floor", "etpu", (box(0, _STRIP_MM + 1, 0, 1, 0, _FLOOR_MM),), "bottom"),
        Body("strip", "x60", tuple(box(a, b, 0, 1, _FLOOR_MM, top) for a, b in pairwise(cuts))),
    )
    scene = Scene(bodies, (_STRIP_MM + 1, 1.0, top))
    solids = {"x60": _RUBBER, "etpu": Elastic(_RUBBER.youngs_modulus_pa * _HARD, 0.3)}
    e, strain, height = _RUBBER.youngs_modulus_pa, np.array([1e-4]), _HALF_MM * M_PER_MM
    laws = compression.unconfined(e), compression.bonded(e, _STRIP_MM * M_PER_MM, 2 * height)
    return KnownBlock(
        scene, _STRIP_MM + 1, solids, BoundaryConditions(top="rigid"), _BONDED * e * strain, strain * height, 1e-4,
        laws, height, columns=False,
    )  # fmt: skip


def rect() -> KnownBlock:
    """Rect with a film of 0.1 mm under 1 kPa: between the limits of first and second order of meshes in tetrahedra."""
    scene = designs.make({"shape": "rect", "parameters": {"dielectric_mm": 0.1}}).in_use
    solids = {"x60": Elastic(6e6, 0.4999), "etpu": Elastic(22e6, 0.4999)}
    laws = (compression.unconfined(6e6), compression.bonded(6e6, 10e-3, 0.7e-3))
    return KnownBlock(
        scene, None, solids, BoundaryConditions(), np.array([1e3]), np.array([_RECT_M]), 0.01, laws, 0.7e-3
    )


STANDARD: dict[str, Callable[[], KnownBlock]] = {
    "block, free along x": block,
    "block, free all round": free_block,
    "bonded strip": strip,
    "rect pressed, 0.1 mm: top down": rect,
}


def points(name: str, budget_s: float) -> list[ChartPoint]:
    """Measure every model of compression on one body.

    Parameters
    ----------
    name : str
        Of ``STANDARD``.
    budget_s : float
        A finer mesh is not tried where that would take longer, estimated as ten times the last one [s].
    """
    standard = STANDARD[name]()
    return list(climbed(name, _models(standard), relative(standard.down_m, standard.known_to), budget_s))


def why_not_applicable(name: str) -> dict[str, str]:
    """Why models of compression do not apply to a scene."""
    standard = STANDARD[name]()
    flat = (
        "it holds the body along its depth" if not standard.plane else press2d.why_not_applicable(standard.scene) or ""
    )
    deep = press3d.why_not_applicable(standard.scene) or "free sides move in both directions, not along x alone"
    return {"press2d": flat or "the mesher is not installed (extra fem)", "press3d": deep,
            "springs": "beside the strip nothing reaches the top"}  # fmt: skip


def _models(standard: KnownBlock) -> Iterator[Ladder]:
    """Displacement [m] by laws of plates, by springs, and by finite elements in two and in three dimensions."""
    for law in standard.laws:
        work = partial(_by_law, standard, law)
        yield f"compression: {law.name}", [("", work)]
    if standard.columns:
        moduli = {
            name: s.youngs_modulus_pa / (1 - standard.plane * s.poisson_ratio**2) for name, s in standard.solids.items()
        }
        yield "springs", [("", lambda: springs.displacement_m(standard.scene, moduli, list(standard.stress_pa)))]
    if standard.plane and has_mesher() and not press2d.why_not_applicable(standard.scene):
        yield "press2d", [(f"mesh {k}, ", partial(_flat, standard, m)) for k, m in enumerate(_MESHES, 1)]
    if not (standard.plane and standard.boundary.period == "free"):
        yield "press3d", [(f"{n} pieces, ", partial(_deep, standard, n)) for n in _PIECES]


def _by_law(standard: KnownBlock, law: Plate) -> Real:
    return np.asarray(law.capacitive_strain(standard.stress_pa)[0] * standard.height_m)


def _flat(standard: KnownBlock, mesh: Fineness) -> Real | None:
    cell = press2d.cell(standard.scene, standard.period_mm)
    stress = [0.0, *standard.stress_pa]
    return _displacement_m(press2d.press(cell, standard.solids, stress, None, standard.boundary, mesh))


def _deep(standard: KnownBlock, pieces: int) -> Real | None:
    cell, stress = press3d.cell(standard.scene), [0.0, *standard.stress_pa]
    return _displacement_m(press3d.press(cell, standard.solids, stress, None, standard.boundary, BrickCounts(pieces)))


def _displacement_m(pressed: Pressed) -> Real | None:
    return None if pressed.faults else pressed.displacement_m[1:]
