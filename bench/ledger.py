"""Ruined prints and harmless edits through the check, and the check's time; writes bench/results/ledger.md.

    python bench/ledger.py [DESIGN ...]

The faults are those of tests/slicers/ruined.py, planted in files of every slicer that is installed: of a sensor of
12 x 8 mm, and of designs of the thesis that are named.
"""

import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "slicers"))

from ruined import HARMLESS, Print, faults, findings  # noqa: E402

from sensorgen.design import design  # noqa: E402
from sensorgen.export.slicing import alone, sliced  # noqa: E402

NEWER = Path.home() / ".cache" / "sensorgen-debian13" / "bin"
PROGRAMS = {
    "PrusaSlicer, own": ("prusa", ""), "PrusaSlicer, Debian 13": ("prusa", NEWER / "prusa-slicer"),
    "CuraEngine, own": ("cura", ""), "CuraEngine, Debian 13": ("cura", NEWER / "CuraEngine"),
}  # fmt: skip
SMALL = {"shape": "tri", "name": "small", "parameters": {"dielectric_mm": 0.2, "length_mm": 12.0, "width_mm": 8.0}}
LARGE = {"shape": "tri", "parameters": {"dielectric_mm": 0.2, "length_mm": 200.0, "width_mm": 100.0}}


def prints(folder):
    """Files by design and slicer, without the slicers that are not installed."""
    named = [design.load(HERE.parent / "designs" / "23" / f"{name}.yaml") for name in sys.argv[1:]]
    for sensor in (design.make(SMALL), *named):
        for slicer, (family, program) in PROGRAMS.items():
            if not program or program.exists():
                made = sliced([alone(sensor)], family, folder / f"{sensor.name} {slicer}", program=str(program))
                yield f"{sensor.name}, {slicer}", Print(sensor, made.ready.read_bytes())


def main():
    """Plant everything, and write what became of it."""
    kinds, accepted, refused, seconds = defaultdict(lambda: [0, 0]), defaultdict(list), [], {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for title, printed in prints(folder):
            start = time.process_time()
            clean = findings(printed.design, printed.lines)
            seconds[title] = time.process_time() - start
            refused += [(title, "the file itself", clean)] if clean else []
            for fault in faults():
                new = fault.edit(printed)
                caught = bool(new and findings(printed.design, new))
                kinds[fault.kind][0] += new is not None
                kinds[fault.kind][1] += caught
                if new and not caught:
                    accepted[fault.name].append(title)
            for edit, change in HARMLESS.items():
                if found := findings(printed.design, change(printed)):
                    refused.append((title, edit, found))
            print(title, flush=True)
            written(kinds, accepted, refused, seconds)
        for title, sensor in (("trix-d0.2", SMALL | {"parameters": {"dielectric_mm": 0.2}}), ("200 x 100 mm", LARGE)):
            text = sliced([alone(design.make(sensor))], "prusa", folder / title).ready.read_text().splitlines()
            start = time.process_time()
            findings(design.make(sensor), text)
            seconds[f"{title}, PrusaSlicer, own"] = time.process_time() - start
            written(kinds, accepted, refused, seconds)


def written(kinds, accepted, refused, seconds):
    """Write what has become of them until now."""
    out = ["# Ruined prints\n", "Planted in real files (tests/slicers/ruined.py), by kind.\n"]
    out += ["| kind | planted | refused |", "|---|---|---|"]
    out += [f"| {kind} | {planted} | {caught} |" for kind, (planted, caught) in kinds.items()]
    total, caught = (sum(each[k] for each in kinds.values()) for k in (0, 1))
    out += [f"| all | {total} | {caught} |", "", "Accepted:", ""]
    out += [f"- {name}: {'; '.join(where)}" for name, where in accepted.items()] or ["- none"]
    out += ["", f"Harmless edits ({len(HARMLESS)}) and files as sliced, refused:", ""]
    out += [f"- {title}: {edit} ({', '.join(sorted(found))})" for title, edit, found in refused] or ["- none"]
    out += ["", "| file | check [s of processor] |", "|---|---|"]
    out += [f"| {title} | {value:.2f} |" for title, value in seconds.items()]
    (HERE / "results" / "ledger.md").write_text("\n".join(out) + "\n", "utf-8")
    print("\n".join(out))


if __name__ == "__main__":
    main()
