"""Travel over another tool's material: known overlaps, measure by polygons, lifts, and planted faults."""

import math
import re

import numpy as np
import pytest
import shapely

from sensorgen.asprinted import nozzle as strands
from sensorgen.core.errors import BadInput
from sensorgen.design.design import make
from sensorgen.design.printer import load_printer
from sensorgen.export.gcode.check import check
from sensorgen.export.gcode.crossings import PrintedLines, crossings, drags, lift
from sensorgen.export.gcode.motion import follow

DIABASE, XL = load_printer("diabase-h5"), load_printer("prusa-xl5")
PER_MM3 = 4 / (math.pi * 1.75**2)  # filament of a volume


def e(length, width=0.5, height=0.1):
    """Filament of a line."""
    return f"E{length * width * height * PER_MM3:.6f}"


# Ten lines of T3 along x, 0 to 20 mm, 0.5 mm wide at y 0, 1, ... 9; then T4 passes over them along y.
COMB = ["G21", "G90", "M83", "G28", "T3", "G1 Z0.1 F3000"] + [
    line for k in range(10) for line in (f"G1 X0 Y{k} F7200", f"G1 X20 {e(20)} F1200")
]
OVER = [
    "G1 X25 F7200", "G1 Y-3", "G1 E-2 F2400", "T4", "G1 E-3 F2400", "G1 X10 Y-3 F7200", "G1 Y12", "G1 E3 F2400",
    f"G1 X15 {e(5)} F1200",
]  # fmt: skip


def sums(lines, machine=DIABASE):
    return {t.tool: (round(t.contact_mm, 2), round(t.near_mm, 2)) for t in drags(lines, machine).tools}


def printing(text):
    """Texts of all lines that print, and the feeds at which they do, by the simulator."""
    motion, lines = follow(text), text.splitlines()
    rows = np.flatnonzero((motion.extruded_mm > 0) & (motion.across_mm > 0))
    return [lines[n - 1] for n in motion.number[rows]], motion.feed_mm_min[rows], motion.rows[rows, :6]


def assert_lifted(lines, machine=DIABASE):
    text = "\n".join([*lines, ""]).encode()
    lifted = lift(text, machine)
    made, lifting = lifted.text, lifted.lifting
    before, after = printing(text), printing(made)
    assert before[0] == after[0]
    assert before[1] == pytest.approx(after[1], abs=1e-3)
    assert np.array_equal(before[2], after[2])
    assert lifting.after.contact_mm + lifting.after.near_mm == 0
    assert follow(text).filament_mm.sum() == pytest.approx(follow(made).filament_mm.sum())
    return made.decode().splitlines(), lifting


def test_ten_lines_of_half_a_millimetre_are_crossed():
    assert sums(COMB + OVER) == {4: (5.0, 0.0)}
    found = drags(COMB + OVER, DIABASE).tools[0]
    assert (found.crossings, found.unretracted) == (1, 0)


def test_stretches_lie_where_the_lines_are():
    stretches = crossings(follow(COMB + OVER), DIABASE).stretches()
    assert stretches.length_mm == pytest.approx([0.5] * 10)
    assert stretches.touches.all()
    assert set(stretches.tool.tolist()) == {4}
    middle = (stretches.start_mm + stretches.end_mm) / 2
    assert middle == pytest.approx(np.array([[10.0, y, 0.1] for y in range(10)]))
    assert len(crossings(follow(COMB), DIABASE).stretches().tool) == 0


def test_one_layer_up_is_near_and_two_are_neither():
    up = [line.replace("G1 X10 Y-3", "G1 Z{} X10 Y-3") for line in OVER]
    assert sums(COMB + [line.format(0.2) for line in up]) == {4: (0.0, 5.0)}
    assert sums(COMB + [line.format(0.3) for line in up]) == {}


def test_an_own_line_on_top_hides_the_other_material():
    own = ["G1 X25", "G1 Y-3", "T4", "G1 Z0.2", "G1 X10 Y-1", f"G1 Y10 {e(11, 1.0)}", "G1 X10 Y12"]
    assert sums(COMB + own + OVER[5:]) == {}
    assert sums([*COMB, *OVER[:2], "T4", "G1 Z0.2", *OVER[5:]])[4][1] == 5.0


def test_tower_and_skirt_are_nobodys_material():
    assert sums([*COMB[:6], ";TYPE:Wipe tower", *COMB[6:], *OVER]) == {}
    assert sums([*COMB[:6], ";TYPE:SKIRT", *COMB[6:], *OVER]) == {}


