"""Imports that are killed at random moments, and a look at the log after each: ``python kills.py FOLDER KILLS SEED``.

A child logs table after table and recording after recording, and tells each one that it was promised is logged. After
``kill -9`` everything promised has to be there, nothing by halves, and the database sound. Prints what it saw as JSON.
"""

import json
import os
import random
import signal
import sqlite3
import sys
import time
from hashlib import sha256
from pathlib import Path

from sensorgen.measure.log import BenchRun, Log, Reading, files, verify

ROWS = 20  # of a table
MOST = 2  # imports that a child may end before it is killed in the next one
NAME = {"specimen": "23 triX", "iteration": 23, "shape": "tri", "written": "23 triX"}


def work(path, run, pipe):
    """Log without end; nobody returns from here."""
    for k in range(1_000_000):
        key = f"{run}-{k}"
        with Log(path, create=True) as log:
            if k % 3 == 2:
                raw = path.with_name(f"{run}.raw")
                raw.write_bytes(sha256(key.encode()).digest() * 4096)
                kept = files.keep(log.files, raw)
                log.add([kept, BenchRun(uid=key, file=kept.uid, **NAME)])
            else:
                log.add(Reading(uid=f"{key}-{j}", remark="x" * 200, **NAME) for j in range(ROWS))
        os.write(pipe, f"{key}\n".encode())


def killed(path, run, rng, pace):
    """What a child promised until it was killed in the midst of an import; ``pace`` holds how long one takes [s]."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(read)
            work(path, run, write)
        finally:
            os._exit(1)
    os.close(write)
    with os.fdopen(read) as promised:
        began = time.monotonic()
        said = [promised.readline() for _ in range(rng.randrange(MOST + 1))]
        if said:
            pace[0] = (time.monotonic() - began) / len(said)
        time.sleep(rng.uniform(0, 1.2 * pace[0]))
        os.kill(child, signal.SIGKILL)
        said += promised
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status), "the child ended by itself"
    return [line.strip() for line in said if line.endswith("\n")]


def look(path, promised):
    """Faults of the log after a kill, by SQLite itself and by what was promised."""
    if not path.exists():
        return [f"{key} is lost" for key in promised]
    found = []
    connection = sqlite3.connect(path)
    try:
        found += [str(row) for row in connection.execute("PRAGMA integrity_check") if row != ("ok",)]
        uids = {uid for (uid,) in connection.execute("SELECT uid FROM record WHERE kind = 'reading'")}
        runs = {uid for (uid,) in connection.execute("SELECT uid FROM record WHERE kind = 'bench_run'")}
    finally:
        connection.close()
    tables = {}
    for uid in uids:
        tables.setdefault(uid.rpartition("-")[0], set()).add(uid)
    found += [f"{key} is there by halves" for key, rows in tables.items() if len(rows) != ROWS]
    return found + [f"{key} is lost" for key in promised if key not in tables and key not in runs]


def main(folder, kills, seed):
    """Kill, look, and say what was seen."""
    path, rng = Path(folder) / "log.db", random.Random(seed)
    promised, faults, idle, pace = [], [], 0, [0.01]
    for run in range(kills):
        said = killed(path, run, rng, pace)
        idle += not said
        promised += said
        faults += look(path, promised)
    with Log(path) as log:
        faults += list(verify.faults(log))
        rows = log.count(Reading) + log.count(BenchRun)
    counts = {"kills": kills, "promised": len(promised), "rows": rows}
    print(json.dumps(counts | {"before any promise": idle, "faults": faults}))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
