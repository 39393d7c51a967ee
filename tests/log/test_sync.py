"""Logs of several machines that exchange records through a folder or a stick: nothing lost, nothing doubled."""

import json
import random
import shutil
import subprocess
import zipfile
from hashlib import sha256
from pathlib import Path

import pytest

from sensorgen.core import document
from sensorgen.core.errors import BadInput
from sensorgen.measure.log import (
    BenchRun,
    Log,
    Prediction,
    Reading,
    chain,
    database,
    exchange,
    files,
    listing,
    sync,
    verify,
)  # fmt: skip
from sensorgen.measure.log.exchange import thesis_readings
from sensorgen.measure.log.logbook import withdraw
from sensorgen.measure.log.notes import reading
from sensorgen.measure.log.prints import prediction

PREDICTED = {"capacitance_f": {"lower": 1e-11, "upper": 2e-11}}


@pytest.fixture
def machines(tmp_path):
    """Logs of three machines."""
    logs = [Log(tmp_path / name / "log.db", create=True) for name in ("a", "b", "c")]
    yield logs
    for log in logs:
        log.__exit__(None, None, None)


def sound(*logs):
    return all(list(verify.faults(log)) == [] for log in logs)


def both_corrected(a, b, share):
    """A row, and its corrections by two machines that did not know of each other's."""
    (old,) = a.add([reading("23 triX", "0.65")])
    for log in (a, b):
        sync.sync(log, share)
    for log, ohm in ((a, "650"), (b, "660")):
        log.add([reading("23 triX", ohm, supersedes=old.uid)])
    for log in (a, b, a):
        sync.sync(log, share)
    return old


def ids(log):
    return {record.id for record in log.records()}


def test_everything_arrives_everywhere(machines, tmp_path):
    a, b, c = machines
    share = tmp_path / "share"
    (tmp_path / "run.mat").write_bytes(b"raw" * 99)
    kept = files.keep(a.files, tmp_path / "run.mat")
    a.add([kept, BenchRun(uid="run", specimen="23 triX", written="23 triX", file=kept.uid)])
    b.add([reading("23 triX", "650")])
    c.add([reading("23 triY", "650")])
    for log in (a, b, c, a, b, c, a):
        sync.sync(log, share)
    assert ids(a) == ids(b) == ids(c)
    assert a.head()[1] == b.head()[1] == c.head()[1]
    assert {r.specimen for r in c.readings()} == {"23 triX", "23 triY"}
    assert b.raw(kept.uid).read_bytes() == b"raw" * 99
    assert sound(a, b, c)
    before = sorted(path.name for path in share.rglob("*"))
    assert sync.sync(b, share).sent == 0
    assert sorted(path.name for path in share.rglob("*")) == before


def test_random_work_and_syncs_lose_nothing(machines, tmp_path):
    rng, made = random.Random(3), set()
    for _ in range(40):
        log = rng.choice(machines)
        if rng.random() < 0.6:
            made.update(row.uid for row in log.add([reading("23 triX", str(rng.randrange(1, 999)))]))
        else:
            sync.sync(log, tmp_path / "share")
    for log in (*machines, *machines):
        sync.sync(log, tmp_path / "share")
    for log in machines:
        assert {r.uid for r in log.readings()} == made
        assert sorted(r.number for r in log.readings()) == list(range(1, len(made) + 1))
    assert sound(*machines)


def test_what_precedes_what_is_known_only_where_the_machines_had_synced(machines, tmp_path):
    a, b, _ = machines
    (early,) = a.add([prediction("d", "trix", PREDICTED)])
    (apart,) = b.add([reading("23 triX", "650")])
    sync.sync(a, tmp_path / "share")
    sync.sync(b, tmp_path / "share")
    (after,) = b.add([reading("23 triX", "660")])
    early = next(b.entries(Prediction))
    assert b.before(early, [apart]) is None, "neither machine knew of the other's"
    assert b.before(early, [after]) is True
    assert b.before(early, [apart, after]) is None


