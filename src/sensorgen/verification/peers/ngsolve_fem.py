"""Capacitance by NGSolve: triangles refined by Zienkiewicz and Zhu's estimate, or bricks; elements of high order.

Run it in a process that does not load the CAD kernel.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.solvers.electrostatics.boxes import Grid
from sensorgen.verification.peers import cells

_ORDER = 3  # on triangles
_WORST = 0.25  # of the largest error: triangles with more are refined
_BRICK = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
_SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (2, 3, 7, 6), (1, 2, 6, 5), (3, 0, 4, 7))  # of a brick


def plane(section: cells.PlaneSection, permittivity: Mapping[str, float], unknowns: int) -> float:
    """From above [F]: triangles are refined until there are that many unknowns."""
    import netgen.meshing as netgen
    import ngsolve as ng

    values = cells.permittivities(section, permittivity)
    kinds, which = np.unique(values, return_inverse=True)
    netgen_mesh = netgen.Mesh(2)
    netgen_mesh.AddPoints(np.column_stack([section.points_mm, np.zeros(len(section.points_mm))]))
    for k in range(len(kinds)):
        netgen_mesh.Add(netgen.FaceDescriptor(surfnr=k + 1, domin=k + 1, domout=0, bc=k + 1))
        netgen_mesh.AddElements(dim=2, index=k + 1, data=section.triangles[which == k].astype(np.int32), base=0)
        netgen_mesh.SetMaterial(k + 1, f"m{k}")
    number = {tuple(p): k for k, p in enumerate(section.points_mm.tolist())}
    for k, end in enumerate(cells.ENDS):
        edges = [[number[a], number[b]] for (a, b), name in section.electrode_edges().items() if name == end]
        netgen_mesh.AddElements(dim=1, index=k + 1, data=np.array(edges, np.int32), base=0)
        netgen_mesh.SetBCName(k, end)
    mesh = ng.Mesh(netgen_mesh)
    eps = ng.CoefficientFunction(kinds.tolist())
    while True:
        energy, field, count = _solved(ng, mesh, eps, _ORDER)
        if count >= unknowns:
            return energy * EPS0_F_PER_M * M_PER_MM * section.depth_mm
        smooth = ng.GridFunction(ng.HDiv(mesh, order=_ORDER - 1))
        smooth.Set(eps * ng.grad(field))
        off = eps * ng.grad(field) - smooth
        error = ng.Integrate(off * off / eps, mesh, ng.VOL, element_wise=True).NumPy()
        mesh.ngmesh.Elements2D().NumPy()["refine"] = (error > _WORST * error.max())[: mesh.ne]
        mesh.Refine()


def _solved(ng: Any, mesh: Any, eps: Any, order: int) -> tuple[float, Any, int]:
    """Energy over that of empty space, the potential, and unknowns."""
    fes = ng.H1(mesh, order=order, dirichlet="top|bottom")
    u, v = fes.TnT()
    field = ng.GridFunction(fes)
    field.Set(ng.CF(1), definedon=mesh.Boundaries("top"))
    form = ng.BilinearForm(eps * ng.grad(u) * ng.grad(v) * ng.dx, symmetric=True).Assemble()
    residual = form.mat.CreateColVector()
    residual.data = form.mat * field.vec
    field.vec.data -= form.mat.Inverse(fes.FreeDofs(), "sparsecholesky") * residual
    energy = ng.Integrate(eps * ng.grad(field) * ng.grad(field), mesh, order=2 * order)  # 5 unless given
    return float(energy), field, fes.ndof


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
    energy, _, _ = _solved(ng, ng.Mesh(netgen_mesh), ng.CoefficientFunction(kinds.tolist()), order)
    return energy * EPS0_F_PER_M * M_PER_MM
