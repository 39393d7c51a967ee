"""Cells under pressure: convergence, cheap rungs against the finite elements, and where methods fail, with pictures.

Curves are held against those of ``tests/reference/contact.json``, which other programs solved. Seconds are the
processor's. Writes ``results/press.md`` and ``docs/pictures/press-*.png``.
"""

import json
import time
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot as plt

from sensorgen.design import make
from sensorgen.models import press2d, springs
from sensorgen.models.compression import bonded
from sensorgen.models.press2d import Elastic, Fineness, Held

HERE = Path(__file__).parent
PICTURES = HERE.parent / "docs" / "pictures"
REFERENCE = json.loads((HERE.parent / "tests" / "reference" / "contact.json").read_text())
EPS = {"x60": 4.68, "air": 1.00059}
STRESSES = np.linspace(0, 1e5, 11)
BLUE, ORANGE, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "0.45"


def solids(nu=0.4999, x60=6e6, etpu=22e6):
    return {"x60": Elastic(x60, nu), "etpu": Elastic(etpu, nu)}


def tri(film_mm=0.1):
    design = make({"shape": "tri", "parameters": {"dielectric_mm": film_mm}})
    return design.in_use, press2d.cell(design.in_use, design.params.period_mm)


def timed(*args, **more):
    start = time.process_time()
    found = press2d.press(*args, **more)
    return found, time.process_time() - start


def once(cell, materials, stresses, fineness, permittivity=None):
    """One solution, without a retry on other meshes."""
    found, run = press2d._solved(cell, materials, stresses, Held(), fineness, lambda _: None)
    return press2d._with_fields(found, cell, run, permittivity) if permittivity else found


def rise(found):
    middle = np.array([c.middle() if c else np.nan for c in found.capacitance_f_per_m2]) * 2e9
    return middle - middle[0]


def reference_table():
    yield "## Against curves that other programs solved\n"
    yield "| film | loads | displacement off by at most | rise of C off by at most | bounds apart by | seconds |"
    yield "|---|---|---|---|---|---|"
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    press2d.press(tri()[1], solids(), STRESSES[:2], EPS)  # imports
    for film, colour in ((0.1, BLUE), (0.2, ORANGE)):
        known = REFERENCE[f"tri_d{film}"]
        found, seconds = timed(tri(film)[1], solids(), STRESSES, EPS)
        u, dc = found.displacement_m * 1e6, rise(found)
        off = [np.max(np.abs(a[1:] / np.array(known[k][1:]) - 1)) for a, k in ((u, "uy_um"), (dc, "dC_pF_per_m"))]
        width = max(c.width() for c in found.capacitance_f_per_m2)
        yield f"| {film} mm | 11 | {off[0]:.2%} | {off[1]:.2%} | {width:.1e} | {seconds:.1f} |"
        for ax, mine, key, error in ((axes[0], u, "uy_um", "uy_err_um"), (axes[1], dc, "dC_pF_per_m", "dC_err")):
            ax.plot(STRESSES / 1e3, mine, color=colour, label=f"press2d, film {film} mm")
            ax.errorbar(
                STRESSES / 1e3, known[key], known[error], fmt="o", ms=3, color=colour, mfc="w", label="other programs"
            )
    axes[0].set(xlabel="stress [kPa]", ylabel="displacement of the top [µm]")
    axes[1].set(xlabel="stress [kPa]", ylabel="rise of C' [pF/m]")
    axes[0].legend(frameon=False, fontsize=8)
    figure.savefig(PICTURES / "press-reference.png", dpi=130)


def convergence_table():
    yield "\n## Mesh (tri, film 0.1 mm, 100 kPa)\n"
    yield "| triangles' sizes apex / corner / far [mm] | displacement [um] | rise of C [pF/m] | seconds | said |"
    yield "|---|---|---|---|---|"
    coarse = (Fineness(2.8e-3, 0.2, 0.4, 1.0), Fineness(1.4e-3, 0.1, 0.3, 1.0), Fineness(7e-4, 0.1, 0.3, 1.0))
    for fineness in (*coarse, Fineness()):
        start = time.process_time()
        found = once(tri()[1], solids(), list(STRESSES[::2]), fineness, EPS)
        seconds = time.process_time() - start
        size = f"{fineness.apex_mm:g} / {fineness.corner_mm:g} / {fineness.coarse_mm:g}"
        said = "; ".join((*found.faults, *found.doubts))
        moved = found.displacement_m[-1] * 1e6
        yield f"| {size} | {moved:.3f} | {rise(found)[-1]:.2f} | {seconds:.1f} | {said} |"


