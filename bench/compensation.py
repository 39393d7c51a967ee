"""Compensation against real slices: gap and capacitance of the drawing, of the print before, and of the print after.

What comes out is measured by another program too: the reader of G-code and the voxels of tests/asprinted/voxels.py. It
cuts one period between mirror planes, away from the middle of the bed, where Cura changes the side that it thins; of
strips five, of which Cura prints no two alike, and takes their mean.
"""

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # threads that wait for a core would count as time

import sys
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from tempfile import TemporaryDirectory

from sensorgen.asprinted.printed import body
from sensorgen.core.errors import SensorgenError
from sensorgen.design.design import make
from sensorgen.design.walls import rule
from sensorgen.export import slicing
from sensorgen.prediction import bodies
from sensorgen.workflows.compensation import CAPACITANCE, GAP, compensated, of_body

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "asprinted"))
import numpy as np
import voxels

RESULT = Path(__file__).parent / "results" / "compensation.md"
CASES = [("rect", 0.1, "fine"), ("rect", 0.2, "fine"), ("tri", 0.1, "fine"), ("tri", 0.2, "fine"),
         ("cone", 0.2, "fine"), ("tri", 0.2, "extrafine"), ("tri", 0.3, "fine")]  # fmt: skip
EPS = {"x60": 4.68, "air": 1.00059}  # thesis, Table 3.2
PERIODS = (-9, -5, 2, 5, 8)  # of strips, from the middle
ASIDE_MM = 0.03  # of a window from the lines in its mirror planes


def main() -> None:
    """Write the table; of named shapes to the screen only."""
    lines = [
        "# Compensation, measured by real slices", "",
        "Asked for: gap and capacitance of the drawing, 100 x 10 mm, PrusaSlicer 2.5.0 (Arachne) and CuraEngine 4.13.0 "
        "(filling outline gaps). Errors of the capacitance as printed, by our cells and by another program's voxels "
        "(`tests/asprinted/voxels.py`; cone: a sensor of 20 x 10 mm of the same cells). Processor time [s] with the "
        "slicer's; with a cache, less than from an empty one.", "",
        "| design | slicer | asked | before | after, ours | gap and error by voxels | changes | slices, time |",
        "|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for shape, film, quality in CASES:
        for slicer in ("prusa", "cura"):
            if sys.argv[1:] and shape not in sys.argv[1:]:
                continue
            lines.append(row(shape, film, quality, slicer))
            print(lines[-1], flush=True)
    if not sys.argv[1:]:
        RESULT.write_text("\n".join(lines) + "\n")


def row(shape: str, film: float, quality: str, slicer: str) -> str:
    """One design by one slicer; what is refused with its reason."""
    design = make({"shape": shape, "quality": quality, "parameters": {"dielectric_mm": film}})
    asked, count, files = of_body(bodies.drawn(design)), [0], {}

    def sliced(one):
        with TemporaryDirectory() as folder:
            made = slicing.sliced([slicing.alone(one)], slicer, Path(folder))
            count[0] += 1
            printed = bodies.sliced(one, lambda: body(one, made.lines), slicer, made.ready.read_bytes())
            printed.cells  # noqa: B018 - while the files are there
            files[one.id()] = made.ready.read_text()
        return printed

    def words(one):
        return f"{one[GAP]:g} mm, {one[CAPACITANCE] / asked[CAPACITANCE] - 1:+.1%}"

    def shorter(one):
        """A cone's sensor of a fifth of its cells: real slices of all take half a minute."""
        data = one.model_dump(exclude={"name"})
        return make(data | {"parameters": dict(one.parameters) | {"length_mm": 20.0}}) if shape == "cone" else one

    larger = 5.0 if shape == "cone" else 1.0
    before = of_body(sliced(shorter(design)))
    start, count[0] = seconds(), 0
    head = f"| {shape} {film:g} {quality} | {slicer} | {asked[GAP]:g} mm, {asked[CAPACITANCE]:.4g} pF | "
    head += f"{before[GAP]:g} mm, {larger * before[CAPACITANCE] / asked[CAPACITANCE] - 1:+.1%} | "
    try:
        made, changes = compensated(design, rule(slicer, design.walls), sliced=sliced)
    except SensorgenError as error:
        return head + f"refused | | {error} | {count[0]}, {seconds() - start:.1f} |"
    effort = f"{count[0]}, {seconds() - start:.1f}"
    made = shorter(made)
    after = of_body(sliced(made))
    error = larger * after[CAPACITANCE] / asked[CAPACITANCE] - 1
    gap, value = by_voxels(made, files[made.id()])
    said = ", ".join(f"{c.what} {c.after:.4g}" for c in changes if "printed" not in c.what) or "none"
    return (
        f"{head}{after[GAP]:g} mm, {error:+.1%} | {gap:g} mm, {larger * value / asked[CAPACITANCE] - 1:+.1%} | "
        f"{said} | {effort} |"
    )


def by_voxels(design, text: str) -> tuple[float, float]:
    """Gap [mm] and capacitance [pF] of a G-code file by the other program."""
    print_, p = voxels.read(text), design.params
    size, period = design.printed.size_mm[:2], p.period_mm
    low = []
    for axis, (long, middle) in enumerate(zip(size, print_.middle(), strict=True)):
        first = {"tri": period / 4, "rect": getattr(p, "etpu_width_mm", 0.0) / 2}.get(design.shape, long % period / 2)
        low.append(middle - long / 2 + first + (int((long / 2 - first) / period) + 2 - axis) * period + ASIDE_MM)
    if design.shape == "tri":
        low["xy".index(p.along) ^ 1] = print_.middle()["xy".index(p.along) ^ 1] - period / 2
    conductor, film = (design.tool(design.slot(part)[0].name) for part in ("bottom_electrode", "film"))
    is_section = design.shape == "tri"  # strips along y: one row of voxels across them
    cuts = [(400, k - 2) for k in PERIODS] if is_section else [(100, 0), (150, 0)]
    values = []
    for n, aside in cuts:
        at = [low[0] + aside * period, low[1]]
        tools, heights = voxels.painted(print_, at, period, n, full=0.95)  # slits of thin layers are there
        part, rows, thin = (tools[:, :, n // 2, None], n, 8) if is_section else (tools, 1, n // 25)
        of = {film: EPS["x60"], -1: EPS["air"]}
        values.append(rows * voxels.capacitance(part, heights, period, thin, of, conductor))
    metal = tools == conductor
    label, _ = voxels.ndimage.label(metal)
    bottom = label == label[0].max()
    gap = min(heights[k] for k in range(len(metal)) if (metal & ~bottom)[k].any())
    gap -= max(heights[k + 1] for k in range(len(metal)) if bottom[k].any())
    values = np.array(values)
    print(values * 1e12 * size[0] * size[1] / period**2, file=sys.stderr, flush=True)
    (n, _), (finer, _) = cuts[0], cuts[-1]
    limit = values.mean() if is_section else values[-1] + (values[-1] - values[0]) * n / (finer - n)
    return round(gap, 4), limit * 1e12 * size[0] * size[1] / period**2


def seconds() -> float:
    """Processor time of this process and of those that have ended [s]."""
    return sum(sum(getrusage(who)[:2]) for who in (RUSAGE_SELF, RUSAGE_CHILDREN))


if __name__ == "__main__":
    main()
