"""Speed, memory and accuracy, measured; writes bench/results (a table, JSON and pictures).

Times are medians of runs that alternate with a peer in the same session, so that a busy machine slows both.
"""

import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).parent
RESULTS = HERE / "results"
RUNS = 7
CLICK_PROGRAM = "import click\n@click.command()\ndef main(): pass\nmain(['--help'])"


def seconds(command: list[str], folder: str) -> float:
    """Wall time of a command."""
    start = time.perf_counter()
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return time.perf_counter() - start


def paired(ours: list[str], peer: list[str], runs: int = RUNS) -> tuple[float, float, float]:
    """Median times of two commands run in turn, and the median of their ratios."""
    with tempfile.TemporaryDirectory() as folder:
        seconds(ours, folder), seconds(peer, folder)  # fill the disk cache
        rows = [(seconds(ours, folder), seconds(peer, folder)) for _ in range(runs)]
    a, b = zip(*rows, strict=True)
    return statistics.median(a), statistics.median(b), statistics.median(x / y for x, y in rows)


def best(work: Callable[[], object], runs: int = RUNS) -> float:
    """Median time of a function."""
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def commands() -> list[dict[str, object]]:
    """The command line against bare programs."""
    tool = [sys.executable, "-m", "sensorgen"]
    help_s, click_s, help_ratio = paired([*tool, "--help"], [sys.executable, "-c", CLICK_PROGRAM], 15)
    quick_s, _, _ = paired([*tool, "build", "tri", "--no-cad"], [sys.executable, "-c", "import numpy"])
    full_s, import_s, full_ratio = paired([*tool, "build", "tri"], [sys.executable, "-c", "import build123d"], 5)
    return [
        row("`--help`, ratio to a bare click program", help_ratio, 2.5, f"{help_s:.3f} s against {click_s:.3f} s"),
        row("`build tri --no-cad`, cold [s]", quick_s, 1.0, "a new process each time"),
        row("`build tri`, ratio to `import build123d`", full_ratio, 1.3, f"{full_s:.2f} s against {import_s:.2f} s"),
    ]


def row(what: str, got: float, target: float | None, note: str = "") -> dict[str, object]:
    return {"what": what, "got": got, "target": target, "note": note}


PROBE = """
import json, resource, sys, time
import numpy, manifold3d
from sensorgen.scene.geometry import meshes
from sensorgen.scene.scene import Fill
import importlib
shape, length, width = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
module = importlib.import_module("sensorgen.design.shapes." + shape)
times = []
for _ in range(3):
    start = time.perf_counter()
    scene = module.scene(module.Params(length_mm=length, width_mm=width), Fill())
    made = [meshes.mesh(b) for b in scene.bodies]
    times.append(time.perf_counter() - start)
exact = sum(b.volume_mm3() for b in scene.bodies)
error = abs(sum(m.volume_mm3() for m in made) / exact - 1)
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps([sorted(times)[1], peak, error, sum(len(m.triangles) for m in made)]))
"""


