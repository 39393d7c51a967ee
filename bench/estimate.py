"""The estimate of a print without a slicer against the real slice: writes bench/results/estimate.md.

PrusaSlicer and CuraEngine are this machine's and those that ``scripts/debian13-slicers`` makes; cases are sensors of
12 x 10 mm. With names of programs, as "CuraEngine 4.13", only their columns are made anew.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

from sensorgen.asprinted.printed import body
from sensorgen.core.errors import SensorgenError
from sensorgen.design import design
from sensorgen.design.walls import rule as rule_of
from sensorgen.export.slicing import alone, sliced
from sensorgen.prediction import bodies
from sensorgen.prediction.rest_state import rest_state

RESULTS = Path(__file__).parent / "results"
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
NEWER = Path(os.environ.get("SENSORGEN_DEBIAN13") or CACHE / "sensorgen-debian13") / "bin"
PROGRAMS = {
    "PrusaSlicer 2.5": ("prusa", "", ""),
    "PrusaSlicer 2.9": ("prusa", str(NEWER / "prusa-slicer"), ""),
    "CuraEngine 4.13": ("cura", "", ""),
    "CuraEngine 5": ("cura", str(NEWER / "CuraEngine"), "cura-5"),
}  # slicer, program, its rule where the design does not decide
SIZE = {"length_mm": 12.0, "width_mm": 10.0}
OWN = """\
title: own
source: own
layer_mm: {0}
first_layer_mm: {1}
infill_pattern: rectilinear
travel_speed_mm_s: 120.0
bridge_warning_mm: 0.44
bridge_error_mm: 5.0
"""


def cases(folder):
    """Designs of every setting that was tried, by name."""

    def quality(layer, first):
        path = folder / f"layers-{layer}-{first}.yaml"
        path.write_text(OWN.format(layer, first), "utf-8")
        return str(path)

    def made(shape="tri", sizes=None, **more):
        known = design.fields(shape)
        size = {key: value for key, value in SIZE.items() if key in known}
        return design.make({"shape": shape, "parameters": size | (sizes or {}), **more})

    tri = {"dielectric_mm": 0.2}
    support = {"support": "bvoh"}
    return {
        "triX 0.1": made(sizes={"dielectric_mm": 0.1}),
        "triX 0.2": made(sizes=tri),
        "triX 0.1, 0.06 mm layers": made(sizes={"dielectric_mm": 0.1}, quality="extrafine"),
        "triX 0.2, 0.06 mm layers": made(sizes=tri, quality="extrafine"),
        "triY 0.2": made(sizes=tri | {"along": "y"}),
        "rect 0.1": made("rect", {"dielectric_mm": 0.1}),
        "rect 0.2": made("rect"),
        "reference": made("reference"),
        "triX 0.2, support": made(sizes=tri, materials=support),
        "triX 0.2, upside down, support": made(sizes=tri, materials=support, orientation="upside-down"),
        "nozzle 0.25": made(sizes=tri, nozzle_mm=0.25),
        "nozzle 0.6": made(sizes=tri, nozzle_mm=0.6),
        "layers 0.07": made(sizes=tri, quality=quality(0.07, 0.07)),
        "layers 0.15": made(sizes=tri, quality=quality(0.15, 0.15)),
        "layers 0.2 (tie)": made(sizes=tri, quality=quality(0.2, 0.2)),
        "layers 0.3": made(sizes=tri, quality=quality(0.3, 0.3)),
        "first layer 0.2": made(sizes=tri, quality=quality(0.1, 0.2)),
        "rect, layers 0.2 (tie)": made("rect", quality=quality(0.2, 0.2)),
        "lines 0.4 mm": made(sizes=tri, profile={"line_mm": {"etpu": 0.4, "x60": 0.4}}),
        "lines 0.5 mm": made(sizes=tri, profile={"line_mm": {"etpu": 0.5, "x60": 0.5}}),
        "lines 0.6 mm": made(sizes=tri, profile={"line_mm": {"etpu": 0.6, "x60": 0.6}}),
        "period 5": made(sizes=tri | {"period_mm": 5.0}),
        "rect yx": made("rect", {"along": "yx"}),
        "10 x 10": made(sizes=tri | {"length_mm": 10.0, "width_mm": 10.0}),
        "shrinkage 0.2": made(sizes=tri, shrinkage=0.2),
        "Prusa XL": made(sizes=tri, printer="prusa-xl5", tools={"etpu": 1, "x60": 2}),
        "infill 50 %": made(sizes=tri, infill={"x60": {"percent": 50}}),
        "infill 80 %": made(sizes=tri, infill={"x60": {"percent": 80}}),
        "reference, infill 50 %": made("reference", infill={"x60": {"percent": 50}}),
        "classic walls": made(sizes=tri, profile={"walls": "classic"}),
    }


def row(variant, slicer, program, rule):
    """Capacitance by the real slice and by the estimate with its range, both gaps; or why not."""
    try:
        with tempfile.TemporaryDirectory() as folder:
            lines = sliced([alone(variant)], slicer, Path(folder), program=program).lines
        real = bodies.sliced(variant, lambda: body(variant, lines), "slicer", b"")
        wanted = rest_state(real).capacitance.value
        guess = bodies.estimated(variant, rule or rule_of(slicer, variant.walls))
        found = rest_state(guess)
        every = rest_state(bodies.estimated(variant))
    except SensorgenError as error:
        return str(error)[:100]
    held = every.capacitance.print
    return {
        "real": wanted, "found": found.capacitance.value, "within": held.lower <= wanted <= held.upper,
        "range": (held.lower, held.upper),
        "gaps": [next(iter(each.cells.gap_mm.values())) for each in (real, guess)],
    }  # fmt: skip


def entry(found):
    """One entry of the table."""
    if isinstance(found, str):
        return found
    error = found["found"] / found["real"] - 1
    mark = "" if abs(error) <= 0.03 else " (in range)" if found["within"] else " **outside**"
    real, guess = found["gaps"]
    gap = f"; gap {guess:.3g} for {real:.3g}" if abs(real - guess) > 2e-3 else ""
    return f"{found['real'] * 1e12:.3f}; {100 * error:+.1f} %{mark}{gap}"


def main():
    """Slice, compare, write."""
    lines = [
        "# The estimate without a slicer against the real slice\n",
        "C of the real slice (`vol`) [pF] of 12 x 10 mm; error of the estimate by the rule of that slicer. Beyond 3 %: "
        "whether the print range of the prediction holds the real value. The electrode gap [mm] where it differs.\n",
        "| design | " + " | ".join(PROGRAMS) + " |",
        "|---" * (len(PROGRAMS) + 1) + "|",
    ]
    path, named = RESULTS / "estimate.md", sys.argv[1:] or list(PROGRAMS)
    rows = [row.strip("| ").split(" | ") for row in path.read_text("utf-8").splitlines() if row.startswith("| ")]
    known = {name: dict(zip(PROGRAMS, entries, strict=True)) for name, *entries in rows[1:]}
    with tempfile.TemporaryDirectory() as folder:
        for name, variant in cases(Path(folder)).items():
            started = time.process_time()
            found = known.get(name, {}) | {each: entry(row(variant, *PROGRAMS[each])) for each in named}
            lines.append(f"| {name} | " + " | ".join(found[each] for each in PROGRAMS) + " |")
            print(f"{time.process_time() - started:4.0f} s {lines[-1]}", file=sys.stderr, flush=True)
    path.write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    main()
