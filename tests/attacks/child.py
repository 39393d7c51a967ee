"""Run sensorgen in a process with little memory, and see how much it took."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass

ADDRESSES = 2 << 30  # bytes: libraries and files on the disk count, too


@dataclass
class Done:
    """Exit code, what it said, largest resident memory [bytes]."""

    code: int
    out: str
    err: str
    resident: int


LAUNCH = """
import os, resource, sys
limit, report, *words = sys.argv[1:]
resource.setrlimit(resource.RLIMIT_AS, (int(limit), int(limit)))
child = os.posix_spawn(words[0], words, os.environ)
_, status, used = os.wait4(child, 0)
open(report, "w").write(f"{os.waitstatus_to_exitcode(status)} {used.ru_maxrss << 10}")
"""


def run(*words, cwd, addresses=ADDRESSES, env=None, program=("-m", "sensorgen")):
    """Run a command of sensorgen; no more than ``addresses`` bytes of addresses.

    A small process in between starts it: the kernel counts what a process's parent had as its own.
    """
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2", **(env or {})}
    report = cwd / "child.used"
    launch = [sys.executable, "-S", "-c", LAUNCH, str(addresses), str(report)]
    done = subprocess.run(
        [*launch, sys.executable, *program, *map(str, words)], cwd=cwd, stdin=subprocess.DEVNULL, capture_output=True,
        env=environment,
    )  # fmt: skip
    code, resident = map(int, report.read_text().split())
    return Done(code, done.stdout.decode(), done.stderr.decode(), resident)


FORKS = """
import gc, json, os, resource, sys
import numpy, h5py, scipy.signal
from sensorgen.cli import bench_command, bench_show, check_command, main
from sensorgen.checks import review
from sensorgen.measure.signal import hysteresis
from sensorgen.workflows import api, batch
gc.freeze()  # a fork copies what it looks at
for line in sys.stdin:
    job = json.loads(line)
    child = os.fork()
    if not child:
        os.chdir(job["cwd"])
        os.environ.clear()
        os.environ.update(job["env"])
        modes = os.O_WRONLY | os.O_CREAT | os.O_TRUNC
        for number, place, mode in ((0, os.devnull, os.O_RDONLY), (1, "child.out", modes), (2, "child.err", modes)):
            os.dup2(os.open(place, mode, 0o600), number)
        resource.setrlimit(resource.RLIMIT_AS, (job["addresses"],) * 2)
        sys.argv = ["sensorgen", *job["words"]]
        try:
            main()
        except SystemExit as left:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(left.code or 0)
    _, status, used = os.wait4(child, 0)
    print(os.waitstatus_to_exitcode(status), used.ru_maxrss << 10, flush=True)
"""


class Forks:
    """One process that has loaded what takes half a second each time, and forks for each command."""

    def __init__(self):
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2"}
        self.process = subprocess.Popen(
            [sys.executable, "-c", FORKS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8",
            env=environment,
        )  # fmt: skip

    def __call__(self, *words, cwd, addresses=ADDRESSES):
        """As :func:`run`."""
        job = {"words": [*map(str, words)], "cwd": str(cwd), "addresses": addresses, "env": {**os.environ}}
        print(json.dumps(job), file=self.process.stdin, flush=True)
        code, resident = map(int, self.process.stdout.readline().split())
        out, err = (cwd / f"child.{end}" for end in ("out", "err"))
        return Done(code, out.read_text("utf-8"), err.read_text("utf-8"), resident)


def refused(done):
    """The one line with which it was refused."""
    assert done.code == 2, (done.code, done.err)
    (line,) = done.err.splitlines()
    assert line.startswith("sensorgen: "), line
    assert "please report" not in line
    return line
