"""As printed: time to read a print back and to solve its electrodes, by size; what direction and walls change.

Times are the processor's. Slicers run where they are installed; without them only the estimate is timed.
"""

import json
import shutil
import sys
import tempfile
import time
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from matplotlib import pyplot as plt

from electrode_lines import electrode_lines
from sensorgen.asprinted.printed import body, gap_mm
from sensorgen.checks.estimate import RULES
from sensorgen.design.design import make
from sensorgen.export import slicing
from sensorgen.export.gcode import motion as paths
from sensorgen.models import fem2d, traxels
from sensorgen.verification.chart.networks import plate

RESULTS = Path(__file__).parent / "results"
PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
DEGREES = tuple(range(0, 91, 15))
CONTACTS = (0.0, 1e-6, 1e-5, 1e-4)
LENGTHS_MM = (100, 200, 400, 800, 1600, 10400)
RHO, LINE_MM, LAYER_MM = 0.2, 0.4185, 0.1
EPS = {"air": 1.00059, "x60": 4.68}
COLOURS = {"etpu": "#303436", "x60": "#f2c14e"}


def spent(work):
    start = time.process_time()
    found = work()
    return found, time.process_time() - start


def networks():
    """Pieces of lines, unknowns and seconds of plates 10 mm wide in three layers."""
    rows = []
    for length in LENGTHS_MM:
        lines = plate(length, 10.0, LINE_MM, LAYER_MM, (90, 0, 90))
        reach = (length / 2 - 1.1) * 1e-3
        found, seconds = spent(
            lambda lines=lines, reach=reach: traxels.resistance(lines, RHO, 1e-5, (-reach, reach), 3e-6)
        )
        rows.append({"length_mm": length, "pieces": len(lines), "unknowns": found.unknowns, "seconds": seconds})
    return rows


def directions():
    """Ratio to the solid by direction of the first layer, for every contact resistivity."""
    found = {}
    for contact in CONTACTS:
        found[contact] = [
            traxels.resistance(
                plate(100.0, 10.0, LINE_MM, LAYER_MM, (a, a + 90, a)), RHO, contact, (-48.9e-3, 48.9e-3), 3e-6
            ).ratio
            for a in DEGREES
        ]
    return found


def read_back():
    """Real slicers' triX and sqXY of 100 x 10 mm: lines, seconds to read, to make layers, and for one electrode."""
    here = [name for name, program in (("prusa", "prusa-slicer"), ("cura", "CuraEngine")) if shutil.which(program)]
    return [
        _read_back(slicer, make({"shape": shape, "parameters": {"dielectric_mm": 0.1}}))
        for slicer in here
        for shape in ("tri", "rect")
    ]


def _read_back(slicer, design):
    with tempfile.TemporaryDirectory() as folder:
        made = slicing.sliced([slicing.alone(design)], slicer, Path(folder))
        lines, reading = spent(lambda: paths.read(made.raw, design.machine, "slicer"))
        printed, layering = spent(lambda: body(design, lines, slicer=slicer))
    top = electrode_lines(design, printed.lines, "top")
    _, solving = spent(lambda: traxels.resistance(top, 0.07, 1e-5, (-48.9e-3, 48.9e-3), 3e-6))
    return {
        "slicer": f"{slicer} {made.version}", "design": design.name, "slicing_s": made.seconds, "lines": len(lines),
        "read_s": reading, "layers_s": layering, "electrode_lines": len(top), "electrode_s": solving,
    }  # fmt: skip


