"""Round posts and strips at 45 degrees: layers of any shape, estimated and from lines, as scenes."""

import shutil
from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest
import shapely

from sensorgen.asprinted import printed as window
from sensorgen.asprinted.beads import Beads, _cut, _narrowed, layers
from sensorgen.asprinted.printed import gap_mm
from sensorgen.checks import estimate
from sensorgen.design import shape_files
from sensorgen.design.design import make
from sensorgen.design.printer import load_printer, load_quality
from sensorgen.export import slicing
from sensorgen.models import prisms
from sensorgen.prediction.bodies import from_gcode
from sensorgen.scene.layers import outlines, scene_of
from sensorgen.scene.scene import Body, Prism, Scene, box, rounded

PRINTER, FINE = load_printer("diabase-h5"), load_quality("fine")
SIZE = 12.0
PERIOD = 3.0


def sensor(pattern):
    """A pattern of 0.4 mm between two electrodes, on a film of 0.2 mm."""

    def plate(low, high):
        return (box(0, SIZE, 0, SIZE, low, high),)

    bodies = (
        Body("low", "etpu", plate(0, 0.3), "bottom"),
        Body("film", "x60", plate(0.3, 0.5)),
        Body("pattern", "etpu", tuple(Prism("z", o, 0.5, 0.9) for o in pattern), "top"),
        Body("high", "etpu", plate(0.9, 1.2), "top"),
    )
    return Scene(bodies, (SIZE, SIZE, 1.2))


def post(x, y, radius=0.8):
    return tuple((rounded(x + radius * cos(a)), rounded(y + radius * sin(a))) for a in np.arange(32) * pi / 16)


PLACES = np.arange(PERIOD / 2, SIZE, PERIOD)
POSTS = sensor([post(x, y) for x in PLACES for y in PLACES])


def test_a_pattern_of_posts_repeats_both_ways():
    found = window.window(POSTS, FINE.boundaries_mm(1.2))
    assert found.sides_mm() == pytest.approx((PERIOD, PERIOD))
    assert found.x_mm[0] % PERIOD == pytest.approx(0.0)  # from the middle between two posts: no post is cut


def test_a_pattern_about_the_middle_that_both_ends_cut_is_solved_as_one_period():
    """Half the sensor occurs a whole number of times, too; but it has many periods."""
    middles = SIZE / 2 + 1.1 * np.arange(-5, 6)
    spans = [(rounded(max(x - 0.3, 0.0)), rounded(min(x + 0.3, SIZE))) for x in middles]
    strips = sensor([((a, 0.0), (b, 0.0), (b, SIZE), (a, SIZE)) for a, b in spans])
    found = window.window(strips, FINE.boundaries_mm(1.2))
    assert found.sides_mm()[0] == pytest.approx(1.1)


def test_a_pattern_without_mirrors_is_solved_as_a_whole():
    steps = np.arange(0.5, SIZE - 4, PERIOD)
    slanted = sensor([((x, 0.0), (x + 1, 0.0), (x + 4, 3.0), (x + 3, 3.0)) for x in steps])
    found = window.window(slanted, FINE.boundaries_mm(1.2))
    assert found.sides_mm() == (SIZE, SIZE)
    assert found.repeats == (False, False)


def test_a_pattern_of_slanted_strips_repeats_by_shifts():
    strips = [((x, 0.0), (x + 1, 0.0), (x + 1 + SIZE, SIZE), (x + SIZE, SIZE)) for x in np.arange(-SIZE, SIZE, PERIOD)]
    plan = shapely.clip_by_rect(shapely.union_all([shapely.Polygon(o) for o in strips]), 0, 0, SIZE, SIZE)
    slanted = sensor(list(outlines(plan)))
    found = window.window(slanted, FINE.boundaries_mm(1.2))
    assert found.sides_mm() == pytest.approx((PERIOD, PERIOD))
    assert found.repeats == (True, True)


def test_the_estimate_of_a_post_is_a_rounding_narrower():
    made = estimate.layers(POSTS, PRINTER, FINE)
    less = estimate.ROUND * 0.1 / 2
    apothem = 0.8 * cos(pi / 32) - less
    assert made[6].region("pattern").area == pytest.approx(16 * 32 * apothem**2 * np.tan(pi / 32), rel=1e-6)


