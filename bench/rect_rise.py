"""Displacement and rise of the capacitance of rect under a small pressure, by NGSolve on graded bricks.

A second program beside press3d: displacement of order 3 and pressure of order 2 at small strain, air carried along by
Laplace's equation, and a potential of order 4 on the deformed mesh. It shares no line with sensorgen. Writes
``tests/reference/rect_rise.json``; five minutes. ``python bench/rect_rise.py large`` adds one cell under pressures
of Table 1.1, neo-Hookean at finite strain, in steps; its gaps stay open. Bricks that shrink towards planes rise by 13 %
more there than even ones, whose corners are too stiff.
"""

import json
import sys
from itertools import pairwise
from math import ceil
from pathlib import Path

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np

FILE = Path(__file__).parents[1] / "tests" / "reference" / "rect_rise.json"
MODULUS, NU = {"bottom": 22e6, "top": 22e6, "x60": 6e6}, 0.4999  # Pa
PERMITTIVITY = {"x60": 4.68, "air": 1.00059}
PRESSURE_PA, ELECTRODE_MM, AIR_MM, ETPU_MM = 1e4, 0.3, 0.3, 0.7
EPS0_F_PER_M = 8.8541878128e-12
CELLS = (  # mm
    {"dielectric_mm": 0.1, "lower_height_mm": 0.3, "upper_height_mm": 0.3, "x60_width_mm": 0.7},
    {"dielectric_mm": 0.2, "lower_height_mm": 0.3, "upper_height_mm": 0.3, "x60_width_mm": 0.7},
    {"dielectric_mm": 0.1, "lower_height_mm": 0.4, "upper_height_mm": 0.2, "x60_width_mm": 0.9},
)
LARGE_KPA, STEP_KPA, LARGE_MESHES = (345, 700, 1103), 200, ((0, 0.3, 2), (0, 0.3, 3), (1, 0.3, 2))
MESHES = ((1, 0.3, 3), (2, 0.3, 3))  # layers at planes, how they shrink, order


def graded(planes, layers, ratio):
    """Planes with layers that shrink towards those inside."""
    found = [planes[0]]
    for k, (a, b) in enumerate(pairwise(planes)):
        half = (b - a) / 2
        left = [a + half * ratio**j for j in range(layers, 0, -1)] if k else []
        right = [b - half * ratio**j for j in range(1, layers + 1)] if k < len(planes) - 2 else []
        found += [*left, *right, b]
    return np.array(found)


def mesh_of(cell, layers, ratio):
    """A quarter of a cell, from the middle of a conductor's strip to that of a dielectric's."""
    start = ETPU_MM / 2
    across = [start, ETPU_MM, ETPU_MM + AIR_MM, ETPU_MM + AIR_MM + cell["x60_width_mm"] / 2]
    steps = [cell["dielectric_mm"], cell["lower_height_mm"], cell["upper_height_mm"], ELECTRODE_MM]
    levels = np.cumsum([0.0, ELECTRODE_MM, *steps])
    x, z = graded(across, layers, ratio), graded(levels.tolist(), layers, ratio)

    def material(at):
        strip = at[1] if at[2] < levels[3] else at[0]
        inside = "top" if strip < across[1] else "air" if strip < across[2] else "x60"
        return ["bottom", "x60", inside, inside, "top"][np.searchsorted(levels, at[2]) - 1]

    mesh, names, sides = netgen.Mesh(dim=3), ["bottom", "x60", "air", "top"], ["base", "roof", "sx", "sy"]
    at = [[[mesh.Add(netgen.MeshPoint(netgen.Pnt(a, b, c))) for c in z] for b in x] for a in x]
    faces = [mesh.Add(netgen.FaceDescriptor(surfnr=k, domin=1, bc=k)) for k in range(1, 5)]
    for k, name in enumerate(sides):
        mesh.SetBCName(k, name)
    for k, name in enumerate(names, 1):
        mesh.SetMaterial(k, name)
    n, top = len(x) - 1, len(z) - 1
    ring = ((0, 0), (1, 0), (1, 1), (0, 1))
    for i, j, k in np.ndindex(n, n, top):
        middle = [(x[i] + x[i + 1]) / 2, (x[j] + x[j + 1]) / 2, (z[k] + z[k + 1]) / 2]
        corners = [at[i + a][j + b][k + c] for c in (0, 1) for a, b in ring]
        mesh.Add(netgen.Element3D(names.index(material(middle)) + 1, corners))
    for i, j in np.ndindex(n, n):
        for face, k in ((faces[0], 0), (faces[1], top)):
            mesh.Add(netgen.Element2D(face, [at[i + a][j + b][k] for a, b in ring]))
    for i, k in np.ndindex(n, top):
        for s in (0, n):
            mesh.Add(netgen.Element2D(faces[2], [at[s][i + a][k + b] for a, b in ring]))
            mesh.Add(netgen.Element2D(faces[3], [at[i + a][s][k + b] for a, b in ring]))
    return ng.Mesh(mesh)


