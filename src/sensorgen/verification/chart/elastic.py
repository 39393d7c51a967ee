"""Models of compression on bodies whose deformation is known.

- A block follows closed forms; a strip that is bonded to stiff plates, and rect pressed lightly, were solved by another
  program to the digits that are given. The error is the largest one over the loads.
- A soft cylinder or sphere touches a stiff flat as wide as by Hertz (Johnson, Contact Mechanics, 1985, Eqs. 4.43 and
  4.22); sides of a polygon about the circle grow from where it touches.
- Cook's membrane, on which elements of nearly incompressible rubber may lock: a panel 48 mm long, 44 mm high where it
  is clamped and 16 mm where it is sheared, E 240.565, nu 0.4999, plane strain, small strain. Compared with the mean
  displacement of the sheared edge, by mixed elements of order 6 in another program.
"""

from collections.abc import Callable, Container, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from math import pi, tan

import numpy as np

from sensorgen.core.arrays import Real, Whole
from sensorgen.core.units import M_PER_MM
from sensorgen.design import design as designs
from sensorgen.models import compression, press2d, press3d, press_round, pressure, springs
from sensorgen.models.compression import Plate
from sensorgen.models.press2d import BoundaryConditions, Elastic, Fineness, Pressed
from sensorgen.models.press3d import BrickCounts
from sensorgen.scene.revolved import Revolved
from sensorgen.scene.scene import Body, Prism, Scene, box
from sensorgen.solvers.contact.cell import ContactCell
from sensorgen.verification.chart.presses import has_mesher
from sensorgen.verification.chart.results import DIGITS, Ladder, Question, of_scene, own

_RUBBER = Elastic(6e6, 0.5)
_STRETCHES = np.array([0.97, 0.9, 0.8])  # along the load, of blocks
_BLOCK_MM, _STRIP_MM, _HALF_STRIP_MM = 1.2, 10.0, 0.3  # heights of block and half strip, width of the strip
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
    cuts, top = cuts.round(6).tolist(), _FLOOR_MM + _HALF_STRIP_MM
    bodies = (
        Body("floor", "etpu", (box(0, _STRIP_MM + 1, 0, 1, 0, _FLOOR_MM),), "bottom"),
        Body("strip", "x60", tuple(box(a, b, 0, 1, _FLOOR_MM, top) for a, b in pairwise(cuts))),
    )
    scene = Scene(bodies, (_STRIP_MM + 1, 1.0, top))
    solids = {"x60": _RUBBER, "etpu": Elastic(_RUBBER.youngs_modulus_pa * _HARD, 0.3)}
    e, strain, height = _RUBBER.youngs_modulus_pa, np.array([1e-4]), _HALF_STRIP_MM * M_PER_MM
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


BLOCKS: dict[str, Callable[[], KnownBlock]] = {
    "block, free along x": block,
    "block, free all round": free_block,
    "bonded strip": strip,
    "rect pressed, 0.1 mm: top down": rect,
}


def of_block(name: str) -> Question:
    """Displacement of the top of a body at every load, by every model of compression [m]."""
    standard = BLOCKS[name]()
    refused = _refused(standard)
    series, asked = own(_models(standard, refused), refused), "displacement of the top of a body"
    return of_scene(name, asked, series, standard.down_m, standard.known_to)


def _refused(standard: KnownBlock) -> dict[str, str]:
    """Why models do not apply to a body, by model."""
    why = {} if standard.columns else {"springs": "beside the strip nothing reaches the top"}
    if not standard.plane:
        why["press2d"] = "it holds the body along its depth"
    elif flat := press2d.why_not_applicable(standard.scene):
        why["press2d"] = flat
    elif not has_mesher():
        why["press2d"] = "the mesher is not installed (extra fem)"
    if standard.plane and standard.boundary.period == "free":
        deep = press3d.why_not_applicable(standard.scene)
        why["press3d"] = deep or "free sides move in both directions, not along x alone"
    return why


def _models(standard: KnownBlock, refused: Container[str]) -> Iterator[Ladder]:
    """Displacement [m] by laws of plates, by springs, and by finite elements in two and in three dimensions."""
    for law in standard.laws:
        yield f"compression: {law.name}", [("", partial(_by_law, standard, law))]
    if "springs" not in refused:
        moduli = {
            name: s.youngs_modulus_pa / (1 - standard.plane * s.poisson_ratio**2) for name, s in standard.solids.items()
        }
        yield "springs", [("", lambda: springs.displacement_m(standard.scene, moduli, list(standard.stress_pa)))]
    if "press2d" not in refused:
        yield "press2d", [(f"mesh {k}", partial(_flat, standard, m)) for k, m in enumerate(_MESHES, 1)]
    if "press3d" not in refused:
        yield "press3d", [(f"{n} pieces", partial(_deep, standard, n)) for n in _PIECES]


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


