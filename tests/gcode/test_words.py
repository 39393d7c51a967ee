"""One line of G-code, in all the forms in which files have it."""

import pytest

from sensorgen.export.gcode.words import parse


def commands(text: str) -> list[tuple[str, dict[str, str]]]:
    line = parse(text)
    assert line.faults == ()
    return [(c.code, dict(c.words)) for c in line.commands]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("G1 X1.5 Y-.5 E+2. F1800\n", [("G1", {"X": "1.5", "Y": "-.5", "E": "+2.", "F": "1800"})]),
        ("g01x1y2", [("G1", {"X": "1", "Y": "2"})]),
        ("G1 X 1.5\tY 2 ; to the left\r\n", [("G1", {"X": "1.5", "Y": "2"})]),
        ("(G28) G1 (X9) X1", [("G1", {"X": "1"})]),
        ("T3", [("T3", {})]),
        ("T-1 P0", [("T-1", {"P": "0"})]),
        ("M104 T3 S210:205", [("M104", {"T": "3", "S": "210:205"})]),
        ("G10 S210 P2 ; set temperature", [("G10", {"S": "210", "P": "2"})]),
        ('M98 P"tprime3.g" ; tool change', [("M98", {"P": "tprime3.g"})]),
        ('M291 P"Is it; in?" R"Bed (hot)" S3', [("M291", {"P": "Is it; in?", "R": "Bed (hot)", "S": "3"})]),
        ("G91 G1 Z5", [("G91", {}), ("G1", {"Z": "5"})]),
        ("G54.1 P3", [("G54.1", {"P": "3"})]),
        ("M117 Layer 3 of 9; G28", [("M117", {"": "Layer 3 of 9"})]),
        ("N3 T0*57", [("T0", {})]),
        ("; G28", []),
        ("   \n", []),
        ("G1 X{move.axes[0].max}", [("G1", {"X": "{move.axes[0].max}"})]),
    ],
)  # fmt: skip
def test_what_a_line_says(text, expected):
    assert commands(text) == expected


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("X5 Y3", "stands before any command"),
        ("G", "is no command"),
        ("Gnan", "is no command"),
        ("G" + 400 * "1", "is no command"),
        ("G1 X5 §", "means nothing"),
        ('M98 P"tprime3.g', "does not end"),
        ("N3 T1*57", "checksum 57 is wrong"),
        ("if sensors.analog[0].lastReading > 50", "own language"),
    ],
)
def test_what_cannot_be_read_is_said(text, fault):
    assert any(fault in said for said in parse(text).faults)


def test_long_lines_take_no_long_time():
    assert parse("G1 X1" + " " * 4_000 + "\n").faults == ()
    assert len(parse("G1" + " X1" * 1_300).commands[0].words) == 1_300
    assert parse('M98 P"' + '""' * 2_000).faults


def test_a_line_without_end_is_a_fault_and_a_long_comment_is_none():
    long = parse("G1 X1" + "*1" * 20_000)
    assert (long.commands, long.faults) == ((), ("a line of 40005 characters; no firmware takes it",))
    assert parse("G1 X1 ;" + "a" * 20_000).faults == ()
