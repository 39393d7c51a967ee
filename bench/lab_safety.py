"""Safety of `bench run`: planted device faults, killed and hung runs, killed guardians, memory; results/lab_safety.md.

The record of the simulated mechanism judges, not the run's own report. Faults: every kind at several moments, on a
simulated clock. Kills: the rig is in another process, on pseudo-terminals and a socket, by the real clock; the run is
the command line, killed (SIGKILL) or stopped (SIGSTOP) at random moments and resumed until its plan is done.
"""

import os

os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

import json
import resource
import subprocess
import sys
import tempfile
import time
from collections import defaultdict, deque
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "lab"))

import killing
from laboratory import HARMLESS, KINDS, MOMENTS, Planted, asked, laboratory, outcome, verdict

from sensorgen.measure.lab import run
from sensorgen.measure.log import Log

KILLS, AT_ONCE, WAYS = 200, 3, ("kill", "kill", "kill", "stop")
RESULTS = Path(__file__).parent / "results" / "lab_safety.md"


def faults() -> list[str]:
    """A row for every kind of fault."""
    rows, total, failed = [], 0, 0
    for kind in KINDS:
        up, peak, above, wrong = [], [], [], []
        for moment in MOMENTS:
            with tempfile.TemporaryDirectory() as folder:
                found, lab = outcome(Path(folder), (Planted(what=kind, **moment),))
            if kind in HARMLESS and found.end == "done":
                continue
            wrong += [f"{moment}: {each}" for each in verdict(found, lab, kind)]
            peak.append(lab.mechanism.peak_n)
            above.append(max((v.duration_s for v in lab.mechanism.violations if v.what == "force"), default=0.0))
            up.append(max(lab.watched.last_down_s - lab.watched.struck_s, 0.0))
        total, failed = total + len(peak), failed + bool(wrong)
        if peak:
            rows.append(f"| {kind} | {len(peak)} | {max(up):.2f} | {max(peak):.2f} | {max(above) / 0.01:.1f} | "
                        f"{'; '.join(wrong) or 'none'} |")  # fmt: skip
    head = ["| fault | planted | tip up after at most [s] | largest force [N] | above the limit [periods] | unsafe |",
            "|---|---:|---:|---:|---:|---|"]  # fmt: skip
    return [f"{total} faults planted, {failed} kinds with an unsafe end. Limit 7 N.", "", *head, *rows]


def kills(seed: int, count: int) -> None:
    """Kill runs, a JSON line each; a process of its own."""
    with tempfile.TemporaryDirectory() as folder, killing.Served() as rig:
        for found in killing.many(Path(folder), rig, seed, count, WAYS):
            print(json.dumps(vars(found)), flush=True)
        state = rig.state()
        print(json.dumps({"violations": state["violations"], "peak_n": state["peak_n"]}), flush=True)


def all_kills(count: int) -> list[str]:
    """Several processes of kills at once."""
    each = [count // AT_ONCE + (k < count % AT_ONCE) for k in range(AT_ONCE)]
    words = [[sys.executable, __file__, "kills", str(k), str(n)] for k, n in enumerate(each)]
    running = [subprocess.Popen(line, stdout=subprocess.PIPE, text=True) for line in words]
    lines = [json.loads(line) for process in running for line in process.communicate()[0].splitlines()]
    assert sum("violations" in line for line in lines) == AT_ONCE, "a part of the kills has failed"
    return summary(lines)


def summary(lines: list[dict[str, Any]]) -> list[str]:
    """Killed runs by the way in which they ended."""
    ends = [line for line in lines if "violations" in line]
    by_way = defaultdict(list)
    for line in lines:
        if "way" in line:
            by_way[line["way"]].append(line)
    rows = ["| way | runs | tip down then | tip up after, median [s] | at most [s] | not up | not raised or motor on |",
            "|---|---:|---:|---:|---:|---:|---:|"]  # fmt: skip
    for way, found in sorted(by_way.items()):
        down = sorted(each["up_s"] for each in found if each["down"]) or [0.0]
        rows.append(f"| {way} | {len(found)} | {sum(each['down'] for each in found)} | {down[len(down) // 2]:.3f} | "
                    f"{max(each['up_s'] for each in found):.3f} | {sum(each['up_s'] > 5 for each in found)} | "
                    f"{sum(not each['raised'] for each in found)} |")  # fmt: skip
    violations = [v for end in ends for v in end["violations"]]
    return [
        f"{sum(map(len, by_way.values()))} runs ended; every one was resumed until its plan was done, and its"
        f" recordings read from the log. Dead man's time {killing.DEAD_MAN_S:g} s. Largest force"
        f" {max(end['peak_n'] for end in ends):.2f} N; violations: {violations or 'none'}.", "", *rows,
    ]  # fmt: skip


def memory() -> list[str]:
    """Peak memory of a process that runs a minute and one that runs an hour of simulated time."""
    rows = [
        "| simulated [min] | wall time [s] | peak memory [MiB] | impedances | rig rows |",
        "|---:|---:|---:|---:|---:|",
    ]
    for minutes in (1, 10, 60):
        words = [sys.executable, __file__, "hour", str(minutes)]
        seconds, peak, count, rig = subprocess.run(words, check=True, capture_output=True, text=True).stdout.split()
        rows.append(f"| {minutes} | {float(seconds):.0f} | {float(peak):.0f} | {count} | {rig} |")
    return rows


def hour(minutes: float) -> None:
    """Run for some minutes of simulated time, and print wall time, peak memory, impedances and rows."""
    lab = laboratory()
    for simulator in (lab.simulators["actuator"], lab.simulators["stage"]):
        simulator.heard = deque(maxlen=1000)
    plan = [{"random": {"presses": 1000, "seed": 1}}]
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, Log(Path(folder) / "log.db", create=True) as log:
        experiment = asked(plan=plan, stop={"minutes": minutes}, limits={"hours": 20})
        kept = run.recorder.log_attempts
        run.recorder.log_attempts = lambda *_: []  # the run alone: logging reads the recording in parts, measured apart
        found = run.run(experiment, clock=lab.clock, log=log, rig=lab.rig, simulated=True)
        run.recorder.log_attempts = kept
        rows = sum(1 for file in Path(found.folder).glob("*-rig.csv") for _ in file.open()) - 1
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(time.monotonic() - begun, peak, found.counts["read"], rows)


def main() -> None:
    parts = {"Device faults": faults, f"{KILLS} killed and hung runs": lambda: all_kills(KILLS), "Memory": memory}
    text = ["# Safety of `bench run`", "", *(__doc__ or "").splitlines(), ""]
    for title, part in parts.items():
        text += [f"## {title}", "", *part(), ""]
        print(title, flush=True)
    RESULTS.write_text("\n".join(text), encoding="utf-8")


if __name__ == "__main__":
    if sys.argv[1:2] == ["kills"]:
        kills(int(sys.argv[2]), int(sys.argv[3]))
    elif sys.argv[1:2] == ["hour"]:
        hour(float(sys.argv[2]))
    else:
        main()
