"""Round cells in place of square ones: displacement and rise of C under small pressure, beside elements in 3D.

Writes ``results/press_round.md``. In 3D linear elasticity on tetrahedra of order 3 deforms the cell with its air, and
potentials of order 3 give C before and after; sizes at the tip's edge are halved twice, and the limit is extrapolated.
Blunt tips: they touch as drawn, and the contact does not grow. Boxes of pillars are those of ``press3d``.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import netgen.occ as occ
import ngsolve as ng
import numpy as np
from netgen.meshing import MeshingParameters

from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design.design import make
from sensorgen.models import curved, press3d, press_round
from sensorgen.models.press_round import Elastic
from sensorgen.prediction.mesh_ladder import limit as two_meshes
from sensorgen.scene.scene import Scene
from sensorgen.solvers.electrostatics.round_bodies import solid

SOLIDS = {"etpu": Elastic(12e6, 0.45), "x60": Elastic(26e6, 0.45)}
EPS = {"x60": 4.68, "air": 1.0}
METAL = 1e7  # permittivity of conductors [-]
STRESS_PA = 2e3
SIZES_MM = (0.04, 0.02, 0.01)
FINE = 0.5  # size of the rings' triangles over the usual one
CELLS: Sequence[tuple[str, dict[str, float]]] = (
    ("cone", {"tip_mm": 0.5}),
    ("cone", {"tip_mm": 0.2}),
    ("cone", {"tip_mm": 0.5, "period_mm": 2.0}),
    ("pyramid", {"tip_mm": 0.5}),
)
HEAD = """# Round cells in place of square ones

Made by `bench/press_round.py`: displacement and rise of C at 2 kPa; `press_round` over the limit of elements in 3D - 1
(pillars: `press3d`, at 50 kPa). Structures of 0.4 mm on a film of 0.2 mm, E 12 and 26 MPa, nu 0.45.

