"""Records that hold each other: whatever is changed, taken out, moved or dated back is found; nothing else is."""

import csv
import json
import sqlite3
from datetime import UTC, datetime, timedelta
from hashlib import sha256

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sensorgen.core.errors import BadInput
from sensorgen.measure.log import Log, Prediction, Reading, chain, database, exchange, verify
from sensorgen.measure.log.exchange import thesis_readings
from sensorgen.measure.log.logbook import withdraw
from sensorgen.measure.log.notes import reading
from sensorgen.measure.log.prints import prediction

PREDICTED = {"capacitance_f": {"lower": 1e-11, "upper": 2e-11}}


@pytest.fixture
def full(log):
    log.add([prediction("d", "trix", PREDICTED), *thesis_readings()[:12]])
    log.add([reading("23 triX", "650", remark="the last")])
    return log


def by_the_back_door(path, *statements, rows=()):
    """Change the file as somebody would who knows its tables: without the triggers, which are made again."""
    connection = sqlite3.connect(path, isolation_level=None)
    triggers = connection.execute("SELECT name, sql FROM sqlite_schema WHERE type = 'trigger'").fetchall()
    for name, _ in triggers:
        connection.execute(f"DROP TRIGGER {name}")
    for statement in statements:
        connection.execute(statement)
    connection.executemany("UPDATE record SET id = ?, parents = ?, content = ? WHERE id = ?", rows)
    for _, sql in triggers:
        connection.execute(sql)
    connection.close()


def test_the_identity_is_the_sha256_of_what_the_documentation_says(full):
    before = []
    for record in full.records():
        text = f"{','.join(before)} {record.kind} {record.version} {record.logged_at}\n{record.content}"
        assert record.id == sha256(text.encode()).hexdigest()
        before = [record.id]
    assert full.head() == (14, record.id)


EDITS = {
    "a value": ["UPDATE record SET content = replace(content, '650.0', '600.0')"],
    "a date": ["UPDATE record SET logged_at = '2020-01-01T00:00:00.000+00:00' WHERE sequence = 1"],
    "a kind": ["UPDATE record SET kind = 'batch', number = 99 WHERE sequence = 1"],
    "an index alone": ["UPDATE record SET specimen = '23 triY' WHERE sequence = 5"],
    "a design in the index": ["UPDATE record SET design_id = 'e' WHERE sequence = 1"],
    "a number": ["UPDATE record SET number = 99 WHERE sequence = 14"],
    "no number, as for a copy": ["UPDATE record SET number = NULL WHERE sequence = 14"],
    "one in the middle out": ["DELETE FROM record WHERE sequence = 7"],
    "the first out": ["DELETE FROM record WHERE sequence = 1"],
    "the last out": ["DELETE FROM record WHERE sequence = 14"],
    "all out": ["DELETE FROM record"],
    "the last nine out": ["DELETE FROM record WHERE sequence > 5"],
    "two exchanged": ["UPDATE record SET sequence = 99 WHERE sequence = 7", "UPDATE record SET sequence = 7 WHERE "
                      "sequence = 8", "UPDATE record SET sequence = 8 WHERE sequence = 99"],
    "the prediction behind": ["UPDATE record SET sequence = 15 WHERE sequence = 1"],
    "a copy of a row": ["INSERT INTO record SELECT 15, 'i', parents, kind, version, logged_at, content, 14, 'u', "
                        "specimen, iteration, design_id, supersedes FROM record WHERE sequence = 14"],
    "the note of the last": ["UPDATE head SET sequence = 13"],
}  # fmt: skip


@pytest.mark.parametrize("statements", EDITS.values(), ids=EDITS)
def test_every_edit_by_sql_is_found(full, path, statements):
    assert list(verify.faults(full)) == []
    by_the_back_door(path, *statements)
    with Log(path) as again:
        assert list(verify.faults(again))


def test_whoever_rewrites_the_whole_chain_is_found_by_an_anchor(full, path, tmp_path):
    verify.anchor(full, tmp_path / "notes.txt")
    assert verify.verified(full, tmp_path / "notes.txt").faults == ()
    head, rows = "", []
    for record in full.records():
        content = record.content.replace("650.0", "600.0")
        new = chain.made([head] if head else [], record.kind, record.version, record.logged_at, content)
        rows.append((new.id, head, content, record.id))
        head = new.id
    by_the_back_door(path, f"UPDATE head SET id = '{head}'", rows=rows)
    with Log(path) as again:
        assert verify.verified(again).faults == ()  # a new chain, sound in itself
        (found,) = verify.verified(again, tmp_path / "notes.txt").faults
        assert "1 of 1 heads" in found


def test_anchors_need_a_text_with_heads(full, tmp_path):
    (tmp_path / "x.txt").write_text("nothing here")
    with pytest.raises(BadInput, match=r"has no head of a log; expected a text as sensorgen log anchor writes it"):
        verify.verified(full, tmp_path / "x.txt")
    with pytest.raises(BadInput, match="cannot read"):
        verify.verified(full, tmp_path / "none.txt")