def rungs_table():
    yield "\n## Cheap rungs against the finite elements (E 6 and 22 MPa, nu 0.4999, displacement of the top)\n"
    yield "| cell | stress [kPa] | press2d [um] | B.49 [um] | springs of columns [um] |"
    yield "|---|---|---|---|---|"
    plane = {name: s.youngs_modulus_pa / (1 - s.poisson_ratio**2) for name, s in solids().items()}
    plate = make({"shape": "reference"}).in_use
    cells = [
        ("plate, sides fixed", plate, press2d.cell(plate, None), Held(), 0.6e-3),
        ("plate, sides free, base sliding", plate, press2d.cell(plate, None), Held("sliding", "free"), 0.6e-3),
        ("tri, film 0.1 mm", *tri(0.1), Held(), 0.6e-3),
        ("tri, film 0.2 mm", *tri(0.2), Held(), 0.7e-3),
    ]
    for name, scene, cell, held, gap in cells:
        stress = np.array([0.0, 1e4, 1e5])
        found = press2d.press(cell, solids(), stress, None, held)
        columns = springs.displacement_m(scene, plane, stress)
        for k in (1, 2):
            u, simple, series = found.displacement_m[k] * 1e6, gap * stress[k] / 6e6 * 1e6, columns[k] * 1e6
            yield (
                f"| {name} | {stress[k] / 1e3:g} | {u:.4g} | {simple:.4g} ({simple / u - 1:+.0%}) "
                f"| {series:.4g} ({series / u - 1:+.0%}) |"
            )
    yield "\nStiffness of a bonded strip 10 mm wide over E (`bonded`, Gent and Lindley) against ours, incompressible:\n"
    yield "| thickness [mm] | confinement factor | finite elements | off by |"
    yield "|---|---|---|---|"
    for thick in (0.6, 0.2, 0.1):
        formula, solved = bonded(1.0, 10e-3, thick * 1e-3).modulus_pa, strip(thick)
        yield f"| {thick} | {formula:.1f} | {solved:.1f} | {formula / solved - 1:+.1%} |"


def strip(thick_mm, wide_mm=5.0, nx=120, ny=6):
    """Half of a strip, sides free, bonded to stiff plates, by mixed elements of NGSolve: stress over strain over E."""
    import ngsolve as ng
    from ngsolve.meshes import MakeStructured2DMesh

    mesh = MakeStructured2DMesh(False, nx, ny, mapping=lambda x, y: (wide_mm * x, thick_mm * y))
    space = ng.VectorH1(mesh, order=3, dirichlet="bottom|top", dirichletx="left") * ng.H1(mesh, order=2)
    (u, p), (v, q) = space.TnT()
    a = ng.BilinearForm(space)
    a += (2 / 3 * ng.InnerProduct(ng.Sym(ng.Grad(u)), ng.Sym(ng.Grad(v))) - p * ng.div(v) - q * ng.div(u)) * ng.dx
    a.Assemble()
    state = ng.GridFunction(space)
    state.components[0].Set(ng.CF((0, -1e-3 * thick_mm)), definedon=mesh.Boundaries("top"))
    residual = (-a.mat * state.vec).Evaluate()
    state.vec.data += a.mat.Inverse(space.FreeDofs(), inverse="umfpack") * residual
    energy = ng.Integrate(
        1 / 3 * ng.InnerProduct(ng.Sym(ng.Grad(state.components[0])), ng.Sym(ng.Grad(state.components[0]))), mesh
    )
    return 2 * energy / (wide_mm * thick_mm * 1e-6)


