"""One design through six slicers: writes bench/results/slicers.*, C and R of each from its own G-code.

PrusaSlicer and CuraEngine are this machine's and those that ``scripts/debian13-slicers`` makes, also for ``sid`` and
``bullseye``. The designs are 12 x 10 mm: three to six cells show what a slicer does to each.
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
from sensorgen.export import slicing
from sensorgen.export.gcode.check import check
from sensorgen.export.slicing import alone, sliced
from sensorgen.prediction import bodies
from sensorgen.prediction.rest_state import rest_state

RESULTS = Path(__file__).parent / "results"
DESIGNS = Path(__file__).parents[1] / "designs"
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
NEWER = Path(os.environ.get("SENSORGEN_DEBIAN13") or CACHE / "sensorgen-debian13") / "bin"
PROGRAMS = (
    ("prusa", ""), ("prusa", NEWER / "prusa-slicer"), ("prusa", CACHE / "sensorgen-sid/bin/prusa-slicer"),
    ("cura", CACHE / "sensorgen-bullseye/bin/CuraEngine"), ("cura", ""), ("cura", NEWER / "CuraEngine"),
)  # fmt: skip
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
        found = rest_state(bodies.sliced(variant, lambda: body(variant, made.lines, slicer=source), source, content))
    except SensorgenError as error:
        return row | {"reason": str(error)[:200]}
    of_print = [found.capacitance.value, found.capacitance.print.lower, found.capacitance.print.upper]
    return row | {
        "capacitance_pf": [c * 1e12 for c in of_print],
        "resistance_ohm": {end: r.value for end, r in found.resistance.items()},
    }


def main():
    slicing._OLDEST["cura"] = (4, 8)  # older than the profiles are for: to see what it makes of them
    rows, programs = {}, [(slicer, str(path)) for slicer, path in PROGRAMS if not path or path.is_file()]
    for variant in variants():
        started = time.process_time()
        rows[variant.name] = [printed(variant, *at) for at in programs]
        print(f"{variant.name}: {time.process_time() - started:.0f} s", file=sys.stderr)
        (RESULTS / "slicers.json").write_text(json.dumps(rows, indent=1) + "\n", "utf-8")
        (RESULTS / "slicers.md").write_text(table(rows), "utf-8")


def table(rows):
    """The results as Markdown."""
    titles = [row["slicer"] for row in next(iter(rows.values()))]
    lines = [
        "# Slicers beside each other\n",
        "From each slicer's G-code of 12 x 10 mm: C between the electrodes [pF], in brackets the range over the widths "
        "that a bead can have; R of the top electrode, end to end [ohm]. `!`: refused by `gcode check`.\n",
        "PrusaSlicer 2.9.6 is Debian sid's. CuraEngine 4.8, Debian 11's, is older than the profiles are for, and is "
        "refused by `sensorgen slice`. PrusaSlicer 2.3, of Debian 11, does not know the options of its command line. "
        "OrcaSlicer, Bambu Studio and SuperSlicer are in no release of Debian, PyPI or npm, and were not run.\n",
        "| design | " + " | ".join(titles) + " |",
        "|---" * (len(titles) + 1) + "|",
    ]
    return (
        "\n".join([*lines, *(f"| {name} | " + " | ".join(map(cell, each)) + " |" for name, each in rows.items())])
        + "\n"
    )


def cell(row):
    """One entry of the table."""
    mark = "" if row.get("accepted") else "! "
    if "capacitance_pf" not in row:
        return f"{mark}{row.get('refused') or row.get('reason')}"
    value, lower, upper = row["capacitance_pf"]
    return f"{mark}{value:.3f} ({lower:.3f} to {upper:.3f}); {row['resistance_ohm']['top']:.4g}"


if __name__ == "__main__":
    main()
