"""Rise of the capacitance of printed cells without contact, by NGSolve: writes tests/reference/rise_other.json.

A second program beside press2d, which shares no line with it: neo-Hookean plane strain with displacements of order 4
and pressures of order 3, air carried along by Laplace's equation, a potential of order 5 on the deformed mesh, elements
of 5 um at every corner. The scenes are those of tests/reference/rise.json whose gaps stay open: periods of 2 mm,
printed with Arachne's walls, under an even pressure. Two minutes.
"""

import json
from itertools import pairwise
from math import ceil
from pathlib import Path

import ngsolve as ng
import numpy as np
import shapely
from netgen.geom2d import SplineGeometry

FOLDER = Path(__file__).parents[1] / "tests" / "reference"
MODULUS = {"top": 22e6, "bottom": 22e6, "x60": 6e6}  # Pa
NU, EPS, EPS0_F_PER_M = 0.4999, {"x60": 4.68, "air": 1.00059}, 8.8541878128e-12
LONGEST_PA = 4e4
CORNER_MM = 5e-3  # size of elements at corners


def section(piece):
    """Of a prism along y, or a box whose plan is given, square to y [mm]."""
    if piece["axis"] == "y":
        return shapely.Polygon(piece["outline"])
    x = [corner[0] for corner in piece["outline"]]
    return shapely.box(min(x), piece["start_mm"], max(x), piece["end_mm"])


def mesh_of(scene, period):
    """Mesh of half a period between mirrors [mm], its materials named by terminal or material, and air."""
    named = [
        (body["terminal"] or body["material"], section(piece))
        for body in scene["bodies"] for piece in body["pieces"]
    ]  # fmt: skip
    half, high = period / 2, max(part.bounds[3] for _, part in named)
    named = [(name, part & shapely.box(0, 0, half, high)) for name, part in named]
    whole = [*((name, part) for name, part in named if part.area), ("air", shapely.box(0, 0, half, high))]
    lines = shapely.set_precision(shapely.union_all([part.boundary for _, part in whole]), 1e-7)
    faces = [shapely.orient_polygons(face) for face in shapely.polygonize([shapely.node(lines)]).geoms]
    geometry, number, sides = SplineGeometry(), {}, {}
    for k, face in enumerate(faces, 1):
        inside = face.representative_point()
        geometry.SetMaterial(k, next(name for name, part in whole if part.contains(inside)))
        for ring in (face.exterior, *face.interiors):
            for a, b in pairwise(tuple(np.round(p, 7).tolist()) for p in ring.coords):
                before = sides.get((b, a))
                if before:
                    sides[b, a] = (before[0], k)
                else:
                    sides[a, b] = (k, 0)
    for edge, (left, right) in sides.items():
        for p in edge:
            number[p] = number[p] if p in number else geometry.AppendPoint(*p, maxh=CORNER_MM)
        (xa, za), (xb, zb) = edge
        wall = "side" if xa == xb and xa in (0.0, half) else "base" if za == zb == 0 else ""
        name = wall or ("roof" if abs(za - high) + abs(zb - high) < 1e-6 else "inside")
        geometry.Append(["line", *(number[p] for p in edge)], leftdomain=left, rightdomain=right, bc=name)
    return ng.Mesh(geometry.GenerateMesh(maxh=0.25, grading=0.6))


def capacitance(mesh, period):
    """Per area [F/m2], of the mesh as it is deformed."""
    space = ng.H1(mesh, order=5, definedon="x60|air|top|bottom")
    u, v = space.TnT()
    eps = mesh.MaterialCF(EPS, default=0)
    energy = ng.BilinearForm(eps * ng.grad(u) * ng.grad(v) * ng.dx("x60|air")).Assemble()
    phi = ng.GridFunction(space)
    phi.Set(1, definedon=mesh.Materials("top"))
    free = space.FreeDofs() & ~space.GetDofs(mesh.Materials("top|bottom"))
    phi.vec.data -= energy.mat.Inverse(free) @ energy.mat * phi.vec
    field = ng.Integrate(eps * ng.grad(phi) * ng.grad(phi) * ng.dx("x60|air"), mesh)
    return EPS0_F_PER_M * field / (period / 2 * 1e-3)


def rises(entry):
    """Rise at each pressure of an entry [nF/m2]."""
    period = entry["print"]["period_mm"]
    mesh = mesh_of(entry["print"], period)
    solid = "top|bottom|x60"
    e = mesh.MaterialCF(MODULUS, default=1.0)
    mu, bulk = e / (2 * (1 + NU)), e * NU / ((1 + NU) * (1 - 2 * NU))
    space = ng.VectorH1(mesh, order=4, definedon=solid, dirichlet="base", dirichletx="side") * ng.L2(
        mesh, order=3, definedon=solid
    )
    (u, p), pressure = space.TrialFunction(), ng.Parameter(0.0)
    f = ng.Id(2) + ng.Grad(u)
    j = ng.Det(f)
    form = ng.BilinearForm(space)
    shape = mu / 2 * (ng.InnerProduct(f, f) - 2) - mu * ng.log(j) + p * (j - 1) - p**2 / (2 * bulk)
    form += ng.Variation((shape * ng.dx(solid)).Compile())
    form += ng.Variation(pressure * u[1] * ng.ds("roof"))
    state = ng.GridFunction(space)
    air = ng.VectorH1(mesh, order=4, dirichletx="side")
    a, b = air.TnT()
    laplace = ng.BilinearForm(ng.InnerProduct(ng.Grad(a), ng.Grad(b)) * ng.dx("air")).Assemble()
    moved = ng.GridFunction(air)
    free = air.FreeDofs() & ~air.GetDofs(mesh.Materials(solid))
    at_rest, found, reached = capacitance(mesh, period), [], 0.0
    for kpa, _ in entry["rise_nf_per_m2"]:
        steps = ceil((1e3 * kpa - reached) / LONGEST_PA)
        for k in range(1, steps + 1):
            pressure.Set(reached + (1e3 * kpa - reached) * k / steps)
            ng.solvers.Newton(form, state, inverse="umfpack", maxit=20, maxerr=1e-9, printing=False)
        reached = 1e3 * kpa
        moved.Set(state.components[0], definedon=mesh.Materials(solid))
        moved.vec.data -= laplace.mat.Inverse(free) @ laplace.mat * moved.vec
        mesh.SetDeformation(moved)
        found.append([kpa, round(1e9 * (capacitance(mesh, period) - at_rest), 6)])
        mesh.UnsetDeformation()
    return found


def main():
    known = json.loads((FOLDER / "rise.json").read_text("utf-8"))["scenes"]
    found = []
    for number, entry in enumerate(known):
        if entry["walls"] == "arachne" and entry["top"] == "even" and "period_mm" not in entry["parameters"]:
            found.append({"scene": number, "rise_nf_per_m2": rises(entry)})
            print(
                number,
                entry["parameters"],
                entry["top"],
                found[-1]["rise_nf_per_m2"],
                entry["rise_nf_per_m2"],
                flush=True,
            )
            text = json.dumps({"origin": __doc__.partition("\n")[0], "scenes": found})
            (FOLDER / "rise_other.json").write_text(text.replace("}, {", "},\n{") + "\n")


if __name__ == "__main__":
    main()
