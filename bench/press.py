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

from sensorgen.design.design import make
from sensorgen.models import press2d, springs
from sensorgen.models.compression import bonded
from sensorgen.models.press2d import BoundaryConditions, Elastic, Fineness
from sensorgen.prediction import mesh_ladder
from sensorgen.scene.scene import Body, Prism, Scene, box, rectangle
from sensorgen.scene.sections import columns, sections
from sensorgen.solvers.contact import cell as cells
from sensorgen.solvers.contact import closing, pressed

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
    found, run = press2d._solved(cell, materials, stresses, BoundaryConditions(), fineness, lambda _: None)
    return press2d._with_fields(found, cell, run, permittivity, fineness) if permittivity else found


def rise(found):
    middle = np.array([c.middle() if c else np.nan for c in found.capacitance_f_per_m2]) * 2e9
    return middle - middle[0]


def reference_table():
    yield "## Against curves that other programs solved\n"
    yield "| film | loads | displacement off by at most | rise of C off by at most | relative width of C | seconds |"
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


def moved(name, materials, fineness, stresses=STRESSES):
    """A row: displacements at 10 and 100 kPa, triangles and seconds."""
    start = time.process_time()
    found, run = press2d._solved(tri()[1], materials, stresses, BoundaryConditions(), fineness, lambda _: None)
    seconds = time.process_time() - start
    u = [np.interp(p, found.stress_pa, found.displacement_m, right=np.nan) * 1e6 for p in (1e4, 1e5)]
    said = "; ".join(found.faults)
    shown = [f"{v:.3f}" if np.isfinite(v) else "not reached" for v in u]
    return f"| {name} | {shown[0]} | {shown[1]} | {len(run.problem.elements.mesh.outer)} | {seconds:.1f} | {said} |"


def mesh_table():
    yield "\n## Mesh (tri, film 0.1 mm, one size changed at a time; used: apex 1 um, 0.05 / 0.15 mm, growth 0.5)\n"
    yield "| size | displacement at 10 kPa [um] | at 100 kPa [um] | triangles | seconds | said |"
    yield "|---|---|---|---|---|---|"
    for apex in (9.0, 3.0, 1.0, 0.5):
        yield moved(f"apex {apex:g} um", solids(), Fineness(apex * 1e-3))
    for corner in (0.1, 0.025):
        yield moved(f"corners {corner:g}, far {3 * corner:g} mm", solids(), Fineness(1e-3, corner, 3 * corner))
    for growth in (0.35, 0.25):
        yield moved(f"growth {growth:g}", solids(), Fineness(growth=growth))
    yield moved("finer in all but the apex", solids(), Fineness(1e-3, 0.025, 0.075, 0.25))


def stairs(lift_mm=0.0):
    """Feet of two printed layers on a film of 0.1 mm; lifted they fall onto it and slip."""
    bars = [
        box(c - w, c + w, 0, 8, 0.4 + lift_mm + z, 0.5 + lift_mm + z)
        for c in (0.5, 2.5)
        for w, z in ((0.2, 0.0), (0.3, 0.1))
    ]
    roof = 0.6 + lift_mm
    bodies = (
        Body("bottom_electrode", "etpu", (box(0, 4, 0, 8, 0, 0.3),), "bottom"),
        Body("film", "x60", (box(0, 4, 0, 8, 0.3, 0.4),)),
        Body("feet", "x60", tuple(bars)),
        Body("top_electrode", "etpu", (box(0, 4, 0, 8, roof, roof + 0.3),), "top"),
    )
    return press2d.cell(Scene(bodies, (4.0, 8.0, roof + 0.3)), 2.0)


CELLS = {
    "tri, film 0.1 mm": lambda: tri(0.1)[1],
    "tri, film 0.2 mm": lambda: tri(0.2)[1],
    "stairs, bonded": stairs,
    "stairs, loose": lambda: stairs(0.02),
}


def off(found, other):
    """Largest difference in displacement, less the fall, and in the rise of C, at the loads that both know."""
    n = min(len(found.stress_pa), len(other.stress_pa))
    u = [(f.displacement_m[1:n] - f.fall_m) for f in (found, other)]
    c = [rise(f)[1:n] for f in (found, other)]
    known = np.isfinite(c[0] / c[1])
    return np.abs(u[0] / u[1] - 1).max(), np.abs(c[0] / c[1] - 1)[known].max(), int(known.sum())