def locking_picture():
    """Cook's membrane, NGSolve's displacement elements against mixed ones: tip over nu."""
    import ngsolve as ng
    from ngsolve.meshes import MakeStructured2DMesh

    def tip(order, nu, n=8, mixed=False):
        mesh = MakeStructured2DMesh(False, n, n, mapping=lambda x, y: (48 * x, 44 * x + y * (44 - 28 * x)))
        mu = 240.565 / (2 * (1 + nu))
        over_lam = (1 + nu) * (1 - 2 * nu) / (240.565 * nu)
        vector = ng.VectorH1(mesh, order=order, dirichlet="left")
        space = vector * ng.L2(mesh, order=order - 2) if mixed else vector
        test, trial = space.TestFunction(), space.TrialFunction()
        u, v = (trial[0], test[0]) if mixed else (trial, test)
        a = ng.BilinearForm(space)
        form = 2 * mu * ng.InnerProduct(ng.Sym(ng.Grad(u)), ng.Sym(ng.Grad(v)))
        if mixed:
            form += trial[1] * ng.div(v) + test[1] * ng.div(u) - over_lam * trial[1] * test[1]
        else:
            form += ng.div(u) * ng.div(v) / over_lam
        a += form * ng.dx
        f = ng.LinearForm(space)
        f += v[1] / 16 * ng.ds("right")
        a.Assemble()
        f.Assemble()
        state = ng.GridFunction(space)
        state.vec.data = a.mat.Inverse(space.FreeDofs(), inverse="umfpack") * f.vec
        moved = state.components[0] if mixed else state
        return moved(mesh(48.0, 60.0))[1]

    poisson = np.array([0.3, 0.4, 0.45, 0.49, 0.499, 0.4999, 0.49999, 0.499999])
    figure, ax = plt.subplots(figsize=(5.4, 3.6), layout="constrained")
    fine = np.array([tip(3, nu, 12, mixed=True) for nu in poisson])
    for label, colour, order, mixed in (
        ("P1: locks", ORANGE, 1, False),
        ("P2: 3 % too stiff here", GREY, 2, False),
        ("mixed: P2 and a pressure in each triangle", BLUE, 2, True),
    ):
        ax.semilogx(
            0.5 - poisson,
            [tip(order, nu, 8, mixed) / f for nu, f in zip(poisson, fine, strict=True)],
            "o-",
            ms=3,
            color=colour,
            label=label,
        )
    ax.invert_xaxis()
    ax.set(xlabel="1/2 - Poisson's ratio [-]", ylabel="tip of Cook's membrane / fine mesh [-]", ylim=(0, 1.1))
    ax.legend(frameon=False, fontsize=8, loc="lower left")
    ax.grid(alpha=0.3)
    figure.savefig(PICTURES / "press-locking.png", dpi=130)


def shapes_picture():
    """Outlines of the pressed cell, and the gap's tip that closes."""
    cell = tri(0.1)[1]
    found = press2d.press(cell, solids(), [0.0, 5e4, 1e5], EPS)
    figure, axes = plt.subplots(1, 3, figsize=(9, 3.9), layout="constrained", sharey=True)
    for ax, outline, stress in zip(axes, found.outlines, found.stress_pa, strict=True):
        for (p, q), sides in outline.edges.items():
            names = {"air" if k and outline.regions[k - 1].material == "air" else "solid" if k else "" for k in sides}
            ax.plot(*zip(p, q, strict=True), color=ORANGE if names == {"air", "solid"} else GREY, lw=1)
        ax.set(aspect="equal", xlabel="x [mm]", title=f"{stress / 1e3:g} kPa")
    axes[0].set(ylabel="height [mm]")
    axes[0].title.set_text("0 kPa: faces of gaps in orange")
    figure.savefig(PICTURES / "press-shapes.png", dpi=130)


def main():
    lines = ["# Cells under pressure", "", "Made by `bench/press.py`.", ""]
    for table in (reference_table, convergence_table, rungs_table):
        lines += table()
    (HERE / "results" / "press.md").write_text("\n".join(lines) + "\n")
    for picture in (locking_picture, shapes_picture):
        picture()


if __name__ == "__main__":
    main()
