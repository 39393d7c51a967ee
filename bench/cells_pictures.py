"""Where ways to compute a cell's capacitance fail, beside the one that is used: ``docs/pictures/cells-*.png``.

Thin films, the mesh at an apex, voxels, and high permittivity ratios; all on the triangular cell. Exact values are
those of ``tests/reference/cells.json``. Takes about a minute.
"""

import json
from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
import numpy as np
import skfem
from expected import stairs
from scipy.sparse import coo_array
from scipy.sparse.linalg import spsolve
from skfem.helpers import dot, grad

mpl.use("Agg")
from matplotlib import pyplot as plt

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.design.shapes import tri
from sensorgen.models import columns, fem2d
from sensorgen.scene.repetition import cell
from sensorgen.scene.scene import Fill, Scene
from sensorgen.scene.sections import sections
from sensorgen.solvers.electrostatics.mesh import Cones
from sensorgen.solvers.electrostatics.plane import Plane

HERE = Path(__file__).parent
PICTURES = HERE.parent / "docs" / "pictures"
EXACT = {
    c["d"]: c["C_F_per_m"] for c in json.loads((HERE.parent / "tests/reference/cells.json").read_text("utf-8"))["tri"]
}
EPS = {"x60": 4.68, "air": 1.00059}
MM = 1e-3
RATE = 4.087e-11  # F/m that C' of the triangular cell grows by per e-fold of a thin film
BLUE, ORANGE, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "0.45"


def tri_scene(film_mm: float) -> Scene:
    """One period, 1 mm deep."""
    return tri.scene(tri.Params(length_mm=2.0, width_mm=1.0, dielectric_mm=film_mm), Fill())


def uniform(scene: Scene, element: skfem.Element, refinements: int) -> Iterator[tuple[int, float]]:
    """scikit-fem on the section's few triangles, each split in four again and again: unknowns, and C' [F/m]."""
    _, coarse = fem2d._triangles(scene)
    used, corners = np.unique(np.array(coarse.triangles), return_inverse=True)
    mesh = skfem.MeshTri(coarse.points[used].T.copy(), corners.reshape(-1, 3).T.copy())
    number = {tuple(edge): k for k, edge in enumerate(used[mesh.facets].T.tolist())}
    ends = {n: np.array([number[e] for e, end in coarse.terminals.items() if end == n]) for n in ("top", "bottom")}
    mesh = mesh.with_boundaries(ends)
    eps = np.array([EPS[material] * share for material, share in coarse.regions])
    for _ in range(refinements):
        mesh, eps = mesh.refined(), np.tile(eps, 4)
        basis = skfem.Basis(mesh, element)
        weight = basis.with_element(skfem.ElementTriP0()).interpolate(eps)
        matrix = skfem.BilinearForm(lambda u, v, w: w.eps * dot(grad(u), grad(v))).assemble(basis, eps=weight)
        held = {name: basis.get_dofs(name).all() for name in ends}
        x = basis.zeros()
        x[held["top"]] = 1.0
        x = skfem.solve(*skfem.condense(matrix, x=x, D=np.concatenate(list(held.values()))))
        yield basis.N, float(x @ matrix @ x) * EPS0_F_PER_M


def thin_films() -> None:
    """C' over the film, and its growth per e-fold."""
    films = np.geomspace(0.2, 1e-6, 17)
    fem, straight = (
        [model.capacitance(tri_scene(d), EPS, *more).times(1 / MM) for d in films]
        for model, more in ((fem2d, (1e-4,)), (columns, ()))
    )
    coarse = [list(uniform(tri_scene(d), skfem.ElementTriP2(), 3))[-1][1] for d in films]
    curves = [
        ("fem2d, both bounds", BLUE, [i.lower for i in fem], [i.upper for i in fem]),
        ("columns, both bounds", GREY, [i.lower for i in straight], [i.upper for i in straight]),
        ("P2, the same even mesh for all", ORANGE, coarse),
    ]
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 3.8), layout="constrained")
    for label, colour, *values in curves:
        values = 1e12 * np.array(values).T
        left.semilogx(films, values, "o-", ms=2.5, color=colour, label=[label] + [None] * (values.shape[1] - 1))
        growth = np.diff(values, axis=0) / -np.diff(np.log(films))[:, None]
        right.semilogx(np.sqrt(films[1:] * films[:-1]), growth, "o-", ms=2.5, color=colour)
    end = fem[-1].middle() + RATE * np.log(films[-1] / films)
    left.semilogx(films, end * 1e12, ":", color="k", label="40.87 pF/m per e-fold")
    right.axhline(RATE * 1e12, ls=":", color="k")
    left.set(xlabel="film thickness d [mm]", ylabel="C' [pF/m]", ylim=(0, 1000))
    right.set(xlabel="film thickness d [mm]", ylabel="growth of C' per e-fold of 1/d [pF/m]", ylim=(0, 80))
    left.legend(frameon=False, fontsize=8)
    for axis in (left, right):
        axis.invert_xaxis()
    save(figure, "thin-films")


