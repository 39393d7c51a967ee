"""Every shape at its default size through each slicer: writes bench/results/slicer_shapes.md, accepted or why not.

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

By `bench/slicer_shapes.py`, 100 x 10 mm, printer diabase-h5, quality fine. Accepted: the check of the G-code, against
the design too, has no error. Else the number of errors, and the first.

"""


def outcome(shape, slicer, program):
    """Result of one slicer for a shape: its version, and "accepted" or why not."""
    made = design.make({"shape": shape})
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
    for shape in packs.names("shapes"):
        started, cells = time.process_time(), []
        for k, (slicer, program) in enumerate(PROGRAMS):
            name, words = outcome(shape, slicer, program)
            titles[k] = name or titles[k]
            cells.append(words)
        rows.append((shape, cells))
        print(shape, cells, f"{time.process_time() - started:.0f} s", file=sys.stderr, flush=True)
        table = [f"| shape | {' | '.join(titles)} |", "|---" * (len(PROGRAMS) + 1) + "|"]
        table += [f"| {name} | {' | '.join(each)} |" for name, each in rows]
        (RESULTS / "slicer_shapes.md").write_text(HEAD + "\n".join(table) + "\n", "utf-8")


if __name__ == "__main__":
    main()