def probe(shape: str, length: float, width: float) -> list[float]:
    """Time [s], peak memory [MB], relative volume error and triangles of one mesh, in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", PROBE, shape, str(length), str(width)], check=True, capture_output=True, text=True
    )
    return list(json.loads(done.stdout))


def meshing() -> tuple[list[dict[str, object]], dict[str, list[list[float]]]]:
    """Meshes against size: rect n x n cells, tri n periods."""
    sizes = (5, 10, 20, 40, 80, 120, 165)
    curves = {shape: [[n, *probe(shape, 2.0 * n, 2.0 * n)] for n in sizes] for shape in ("rect", "tri")}
    rect, tri = curves["rect"][-1], curves["tri"][-1]
    table = [
        row("mesh of rect, 165 x 165 cells [s]", rect[1], 1.0, f"{rect[4]:.3g} triangles, volume to {rect[3]:.0e}"),
        row("the same, peak memory [MB]", rect[2], 600.0, "numpy and manifold3d included"),
        row("mesh of tri, 165 periods [s]", tri[1], 0.05, f"volume to {tri[3]:.0e}"),
        row(
            "rect: time per cell, 165 against 40",
            (rect[1] / 165**2) / (curves["rect"][3][1] / 40**2),
            1.5,
            "1 is linear growth",
        ),
    ]
    return table, curves


CHECK = """
import sys, time
from sensorgen.checks.review import review
from sensorgen.design import design
made = design.make({"shape": "tri", "parameters": {"length_mm": float(sys.argv[1])}})
start = time.perf_counter()
review(made)
print(time.perf_counter() - start)
"""


def checking() -> list[dict[str, object]]:
    """Checks, validity included, against the number of periods."""

    def took(periods: int) -> float:
        runs = (
            subprocess.run(
                [sys.executable, "-c", CHECK, str(2.0 * periods)], check=True, capture_output=True, text=True
            )
            for _ in range(3)
        )
        return statistics.median(float(run.stdout) for run in runs)

    few, many = took(40), took(160)
    note = f"{few:.3f} s for 40, {many:.3f} s for 160 periods; 1 is linear growth"
    return [row("checks of tri: time per period, 160 against 40", (many / 160) / (few / 40), 1.5, note)]


def against_union() -> list[dict[str, object]]:
    """Our grid mesh against manifold3d's union of the same boxes, rect 20 x 20 cells."""
    import manifold3d

    from sensorgen.design.shapes import rect
    from sensorgen.scene.geometry import meshes
    from sensorgen.scene.scene import Fill

    body = rect.scene(rect.Params(length_mm=40, width_mm=40), Fill()).body("top_electrode_with_cogs")

    def union() -> "manifold3d.Manifold":
        boxes = [solid(p) for p in body.pieces]
        made = manifold3d.Manifold.batch_boolean(boxes, manifold3d.OpType.Add)
        made.to_mesh64()  # it works only when asked
        return made

    def solid(p) -> "manifold3d.Manifold":
        low, high = zip(*(p.span(axis) for axis in "xyz"), strict=True)
        size = [h - lo for lo, h in zip(low, high, strict=True)]
        return manifold3d.Manifold.cube(size).translate(low)

    exact = body.volume_mm3()
    ours, peer = best(lambda: meshes.mesh(body)), best(union)
    errors = [abs(v / exact - 1) for v in (meshes.mesh(body).volume_mm3(), union().volume())]
    note = f"{ours * 1e3:.1f} ms, error {errors[0]:.0e}; union {peer * 1e3:.1f} ms, error {errors[1]:.0e}"
    return [row("grid mesh against manifold3d's union of the same boxes, ratio", ours / peer, None, note)]


def models() -> list[dict[str, object]]:
    """Time and error of the capacitance bounds against reference values (tests/reference)."""
    from sensorgen.core import lazy as registry
    from sensorgen.design import shapes
    from sensorgen.models import columns
    from sensorgen.scene.scene import Fill

    eps = {"x60": 4.68, "air": 1.00059}
    # Whole-sensor values of 100 x 10 mm from cells solved by adaptive finite elements with two-sided bounds.
    known = {
        ("tri", 0.1): 159.65204e-12 * 0.5,
        ("tri", 0.2): 128.51366e-12 * 0.5,
        ("rect", 0.1): 0.812343e-12 * 250,
        ("rect", 0.2): 0.485234e-12 * 250,
        ("reference", 0.6): 0.27625066e-12 * 250,
    }
    found = []
    for (shape, film), reference in known.items():
        module = registry.load(shapes, shape)
        scene = module.scene(module.Params(dielectric_mm=film), Fill())
        bounds = columns.capacitance(scene, eps)
        took = best(lambda scene=scene: columns.capacitance(scene, eps))
        errors = [bounds.lower / reference - 1, bounds.upper / reference - 1]
        found.append({"cell": f"{shape}, d = {film}", "seconds": took, "lower": errors[0], "upper": errors[1]})
    return found