def apex() -> None:
    """Error of the upper bound against unknowns: even meshes, an even mesh of rising order, rings of rising order."""
    scene, exact = tri_scene(0.1), EXACT[0.1]
    _, coarse = fem2d._triangles(scene)
    exponents = fem2d.exponents(coarse, EPS)
    mesh = fem2d._graded(coarse, EPS, 1e-9)
    families = {
        "P1, even mesh": (ORANGE, "o-", list(uniform(scene, skfem.ElementTriP1(), 7))),
        "P2, even mesh": (GREEN, "s-", list(uniform(scene, skfem.ElementTriP2(), 6))),
        "order 2 to 16, few large triangles": (GREY, "^-", [_of_order(Cones(coarse, {}), p) for p in range(2, 17, 2)]),
        "fem2d: order 2 to 12, rings at corners": (BLUE, "D-", [_of_order(mesh, p) for p in range(2, 13)]),
    }
    figure, axis = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for label, (colour, style, found) in families.items():
        unknowns, energy = np.array(found).T
        axis.loglog(unknowns, energy / exact - 1, style, ms=3.5, color=colour, label=label)
    least = min(exponents.values())
    n = np.array([100.0, 5e4])
    axis.loglog(n, 0.2 * (n / n[0]) ** -least, "k:", label=f"$N^{{-{least:.2f}}}$, as the apex's field has it")
    axis.set(xlabel="unknowns N that triangles share [-]", ylabel="C' too high by [-]")
    axis.legend(frameon=False, fontsize=8, loc="lower left")
    save(figure, "apex")


def _of_order(mesh: Cones, order: int) -> tuple[int, float]:
    """Unknowns of a potential of one order that triangles share, in rings too, and C' from above [F/m]."""
    plane = Plane(mesh, order)
    eps, _ = fem2d._by_triangle(mesh, EPS)
    u = plane.potential(eps)
    rings = [
        (len(fan.spokes) + (order - 1) * (len(fan.spokes) + 2 * len(fan.members))) << mesh.doublings[corner]
        for corner, fan in mesh.fans.items()
    ]
    cells = mesh.triangles.regions[0][1]
    return plane.unknowns + sum(rings), float((eps * plane.energies(u, u)).sum()) * cells * EPS0_F_PER_M


def voxels() -> None:
    """Error of voxels over their edge, d = 0.1: each takes the material of its middle."""
    exact, scene = EXACT[0.1], tri_scene(0.1)
    layers = 3 * np.unique(np.geomspace(3, 80, 40).astype(int))  # so that squares fill half a period too
    edges_um = 600 / layers
    below, above = (
        np.array([100 * (voxel_capacitance(scene, int(n), side) / exact - 1) for n in layers]) for side in (-1, 1)
    )
    tied = layers % 6 == 0
    ours = fem2d.capacitance(scene, EPS, 1e-4).times(1 / MM)
    low, high = (100 * (bound / exact - 1) for bound in (ours.lower, ours.upper))
    figure, axis = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    axis.semilogx(edges_um, below, "-", lw=0.6, color=GREY)
    axis.semilogx(edges_um[~tied], below[~tied], "o", ms=3.5, color=ORANGE, label="voxels that cut the film's top")
    for errors, mark, side in ((below, "v", "air"), (above, "^", "electrode")):
        label = f"voxels that fit; middles on the flank count as {side}"
        axis.semilogx(edges_um[tied], errors[tied], mark, ms=4.5, color=GREEN, mfc="w", label=label)
    axis.axhspan(low, high, color=BLUE, label=f"fem2d, bounds {high - low:.0g} % apart", lw=1.5)
    axis.set(xlabel="edge of a voxel [µm]", ylabel="error of C' [%]", xlim=(80, 2), ylim=(-30, 35))
    axis.set_xticks([60, 40, 20, 10, 5, 2.5], ["60", "40", "20", "10", "5", "2.5"])
    axis.minorticks_off()
    axis.legend(frameon=False, fontsize=8, loc="lower right")
    save(figure, "voxels")


