"""One design through four slicers: writes bench/results/slicers.*, C and R of each from its own G-code.

PrusaSlicer and CuraEngine are this machine's and those that ``scripts/debian13-slicers`` makes. The designs are
12 x 10 mm: three to six cells show what a slicer does to each.
"""

import json
import os
import sys
import tempfile
import time
from pathlib import Path

from sensorgen.asprinted.printed import body
from sensorgen.core import yamlfile
from sensorgen.core.errors import SensorgenError
from sensorgen.design import design
from sensorgen.export.gcode.check import check
from sensorgen.export.slicing import alone, sliced
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate

RESULTS = Path(__file__).parent / "results"
DESIGNS = Path(__file__).parents[1] / "designs"
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
NEWER = Path(os.environ.get("SENSORGEN_DEBIAN13") or CACHE / "sensorgen-debian13") / "bin"
PROGRAMS = (("prusa", ""), ("prusa", "prusa-slicer"), ("cura", ""), ("cura", "CuraEngine"))
SIZE = {"length_mm": 12.0, "width_mm": 10.0}


def variants():
    """The nine printable designs of the thesis, and one of each other shape."""
    names = sorted(p for p in DESIGNS.rglob("*.yaml") if not p.stem.endswith("-d0"))
    found = {name.stem: yamlfile.read(name) for name in names}
    found["rect"] = {"shape": "rect"}
    found["support"] = {"shape": "tri", "parameters": {"dielectric_mm": 0.2}, "materials": {"support": "bvoh"}}
    for name, data in found.items():
        known = design.fields(data["shape"])
        size = {key: value for key, value in SIZE.items() if key in known}
        yield design.make({**data, "name": name, "parameters": {**data.get("parameters", {}), **size}})


def printed(variant, slicer, program):
    """What one slicer makes of a design, checked and predicted."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            made = sliced([alone(variant)], slicer, Path(folder), program=program)
        except SensorgenError as error:
            return {"slicer": slicer, "refused": str(error)[:200]}
        loaded = {variant.tool(name): name for name in variant.used()}
        checked = check(made.ready, variant.machine, loaded, others_empty=True)
        source, content = f"{made.slicer} {made.version}", made.ready.read_bytes()
    row = {
        "slicer": source, "seconds": round(made.seconds, 2), "unknown": [f.message for f in made.findings],
        "accepted": not checked.errors(strict=True), "findings": [f.message for f in checked.findings],
    }  # fmt: skip
    try:
        found = evaluate(bodies.sliced(variant, lambda: body(variant, made.lines, slicer=source), source, content))
    except SensorgenError as error:
        return row | {"reason": str(error)[:200]}
    ends = {name: (r.lower, r.value, r.upper) for name, r in found.resistance.items()}
    return row | {
        "capacitance_pf": found.capacitance.value * 1e12,
        "resistance_ohm": ends,
        "gap_mm": found.gap.value * 1e3,
    }


def main():
    rows, programs = {}, [(slicer, str(NEWER / name) if name else "") for slicer, name in PROGRAMS]
    for variant in variants():
        started = time.perf_counter()
        rows[variant.name] = [printed(variant, *at) for at in programs]
        print(f"{variant.name}: {time.perf_counter() - started:.0f} s", file=sys.stderr)
    (RESULTS / "slicers.json").write_text(json.dumps(rows, indent=1) + "\n", "utf-8")
    titles = [row["slicer"] for row in next(iter(rows.values()))]
    lines = [
        "# Slicers beside each other\n",
        "C between the electrodes [pF]; R of the top and the bottom electrode, end to end [ohm]; electrode gap [mm]; from "
        "each slicer's G-code of 12 x 10 mm, `!` where `gcode check` refuses it.\n",
        "| design | " + " | ".join(titles) + " |", "|---" * (len(titles) + 1) + "|",
    ]  # fmt: skip
    for name, found in rows.items():
        lines.append(f"| {name} | " + " | ".join(map(cell, found)) + " |")
    (RESULTS / "slicers.md").write_text("\n".join(lines) + "\n", "utf-8")


def cell(row):
    """One entry of the table."""
    mark = "" if row.get("accepted") else "! "
    if "capacitance_pf" not in row:
        return f"{mark}{row.get('refused') or row.get('reason')}"
    ends = ", ".join(f"{middle:.3g}" for _, middle, _ in row["resistance_ohm"].values())
    return f"{mark}{row['capacitance_pf']:.3f}; {ends}; {row['gap_mm']:g}"


if __name__ == "__main__":
    main()
