"""Capacitance by scikit-fem: triangles of fourth order that shrink towards corners, bricks of second towards edges."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.solvers.electrostatics.boxes import Grid
from sensorgen.verification.peers import cells

_NEAR_MM = 1e-9


def plane(section: cells.PlaneSection, permittivity: Mapping[str, float], halvings: int) -> float:
    """From above [F]: triangles of fourth order, those at corners halved so many times."""
    import skfem
    from skfem.helpers import dot, grad

    values, border = cells.permittivities(section, permittivity), section.border()
    mesh = skfem.MeshTri(section.points_mm.T.copy(), section.triangles.T.copy())
    finder, corners = mesh.element_finder(), section.corners()
    for _ in range(halvings):
        mesh = mesh.refined(np.flatnonzero(np.isin(mesh.t, corners).any(axis=0)))
    basis = skfem.Basis(mesh, skfem.ElementTriP4(), intorder=6)
    eps = values[finder(*mesh.p[:, mesh.t].mean(1))]
    weight = np.repeat(eps[:, None], basis.X.shape[1], axis=1)
    matrix = skfem.BilinearForm(lambda u, v, w: w.eps * dot(grad(u), grad(v))).assemble(basis, eps=weight)
    x, fixed = np.zeros(basis.N), []
    for end in cells.ENDS:
        here = basis.get_dofs(_on(mesh, section.points_mm[np.array(border[end])])).flatten()
        x[here] = float(end == "top")
        fixed.append(here)
    x = skfem.solve(*skfem.condense(matrix, x=x, D=np.concatenate(fixed)))
    return float(x @ matrix @ x) * EPS0_F_PER_M * M_PER_MM * section.depth_mm


def _on(mesh: Any, edges_mm: Real) -> Any:
    """Facets at the border of a mesh whose middle lies on one of some edges (n, 2, 2)."""
    facets = mesh.boundary_facets()
    middle = mesh.p[:, mesh.facets[:, facets]].mean(axis=1).T[:, None]
    first, along = edges_mm[:, 0], edges_mm[:, 1] - edges_mm[:, 0]
    part = np.clip(((middle - first) * along).sum(-1) / (along**2).sum(-1), 0, 1)
    return facets[(np.linalg.norm(middle - first - part[..., None] * along, axis=-1) < _NEAR_MM).any(axis=1)]


def boxes(grid: Grid, permittivity: Mapping[str, float], layers: int) -> float:
    """From above [F], each box of the cell with so many layers that shrink towards its edges."""
    import skfem
    from skfem.helpers import dot, grad

    mesh = skfem.MeshHex.init_tensor(*(cells.nodes(p, layers) for p in grid.planes_mm))
    at = [
        np.searchsorted(planes, middle) - 1
        for planes, middle in zip(grid.planes_mm, mesh.p[:, mesh.t].mean(1), strict=True)
    ]
    fill = grid.fill[tuple(at)]
    values = cells.fillings(grid, permittivity)
    field = np.flatnonzero(fill > 1)
    basis = skfem.Basis(mesh, skfem.ElementHex2(), elements=field, intorder=4)
    eps = (values[fill] * grid.shares[at[0], at[1]])[field]
    weight = np.repeat(eps[:, None], basis.X.shape[1], axis=1)
    matrix = skfem.BilinearForm(lambda u, v, w: w.eps * dot(grad(u), grad(v))).assemble(basis, eps=weight)
    x = np.zeros(basis.N)
    top, bottom = (basis.get_dofs(elements=np.flatnonzero(fill == k)).flatten() for k in (1, 0))
    x[top] = 1.0
    free = np.setdiff1d(basis.get_dofs(elements=field).flatten(), np.union1d(top, bottom))
    x = skfem.solve(*skfem.condense(matrix, x=x, I=free))
    return float(x @ matrix @ x) * EPS0_F_PER_M * M_PER_MM