def fineness_table():
    """Errors over the fineness, against the finest."""
    yield "\n## Fineness (10 loads to 100 kPa; off at most, against 0.35 times the sizes)\n"
    yield "| cell | sizes times | displacement off by | rise of C off by | loads with C | seconds | said |"
    yield "|---|---|---|---|---|---|---|"
    for name, made in CELLS.items():
        finest = press2d.press(made(), solids(), STRESSES, EPS, fineness=Fineness().scaled(0.35))
        for factor in (3, 2, 1.5, 1, 0.7, 0.5):
            found, seconds = timed(made(), solids(), STRESSES, EPS, fineness=Fineness().scaled(factor))
            u, c, known = off(found, finest)
            yield f"| {name} | {factor} | {u:.2%} | {c:.2%} | {known} | {seconds:.1f} | {'; '.join(found.faults)} |"


def choices_table():
    """What is not the mesh: penalty, step and apex, each varied."""
    penalty, step = pressed.penalty_pa, press2d._STEP
    yield "\n## What is not the mesh (used: penalty 60 E, steps 10 kPa, apex 1 um)\n"
    yield "| cell | varied | displacement changes by at most | rise of C by at most | said |"
    yield "|---|---|---|---|---|"
    for name, made in CELLS.items():
        used = once(made(), solids(), STRESSES, Fineness(), EPS)
        for factor in (0.5, 2):
            pressed.penalty_pa = lambda softest_pa, factor=factor: factor * penalty(softest_pa)
            yield changed_row(name, f"penalty {60 * factor:g} E", made(), used, Fineness())
            pressed.penalty_pa, press2d._STEP = penalty, step * factor / 4
            press2d._STEP = step
            if name.startswith("tri"):
                yield changed_row(name, f"apex {factor:g} um", made(), used, Fineness(factor * 1e-3))


def changed_row(name, varied, cell, used, fineness):
    found = once(cell, solids(), STRESSES, fineness, EPS)
    u, c, _ = off(found, used)
    return f"| {name} | {varied} | {u:.2%} | {c:.2%} | {'; '.join(found.faults)} |"


def method_tables():
    """Penalty and load step."""
    penalty, step = pressed.penalty_pa, press2d._STEP
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained", sharey=True)
    studies = (
        (axes[0], "penalty [MPa]", (10, 30, 60, 100, 300, 360, 1000), STRESSES, 360),
        (axes[1], "longest load step [kPa]", (2.5, 5, 10, 25, 50), [0.0, 1e5], 40),
    )
    for ax, name, values, stresses, used in studies:
        rows = []
        yield f"\n## {name[0].upper() + name[1:]} (tri, film 0.1 mm, 100 kPa, apex 3 um; used: {used})\n"
        yield f"| {name} | displacement [um] | rise of C [pF/m] | said |"
        yield "|---|---|---|---|"
        for value in values:
            if ax is axes[0]:
                pressed.penalty_pa = lambda _, value=value: value * 1e6
            else:
                press2d._STEP = value * 1e3 / 6e6
            found = once(tri()[1], solids(), stresses, Fineness(3e-3), EPS)
            pressed.penalty_pa, press2d._STEP = penalty, step
            rows.append((value, found.displacement_m[-1] * 1e6, rise(found)[-1]))
            yield f"| {value:g} | {rows[-1][1]:.3f} | {rows[-1][2]:.2f} | {'; '.join(found.faults)} |"
        x, u, c = np.array(rows).T
        known = REFERENCE["tri_d0.1"]
        for y, key, colour, label in ((u, "uy_um", BLUE, "displacement"), (c, "dC_pF_per_m", ORANGE, "rise of C'")):
            ax.semilogx(x, 100 * (y / known[key][-1] - 1), "o-", ms=3, color=colour, label=label)
        ax.axvline(used, color=GREY, lw=0.8, ls=":")
        ax.axhspan(-1, 1, color="0.93", zorder=0)
        marked = [v for v in values if ax is axes[1] or v != used]
        ax.set_xticks(marked, [f"{v:g}" for v in marked])
        ax.minorticks_off()
        ax.set(xlabel=name)
    axes[0].set(ylabel="off the reference at 100 kPa [%]")
    axes[0].legend(frameon=False, fontsize=8)
    figure.savefig(PICTURES / "press-method.png", dpi=130)


