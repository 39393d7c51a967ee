"""What a file takes, by hand."""

import math

import pytest

from sensorgen.core.document import Facts
from sensorgen.design import materials
from sensorgen.design.printer import load_printer
from sensorgen.export.gcode.check import check
from sensorgen.export.gcode.motion import follow
from sensorgen.export.gcode.moves import seconds

from .good import OWN  # isort: skip

DIABASE = load_printer("diabase-h5")


def test_filament_mass_and_purge_of_each_tool():
    result = check(OWN.splitlines(), DIABASE)
    three, four = result.tools
    assert (three.tool, three.material, three.filament_mm, three.purge_mm) == (3, "etpu", pytest.approx(0.2), 0.0)
    assert (four.tool, four.material) == (4, "x60")
    assert (four.filament_mm, four.purge_mm) == pytest.approx((0.5, 0.3))
    assert four.volume_mm3 == pytest.approx(0.5 * math.pi * 1.75**2 / 4)
    density = materials.load("x60").value("density_kg_m3").value
    assert four.mass_g == pytest.approx(four.volume_mm3 * 1e-9 * density * 1e3)
    assert (result.tool_changes, result.layers) == (1, 2)
    assert result.box_mm == ((10.0 - 10.0, 5.0, 0.1), (15.0, 20.0, 0.2))


def test_a_material_may_be_named_and_none_means_no_mass():
    lines = ["M83", "T5", "G1 X1 E1"]
    assert check(lines, DIABASE).tools[0].mass_g is None  # bvoh or pla
    named = check(lines, DIABASE, {5: "x60"}).tools[0]
    assert (named.material, named.mass_g) == ("x60", pytest.approx(math.pi * 1.75**2 / 4 * 1e-3))
    assert check(lines, DIABASE, {5: "nothing"}).tools[0].mass_g is None


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (["G1 X10 F600"], 1.0),
        (["G1 X200 F99999"], 1.0),  # the axis is slower
        (["G1 Z50 F12000"], 1.0),
        (["G1 E10 F600"], 1.0),
        (["G1 X1 E100 F99999"], 1.0),
        (["G4 S1"], 1.0),
        (["G4 P1000"], 1.0),
        (["G1 X10 F600", "G1 X0", "G1 X10 F1200"], 2.5),
    ],
)
def test_time_by_hand(lines, expected):
    assert check(["G90", "M83", *lines], DIABASE).time_s == pytest.approx(expected)


def test_a_feed_of_none_takes_long_but_not_for_ever():
    assert math.isfinite(seconds(follow(["M83", "G1 X1 F0"]), DIABASE.max_speed_mm_s).sum())


def test_spot_extrusion_is_purge():
    tool = check(["M83", "T3", "G1 E5", "G1 E-2", "G1 E2", "G1 X1 E.5"], DIABASE).tools[0]
    assert (tool.filament_mm, tool.purge_mm) == (5.5, 5.0)


def test_purge_that_no_comment_tells_is_unknown():
    found = check(["M83", "T3", "G1 X1 E.5"], DIABASE)
    assert found.tools[0].purge_mm is None
    rows = [row for part in found.document() if isinstance(part, Facts) for row in part.rows]
    assert ("purged", "not counted by the file") in rows
    assert check([";TYPE:FILL", "M83", "T3", "G1 X1 E.5"], DIABASE).tools[0].purge_mm == 0.0
