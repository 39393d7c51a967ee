"""G-code: time and memory of checking a file as it grows, and our own share of slicing; writes bench/results/gcode.*.

Times are the processor's, so that other programs count for nothing; each file is checked in a process of its own,
whose peak memory is that of the check. The slicers' times are those of their own processes and all they start.
"""

import json
import platform
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
RESULTS = HERE / "results"
SIZES = (10_000, 100_000, 300_000, 1_000_000, 2_000_000)
ARCS = (100_000, 1_000_000)
RUNS = 3
TARGET_S, TARGET_MB, TARGET_SHARE, TARGET_CURA_S = 10.0, 500.0, 0.15, 0.3
DESIGNS = ("23/trix-d0.1.yaml", "23/trix-d0.2.yaml", "23/sqxy-d0.2.yaml")

HEAD = "G90\nM83\nM140 S75\nG10 P3 S210 R180\nG10 P4 S230 R180\nG28\nG32\nM116\nM106 P3 S255\n"
TAIL = "G10 P3 S0 R0\nG10 P4 S0 R0\nG28\nM0 H1\n"
CHECK = """
import json, resource, sys, time
from pathlib import Path
from sensorgen.export.gcode.check import check
from sensorgen.design.printer import load_printer
machine = load_printer("diabase-h5")
start = time.process_time()
result = check(Path(sys.argv[1]), machine)
print(json.dumps({"lines": result.lines, "seconds": time.process_time() - start, "errors": len(result.errors()),
    "mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}))
"""

SLICE = """
import json, resource, sys, time
from pathlib import Path
from sensorgen.design.design import load
from sensorgen.workflows.slice import slice_design
imported, times = time.process_time(), {}
made = slice_design(
    load(Path(sys.argv[1])), Path(sys.argv[3]), sys.argv[2], force=True,
    step=lambda name: times.setdefault(name, time.process_time()),
)
end, used = time.process_time(), resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps({"lines": made.lines, "version": made.slicer.version, "slicer_s": used.ru_utime + used.ru_stime,
    "imports_s": imported, "before_s": times["G-code"] - imported, "after_s": end - times["G-code"]}))
"""

DRAGS = (
    CHECK.replace("gcode.check import check", "gcode.crossings import drags")
    .replace("check(Path", "drags(Path")
    .replace('"lines": result.lines', '"lines": Path(sys.argv[1]).read_bytes().count(b"\\n")')
    .replace("len(result.errors())", "0")
)


def write(path, lines):
    """A print of two tools: layers of short lines, with a slicer's comments on every twelfth."""
    count, layer = 0, 0
    with path.open("w") as file:
        file.write(HEAD)
        while count < lines:
            layer += 1
            z = min(0.1 + 0.001 * layer, 190.0)
            file.write(f"T{3 + layer % 2}\n;LAYER_CHANGE\n;HEIGHT:0.1\nG1 Z{z:.3f} F3000\nG1 E-4.7 F2400\n")
            file.write("G1 X-50 Y-40 F7200\nG1 E4.7 F2400\n;TYPE:Solid infill\n")
            for k in range(2000):
                file.write(
                    f"G1 X{-50 + k % 100:.3f} Y{-40 + 0.04 * k:.3f} E.0{1000 + k}\n" if k % 12 else ";WIDTH:0.44\n"
                )
            count += 2009
        file.write(TAIL)


def write_arcs(path, arcs):
    """A print of wide arcs, half circles of 80 mm to and fro."""
    with path.open("w") as file:
        file.write(f"{HEAD}T3\nG1 X80 Y0 Z0.1 F3000\n")
        file.writelines(
            f"G{3 - k % 2} X{-80 if k % 2 == 0 else 80} Y0 I{-80 if k % 2 == 0 else 80} E4\n" for k in range(arcs)
        )
        file.write(TAIL)