def pressed_row(name, cell, materials, stresses=STRESSES):
    found, seconds = timed(cell, materials, stresses, EPS)
    known = [c for c in found.capacitance_f_per_m2 if c]
    c = found.capacitance_f_per_m2[-1]
    grown = f"{c.middle() / known[0].middle() - 1:.1%}" if c else "not known"
    u = found.displacement_m[[1, -1]] * 1e6
    apex = f"{found.apex_m[-1] * 1e6:g}"
    said = "; ".join(found.faults)
    return (
        f"| {name} | {found.converged_pa / 1e3:g} | {u[0]:.3f} | {u[1]:.2f} | {grown} | {apex} "
        f"| {max(x.width() for x in known):.1e} | {seconds:.1f} | {said} |"
    )


RANGE_HEAD = (
    "| cell | reached [kPa] | displacement at the first load [um] | at the last [um] | C rises by "
    "| apex at the last [um] | relative width of C | seconds | said |\n|---|---|---|---|---|---|---|---|---|"
)


def moduli_table():
    yield "\n## Moduli of X60 (eTPU 22 MPa), 10 to 100 kPa\n"
    yield RANGE_HEAD
    for film in (0.1, 0.2):
        for e in (1, 2, 3, 6, 12, 30):
            yield pressed_row(f"film {film:g} mm, E {e} MPa", tri(film)[1], solids(x60=e * 1e6))
    yield "\nE of 1 MPa on meshes that differ (film 0.1 mm):\n"
    yield "| size | displacement at 10 kPa [um] | at 100 kPa [um] | triangles | seconds | said |"
    yield "|---|---|---|---|---|---|"
    for fineness in (
        Fineness(3e-3),
        Fineness(9e-3),
        Fineness(3e-3, 0.025, 0.075, 0.35),
        Fineness(5e-3, 0.025, 0.075, 0.25),
    ):
        sizes = f"apex {fineness.apex_mm * 1e3:g} um, {fineness.corner_mm:g} / {fineness.coarse_mm:g} mm, growth "
        yield moved(sizes + f"{fineness.growth:g}", solids(x60=1e6), fineness)


def angles_table():
    yield "\n## Angles, periods and films (E 6 MPa; else film 0.1, period 2, hanging height 0.5, lower one 0.24 mm)\n"
    yield RANGE_HEAD
    cases = (
        ("hanging 0.2, lower 0.1", {"hang_height_mm": 0.2, "lower_height_mm": 0.1}),
        ("hanging 0.3", {"hang_height_mm": 0.3}),
        ("hanging 1", {"hang_height_mm": 1.0}),
        ("hanging 1, lower 0.4", {"hang_height_mm": 1.0, "lower_height_mm": 0.4}),
        ("lower 0.1", {"lower_height_mm": 0.1}),
        ("lower 0.4", {"lower_height_mm": 0.4}),
        ("period 1", {"period_mm": 1.0}),
        ("period 4", {"period_mm": 4.0}),
        ("film 0.02", {"dielectric_mm": 0.02}),
    )
    for name, changed in cases:
        design = make({"shape": "tri", "parameters": {"dielectric_mm": 0.1} | changed})
        yield pressed_row(name + " mm", press2d.cell(design.in_use, design.params.period_mm), solids())


def far_table():
    yield "\n## On to 1 MPa (E 6 MPa)\n"
    yield RANGE_HEAD
    for film in (0.1, 0.2):
        yield pressed_row(f"film {film:g} mm", tri(film)[1], solids(), np.linspace(0, 1.1e6, 12))
    yield pressed_row("of the second table", other()[1], solids(), np.linspace(0, 1.1e6, 12))


OTHER = {"period_mm": 1.2, "hang_height_mm": 0.4, "lower_height_mm": 0.2, "dielectric_mm": 0.05}
OTHERS = json.loads((HERE.parent / "tests" / "reference" / "contact_other.json").read_text())


