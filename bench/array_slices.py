"""Arrays through real slicers: writes ``results/array_slices.*``.

Each case in a process of its own: ``python bench/array_slices.py insole-5:prusa mat-1:cura`` runs those, without any
all of them.
"""

import json
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from sensorgen.design.design import Design, make
from sensorgen.workflows.build import build
from sensorgen.workflows.slice import slice_design
from sensorgen.workflows.tiles import tiles

NOTES = "## Notes\n"
RESULTS = Path(__file__).parent / "results"
NEWER = Path.home() / ".cache/sensorgen-debian13/bin"
PROGRAMS = {"prusa": ("prusa", ""), "cura": ("cura", ""), "prusa-newer": ("prusa", NEWER / "prusa-slicer"),
            "cura-newer": ("cura", NEWER / "CuraEngine"), "build": ("", "")}  # fmt: skip
PITCH_5 = {"pitch_x_mm": 5, "pitch_y_mm": 5, "column_mm": 4, "row_mm": 4}
NARROW = {"connector_mm": 2, "lead_mm": 1.2}  # leads of 52 columns on the bed
ARRAYS = {
    "pad-5": {"parameters": {"length_mm": 60, "width_mm": 60, **PITCH_5}},
    "insole-10": {"border": "foot 42 left"},
    "insole-5": {"border": "foot 42 left", "parameters": {**PITCH_5, **NARROW}},
    "mat": {"parameters": {"length_mm": 488, "width_mm": 447}},
}
KINDS = {1: "corner, left", 2: "edge, left", 6: "corner, right", 7: "edge, right"}  # of the mat's ten tiles


def design(name: str) -> Design:
    """The array, or a tile of the mat, as ``mat-2``."""
    if name.startswith("mat-"):
        return next(made for tile, made in tiles(design("mat")) if f"mat-{tile.tile}" == name)
    return make({"shape": "array", "name": name, "cell": {"shape": "tri"}, **ARRAYS[name]})


def measured(name: str, how: str) -> dict[str, object]:
    """Verdict, processor seconds of this program and of the slicer, and peak memory of one case."""
    slicer, program = PROGRAMS[how]
    of = design(name)
    with tempfile.TemporaryDirectory() as folder:
        if slicer:
            made = slice_design(of, Path(folder), slicer, program=str(program), force=True)
            words = f"{made.slicer.name} {made.slicer.version}"
            errors = [f for f in made.all_findings if f.severity == "error"]
        else:
            words = "files"
            errors = [f for f in build(of, Path(folder), force=True).findings if f.severity == "error"]
    own, others = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return {
        "of": words, "verdict": "; ".join(f.message for f in errors) or "accepted",
        "own_s": round(own.ru_utime + own.ru_stime),
        "slicer_s": round(others.ru_utime + others.ru_stime),
        "gb": round(max(own.ru_maxrss, others.ru_maxrss) / 1e6, 2),
    }  # fmt: skip


def main() -> None:
    """Run the cases, and write the page of all that were ever run."""
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(measured(*sys.argv[2].split(":"))))
        return
    every = [f"{name}:{how}" for name in (*ARRAYS, *(f"mat-{k}" for k in KINDS)) if name != "mat" for how in PROGRAMS]
    path = RESULTS / "array_slices.json"
    found = json.loads(path.read_text("utf-8")) if path.exists() else {}
    for case in sys.argv[1:] or every:
        done = subprocess.run([sys.executable, __file__, "--one", case], capture_output=True, text=True, check=False)
        found[case] = json.loads(done.stdout) if not done.returncode else {"verdict": done.stderr[-300:]}
        path.write_text(json.dumps(dict(sorted(found.items())), indent=1) + "\n", "utf-8")
    rows = [
        f"| {case.split(':')[0]} | {row.get('of', case)} | {row['verdict']} | {row.get('own_s', '')} "
        f"| {row.get('slicer_s', '')} | {row.get('gb', '')} |"
        for case, row in sorted(found.items())
    ]
    head = "| array | of | verdict | sensorgen [s of processor] | other programs [s] | peak [GB] |\n"
    head += "|---|---|---|---|---|---|\n"
    kinds = ", ".join(f"mat-{k} {kind}" for k, kind in KINDS.items())
    note = f"Foot 42 and 60 x 60 mm at 5 mm pitch, foot 42 at 10 mm, tiles of a mat of 488 x 447 mm ({kinds})."
    page = RESULTS / "array_slices.md"
    notes = page.read_text("utf-8").partition(NOTES)[2] if page.exists() else ""  # by hand: they stay
    page.write_text(f"# Arrays and slicers\n\n{head}" + "\n".join(rows) + f"\n\n{note}\n\n{NOTES}{notes}", "utf-8")


if __name__ == "__main__":
    main()