def write_layers(path, lines):
    """A print of two tools side by side in layers of 0.1 mm, each of 20 000 short lines to and fro."""
    with path.open("w") as file:
        file.write(HEAD)
        for layer in range(1, lines // 20_000 + 1):
            for tool in (3, 4):
                y = 40 * (tool - 4)
                file.write(f"T{tool}\n;LAYER_CHANGE\n;HEIGHT:0.1\nG1 Z{0.1 * layer:.3f} F3000\nG1 E-4.7 F2400\n")
                file.write(f"G1 X-50 Y{y} F7200\nG1 E4.7 F2400\n;TYPE:Solid infill\n")
                for row, k in ((row, k) for row in range(100) for k in range(100)):
                    file.write(f"G1 X{-50 + (99 - k if row % 2 else k)} Y{y + 0.42 * row:.3f} E.0166\n")
        file.write(TAIL)


def measured(path, program=CHECK):
    runs = []
    for _ in range(RUNS):
        done = subprocess.run([sys.executable, "-c", program, path], capture_output=True, text=True, check=True)
        runs.append(json.loads(done.stdout))
    assert not any(run["errors"] for run in runs)
    return {key: statistics.median(run[key] for run in runs) for key in ("lines", "seconds", "mb")}


def share(name, slicer):
    """Processor time of the slicer, of imports, and of all that ``sensorgen slice`` does before and after slicing."""
    rows = []
    for _ in range(RUNS):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-c", SLICE, HERE.parent / "designs" / name, slicer, folder]
            rows.append(json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout))
    found = {key: statistics.median(row[key] for row in rows) for key in rows[0] if key != "version"}
    return {"design": Path(name).stem, "slicer": slicer, "version": rows[0]["version"], **found}


def table(growth, arcs, travel, shares):
    yield "# G-code\n"
    yield f"Processor times on {platform.machine()}, Python {platform.python_version()}; medians of {RUNS}.\n"
    yield "| lines | check [s] | us per line | peak memory [MB] |"
    yield "|---|---|---|---|"
    for row in growth:
        per_line = row["seconds"] / row["lines"] * 1e6
        yield f"| {row['lines']} | {row['seconds']:.2f} | {per_line:.2f} | {row['mb']:.0f} |"
    for row in arcs:
        per_line = row["seconds"] / row["lines"] * 1e6
        yield f"| {row['lines']}, all wide arcs | {row['seconds']:.2f} | {per_line:.2f} | {row['mb']:.0f} |"
    for row in travel:
        per_line = row["seconds"] / row["lines"] * 1e6
        yield f"| {row['lines']}, travel over foreign lines | {row['seconds']:.2f} | {per_line:.2f} | {row['mb']:.0f} |"
    yield f"\nTarget: 1 000 000 lines in {TARGET_S:g} s and {TARGET_MB:g} MB.\n"
    yield "| design | slicer | lines | slicer [s] | imports [s] | checks and files [s] | after slicing [s] | share |"
    yield "|---|---|---|---|---|---|---|---|"
    for row in shares:
        yield (
            f"| {row['design']} | {row['slicer']} {row['version']} | {row['lines']:.0f} | {row['slicer_s']:.2f} | "
            f"{row['imports_s']:.2f} | {row['before_s']:.2f} | {row['after_s']:.2f} | "
            f"{row['after_s'] / row['slicer_s']:.0%} |"
        )
    yield (
        "\nAfter slicing: parsing, lifts, conversion, the print's layers, both checks, through-holes of the film, and "
        f"the page of layers. Target: {TARGET_SHARE:.0%} of PrusaSlicer's time, {TARGET_CURA_S:g} s with CuraEngine."
    )


def main():
    growth = []
    with tempfile.TemporaryDirectory() as folder:
        for size in SIZES:
            path = Path(folder) / "a.gcode"
            write(path, size)
            growth.append(measured(path))
        arcs = []
        for size in ARCS:
            write_arcs(path, size)
            arcs.append(measured(path))
        write_layers(path, 1_000_000)
        travel = [measured(path, DRAGS)]
    shares = [share(name, slicer) for name in DESIGNS for slicer in ("prusa", "cura")]
    text = "\n".join(table(growth, arcs, travel, shares))
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / "gcode.md").write_text(f"{text}\n", "utf-8")
    (RESULTS / "gcode.json").write_text(
        json.dumps({"growth": growth, "arcs": arcs, "travel": travel, "shares": shares}, indent=1) + "\n", "utf-8"
    )
    print(text)


if __name__ == "__main__":
    main()
