"""Scenes of boxes under pressure, as crossed strips: bricks at large strain, and the capacitance when deformed.

Near-incompressible neo-Hookean solids between four mirrors; faces of gaps hold each other apart where they meet. The
field is solved on the boxes as drawn, with the displacement drawn into the permittivity. Checked as press2d is.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput
from sensorgen.scene.scene import Scene
from sensorgen.solvers.contact.brick_field import Orders
from sensorgen.solvers.contact.bricks import Bricks, bricks_of
from sensorgen.solvers.contact.cell import AIR
from sensorgen.solvers.contact.pressed import (
    Elastic,
    Pressed,
    check,
    compared,
    curve_of,
    penalty_pa,
    reached,
    with_capacitances,
)
from sensorgen.solvers.contact.support import Held

if TYPE_CHECKING:
    from sensorgen.solvers.contact.brick_element import BrickElements
    from sensorgen.solvers.contact.brick_field import Field
    from sensorgen.solvers.contact.brick_touch import BrickFaces
    from sensorgen.solvers.contact.load import Problem, State

SOURCE = (
    "neo-Hookean in 3D, bricks with 27 nodes and a linear pressure each (Q2 / P1); bounds of the capacitance by "
    "Dirichlet's and Thomson's principles on the boxes as drawn"
)
COST = 3

__all__ = ["Elastic", "Held", "Pieces", "Pressed", "cell", "compared", "curve_of", "press", "why_not_applicable"]

_STEP = 1 / 60  # longest load step over the least Young's modulus: 100 kPa for 6 MPa [-]
_MOST = 4000  # solid bricks: more would take hours
_OPEN = (1e-4, 1e-3, 1e-2)  # least height of a gap in the field, over that as drawn: to be tried in turn [-]

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Pieces:
    """Into how many bricks every box is cut along each axis, how they shrink towards planes, and the field's orders."""

    pieces: int = 3
    shrink: float = 0.3
    orders: Orders = field(default_factory=Orders)

    def finer(self) -> "Pieces":
        """One piece more."""
        return replace(self, pieces=self.pieces + 1)

    def coarser(self) -> "Pieces":
        """One piece less."""
        return replace(self, pieces=self.pieces - 1)


@dataclass(frozen=True)
class _Run:
    """What was solved, and the equilibria that were found."""

    elements: "BrickElements"
    faces: "BrickFaces"
    states: "list[State]"


def why_not_applicable(scene: Scene) -> str | None:
    """Why this model cannot speak of a scene, or None."""
    try:
        cell(scene)
    except BadInput as error:
        return str(error)
    return None


def cell(scene: Scene) -> Bricks:
    """The cell of a scene of boxes, between mirrors at its four sides.

    Raises
    ------
    BadInput
        A prism is no box, bodies overlap, or the cell has too many boxes.
    """
    found = bricks_of(scene)
    boxes = int((found.fill > 0).sum())
    if boxes > _MOST:
        raise BadInput(f"its cell has {boxes} boxes; at most {_MOST} can be pressed in 3D")
    return found


def press(
    bricks: Bricks,
    solids: Mapping[str, Elastic],
    stress_pa: Sequence[float],
    permittivity: Mapping[str, float] | None = None,
    held: Held | None = None,
    fineness: Pieces | None = None,
    step: Callable[[float], None] | None = None,
) -> Pressed:
    """Press a cell from above.

    Parameters
    ----------
    bricks : Bricks
        From :func:`cell`.
    solids : mapping of str to Elastic
        By material.
    stress_pa : sequence of float
        Pressures, from 0 on and rising [Pa].
    permittivity : mapping of str to float, optional
        Relative permittivity by material, with "air"; without it no capacitance is computed [-].
    held : Held, optional
        Base, period ("free": in both directions), top and contact.
    fineness : Pieces, optional
        Of the mesh; fewer pieces, which is said, where they would be too many.
    step : callable, optional
        Told every pressure of ``stress_pa`` that is reached [Pa].

    Raises
    ------
    OutOfRange
        Pressures do not rise from 0, or the electrodes touch.
    BadInput
        A choice of ``held`` is unknown, or an electrode does not cover the cell.
    """
    held, wanted = held or Held(), fineness or Pieces()
    check(stress_pa, held)
    fineness = _affordable(bricks, wanted)
    found, run = _solved(
        bricks.cut(fineness.pieces, fineness.shrink), solids, stress_pa, held, step or (lambda _: None)
    )
    if fineness != wanted:
        said = f"every box cut into {fineness.pieces} pieces along each axis, not {wanted.pieces}: there are many"
        found = replace(found, doubts=(*found.doubts, said))
    return _with_fields(found, run, permittivity, fineness.orders) if permittivity else found


