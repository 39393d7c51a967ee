"""Runs of the command line on a rig in another process, which are killed, stopped or robbed of their guardian."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import yaml

from sensorgen.measure.lab import recorder
from sensorgen.measure.log import Log
from sensorgen.measure.log.bench import read_again
from sensorgen.measure.recording import parts

HERE = Path(__file__).parent
DEAD_MAN_S = 1.0


class Served:
    """The rig in its process; use it in a ``with`` statement."""

    def __enter__(self) -> Self:
        self._process = subprocess.Popen(
            [sys.executable, str(HERE / "served.py")], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.places = json.loads(self._process.stdout.readline())
        return self

    def __exit__(self, *_: object) -> None:
        self._process.stdin.close()
        self._process.wait(10)
        self._process.stdout.close()

    def state(self) -> dict[str, Any]:
        """What the mechanism has to say."""
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())


def experiment(folder: Path, places: dict[str, str], presses: int = 12, **changes: Any) -> Path:
    """A quick experiment at the addresses of a served rig."""
    plan = [{"sweep": {"force_n": 4.0, "position_mm": [20, 80], "places": presses, "hold_s": 1.5, "rest_s": 0.5}}]
    data = {
        "specimen": "24 SX60",
        "devices": {
            "actuator": {"kind": "smac-lcc10", "address": places["actuator"], "settings": {"friction_n": 0.2}},
            "stage": {"kind": "reprapfirmware", "address": places["stage"], "settings": {"lift_mm_s": 100.0}},
            "impedance": {"kind": "hp-4284a", "address": places["impedance"], "settings": {}},
        },
        "readout": {"tones_hz": [10000, 100000], "voltage_v": 1.0},
        "approach": {"speed_mm_s": 100.0, "landing_mm_s": 20.0, "travel_mm_s": 200.0},
        "limits": {"dead_man_s": DEAD_MAN_S},
        "plan": plan,
    } | changes  # fmt: skip
    file = folder / "e.yaml"
    file.write_text(yaml.safe_dump(data))
    return file


@dataclass
class Started:
    """A run of the command line."""

    process: subprocess.Popen
    log: Path
    lines: list[str] = field(default_factory=list)

    @property
    def folder(self) -> Path:
        """Of its run."""
        return sorted(recorder.home(self.log).glob("*/"))[-1]

    def events(self, kind: str) -> list[dict[str, Any]]:
        """Of the journal, so far."""
        try:
            return list(recorder.RunFolder.read(self.folder).of(kind))
        except Exception:
            return []

    def guardian(self) -> int:
        """Number of the guardian's process; 0 where there is none."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        return next((int(p) for p in children if b"guardian" in Path(f"/proc/{p}/cmdline").read_bytes()), 0)