def draw_directions(found):
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for (contact, ratios), mark in zip(found.items(), "osv^", strict=True):
        label = f"{contact:g} Ω m²" if contact else "no contact resistance"
        left.plot(DEGREES, ratios, mark + "-", ms=3.5, label=label)
    left.set(xlabel="direction of the first layer's lines, from x [°]", ylabel="resistance over ρL/(HW) [-]")
    left.set_title("100 × 10 × 0.3 mm, layers a / a + 90° / a", fontsize=10)
    left.set_xticks(range(0, 91, 15))
    left.legend(title="contact between lines", fontsize=8, title_fontsize=8)
    left.grid(alpha=0.3)
    for number, degrees in enumerate((0, 45, 90)):
        lines = plate(12.0, 6.0, LINE_MM, LAYER_MM, (degrees,))
        for a, b in zip(lines.start_m * 1e3, lines.end_m * 1e3, strict=True):
            x = np.array([a[0], b[0]])
            right.plot(
                x, np.array([a[1], b[1]]) - 7.5 * number, "-", color=f"C{number}", lw=1.6, solid_capstyle="round"
            )
        right.text(6.6, -7.5 * number, f"a = {degrees}°", va="center", fontsize=9)
    right.set(aspect="equal", xlim=(-6.5, 9.5))
    right.axis("off")
    right.set_title("lines of one layer: two walls and infill", fontsize=10)
    figure.savefig(PICTURES / "as-printed-directions.png", dpi=110)


def draw_walls():
    """One period of triX as drawn and as every way of walls prints it, with its capacitance."""
    design = make({"shape": "tri", "parameters": {"dielectric_mm": 0.1, "length_mm": 12.0}})
    one = make({"shape": "tri", "parameters": {"dielectric_mm": 0.1, "length_mm": 4.0}}).drawn
    scenes = {"as drawn": (one, 1.5)}
    for walls in RULES:
        scenes[walls] = (body(design, walls=walls).cell.scene, 0.0)
    figure, panels = plt.subplots(len(scenes), 1, figsize=(3.6, 9.2), layout="constrained")
    for axes, (name, (scene, start)) in zip(panels, scenes.items(), strict=True):
        for each in scene.bodies:
            for prism in each.pieces:
                for outline in prism.cut("y", scene.size_mm[1] / 2):
                    x, z = np.array(outline).T
                    axes.fill(x - start, z, color=COLOURS[each.material], lw=0.3, ec="white")
        at = 0.159652 if name == "as drawn" else per_m(scene)
        gap = 0.1 if name == "as drawn" else gap_mm(scene)
        axes.set(xlim=(0, 2), ylim=(0, 1.2), aspect="equal")
        axes.set_title(f"{name}: gap {gap:g} mm, {at * 1e3:.1f} pF/m", fontsize=8, loc="left")
        axes.set_ylabel("z [mm]", fontsize=8)
        axes.tick_params(labelsize=7)
    panels[-1].set_xlabel("x [mm]", fontsize=8)
    figure.savefig(PICTURES / "as-printed-walls.png", dpi=110)


def per_m(scene):
    """Capacitance of one period [nF/m]."""
    return fem2d.capacitance(scene, EPS, 1e-3).middle() / (scene.size_mm[1] * 1e-3) * 1e9


def table(rows):
    heads = list(rows[0])
    lines = [[f"{row[h]:.3g}" if isinstance(row[h], float) else str(row[h]) for h in heads] for row in rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in (heads, ["---"] * len(heads), *lines))


def main():
    RESULTS.mkdir(exist_ok=True)
    found = {"networks": networks(), "read_back": read_back(), "directions": directions()}
    slope = np.polyfit(*np.log([[r["pieces"], r["seconds"]] for r in found["networks"][1:]]).T, 1)[0]
    parts = [
        "# As printed, measured (processor seconds)", "Electrode networks, three layers, 10 mm wide:",
        table(found["networks"]), f"Time grows as the number of pieces to the power {slope:.2f}.",
    ]  # fmt: skip
    if found["read_back"]:
        parts += ["Prints of 100 x 10 mm read back; slicing is wall-clock time:", table(found["read_back"])]
    (RESULTS / "asprinted.md").write_text("\n\n".join(parts) + "\n")
    (RESULTS / "asprinted.json").write_text(json.dumps(found, indent=1) + "\n")
    draw_directions(found["directions"])
    if not fem2d.why_not_applicable(make({"shape": "reference"}).drawn):
        draw_walls()
    print("\n\n".join(parts))


if __name__ == "__main__":
    main()