def test_the_cell_of_a_print_has_the_gap_and_volume_of_its_layers():
    made = estimate.layers(POSTS, PRINTER, FINE)
    cell = scene_of(window.cut(made, window.window(POSTS, FINE.boundaries_mm(1.2))), POSTS)
    assert gap_mm(cell) == pytest.approx(0.2)
    assert cell.body("pattern").volume_mm3() == pytest.approx(0.4 * made[6].region("pattern").area / 16, rel=1e-3)


class Sliced:
    """What ``layers`` reads of a design."""

    printed, layers = POSTS, FINE


def ring(x, y, radius, width, corners=64):
    """Lines around a post, their volume that of a rectangle of 0.1 mm height."""
    turn = np.arange(corners + 1) * 2 * pi / corners
    points = np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn)])
    start, end = points[:-1], points[1:]
    length = np.hypot(*(end - start).T)
    return start, end, np.full(corners, width), np.full(corners, 0.1), length * width * 0.1


@pytest.mark.parametrize(
    ("convention", "more"), [("vol", 0.0), ("stadium", estimate.ROUND * 0.1 / 2), ("deposit", 0.0)]
)
def test_rings_of_lines_make_a_round_post(convention, more):
    """Two walls of 0.4 mm fill a post of radius 0.8 mm."""
    start, end, width, height, volume = map(
        np.concatenate, zip(ring(1.5, 1.5, 0.6, 0.4), ring(1.5, 1.5, 0.2, 0.4), strict=True)
    )
    count = len(start)
    lines = Beads(
        start, end, width, height, volume, np.full(count, 6), np.full(count, 2), np.full(count, 1), np.arange(count)
    )  # fmt: skip
    found = layers(Sliced, lines, convention)[6].region("pattern")
    assert found.area == pytest.approx(pi * (0.8 + more) ** 2, rel=0.01)
    assert shapely.get_num_interior_rings(shapely.get_parts(found)).sum() == 0


def straight(start, end, width=0.4):
    """Lines of the pattern in the seventh layer, their volume that of a rectangle of 0.1 mm height."""
    start, end = np.array(start, float), np.array(end, float)
    ones = np.ones(len(start))
    volume = np.hypot(*(end - start).T) * width * 0.1
    layer, body, tool = (np.full(len(start), k) for k in (6, 2, 1))
    return Beads(start, end, ones * width, ones * 0.1, volume, layer, body, tool, np.arange(len(start)))


@pytest.mark.parametrize(("slit", "strips"), [(0.021, 1), (0.022, 2)])
def test_strips_beside_each_other_are_one_as_far_as_round_beads_bulge(slit, strips):
    """By 0.0215 mm in a layer of 0.1 mm."""
    lines = straight([[1.0, 0.0], [1.4 + slit, 0.0]], [[1.0, 8.0], [1.4 + slit, 8.0]])
    runs = _cut(lines, 0, 4.0, "vol", estimate.ROUND * 0.1)
    assert len(runs) == strips
    assert runs[[0, -1], [0, 1]] == pytest.approx([0.8, 1.6 + slit])


@pytest.mark.parametrize("convention", ["vol", "deposit"])
@pytest.mark.parametrize("across", [False, True], ids=["along", "across"])
def test_lines_that_end_half_a_width_inside_a_strip_fill_it(across, convention):
    """As a slicer lays them: the print has the strip's volume, 1.2 x 12 x 0.1 mm, and its place."""
    low, high = (5.0, 0.0), (6.2, SIZE)
    strip = sensor([((low[0], low[1]), (high[0], low[1]), high, (low[0], high[1]))])
    if across:
        rows = np.arange(0.2, SIZE, 0.4)
        lines = straight([(5.2, y) for y in rows], [(6.0, y) for y in rows])
    else:
        lines = straight([(x, 0.2) for x in (5.2, 5.6, 6.0)], [(x, SIZE - 0.2) for x in (5.2, 5.6, 6.0)])
    made = type("Sliced", (), {"printed": strip, "layers": FINE})
    found = layers(made, lines, convention)[6]
    assert found.region("pattern").area * found.height_mm == pytest.approx(1.2 * SIZE * 0.1, rel=1e-9)
    assert found.region("pattern").bounds == pytest.approx((*low, *high))


