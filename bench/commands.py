"""Time of whole commands from an empty cache: of the processor, with processes that they start; elapsed; and again.

Writes ``results/commands.md``. ``--beside FOLDER`` times another source tree in turn, command by command: a computer
that does other things slows both. G-code is sliced first, by both slicers.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

from sensorgen.core.cache import PLACE

ROOT = Path(__file__).parents[1]
PAGE = Path(__file__).parent / "results" / "commands.md"
TRI = ROOT / "docs" / "best-tri.yaml"
GCODE = "best-tri/best-tri.{}.gcode"
JOBS = {  # and the targets [s]: from an empty cache, and again
    ("check", "tri"): (1.5, 0.25),
    ("predict", "tri"): (1.5, 0.25),
    ("cell", "tri", "--accuracy", "1e-4"): (None, 0.35),
    ("compress", "tri", "--stress", "0:100:10"): (1.5, None),
    ("compress", "tri", "--dielectric", "0.1", "--drawn", "--stress", "0:600:100"): (None, None),
    ("compress", "rect", "--stress", "0:100:10"): (6.0, None),
    ("predict", str(TRI), "--gcode", GCODE.format("prusa")): (5.0, None),
    ("predict", str(TRI), "--gcode", GCODE.format("cura")): (8.0, None),
}


def seconds(tree: Path, words: tuple[str, ...], place: Path, cache: Path) -> tuple[float, float]:
    """Processor time of a command of a source tree, and the time that passes [s]."""
    alone = {"OPENBLAS_NUM_THREADS": "1", "SENSORGEN_BUDGET": "0"}  # no changes tried after a verdict
    environment = {**os.environ, **alone, PLACE: str(cache), "PYTHONPATH": str(tree / "src")}
    before, begun = os.times(), perf_counter()
    command = [sys.executable, "-m", "sensorgen", *words]
    done = subprocess.run(command, cwd=place, env=environment, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):  # 1: findings
        raise SystemExit(f"{' '.join(words)}: {done.stderr}")
    after, passed = os.times(), perf_counter() - begun
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return used, passed


def cold_and_warm(tree: Path, words: tuple[str, ...], place: Path) -> tuple[float, ...]:
    """Processor time and elapsed time from an empty cache, and processor time again [s]."""
    with tempfile.TemporaryDirectory() as cache:
        return *seconds(tree, words, place, Path(cache)), seconds(tree, words, place, Path(cache))[0]


def cells(values: list[tuple[float, ...]]) -> list[str]:
    """Medians in words."""
    return [f"{median(times):.2f}" for times in zip(*values, strict=True)]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--beside", type=Path, help="another source tree, timed in turn")
    options.add_argument("--runs", type=int, default=3)
    given = options.parse_args()
    trees = [ROOT, *([given.beside.resolve()] if given.beside else [])]
    heads = [f"{when}{which} [s]" for which in ("", ", before")[: len(trees)] for when in ("cold", "elapsed", "again")]
    lines = [f"| command | {' | '.join(heads)} | target |", f"|{'---|' * (len(heads) + 2)}"]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for slicer in ("prusa", "cura"):
            seconds(ROOT, ("slice", str(TRI), "--out", str(place), "--slicer", slicer, "--force"), place, place / "c")
        for words, targets in JOBS.items():
            times: list[list[tuple[float, ...]]] = [[] for _ in trees]
            for _ in range(given.runs):
                for tree, of in zip(trees, times, strict=True):
                    of.append(cold_and_warm(tree, words, place))
            shown = [cell for of in times for cell in cells(of)]
            asked = ", ".join(f"{t:g}" if t else "-" for t in targets) if any(targets) else ""
            name = " ".join(words).replace(str(ROOT) + "/", "")
            lines.append(f"| `{name}` | {' | '.join(shown)} | {asked} |")
            print(lines[-1], flush=True)
    about = (
        f"Medians of {given.runs}, from an empty cache: processor seconds with the processes that a command starts "
        "(slicer, mesher, a drawing's prediction), and elapsed; then processor seconds again. Targets: cold, again."
    )
    PAGE.write_text(
        "\n".join(["# Time of whole commands", "", "Made by `bench/commands.py`.", "", about, "", *lines, ""])
    )


if __name__ == "__main__":
    main()
