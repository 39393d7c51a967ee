"""Both bounds of a graded cell by NGSolve, on the same triangles: a potential, and a hybrid H(div) flux."""

from collections import defaultdict
from itertools import pairwise

import numpy as np

from sensorgen.solvers.electrostatics.mesh import Cones
from sensorgen.solvers.electrostatics.plane import RATIO


def written_out(mesh: Cones) -> tuple[np.ndarray, list[tuple[int, int, int]], list[int], dict[str, list]]:
    """Every ring with points of its own: points, triangles, whose material each has, edges at the electrodes."""
    points, triangles, owners = list(mesh.triangles.points), [], []
    ends = defaultdict(list)
    spokes = {(min(c, s), max(c, s)) for c, fan in mesh.fans.items() for s in fan.spokes}
    for edge, name in mesh.triangles.terminals.items():
        if edge not in spokes:
            ends[name].append(edge)
    for n in mesh.plain:
        triangles.append(mesh.triangles.triangles[n])
        owners.append(n)
    for corner, fan in mesh.fans.items():
        rims = [list(fan.spokes)]
        for k in range(1, 2 ** mesh.doublings[corner] + 1):
            rims.append(list(range(len(points), len(points) + len(fan.spokes))))
            here = mesh.triangles.points[corner]
            points += [here + RATIO**k * (mesh.triangles.points[s] - here) for s in fan.spokes]
        for number, a in zip(fan.members, range(len(fan.members)), strict=True):
            b = (a + 1) % len(fan.spokes)
            for outer, inner in pairwise(rims):
                triangles += [(outer[b], inner[b], outer[a]), (inner[b], inner[a], outer[a])]
            triangles.append((corner, rims[-1][a], rims[-1][b]))
            owners += [number] * (2 * len(rims) - 1)
        for k, spoke in enumerate(fan.spokes):
            if name := mesh.triangles.terminals.get((min(corner, spoke), max(corner, spoke))):
                chain = [*(rim[k] for rim in rims), corner]
                ends[name] += pairwise(chain)
    return np.array(points), triangles, owners, ends


def bounds(mesh: Cones, permittivity: dict[str, float], order: int) -> tuple[float, float]:
    """By Thomson's and by Dirichlet's principle, per depth of one cell and over eps0 [-]."""
    import ngsolve as ng

    space, eps = _space(mesh, permittivity)
    fes = ng.H1(space, order=order, dirichlet="top|bottom")
    u, v = fes.TnT()
    found = ng.GridFunction(fes)
    found.Set(ng.CF(1), definedon=space.Boundaries("top"))
    _solve(ng.BilinearForm(eps * ng.grad(u) * ng.grad(v) * ng.dx, symmetric=True, condense=True), found)
    upper = ng.Integrate(eps * ng.grad(found) * ng.grad(found), space, order=2 * order + 2)
    return _flux(space, eps, order - 1), upper


def _space(mesh: Cones, permittivity: dict[str, float]):
    import netgen.meshing as netgen
    import ngsolve as ng

    points, triangles, owners, ends = written_out(mesh)
    materials = sorted(permittivity)
    region = np.array([materials.index(mesh.triangles.regions[n][0]) for n in owners])
    made = netgen.Mesh(2)
    made.AddPoints(np.column_stack([points, np.zeros(len(points))]))
    for number, name in enumerate(materials, 1):
        made.Add(netgen.FaceDescriptor(surfnr=number, domin=number, domout=0, bc=number))
        here = np.ascontiguousarray(np.array(triangles, np.int32)[region == number - 1])
        made.AddElements(dim=2, index=number, data=here, base=0)
        made.SetMaterial(number, name)
    for number, name in enumerate(("bottom", "top")):
        made.AddElements(dim=1, index=number + 1, data=np.array(ends[name], np.int32), base=0)
        made.SetBCName(number, name)
    return ng.Mesh(made), ng.CoefficientFunction([permittivity[name] for name in materials])


def _flux(space, eps, order: int) -> float:
    """Thomson's functional of the flux at which it is most."""
    import ngsolve as ng

    flux = ng.HDiv(space, order=order, discontinuous=True, hodivfree=True)
    facet = ng.FacetFESpace(space, order=order, dirichlet="top|bottom")
    fes = flux * ng.L2(space, order=0) * facet
    (d, q, w), (e, r, z) = fes.TnT()
    normal = ng.specialcf.normal(2)
    form = ng.BilinearForm(fes, symmetric=True, condense=True)
    form += -(d * e / eps - q * ng.div(e) - r * ng.div(d)) * ng.dx
    form += -(w * (e * normal) + z * (d * normal)) * ng.dx(element_boundary=True)
    found = ng.GridFunction(fes)
    found.components[2].Set(ng.CF(1), definedon=space.Boundaries("top"))
    _solve(form, found)
    field = found.components[0]
    outwards = found.components[2] * (field * normal) * ng.dx(element_boundary=True, bonus_intorder=order)
    into_top = -ng.Integrate(outwards, space)
    return 2 * into_top - ng.Integrate(field * field / eps, space, order=2 * order + 2)


def _solve(form, found) -> None:
    form.Assemble()
    residual = found.vec.CreateVector()
    inverse = form.mat.Inverse(found.space.FreeDofs(True), "sparsecholesky")
    for _ in range(2):
        residual.data = form.mat * found.vec
        found.vec.data -= inverse * residual
    found.vec.data += form.harmonic_extension * found.vec