def _affordable(bricks: Bricks, wanted: Pieces) -> Pieces:
    most = int((_MOST / max((bricks.fill > 0).sum(), 1)) ** (1 / 3))
    return replace(wanted, pieces=min(wanted.pieces, max(most, 1)))


def _solved(
    bricks: Bricks,
    solids: Mapping[str, Elastic],
    stress_pa: Sequence[float],
    held: Held,
    step: Callable[[float], None],
) -> tuple[Pressed, _Run]:
    from sensorgen.solvers.contact import brick_element, brick_factors, brick_touch, element, load, support

    mesh = brick_element.mesh_of(bricks, bricks.fill > 0)
    materials = [solids[r.material] if r.material != AIR else Elastic(1.0, 0.3) for r in bricks.regions]
    moduli, ratios = (
        np.array([getattr(m, key) for m in materials])[mesh.region] for key in ("youngs_modulus_pa", "poisson_ratio")
    )
    elements = brick_element.BrickElements(mesh, element.law(moduli, ratios))
    used = np.zeros(len(mesh.points_m), bool)
    used[elements.freedoms // 3] = True
    faces = brick_touch.BrickFaces(mesh, held.contact == "stick")
    free = support.free_of(mesh.points_m, held, bricks.spans_m(), used)
    first = free.tocsc().indices[free.tocsc().indptr[:-1]]
    problem = load.Problem(
        elements,
        faces,
        free,
        brick_touch.top_load(mesh),
        penalty_pa(float(moduli.min())),
        held.contact == "stick",
        solver=brick_factors.Solver(mesh.lattice[first // 3]),
    )
    found, states = reached(problem, stress_pa, _STEP * float(moduli.min()), step, SOURCE)
    return _judged(found, problem, states, held), _Run(elements, faces, states)


def _judged(found: Pressed, problem: "Problem", states: "list[State]", held: Held) -> Pressed:
    """With what is to be known of its contact."""
    last = states[-1]
    touching = problem.gaps(last.pairs, last.u_m) < 0
    if not touching.any():
        return found
    how = "and hold fast" if held.contact == "stick" else "without friction"
    return replace(found, doubts=(*found.doubts, f"faces of gaps touch, {how}"))


def _with_fields(found: Pressed, run: _Run, permittivity: Mapping[str, float], orders: Orders) -> Pressed:
    """The same with the capacitance of the deformed boxes."""
    from sensorgen.solvers.contact import brick_element
    from sensorgen.solvers.contact.brick_field import Field

    bricks = run.elements.mesh.bricks
    whole = brick_element.mesh_of(bricks, np.ones(bricks.fill.shape, bool))
    cell = Field(whole, permittivity, orders)
    return with_capacitances(found, [_bounds(cell, run, s) for s in run.states])


def _bounds(cell: "Field", run: _Run, state: "State") -> Interval | None:
    """Bounds of the capacitance; gaps that are shut are held open by a little."""
    from sensorgen.solvers.contact import brick_air, brick_field

    moved = run.elements.all_nodes(state.u_m, state.inner)
    for share in _OPEN:
        u = brick_air.extended(cell.mesh, run.elements.mesh, *run.faces.opened(moved, share))
        try:
            return cell.capacitance(u)
        except brick_field.Folded:
            continue
    return None
