"""Four more places where a plausible way fails, beside the one that is used: ``docs/pictures/stability-*.png``.

Iterations that stop early, air wedges that close, a thin film between stiff plates, and a gap that closes fully. The
other places have their pictures from ``cells_pictures.py`` and ``press.py``. Takes about a minute.
"""

from collections.abc import Iterator

import numpy as np
import skfem
from cells_pictures import BLUE, EPS, EPS0_F_PER_M, GREEN, GREY, ORANGE, PICTURES, plt, uniform
from press import solids
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from sensorgen.design.shapes import rect, tri
from sensorgen.models import fem2d, fem3d, press2d, press3d, springs
from sensorgen.models.compression import bonded
from sensorgen.scene.scene import Body, Fill, Scene, box

M_PER_MM = 1e-3
NU = 0.4999
EASY = 1e-3  # change from one iteration to the next at which many a program takes a solution for converged [-]


def stopped() -> None:
    """Rect by finite volumes and conjugate gradients: what charge and energy say on the way."""
    scene = rect.scene(rect.Params(length_mm=2.0, width_mm=2.0, dielectric_mm=0.1), Fill())
    matrix, into, one, cells = volumes(scene)
    exact = one - into @ splu(matrix.tocsc()).solve(into)
    ours = fem3d.capacitance(scene, EPS, 1e-3)
    figure, axis = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for label, colour, scale in (
        ("no preconditioner", ORANGE, np.ones(len(into))),
        ("divided by the diagonal", GREEN, matrix.diagonal()),
    ):
        energy, charge = np.array(list(iterates(matrix, into, one, scale, 600))).T / exact
        done = np.flatnonzero(np.abs(np.diff(charge)) < EASY * np.abs(charge[1:]))
        done = done[done > 2][0] + 1
        axis.semilogx(np.arange(1, 601), energy, color=colour, label=f"{label}: energy")
        axis.semilogx(np.arange(1, 601), charge, "--", color=colour, label=f"{label}: charge")
        stops = f"taken for done at {done + 1}: {charge[done] - 1:+.1%}"
        axis.plot(done + 1, charge[done], "o", ms=8, mfc="none", color=colour, label=stops)
    low, high = (bound / (exact * cells * EPS0_F_PER_M) for bound in (ours.lower, ours.upper))
    axis.axhspan(low, high, color=BLUE, label=f"fem3d, direct: bounds {ours.width():.0e} apart")
    axis.set(
        xlabel="iterations [-]", ylabel="C over that of the same grid, solved fully [-]", ylim=(0, 2), xlim=(4, 600)
    )
    axis.legend(fontsize=8, loc="upper right")
    save(figure, "stopped")


def volumes(scene: Scene) -> tuple[csr_array, np.ndarray, float, float]:
    """Finite volumes on a graded grid: matrix, what flows in from the top at 1 V, its own share, cells per sensor.

    All over eps0 [m].
    """
    bricks = press3d.cell(scene).cut(8, 0.4)
    code = np.array([{"": 0, "top": 1, "bottom": 2}[r.terminal] for r in bricks.regions])[bricks.fill]
    eps = np.array([EPS.get(r.material, 1.0) for r in bricks.regions])[bricks.fill]
    free = np.full(code.shape, -1)
    free[code == 0] = np.arange((code == 0).sum())
    edges = [np.diff(p) for p in bricks.planes_m]
    rows, columns, values, into, one = [], [], [], np.zeros((code == 0).sum()), 0.0
    for axis in range(3):
        a, b = ([slice(None)] * 3, [slice(None)] * 3)
        a[axis], b[axis] = slice(None, -1), slice(1, None)
        a, b = tuple(a), tuple(b)
        shape = [-1 if k == axis else 1 for k in range(3)]
        half = np.where(code == 0, edges[axis].reshape(shape) / 2 / eps, 0.0)
        across = [edges[k].reshape([-1 if n == k else 1 for n in range(3)]) for k in range(3) if k != axis]
        series = half[a] + half[b]
        g = np.where(series > 0, across[0] * across[1] / np.where(series > 0, series, 1.0), 0.0)
        for here, there in ((a, b), (b, a)):
            inside = code[here] == 0
            both, top = inside & (code[there] == 0), inside & (code[there] == 1)
            rows += [free[here][inside], free[here][both]]
            columns += [free[here][inside], free[there][both]]
            values += [g[inside], -g[both]]
            np.add.at(into, free[here][top], g[top])
            one += g[top].sum()
    matrix = csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))))
    width, depth = (np.ptp(p) for p in bricks.planes_m[:2])
    return matrix, into, one, scene.size_mm[0] * scene.size_mm[1] * M_PER_MM**2 / (width * depth)


