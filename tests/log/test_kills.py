"""Whatever happens while the log is written: what was promised is there, nothing is there by halves, and it says so."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import pytest

from sensorgen.core.errors import Unwritable
from sensorgen.measure.log import Log, Reading, verify
from sensorgen.measure.log.notes import reading

HERE = Path(__file__).parent

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals and limits of POSIX")


def seen(program, folder, count):
    done = subprocess.run(
        [sys.executable, HERE / program, folder, str(count), "7"], capture_output=True, encoding="utf-8"
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("kills", [40, pytest.param(200, marks=pytest.mark.nightly)])
def test_killed_at_random_moments(tmp_path, kills):
    found = seen("kills.py", tmp_path, kills)
    assert found["faults"] == []
    assert found["promised"] > kills / 2
    assert [p.name for p in tmp_path.glob(".*.part")] == []


def test_files_that_were_tampered_with(tmp_path):
    found = seen("fuzz.py", tmp_path, 600)
    assert found["faults"] == []
    for name in ("table.csv", "table.parquet", "words.csv", "batch.json", "sound.db"):
        assert found[f"{name} refused"] > 20


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


@pytest.mark.parametrize("room", [0, 8, 40])
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


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="no users on this system")
def test_a_log_that_may_only_be_read():
    place = Path(tempfile.mkdtemp())  # pytest's own folders are for this user only
    path = place / "log.db"
    with Log(path, create=True) as log:
        log.add([reading("23 triX", "650")])
    place.chmod(0o555)
    path.chmod(0o444)
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        with Log(path) as log:
            assert len(log.readings()) == 1
            with pytest.raises(Unwritable, match=r"cannot write to the log .*read-only; nothing was logged"):
                log.add([reading("23 triX", "650")])
    finally:
        if root:
            os.seteuid(0)
        shutil.rmtree(place)