def test_a_row_that_arrives_again_takes_no_number(machines, tmp_path):
    a, b, _ = machines
    for log in (a, b):
        log.add([reading("23 triX", "650", uid="same")])
    b.add([reading("23 triX", "660")])
    for log in (b, a):
        sync.sync(log, tmp_path / "share")
    assert [(row.number, *row.y_ohm) for row in a.readings()] == [(1, 650), (2, 660)]
    assert sound(a, b)


def test_of_two_corrections_of_one_row_the_same_one_counts_everywhere_until_a_person_settles_it(machines, tmp_path):
    a, b, _ = machines
    (old,) = a.add([reading("23 triX", "0.65")])
    sync.sync(a, tmp_path / "share")
    sync.sync(b, tmp_path / "share")
    lines = {}  # what each machine corrected, and what it corrects that by
    for log, ohms in ((a, ("650", "651")), (b, ("660", "661"))):
        (first,) = log.add([reading("23 triX", ohms[0], supersedes=old.uid)])
        (last,) = log.add([reading("23 triX", ohms[1], supersedes=first.uid)])
        lines[last.uid] = first.uid
    for log in (a, b, a):
        sync.sync(log, tmp_path / "share")
    (counts,), (also,) = a.readings(), b.readings()
    assert counts.uid == also.uid
    other = next(uid for uid in lines if uid != counts.uid)
    for log in (a, b):
        rows = {row.uid: row for row in log.readings(superseded=True)}
        assert log.count(Reading) == 1
        assert len(log.superseding(old)) == 2
        assert {other, lines[other]} <= {row.uid for row in log.entries(Reading, replaced=True)}
        assert log.rival(rows[lines[other]]) == rows[lines[counts.uid]]
        assert log.rival(rows[counts.uid]) is None
        said = " ".join(document.text(listing.details(log, [rows[lines[other]]]).document()))
        expected = f"row {rows[lines[counts.uid]].number}, from another machine, corrects the same row and counts"
        assert expected in " ".join(said.split())
        expected = f"conflict: readings {rows[lines[other]].number} and {rows[lines[counts.uid]].number} correct the"
        assert [note[: len(expected)] for note in listing.listing(log).notes[:-3]] == [expected]
        with pytest.raises(BadInput, match="was corrected before"):
            log.add([reading("23 triX", "652", supersedes=lines[other])])
    withdraw(b, "reading", next(r.number for r in b.readings(superseded=True) if r.uid == counts.uid), "typing error")
    withdraw(b, "reading", next(r.number for r in b.readings(superseded=True) if r.uid == other), "typing error")
    assert b.readings() == ()
    assert b.conflicts() == []
    assert sound(a, b)


def test_withdrawing_the_correction_that_counts_lets_the_other_one_count(machines, tmp_path):
    a, b, _ = machines
    old = both_corrected(a, b, tmp_path / "share")
    (counts,) = b.readings()
    lost = next(r for r in b.entries(Reading, replaced=True) if r.uid not in (old.uid, counts.uid))
    with pytest.raises(BadInput, match=f"row {lost.number} is out of use: row {counts.number}, from another machine"):
        b.add([reading("23 triX", "670", supersedes=lost.uid)])
    assert len(b.conflicts()) == len(sync.sync(b, tmp_path / "share").notes) == 1
    withdraw(b, "reading", counts.number, "typing error")
    assert b.conflicts() == []
    for log in (b, a):
        sync.sync(log, tmp_path / "share")
        assert [row.uid for row in log.readings()] == [lost.uid]
    assert sound(a, b)


def test_the_file_alone_has_everything_that_was_acknowledged(log, path, tmp_path):
    """While a program holds the log open, somebody copies the file without its write-ahead log."""
    for k in range(20):
        log.add([reading("23 triX", str(k + 1))])
    shutil.copy(path, tmp_path / "alone.db")
    with Log(tmp_path / "alone.db") as alone:
        assert alone.readings() == log.readings()
        assert len(alone.readings()) == 20