def displaced(mesh, order):
    """Displacement everywhere [mm], and its mean on top downwards [mm]."""
    solid = mesh.Materials("bottom|x60|top")
    held = {"dirichletx": "base|sx", "dirichlety": "base|sy", "dirichletz": "base"}
    both = ng.VectorH1(mesh, order=order, definedon=solid, **held) * ng.L2(mesh, order=order - 1, definedon=solid)
    (u, p), (v, q) = both.TnT()
    modulus = mesh.MaterialCF(MODULUS, default=1)
    mu, weak = modulus / 2 / (1 + NU), (1 + NU) * (1 - 2 * NU) / (modulus * NU)
    strain = [(ng.Grad(w) + ng.Grad(w).trans) / 2 for w in (u, v)]
    form = ng.BilinearForm(both, symmetric=True, condense=True)
    form += (2 * mu * ng.InnerProduct(*strain) + ng.div(u) * q + ng.div(v) * p - weak * p * q) * ng.dx(definedon=solid)
    load, found = ng.LinearForm(both), ng.GridFunction(both)
    load += -PRESSURE_PA * v[2] * ng.ds("roof")
    form.Assemble()
    load.Assemble()
    load.vec.data += form.harmonic_extension_trans * load.vec
    found.vec.data = form.mat.Inverse(both.FreeDofs(coupling=True), inverse="sparsecholesky") * load.vec
    found.vec.data += form.harmonic_extension * found.vec
    found.vec.data += form.inner_solve * load.vec
    return carried(mesh, order, found.components[0])


def carried(mesh, order, moved):
    """A displacement of the solids with that of the air, and its mean on top downwards [mm]."""
    roof, solid = mesh.Boundaries("roof"), mesh.Materials("bottom|x60|top")
    down = ng.Integrate(-moved[2], mesh, ng.BND, definedon=roof) / ng.Integrate(1, mesh, ng.BND, definedon=roof)
    space = ng.VectorH1(mesh, order=order, dirichletx="sx", dirichlety="sy")
    whole = ng.GridFunction(space)
    whole.Set(moved, definedon=solid)
    u, v = space.TnT()
    air = ng.BilinearForm(space, symmetric=True)
    air += ng.InnerProduct(ng.Grad(u), ng.Grad(v)) * ng.dx(definedon=mesh.Materials("air"))
    air.Assemble()
    free = space.FreeDofs() & ~unknowns(space, MODULUS)
    whole.vec.data -= air.mat.Inverse(free, inverse="sparsecholesky") * (air.mat * whole.vec)
    return whole, down