_RADIUS_MM, _CONTACT_MM, _DEEP_MM, _FLAT_MM = 1.0, 0.02, 10.0, 0.1
_SOLIDS = {"soft": Elastic(6e6, 0.3), "stiff": Elastic(6e11, 0.3)}
_PLANE_PA = 6e6 / (1 - 0.3**2)
_SIDES_MM = (8e-3, 4e-3, 2e-3)  # where it touches

SPHERE = "sphere on a flat"
ROUND = dict.fromkeys(("cylinder on a flat", SPHERE), 2 * _CONTACT_MM * M_PER_MM)  # length of the contact [m]


def of_round(name: str) -> Question:
    """Length of a contact, by every model of it [m]."""
    solve = _turned if name == SPHERE else _solved
    levels = [(f"sides of {1e3 * side:g} µm", partial(solve, side)) for side in _SIDES_MM if has_mesher()]
    formula: Ladder = ("pressure: hertz", [("", _formula)])
    ladders = [("press_round", levels)] if name == SPHERE else [formula, ("press2d", levels)]
    return of_scene(name, "how wide a round body touches", own(ladders, _not_for_round(name)), ROUND[name], DIGITS)


def _not_for_round(name: str) -> dict[str, str]:
    """Why models of compression do not apply to a round body."""
    why = dict.fromkeys(("press2d", "press_round"), "the mesher is not installed (extra fem)")
    why |= dict.fromkeys(("springs", "compression"), "it gives the displacement of the top, and not where bodies touch")
    why["press3d"] = "a round body is no box"
    if name == SPHERE:
        return why | {"press2d": "a sphere is no prism", "pressure": "its contacts are as long as the sensor is wide"}
    return why | {"press_round": "a cylinder that lies has no upright axis"}


def _load_n_per_m() -> float:
    """That makes a contact of the standard's length, by Hertz."""
    return pi * _PLANE_PA * (_CONTACT_MM * M_PER_MM) ** 2 / (4 * _RADIUS_MM * M_PER_MM)


def _formula() -> float:
    length, _ = pressure.hertz(_RADIUS_MM * M_PER_MM, _PLANE_PA).length_m(np.asarray(_load_n_per_m()), 1.0)
    return float(length)


def _solved(side_mm: float) -> float:
    """Length of a half ellipse of pressure that has the second moment of what the faces push."""
    stress_pa = _load_n_per_m() / (2 * _RADIUS_MM * M_PER_MM)
    moment = _moment_m2(_cylinder(side_mm), stress_pa, Fineness(side_mm, 0.1, 0.1, 0.3))
    return float(4 * np.sqrt(moment))


def _turned(side_mm: float) -> float:
    """Diameter of a half ellipsoid of pressure, likewise."""
    width, high, cut = 3 * _RADIUS_MM, _RADIUS_MM / 2, _RADIUS_MM * 0.75**0.5
    corners = ((0.0, _FLAT_MM), (cut, _FLAT_MM + high), (0.0, _FLAT_MM + high))
    dome = Revolved(width / 2, width / 2, corners, (tan(pi / 12), 0.0, 0.0))
    top = _FLAT_MM + high + 2 * _RADIUS_MM
    bodies = (
        Body("flat", "stiff", (box(0, width, 0, width, 0, _FLAT_MM),), "bottom"),
        Body("sphere", "soft", (dome, box(0, width, 0, width, _FLAT_MM + high, top)), "top"),
    )
    fineness = Fineness(side_mm, 0.05, 0.3, 0.25)
    stress_pa = 4 / 3 * _PLANE_PA * (_CONTACT_MM * M_PER_MM) ** 3 / (_RADIUS_MM * M_PER_MM * (width * M_PER_MM) ** 2)
    moment = _moment_m2(press_round.cell(Scene(bodies, (width, width, top)), fineness), stress_pa, fineness)
    return float(2 * np.sqrt(2.5 * moment))