@pytest.mark.parametrize("name", ["backup", "backup.zip"])
def test_backup_and_restore(machines, tmp_path, name):
    a, b, _ = machines
    (tmp_path / "run.mat").write_bytes(b"raw" * 99)
    kept = files.keep(a.files, tmp_path / "run.mat")
    a.add([kept, BenchRun(uid="run", specimen="23 triX", written="23 triX", file=kept.uid), *thesis_readings()])
    sync.backup(a, tmp_path / name)
    with pytest.raises(BadInput, match="is there; expected a new folder"):
        sync.backup(a, tmp_path / name)
    sync.restore(b, tmp_path / name)
    assert list(a.records()) == list(b.records())
    assert a.readings() == b.readings()
    assert b.raw(kept.uid).read_bytes() == b"raw" * 99
    assert sound(a, b)
    with pytest.raises(BadInput, match="has rows; expected an empty or new one"):
        sync.restore(a, tmp_path / name)


def test_places_that_are_none(log, tmp_path):
    (tmp_path / "text").write_text("x")
    (tmp_path / "no.zip").write_text("x")
    (tmp_path / "empty").mkdir()
    for call, place, said in (
        (sync.sync, "text", "is a file; expected a folder or a .zip"),
        (sync.sync, "no.zip", "is no archive of a log"),
        (sync.restore, "empty", "has no folder 'records'"),
        (sync.restore, "none", "no folder or .zip at"),
    ):
        with pytest.raises(BadInput, match=said):
            call(log, tmp_path / place)


def test_a_bomb_is_refused_by_its_size(log, tmp_path, monkeypatch):
    monkeypatch.setattr(sync, "MOST_BYTES", 1_000_000)
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("records/x.jsonl", b"0" * 5_000_000)
    with pytest.raises(BadInput, match="GB unpacked"):
        sync.sync(log, tmp_path / "bomb.zip")


def records_file(share):
    (path,) = (share / "records").iterdir()
    return path


def rewritten(share, change):
    """A file of records that somebody changed and named anew by its content."""
    path = records_file(share)
    lines = [json.loads(line) for line in path.read_text("utf-8").splitlines()]
    path.unlink()
    content = "".join(json.dumps(line) + "\n" for line in change(lines)).encode()
    (share / "records" / f"{sha256(content).hexdigest()}.jsonl").write_bytes(content)


def without(lines):
    return [line for line in lines if line is not lines[2]]


def tuned(lines):
    lines[2]["content"] = lines[2]["content"].replace("650", "600")
    return lines


def newer(lines):
    last = lines[-1]
    last["version"] = 99
    last["id"] = chain.identity(last["parents"], last["kind"], 99, last["logged_at"], last["content"])
    return lines


def nonsense(lines):
    last = lines[-1]
    last["content"] = json.dumps(json.loads(last["content"]) | {"y_ohm": "x"})
    last["id"] = chain.identity(last["parents"], last["kind"], last["version"], last["logged_at"], last["content"])
    return lines


@pytest.mark.parametrize(
    ("change", "said", "there"),
    [
        (without, "3 records follow others that are not there yet", 2),
        (tuned, "is not what its identity says; nothing was added", 0),
        (newer, "of version 99, which this sensorgen does not read: take a newer one", 0),
        (nonsense, "column y_ohm of a Reading holds 'x'", 0),
        (lambda lines: [{**lines[0], "parents": 5}], "is no record; expected a file as sensorgen log sync writes", 0),
        (lambda lines: ["x"], "is no record", 0),
    ],
)
def test_records_that_were_tampered_with(machines, tmp_path, change, said, there):
    a, b, _ = machines
    a.add(reading("23 triX", "650", uid=str(k)) for k in range(6))
    sync.sync(a, tmp_path / "share")
    rewritten(tmp_path / "share", change)
    try:
        words = " ".join(sync.sync(b, tmp_path / "share").notes)
    except BadInput as error:
        words = str(error)
    assert said in words
    assert b.count(Reading) == there
    assert sound(b)


