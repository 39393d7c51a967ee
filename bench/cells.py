"""Time against true error of every capacitance model, beside scikit-fem's adaptive P2; writes bench/results/cells.*

Processor time on one thread, in the same run, each program warmed up by a coarse one. Errors are against the exact
cells of tests/reference/cells.json.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import skfem
from skfem.helpers import dot, grad

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.design.shapes import rect, tri
from sensorgen.models import columns, fem2d, fem3d, thesis_cells
from sensorgen.scene.scene import Fill, Scene

HERE = Path(__file__).parent
CELLS = json.loads((HERE.parent / "tests" / "reference" / "cells.json").read_text("utf-8"))
EPS = {"x60": 4.68, "air": 1.00059}
MM = 1e-3


def tri_scene(d: float) -> Scene:
    return tri.scene(tri.Params(length_mm=2.0, width_mm=1.0, dielectric_mm=d), Fill())


def rect_scene(d: float) -> Scene:
    return rect.scene(rect.Params(length_mm=2.0, width_mm=2.0, dielectric_mm=d), Fill())


def timed(work: Callable[[], float], exact: float, runs: int = 5) -> tuple[float, float]:
    times = []
    for _ in range(runs):
        start = time.process_time()
        value = work()
        times.append(time.process_time() - start)
    return float(np.median(times)), abs(value / exact - 1)


def adaptive(scene: Scene, most: int) -> Iterator[tuple[float, float]]:
    """scikit-fem: P2, red-green-blue refinement of the half with the largest residuals; time so far and energy."""
    section, coarse = fem2d._triangles(scene)
    used, corners = np.unique(np.array(coarse.triangles), return_inverse=True)
    start = time.process_time()
    mesh = skfem.MeshTri(coarse.points[used].T.copy(), corners.reshape(-1, 3).T.copy())
    values = np.array([EPS[m] * share for m, share in coarse.regions])
    finder = mesh.element_finder()
    edges = [(coarse.points[a], coarse.points[b], end) for (a, b), end in coarse.terminals.items()]
    while True:
        basis = skfem.Basis(mesh, skfem.ElementTriP2(), intorder=4)
        eps = values[finder(*mesh.p[:, mesh.t].mean(1))]
        weight = skfem.Basis(mesh, skfem.ElementTriP0(), intorder=4).interpolate(eps)
        matrix = skfem.BilinearForm(lambda u, v, w: w.eps * dot(grad(u), grad(v))).assemble(basis, eps=weight)
        x, held = np.zeros(basis.N), []
        for a, b, end in edges:
            here = np.flatnonzero(_off(a, b, basis.doflocs) < 1e-12)
            x[here], held = float(end == "top"), [*held, here]
        x = skfem.solve(*skfem.condense(matrix, x=x, D=np.unique(np.concatenate(held))))
        yield time.process_time() - start, float(x @ matrix @ x) * EPS0_F_PER_M * MM * section.depth_mm
        if most < basis.N:
            return
        left = skfem.InteriorFacetBasis(mesh, skfem.ElementTriP2(), side=0, intorder=4)
        right = skfem.InteriorFacetBasis(mesh, skfem.ElementTriP2(), side=1, intorder=4)
        sides = [eps[mesh.f2t[k, left.find]] for k in (0, 1)]
        jump = skfem.Functional(lambda w: w.h * dot(w.e0 * grad(w.u0) - w.e1 * grad(w.u1), w.n) ** 2)
        flux = jump.elemental(
            left, u0=left.interpolate(x), u1=right.interpolate(x), e0=sides[0][:, None], e1=sides[1][:, None]
        )
        error = np.bincount(mesh.f2t[0, left.find], flux, mesh.nelements)
        error += np.bincount(mesh.f2t[1, left.find], flux, mesh.nelements)
        mesh = mesh.refined(skfem.adaptive_theta(error, theta=0.5))


def _off(a: np.ndarray, b: np.ndarray, points: np.ndarray) -> np.ndarray:
    along = (b - a) / np.hypot(*(b - a))
    share = np.clip((points.T - a) @ along, 0, np.hypot(*(b - a)))
    return np.hypot(*(points.T - a - share[:, None] * along).T)


def rows() -> Iterator[dict[str, object]]:  # noqa: C901
    for case in CELLS["tri"]:
        exact, scene, name = case["C_F_per_m"] * MM, tri_scene(case["d"]), f"tri d={case['d']}"
        p = tri.Params(dielectric_mm=case["d"])
        for model, law in thesis_cells.NAMED.items():
            if "tri" in law.shapes:
                seconds, error = timed(lambda f=law, p=p: f.value_f_per_m2(p, 4.68) * 2 * MM * MM, exact)
                yield row(name, model, seconds, error)
        for side in ("lower", "upper"):
            seconds, error = timed(lambda s=side, sc=scene: getattr(columns.capacitance(sc, EPS), s), exact)
            yield row(name, f"columns, {side}", seconds, error)
        for width in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7):
            interval = fem2d.capacitance(scene, EPS, width)
            seconds, error = timed(lambda w=width, sc=scene: fem2d.capacitance(sc, EPS, w).middle(), exact)
            yield row(name, "fem2d", seconds, error, interval.width())
        list(adaptive(scene, 300))
        for seconds, value in adaptive(scene, 12000):
            yield row(name, "scikit-fem, adaptive P2", seconds, abs(value / exact - 1))
    for case in CELLS["rect"]:
        exact, scene, name = case["C_F"], rect_scene(case["d"]), f"rect d={case['d']}"
        for side in ("lower", "upper"):
            seconds, error = timed(lambda s=side, sc=scene: getattr(columns.capacitance(sc, EPS), s), exact)
            yield row(name, f"columns, {side}", seconds, error)
        p3 = rect.Params(dielectric_mm=case["d"])
        for model, law in thesis_cells.NAMED.items():
            if "rect" in law.shapes:
                seconds, error = timed(lambda f=law, p=p3: f.value_f_per_m2(p, 4.68) * 4e-6, exact)
                yield row(name, model, seconds, error)
        start = time.process_time()
        for step in fem3d.steps(scene, EPS, 1e-3):
            found = step.interval
            seconds = time.process_time() - start
            yield row(name, "fem3d", seconds, abs(found.middle() / exact - 1), found.width(), step.unknowns)


def row(
    cell: str, model: str, seconds: float, error: float, width: float = 0.0, unknowns: int = 0
) -> dict[str, object]:
    return {"cell": cell, "model": model, "seconds": seconds, "error": error, "width": width, "unknowns": unknowns}


def speedups(found: list[dict]) -> list[tuple[str, float, str]]:
    """How much faster fem2d is than the first of scikit-fem's meshes that errs no more."""
    out = []
    for ours in (r for r in found if r["model"] == "fem2d"):
        peers = [r for r in found if r["cell"] == ours["cell"] and r["model"].startswith("scikit")]
        as_good = [r["seconds"] for r in peers if r["error"] <= max(ours["error"], ours["width"] / 2)]
        times = min(as_good or [r["seconds"] for r in peers[-1:]]) / ours["seconds"]
        more = "" if as_good else "more than "
        out.append((ours["cell"], ours["width"], f"{more}{times:.0f}"))
    return out