def iterates(matrix: csr_array, into: np.ndarray, one: float, scale: np.ndarray, most: int) -> Iterator[tuple]:
    """Energy of the potential, and charge on the bottom, after each turn of conjugate gradients; over eps0 [m]."""
    x = np.zeros_like(into)
    residual, bottom = into.copy(), matrix @ np.ones_like(into) - into
    way = direction = residual / scale
    for _ in range(most):
        pushed = matrix @ direction
        share = (residual @ way) / (direction @ pushed)
        x, before = x + share * direction, residual @ way
        residual = residual - share * pushed
        way = residual / scale
        direction = way + (residual @ way) / before * direction
        yield one - 2 * into @ x + x @ (matrix @ x), bottom @ x


def slivers() -> None:
    """Error and width as the lower triangles grow to meet the hanging ones, and the air becomes a sliver."""
    air = np.geomspace(0.4, 1e-6, 18)
    ours, even = [], []
    for apart in air:
        scene = tri.scene(
            tri.Params(length_mm=2.0, width_mm=1.0, dielectric_mm=0.1, lower_height_mm=0.5 - apart), Fill()
        )
        ours.append(fem2d.capacitance(scene, EPS, 1e-4).times(1 / M_PER_MM))
        even.append([c for _, c in uniform(scene, skfem.ElementTriP2(), 4)][-1])
    middle = np.array([i.middle() for i in ours])
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 3.8), layout="constrained")
    left.semilogx(air, middle * 1e12, "o-", ms=3, color=BLUE, label="fem2d")
    left.semilogx(air, np.array(even) * 1e12, "s-", ms=3, color=ORANGE, label="P2, even mesh")
    left.set(ylabel="C' [pF/m]")
    right.loglog(air, [i.width() for i in ours], "o-", ms=3, color=BLUE, label="fem2d: width of the interval")
    right.loglog(air, np.array(even) / middle - 1, "s-", ms=3, color=ORANGE, label="P2, even mesh: error")
    right.axhline(1e-4, color=GREY, ls=":", label="asked for")
    right.set(ylabel="relative [-]", ylim=(1e-6, 1))
    for axis in (left, right):
        axis.set(xlabel="height of the air between the flanks [mm]")
        axis.invert_xaxis()
        axis.legend(frameon=False, fontsize=8)
    save(figure, "slivers")


def film() -> None:
    """How stiff a film between stiff plates is, 10 mm wide, nu 0.4999: by three kinds of elements, and closed forms."""
    thick = np.geomspace(2.0, 0.05, 8)
    figure, axis = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for label, style, order, mixed in (
        ("P1: locks", ("o-", ORANGE), 1, False),
        ("P2", ("s-", GREEN), 2, False),
        ("P3 and a pressure", ("D-", BLUE), 3, True),
    ):
        found = [strip(t, order, mixed) for t in thick]
        axis.loglog(thick, found, style[0], ms=3.5, color=style[1], label=label)
    formula = [bonded(1.0, 10e-3, t * 1e-3).modulus_pa for t in thick]
    axis.loglog(thick, formula, "k:", label="Gent and Lindley, incompressible")
    axis.axhline(confined(NU), color="k", ls="--", lw=1, label="without end, nu 0.4999")
    axis.axhline(1, color=GREY, label="E alone (B.49)")
    axis.set(xlabel="thickness of the film [mm]", ylabel="stiffness over E [-]")
    axis.set_xticks([2, 1, 0.5, 0.2, 0.1, 0.05], ["2", "1", "0.5", "0.2", "0.1", "0.05"])
    axis.minorticks_off()
    axis.invert_xaxis()
    axis.legend(frameon=False, fontsize=8, loc="lower right", bbox_to_anchor=(1, 0.06))
    save(figure, "film")


def confined(nu: float) -> float:
    """Stiffness of a film without end over E, which gives way by its bulk alone."""
    return (1 - nu) / ((1 + nu) * (1 - 2 * nu))


