"""Travel over another tool's material before and after lifts, and open places of films, by variant and slicer.

Writes results/drags.md. Seconds are without acceleration, heating and changing tools; CPU time is the processor's.
"""

import shutil
import tempfile
import time
from pathlib import Path

from sensorgen.asprinted.pinholes import pinholes
from sensorgen.design.design import make
from sensorgen.export.gcode.check import check
from sensorgen.export.gcode.crossings import lift
from sensorgen.export.gcode.reading import text_of
from sensorgen.export.slicing import alone, sliced

RESULTS = Path(__file__).parent / "results"
PROGRAMS = {"prusa": "prusa-slicer", "cura": "CuraEngine"}
VARIANTS = {
    "triX 0.1": {"shape": "tri", "parameters": {"dielectric_mm": 0.1}},
    "triX 0.2": {"shape": "tri", "parameters": {"dielectric_mm": 0.2}},
    "triX 0.2 extrafine": {"shape": "tri", "parameters": {"dielectric_mm": 0.2}, "quality": "extrafine"},
    "triY 0.2": {"shape": "tri", "parameters": {"dielectric_mm": 0.2, "along": "y"}},
    "rect 0.1": {"shape": "rect", "parameters": {"dielectric_mm": 0.1}},
    "rect 0.2": {"shape": "rect", "parameters": {"dielectric_mm": 0.2}},
    "reference": {"shape": "reference"},
    "double": {"shape": "double"},
}
HEAD = """| variant | slicer | before, contact + near [mm] | after [mm] | lifts | retractions | added [s] | of [s] | \
findings | CPU [s] |
|---|---|---:|---:|---:|---:|---:|---:|---:|---:|"""
FILMS = """| variant | slicer | film | layers | line width | open [%] | through [%] | holes |
|---|---|---|---:|---:|---:|---:|---:|"""


def unlifted(made, machine):
    """The printer's file without lifts: what the slicer's own says."""
    from sensorgen.export.gcode.motion import follow
    from sensorgen.export.gcode.ready import ready

    raw = text_of(made.raw)
    return b"".join(ready(raw, follow(raw), machine))


def main():
    rows, films = ["# Travel over other tools' material, and through-holes of films", "", HEAD], [FILMS]
    for name, data in VARIANTS.items():
        design = make(data)
        for slicer in (s for s, program in PROGRAMS.items() if shutil.which(program)):
            with tempfile.TemporaryDirectory() as folder:
                made = sliced([alone(design)], slicer, Path(folder))
                text = unlifted(made, design.machine)
                start = time.process_time()
                found = lift(text, design.machine)
                lifted, change = found.text, found.lifting
                spent = time.process_time() - start
                found = check(lifted, design.machine)
                before, after = (f"{d.contact_mm:.1f} + {d.near_mm:.1f}" for d in (change.before, change.after))
                rows.append(
                    f"| {name} | {slicer} | {before} | {after} | {change.lifts} | {change.retractions} | "
                    f"{change.added_s:.0f} | {found.time_s:.0f} | {len(found.errors(strict=True))} | {spent:.2f} |"
                )
                films += [
                    f"| {name} | {slicer} | {r.film} | {r.layers} | {r.width} | {r.open_percent:.3f} | "
                    f"{r.through_percent:.4f} | {r.holes} |"
                    for r in pinholes(design, made.lines, most_layers=2).rows
                ]
                print(rows[-1])
    (RESULTS / "drags.md").write_text("\n".join([*rows, "", *films, ""]))


if __name__ == "__main__":
    main()
