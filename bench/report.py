"""A report of a run of a million samples of seven tones: time, memory and size of the page.

``python bench/report.py [SAMPLES]`` prints the table of docs/report.md; the budget is 10 s and 12 MB.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1] / "tests" / name) for name in ("report", "recording")]

import bench_files  # noqa: E402 - it is among the tests

from sensorgen.analysis.report import pieces, report  # noqa: E402
from sensorgen.design.specimen_name import design_of, parse  # noqa: E402
from sensorgen.measure.log import Log, bench, notes  # noqa: E402

RATE_HZ, PERIOD_S, NAME = 140.0, 20.0, "23 triX .1mm"


def filled(folder: Path, samples: int) -> Path:
    """A log with one run of presses every 20 s."""
    sensor = bench_files.truth(design_of(parse(NAME)), **bench_files.TRUTH)
    count = round(samples / RATE_HZ / PERIOD_S)
    files = bench_files.write(folder, "run", sensor, count, RATE_HZ, dwell_s=8.0, rest_s=10.4)
    with Log(folder / "log.db", create=True) as log:
        start = time.process_time()
        bench.log_recording(log, NAME, *files)
        print(f"import: {time.process_time() - start:.1f} s of processor time")
        log.add([notes.reading(NAME, "0.74k", "28")])
    return folder / "log.db"


def main() -> None:
    samples = int(sys.argv[1]) if sys.argv[1:] else 1_000_000
    with tempfile.TemporaryDirectory() as folder, Log(filled(Path(folder), samples)) as log:
        start, wall = time.process_time(), time.perf_counter()
        made = report(log, 23)
        middle = time.process_time()
        page = "".join(pieces(made, "html"))
        end = time.process_time()
        rows = next(t for t in made.tables if t.key == "recordings").cells
        print(f"samples: {rows[0][4]}, presses: {rows[0][8]}")
        print(f"computed in {middle - start:.1f} s, written in {end - middle:.1f} s of processor time")
        print(f"{time.perf_counter() - wall:.1f} s by the clock")
        print(f"page: {len(page.encode()) / 1e6:.1f} MB")
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print(f"largest memory, making of the data included: {most:.2f} GB")


if __name__ == "__main__":
    main()
