"""Run sensorgen in a process with little memory, and see how much it took."""

import os
import resource
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


def run(*words, cwd, addresses=ADDRESSES, env=None, program=("-m", "sensorgen")):
    """Run a command of sensorgen; no more than ``addresses`` bytes of addresses."""

    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (addresses, addresses))

    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2", **(env or {})}
    with (cwd / "child.out").open("w+b") as out, (cwd / "child.err").open("w+b") as err:
        process = subprocess.Popen(
            [sys.executable, *program, *map(str, words)], cwd=cwd, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
            env=environment, preexec_fn=limit,
        )  # fmt: skip
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = code = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        return Done(code, out.read().decode(), err.read().decode(), used.ru_maxrss << 10)


def refused(done):
    """The one line with which it was refused."""
    assert done.code == 2, (done.code, done.err)
    (line,) = done.err.splitlines()
    assert line.startswith("sensorgen: "), line
    assert "please report" not in line
    return line