def test_the_nozzles_face_rubs_on_what_is_beside_a_line():
    beside = ["T4", "G1 X5 Y-0.7", f"G1 X15 {e(10, 0.4)}"]  # 0.45 mm from the edge of the line at y 0
    away = ["T4", "G1 X5 Y-0.8", f"G1 X15 {e(10, 0.4)}"]  # 0.55 mm
    assert drags(COMB + OVER[:2] + beside, DIABASE).tools[0].rubbing_mm == pytest.approx(10, abs=0.01)
    assert drags(COMB + OVER[:2] + away, DIABASE).tools == ()


def by_polygons(moves):
    """Contact of travel with rectangles that another tool has printed before, one by one."""
    found, printed = 0.0, []
    for tool, start, end, width in moves:
        way = shapely.LineString([start, end])
        if width:
            printed.append((tool, way.buffer(width / 2, cap_style="square")))
        else:
            found += way.intersection(shapely.union_all([area for other, area in printed if other != tool])).length
    return found


def test_against_polygons():
    rng = np.random.default_rng(4)
    moves, lines, at = [], ["M83", "G1 Z0.1"], (0.0, 0.0)
    for _ in range(150):
        tool, end = int(rng.integers(3, 5)), tuple(rng.uniform(0, 30, 2).round(3).tolist())
        width = float(rng.uniform(0.3, 0.6)) * int(rng.integers(0, 2))
        moves.append((tool, at, end, width))
        lines += [f"T{tool}", f"G1 X{end[0]} Y{end[1]}" + (f" {e(math.dist(at, end), width)}" if width else "")]
        at = end
    expected = by_polygons(moves)
    assert expected > 200
    # where lines of both tools lie upon each other the top is the other's: polygons and rectangles alike
    assert drags(lines, DIABASE).contact_mm == pytest.approx(expected, rel=0.005)


def test_a_crossing_is_lifted_and_its_feed_restated():
    made, lifting = assert_lifted(COMB + OVER)
    assert (lifting.lifts, lifting.retractions) == (1, 0)
    place = made.index("G1 Y12")
    assert made[place - 2 : place + 2] == ["G1 Z0.3 F3000", "G1 F7200", "G1 Y12", "G1 Z0.1 F3000"]
    assert made[place + 2] == "G1 E3 F2400"


def test_an_unretracted_crossing_gets_its_tools_usual_retraction():
    lines = [*COMB, *OVER, "G1 X20 Y12 F7200", "G1 X12 Y-4", f"G1 X15 {e(3)}"]
    made, lifting = assert_lifted(lines)
    assert (lifting.lifts, lifting.retractions) == (2, 1)
    place = made.index("G1 X12 Y-4")
    assert made[place - 3 : place] == ["G1 E-3 F2400", "G1 Z0.3 F3000", "G1 F7200"]
    assert made[place + 1 : place + 4] == ["G1 Z0.1 F3000", "G1 E3 F2400", "G1 F7200"]


@pytest.mark.parametrize(("y", "retractions"), [(6.4, 0), (4.4, 1)])
def test_a_lifted_travel_of_up_to_2_mm_over_other_lines_draws_nothing_back(y, retractions):
    """Three lines of 0.5 mm, and five: 640 tips of cones cost 143 s of retractions."""
    _, lifting = assert_lifted([*COMB, *OVER, f"G1 Y{y} F7200", f"G1 X20 {e(5)}"])
    assert (lifting.lifts, lifting.retractions) == (2, retractions)


def test_heights_in_travels_move_to_the_way_down():
    """CuraEngine changes layers while it travels."""
    travels = ["T4", "G0 F7200 X10 Y-3", "G0 F600 X10 Y12 Z0.2", f"G1 F1200 X15 {e(5)}"]
    made, _ = assert_lifted([*COMB, *OVER[:2], *travels])
    place = made.index("G0 F600 X10 Y12")
    assert (made[place - 1], made[place + 1]) == ("G1 Z0.4 F3000", "G1 Z0.2 F3000")


def test_a_wipe_over_foreign_material_is_flown():
    wipe = ["T4", "G1 X10 Y-3", f"G1 X5 {e(5)} F1200", "G1 E-1 F2400", "G1 X5 Y5 E-2 F4800", "G1 X30", "G1 E3"]
    made, lifting = assert_lifted([*COMB, *wipe])
    assert "G1 X5 Y5 E-2 F4800" in made
    assert lifting.before.contact_mm > 2


def test_a_slow_z_axis_gets_its_own_feed():
    lines = [line.replace("T3", "T0").replace("T4", "T1") for line in COMB + OVER]
    made, _ = assert_lifted(lines, XL)
    assert "G1 Z0.3 F720" in made


