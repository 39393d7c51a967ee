"""Virtual work of the field: how the capacitance grows under load, from one deformed cell alone, by another program.

For a motion v that takes each material along with its permittivity, the integral of eps |grad phi|^2 changes by that
of eps ((div v) |grad phi|^2 - 2 grad phi . (grad v) grad phi), with phi kept: Hadamard's formula, in its volume form.
"""

import numpy as np
import pytest

pytest.importorskip("netgen", reason="pip install 'sensorgen[fem]'")
from test_press_feet import EPS, QUICK, SOLIDS, stacked

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import press2d
from sensorgen.models.press2d import BoundaryConditions
from sensorgen.solvers.contact import closing

LOADS_PA = [0.0, 1.9e4, 2e4, 2.1e4]


def paired(outlines):
    """Edges that belong together in three outlines (k, 3, 2, 2) [mm], and the regions beside them."""
    rows = []
    for first, here, last in zip(*(o.edges for o in outlines), strict=True):
        ends = [np.array(edge) for edge in (first, here, last)]
        rows.append([e if abs(e - ends[1]).sum() < abs(e[::-1] - ends[1]).sum() else e[::-1] for e in ends])
    return np.array(rows), list(outlines[1].edges.values())


def growth(outlines, stress_pa):
    """Capacitance per area of the middle outline, and its derivative by the stress, by NGSolve."""
    import ngsolve as ng
    from netgen.geom2d import SplineGeometry

    places, beside = paired(outlines)
    regions = outlines[1].regions
    geometry, number = SplineGeometry(), {}
    filled = [k + 1 if not r.terminal else 0 for k, r in enumerate(regions)]
    ends = {k + 1: r.terminal for k, r in enumerate(regions) if r.terminal}
    for edge, sides in zip(places[:, 1], beside, strict=True):
        left, right = ([0, *filled][k] for k in sides)
        if left or right:
            for p in map(tuple, edge):
                if p not in number:
                    number[p] = geometry.AppendPoint(*p)
            name = next((ends[k] for k in sides if k in ends), "side" if 0 in sides else "inside")
            a, b = map(tuple, edge)
            geometry.Append(["line", number[a], number[b]], leftdomain=left, rightdomain=right, bc=name)
    for k, region in enumerate(regions, 1):
        geometry.SetMaterial(k, region.material)
    mesh = ng.Mesh(geometry.GenerateMesh(maxh=0.1, grading=0.3))
    eps = mesh.MaterialCF(EPS, default=0)
    space = ng.H1(mesh, order=4, dirichlet="bottom|top")
    u, w = space.TnT()
    matrix = ng.BilinearForm(eps * ng.grad(u) * ng.grad(w) * ng.dx).Assemble()
    phi = ng.GridFunction(space)
    phi.Set(1, definedon=mesh.Boundaries("top"))
    phi.vec.data -= matrix.mat.Inverse(space.FreeDofs(), inverse="umfpack") @ matrix.mat * phi.vec
    motion = carried(mesh, places, stress_pa)
    squeezed = ng.Trace(ng.grad(motion)) * (ng.grad(phi) * ng.grad(phi))
    turned = ng.grad(phi) * (ng.grad(motion) * ng.grad(phi))
    width = outlines[1].width_mm()
    whole = EPS0_F_PER_M * 1e3 / width
    return (
        whole * ng.Integrate(eps * ng.grad(phi) * ng.grad(phi), mesh),
        whole * ng.Integrate(eps * (squeezed - 2 * turned), mesh),
    )


def carried(mesh, places, stress_pa):
    """A motion per stress [mm/Pa] that is right on every edge, and smooth between."""
    import ngsolve as ng

    space = ng.VectorH1(mesh, order=1)
    motion, size = ng.GridFunction(space), mesh.nv
    at = np.array([v.point for v in mesh.vertices])
    values, fixed = np.zeros((size, 2)), np.zeros(size, bool)
    for before, here, after in places:
        along = here[1] - here[0]
        share = np.clip((at - here[0]) @ along / (along @ along), 0, 1)
        on = np.hypot(*(at - here[0] - share[:, None] * along).T) < 1e-9
        rate = (after - before) / (stress_pa[2] - stress_pa[0])
        values[on], fixed[on] = rate[0] + share[on, None] * (rate[1] - rate[0]), True
    u, w = space.TnT()
    matrix = ng.BilinearForm(ng.InnerProduct(ng.Grad(u), ng.Grad(w)) * ng.dx).Assemble()
    motion.vec.FV().NumPy()[:] = values.T.ravel()
    free = ng.BitArray(~np.tile(fixed, 2))
    motion.vec.data -= matrix.mat.Inverse(free, inverse="umfpack") @ matrix.mat * motion.vec
    return motion


def test_growth_of_the_capacitance_is_the_fields_virtual_work():
    cell, on_base = stacked(0.2, 0.3), BoundaryConditions()
    found = press2d.press(cell, SOLIDS, LOADS_PA, EPS, fineness=QUICK)
    _, run = press2d._solved(cell, SOLIDS, LOADS_PA, on_base, QUICK, lambda _: None)
    outlines = [closing.deformed(cell, run.mesh, run.problem.faces, state.u_m) for state in run.states]
    capacitance, slope = growth(outlines[1:], LOADS_PA[1:])
    before, here, after = (c.middle() for c in found.capacitance_f_per_m2[1:])
    assert capacitance == pytest.approx(here, rel=1e-3)
    assert slope == pytest.approx((after - before) / (LOADS_PA[3] - LOADS_PA[1]), rel=2e-3)
