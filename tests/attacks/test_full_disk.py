"""A log on a full or read-only file system is read like any other; what cannot be logged is said."""

import os
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from sensorgen.measure.log import Log, Reading

NOBODY = 65534
COMMANDS = ("list", "verify")


def reading(number):
    return Reading(uid=str(number), specimen=f"S{number}", written=f"S{number}", y_ohm=(680.0,))


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "log.db"
    with Log(path, create=True) as log:
        log.add([reading(number) for number in range(3)])
    return path


@contextmanager
def unmerged(path):
    """A log whose last row is in the write-ahead log alone, as a killed program leaves it."""
    with Log(path) as log, closing(sqlite3.connect(path)) as reader:
        log._connection.execute("PRAGMA wal_autocheckpoint = 0")
        reader.execute("BEGIN")
        reader.execute("SELECT count(*) FROM record").fetchone()
        log.add([reading(7)])
        yield


def mounted(place, script, *words):
    """Outcome of a shell script in a name space of its own, whose first word is a folder to mount at."""
    place.mkdir()
    command = ["unshare", "-m", "sh", "-c", script, "sh", str(place), *map(str, words), sys.executable]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    if "unshare" in done.stderr or "mount:" in done.stderr:
        pytest.skip(done.stderr)
    return done


@pytest.mark.parametrize("killed", [False, True], ids=["checkpointed", "rows in the write-ahead log"])
def test_a_full_disk_lets_read_and_says_what_is_not_logged(path, killed, forked, tmp_path):
    if killed:
        copy = path.parent / "copy"
        copy.mkdir()
        with unmerged(path):
            for end in ("", "-wal"):
                shutil.copy(f"{path}{end}", copy)
        path = copy / "log.db"
        with closing(sqlite3.connect(f"{path.as_uri()}?immutable=1", uri=True)) as without:
            assert without.execute("SELECT count(*) FROM record WHERE specimen = 'S7'").fetchone() == (0,)
    expected = ["S0", "S1", "S2", *(["S7"] if killed else [])]
    for command in COMMANDS:
        done = forked("log", command, "--log", path, cwd=tmp_path, FSIZE=0)
        assert (done.code, done.err) == (0, ""), done
        if command == "list":
            assert [name for name in (*expected, "S8") if name in done.out] == expected
    done = forked("log", "add", "23 triX", "--y", "680", "--log", path, cwd=tmp_path, FSIZE=0)
    assert done.code == 2
    assert done.err.count("\n") == 1
    assert "nothing was logged" in done.err, done.err


@pytest.mark.skipif(os.name == "nt" or os.getuid() != 0, reason="only root can mount, and become another user")
def test_a_small_file_system_that_is_full(path):
    """A real one of 300 kB."""
    script = (
        'mount -t tmpfs -o size=300k none "$1" && cp "$2" "$1/log.db" && { cat /dev/zero > "$1/fill" 2>/dev/null; '
        '"$3" -m sensorgen log list --log "$1/log.db" && "$3" -m sensorgen log verify --log "$1/log.db"; }'
    )
    done = mounted(path.parent / "small", script, path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "S2" in done.stdout


@pytest.mark.skipif(os.name == "nt" or os.getuid() != 0, reason="only root can become another user")
def test_a_folder_that_another_user_may_only_read(path):
    """In a process that has given up being root, since permissions do not bind root."""
    for folder in (path.parent, *path.parent.parents[:3]):
        if folder != Path("/tmp"):
            folder.chmod(0o755)
    path.chmod(0o644)
    child = os.fork()
    if not child:
        code = 1
        try:
            os.setresgid(NOBODY, NOBODY, NOBODY)
            os.setresuid(NOBODY, NOBODY, NOBODY)
            with Log(path) as log:
                rows = [row.specimen for row in log.readings()]
                try:
                    log.add([reading(9)])
                except Exception as error:
                    told = "cannot write to the log" in str(error) and "read-only; nothing was logged" in str(error)
                    code = 0 if rows == ["S0", "S1", "S2"] and told else 2
        finally:
            os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert sorted(each.name for each in path.parent.glob("log*")) == ["log.db"]
    with closing(sqlite3.connect(path)) as connection:
        assert connection.execute("SELECT count(*) FROM record").fetchone()[0] >= 3


@pytest.mark.skipif(os.name == "nt" or os.getuid() != 0, reason="only root can mount")
def test_a_medium_that_is_read_only_shows_rows_of_the_write_ahead_log_too(path):
    """As a copy of a killed program's log, without its index."""
    script = (
        'mount -t tmpfs none "$1" && cp "$2" "$1/log.db" && cp "$2-wal" "$1/log.db-wal" && mount -o remount,ro "$1" && '
        '"$3" -m sensorgen log list --log "$1/log.db" && ! "$3" -m sensorgen log add "23 triX" --y 6 --log "$1/log.db"'
    )
    with unmerged(path):
        done = mounted(path.parent / "medium", script, path)
    assert done.returncode == 0, done
    assert "S7" in done.stdout
    assert "its disk is full or read-only; nothing was logged" in done.stderr


def test_rows_of_a_log_that_is_gone_do_not_get_into_a_new_one(path):
    with unmerged(path):
        shutil.copy(f"{path}-wal", path.parent / "kept")
    path.unlink()
    shutil.copy(path.parent / "kept", f"{path}-wal")
    with pytest.raises(Exception, match=r"log\.db-wal' is left of a log that was removed or renamed; move it"):
        Log(path, create=True)
    Path(f"{path}-wal").unlink()
    with Log(path, create=True) as log:
        assert log.readings() == ()


def test_a_log_that_was_removed_takes_no_row_in_silence(path):
    with Log(path) as log:
        path.unlink()
        with pytest.raises(Exception, match=r"was removed or replaced meanwhile; nothing was logged"):
            log.add([reading(9)])