def start(file: Path, log: Path, *, resume: str = "") -> Started:
    """Start a run, or go on with one."""
    words = ["--resume", resume] if resume else [str(file)]
    process = subprocess.Popen(
        [sys.executable, "-m", "sensorgen", "bench", "run", *words, "--yes", "--no-page", "--log", str(log), "--json"],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    return Started(process, log)


def seconds_to_tip_up(rig: Served, timeout_s: float = 20.0) -> float:
    """Until the mechanism's tip is up to stay, from now on."""
    begun, up_since = time.monotonic(), None
    while time.monotonic() - begun < timeout_s:
        if rig.state()["tip_mm"] < 1.0:
            up_since = None
        elif up_since is None:
            up_since = time.monotonic()
        elif time.monotonic() - up_since > 0.5:
            return up_since - begun
        time.sleep(0.005)
    return float("inf")


def gone(pid: int, timeout_s: float = 60.0) -> bool:
    """Whether a process ends in time; one that nobody waits for counts as ended."""
    until = time.monotonic() + timeout_s
    while time.monotonic() < until:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return True
        if state == "Z":
            return True
        time.sleep(0.02)
    return False


def at_rest(rig: Served, timeout_s: float = 20.0) -> bool:
    """Wait until the motor is off; true if the tip is up.

    Switching off is not answered: the guardian may have ended before the rig reads its last order, and the motor's
    force dies away after that.
    """
    until = time.monotonic() + timeout_s
    while abs((state := rig.state())["motor_n"]) >= 1e-3 and time.monotonic() < until:
        time.sleep(0.02)
    return state["tip_mm"] >= 1.0 and abs(state["motor_n"]) < 1e-3


def reports(run: Started) -> list[dict[str, Any]]:
    """The guardian's reports of its rescues."""
    from sensorgen.measure.lab.guardian import REPORT

    file = run.folder / REPORT
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def readable(run: Started) -> int:
    """Impedances in the files that a killed run has left, read as any recording."""
    count = 0
    for event in run.events("begun"):
        file = run.folder / f"{event['stem']}.csv"
        if file.exists() and file.read_bytes().count(b"\n") > 1:
            count += sum(len(one.time_s) for part in parts(file) for one in part)
    return count


@dataclass(frozen=True)
class Killed:
    """What became of the rig.

    ``way`` is how the run was stopped, ``down`` whether the tip was down then, ``up_s`` the time until the tip was up
    to stay [s], ``raised`` whether the motor is off and the piston reaches nothing after the rescue, ``readings`` how
    many impedances the files have, ``told`` the guardian's last report.
    """

    way: str
    down: bool
    up_s: float
    raised: bool
    readings: int
    told: dict[str, Any]


def killed(rig: Served, run: Started, way: str = "kill") -> Killed:
    """Kill, or stop, a run that goes on, and see what becomes of the tip."""
    guardian = run.guardian()
    down = rig.state()["tip_mm"] < 1.0
    os.kill(run.process.pid, {"kill": signal.SIGKILL, "stop": signal.SIGSTOP}[way])
    up_s = seconds_to_tip_up(rig)
    try:
        run.process.communicate(timeout=10)
    except subprocess.TimeoutExpired:  # stopped before it began, or when it had ended and the guardian was released
        assert rig.state()["tip_mm"] >= 1.0
        os.kill(run.process.pid, signal.SIGKILL)
        run.process.communicate()
    raised = (not guardian or gone(guardian)) and at_rest(rig)
    return Killed(way, down, up_s, raised, readable(run), (reports(run) or [{}])[-1])


def many(folder: Path, rig: Served, seed: int, kills: int, ways: tuple[str, ...] = ("kill",)) -> Iterator[Killed]:
    """Kill runs at random moments, going on with each until it is whole; raises where one does not go on."""
    rng = random.Random(seed)
    count = 0
    while count < kills:
        log = folder / f"{count}.db"
        with Log(log, create=True):
            pass
        run = start(experiment(folder, rig.places, presses=4), log)
        for _ in range(100):
            if count < kills and _moment(rig, run, rng):
                yield killed(rig, run, ways[count % len(ways)])
                count += 1
            elif run.process.wait(120) == 0:
                break
            run.process.communicate()
            run = start(folder, log, resume=run.folder.name)
        whole(run)


def _moment(rig: Served, run: Started, rng: random.Random) -> bool:
    """Wait for a random moment of a run, two in three with the tip down; False where the run ends before."""
    pressing, before = rng.random() < 2 / 3, len(run.events("identified"))
    while not (rig.state()["force_n"] > 1.0 if pressing else len(run.events("identified")) > before):
        if run.process.poll() is not None:
            return False
        time.sleep(0.02)
    try:
        run.process.wait(rng.uniform(0.0, 1.5 if pressing else 6.0))
    except subprocess.TimeoutExpired:
        return True
    return False


def whole(run: Started) -> None:
    """Check that a run has done all of its steps, and that each of its recordings can be read from the log."""
    out, err = run.process.communicate(timeout=120)
    assert run.process.returncode == 0, (run.process.returncode, out[-500:], err[-800:])
    assert json.loads(out)["done"] == 4
    with Log(run.log) as log:
        rows = log.recordings()
        begun = run.events("begun")
        assert {row.source for row in rows} <= {f"{each['stem']}.csv" for each in begun}
        assert rows
        for row in rows:
            found, _ = read_again(log, row)
            assert sum(len(one.time_s) for part in found for one in part) > 0
