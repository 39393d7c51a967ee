"""Whatever happens while the log is written: what was promised is there, nothing is there by halves, and it says so."""

import json
import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from sensorgen.core.errors import Unwritable
from sensorgen.measure.log import Log, Reading, verify
from sensorgen.measure.log.notes import reading

HERE = Path(__file__).parent

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals and limits of POSIX")


@pytest.mark.parametrize("kills", [20, pytest.param(200, marks=pytest.mark.nightly)])
def test_killed_at_random_moments(tmp_path, kills):
    words = [sys.executable, HERE / "kills.py", tmp_path, str(kills), "7"]
    done = subprocess.run(words, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["faults"] == []
    assert found["promised"] > kills / 2
    assert [p.name for p in tmp_path.glob(".*.part")] == []


@pytest.fixture
def command(forked, tmp_path):
    """Run a command beside a log, whose files may grow up to a limit [bytes]."""

    def run(path, *words, limit):
        return forked("log", *words, "--log", path, cwd=tmp_path, FSIZE=limit)

    return run


def assert_told(done, *said):
    assert done.code == 2, done.err
    assert done.err.count("\n") == 1
    assert "Traceback" not in done.err
    assert any(word in done.err for word in said), done.err


@pytest.mark.parametrize("room", [0, 40])
def test_a_full_disk_is_told_and_costs_nothing(tmp_path, room, command):
    path = tmp_path / "log.db"
    with Log(path, create=True) as log:
        log.add([reading("23 triX", "650")])
        before = log.readings()
    assert_told(command(path, "import", "--thesis", limit=room << 10), "cannot write to the log", "File too large")
    with Log(path) as log:
        assert log.readings() == before
        assert list(verify.faults(log)) == []
    assert "69 of 69" in command(path, "import", "--thesis", limit=1 << 30).out


def test_no_room_for_a_new_log_or_a_raw_file(tmp_path, command):
    done = command(tmp_path / "log.db", "import", "--thesis", limit=10_000)
    assert_told(done, "cannot use the log", "File too large")
    assert list(tmp_path.iterdir()) == []
    with Log(tmp_path / "log.db", create=True):
        pass
    rows = "".join(f"{k},-{k},{k}\n" for k in range(1, 40_000))
    (tmp_path / "run.csv").write_text(f"re_ohm_1kHz,im_ohm_1kHz,time_s\n{rows}")
    done = command(tmp_path / "log.db", "bench", "23 triX", tmp_path / "run.csv", limit=200_000)
    assert_told(done, "cannot write", "File too large")
    assert [p for p in (tmp_path / "log.db.files").rglob("*") if p.is_file()] == []


def test_a_disk_that_is_really_full(tmp_path):
    place = tmp_path / "disk"
    place.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=400k", "none", place], capture_output=True, encoding="utf-8"
    )
    if mounted.returncode:
        pytest.skip(f"cannot mount a small disk here: {mounted.stderr.strip()}")
    try:
        promised = 0
        with Log(place / "log.db", create=True) as log, suppress(Unwritable):
            for k in range(1000):
                log.add([Reading(uid=f"{k}-{j}", specimen="23 triX", written="x" * 100) for j in range(20)])
                promised += 20
            pytest.fail("the disk never filled")
        with Log(place / "log.db") as log:
            assert log.count(Reading) == promised > 0
            assert list(verify.faults(log)) == []
    finally:
        subprocess.run(["umount", place], check=True)
