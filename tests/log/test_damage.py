"""Files that are no log, or no longer one: told by name, and left as they are."""

import os
import re
import sqlite3
from pathlib import Path

import pytest

from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.measure.log import Log, files, verify
from sensorgen.measure.log.exchange import thesis_readings


@pytest.fixture
def sound(path):
    """A log with Table D.1."""
    with Log(path, create=True) as log:
        log.add(thesis_readings())
    return path


def another(path):
    path.unlink()
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE t (x)")
    connection.close()


def cut(path, share):
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])


def overwritten(path, at):
    content = bytearray(path.read_bytes())
    content[at : at + 4096] = os.urandom(4096)
    path.write_bytes(content)


def typed_wrongly(path):
    """A record that no version of sensorgen writes, by the back door."""
    connection = sqlite3.connect(path, isolation_level=None)
    columns = [name for _, name, *_ in connection.execute("PRAGMA table_info(record)")]
    other = {"sequence": "99", "number": "99", "id": "'i'", "uid": "'u'",
             "content": "'{\"uid\":\"u\",\"specimen\":\"x\",\"written\":\"x\",\"y_ohm\":\"[nan\"}'"}  # fmt: skip
    values = ", ".join(other.get(name, name) for name in columns)
    connection.execute(f"INSERT INTO record ({', '.join(columns)}) SELECT {values} FROM record LIMIT 1")
    connection.close()


DAMAGE = {
    "empty": (lambda p: p.write_bytes(b""), "is empty; expected a log"),
    "short": (lambda p: cut(p, 0.0005), "is no SQLite file"),
    "pickle": (lambda p: p.write_bytes(b"\x80\x04cos\nsystem\n(S'touch it'\ntR." + bytes(200)), "is no SQLite file"),
    "another program's": (another, "is another program's database"),
    "cut in half": (lambda p: cut(p, 0.5), "is damaged"),
    "first page lost": (lambda p: overwritten(p, 200), "is damaged"),
    "a page lost": (lambda p: overwritten(p, 5 * 4096), "is damaged|database: "),
    "a row of nonsense": (typed_wrongly, "record 70, a 'reading', is not what was logged"),
}


@pytest.mark.parametrize(("damage", "message"), DAMAGE.values(), ids=DAMAGE)
def test_a_damaged_log_is_told_by_name(sound, damage, message, run, tmp_path):
    damage(sound)
    before = sound.read_bytes()
    said = run("verify")
    assert said.code in (1, 2)
    text = said.words + said.err
    assert re.search(message, text), text
    assert str(sound) in text or "database: " in text
    assert "Traceback" not in text
    assert max(map(len, said.out.splitlines() + said.err.splitlines())) < 500
    for words in ("list", "show 23-trix-d0", "export x.csv", "list --all --json", "import --thesis"):
        assert "Traceback" not in run(*words.split()).err
    if said.code == 2:
        assert sound.read_bytes() == before
    assert not (tmp_path / "pwned").exists()


def test_folders_devices_and_pipes_are_no_log(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path, tmp_path / "pipe", Path("/dev/zero"), Path("/dev/full")):
        with pytest.raises(BadInput, match="is no file; expected a log"):
            Log(place, create=True)


def test_a_log_in_a_place_that_cannot_be(tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(SensorgenError, match="cannot use the log"):
        Log(tmp_path / "file" / "log.db", create=True)
    with pytest.raises(SensorgenError, match=r"cannot use the log|no log"):
        Log(tmp_path / ("x" * 300), create=True)


def test_raw_files_are_checked(log, tmp_path):
    (tmp_path / "a.csv").write_text("a")
    left = log.files / "ca" / f".x.ab.{os.getpid()}.part"  # of an earlier process of our number
    left.parent.mkdir(parents=True)
    left.touch()
    (tmp_path / "b").write_text("b")
    kept = [files.keep(log.files, tmp_path / name) for name in ("a.csv", "b")]
    log.add(kept)
    assert list(verify.faults(log)) == []
    first, second = (files.place(log.files, file) for file in kept)
    assert first.name == f"{kept[0].uid}.csv"
    assert left.parent == first.parent
    assert not left.exists()
    first.chmod(0o644)
    first.write_text("A")
    second.unlink()
    assert list(verify.faults(log)) == [
        f"raw file a.csv ({first}) is not what was logged",
        f"raw file b ({second}): No such file or directory",
    ]
