"""Live inversion: rows come at a rate through a pipe, answers go out; writes results/live.md.

The specimen is a virtual one (tests/virtual_specimen), calibrated by 30 known presses. A row waits from when it was
sent until its answer is read; the beginning of the program and the table for its noise are left out.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from sensorgen.analysis import calibration
from sensorgen.measure.log import Log, prints
from sensorgen.measure.log.bench import log_recording
from sensorgen.prediction.bodies import drawn as drawn_body
from virtual_specimen import TONES_HZ, drawn, recorded, session, write_csv

RATES_HZ = (100, 1000, 5000, 10_000, 1_000_000)  # the last: as fast as they are taken
SECONDS, FIRST = 6.0, 400  # the first rows begin the program


def lines(truth, folder, count=2000):
    """Rows of readings, of which every tenth is at rest."""
    made = session(truth, count, 5, (0.5, 5.5))
    rest = np.arange(count) % 10 == 0
    z = np.where(rest[:, None], made.rest_ohm, made.pressed_ohm)
    write_csv(folder / "rows.csv", np.arange(count) / 10, z, TONES_HZ, rest=rest.astype(float))
    header, *rows = (folder / "rows.csv").read_bytes().splitlines(keepends=True)
    return header, rows


def timed(rate_hz, header, rows, environment, *words):
    """Answers per second, seconds from row to answer, median and 95 %, and share of rows that were answered."""
    command = [sys.executable, "-m", "sensorgen", "invert", "S1", "-", *words]
    count = FIRST + int(min(rate_hz * SECONDS, 60_000))
    sent, answered = np.zeros(count), []
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, env=environment) as program:

        def read():
            program.stdout.readline()
            answered.extend((time.perf_counter(), int(float(line.partition(b",")[0]))) for line in program.stdout)

        reader = threading.Thread(target=read)
        reader.start()
        program.stdin.write(header + b"".join(numbered(rows, range(FIRST))))
        program.stdin.flush()
        while not answered or answered[-1][1] < FIRST - 1:
            time.sleep(0.01)
        start, at = time.perf_counter(), FIRST
        while at < count:
            due = min(count, FIRST + int((time.perf_counter() - start) * rate_hz) + 1)
            if due > at:
                sent[at:due] = time.perf_counter()
                program.stdin.write(b"".join(numbered(rows, range(at, due))))
                program.stdin.flush()
                at = due
            time.sleep(0.0005)
        program.stdin.close()
        reader.join()
    late = [(at, k) for at, k in answered if k >= FIRST]
    waits = [at - sent[k] for at, k in late]
    per_s = len(late) / (late[-1][0] - start)
    return per_s, statistics.median(waits), float(np.quantile(waits, 0.95)), len(late) / (count - FIRST)


def numbered(rows, numbers):
    """Rows again and again, each with its number in place of its time."""
    return (b"%d,%s" % (k, rows[k % len(rows)].partition(b",")[2]) for k in numbers)


def main():
    """Measure and write."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = drawn(3, noise=1e-3, noise_by_tone=(1,) * 7)
        (folder / "mine.yaml").write_text("shape: tri\nname: mine\nparameters:\n  dielectric_mm: 0.2\n")
        recorded(truth, folder, 30, 1)
        with Log(folder / "log.db", create=True) as log:
            prints.bind(log, ["S1"], str(folder / "mine.yaml"))
            log_recording(log, "S1", folder / "run-lcr.csv", folder / "run-rig.csv")
            made = calibration.calibrate(log, ["S1"], calibration.Bench(tip_m=5e-3), body_of=drawn_body)
            log.add(calibration.rows(log, [made[0].calibration]))
        environment = os.environ | {"SENSORGEN_LOG": str(folder / "log.db")}
        header, rows = lines(truth, folder)
        table = []
        for rate in RATES_HZ:
            said = f"{rate:,}" if rate < RATES_HZ[-1] else "as fast as they are taken"
            for word in ("", "--newest"):
                per_s, median, late, share = timed(rate, header, rows, environment, *filter(None, [word]))
                table.append(
                    f"| {said} | {word} | {per_s:,.0f} | {share:.0%} | {1e3 * median:.1f} | {1e3 * late:.1f} |"
                )
                print(table[-1], flush=True)
    text = (
        "Live inversion of a calibrated specimen through a pipe: `sensorgen invert S1 -`, seven tones, noise 0.1 %, "
        "one row in ten at rest; the wait of those that were answered. "
        f"Load of this computer: {os.getloadavg()[0]:.0f} on {os.cpu_count()} cores.\n\n"
        "| rows/s sent | | rows/s answered | of all | wait, median [ms] | 95 % [ms] |\n|---|---|---|---|---|---|\n"
        + "\n".join(table)
        + "\n"
    )
    (Path(__file__).parent / "results" / "live.md").write_text(text)


if __name__ == "__main__":
    main()
