"""Scenes of boxes under pressure, as crossed strips: bricks at large strain, and the capacitance of the deformed cell.

Nearly incompressible neo-Hookean solids between four mirrors, with contact. The field is solved on the undeformed
boxes, the displacement being mapped into the permittivity. The checks are those of press2d.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput
from sensorgen.models import refusal
from sensorgen.scene.scene import Scene
from sensorgen.solvers.contact.boundary import BoundaryConditions
from sensorgen.solvers.contact.bricks import Bricks, bricks_of
from sensorgen.solvers.contact.mapped_field import FieldOrders
from sensorgen.solvers.contact.pressed import Elastic, LoadSteps, Pressed, check, solve, with_capacitances

if TYPE_CHECKING:
    from sensorgen.solvers.contact.bricks import BrickMesh
    from sensorgen.solvers.contact.load import State

SOURCE = (
    "neo-Hookean in 3D, bricks with 27 nodes and a linear pressure each (Q2 / P1); bounds of the capacitance by "
    "Dirichlet's and Thomson's principles on the boxes as drawn"
)
COST = 3

_STEP = 1 / 60  # longest load step over the least Young's modulus: 100 kPa for 6 MPa [-]
_MOST = 4000  # solid bricks: more would take hours
_OPEN = (1e-4, 1e-3, 1e-2, 5e-2, 0.15)  # least height of a gap in the field over that as drawn, tried in turn [-]


@dataclass(frozen=True)
class BrickCounts:
    """Into how many bricks every box is cut along each axis, how they shrink towards planes, and the field's orders."""

    pieces: int = 3
    shrink: float = 0.3
    orders: FieldOrders = field(default_factory=FieldOrders)


def why_not_applicable(scene: Scene) -> str | None:
    """Why this model does not apply to a scene, or None."""
    return refusal(BadInput, cell, scene)


def cell(scene: Scene) -> Bricks:
    """The cell of a scene of boxes, between mirrors at its four sides.

    Raises
    ------
    BadInput
        A prism is no box, bodies overlap, or the cell has too many boxes.
    """
    bricks = bricks_of(scene)
    boxes = int((bricks.fill > 0).sum())
    if boxes > _MOST:
        raise BadInput(f"its cell has {boxes} boxes; at most {_MOST} can be pressed in 3D")
    return bricks


def press(
    bricks: Bricks,
    solids: Mapping[str, Elastic],
    stress_pa: Sequence[float],
    permittivity: Mapping[str, float] | None = None,
    boundary: BoundaryConditions | None = None,
    fineness: BrickCounts | None = None,
    step: Callable[[float], None] | None = None,
) -> Pressed:
    """Solve a cell under pressure on its top.

    Parameters
    ----------
    bricks : Bricks
        From :func:`cell`.
    solids : mapping of str to Elastic
        By material.
    stress_pa : sequence of float
        Increasing pressures, from 0 on [Pa].
    permittivity : mapping of str to float, optional
        Relative permittivity by material, with "air"; without it no capacitance is computed [-].
    boundary : BoundaryConditions, optional
        Base, period ("free": in both directions), top and contact.
    fineness : BrickCounts, optional
        Of the mesh; fewer pieces, with a remark, where they would be too many.
    step : callable, optional
        Called with every pressure of ``stress_pa`` that is reached [Pa].

    Raises
    ------
    OutOfRange
        Pressures do not increase from 0, or the electrodes touch.
    BadInput
        A boundary condition is unknown, or an electrode does not cover the cell.
    """
    boundary, wanted = boundary or BoundaryConditions(), fineness or BrickCounts()
    check(stress_pa, boundary)
    most = int((_MOST / max((bricks.fill > 0).sum(), 1)) ** (1 / 3))
    fineness = replace(wanted, pieces=min(wanted.pieces, max(most, 1)))
    pressed, run = _solved(bricks.cut(fineness.pieces, fineness.shrink), solids, stress_pa, boundary, step)
    if fineness != wanted:
        remark = f"every box cut into {fineness.pieces} pieces along each axis, not {wanted.pieces}: there are many"
        pressed = replace(pressed, doubts=(*pressed.doubts, remark))
    return _with_fields(pressed, run, permittivity, fineness.orders) if permittivity else pressed


def _solved(
    cut: Bricks, solids: Mapping[str, Elastic], stress_pa: Sequence[float], boundary: BoundaryConditions,
    step: Callable[[float], None] | None,
) -> "tuple[Pressed, LoadSteps[BrickMesh]]":  # fmt: skip
    from sensorgen.solvers.contact.bricks import mesh_of

    mesh = mesh_of(cut, cut.fill > 0)
    materials = [cut.regions[k].material for k in mesh.region.tolist()]
    pressed, run = solve(mesh, [solids[m] for m in materials], stress_pa, boundary, _STEP, SOURCE, step)
    last = run.states[-1]
    if (run.problem.gaps(last.pairs, last.u_m) < 0).any():
        how = "and hold fast" if boundary.contact == "stick" else "without friction"
        pressed = replace(pressed, doubts=(*pressed.doubts, f"faces of gaps touch, {how}"))
    return pressed, run


def _with_fields(
    pressed: Pressed, run: "LoadSteps[BrickMesh]", permittivity: Mapping[str, float], orders: FieldOrders
) -> Pressed:
    """Add the capacitance of the deformed boxes; gaps that are shut are boundary open by a little."""
    from sensorgen.solvers.contact.bricks import mesh_of
    from sensorgen.solvers.contact.mapped_field import AirMap, Folded, MappedField

    solid = run.mesh
    whole = mesh_of(solid.bricks, np.ones_like(solid.bricks.fill, dtype=np.bool_))
    field, air = MappedField(whole, permittivity, orders), AirMap(whole, solid)

    def bounds(state: "State") -> Interval | None:
        moved = solid.all_nodes(state.u_m, state.inner.bubble)
        for share in _OPEN:
            try:
                return field.capacitance(air.displacements_m(moved, share))
            except Folded:
                continue
        return None

    return with_capacitances(pressed, [bounds(state) for state in run.states])