def plot_growth(curves: dict[str, list[list[float]]]) -> None:
    import matplotlib as mpl

    mpl.use("svg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for shape, colour, power in (("rect", "#303436", 2), ("tri", "#c8951d", 1)):
        n = [r[0] for r in curves[shape]]
        left.loglog([k**power for k in n], [r[1] for r in curves[shape]], "o-", color=colour, label=f"{shape}")
        right.semilogx([k**power for k in n], [r[2] for r in curves[shape]], "o-", color=colour, label=f"{shape}")
    cells = [k**2 for k in (5, 165)]
    last = curves["rect"][-1]
    left.loglog(cells, [last[1] * c / last[0] ** 2 for c in cells], ":", color="grey", label="linear")
    left.plot(165**2, 1.0, "v", color="firebrick", label="target, rect")
    left.plot(165, 0.05, "^", color="firebrick", label="target, tri")
    right.axhline(600, color="firebrick", ls="--", lw=1, label="target, rect")
    left.set(xlabel="cells (rect) or periods (tri)", ylabel="time of scene and mesh [s]", title="Growth of the mesher")
    right.set(
        xlabel="cells (rect) or periods (tri)",
        ylabel="peak memory [MB]",
        ylim=(0, 650),
        title="Memory, libraries included",
    )
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    figure.savefig(RESULTS / "growth.png", dpi=130)


def plot_models(found: list[dict[str, object]]) -> None:
    """Interval of the bounds round the reference value, and the time that it took, for each cell."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 3.2), layout="constrained")
    colours = {"tri": "#c8951d", "rect": "#303436", "reference": "#3b7dd8"}
    for y, entry in enumerate(reversed(found)):
        colour = colours[str(entry["cell"]).partition(",")[0]]
        low, high = float(entry["lower"]) * 100, float(entry["upper"]) * 100
        axes.plot([low, high], [y, y], "|-", color=colour, lw=3, ms=14)
        exact = abs(high - low) < 1e-3
        said = "exact" if exact else f"{low:+.1f} .. {high:+.1f} %"
        axes.annotate(f"{said},  {float(entry['seconds']) * 1e3:.2g} ms", (high + 3, y), va="center", fontsize=9)
    axes.axvline(0, color="firebrick", lw=1)
    axes.set(
        xlim=(-35, 165), ylim=(-0.6, len(found) - 0.4), xlabel="bounds of C against the reference value [%]",
        title="columns: how far the bounds are, and how long they take (100 x 10 mm)",
    )  # fmt: skip
    axes.set_yticks(range(len(found)), [f"{e['cell']} mm" for e in reversed(found)])
    axes.grid(alpha=0.3, axis="x")
    figure.savefig(RESULTS / "models.png", dpi=130)


def table(rows: list[dict[str, object]], found: list[dict[str, object]]) -> str:
    lines = ["| what | target, at most | got | how |", "|---|---|---|---|"]
    lines += [f"| {r['what']} | {r['target'] or ''} | {r['got']:.3g} | {r['note']} |" for r in rows]
    lines += ["", "| capacitance by `columns` | time [ms] | lower bound [%] | upper bound [%] |", "|---|---|---|---|"]
    lines += [
        f"| {m['cell']} | {m['seconds'] * 1e3:.2f} | {m['lower'] * 100:+.2f} | {m['upper'] * 100:+.2f} |" for m in found
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure everything and write the results; with --draw only draw those of the last time."""
    if "--draw" in sys.argv:
        last = json.loads((RESULTS / "results.json").read_text("utf-8"))
        plot_growth(last["curves"])
        plot_models(last["models"])
        return
    RESULTS.mkdir(exist_ok=True)
    mesh_rows, curves = meshing()
    rows = [*commands(), *mesh_rows, *checking(), *against_union()]
    found = models()
    plot_growth(curves)
    plot_models(found)
    (RESULTS / "table.md").write_text(table(rows, found), "utf-8")
    (RESULTS / "results.json").write_text(
        json.dumps({"rows": rows, "curves": curves, "models": found}, indent=1) + "\n", "utf-8"
    )
    print(table(rows, found))


if __name__ == "__main__":
    main()
