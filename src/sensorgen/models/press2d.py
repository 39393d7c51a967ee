"""Prismatic cells under pressure: plane-strain finite elements with contact, and the capacitance of the deformed cell.

Nearly incompressible neo-Hookean solids at large strain; contact without friction or sticking. Each result is checked:
load reached, volume, penetration of faces, work equal to the energy stored.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput
from sensorgen.scene.scene import Scene
from sensorgen.solvers.contact.boundary import BoundaryConditions
from sensorgen.solvers.contact.cell import Cell
from sensorgen.solvers.contact.cell import cell_of as cell
from sensorgen.solvers.contact.mesh import Fineness, Mesh, Unmeshed, mesh_of
from sensorgen.solvers.contact.pressed import Elastic, Pressed, Run, check, compared, solve, with_capacitances

SOURCE = (
    "neo-Hookean plane strain, displacement with bubble and pressure (Crouzeix and Raviart 1973), penalty contact with "
    "frozen partners; bounds of the capacitance by Dirichlet's and Thomson's principles"
)
COST = 2

__all__ = ["BoundaryConditions", "Elastic", "Fineness", "Pressed", "cell", "compared", "press", "why_not_applicable"]

_STEP = 1 / 150  # longest load step over the least Young's modulus: 40 kPa for 6 MPa [-]
_STICKING_STEP = _STEP / 16  # the same where faces stick: how far they had slid when they touched counts [-]
_FIELD_GROWTH = 0.2  # of the triangles of the capacitance's mesh, per distance [-]
_MISFIT = 1e-3  # of a solid's area: gaps that were closed in the wrong place change more [-]
_APEX = (1.0, 3.0, 9.0)  # times the size of the triangles at an apex, the next where the finer ones do not converge [-]


def press(
    cell: Cell,
    solids: Mapping[str, Elastic],
    stress_pa: Sequence[float],
    permittivity: Mapping[str, float] | None = None,
    boundary: BoundaryConditions | None = None,
    fineness: Fineness | None = None,
    step: Callable[[float], None] | None = None,
    enough: float = 1.0,
    apex: float = 1.0,
) -> Pressed:
    """Solve a cell under pressure on its top.

    Parameters
    ----------
    cell : Cell
        From :func:`cell`.
    solids : mapping of str to Elastic
        By material.
    stress_pa : sequence of float
        Increasing pressures, from 0 on [Pa].
    permittivity : mapping of str to float, optional
        Relative permittivity by material, with "air"; without it no capacitance is computed [-].
    boundary : BoundaryConditions, optional
        Base, period, top and contact.
    fineness : Fineness, optional
        Of the mesh.
    step : callable, optional
        Called with every pressure of ``stress_pa`` that is reached [Pa].
    enough : float
        Share of the last pressure: what is sound up to there is not solved again on coarser triangles [-].
    apex : float
        Factor on the size of triangles at an apex to begin with: one of those that a solution tells [-].

    Raises
    ------
    OutOfRange
        Pressures do not increase from 0, or a boundary condition is unknown.
    MissingValue
        The mesher is not installed.
    """
    boundary, fineness = boundary or BoundaryConditions(), fineness or Fineness()
    check(stress_pa, boundary)
    told = step or (lambda _: None)
    meshes = {factor: replace(fineness, apex_mm=factor * fineness.apex_mm) for factor in _APEX if factor >= apex}
    first, run = _solved(cell, solids, stress_pa, boundary, meshes.pop(apex), told)
    best = replace(first, apex=apex)
    for factor, coarser in meshes.items():
        if not best.faults or best.sound().converged_pa >= enough * stress_pa[-1]:
            break
        again, other = _solved(cell, solids, stress_pa, boundary, coarser, told)
        if (again.converged_pa, -len(again.faults)) > (best.converged_pa, -len(best.faults)):
            both = len(first.stress_pa)
            apart = float(np.abs(again.displacement_m[1:both] / first.displacement_m[1:] - 1).max(initial=0.0))
            known = f"displacement {apart:.1%} off up to {first.converged_pa / 1e3:.4g} kPa"
            size = f"triangles of {coarser.apex_mm * 1e3:.3g} um at the apex, because finer ones do not converge"
            doubt = f"{size}: {known if both > 1 else 'error not known'}"
            best, run = replace(again, doubts=(*again.doubts, doubt), apex=factor), other
    return _with_fields(best, cell, run, permittivity) if permittivity else best


def _solved(
    cell: Cell,
    solids: Mapping[str, Elastic],
    stress_pa: Sequence[float],
    boundary: BoundaryConditions,
    fineness: Fineness,
    step: Callable[[float], None],
) -> tuple[Pressed, Run[Mesh]]:
    mesh = mesh_of(cell, fineness)
    materials = [cell.regions[k - 1].material for k in mesh.region.tolist()]
    longest = _STICKING_STEP if boundary.contact == "stick" else _STEP
    found, run = solve(mesh, [solids[m] for m in materials], stress_pa, boundary, longest, SOURCE, step)
    if not cell.mirrored:
        said = "solved as if each period were followed by its mirror image: the cell is not symmetric"
        found = replace(found, doubts=(said, *found.doubts))
    return found, run


def _with_fields(found: Pressed, cell: Cell, run: Run[Mesh], permittivity: Mapping[str, float]) -> Pressed:
    """The same with the capacitance of the deformed outlines."""
    fields = [_field(cell, run, s.u_m, permittivity) for s in run.states]
    return with_capacitances(found, [c for c, _ in fields], tuple(outline for _, outline in fields))


def _field(cell: Cell, run: Run[Mesh], u_m: Real, permittivity: Mapping[str, float]) -> tuple[Interval | None, Cell]:
    """Capacitance and outlines of a deformed cell; None where no sound mesh of them was found."""
    from sensorgen.solvers.contact import deformed, plane_field

    mesh = run.mesh
    outline = deformed.deformed(cell, mesh, run.problem.faces, u_m)
    if deformed.misfit(outline, mesh, u_m) > _MISFIT:
        return None, outline
    try:
        return plane_field.capacitance(outline, permittivity, cell.width_mm() / 4, _FIELD_GROWTH), outline
    except Unmeshed:
        return None, outline


def why_not_applicable(scene: Scene) -> str | None:
    """Why this model does not apply to a scene, or None."""
    try:
        cell(scene, None)
    except BadInput as error:
        return str(error)
    return None
