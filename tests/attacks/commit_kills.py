"""Work on a log, killed at each call by which it changes a file: ``LD_PRELOAD=fault.so python commit_kills.py FOLDER``.

For each kind of work a fork counts its calls first; then a fork for each call, and for each way to die in it, begins
from the same log and dies there. After that the log must be sound, with all rows of the work or none, and with all if
they were acknowledged. Prints what it saw as JSON.
"""

import ctypes
import json
import os
import shutil
import sys
from pathlib import Path

from sensorgen.measure.log import BenchRun, Log, Reading, files, sync, verify
from sensorgen.measure.log.exchange import thesis_readings

FAULT = ctypes.CDLL(None)
OLD = Path(__file__).parents[1] / "reference" / "0645a80"
NEW = 20  # rows of a work


def add(path):
    with Log(path, create=True) as log:
        log.add(Reading(uid=f"new {k}", specimen="23 triX", written="23 triX", remark="x" * 300) for k in range(NEW))


def record(path):
    with Log(path) as log:
        kept = files.keep(log.files, path.with_name("run.mat"))
        rows = [Reading(uid=f"new {k}", specimen="23 triX", written="23 triX") for k in range(NEW - 1)]
        log.add([kept, BenchRun(uid="new run", specimen="23 triX", written="23 triX", file=kept.uid), *rows])


def merge(path):
    with Log(path) as log:
        sync.sync(log, path.with_name("share"))


def migrate(path):
    with Log(path) as log:
        log.count(Reading)


def begin(folder, work):
    """What is there before a work, anew each time."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    path = folder / "log.db"
    if work is migrate:
        shutil.copyfile(OLD / "log.db", path)
        shutil.copytree(OLD / "log.db.files", path.with_name("log.db.files"))
    elif work is not add:
        (folder / "run.mat").write_bytes(b"raw" * 5000)
        with Log(path, create=True) as log:
            log.add(thesis_readings()[:9])
    if work is merge:
        with Log(folder / "other.db", create=True) as other:
            add(folder / "other.db")
            sync.sync(other, folder / "share")
    return path


def forked(work, path, call, how):
    """Whether a fork that does the work and dies at a call has acknowledged it; without a call, the number of calls."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        FAULT.fault_arm(call, how)
        work(path)
        said = f"{FAULT.fault_seen()}\n"
        os.write(write, said.encode())
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        said = pipe.read()
    _, status = os.waitpid(child, 0)
    return int(said or 0), os.WIFSIGNALED(status)


def look(path, work, acknowledged):
    """Faults of what is left."""
    if not path.exists():
        return ["acknowledged, and no log"] if acknowledged else []
    with Log(path) as log:
        found = list(verify.faults(log))
        rows = [r for kind in (Reading, BenchRun) for r in log.entries(kind, superseded=True)]
        new = sum(row.uid.startswith("new") for row in rows)
        if work is migrate:
            return found + ([] if log.count(Reading, superseded=True) == 9 else ["readings lost by the migration"])
        if new not in (0, NEW) or (acknowledged and new != NEW):
            found.append(f"{new} of {NEW} rows")
        if work is not add and len(rows) - new != 9:
            found.append("rows from before are lost")
    return found


def main(folder, step):
    seen, faults = {}, []
    for work in (add, record, merge, migrate):
        path = begin(folder / "x", work)
        calls, _ = forked(work, path, 0, 0)
        kills = 0
        for call in range(1, calls + 1, step):
            for how in (0, 1, 2):
                path = begin(folder / "x", work)
                acknowledged, killed = forked(work, path, call, how)
                kills += killed
                faults += [f"{work.__name__}, call {call}, {how}: {fault}" for fault in look(path, work, acknowledged)]
        seen[work.__name__] = {"calls": calls, "kills": kills}
    print(json.dumps({**seen, "kills": sum(of["kills"] for of in seen.values()), "faults": faults[:20]}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
