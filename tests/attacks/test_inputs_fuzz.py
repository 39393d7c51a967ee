"""A few damaged files of each kind; ``make attack`` feeds 10 000 of each."""

import fuzz
import pytest


@pytest.mark.parametrize(("kind", "count"), [("mat", 30), ("packed", 20), ("hdf5", 30), ("csv", 20), ("rig", 20),
                                             ("gcode", 100), ("printer", 150), ("quality", 150), ("plan", 100),
                                             ("design", 100), ("invert", 100)])  # fmt: skip
def test_damaged_files_are_read_or_refused(kind, count):
    found = fuzz.fuzz(kind, count, 1)
    assert found["faults"] == []
    assert found["read"] + found["refused"] == count
    assert found["refused"] > count / 20
    assert found["resident_mb"] < 512


def test_a_reader_that_fails_is_seen(monkeypatch):
    """The harness itself: a planted fault in a reader is counted."""
    assert fuzz.outcome(lambda _: 1 / 0, None)[0] == "fault"
    assert fuzz.outcome(lambda _: None, None)[0] == "read"
