"""The log: how long its commands take as it grows, what a recording costs, and what kills and tampering come to.

Seconds are the processor's, of the command's own process where one runs. Writes ``results/log.md``. The recordings
are of seven tones in MATLAB's format.
"""

import dataclasses
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import scipy.io

from sensorgen.measure.log import Log
from sensorgen.measure.log.notes import reading

HERE = Path(__file__).parent
TESTS = HERE.parent / "tests" / "log"
READINGS, SAMPLES, KILLS = 100_000, 1_000_000, 200
TONES_HZ = [1.1e3, 2.3e3, 5.3e3, 10.1e3, 19.9e3, 49.9e3, 99.7e3]
RUNS = 5
COMMAND = """
import resource, sys
from sensorgen.cli import main
try:
    main()
finally:
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)
"""


def spent(*words):
    """Processor time [s], output and peak memory [GB] of a command."""
    before = os.times()
    done = subprocess.run([sys.executable, "-c", COMMAND, *map(str, words)], capture_output=True, text=True, check=True)
    after = os.times()
    peak = int(done.stderr.split()[-1]) * 1024 / 1e9
    return (
        after.children_user + after.children_system - before.children_user - before.children_system,
        done.stdout,
        peak,
    )


def median(*words):
    return sorted(spent(*words)[0] for _ in range(RUNS))[RUNS // 2]


def of_readings(folder):
    path = folder / "big.db"
    names = [f"{k} triX .{film}mm {copy}" for k in range(1, 51) for film in (1, 2) for copy in range(2, 12)]
    rows = [reading(name, "0.65k", "40 / 2.3k", remark="small holes") for name in names]
    start = time.process_time()
    with Log(path, create=True) as log:
        log.add(
            dataclasses.replace(row, uid=f"{k}-{j}") for k in range(READINGS // len(rows)) for j, row in enumerate(rows)
        )
    yield f"`Log.add` of {READINGS} readings at once", f"{time.process_time() - start:.1f} s", ""
    yield f"`log list` of {READINGS} readings", f"{median('log', 'list', '--log', path):.2f} s", "0.3 s"
    yield "`log list --iteration 25`", f"{median('log', 'list', '--iteration', 25, '--log', path):.2f} s", "0.5 s"
    yield "`log list --all`, all lines of it", f"{spent('log', 'list', '--all', '--log', path)[0]:.1f} s", ""
    yield "`log export` to CSV", f"{spent('log', 'export', folder / 'r.csv', '--log', path)[0]:.1f} s", ""
    start = time.process_time()
    with Log(path) as log:
        log.readings()
    yield "`Log.readings()`, all of them", f"{time.process_time() - start:.1f} s", ""


def of_a_table(folder):
    """Import of a table of 1000 specimens of eight designs, each row with other readings, and its report."""
    table, log = folder / "table.csv", folder / "table.db"
    kinds = ("triX", "triY", "sqXY", "sqYX")
    rows = (
        f"23 {kinds[k % 4]} .{k // 4 % 2 + 1}mm {2 + k // 40 % 125},0.{40 + k % 60}k,{20 + k % 51} / 2.{k % 9 + 1}k,"
        f"{('', 'small holes', 'not baked')[k % 3]}"
        for k in range(READINGS)
    )
    table.write_text("\n".join(["specimen,y,z,remark", *rows]) + "\n", "utf-8")
    seconds, _, peak = spent("log", "import", table, "--log", log)
    yield f"`log import` of a table of {READINGS} readings", f"{seconds:.1f} s, {peak:.2f} GB", "6 s, 0.2 GB"
    spent("report", "--iteration", 23, "--log", log, "-o", folder / "table.html")  # predictions are kept then
    for form in ("html", "md", "csv"):
        seconds, _, peak = spent(
            "report", "--iteration", 23, "--log", log, "--format", form, "-o", folder / "table.out"
        )
        size = (folder / "table.out").stat().st_size / 1e6
        yield (
            f"`report` of it as {form}",
            f"{seconds:.1f} s, {peak:.2f} GB, {size:.1f} MB",
            "5 s, 3 MB" * (form == "html"),
        )


def of_records(folder):
    path, share = folder / "big.db", folder / "share"
    times = []
    with Log(path) as log:
        for k in range(50):
            row = reading("23 triX", "650", uid=f"single {k}")
            start = time.perf_counter()
            log.add([row])
            times.append(time.perf_counter() - start)
    yield "`Log.add` of one reading, to the disk, by the clock", f"{1e3 * sorted(times)[25]:.1f} ms", "15 ms"
    for what, log in (("to a folder", path), ("to an empty log", folder / "other.db"), ("that are there", path)):
        seconds, _, peak = spent("log", "sync", share, "--log", log)
        yield f"`log sync` of {READINGS} records {what}", f"{seconds:.1f} s, {peak:.2f} GB", "5 s, 0.5 GB"
    seconds, _, peak = spent("log", "verify", "--log", path)
    yield f"`log verify` of {READINGS} records", f"{seconds:.1f} s, {peak:.2f} GB", "3 s"
    with Log(path) as log:
        for k in range(9):
            log.add(dataclasses.replace(row, uid=f"{k} {row.uid}") for row in log.readings(last=READINGS))
    seconds, _, peak = spent("log", "verify", "--log", path)
    yield f"`log verify` of {10 * READINGS} records", f"{seconds:.1f} s, {peak:.2f} GB", "30 s"


def of_an_iteration(folder):
    """Comparison of readings of one iteration: 1000 specimens of eight designs."""
    of = [f"{kind} .{film}mm {copy}" for kind in ("triX", "triY", "sqXY", "sqYX") for film in (1, 2)
          for copy in range(2, 127)]  # fmt: skip
    rows = [reading(f"23 {name}", f"0.{60 + k % 30}k", f"{40 + k % 7} / 2.{k % 9 + 1}k") for k, name in enumerate(of)]
    for command, count, target in (("report", READINGS, "14 s, 1 GB"), ("fit", 10 * READINGS, "1 GB")):
        path = folder / f"{command}.db"
        with Log(path, create=True) as log:
            log.add(dataclasses.replace(row, uid=f"{k}-{row.uid}") for k in range(count // len(rows)) for row in rows)
        how = ("-o", folder / "report.html") if command == "report" else ("--dry-run",)
        seconds, _, peak = spent(command, "--iteration", 23, "--log", path, *how)
        yield f"`{command}` of {count} readings of an iteration", f"{seconds:.1f} s, {peak:.2f} GB", target


def of_a_recording(folder):
    rng = np.random.default_rng(0)
    t = np.arange(SAMPLES) / 140
    z = (1e4 - 1e5j) / np.sqrt(TONES_HZ) * (1 + 1e-3 * rng.standard_normal((SAMPLES, 7)))
    settings = np.empty((1, 1), object)
    settings[0, 0] = {"bandwidth": 10.0, "dem_freqs": np.array(TONES_HZ), "version": "V1.0.3"}
    content = {
        "impedance_data": {"lockin1": z},
        "impedance_time": t[None],
        "timestamps": 1.66e9 + t[:, None],
        "settings": settings,
    }
    scipy.io.savemat(folder / "run.mat", content)
    seconds, said, peak = spent("log", "bench", "23 triX", folder / "run.mat", "--log", folder / "run.db")
    assert f"{SAMPLES} samples" in said, said
    size = (folder / "run.mat").stat().st_size / 1e6
    yield f"`log bench` of {SAMPLES} samples x 7 tones, {size:.0f} MB", f"{seconds:.1f} s, {peak:.2f} GB", "5 s, 1 GB"


def of_chance(folder, about, program, count, target):
    place = folder / program
    place.mkdir()
    start = time.monotonic()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, TESTS / program, place, str(count), "1"], capture_output=True, text=True, check=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seen = json.loads(done.stdout)
    faults = seen.pop("faults")
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    said = about + ": " + ", ".join(f"{value} {name}" for name, value in seen.items())
    yield (
        f"{said}; {used:.0f} s of the processor, {time.monotonic() - start:.0f} s by the clock",
        f"{len(faults)} faults {faults or ''}".strip(),
        target,
    )


def main():
    print(platform.processor() or platform.machine(), "Python", platform.python_version())
    lines = [
        "# The log, measured",
        "",
        "Written by `python bench/log.py`.",
        "",
        "| what | measured | target |",
        "|---|---|---|",
    ]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for work in (
            of_readings(folder),
            of_a_table(folder),
            of_records(folder),
            of_an_iteration(folder),
            of_a_recording(folder),
            of_chance(folder, "`kill -9` at random moments", "kills.py", KILLS, "200 kills, 0 faults"),
        ):
            for what, got, target in work:
                lines.append(f"| {what} | {got} | {target} |")
                print(lines[-1], flush=True)
    (HERE / "results" / "log.md").write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    main()
