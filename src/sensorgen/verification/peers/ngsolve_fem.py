"""Capacitance by NGSolve: triangles or bricks that shrink towards corners; elements of high order, condensed.

Run it in a process that does not load the CAD kernel.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.solvers.electrostatics.boxes import Grid
from sensorgen.verification.peers import cells

_NONE = 1e-3  # share of the upper bound that is no lower one [-]
_ROUNDING = 1e-11  # of an energy, by its solution in double precision [-]
_BRICK = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
_SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (2, 3, 7, 6), (1, 2, 6, 5), (3, 0, 4, 7))  # of a brick


def plane(
    section: cells.PlaneSection, permittivity: Mapping[str, float], rings: int, order: int
) -> Interval | float:  # fmt: skip
    r"""Bounds [F], or the upper one alone, by elements of an order that shrink towards each corner in rings.

    .. math:: 1 / \min_\psi \int |\nabla\psi|^2 / \varepsilon \le C \le \min_u \int \varepsilon |\nabla u|^2

    with the stream function 0 at the left mirror and 1 at the right one.

    Raises
    ------
    OutOfRange
        Triangles are too slender for doubles.
    """
    import netgen.meshing as netgen
    import ngsolve as ng

    kinds, which = np.unique(cells.permittivities(section, permittivity), return_inverse=True)
    netgen_mesh = netgen.Mesh(2)
    netgen_mesh.AddPoints(np.column_stack([section.points_mm, np.zeros(len(section.points_mm))]))
    for k in range(len(kinds)):
        netgen_mesh.Add(netgen.FaceDescriptor(surfnr=k + 1, domin=k + 1, domout=0, bc=k + 1))
        netgen_mesh.AddElements(dim=2, index=k + 1, data=section.triangles[which == k].astype(np.int32), base=0)
        netgen_mesh.SetMaterial(k + 1, f"m{k}")
    for k, (name, edges) in enumerate(section.border().items()):
        netgen_mesh.AddElements(dim=1, index=k + 1, data=np.array(edges, np.int32), base=0)
        netgen_mesh.SetBCName(k, name)
    for corner in section.corners():
        netgen_mesh.AddSingularity(netgen.PointId(corner + 1), 1.0)
    mesh = ng.Mesh(netgen_mesh)
    mesh.RefineHP(rings, cells.RATIO)
    eps, unit = ng.CoefficientFunction(kinds.tolist()), EPS0_F_PER_M * M_PER_MM * section.depth_mm
    try:
        upper, lower = _energy(ng, mesh, eps, order, cells.ENDS), 1 / _energy(ng, mesh, 1 / eps, order, cells.MIRRORS)
    except ng.ngstd.NgException as error:
        raise OutOfRange(f"NGSolve, {rings} rings of order {order}: {error}") from None
    if lower < _NONE * upper:  # mirrors of textbook scenes are walls: they join those at both sides
        return upper * unit
    return Interval(lower * (1 - _ROUNDING), upper * (1 + _ROUNDING)).times(unit)


def _energy(ng: Any, mesh: Any, eps: Any, order: int, ends: tuple[str, str]) -> float:
    """Least energy of a function that is 0 at the first end and 1 at the second; unknowns within elements condensed."""
    fes = ng.H1(mesh, order=order, dirichlet="|".join(ends))
    u, v = fes.TnT()
    field = ng.GridFunction(fes)
    field.Set(ng.CF(1), definedon=mesh.Boundaries(ends[1]))
    form = ng.BilinearForm(eps * ng.grad(u) * ng.grad(v) * ng.dx, symmetric=True, condense=True).Assemble()
    residual = form.mat.CreateColVector()
    residual.data = form.mat * field.vec
    field.vec.data -= form.mat.Inverse(fes.FreeDofs(coupling=True), "sparsecholesky") * residual
    field.vec.data += form.harmonic_extension * field.vec
    return float(ng.Integrate(eps * ng.grad(field) * ng.grad(field), mesh, order=2 * order))  # 5 unless given


def boxes(grid: Grid, permittivity: Mapping[str, float], layers: int, order: int) -> float:
    """From above [F], each box of the cell with so many layers that shrink towards its edges."""
    import netgen.meshing as netgen
    import ngsolve as ng

    planes = [cells.nodes(p, layers) for p in grid.planes_mm]
    pieces = 2 * layers + 1
    fill = grid.fill.repeat(pieces, 0).repeat(pieces, 1).repeat(pieces, 2)
    shares = grid.shares.repeat(pieces, 0).repeat(pieces, 1)
    values = cells.fillings(grid, permittivity)
    eps = values[fill] * shares[:, :, None]
    kinds, which = np.unique(eps[fill > 1], return_inverse=True)
    netgen_mesh = netgen.Mesh(3)
    netgen_mesh.Add(netgen.FaceDescriptor(surfnr=1, domin=1, domout=0, bc=1))
    netgen_mesh.Add(netgen.FaceDescriptor(surfnr=2, domin=1, domout=0, bc=2))
    points: dict[tuple[int, ...], Any] = {}

    def point(at: tuple[int, ...]) -> Any:
        if at not in points:
            points[at] = netgen_mesh.Add(netgen.MeshPoint(netgen.Pnt(*(float(planes[n][k]) for n, k in enumerate(at)))))
        return points[at]

    padded = np.pad(fill, 1, constant_values=-1)
    for at, kind in zip(np.argwhere(fill > 1).tolist(), which.tolist(), strict=True):
        corners = [point(tuple(a + d for a, d in zip(at, step, strict=True))) for step in _BRICK]
        netgen_mesh.Add(netgen.Element3D(kind + 1, corners))
        x, y, z = (a + 1 for a in at)
        around = (padded[x, y, z - 1], padded[x, y, z + 1], padded[x, y - 1, z], padded[x, y + 1, z],
                  padded[x + 1, y, z], padded[x - 1, y, z])  # fmt: skip
        for side, neighbour in zip(_SIDES, around, strict=True):
            if neighbour in (0, 1):
                netgen_mesh.Add(netgen.Element2D(int(neighbour) + 1, [corners[k] for k in side]))
    netgen_mesh.SetBCName(0, "bottom")
    netgen_mesh.SetBCName(1, "top")
    for k in range(len(kinds)):
        netgen_mesh.SetMaterial(k + 1, f"m{k}")
    energy = _energy(ng, ng.Mesh(netgen_mesh), ng.CoefficientFunction(kinds.tolist()), order, cells.ENDS)
    return energy * EPS0_F_PER_M * M_PER_MM
