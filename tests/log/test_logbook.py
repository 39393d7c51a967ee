"""The log only grows, ties every row to what it is about, and takes older files along."""

import dataclasses
import json
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from sensorgen.core.errors import BadInput, UnknownName, Unwritable
from sensorgen.measure.log import Batch, BenchRun, Log, Prediction, Print, RawFile, Reading, database, listing, verify
from sensorgen.measure.log.entries import ROWS, DesignRow, Withdrawal
from sensorgen.measure.log.notes import reading

HERE = Path(__file__).parent
SHA = "0" * 64


def sql(path, *statements):
    connection = sqlite3.connect(path, isolation_level=None)
    try:
        return [connection.execute(statement).fetchall() for statement in statements]
    finally:
        connection.close()


def everything(log):
    return {kind: list(log.entries(kind, superseded=True)) for kind in ROWS}


def filled(log):
    """One row of each kind at least."""
    log.add(
        [
            RawFile(uid=SHA, name="run.mat", size=3),
            Batch(uid="b", batch="26", file=SHA),
            Print(uid="p", specimen="26 triX", iteration=26, shape="tri", batch_uid="b", design_id="d", design="trix"),
            reading("26 triX", "650", "1.1m", uid="r"),
            BenchRun(uid="run", specimen="26 triX", written="26 triX", file=SHA),
            Prediction(uid="x", design_id="d", design="trix", version="1", data="{}"),
            DesignRow(uid="d", design="trix", data="{}"),
            Withdrawal(uid="w", of="prediction", supersedes="x", reason="of another bed"),
        ]
    )


def test_what_is_logged_is_read_back_as_the_very_same(log, path):
    given = reading("23 tri¥.2mm 3", "0.6k", "65 / OL", remark="small holes, 'not baked' \"x\"", measured_at="May 4")
    (new,) = log.add([given])
    assert (new.number, dataclasses.replace(new, number=0, logged_at="")) == (1, given)
    assert log.readings() == (new,)
    with Log(path) as again:
        assert again.readings() == (new,)
    assert new.logged_at.endswith("+00:00")
    assert new.z_ohm == (65.0, float("inf"))


def test_every_reading_is_tied_to_specimen_iteration_design_and_batch(log):
    log.add([reading("26 triX .1mm", "650")])
    filled(log)
    log.add([reading("26 triX", "700", uid="later"), reading("27 triX", "700")])
    found = {r.uid: r for r in log.readings()}
    before = log.readings(specimen="26 triX .1mm")[0]
    assert (before.iteration, before.batch, before.design) == (26, "", "trix-d0.1")  # by its name alone
    assert len(before.design_id) == 16
    for uid in ("r", "later"):  # the print bed knows better than the name
        row = found[uid]
        assert (row.specimen, row.batch, row.design_id, row.design) == ("26 triX", "26", "d", "trix")
    assert log.recordings()[0].batch == "26"
    again = [
        Batch(uid="b2", batch="26 again", file=SHA),
        Print(uid="p2", specimen="26 triX", batch_uid="b2", design_id="d", design="trix"),
    ]
    log.add([*again, reading("26 triX", "700", uid="last")])
    assert next(log.entries(Reading, uid="last")).batch == "26 again"
    assert [len(log.readings(iteration=k)) for k in (25, 26, 27)] == [0, 4, 1]
    assert [s.specimen for s in log.specimens()] == ["26 triX", "26 triX .1mm", "27 triX"]
    assert [s.specimen for s in log.specimens(iteration=27)] == ["27 triX"]
    assert log.readings(last=2) == log.readings()[-2:]


def test_nothing_is_changed_or_taken_out(log, path):
    filled(log)
    before = everything(log)
    again = "INSERT OR REPLACE INTO record SELECT * FROM record"
    for statement in ("DELETE FROM record", "UPDATE record SET content = 'x'", again):
        connection = sqlite3.connect(path)
        connection.execute("PRAGMA recursive_triggers = ON")
        with pytest.raises(sqlite3.IntegrityError, match="nothing in the log is changed or taken out"):
            connection.execute(statement)
        connection.close()
    assert everything(log) == before


def test_a_correction_is_a_new_row_and_the_old_one_stays(log):
    (old,) = log.add([reading("23 triX", "0.65", "40")])
    (new,) = log.add([reading("23 triX", "0.65k", "40", supersedes=old.uid)])
    assert log.readings() == (new,)
    assert log.readings(superseded=True) == (old, new)
    assert (log.count(Reading), log.count(Reading, superseded=True)) == (1, 2)
    with pytest.raises(BadInput, match="row 1 was corrected before, by row 2"):
        log.add([reading("23 triX", "0.7k", supersedes=old.uid)])
    with pytest.raises(BadInput, match="nothing to correct: no row 'nobody'"):
        log.add([reading("23 triX", "0.7k", supersedes="nobody")])
    assert len(log.readings(superseded=True)) == 2