| cell | displacement in 3D [nm] | rise in 3D [nF/m²] | displacement off by | rise off by |
|---|---|---|---|---|
"""


def solid_3d(scene: Scene, fine_mm: float) -> tuple[float, float]:
    """Displacement [m] and rise [F/m2] in 3D."""
    cell, _ = curved.cell(scene)
    whole = occ.Box(cell.low_mm, cell.high_mm)
    rest, shapes, terminals = whole, [], {}
    for piece, _ in cell.pieces:
        body = next(b for b in scene.bodies if piece in b.pieces)
        one = solid(piece) * whole
        rest = rest - one
        one.mat(f"{body.material}_{body.terminal}")
        terminals[f"{body.material}_{body.terminal}"] = body
        shapes.append(one)
    rest.mat("air")
    glued = occ.Glue([*shapes, rest])
    for face in glued.faces:
        for k, axis in enumerate("xyz"):
            for end, at in (("low", cell.low_mm[k]), ("high", cell.high_mm[k])):
                if max(abs(tuple(corner)[k] - at) for corner in face.bounding_box) < 1e-6:
                    face.name = axis + end
    tip = min(p.span("z")[0] for p, _ in cell.pieces if not p.is_constant("z"))
    sizes = MeshingParameters(maxh=0.15, grading=0.35)
    for edge in glued.edges:
        low, high = edge.parameter_interval
        if all(abs(edge.Value(t).z - tip) < 1e-6 for t in (low, high)):
            for t in np.linspace(low, high, 80):
                sizes.RestrictH(*edge.Value(t), fine_mm)
    mesh = ng.Mesh(occ.OCCGeometry(glued).GenerateMesh(sizes))
    mesh.Curve(3)
    slope, moved = deformed(mesh, terminals)
    at_rest = energy(mesh, terminals)
    mesh.SetDeformation(moved)
    rise = energy(mesh, terminals) - at_rest
    area = np.prod(np.subtract(cell.high_mm, cell.low_mm)[:2])
    return slope, float(rise / area * EPS0_F_PER_M / M_PER_MM)


def deformed(mesh: Any, terminals: dict[str, Any]) -> tuple[float, Any]:
    """Mean displacement of the top [m], and that of the whole cell, harmonic in the air [mm]."""
    solids = mesh.Materials("|".join(terminals))
    sides = {"dirichletx": "xlow|xhigh", "dirichlety": "ylow|yhigh"}
    held = {key: f"{value}|zlow" for key, value in sides.items()}
    space = ng.VectorH1(mesh, order=3, definedon=solids, dirichletz="zlow", **held)
    u, v = space.TnT()

    def strain(w: Any) -> Any:
        return (ng.Grad(w) + ng.Grad(w).trans) / 2

    laws = {name: SOLIDS[body.material] for name, body in terminals.items()}
    mu = mesh.MaterialCF({n: s.youngs_modulus_pa / (2 + 2 * s.poisson_ratio) for n, s in laws.items()}, default=0)
    ratio = mesh.MaterialCF({n: 2 * s.poisson_ratio / (1 - 2 * s.poisson_ratio) for n, s in laws.items()}, default=0)
    work = 2 * mu * ng.InnerProduct(strain(u), strain(v)) + mu * ratio * ng.div(u) * ng.div(v)
    form = ng.BilinearForm(work * ng.dx(definedon=solids), symmetric=True).Assemble()
    top = mesh.Boundaries("zhigh")
    load = ng.LinearForm(-STRESS_PA * v[2] * ng.ds(definedon=top)).Assemble()
    own = ng.GridFunction(space)
    own.vec.data = form.mat.Inverse(space.FreeDofs(), "sparsecholesky") * load.vec
    down = -ng.Integrate(own[2], mesh, definedon=top) / ng.Integrate(1, mesh, definedon=top)
    every = ng.VectorH1(mesh, order=3, **sides)
    moved = ng.GridFunction(every)
    moved.Set(own, definedon=solids)
    free = ng.BitArray(every.FreeDofs())
    free &= ~every.GetDofs(solids)
    p, q = every.TnT()
    air = ng.InnerProduct(ng.Grad(p), ng.Grad(q)) * ng.dx(definedon=mesh.Materials("air"))
    stiff = ng.BilinearForm(air, symmetric=True).Assemble()
    left = (-stiff.mat * moved.vec).Evaluate()
    moved.vec.data += stiff.mat.Inverse(free, "sparsecholesky") * left
    return float(down * M_PER_MM), moved


def energy(mesh: Any, terminals: dict[str, Any]) -> float:
    """Of the potential, 1 on the top, over eps0 [mm]."""
    eps = {name: METAL if body.terminal else EPS[body.material] for name, body in terminals.items()}
    value = mesh.MaterialCF(eps | {"air": EPS["air"]})
    space = ng.H1(mesh, order=3, dirichlet="zlow|zhigh")
    u, v = space.TnT()
    form = ng.BilinearForm(value * ng.grad(u) * ng.grad(v) * ng.dx, symmetric=True).Assemble()
    found = ng.GridFunction(space)
    found.Set(1, definedon=mesh.Boundaries("zhigh"))
    left = (-form.mat * found.vec).Evaluate()
    found.vec.data += form.mat.Inverse(space.FreeDofs(), "sparsecholesky") * left
    return float(ng.Integrate(value * ng.grad(found) ** 2, mesh))


def limit(values: Sequence[float]) -> float:
    """Where three meshes lead (Aitken), at most as far again as the last two differ."""
    a, b, c = values
    ratio = min(max((c - b) / (b - a), 0.0), 0.5)
    return c + (c - b) * ratio / (1 - ratio)


def rings(scene: Scene, stress_pa: float) -> tuple[float, float]:
    """Displacement [m] and rise [F/m2] by rings."""
    found = press_round.press(
        scene, SOLIDS, [0.0, stress_pa, 2 * stress_pa], EPS, fineness=press_round.USUAL.scaled(FINE)
    )
    before, after, _ = (c.middle() for c in found.capacitance_f_per_m2 if c)
    return float(found.displacement_m[1]), after - before


def main() -> None:
    rows = []
    for shape, more in CELLS:
        scene = make({"shape": shape, "parameters": more}).in_use
        down, rise = (limit(values) for values in zip(*(solid_3d(scene, size) for size in SIZES_MM), strict=True))
        rows.append((shape + "".join(f", {k} {v:g}" for k, v in more.items()), down, rise, *rings(scene, STRESS_PA)))
        print(rows[-1], flush=True)
    scene = make({"shape": "pillar", "parameters": {"length_mm": 1.25, "width_mm": 1.25}}).in_use
    stress = [0.0, 2.5e4, 5e4]
    fine, coarse = (
        press3d.press(press3d.cell(scene), SOLIDS, stress, EPS, fineness=press3d.BrickCounts(n)) for n in (3, 2)
    )
    boxes = two_meshes(fine, coarse, 3)
    rows.append(("pillar", float(boxes.found.displacement_m[2]), float(boxes.rise_f_per_m2[2]), *rings(scene, 5e4)))
    lines = [
        f"| {name} | {down * 1e9:.4g} | {rise * 1e9:.4g} | {own / down - 1:+.1%} | {more / rise - 1:+.1%} |\n"
        for name, down, rise, own, more in rows
    ]
    (Path(__file__).parent / "results" / "press_round.md").write_text(HEAD + "".join(lines), "utf-8")


if __name__ == "__main__":
    main()