def other():
    """A cell off the published ones, with its period."""
    design = make({"shape": "tri", "parameters": OTHER})
    return design, press2d.cell(design.in_use, OTHER["period_mm"])


def stated_table():
    """What the meshes state of a cell off the published ones, against another program's solution."""
    yield "\n## Stated errors (tri, period 1.2, heights 0.4 and 0.2, film 0.05 mm)\n"
    yield "| mesh | load [kPa] | displacement [um] | another program | rise of C [pF/m] | another program | seconds |"
    yield "|---|---|---|---|---|---|---|"
    design, _ = other()
    piece = mesh_ladder.drawn(design)
    case = mesh_ladder.Case(piece, "press2d", solids(), EPS, BoundaryConditions())
    for level in range(-1, 3):
        start = time.process_time()
        found = mesh_ladder.estimated(case, [0.0, 1e4, 3e4], level, keep=False)
        seconds = time.process_time() - start
        per_m = OTHER["period_mm"] * 1e9
        for k, (load, u, c) in enumerate(zip(*(OTHERS[n] for n in ("p_kPa", "uy_um", "dC_pF_per_m")), strict=True), 1):
            shown = (
                f"{found.found.displacement_m[k] * 1e6:.3f} +- {found.displacement_error_m[k] * 1e6:.3f}",
                " to ".join(map(str, u)),
                f"{found.rise_f_per_m2[k] * per_m:.2f} +- {found.rise_error_f_per_m2[k] * per_m:.2f}",
                " to ".join(map(str, c)),
            )
            yield f"| {mesh_ladder._name('press2d', level)} | {load:g} | {' | '.join(shown)} | {seconds:.1f} |"


