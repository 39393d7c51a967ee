"""Prismatic cells under pressure: plane-strain finite elements with contact, and the capacitance of the deformed cell.

Nearly incompressible neo-Hookean solids at large strain; contact without friction or sticking. Each result is checked:
load reached, volume, penetration of faces, work equal to the energy stored.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import inf

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput
from sensorgen.core.units import M_PER_MM
from sensorgen.models import refusal
from sensorgen.scene.scene import Scene
from sensorgen.solvers.contact.boundary import BoundaryConditions
from sensorgen.solvers.contact.cell import ContactCell
from sensorgen.solvers.contact.cell import cell_of as cell
from sensorgen.solvers.contact.mesh import Fineness, TriangleMesh, mesh_of, pinches
from sensorgen.solvers.contact.mesher import Unmeshed
from sensorgen.solvers.contact.pressed import (
    Elastic,
    LoadSteps,
    Pressed,
    check,
    compared,
    joined,
    solve,
    with_capacitances,
)

SOURCE = (
    "neo-Hookean plane strain, displacement with bubble and pressure (Crouzeix and Raviart 1973), penalty contact with "
    "frozen partners; bounds of the capacitance by Dirichlet's and Thomson's principles"
)
COST = 2

__all__ = ["BoundaryConditions", "Elastic", "Fineness", "Pressed", "cell", "compared", "press", "why_not_applicable"]

_STEP = 1 / 150  # longest load step over the least Young's modulus: 40 kPa for 6 MPa [-]
_STICKING_STEP = _STEP / 16  # the same where faces stick: how far they had slid when they touched counts [-]
# Of the capacitance's mesh: growth of its triangles over that of the solids' mesh [-], and rings around corners
_SHARP_FIELD, _BLUNT_FIELD = (0.4, 6), (0.5, 3)
_UM = 1e-3  # in mm
_MISFIT = 1e-3  # of a solid's area: gaps that were closed in the wrong place change more [-]
_APEX = (1.0, 3.0, 9.0, 20.0)  # times the size of the triangles at an apex, the next where pressure folds the finer [-]
_FOLDS = 0.04  # pressure over least modulus and growth that folds triangles of 1 um at an apex; 0.045 was seen [-]
_FOLDS_POWER = 0.85  # of their size


def press(
    cell: ContactCell,
    solids: Mapping[str, Elastic],
    stress_pa: Sequence[float],
    permittivity: Mapping[str, float] | None = None,
    boundary: BoundaryConditions | None = None,
    fineness: Fineness | None = None,
    step: Callable[[float], None] | None = None,
) -> Pressed:
    """Solve a cell under pressure on its top.

    The triangles at an apex grow with the pressure, which folds small ones and makes their size matter less. Which size
    a pressure has does not depend on the others that are asked for.

    Parameters
    ----------
    cell : ContactCell
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

    Raises
    ------
    OutOfRange
        Pressures do not increase from 0, or a boundary condition is unknown.
    MissingValue
        The mesher is not installed.
    """
    boundary, fineness = boundary or BoundaryConditions(), fineness or Fineness()
    check(stress_pa, boundary)
    if not pinches(cell):
        part, run = _solved(cell, solids, stress_pa, boundary, fineness, step)
        return joined([_with_fields(part, cell, run, permittivity, fineness) if permittivity else part], stress_pa[-1])
    least_pa = min(solid.youngs_modulus_pa for solid in solids.values())
    parts: list[Pressed] = []
    left, failed = np.array(stress_pa[1:], float), False
    for factor in _APEX:
        sizes = replace(fineness, apex_mm=factor * fineness.apex_mm)
        folds_pa = inf if factor == _APEX[-1] else _folds_pa(sizes, least_pa)
        loads = left[left <= folds_pa].tolist()
        if loads:
            part, run = _solved(cell, solids, [0.0, *loads], boundary, sizes, step)
            part = _of_size(part, sizes.apex_mm, finer_failed=failed, largest=folds_pa == inf)
            parts.append(_with_fields(part, cell, run, permittivity, sizes) if permittivity else part)
            reached = len(part.stress_pa) - 1
            left, failed = left[reached:], reached < len(loads)
    return joined(parts, stress_pa[-1])


def _folds_pa(sizes: Fineness, least_pa: float) -> float:
    """Pressure that folds triangles at an apex [Pa]."""
    return float(_FOLDS * (sizes.apex_mm / _UM) ** _FOLDS_POWER * sizes.growth * least_pa)


def _of_size(part: Pressed, apex_mm: float, *, finer_failed: bool, largest: bool) -> Pressed:
    """A part of a curve with the size of its triangles at the apex, and with a doubt where finer ones failed.

    Of all but the largest, what is not sound is left to larger ones.
    """
    part = part if largest else replace(part.some(range(part.sound_loads())), faults=())
    part = replace(part, apex_m=(apex_mm * M_PER_MM,) * len(part.stress_pa))
    if not finer_failed or len(part.stress_pa) == 1:
        return part
    size = f"triangles of {apex_mm / _UM:.3g} um at the apex from {part.stress_pa[1] / 1e3:.4g} kPa on"
    return replace(part, doubts=(*part.doubts, f"{size}, because finer ones do not converge"))


def _solved(
    cell: ContactCell, solids: Mapping[str, Elastic], stress_pa: Sequence[float], boundary: BoundaryConditions,
    fineness: Fineness, step: Callable[[float], None] | None = None,
) -> tuple[Pressed, LoadSteps[TriangleMesh]]:  # fmt: skip
    mesh = mesh_of(cell, fineness)
    materials = [cell.regions[k - 1].material for k in mesh.region.tolist()]
    longest = _STICKING_STEP if boundary.contact == "stick" else _STEP
    pressed, run = solve(mesh, [solids[m] for m in materials], stress_pa, boundary, longest, SOURCE, step)
    if not cell.mirrored:
        remark = "solved as if each period were followed by its mirror image: the cell is not symmetric"
        pressed = replace(pressed, doubts=(remark, *pressed.doubts))
    return pressed, run


def _with_fields(
    pressed: Pressed, cell: ContactCell, run: LoadSteps[TriangleMesh], permittivity: Mapping[str, float],
    fineness: Fineness,
) -> Pressed:  # fmt: skip
    """Add the capacitance of the deformed outlines.

    Where no gap ends in an apex, the mesh as drawn is carried along until a gap closes: its errors cancel in the rise.
    """
    from sensorgen.solvers.contact import closing, plane_field
    from sensorgen.solvers.contact.plane_field import Carried

    mesh, sharp = run.mesh, bool(pressed.apex_m)
    share, rings = _SHARP_FIELD if sharp else _BLUNT_FIELD

    def meshed(u_m: Real) -> TriangleMesh | None:
        outline = closing.deformed(cell, mesh, run.problem.faces, u_m)
        if closing.misfit(outline, mesh, u_m) > _MISFIT:
            return None
        try:
            return plane_field.meshed(outline.without_block(), cell.width_mm() / 4, share * fineness.growth, rings)
        except Unmeshed:
            return None

    def bounds(field: TriangleMesh | None) -> Interval | None:
        try:
            return plane_field.capacitance(cell, field, permittivity) if field else None
        except Unmeshed:
            return None

    displacements = [state.u_m for state in run.states[: len(pressed.stress_pa)]]
    drawn = None if sharp else meshed(displacements[0])
    carried = Carried(drawn, mesh, cell) if drawn else None
    own = [carried.at(u_m) if carried else None for u_m in displacements]
    fields = [bounds(field or meshed(u_m)) for field, u_m in zip(own, displacements, strict=True)]
    return replace(with_capacitances(pressed, fields), carried=tuple(field is not None for field in own))


def why_not_applicable(scene: Scene) -> str | None:
    """Why this model does not apply to a scene, or None."""
    return refusal(BadInput, cell, scene, None)