def picture(found: list[dict]) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(11, 8), sharey=True, layout="constrained")
    for axis, cell in zip(axes.flat, dict.fromkeys(r["cell"] for r in found), strict=True):
        here = [r for r in found if r["cell"] == cell]
        for model in dict.fromkeys(r["model"] for r in here):
            x, y = zip(
                *[(r["seconds"], max(r["error"], r["width"] / 2)) for r in here if r["model"] == model], strict=True
            )
            axis.loglog(x, y, "o-" if len(x) > 1 else "s", ms=5, label=model)
        axis.set_title(cell)
        axis.grid(alpha=0.3)
        axis.legend(fontsize=7, loc="lower left")
    for axis in axes[1]:
        axis.set_xlabel("processor time [s]")
    for axis in axes[:, 0]:
        axis.set_ylabel("relative error, certified where bounds exist [-]")
    figure.savefig(HERE / "results" / "cells.png", dpi=110)


def main() -> None:
    found = list(rows())
    lines = [
        "| cell | model | processor time [s] | true error | interval's width | unknowns |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {r['cell']} | {r['model']} | {r['seconds']:.2g} | {r['error']:.1e} | "
        f"{format(r['width'], '.1e') if r['width'] else ''} | {r['unknowns'] or ''} |"
        for r in found
    ]
    lines += [
        "",
        "fem2d against the first adaptive P2 mesh of scikit-fem with at most half the interval's width in error",
        "(more than: not reached by 12000 unknowns):",
        "",
    ]
    lines += ["| cell | width | times faster |", "|---|---|---|"]
    lines += [f"| {cell} | {width:.1e} | {times} |" for cell, width, times in speedups(found)]
    (HERE / "results" / "cells.md").write_text("\n".join(lines) + "\n", "utf-8")
    (HERE / "results" / "cells.json").write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    picture(found)


if __name__ == "__main__":
    main()