def _moment_m2(cell: ContactCell, stress_pa: float, fineness: Fineness) -> float:
    """Mean square of the distance from the middle, weighted with what the faces push [m2]."""
    boundary = BoundaryConditions(top="rigid")
    _, run = press2d._solved(cell, _SOLIDS, [0.0, stress_pa], boundary, fineness)
    state = run.states[-1]
    places = run.problem.places(state.u_m)
    here = run.problem.faces.rays(places).here_m
    push = np.maximum(-run.problem.gaps(state.pairs, state.u_m), 0) * state.pairs.stiffness_pa
    x = here[state.pairs.point % len(here), 0] - (0.0 if cell.turned else places[:, 0].max())
    return float((push * x**2).sum() / push.sum())


def _cylinder(side_mm: float) -> ContactCell:
    """The lower half of a polygon about a circle, on a flat."""
    sizes = np.minimum(side_mm * np.exp(0.25 * np.maximum(np.arange(400) - 2 * _CONTACT_MM / side_mm, 0)), 0.1)
    angle = np.cumsum(sizes)
    angle = np.append(angle[angle < pi / 2 - 0.05], pi / 2)
    angle = np.concatenate([-angle[::-1], [0.0], angle])
    middle, top = 1.5 * _RADIUS_MM, _FLAT_MM + _RADIUS_MM
    outline = np.column_stack([middle + np.sin(angle), top - np.cos(angle)]).round(9)
    bodies = (
        Body("flat", "stiff", (box(0, 2 * middle, 0, _DEEP_MM, 0, _FLAT_MM),)),
        Body("cylinder", "soft", (Prism("y", tuple(map(tuple, outline.tolist())), 0.0, _DEEP_MM),)),
    )
    return press2d.cell(Scene(bodies, (2 * middle, _DEEP_MM, top)), 2 * middle)


MEMBRANE: dict[str, float] = {"Cook's membrane": 0.077181}
_MEMBRANE_KNOWN_TO = 4e-5
_CELLS = (4, 8, 16, 32)
_MODULUS, _RATIO = 240.565, 0.4999


def of_membrane(name: str) -> Question:
    """Mean way of the sheared edge, by the elements of press2d on meshes from coarse to fine [mm]."""
    levels = [(f"{n} x {n} cells of two triangles", partial(edge, n)) for n in _CELLS]
    why = {"press3d": "its bricks have upright walls", "springs": "nothing presses it", "compression": "it is no film"}
    series, asked = own([("press2d: its elements", levels)], why), "how far the sheared edge of a membrane moves"
    return of_scene(name, asked, series, MEMBRANE[name], _MEMBRANE_KNOWN_TO)


def edge(cells: int) -> float:
    """Mean way of the sheared edge under a force of 1, with that many cells along each side."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import spsolve

    from sensorgen.solvers.contact import element
    from sensorgen.solvers.contact.mesh import of_triangles

    mesh = of_triangles(*_grid(cells))
    full = np.full(len(mesh.outer), 1.0)
    elements = element.Elements(mesh, element.law(_MODULUS * full, _RATIO * full))
    x = mesh.points_m[:, 0]
    force = np.zeros(2 * len(x))
    sheared = (x[mesh.rim] == x.max()).all(axis=1)
    length = mesh.lengths_m()[sheared]
    for node, share in zip(mesh.rim[sheared].T, (1 / 6, 1 / 6, 2 / 3), strict=True):
        np.add.at(force, 2 * node + 1, share * length / length.sum())
    tangent = elements.tangent(np.zeros(2 * len(x)), elements.start()).stiffness
    places = np.broadcast_to(elements.freedoms[:, :, None], tangent.shape)
    matrix = coo_matrix((tangent.ravel(), (places.ravel(), places.swapaxes(1, 2).ravel()))).tocsr()
    free = np.flatnonzero(np.repeat(x > 0, 2))
    return float(force[free] @ spsolve(matrix[free][:, free].tocsc(), force[free]))


def _grid(cells: int) -> tuple[Real, Whole, Whole]:
    """Corners, triangles and their region, narrow towards the clamped edge and its ends."""
    s = np.linspace(0, 1, cells + 1)
    x, y = (v.ravel() for v in np.meshgrid(s**2, (1 - np.cos(np.pi * s)) / 2))
    k = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (v.ravel() for v in (k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]))
    corners = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return np.column_stack([48 * x, 44 * x + y * (44 - 28 * x)]), corners, np.ones(len(corners), np.int64)
