"""Run sensorgen in a process with little memory, and see how much it took."""

import os
import subprocess
import sys

from forks import Done

ADDRESSES = 2 << 30  # bytes: libraries and files on the disk count, too


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


def refused(done):
    """The one line with which it was refused."""
    assert done.code == 2, (done.code, done.err)
    (line,) = done.err.splitlines()
    assert line.startswith("sensorgen: "), line
    assert "please report" not in line
    return line
