"""A few damaged files of each kind; ``make attack`` feeds 10 000 of each."""

import fuzz
import pytest

COUNTS = {
    "mat": 40, "packed": 15, "hdf5": 20, "csv": 20, "rig": 20, "table": 30, "words": 30, "parquet": 30, "batch": 30,
    "db": 30, "gcode": 20, "printer": 30, "plan": 20, "design": 20,
}  # fmt: skip


@pytest.fixture(scope="module")
def outcomes():
    """Of all kinds in one process, whose begin takes longer than they do."""
    return fuzz.fuzz([(kind, number) for kind, count in COUNTS.items() for number in range(count)], 1)


@pytest.mark.parametrize("kind", COUNTS)
def test_damaged_files_are_read_or_refused(kind, outcomes):
    count, found = COUNTS[kind], outcomes[kind]
    assert found["faults"] == []
    assert found["read"] + found["refused"] == count
    assert found["refused"] > count / 20
    assert found["resident_mb"] < 512


def test_a_reader_that_fails_is_seen(monkeypatch):
    """The harness itself: a planted fault in a reader is counted."""
    assert fuzz.outcome(lambda _: 1 / 0, None)[0] == "fault"
    assert fuzz.outcome(lambda _: None, None)[0] == "read"
