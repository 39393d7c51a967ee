"""Time of ``sensorgen show``, cold and warm, and the size of its page: ``python bench/show.py``."""

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

DESIGNS = {"tri 0.2": ["tri", "--dielectric", "0.2"], "rect": ["rect"], "reference": ["reference"]}
RESULT = Path(__file__).parent / "results" / "show.md"


def timed(words: list[str], cache: Path, out: Path) -> tuple[float, float]:
    """Elapsed and processor time of one run [s]."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    environment = {**os.environ, "SENSORGEN_CACHE": str(cache)}
    command = [sys.executable, "-m", "sensorgen", "show", *words, "--no-open", "-o", str(out)]
    subprocess.run(command, check=True, capture_output=True, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - start, processor


def main() -> None:
    """Write the table."""
    lines = ["# Page of a design", "", "Processor time of `sensorgen show`: with an empty cache, and with the",
             "prediction stored (`python bench/show.py`). Goal: 3 s, 3 MB.", "",
             "| design | cold [s] | stored [s] | page [kB] |", "|---|---:|---:|---:|"]  # fmt: skip
    for name, words in DESIGNS.items():
        with tempfile.TemporaryDirectory() as folder:
            cache, out = Path(folder) / "cache", Path(folder) / "page.html"
            (_, cold), (_, stored) = timed(words, cache, out), timed(words, cache, out)
            lines.append(f"| {name} | {cold:.1f} | {stored:.1f} | {out.stat().st_size / 1e3:.0f} |")
    RESULT.write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    main()
