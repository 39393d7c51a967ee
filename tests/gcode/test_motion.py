"""Positions and filament by hand, in every way in which a file may say them."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sensorgen.core.errors import BadInput
from sensorgen.design.printer import Macro, load_printer
from sensorgen.export.gcode import motion as paths
from sensorgen.export.gcode.motion import follow
from sensorgen.export.gcode.words import effect, parse

R = "M83"


def test_homing_without_an_axis_is_homing_of_all():
    assert follow([R, "G1 X1 Y2 Z3", "G28", "G1 X4"]).start_mm[-1].tolist() == [0, 0, 0]
    assert follow([R, "G1 X1 Y2 Z3", "G28 Z", "G1 X4"]).start_mm[-1].tolist() == [1, 2, 0]


def test_a_macro_may_take_the_tool():
    motion = follow([R, 'M98 P"tprime3.g"', "G1 X1 E1", 'M98 P"other.g"', "G1 X2"], "tprime{tool}.g")
    assert motion.tools.column(2).tolist() == [3, 3]
    assert [(c.tool, c.macro, c.number) for c in motion.changes] == [(3, True, 2)]


@pytest.mark.parametrize(
    ("line", "length"),
    [
        ("G3 X-10 Y0 I-10 J0 E3", 10 * math.pi),  # half a circle, to the left
        ("G2 X-10 Y0 R10 E3", 10 * math.pi),
        ("G3 X0 Y10 R10 E3", 5 * math.pi),
        ("G3 X0 Y10 R-10 E3", 15 * math.pi),
        ("G2 X0 Y10 I-10 J0 E3", 15 * math.pi),
        ("G2 I-10 E3", 20 * math.pi),
    ],
)
def test_arcs_have_their_length_and_share_their_filament(line, length):
    motion = follow([R, "G1 X10", line])
    assert motion.length_mm[1:].sum() == pytest.approx(length, rel=1e-3)
    assert motion.extruded_mm.sum() == pytest.approx(3.0)
    assert set(motion.number.tolist()) == {2, 3}
    assert np.hypot(*motion.end_mm[1:, :2].T).max() == pytest.approx(10.0, abs=0.01) or "R" in line


def test_a_wide_arc_is_nearly_straight():
    motion = follow([R, "G1 X10", "G3 X10 Y100 I-900000000 J50"])
    assert motion.length_mm[1:].sum() == pytest.approx(100.0, rel=1e-6)


@pytest.mark.parametrize(
    ("line", "low", "high"),
    [
        ("G3 X-10 I-10", (-10, 0), (10, 10)),
        ("G2 X-10 I-10", (-10, -10), (10, 0)),
        ("G3 X0 Y10 R10", (0, 0), (10, 10)),
        ("G3 X0 Y10 R-10", (0, 0), (20, 20)),
        ("G2 X0 Y10 I-10", (-10, -10), (10, 10)),
        ("G3 X-8 Y6 I-10 ", (-8, 0), (10, 10)),
        ("G3 X8 Y6 I-10 ", (8, 0), (10, 6)),
        ("G3 I-10 Z4", (-10, -10), (10, 10)),
    ],
)
def test_an_arc_turns_the_right_way_and_reaches_as_far_as_its_chords(line, low, high):
    motion = follow([R, "G1 X10", f"{line} E2"])
    lowest, highest = motion.box_mm()
    assert (lowest[1, :2], highest[1, :2]) == (pytest.approx(low, abs=1e-9), pytest.approx(high, abs=1e-9))
    _, start, end = motion.arcs.chords()
    every = np.concatenate([start, end])
    assert every.min(axis=0)[:2] == pytest.approx(low, abs=0.006)
    assert every.max(axis=0)[:2] == pytest.approx(high, abs=0.006)
    assert start[1:] == pytest.approx(end[:-1])
    assert np.hypot(*(end - start)[:, :2].T).sum() == pytest.approx(motion.across_mm[1], rel=1e-3)


@pytest.mark.parametrize("radius", [0.003, 1.0, 5e4])
def test_chords_stay_near_their_arc(radius):
    motion = follow([R, f"G1 X{radius:.4f}", f"G3 I{-radius:.4f} E2", f"G2 I{-radius:.4f} E2"])
    which, start, end = motion.arcs.chords()
    middle = (start + end) / 2
    assert radius - np.hypot(*middle[:, :2].T).min() < max(0.0051, radius * 2e-5)
    assert np.bincount(which).tolist() == [len(which) / 2] * 2


def test_a_spiral_rises_evenly():
    _, _, end = follow([R, "G1 X10", "G3 X-10 Z2 I-10"]).arcs.chords()
    assert end[-1].tolist() == [-10, 0, 2]
    assert np.diff(end[:, 2]) == pytest.approx(np.full(len(end) - 1, 2 / len(end)))
    assert follow([R, "G1 X10", "G3 X-10 Z2 I-10"]).length_mm[1] == pytest.approx(math.hypot(10 * math.pi, 2))


def test_a_printed_arc_is_read_as_chords_that_share_its_filament():
    found = paths.read([R, "G1 X10 E1", "G3 X-10 I-10 E3", "G1 X-20 E1", "G2 X-20 I5"], load_printer("diabase-h5"))
    inner = found.number == 3
    assert found.number.tolist() == sorted(found.number.tolist())
    assert inner.sum() > 40
    assert found.filament_mm[inner] == pytest.approx(3 / inner.sum())
    assert found.start_mm[1:] == pytest.approx(found.end_mm[:-1])
    assert found.length_mm()[inner].sum() == pytest.approx(10 * math.pi, rel=1e-3)
    assert np.hypot(*found.end_mm[inner, :2].T) == pytest.approx(np.full(inner.sum(), 10.0))


def test_arcs_beside_the_plane_of_the_bed_are_straight_and_said():
    motion = follow([R, "G1 X10", "G18", "G3 X-10 I-10 J0", "G17", "G3 X10 I10 J0"])
    assert motion.arcs.row.tolist() == [2]
    assert [fault.number for fault in motion.faults] == [4]


@pytest.mark.parametrize(
    "line", ["G2 X5 Y5", "G2 X5 R1", "G2 X9 Y9 I1 J0", "G2 X5 Rnan", "G3 X9 I9" + 17 * "0", "G3 X9 I" + 400 * "9"]
)
def test_an_arc_that_cannot_be_is_a_straight_line_and_said(line):
    motion = follow([R, "G1 X10", line])
    assert len(motion.rows) == 2
    assert any("straight line" in fault.what for fault in motion.faults)


def test_values_that_are_none_are_faults_and_no_places():
    motion = follow([R, "G1 X1", "G1 Xnan Y2", "G1 X Y3", "G1 X-inf", "G1 X1" + "0" * 400, "G1 X0"])
    assert [fault.number for fault in motion.faults] == [3, 4, 5, 6]
    assert motion.end_mm[1:3].tolist() == [[1, 2, 0], [1, 3, 0]]
    assert np.isfinite(motion.rows).all()


def test_foreign_letters_in_the_comment_of_a_move_are_told():
    (fault,) = follow([R, "G1 X1 ; 210 \N{DEGREE SIGN}C", "G1 X2 ; 210 C"]).faults
    assert (fault.number, fault.severe) == (2, False)


def test_an_empty_file():
    motion = follow([])
    assert (len(motion.rows), motion.lines, motion.kind.column(0).tolist()) == (0, 0, [])


NUMBERS = st.one_of(
    st.integers(-999, 999).map(str),
    st.decimals(-500, 500, places=5).map(lambda value: f"{value:f}"),
    st.sampled_from(
        [".5", "-.25", "+3", "007.10", "-0", "0.1234567890123456789", "1e3", "1.2.3", "--1", "5.", ".", ""]
    ),
)
MOVES = st.builds(
    lambda code, words: " ".join([code, *(letter + number for letter, number in words)]),
    st.sampled_from(["G0", "G1", "G1", "G1", "G2", "G3"]),
    st.lists(st.tuples(st.sampled_from("XYZEFIJR"), NUMBERS), max_size=5),
)
MODES = st.sampled_from(
    ["G90", "G91", "M82", "M83", "G20", "G21", "T1", "T2", "G92 E0", "G92 X1", "G28 Y", "G92", "G91 G1 X1 G90 G1 Y2"]
)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.one_of(MOVES, MOVES, MOVES, MODES), max_size=40))
def test_moves_read_all_at_once_are_those_read_one_by_one(lines):
    """A bracket with nothing in it makes a line one that is read word by word, and changes nothing."""
    fast, slow = follow(lines), follow([f"{line} ()" for line in lines])
    assert fast.rows.tolist() == slow.rows.tolist()
    assert fast.arcs.centre_mm.tolist() == slow.arcs.centre_mm.tolist()
    assert [(f.number, f.what) for f in fast.faults] == [(f.number, f.what) for f in slow.faults]
    tools = [each.tools.column(len(each.rows)).tolist() for each in (fast, slow)]
    assert tools[0] == pytest.approx(tools[1], nan_ok=True)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.one_of(MOVES, MOVES, MODES), max_size=40))
@example(["M83", "G1 X1 Y2 Z3", "G91", "G1 X1", "G0 Y-2 Z1", "G90", "G1 X0", "G20", "G1 X1 E1 F10", "G21", "G1 X1"])
@example(["M82", "G1 X1 E2", "M83", "G1 X2 E3", "G1  x3 E1", "M82", "G1 X4 E7", "G1 X5 e7.5"])
@example(["M83", "T1", "G1 E-2", "T2", "G1 X1 E1", "T1", "G1 E2.5"])
@example(["M83", "G1 X7", "G91", "G92 X5", "G1 X1", "G28 X", "G1 X2", "G90", "G1 X3"])
@example(["M83", *(f"G1 X{k} E{e}" for k, e in enumerate((-3, 1, -0.5, 2, 1, 1, -1, 2)))])
def test_columns_are_what_a_machine_does_line_by_line(lines):
    """Followed anew as a firmware does it, with one state."""
    at, held, rows = dict.fromkeys("XYZE", 0.0), {"scale": 1.0, "G91": False, "M82": True, "F": 3000.0}, []
    owed, tool = {}, -1
    for line in lines:
        for command in parse(line).commands:
            code, given = command.code, {k: command.number(k) for k in "XYZEF" if command.has(k)}
            given = {k: v * held["scale"] for k, v in given.items() if v == v}
            if code in ("G0", "G1", "G2", "G3"):
                held["F"] = given.pop("F", held["F"])
                start = dict(at)
                moved = given.get("E", 0.0) - (at["E"] if held["M82"] and "E" in given else 0.0)
                at["E"] += moved
                for axis in set("XYZ") & set(given):
                    at[axis] = given[axis] + (at[axis] if held["G91"] else 0.0)
                debt = owed.get(tool, 0.0)
                extruded, owed[tool] = max(0.0, moved - debt), max(0.0, debt - moved)
                rows.append([*(start[a] for a in "XYZ"), *(at[a] for a in "XYZ"), extruded, moved, held["F"]])
            elif code in ("G92", "G28"):
                names = [k for k in "XYZE" if command.has(k)] or list("XYZE" if code == "G92" else "XYZ")
                for k in names:
                    at[k] = 0.0 if code == "G28" else given.get(k, at[k] if given or command.has(k) else 0.0)
            elif code[0] == "T":
                tool = int(code[1:])
            else:
                held.update({"G20": {"scale": 25.4}, "G21": {"scale": 1.0}}.get(code, {}))
                held.update({"G90": {"G91": False}, "G91": {"G91": True}}.get(code, {}))
                held.update({"M82": {"M82": True}, "M83": {"M82": False}}.get(code, {}))
    assert follow(lines).rows[:, :9] == pytest.approx(np.array(rows).reshape(-1, 9), abs=1e-9)


def test_macros_of_a_change_are_executed():
    """As Diabase's: 40 mm up, back to X and Y and to 2 mm above the place of the change; and two others."""
    lines = [R, "G1 X1 Y2 Z3", "T3", "G1 X5", "G1 Z3", "T3", "G1 X6", "T4", "G1 Y7"]
    motion = follow(lines, change=effect("G91\nG1 Z40\nG90\nG1 R2 X0 Y0\nG1 R2 Z2"))
    assert motion.end_mm.tolist() == [[1, 2, 3], [5, 2, 5], [5, 2, 3], [6, 2, 3], [6, 7, 5]]
    assert motion.z_stated.tolist() == [True, False, True, True, False]
    assert follow(lines).end_mm[-1].tolist() == [6, 7, 3]
    stays = Macro(lift_mm=40.0, return_mm=(0.0, 0.0, None), leaves="G91")
    assert follow(lines, change=effect(stays.gcode())).end_mm[1].tolist() == [6, 2, 43]
    parks = follow(lines, change=effect("G1 X-180 Y-45 Z3\nG91\nG1 Z1\nG90"))
    assert parks.start_mm[1].tolist() == [-180, -45, 4]
    with pytest.raises(BadInput, match="lift_mm"):
        effect("if true\n  G1 Z2")