@pytest.mark.parametrize("turn", [0.0, 0.6, pi / 2])
@pytest.mark.parametrize(("convention", "width"), [("vol", 0.4), ("stadium", 0.4 + estimate.ROUND * 0.1)])
def test_ends_of_a_line_by_closed_form(turn, convention, width):
    """A rectangle of width w, longer than the line by w; of any shape a stadium of the deposit's area, then its rim."""
    length, start = 2.0, np.array([5.0, 5.0])
    line = straight([start], [start + length * np.array([cos(turn), sin(turn)])])
    (corners,) = line.corners_mm(convention)
    assert shapely.Polygon(corners).area == pytest.approx((length + 0.4) * width, rel=1e-12)
    assert corners.mean(0) == pytest.approx(start + length / 2 * np.array([cos(turn), sin(turn)]))
    region = layers(Sliced, line, convention)[6].region("pattern")
    rim, wide = width - 0.4, ((length**2 + pi * length * 0.4) ** 0.5 - length) * 2 / pi  # of a stadium of that area
    assert region.area == pytest.approx(length * 0.4 + rim * (length + (pi / 2 - 1) * wide) + rim * rim, rel=0.01)


@pytest.mark.parametrize(("pattern", "slicer"), [
    ("slanted", "prusa"), pytest.param("posts", "cura", marks=pytest.mark.nightly)
])  # fmt: skip
def test_a_shape_of_ones_own_is_sliced_and_read(pattern, slicer, tmp_path):
    """The capacitance by the lines of a real slicer is that of the drawing but for a rounding, and has both bounds."""
    if shutil.which({"prusa": "prusa-slicer", "cura": "CuraEngine"}[slicer]) is None:
        pytest.skip(f"{slicer} is not installed")
    pytest.importorskip("ngsolve")
    given = {"length_mm": 9.0, "width_mm": 9.0, "pattern": pattern}
    own = {"posts": {"period_mm": 3.0}, "slanted": {"period_mm": 2.0, "across_mm": 1.0}}[pattern]
    file = Path(__file__).parent / "shapes" / "pillars.py"
    shape_files.trust("pillars", file.read_text("utf-8"))  # it needs NumPy
    design = make({"shape": str(file), "parameters": given | own})
    made = slicing.sliced([slicing.alone(design)], slicer, tmp_path)
    printed = from_gcode(design, made.raw)
    scene, eps = printed.cells.first(), {"x60": 4.68, "air": 1.00059}
    assert scene.repeats == ((pattern == "slanted"),) * 2
    found = prisms.capacitance(scene, eps, 1e-2)
    assert found.width() < 1e-2
    meant = prisms.capacitance(design.in_use, eps, 0.1)
    assert found.middle() * printed.cells.count == pytest.approx(meant.middle(), rel=0.06)
    assert not any(printed.cells.remarks.values())


@pytest.mark.parametrize("degrees", [0, 90, 45, 135])
def test_lines_of_every_direction_unite_to_what_geos_unites(degrees):
    """Of 400 long lines and 100 across; each way is turned by another multiple of 45 degrees for Clipper's sweep."""
    rng = np.random.default_rng(degrees)
    angle = np.radians(np.where(np.arange(500) < 400, degrees, degrees + 90))
    way = np.column_stack([np.cos(angle), np.sin(angle)]) * np.where(np.arange(500) < 400, 8.0, 2.0)[:, None]
    start = rng.uniform(0, 60, (500, 2))
    lines = shapely.linestrings(np.stack([start, start + way], axis=1))
    plans, wider = (shapely.buffer(lines, 0.25 + more, quad_segs=4) for more in (0.0, 1e-6))
    united, other = _narrowed(wider, 1e-6, way), shapely.union_all(plans)
    assert shapely.symmetric_difference(shapely.make_valid(united), other).area < 1e-3
    assert united.area == pytest.approx(other.area, rel=1e-6)


@pytest.mark.parametrize(("apart", "area"), [(0.43, 10 * 0.83), (0.45, 2 * 10 * 0.4)])
def test_slits_are_closed_up_to_their_width(apart, area):
    """Lines 0.4 mm wide with a slit of 0.03 mm are one rectangle, with one of 0.05 mm two, where 0.04 mm are closed."""
    start = np.array([[0.0, 0.0], [0.0, apart]])
    lines = shapely.linestrings(np.stack([start, start + np.array([10.0, 0.0])], axis=1))
    plans = shapely.buffer(lines, 0.2 + 0.02, cap_style="flat")
    assert _narrowed(plans, 0.02, np.array([[10.0, 0.0]] * 2)).area == pytest.approx(area, rel=1e-2)