def strip(thick_mm: float, order: int, mixed: bool, wide_mm: float = 5.0) -> float:
    """Half of a strip, sides free, bonded to stiff plates: stress over strain over E."""
    import ngsolve as ng
    from ngsolve.meshes import MakeStructured2DMesh

    mesh = MakeStructured2DMesh(False, 60, 4, mapping=lambda x, y: (wide_mm * x, thick_mm * y))
    vector = ng.VectorH1(mesh, order=order, dirichlet="bottom|top", dirichletx="left")
    space = vector * ng.H1(mesh, order=order - 1) if mixed else vector
    trial, test = space.TnT()
    (u, p), (v, q) = (trial, test) if mixed else ((trial, 0), (test, 0))
    mu, lam = 1 / (2 * (1 + NU)), NU / ((1 + NU) * (1 - 2 * NU))
    shear = 2 * mu * ng.InnerProduct(ng.Sym(ng.Grad(u)), ng.Sym(ng.Grad(v)))
    bulk = p * ng.div(v) + q * ng.div(u) - p * q / lam if mixed else lam * ng.div(u) * ng.div(v)
    form = ng.BilinearForm((shear + bulk) * ng.dx).Assemble()
    state = ng.GridFunction(space)
    moved = state.components[0] if mixed else state
    moved.Set(ng.CF((0, -1e-3 * thick_mm)), definedon=mesh.Boundaries("top"))
    residual = (-form.mat * state.vec).Evaluate()
    state.vec.data += form.mat.Inverse(space.FreeDofs(), inverse="umfpack") * residual
    return ng.InnerProduct(state.vec, (form.mat * state.vec).Evaluate()) / (wide_mm * thick_mm * 1e-6)


def shut() -> None:
    """A flat foot over a film: without contact it goes through, springs of columns let it down too far."""
    gap_mm = 0.02
    scene = foot(gap_mm)
    stress = np.linspace(0, 2e5, 21)
    found = press2d.press(press2d.cell(scene, 2.0), solids(), stress, EPS)
    plane = {name: s.youngs_modulus_pa / (1 - s.poisson_ratio**2) for name, s in solids().items()}
    columns = springs.displacement_m(scene, plane, stress) * 1e6
    u = found.displacement_m * 1e6
    loads, reached = stress / 1e3, found.stress_pa / 1e3
    linear = u[1] / stress[1] * stress
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 3.8), layout="constrained")
    left.plot(loads, linear, color=ORANGE, label="linear, no contact")
    left.plot(loads, columns, color=GREEN, label="springs of columns")
    left.plot(reached, u, "o-", ms=3, color=BLUE, label="press2d")
    left.axhline(gap_mm * 1e3, color=GREY, ls=":", label="height of the gap")
    left.set(xlabel="stress [kPa]", ylabel="displacement of the top [µm]", ylim=(0, 60))
    middle = np.array([c.middle() if c else np.nan for c in found.capacitance_f_per_m2]) * 1e6
    right.plot(reached, middle, "o-", ms=3, color=BLUE, label="press2d, both bounds")
    film_mm, width = 0.1, 0.4
    with np.errstate(divide="ignore"):
        series = film_mm / EPS["x60"] + (gap_mm - linear * 1e-3) / EPS["air"]
    change = EPS0_F_PER_M * width / M_PER_MM * (1 / series - 1 / series[0]) * 1e6
    shown = middle[0] + np.where(np.abs(change) < 60, change, np.nan)
    right.plot(loads, shown, color=ORANGE, label="linear: the foot as a plate above the film")
    right.set(xlabel="stress [kPa]", ylabel="C [µF/m²]", ylim=(0, 0.6))
    for axis in (left, right):
        axis.legend(frameon=False, fontsize=8)
    save(figure, "shut")


def foot(gap_mm: float) -> Scene:
    """A conducting foot 0.8 mm wide over a film of 0.1 mm, with pillars of X60 that carry the top; two periods."""
    film, lid = 0.4, 0.4 + gap_mm + 0.3
    feet = tuple(box(x - 0.4, x + 0.4, 0, 10, film + gap_mm, lid) for x in (0.5, 2.5))
    pillars = tuple(box(x - 0.3, x + 0.3, 0, 10, film, lid) for x in (1.5, 3.5))
    return Scene(
        (
            Body("bottom_electrode", "etpu", (box(0, 4, 0, 10, 0, 0.3),), "bottom"),
            Body("film", "x60", (box(0, 4, 0, 10, 0.3, film),)),
            Body("pillars", "x60", pillars),
            Body("feet", "etpu", feet, "top"),
            Body("top_electrode", "etpu", (box(0, 4, 0, 10, lid, lid + 0.3),), "top"),
        ),
        (4.0, 10.0, lid + 0.3),
    )


def save(figure, name: str) -> None:
    for axis in figure.axes:
        axis.grid(alpha=0.3)
    figure.savefig(PICTURES / f"stability-{name}.png", dpi=130)
    plt.close(figure)


def main() -> None:
    for picture in (stopped, slivers, film, shut):
        picture()


if __name__ == "__main__":
    main()