def rungs_table():
    yield "\n## Cheap rungs against the finite elements (E 6 and 22 MPa, nu 0.4999, displacement of the top)\n"
    yield "| cell | stress [kPa] | press2d [um] | B.49 [um] | springs of columns [um] |"
    yield "|---|---|---|---|---|"
    plane = {name: s.youngs_modulus_pa / (1 - s.poisson_ratio**2) for name, s in solids().items()}
    plate = make({"shape": "reference"}).in_use
    cells = [
        ("plate, sides fixed", plate, press2d.cell(plate, None), BoundaryConditions(), 0.6e-3),
        (
            "plate, sides free, base sliding",
            plate,
            press2d.cell(plate, None),
            BoundaryConditions("sliding", "free"),
            0.6e-3,
        ),
        ("tri, film 0.1 mm", *tri(0.1), BoundaryConditions(), 0.6e-3),
        ("tri, film 0.2 mm", *tri(0.2), BoundaryConditions(), 0.7e-3),
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
    found, run = press2d._solved(cell, solids(), [0.0, 5e4, 1e5], BoundaryConditions(), Fineness(), lambda _: None)
    outlines = [closing.deformed(cell, run.mesh, run.problem.faces, state.u_m) for state in run.states]
    figure, axes = plt.subplots(1, 3, figsize=(9, 3.9), layout="constrained", sharey=True)
    for ax, outline, stress in zip(axes, outlines, found.stress_pa, strict=True):
        for (p, q), sides in outline.edges.items():
            names = {"air" if k and outline.regions[k - 1].material == "air" else "solid" if k else "" for k in sides}
            ax.plot(*zip(p, q, strict=True), color=ORANGE if names == {"air", "solid"} else GREY, lw=1)
        ax.set(aspect="equal", xlabel="x [mm]", title=f"{stress / 1e3:g} kPa")
    axes[0].set(ylabel="height [mm]")
    axes[0].title.set_text("0 kPa: faces of gaps in orange")
    figure.savefig(PICTURES / "press-shapes.png", dpi=130)


def between_plates(high, left, right, *outlines):
    """Outlines of X60 between plates of eTPU 0.3 mm thick, ``high`` mm apart; mirrors at the ends."""
    wide, top = 4.0, 0.3 + high
    bodies = (
        Body("bottom_electrode", "etpu", (Prism("y", rectangle(0, wide, 0, 0.3), 0.0, 10.0),), "bottom"),
        Body("shape", "x60", tuple(Prism("y", tuple(o), 0.0, 10.0) for o in outlines)),
        Body("top_electrode", "etpu", (Prism("y", rectangle(0, wide, top, top + 0.3), 0.0, 10.0),), "top"),
    )
    return cells._cell(columns(sections(Scene(bodies, (wide, 10.0, top + 0.3)))[0]), left, right, mirrored=True)


def pillars(gap, count, high=0.5):
    """Half a pillar 0.45 mm wide before a mirror, or two halves ``gap`` apart."""
    period = 0.45 + gap
    bars = [rectangle(k * period + gap / 2, (k + 1) * period - gap / 2, 0.3, 0.3 + high) for k in range(3)]
    return between_plates(high, 0.5 * period, (0.5 + count / 2) * period, *bars)


def mushroom():
    """Half a stem with a brim, whose underside comes down on a post."""
    parts = ((0, 0.25, 0, 0.4), (0, 0.6, 0.4, 0.6), (0.45, 0.8, 0, 0.35))
    halves = [rectangle(a, b, 0.3 + c, 0.3 + d) for a, b, c, d in parts]
    return between_plates(0.6, 0.0, 1.0, *halves)


def upright_table():
    """Pillars that bulge into each other, and the picture of these and of a mushroom."""
    stress = np.linspace(0, 4e5, 9)
    yield "\n## Upright faces (pillars of X60, E 1 MPa, 0.45 mm wide, 0.5 high and 0.05 apart, bonded)\n"
    yield "| stress [kPa] | two pillars [um] | one before a mirror [um] | finer mesh [um] | 0.3 mm apart [um] |"
    yield "|---|---|---|---|---|"
    cases = ((pillars(0.05, 2), Fineness()), (pillars(0.05, 1), Fineness()), (pillars(0.05, 1), Fineness().finer()))
    solved = [press2d._solved(c, solids(x60=1e6), stress, BoundaryConditions(), f, lambda _: None) for c, f in cases]
    apart = once(pillars(0.3, 1), solids(x60=1e6), stress, Fineness())
    for k in range(1, len(stress)):
        moved = [f.displacement_m[k] * 1e6 for f in (*(found for found, _ in solved), apart)]
        yield f"| {stress[k] / 1e3:g} | " + " | ".join(f"{u:.2f}" for u in moved) + " |"
    brim = press2d._solved(
        mushroom(), solids(x60=1e6), np.linspace(0, 1.6e5, 9), BoundaryConditions(), Fineness(), lambda _: None
    )
    figure, axes = plt.subplots(1, 4, figsize=(9, 3.9), layout="constrained", sharey=True)
    for ax, (run, k) in zip(axes, ((solved[0][1], 2), (solved[0][1], -1), (brim[1], 2), (brim[1], -1)), strict=True):
        draw_pressed(ax, run, run.states[k])
    axes[0].set(ylabel="height [mm]")
    figure.savefig(PICTURES / "press-upright.png", dpi=130)


def draw_pressed(ax, run, state):
    """Triangles as they lie, the softest solid blue, faces orange."""
    places = run.problem.places(state.u_m) * 1e3
    softest = run.problem.elements.law.mu_pa.min()
    rubber = run.problem.elements.law.mu_pa == softest
    for corners, soft in zip(run.problem.elements.mesh.outer[:, [0, 3, 1, 4, 2, 5]], rubber, strict=True):
        ax.fill(*places[corners].T, fc="#cfe3f5" if soft else "0.9", ec="0.7", lw=0.2)
    for side in run.problem.faces.nodes:
        ax.plot(*places[side].T, color=ORANGE, lw=1)
    ax.set(aspect="equal", xlabel="x [mm]", title=f"{state.pressure_pa / 1e3:g} kPa")
    ax.locator_params(axis="x", nbins=3)


def main():
    lines = ["# Cells under pressure", "", "Made by `bench/press.py`.", ""]
    for table in (
        *(reference_table, stated_table, mesh_table, fineness_table, choices_table, method_tables),
        *(moduli_table, angles_table, upright_table, far_table, rungs_table),
    ):
        lines += table()
    (HERE / "results" / "press.md").write_text("\n".join(lines) + "\n")
    for picture in (locking_picture, shapes_picture):
        picture()


if __name__ == "__main__":
    main()