def at_large(cell, layers, ratio, order):
    """Rise and displacement [um] at each of ``LARGE_KPA``, neo-Hookean, the pressure along the first normal."""
    mesh = mesh_of(cell, layers, ratio)
    solid = mesh.Materials("bottom|x60|top")
    held = {"dirichletx": "base|sx", "dirichlety": "base|sy", "dirichletz": "base"}
    both = ng.VectorH1(mesh, order=order, definedon=solid, **held) * ng.L2(mesh, order=order - 1, definedon=solid)
    (u, p), load = both.TrialFunction(), ng.Parameter(0.0)
    modulus = mesh.MaterialCF(MODULUS, default=1)
    mu, bulk = modulus / 2 / (1 + NU), modulus * NU / ((1 + NU) * (1 - 2 * NU))
    f = ng.Id(3) + ng.Grad(u)
    j = ng.Det(f)
    energy = mu / 2 * (ng.InnerProduct(f, f) - 3) - mu * ng.log(j) + p * (j - 1) - p**2 / (2 * bulk)
    form = ng.BilinearForm(both, symmetric=True)
    form += ng.Variation(energy.Compile() * ng.dx(definedon=solid))
    form += ng.Variation(load * u[2] * ng.ds("roof"))
    free = both.FreeDofs() & unknowns(both, MODULUS)
    state, known, reached = ng.GridFunction(both), [], 0.0
    for kpa in LARGE_KPA:
        steps = ceil((kpa - reached) / STEP_KPA)
        for k in range(1, steps + 1):
            load.Set(1e3 * (reached + (kpa - reached) * k / steps))
            failed, _ = ng.solvers.Newton(form, state, free, inverse="umfpack", maxerr=1e-6, printing=False)
            if failed:
                return known
        reached = kpa
        whole, down = carried(mesh, order, state.components[0])
        nothing = ng.GridFunction(whole.space)
        at_rest, pressed = (capacitance(mesh, order + 1, moved) for moved in (nothing, whole))
        known.append({"pressure_kpa": kpa, "displacement_um": down * 1e3, "rise": pressed / at_rest - 1})
        print(known[-1], flush=True)
    return known


def unknowns(space, materials):
    """Those of elements of some materials."""
    found = ng.BitArray(space.ndof)
    found.Clear()
    for element in space.Elements(ng.VOL):
        if element.mat in materials:
            for k in element.dofs:
                found[k] = True
    return found


def capacitance(mesh, order, displacement):
    """Energy of the best potential at 1 V over eps0 [mm]."""
    space = ng.H1(mesh, order=order)
    free = unknowns(space, PERMITTIVITY) & ~unknowns(space, ("bottom", "top"))
    mesh.SetDeformation(displacement)
    u, v = space.TnT()
    form = ng.BilinearForm(space, symmetric=True)
    eps, where = mesh.MaterialCF(PERMITTIVITY, default=0), mesh.Materials("x60|air")
    form += eps * ng.grad(u) * ng.grad(v) * ng.dx(definedon=where, bonus_intorder=4)
    form.Assemble()
    potential = ng.GridFunction(space)
    potential.Set(ng.CF(1), definedon=mesh.Materials("top"))
    potential.vec.data -= form.mat.Inverse(free, inverse="sparsecholesky") * (form.mat * potential.vec)
    found = ng.InnerProduct(form.mat * potential.vec, potential.vec)
    mesh.UnsetDeformation()
    return found


def solved(cell, layers, ratio, order):
    mesh = mesh_of(cell, layers, ratio)
    displacement, down = displaced(mesh, order)
    nothing = ng.GridFunction(displacement.space)
    at_rest, pressed = (capacitance(mesh, order + 1, u) for u in (nothing, displacement))
    farad = 4 * at_rest * EPS0_F_PER_M * 1e-3
    return {"layers": layers, "displacement_um": down * 1e3, "rise": pressed / at_rest - 1, "capacitance_f": farad}


def main():
    if sys.argv[1:] == ["large"]:
        solutions = [{"layers": m[0], "order": m[2], "loads": at_large(CELLS[1], *m)} for m in LARGE_MESHES]
        whole = json.loads(FILE.read_text()) | {"large": CELLS[1] | {"meshes": solutions}}
        FILE.write_text(json.dumps(whole, indent=1) + "\n")
        return
    chosen = [int(k) for k in sys.argv[1:]] or range(len(CELLS))
    known = json.loads(FILE.read_text())["cells"] if FILE.exists() else [None] * len(CELLS)
    for k in chosen:
        known[k] = CELLS[k] | {"meshes": [solved(CELLS[k], *mesh) for mesh in MESHES]}
    about = {"pressure_pa": PRESSURE_PA, "youngs_modulus_pa": {"x60": 6e6, "etpu": 22e6}, "poisson_ratio": NU}
    large = {"large": json.loads(FILE.read_text())["large"]} if FILE.exists() else {}
    FILE.write_text(json.dumps(about | {"cells": known} | large, indent=1) + "\n")


if __name__ == "__main__":
    main()