def test_a_list_of_many_recordings_says_that_it_is_cut(log):
    runs = [BenchRun(uid=uid, specimen="26 triX", written="26 triX", file=SHA) for uid in "ab"]
    log.add([RawFile(uid=SHA, name="run.mat", size=3), *runs])
    cut, whole = (listing.listing(log, last=last) for last in (2, 3))
    assert ["the latest 2 are shown; --all shows all" in each.notes for each in (cut, whole)] == [True, False]


def test_all_rows_of_one_call_or_none(log):
    rows = [reading("23 triX", "650", uid=str(k)) for k in range(5)]
    with pytest.raises(BadInput, match="nothing to correct"):
        log.add([*rows, reading("23 triX", "1", supersedes="nobody")])
    with pytest.raises(BadInput, match=r"a recording refers to raw file '0+', which the log does not have"):
        log.add([*rows, BenchRun(uid="run", specimen="23 triX", written="23 triX", file=SHA)])
    with pytest.raises(ZeroDivisionError):
        log.add(rows[1 // k] for k in (1, 0))
    assert log.readings() == log.specimens() == ()
    assert len(log.add(rows)) == 5
    assert log.add(rows) == []


def test_a_known_row_that_says_something_else_is_refused(log):
    (row,) = log.add([reading("23 triX", "650", uid="1")])
    assert log.add([row]) == []
    with pytest.raises(BadInput, match="row 1 has other content in the log"):
        log.add([dataclasses.replace(row, remark="tuned")])


@pytest.mark.parametrize("remark", ["\ud800", "x\udcff"])
def test_what_is_no_text_is_refused(log, remark):
    with pytest.raises(BadInput, match="not text"):
        log.add([reading("23 triX", "650", remark=remark)])
    with pytest.raises(BadInput, match="zero byte"):
        reading("23 triX", "650", remark="a\0b")


@pytest.mark.parametrize(
    ("remark", "said", "baked"),
    [
        ("not baked", None, False), ("Unbaked, small holes", None, False), ("before the bake", None, False),
        ("", True, True), ("half-baked", None, None), ("not baked", True, True),
    ],
)  # fmt: skip
def test_the_bake_is_what_is_said_or_remarked(remark, said, baked):
    row = reading("23 triX .1mm", "650", remark=remark, baked=said)
    doubts = ("baked, but the remark says that it is not",) if said and remark else ()
    assert (row.baked, row.doubts) == (baked, doubts)


def test_settings_that_keep_what_is_promised(log):
    assert log.pragma("journal_mode") == ("wal",)
    assert log.pragma("synchronous") == ("2",)
    assert log.pragma("foreign_keys") == ("1",)
    assert log.pragma("trusted_schema") == ("0",)
    assert log.pragma("user_version") == (str(database.VERSION),)


@pytest.fixture
def version1(path):
    """A log of version 1 as it was written then."""
    connection = sqlite3.connect(path)
    connection.executescript((HERE / "version1.sql").read_text("utf-8"))
    connection.close()
    return path


def test_a_log_of_version_1_is_taken_along(version1):
    held = "SELECT number, uid, written, y_ohm, z_ohm, baked, doubts FROM reading"
    before = sql(version1, held)
    with Log(version1) as log:
        assert log.pragma("user_version") == ("3",)
        assert [(r.written, r.y_ohm, r.z_ohm, r.baked) for r in log.readings()] == [
            ("23 triX", (680.0,), (45.0,), None),
            ("23 triY .1mm xfine", (75000.0,), (1.1e6,), False),
            ("23 sqXY .1mm 3", (2500.0, 3000.0), (5000.0, 0.0), None),
        ]
        assert {(r.design_id, r.design, r.batch) for r in log.readings()} == {("", "", "")}
        filled(log)
        assert [fault.partition(" (")[0] for fault in verify.faults(log)] == ["raw file run.mat"]
        kept = [(r.number, r.uid, r.written, r.y_ohm, r.z_ohm, r.baked, r.doubts) for r in log.readings()[:3]]
    assert kept == [
        (number, uid, written, *(tuple(json.loads(ohm)) for ohm in (y, z)), baked, tuple(json.loads(doubts)))
        for number, uid, written, y, z, baked, doubts in before[0]
    ]


def test_a_migration_that_fails_leaves_version_1(version1, monkeypatch):
    monkeypatch.setattr(database, "STEPS", (*database.STEPS[:2], (*database.STEPS[2], "CREATE TABLE reading (x)")))
    with pytest.raises(BadInput, match="damaged"):
        Log(version1)
    tables = "SELECT count(*) FROM sqlite_schema WHERE name = 'bench_run'"
    assert sql(version1, "PRAGMA user_version", tables) == [[(1,)], [(0,)]]
    monkeypatch.undo()
    with Log(version1) as log:
        assert len(log.readings()) == 3


def test_a_log_of_a_newer_sensorgen_is_refused(log, path):
    sql(path, f"PRAGMA user_version = {database.VERSION + 1}")
    with pytest.raises(BadInput, match=r"of version 4; expected up to 3: take a newer sensorgen"):
        Log(path)


@pytest.mark.parametrize(
    "statement",
    [
        "DROP TRIGGER record_no_delete",
        "CREATE TRIGGER evil AFTER INSERT ON record BEGIN SELECT 1; END",
        "DROP TABLE head",
    ],
)
def test_tables_that_somebody_has_changed_are_refused(log, path, statement):
    sql(path, statement)
    with pytest.raises(BadInput, match="not as sensorgen made it"):
        Log(path)


def test_views_and_tables_of_a_user_s_own_are_fine(log, path):
    sql(path, "CREATE VIEW mine AS SELECT * FROM record", "CREATE TABLE own (x)")
    with Log(path) as again:
        assert again.readings() == ()


def test_a_reader_makes_no_log(tmp_path):
    with pytest.raises(BadInput, match=r"no log at .*: log something first"):
        Log(tmp_path / "none.db")
    assert list(tmp_path.iterdir()) == []


def test_whoever_makes_the_log_first_keeps_it(path, monkeypatch):
    def slow(made=database._empty):
        monkeypatch.setattr(database, "_empty", made)
        with Log(path, create=True) as first:
            first.add([reading("23 triX", "650")])
        return made()

    monkeypatch.setattr(database, "_empty", slow)
    with Log(path, create=True) as second:
        assert len(second.readings()) == 1
    assert [p.name for p in path.parent.iterdir()] == ["log.db"]


def test_a_log_is_made_where_there_are_no_links(path, monkeypatch):
    def refuse(*_):
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr("os.link", refuse)
    with Log(path, create=True) as log:
        assert len(log.add([reading("23 triX", "650")])) == 1
    assert [p.name for p in path.parent.iterdir()] == ["log.db"]


def test_rows_by_columns_that_there_are(log):
    log.add([reading("23 triX", "650"), reading("23 triY", "650")])
    assert [r.specimen for r in log.readings(shape="tri", axes="Y", baked=None)] == ["23 triY"]
    with pytest.raises(UnknownName, match="unknown column of a Reading 'iteratoin'; did you mean 'iteration'"):
        log.readings(iteratoin=23)
    with pytest.raises(UnknownName):
        log.readings(**{"uid = '' OR 1 --": ""})


WRITER = """
import sys
from pathlib import Path
from sensorgen.measure.log import Log, Reading
for k in range(int(sys.argv[3])):
    with Log(Path(sys.argv[1]), create=True) as log:
        log.add(Reading(uid=f"{sys.argv[2]}-{k}-{j}", specimen="23 triX", written="23 triX") for j in range(10))
"""


def test_writers_at_once_lose_nothing(tmp_path):
    path = tmp_path / "log.db"
    writers = [subprocess.Popen([sys.executable, "-c", WRITER, path, name, "8"]) for name in "abc"]
    assert [writer.wait(60) for writer in writers] == [0, 0, 0]
    with Log(path) as log:
        uids = [r.uid for r in log.readings()]
        assert list(verify.faults(log)) == []
    assert sorted(uids) == sorted(f"{name}-{k}-{j}" for name in "abc" for k in range(8) for j in range(10))
    for start in range(0, len(uids), 10):  # rows of one call stand together
        assert len({uid.rpartition("-")[0] for uid in uids[start : start + 10]}) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["log.db"]


def test_a_writer_who_does_not_end_is_told(log, path, monkeypatch):
    monkeypatch.setattr(database, "WAIT_S", 0.05)
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    refused = pytest.raises(Unwritable, match=r"another program has locked the log .* nothing was logged")
    with Log(path) as late, refused:
        late.add([reading("23 triX", "650")])
    assert log.readings() == ()  # readers do not wait
    other.close()
    assert len(log.add([reading("23 triX", "650")])) == 1
