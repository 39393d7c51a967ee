"""The log under attack: killed inside commits, bits flipped. ``make attack`` does all of it, ``make test`` a part."""

import json
import os
import random
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

from sensorgen.core.errors import SensorgenError
from sensorgen.measure.log import Log, verify
from sensorgen.measure.log.exchange import thesis_readings
from sensorgen.measure.log.prints import prediction

HERE = Path(__file__).parent
LONG = bool(os.environ.get("SENSORGEN_ATTACK"))
FLIPS = 3500 if LONG else 120


@pytest.mark.parametrize(("every", "least"), [(1, 1000)] if LONG else [
    (50, 25), pytest.param(7, 200, marks=pytest.mark.nightly)
])  # fmt: skip
def test_killed_at_calls_inside_commits(tmp_path, every, least):
    """Deaths at calls that change a file: before it, after half of its bytes, after it."""
    if sys.platform != "linux" or shutil.which("cc") is None:
        pytest.skip("needs Linux and a C compiler")
    shim = tmp_path / "fault.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", shim, HERE / "fault.c", "-ldl"], check=True)
    done = subprocess.run(
        [sys.executable, HERE / "commit_kills.py", tmp_path, str(every)], capture_output=True, encoding="utf-8",
        env={**os.environ, "LD_PRELOAD": str(shim)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["faults"] == []
    assert found["kills"] >= least


def content(path):
    """What a log says, read by SQLite itself."""
    with closing(sqlite3.connect(path)) as file:
        return file.execute("SELECT sequence, id, kind, logged_at, content, number FROM record").fetchall()


def test_flipped_bits_change_nothing_unseen(tmp_path):
    """A flip is found by opening or by ``verify``, or it lies where nothing of the content does."""
    path, other = tmp_path / "log.db", tmp_path / "other.db"
    with Log(path, create=True) as log:
        log.add([*thesis_readings(), prediction("d", "trix", {"capacitance_f": {"lower": 1e-11, "upper": 2e-11}})])
        log.pragma("wal_checkpoint(TRUNCATE)")
    whole, before, rng = path.read_bytes(), content(path), random.Random(11)
    told = 0
    for _ in range(FLIPS):
        flipped = bytearray(whole)
        flipped[rng.randrange(len(whole))] ^= 1 << rng.randrange(8)
        for left in ("", "-wal", "-shm"):
            Path(f"{other}{left}").unlink(missing_ok=True)
        other.write_bytes(flipped)
        try:
            with Log(other) as log:
                found = list(verify.faults(log))
                rows = [] if found else content(other)
        except SensorgenError:
            told += 1
            continue
        told += bool(found)
        assert found or rows == before
    assert told > FLIPS / 4
