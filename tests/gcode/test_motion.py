"""Positions and filament by hand, in every way in which a file may say them."""

import math

import numpy as np
import pytest

from sensorgen.gcode.motion import follow

R = "M83"


def ends(*lines):
    return follow(lines).end_mm.tolist()


def test_absolute_and_relative_places():
    assert ends(R, "G1 X1 Y2 Z3", "G91", "G1 X1", "G0 Y-2 Z1", "G90", "G1 X0") == [
        [1, 2, 3], [2, 2, 3], [2, 0, 4], [0, 0, 4],
    ]  # fmt: skip


def test_starts_are_where_the_last_move_ended():
    motion = follow([R, "G1 X1", "G92 X5", "G1 X6", "G28 Y", "G1 Y2"])
    assert motion.start_mm[:, 0].tolist() == [0, 5, 6]
    assert motion.length_mm().tolist() == [1, 1, 2]
    assert follow([R, "G1 Z1", "G92 Y9 Z5", "G1 Z6", "G1 Y10"]).length_mm().tolist() == [1, 1, 1]
    assert follow([R, "G1 X1 Y1 Z1", "G92", "G1 X3"]).length_mm()[1] == 3


def test_inches():
    assert ends(R, "G20", "G1 X1 F10", "G21", "G1 X1") == [[25.4, 0, 0], [1, 0, 0]]
    assert follow([R, "G20", "G1 X1 E1 F10"]).feed_mm_min.tolist() == [254.0]
    assert follow([R, "G20", "G1 X1 E1 F10"]).filament_mm.tolist() == [25.4]


@pytest.mark.parametrize(
    "lines",
    [
        ["M83", "G1 X1 E2", "G1 X2 E-3", "G1 X3 E3", "G1 X4 E.5"],
        ["M82", "G1 X1 E2", "G1 X2 E-1", "G1 X3 E2", "G1 X4 E2.5"],
        ["M82", "G1 X1 E2", "G92 E0", "G1 X2 E-3", "G1 X3 E0", "G92 E7", "G1 X4 E7.5"],
        ["m83", "g1x1e2", "G1 E-3 X2 ", "N5 G1 X3 E3", "G01 X4 E0.5"],
    ],
)
def test_filament_relative_and_absolute(lines):
    motion = follow(lines)
    assert motion.filament_mm.tolist() == [2, -3, 3, 0.5]
    assert motion.extruded_mm.tolist() == [2, 0, 0, 0.5]
    assert motion.end_mm[:, 0].tolist() == [1, 2, 3, 4]


def test_relative_filament_moves_the_absolute_place_on():
    """As in RepRapFirmware, whose virtual position of the extruder follows both."""
    motion = follow(["M82", "G1 X1 E2", "M83", "G1 X2 E3", "G1  x3 E1", "M82", "G1 X4 E7", "G1 X5 e7.5"])
    assert motion.filament_mm.tolist() == [2, 3, 1, 1, 0.5]


def test_each_tool_owes_its_own_retraction():
    motion = follow([R, "T1", "G1 E-2", "T2", "G1 X1 E1", "T1", "G1 E2.5"])
    assert motion.extruded_mm.tolist() == [0, 1, 0.5]
    assert motion.tools.column(3).tolist() == [1, 2, 1]


def test_a_macro_may_take_the_tool():
    motion = follow([R, 'M98 P"tprime3.g"', "G1 X1 E1", 'M98 P"other.g"', "G1 X2"], "tprime{tool}.g")
    assert motion.tools.column(2).tolist() == [3, 3]
    assert [(c.tool, c.macro, c.number) for c in motion.changes] == [(3, True, 2)]


def test_feed_holds_until_the_next():
    assert follow([R, "G1 X1", "G1 X2 F600", "G1 F900", "G1 X3", "G1 F300 X4"]).feed_mm_min.tolist() == [
        3000, 600, 900, 900, 300,
    ]  # fmt: skip


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
    assert motion.length_mm()[1:].sum() == pytest.approx(length, rel=1e-3)
    assert motion.extruded_mm.sum() == pytest.approx(3.0)
    assert set(motion.number.tolist()) == {2, 3}
    assert np.hypot(*motion.end_mm[1:, :2].T).max() == pytest.approx(10.0, abs=0.01) or "R" in line


def test_a_wide_arc_is_nearly_straight():
    motion = follow([R, "G1 X10", "G3 X10 Y100 I-900000000 J50"])
    assert motion.length_mm()[1:].sum() == pytest.approx(100.0, rel=1e-6)


def test_an_arc_turns_the_right_way():
    assert follow([R, "G1 X10", "G3 X-10 I-10"]).end_mm[:, 1].max() == pytest.approx(10, abs=0.01)
    assert follow([R, "G1 X10", "G2 X-10 I-10"]).end_mm[:, 1].min() == pytest.approx(-10, abs=0.01)
    assert follow([R, "G1 X10", "G3 X0 Y10 R10"]).end_mm[:, 0].max() == pytest.approx(10, abs=0.01)


def test_a_spiral_rises_evenly():
    z = follow([R, "G1 X10", "G3 X-10 Z2 I-10"]).end_mm[1:, 2]
    assert z[-1] == 2.0
    assert np.diff(z) == pytest.approx(np.full(len(z) - 1, 2 / len(z)))


@pytest.mark.parametrize(
    "line",
    ["G2 X5 Y5", "G2 X5 R1", "G2 X9 Y9 I1 J0", "G2 X5 Rnan", "G3 X9 I9" + 17 * "0", "G3 X9 I" + 400 * "9"],
)
def test_an_arc_that_cannot_be_is_a_straight_line_and_said(line):
    motion = follow([R, "G1 X10", line])
    assert len(motion.rows) == 2
    assert any("straight line" in fault.what for fault in motion.faults)


def test_comments_of_slicers():
    motion = follow(
        [
            R, ";LAYER_CHANGE", ";HEIGHT:0.1", ";TYPE:External perimeter", ";WIDTH:0.44", "G1 X1 E1", ";WIDTH:0.39",
            "G1 X2 E1", ";LAYER_CHANGE", "G1 X3 E1 ;TYPE:Skirt", "G1 X4 E1",
        ]
    )  # fmt: skip
    assert motion.width_mm.column(4).tolist() == [0.44, 0.39, 0.39, 0.39]
    assert motion.layer.column(4).tolist() == [1, 1, 2, 2]
    assert motion.height_mm.column(4).tolist() == [0.1] * 4
    assert [motion.kinds[int(k)] for k in motion.kind.column(4, 0)][:2] == ["external perimeter"] * 2


def test_values_that_are_none_are_faults_and_no_places():
    motion = follow([R, "G1 X1", "G1 Xnan Y2", "G1 X Y3", "G1 X-inf", "G1 X1" + "0" * 400, "G1 X0"])
    assert [fault.number for fault in motion.faults] == [3, 4, 5, 6]
    assert motion.end_mm[1:3].tolist() == [[1, 2, 0], [1, 3, 0]]
    assert np.isfinite(motion.rows).all()


def test_an_empty_file():
    motion = follow([])
    assert (len(motion.rows), motion.lines, motion.kind.column(0).tolist()) == (0, 0, [])
