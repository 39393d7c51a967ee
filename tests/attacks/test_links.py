"""Links in place of files and folders: nothing is read from, nor written to, where somebody else points."""

import os
import stat
import zipfile

import pytest

from sensorgen.core import files as store
from sensorgen.core.errors import BadInput, Unwritable
from sensorgen.measure.log import BenchRun, Log, files, sync, verify
from sensorgen.measure.log.notes import reading

pytestmark = pytest.mark.skipif(os.name == "nt", reason="links and pipes of POSIX")


@pytest.fixture
def logs(tmp_path):
    """A log with a raw file, an empty one, and a folder outside, which nothing may change."""
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim" / "own.txt").write_text("mine")
    with Log(tmp_path / "a" / "log.db", create=True) as a, Log(tmp_path / "b" / "log.db", create=True) as b:
        (tmp_path / "run.mat").write_bytes(b"raw" * 99)
        kept = files.keep(a.files, tmp_path / "run.mat")
        a.add([kept, BenchRun(uid="run", specimen="23 triX", written="23 triX", file=kept.uid)])
        yield a, b, kept
    assert [(p.name, p.read_text()) for p in (tmp_path / "victim").iterdir()] == [("own.txt", "mine")]


@pytest.mark.parametrize("name", ["records", "files", "files/XX"])
def test_a_sync_writes_through_no_link(logs, tmp_path, name):
    a, _, kept = logs
    link = tmp_path / "share" / name.replace("XX", kept.uid[:2])
    link.parent.mkdir(parents=True)
    link.symlink_to(tmp_path / "victim")
    with pytest.raises(BadInput, match="is a link; expected a folder: move it away"):
        sync.sync(a, tmp_path / "share")


def test_a_sync_reads_no_link_and_waits_for_no_pipe(logs, tmp_path):
    a, b, kept = logs
    share = tmp_path / "share"
    sync.sync(a, share)
    (records,) = (share / "records").iterdir()
    records.rename(tmp_path / "records.jsonl")
    records.symlink_to(tmp_path / "records.jsonl")
    (share / "records" / "zero.jsonl").symlink_to("/dev/zero")
    os.mkfifo(share / "records" / "pipe.jsonl")
    found = sync.sync(b, share)
    assert found.received == 0
    assert sum("is a link" in note for note in found.notes) == 2
    records.unlink()
    (tmp_path / "records.jsonl").rename(records)
    raw = files.place(share / "files", kept)
    raw.unlink()
    raw.symlink_to("/dev/zero")
    found = sync.sync(b, share)
    assert (found.received, "is a link in" in " ".join(found.notes)) == (2, True)
    assert not files.place(b.files, kept).exists()
    raw.unlink()
    assert not any("raw file" in note for note in sync.sync(a, share).notes)
    assert not raw.is_symlink()
    sync.sync(b, share)
    assert b.raw(kept.uid).read_bytes() == b"raw" * 99


def test_a_link_in_an_archive_is_a_file_with_its_text(logs, tmp_path):
    """An entry that is a link, and one that leads out of the folder, as an attacker packs them."""
    a, b, _ = logs
    sync.backup(a, tmp_path / "backup.zip")
    with zipfile.ZipFile(tmp_path / "backup.zip", "a") as archive:
        for name, to in (("records/0.jsonl", "/dev/zero"), ("files/xx", str(tmp_path / "victim")), ("../out.txt", "x")):
            entry = zipfile.ZipInfo(name)
            entry.external_attr = (stat.S_IFLNK | 0o777) << 16
            archive.writestr(entry, to)
        archive.writestr("files/xx/own.txt", "theirs")
    with pytest.raises(Unwritable, match="cannot use"):  # a file where a folder is needed
        sync.restore(b, tmp_path / "backup.zip")
    assert b.head() == (0, "")
    assert not (tmp_path / "out.txt").exists()


@pytest.mark.parametrize("to", ["same", "pipe", "/dev/zero"])
def test_verify_finds_a_raw_file_that_is_a_link_or_a_pipe(logs, tmp_path, to):
    a, _, kept = logs
    raw = files.place(a.files, kept)
    raw.unlink()
    if to == "pipe":
        os.mkfifo(raw)
    else:
        raw.symlink_to(tmp_path / "run.mat" if to == "same" else to)
    (fault,) = verify.faults(a)
    assert "is a link or no file" in fault


def test_a_log_that_is_a_dangling_link_is_refused_and_one_to_a_log_is_that_log(logs, tmp_path):
    a, *_ = logs
    (tmp_path / "link.db").symlink_to(a.path)
    with Log(tmp_path / "link.db") as same:
        same.add([reading("23 triX", "650")])
    assert len(a.readings()) == 1
    (tmp_path / "nowhere.db").symlink_to(tmp_path / "none.db")
    with pytest.raises(BadInput, match="is no file; expected a log"):
        Log(tmp_path / "nowhere.db", create=True)
    assert not (tmp_path / "none.db").exists()


def test_a_build_writes_through_no_link(logs, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "cad").symlink_to(tmp_path / "victim")
    (folder / "manifest.json").symlink_to(tmp_path / "victim" / "own.txt")
    with store.staging(folder) as stage:
        store.write(stage, {"cad/own.txt": b"theirs", "manifest.json": b"{}"})
        with pytest.raises(Unwritable, match="is a link to another folder"):
            store.publish(stage, folder)
        (folder / "cad").unlink()
        store.publish(stage, folder)
    assert not (folder / "manifest.json").is_symlink()
    assert (folder / "cad" / "own.txt").read_bytes() == b"theirs"
