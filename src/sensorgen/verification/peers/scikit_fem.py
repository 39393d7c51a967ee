"""Capacitance by scikit-fem: second order; triangles refined where fluxes jump, bricks that shrink towards edges."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sensorgen.core.arrays import Real
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.solvers.electrostatics.boxes import Grid
from sensorgen.verification.peers import cells

_NEAR_MM = 1e-9
_HALF = 0.5  # share of the error that refined triangles hold


def plane(section: cells.PlaneSection, permittivity: Mapping[str, float], unknowns: int) -> float:
    """From above [F]: triangles are refined until there are that many unknowns."""
    import skfem
    from skfem.helpers import dot, grad

    values = cells.permittivities(section, permittivity)
    mesh = skfem.MeshTri(section.points_mm.T.copy(), section.triangles.T.copy())
    finder, electrodes = mesh.element_finder(), section.electrode_edges()
    while True:
        basis = skfem.Basis(mesh, skfem.ElementTriP2(), intorder=4)
        eps = values[finder(*mesh.p[:, mesh.t].mean(1))]
        weight = skfem.Basis(mesh, skfem.ElementTriP0(), intorder=4).interpolate(eps)
        matrix = skfem.BilinearForm(lambda u, v, w: w.eps * dot(grad(u), grad(v))).assemble(basis, eps=weight)
        x, fixed = _given(basis.doflocs, electrodes)
        x = skfem.solve(*skfem.condense(matrix, x=x, D=fixed))
        if unknowns <= basis.N:
            return float(x @ matrix @ x) * EPS0_F_PER_M * M_PER_MM * section.depth_mm
        error = _jumps(skfem, mesh, x, eps)
        mesh = mesh.refined(skfem.adaptive_theta(error, theta=_HALF))


def _given(places: Real, electrodes: Mapping[cells.Edge, str]) -> tuple[Real, Any]:
    """Potentials with those of the electrodes, and which of them are given."""
    x, fixed = np.zeros(places.shape[1]), np.zeros(places.shape[1], bool)
    for (a, b), end in electrodes.items():
        along = np.subtract(b, a)
        part = np.clip((places.T - a) @ along / (along @ along), 0, 1)
        here = np.hypot(*(places.T - a - part[:, None] * along).T) < _NEAR_MM
        fixed |= here
        x[here] = float(end == "top")
    return x, np.flatnonzero(fixed)


def _jumps(skfem: Any, mesh: Any, x: Real, eps: Real) -> Real:
    """Of the flux across the sides of each triangle, squared."""
    from skfem.helpers import dot, grad

    sides = [skfem.InteriorFacetBasis(mesh, skfem.ElementTriP2(), side=k, intorder=4) for k in (0, 1)]
    own = [eps[mesh.f2t[k, side.find]][:, None] for k, side in enumerate(sides)]
    jump = skfem.Functional(lambda w: w.h * dot(w.e0 * grad(w.u0) - w.e1 * grad(w.u1), w.n) ** 2)
    u0, u1 = (side.interpolate(x) for side in sides)
    flux = jump.elemental(sides[0], u0=u0, u1=u1, e0=own[0], e1=own[1])
    total = sum(np.bincount(mesh.f2t[k, sides[0].find], flux, mesh.nelements) for k in (0, 1))
    return np.asarray(total)


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