def voxel_capacitance(scene: Scene, layers: int, side: int) -> float:
    """C' by finite volumes on squares, so many of them one above another between the electrodes' plates [F/m].

    Fluxes between middles meet both materials in series; electrodes are at the voxels' faces. A middle on a line
    between two materials has that above it for ``side`` 1, that below for -1.
    """
    code, eps, shares = _voxels(scene, layers, side)
    free = np.full(code.shape, -1)
    free[code == 0] = np.arange((code == 0).sum())
    rows, columns_, values, into, one = [], [], [], np.zeros((code == 0).sum()), 0.0
    for axis in (0, 1):
        a, b = (tuple(slice(*s) if k == axis else slice(None) for k in (0, 1)) for s in ((None, -1), (1, None)))
        half = [np.where(code[s] == 0, 0.5 / eps[s], 0.0) for s in (a, b)]
        dielectric = (code[a] == 0) | (code[b] == 0)
        g = np.where(dielectric, 1 / np.where(dielectric, half[0] + half[1], 1.0), 0.0)
        for here, there in ((a, b), (b, a)):
            inside = dielectric & (code[here] == 0)
            rows += [free[here][inside]]
            columns_ += [free[here][inside]]
            values += [g[inside]]
            both = inside & (code[there] == 0)
            rows, columns_, values = [*rows, free[here][both]], [*columns_, free[there][both]], [*values, -g[both]]
            top = inside & (code[there] == 1)
            np.add.at(into, free[here][top], g[top])
            one += g[top].sum()
    matrix = coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns_)))).tocsc()
    return float(one - into @ spsolve(matrix, into)) * shares * EPS0_F_PER_M


def _voxels(scene: Scene, layers: int, side: int) -> tuple[np.ndarray, np.ndarray, float]:
    """What is at the middle of each voxel (0 dielectric, 1 top, 2 bottom), its permittivity, cells per sensor."""
    found = cell(sections(scene)[0], scene.size_mm[2])
    floor, lid = found.slices[0].bands[0].top_mm[0], max(max(s.bands[-1].bottom_mm) for s in found.slices)
    edge = (lid - floor) / layers
    left, right = found.slices[0].left_mm, found.slices[-1].right_mm
    across = round((right - left) / edge)
    x = left + (np.arange(across) + 0.5) * (right - left) / across
    z = floor + (np.arange(-1, layers + 1) + 0.5) * edge + side * 1e-9
    code, eps = np.zeros((across, len(z)), dtype=int), np.ones((across, len(z)))
    for k, at in enumerate(x):
        here = next(s for s in found.slices if s.left_mm <= at <= s.right_mm)
        for n, band in enumerate(here.bands[j] for j in np.searchsorted(here.lines_mm(at), z)):
            code[k, n] = {"": 0, "top": 1, "bottom": 2}[band.terminal]
            eps[k, n] = EPS.get(band.material, 1.0)
    return code, eps, found.shares[0]


def ratios() -> None:
    """Width of the interval over the ratio of permittivities, 1e-4 asked for."""
    values = np.geomspace(1, 1e6, 19)
    scenes = {"triangular cell, air wedges at the apex": (tri_scene(0.1), ORANGE), "cog in layers": (stairs(3), BLUE)}
    figure, axis = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for label, (scene, colour) in scenes.items():
        for name, style, widths in (
            ("fem2d", "o-", [fem2d.capacitance(scene, {"x60": r, "air": 1.0}, 1e-4).width() for r in values]),
            ("columns", "s--", [columns.capacitance(scene, {"x60": r, "air": 1.0}).width() for r in values]),
        ):
            axis.loglog(values, np.maximum(widths, 1e-9), style, ms=3.5, color=colour, label=f"{name}: {label}")
    axis.axhline(1e-4, color=GREY, ls=":", label="asked for")
    axis.set(
        xlabel="permittivity of the solid over that of air [-]", ylabel="width of the interval [-]", ylim=(3e-8, 5)
    )
    figure.legend(frameon=False, fontsize=8, ncols=2, loc="outside lower center")
    save(figure, "ratios")


def save(figure, name: str) -> None:
    for axis in figure.axes:
        axis.grid(alpha=0.3)
    figure.savefig(PICTURES / f"cells-{name}.png", dpi=130)
    plt.close(figure)


def main() -> None:
    for picture in (thin_films, apex, voxels, ratios):
        picture()


if __name__ == "__main__":
    main()