def test_a_file_of_one_tool_stays_as_it_is():
    text = "\n".join([*COMB, "G1 X10 Y-3", "G1 Y12", ""]).encode()
    lifted = lift(text, DIABASE)
    made, lifting = lifted.text, lifted.lifting
    assert made == text
    assert (lifting.lifts, [*lifting.document()]) == (0, [])


@pytest.mark.parametrize("mode", ["G91", "G20"])
def test_relative_places_and_inches_are_refused(mode):
    with pytest.raises(BadInput, match=rf"line {len(COMB) + 1}: {mode}"):
        lift([*COMB, mode, *(["G1 X0.1"] if mode == "G20" else []), "G90", "G21", *OVER], DIABASE)


def test_lifts_are_no_new_findings():
    before = {f.rule for f in check(COMB + OVER, DIABASE).findings} - {"z"}  # a lift states Z
    made = lift(COMB + OVER, DIABASE).text
    assert {f.rule for f in check(made, DIABASE).findings} == before


@pytest.mark.parametrize("number", [0, 3])
def test_a_planted_crossing_is_found(number):
    """Of a lifted file, one lift left out at a time."""
    back = [f"G1 X{12 + number} Y-4 F7200", f"G1 X15 {e(3)} F1200", f"G1 X{14 - number} Y12 F7200", f"G1 X15 {e(1)}"]
    lifted = lift([*COMB, *OVER, *back, *back], DIABASE)
    made, lifting = lifted.text, lifted.lifting
    assert lifting.lifts == 5
    lines = made.decode().splitlines()
    up = [k for k, line in enumerate(lines) if line == "G1 Z0.3 F3000"]
    del lines[up[number]]
    assert drags(lines, DIABASE).contact_mm == pytest.approx(5.0, abs=0.5)


def test_a_planted_change_of_a_printing_line_is_found():
    text = "\n".join([*COMB, *OVER, ""]).encode()
    made = lift(text, DIABASE).text
    for old, new in ((rb"X20 E", b"X20.001 E"), (rb"F1200$", b"F1201"), (rb"(X15 E.*)", rb"\1 ;")):
        wrong = re.sub(old, new, made, count=1, flags=re.MULTILINE)
        assert wrong != made
        assert printing(wrong)[0] != printing(text)[0]
    without_feed = made.replace(b"G1 F7200\n", b"", 1)
    assert follow(without_feed).feed_mm_min.tolist() != follow(made).feed_mm_min.tolist()


def test_insulation_left_by_a_strand_on_a_plate():
    """A plate of X60, 0.5 mm thick, between two electrodes: a strand on its top has 0.5 mm below it."""
    design = make({"shape": "reference", "parameters": {"length_mm": 20.0, "width_mm": 10.0}})
    height, tools = design.printed.size_mm[2], {"etpu": 3, "x60": 4}
    lines = ["M83", "G90"]
    for z in design.layers.boundaries_mm(height)[1:]:
        (material,) = {b.material for b in design.printed.bodies for low, high in (b.pieces[0].span("z"),)
                       if low < z - 0.01 < high}  # fmt: skip
        lines += [f"T{tools[material]}", f"G1 Z{z}"]
        for k in range(24):
            lines += [f"G1 X-9.8 Y{-4.8 + k * 9.6 / 23:.3f}", f"G1 X9.8 {e(19.6, 0.44)}"]
    found = strands.drags(design, lines).strands
    film = sum(b.volume_mm3() for b in design.printed.bodies if b.material == "x60") / 200
    assert max(s.insulation_mm for s in found if s.near_mm > 9) == pytest.approx(film)


@pytest.mark.parametrize(
    ("z_mm", "left_mm"), [(0.05, 0.0), (0.1, 0.0), (0.3, 0.2), (0.5, 0.3), (0.85, 0.0), (1.4, 0.4)]
)
def test_insulation_reaches_to_the_nearest_electrode_above_or_below(z_mm, left_mm):
    """Electrodes from 0 to 0.1 mm and from 0.8 to 1 mm, in layers of 0.1 mm; beside them there is none."""
    tops = np.array([0.1, 0.9, 1.0])
    ends, none = (np.array([[x, 0.0]] * 3) for x in (0.0, 9.0)), np.zeros(3, np.int64)
    lines, layers = PrintedLines(*ends, tops, np.full(3, 0.5), none, none), np.arange(1, 11) / 10
    left = strands._insulation(np.array([[5.0, 0.0, z_mm], [5.0, 3.0, z_mm]]), lines, layers)
    assert left == pytest.approx([left_mm, np.inf])