def test_a_clock_that_was_set_back_is_told_and_decides_nothing(log, monkeypatch):
    (first,) = log.add([prediction("d", "trix", PREDICTED)])

    class Back(datetime):
        @classmethod
        def now(cls, tz=None):
            return datetime.now(tz) - timedelta(days=2500)

    monkeypatch.setattr(database, "datetime", Back)
    (late,) = log.add([reading("23 triX", "650")])
    assert late.logged_at < first.logged_at
    assert log.before(first, [late]) is True
    found = verify.verified(log)
    assert found.faults == ()
    assert "1 records are dated before the one that they follow" in found.notes[0]


def test_a_row_of_any_kind_can_be_withdrawn(full):
    for kind, of in (("prediction", Prediction), ("reading", Reading)):
        count = full.count(of)
        withdraw(full, kind, 1, "of another sensor")
        assert full.count(of) == count - 1 == len(list(full.entries(of)))
        assert full.count(of, superseded=True) == count
        with pytest.raises(BadInput, match="row 1 was withdrawn before"):
            withdraw(full, kind, 1, "again")
    for kind, number, reason, said in (
        ("reading", 99, "x", "no reading 99"), ("reading", 2, " ", "an empty reason"),
    ):  # fmt: skip
        with pytest.raises(BadInput, match=said):
            withdraw(full, kind, number, reason)
    assert list(verify.faults(full)) == []


@st.composite
def histories(draw):
    """Parents of each record of a log, in order, after three machines have logged and taken over each other's logs.

    A new record follows the machine's last one. What a machine takes over it appends in the other's order, and logs a
    merge of all records without a successor where there are several.
    """
    logs, machine = [{}, {}, {}], st.integers(0, 2)
    for name, (own, other) in enumerate(draw(st.lists(st.tuples(machine, machine), min_size=10, max_size=30))):
        log = logs[own]
        if own == other:
            log[name] = tuple(log)[-1:]
            continue
        log |= {key: parents for key, parents in logs[other].items() if key not in log}
        ends = tuple(log.keys() - set().union(*log.values()))
        if len(ends) > 1:
            log[name] = tuple(sorted(ends, key=list(log).index))
    return logs[0]


@settings(deadline=None)
@given(histories())
@example({0: (), 1: (0,), 2: (1,), 3: (0,), 4: (1, 3), 5: (2, 4)})  # 3 knows less of the first line than 1, 4's parents
def test_ancestry_is_that_of_a_walk_through_all_parents(parents):
    ancestry = chain.Ancestry((str(key), tuple(map(str, before))) for key, before in parents.items())
    for second in parents:
        reached, left = set(), [*parents[second]]
        while left:
            reached.add(key := left.pop())
            left += parents[key]
        assert {first for first in parents if ancestry.before(str(first), str(second))} == reached


def test_the_claim_of_an_export_proves_nothing(log, tmp_path):
    """As an attacker would: a prediction exported, tuned, dated 2020 and imported again; or a reading dated back."""
    log.add([reading("23 triX", "650")])
    log.add([prediction("d", "trix", PREDICTED)])
    exchange.export(log, tmp_path / "out")
    table = tmp_path / "out" / "predictions.csv"
    with table.open(encoding="utf-8", newline="") as text:
        rows = list(csv.DictReader(text))
    rows[0] |= {"logged_at": "2020-01-01T00:00:00.000+00:00", "data": json.dumps(PREDICTED), "uid": "f" * 64}
    with table.open("w", encoding="utf-8", newline="") as text:
        writer = csv.DictWriter(text, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    with Log(tmp_path / "new.db", create=True) as new:
        exchange.import_file(new, tmp_path / "out" / "readings.csv", {})
        exchange.import_file(new, table, {})
        (tuned,) = new.entries(Prediction)
        assert tuned.logged_at > datetime.now(UTC).isoformat()[:10]
        assert tuned.claimed_at.startswith("2020")
        assert new.before(tuned, new.readings()) is False


MALFORMED = [
    {"reason": 5}, {"electrode_resistance_ohm": {"top": [1]}}, {"electrode_resistance_ohm": 5},
    {"schema": 3, "values": 5}, {"capacitance_f": {"upper": 1e-11}}, {"capacitance_f": [1, 2]},
    {"capacitance_f": {"lower": "a", "upper": "b"}}, {"corner_frequency_hz": {"lower": None, "upper": "x"}},
    {"identifiability": 5}, {"identifiability": {"press": [1]}},
    {"schema": 3}, {"schema": 4}, {"schema": 5}, {"schema": 2}, {"schema": "3"}, {"schema": None},
    {"schema": 3, "capacitance": {"value": "x"}}, {"schema": 2, "force_resolution_n": "x"}, {"schema": [3]},
    {"schema": 3, "status": "fine"},
]  # fmt: skip


@pytest.mark.parametrize("data", [*MALFORMED, [], 5, None, "x"], ids=str)
def test_a_prediction_that_no_report_could_read_is_refused(log, data):
    with pytest.raises(BadInput, match=r"prediction of 'trix': "):
        log.add([prediction("d", "trix", data)])
    assert log.head() == (0, "")
