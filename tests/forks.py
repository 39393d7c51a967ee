"""Commands in processes of their own, forked from one that has loaded what takes half a second each time."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass

FORKS = """
import gc, json, os, resource, selectors, sys
import h5py, numpy, scipy.signal
from sensorgen.checks import review
from sensorgen.cli import bench_command, log_command, main, printing
from sensorgen.measure.log import Log, notes, verify
from sensorgen.measure.log import exchange
from sensorgen.measure.signal import run
from sensorgen.workflows import api, batch, build


def begun(job, ends):
    os.chdir(job["cwd"])
    os.environ.clear()
    os.environ.update(job["env"])
    for number, end in enumerate((os.open(os.devnull, os.O_RDONLY), *ends)):
        os.dup2(end, number)
    for name, limit in job["limits"].items():
        resource.setrlimit(getattr(resource, "RLIMIT_" + name), (limit, limit))
    sys.argv = ["sensorgen", *job["words"]]
    code = 1
    try:
        exec(job["before"], {})
        main()
    except SystemExit as left:
        code = left.code or 0
    except BaseException:
        sys.excepthook(*sys.exc_info())
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)


gc.freeze()  # a fork copies what it looks at
for line in sys.stdin:
    (out, told), (err, warned) = os.pipe(), os.pipe()
    child = os.fork()
    if not child:
        begun(json.loads(line), (told, warned))
    os.close(told)
    os.close(warned)
    said, left = {out: b"", err: b""}, selectors.DefaultSelector()
    for end in said:
        left.register(end, selectors.EVENT_READ)
    while left.get_map():
        for key, _ in left.select():
            piece = os.read(key.fd, 1 << 16)
            said[key.fd] += piece
            if not piece:
                left.unregister(key.fd)
                os.close(key.fd)
    _, status, used = os.wait4(child, 0)
    texts = [text.decode(errors="replace") for text in said.values()]
    print(json.dumps([os.waitstatus_to_exitcode(status), *texts, used.ru_maxrss << 10]), flush=True)
"""


@dataclass
class Done:
    """Exit code, what it said, largest resident memory [bytes]."""

    code: int
    out: str
    err: str
    resident: int


class Forks:
    """The process that forks; it ends with :meth:`close`."""

    def __init__(self, env=None):
        own = {"OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2", "PYTHONDONTWRITEBYTECODE": "1"}
        self.process = subprocess.Popen(
            [sys.executable, "-c", FORKS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8",
            env=os.environ | own | (env or {}),
        )  # fmt: skip

    def __call__(self, *words, cwd, before="pass", env=None, **limits):
        """Run a command; ``before`` is Python ahead of it, limits are those of ``resource``, as AS=2 << 30."""
        job = {"words": [*map(str, words)], "cwd": str(cwd), "before": before, "limits": limits}
        print(json.dumps(job | {"env": os.environ | (env or {})}), file=self.process.stdin, flush=True)
        return Done(*json.loads(self.process.stdout.readline()))

    def close(self):
        """End it when all are done."""
        self.process.communicate(timeout=60)
