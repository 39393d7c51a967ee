"""Every shape at its default size through each slicer: writes bench/results/slicer_shapes.md, accepted or why not.

Named ones: these alone, to the screen.

A cell counts the findings of the print that are errors, with the gravest: what `sensorgen slice` says.
"""

import sys
import time

from sensorgen.core.errors import SensorgenError
from sensorgen.design import design, packs
from sensorgen.prediction.new_slice import slice_now
from slicers import NEWER, RESULTS

PROGRAMS = (("prusa", ""), ("prusa", str(NEWER / "prusa-slicer")), ("cura", ""), ("cura", str(NEWER / "CuraEngine")))
HEAD = """# Shapes at their default sizes through slicers

By `bench/slicer_shapes.py`, 100 x 10 mm, printer diabase-h5, quality fine, or as the file has it. Accepted: the check
of the G-code, against the design too, has no error. Else the number of errors, and the first.

`tri` keeps the sharp apexes of the thesis by default. Where their first layer is cut they are 0.1 mm wide, a quarter of
the nozzle: three slicers leave them out, and Arachne with a `min_feature_size` of 15 % prints 3.4 times their volume,
which the check refuses. Tips of 0.1 mm (`--tip 0.1`) are printed by all.

"""
SHORT = {"double_tri": {"length_mm": 12.0, "width_mm": 6.0}}
MORE = {"tri --tip 0.1": {"shape": "tri", "parameters": {"tip_mm": 0.1}}}  # and files of the docs
FILES = ("locates-tri", "best-tri")


def designs():
    """All rows: name and design."""
    for shape in packs.names("shapes"):
        size = SHORT.get(shape, {})
        more = f" ({size['length_mm']:g} x {size['width_mm']:g} mm)" if size else ""
        yield shape + more, design.make({"shape": shape, "parameters": size})
    for name, data in MORE.items():
        yield name, design.make(data)
    for name in FILES:
        yield f"docs/{name}.yaml", design.load(RESULTS.parents[1] / "docs" / f"{name}.yaml")


def outcome(made, slicer, program):
    """Result of one slicer for a design: its version, and "accepted" or why not."""
    try:
        report = slice_now(made, slicer, program=program).report
    except SensorgenError as error:
        return "", f"refused: {error!s:.120}"
    errors = [
        f
        for f in (*report.findings, *report.printed.findings)
        if f.severity == "error" and not getattr(f, "waiver", "")
    ]
    name = f"{report.slicer.name} {report.slicer.version}"
    if not errors:
        return name, "accepted"
    first = errors[0]
    return name, f"{len(errors)}: {first.rule} {first.message}"[:140].replace("|", "/")


def main():
    rows, titles = [], [""] * len(PROGRAMS)
    for shape, made in designs():
        if sys.argv[1:] and shape not in sys.argv[1:]:
            continue
        started, cells = time.process_time(), []
        for k, (slicer, program) in enumerate(PROGRAMS):
            name, words = outcome(made, slicer, program)
            titles[k] = name or titles[k]
            cells.append(words)
        rows.append((shape, cells))
        print(shape, cells, f"{time.process_time() - started:.0f} s", file=sys.stderr, flush=True)
        if sys.argv[1:]:
            continue
        table = [f"| shape | {' | '.join(titles)} |", "|---" * (len(PROGRAMS) + 1) + "|"]
        table += [f"| {name} | {' | '.join(each)} |" for name, each in rows]
        (RESULTS / "slicer_shapes.md").write_text(HEAD + "\n".join(table) + "\n", "utf-8")


if __name__ == "__main__":
    main()
