"""A log of commit 0645a80 (version 2), as SQL, as its export and as Parquet, still reads as it was written."""

import dataclasses
import json
import math
import sqlite3
from pathlib import Path

import pytest

from sensorgen.measure.log import TABLES, Log, Reading, bench, facts, importing, verify

EARLIER = Path(__file__).with_name("of_0645a80")
ROWS = json.loads((EARLIER / "rows.json").read_text("utf-8"))


def shown(value):
    if isinstance(value, tuple):
        return [shown(item) for item in value]
    return "inf" if value == math.inf else value


def rows(log):
    return {
        table: [
            {k: shown(v) for k, v in dataclasses.asdict(entry).items()} for entry in log.entries(kind, superseded=True)
        ]
        for kind, table in TABLES.items()
    }


@pytest.fixture
def earlier(path):
    """The log's file, without its raw files."""
    connection = sqlite3.connect(path)
    connection.executescript((EARLIER / "log.sql").read_text("utf-8"))
    connection.close()
    return path


def test_the_database_reads_as_it_was_written(earlier):
    with Log(earlier) as log:
        assert rows(log) == ROWS
        assert len(log.readings()) == len(log.readings(superseded=True)) - 1
        assert [str(fault).partition(" (")[0] for fault in verify.faults(log)] == [
            f"raw file {name}" for name in ("batch.json", "run.csv", "rig.csv", "alone.mat")
        ]


def test_the_export_gives_the_same_log(log):
    done = importing.import_file(log, EARLIER / "export", {})
    assert (done.rows, done.new) == (sum(map(len, ROWS.values())),) * 2
    assert rows(log) == ROWS
    assert list(verify.faults(log)) == []


def test_readings_in_parquet_are_the_same(log):
    importing.import_file(log, EARLIER / "readings.parquet", {})
    assert rows(log)["reading"] == ROWS["reading"]


def test_the_log_that_it_came_from_takes_nothing_of_it(earlier):
    with Log(earlier) as log:
        assert importing.import_file(log, EARLIER / "export", {}).new == 0


def test_recordings_are_read_again_from_their_files(log):
    importing.import_file(log, EARLIER / "export", {})
    first, *others = log.recordings(superseded=True)
    (one,), rig = bench.read_again(log, first)
    summary = facts.from_json(first.facts)
    assert (len(one.time_s), rig.counts()) == (575, {"rows": summary.rig.rows, "errors": summary.rig.errors})
    assert tuple(one.tones_hz) == summary.lockins[0].tones_hz
    assert summary.lockins[0].bandwidth_hz is None
    assert summary.columns == {"t": "time_s"}
    for run in others:
        (one,), rig = bench.read_again(log, run)
        assert (len(one.time_s), rig) == (40, None)


def test_new_rows_stand_beside_the_earlier_ones(earlier):
    with Log(earlier) as log:
        (row,) = log.add([Reading(uid="new", specimen="26 triX .1mm", written="26 triX .1mm", y_ohm=(650.0,))])
        assert (row.number, row.batch, row.design_id) == (len(ROWS["reading"]) + 1, "26", "a" * 16)