def test_a_file_that_has_not_arrived_in_full_is_left_for_later(machines, tmp_path):
    a, b, _ = machines
    a.add([reading("23 triX", "650")])
    sync.sync(a, tmp_path / "share")
    path = records_file(tmp_path / "share")
    whole = path.read_bytes()
    path.write_bytes(whole[:40])
    assert "is incomplete or was changed" in sync.sync(b, tmp_path / "share").notes[0]
    path.write_bytes(whole)
    assert sync.sync(b, tmp_path / "share").received == 1


def test_a_file_system_without_locks_is_refused_with_the_way_out(tmp_path):
    """A real FUSE mount, as of a share or another machine."""
    if shutil.which("bindfs") is None:
        pytest.skip("bindfs is not installed")
    (tmp_path / "real").mkdir()
    (tmp_path / "mount").mkdir()
    mounted = subprocess.run(["bindfs", tmp_path / "real", tmp_path / "mount"], capture_output=True, encoding="utf-8")
    if mounted.returncode:
        pytest.skip(f"cannot mount through FUSE here: {mounted.stderr.strip()}")
    try:
        with pytest.raises(BadInput, match=r"is on fuse at .*cannot lock a file.*sensorgen log sync"):
            Log(tmp_path / "mount" / "log.db", create=True)
        assert list((tmp_path / "real").iterdir()) == []
        with Log(tmp_path / "log.db", create=True) as log:  # the way out works there
            log.add([reading("23 triX", "650")])
            assert sync.sync(log, tmp_path / "mount" / "share").sent == 1
    finally:
        subprocess.run(["umount", tmp_path / "mount"], check=True)


MOUNTS = """\
22 1 254:1 / / rw,relatime - ext4 /dev/vda rw
40 22 0:50 / /mnt/lab\\040share rw - cifs //server/lab rw
41 22 0:51 / /mnt/lab rw - nfs4 server:/lab rw
42 41 254:2 / /mnt/lab/disk rw - ext4 /dev/vdb rw
43 22 0:52 / /media/stick rw - fuseblk /dev/sdb1 rw
44 22 0:53 / /home/me/cloud rw - fuse.rclone drive: rw
"""


@pytest.mark.parametrize(
    ("path", "shared"),
    [
        ("/home/me/log.db", ""), ("/mnt/lab/log.db", "nfs4 at /mnt/lab"), ("/mnt/lab share/x/log.db", "cifs at"),
        ("/mnt/lab/disk/log.db", ""), ("/media/stick/log.db", ""), ("/home/me/cloud/log.db", "fuse.rclone at"),
        ("/mnt/laboratory/log.db", ""),
    ],
)  # fmt: skip
def test_shares_are_told_from_disks(monkeypatch, path, shared):
    monkeypatch.setattr(Path, "read_text", lambda *_: MOUNTS)
    found = database.without_locks(Path(path))
    assert found.startswith(shared)
    assert bool(found) == bool(shared)


@pytest.mark.parametrize("settled", [True, False])
def test_an_export_with_the_corrections_of_two_machines_is_imported(machines, tmp_path, settled):
    a, b, _ = machines
    both_corrected(a, b, tmp_path / "share")
    if settled:
        withdraw(a, "reading", a.readings()[0].number, "typing error")
    exchange.export(a, tmp_path / "out")
    for k in range(4):  # what counts does not depend on the chance of an identity
        with Log(tmp_path / f"{k}.db", create=True) as new:
            exchange.import_file(new, tmp_path / "out", {})
            assert [row.uid for row in new.readings()] == [row.uid for row in a.readings()]
            assert len(new.conflicts()) == (not settled)
            assert list(verify.faults(new)) == []
