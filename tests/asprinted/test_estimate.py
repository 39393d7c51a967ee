"""The mid-plane estimate against sections drawn by hand, and against what the slicers were found to print."""

from dataclasses import replace
from math import cos, pi, sin

import pytest
import shapely

from sensorgen.asprinted import printed as window
from sensorgen.checks.estimate import LineLayout, layers, lines
from sensorgen.core.errors import UnknownName
from sensorgen.design import design
from sensorgen.models import columns, fem2d
from sensorgen.prediction.bodies import estimated
from sensorgen.scene.layers import LayerRegions, scene_of
from sensorgen.scene.scene import Body, Prism, Scene, area_mm2, box

RING = ((1, 4, 1, 2), (1, 4, 3, 4), (1, 2, 2, 3), (3, 4, 2, 3))  # 3 x 3 mm around a hole of 1 x 1
COG = "top_electrode_with_cogs"
EPS = {"air": 1.00059, "x60": 4.68}

# Half widths of the cog per layer [mm], from 0.4 mm up: thesis' triX with a film of 0.1 mm, sliced for real.
SLICED = {
    "arachne": (0.0, 0.170, 0.239, 0.340, 0.440),
    "classic": (0.0, 0.0, 0.239, 0.339, 0.439),
    # One line, or two that overlap, of which one is thinned and keeps its path
    "cura": (0.0, 0.0, 0.22, 0.305, 0.45),
    "cura-gaps": (0.05, 0.155, 0.22, 0.305, 0.45),
    "cura-5": (0.0, 0.170, 0.25, 0.35, 0.45),
}
# Capacitance of one period of 2 mm [pF/m]: the rules by hand, solved by another program's finite elements; Cura's by
# finite differences of 2.5 um, which give 146.94 and 80.07 for the first two. Along x what overlaps takes from Cura's
# strips is lost on the side far from the middle of the bed, along y on the front of all.
SOLVED = {"arachne": 147.07, "classic": 80.02, "cura": 76.86, "cura-gaps": 196.89}
SOLVED_ALONG_X = SOLVED | {"cura": 78.45, "cura-gaps": 202.58}
SOLVED_WITHIN = {"arachne": 4e-4, "classic": 4e-4, "cura": 2e-3, "cura-gaps": 6e-3}


def tri(quality="fine", orientation="as-drawn", **more):
    parameters = {"dielectric_mm": 0.1, "length_mm": 12.0} | more
    return design.make({"shape": "tri", "parameters": parameters, "quality": quality, "orientation": orientation})


def one_period(d, walls):
    scene = d.printed
    plan = window.window(scene, d.layers.boundaries_mm(scene.size_mm[2]))
    found = window.cut(layers(scene, d.machine, d.layers, walls), plan)
    return scene_of(found, replace(scene, size_mm=(*plan.sides_mm(), scene.size_mm[2]))), plan


def estimate(scene, printer, quality, walls="arachne"):
    return scene_of(layers(scene, printer, quality, walls), scene)


def half_widths(scene):
    found = []
    for z in (0.45, 0.55, 0.65, 0.75, 0.85):
        boxes = [o for p in scene.body(COG).pieces for o in p.cut("z", z)]
        found.append(sum(area_mm2(o) for o in boxes) / scene.size_mm[1] / 2)
    return found


@pytest.mark.parametrize("walls", SLICED)
def test_cogs_are_as_wide_as_the_slicers_print_them(walls):
    scene, _ = one_period(tri(), walls)
    assert half_widths(scene) == pytest.approx(SLICED[walls], abs=0.0055)


@pytest.mark.parametrize("walls", SOLVED)
@pytest.mark.parametrize("along", ["x", "y"])
def test_capacitance_of_the_rules(walls, along):
    sides = {"length_mm": 12.0, "width_mm": 10.0}
    scene, plan = one_period(tri(along=along, **sides), walls)
    found = fem2d.capacitance(scene, EPS, 1e-3).middle() / (plan.area_mm2() / 2 * 1e-3) * 1e12
    assert found == pytest.approx((SOLVED_ALONG_X if along == "x" else SOLVED)[walls], rel=SOLVED_WITHIN[walls])


def test_a_strip_of_cura_keeps_the_side_that_lies_nearer_the_middle_of_the_bed():
    """Sides of the cog that hangs at 2.5 and 6.5 mm of 10, from 0.25 to 0.75 mm of its period, as sliced for real."""
    d = tri(dielectric_mm=0.2, length_mm=10.0, width_mm=10.0)
    made = estimate(d.printed, d.machine, d.layers, "cura-gaps")
    sides = {tuple(round(v, 3) for v in p.span("x")) for p in made.body(COG).pieces if p.span("z") == (0.7, 0.8)}
    assert {(2.31, 2.75), (6.25, 6.69)} <= sides


def test_a_sensor_printed_upside_down_is_the_same_sensor():
    as_drawn, _ = one_period(tri(), "arachne")
    turned, _ = one_period(tri(orientation="upside-down"), "arachne")
    assert half_widths(turned.turned_over()) == pytest.approx(half_widths(as_drawn), abs=1e-9)


def test_strips_across_strips_keep_their_place_and_lose_a_rounding():
    d = design.make({"shape": "rect", "parameters": {"dielectric_mm": 0.1, "length_mm": 8, "width_mm": 8}})
    scene, plan = one_period(d, "arachne")
    assert (plan.x_mm, plan.y_mm) == ((3.35, 5.35), (3.35, 5.35))
    lower, upper = (
        {round(o[1][k] - o[0][k], 4) for p in scene.body(COG).pieces for o in p.cut("z", z)}
        for k, z in ((0, 0.55), (0, 0.85))
    )
    assert lower == {0.6785}  # 0.7 less 0.1 (1 - pi / 4): along x the lower strips are cut
    assert upper == {2.0}


def test_a_plate_comes_out_as_drawn():
    d = design.make({"shape": "reference"})
    made = estimate(d.printed, d.machine, d.layers, "classic")
    assert made.body("bottom_electrode") == d.printed.body("bottom_electrode")
    assert columns.capacitance(made, EPS).middle() == pytest.approx(
        columns.capacitance(d.printed, EPS).middle(), rel=1e-12, abs=0
    )


@pytest.mark.parametrize(("quality", "film", "height"), [("fine", 0.1, 1.2), ("extrafine", 0.12, 1.2)])
def test_heights_are_whole_layers(quality, film, height):
    d = tri(quality)
    made = estimate(d.printed, d.machine, d.layers, "cura-gaps")
    film_top = min(p.end_mm for p in made.body("film_and_lower").pieces if p.span("x")[1] == 12.0)
    assert film_top - 0.3 == pytest.approx(film, abs=1e-9)
    assert made.size_mm[2] == pytest.approx(height, abs=1e-9)


def test_where_bodies_swell_into_each_other_the_electrode_keeps_the_place():
    scene = Scene(
        (
            Body("rib", "x60", (box(4.0, 4.2, 0, 5, 0, 0.1),)),
            Body("wire", "etpu", (box(4.2, 4.4, 0, 5, 0, 0.1),), "top"),
        ),
        (10.0, 5.0, 0.1),
    )
    d = tri()
    made = estimate(scene, d.machine, d.layers, "arachne")
    (wire,), (rib,) = made.body("wire").pieces, made.body("rib").pieces
    assert wire.span("x") == pytest.approx((4.13, 4.47))
    assert rib.span("x") == pytest.approx((3.93, 4.13))


def test_a_slanted_part_is_narrower_by_a_rounding_all_round():
    corner = Prism("z", ((1, 1), (4, 1), (1, 4)), 0, 0.1)
    made = estimate(Scene((Body("corner", "x60", (corner,)),), (5.0, 5.0, 0.1)), tri().machine, tri().layers)
    less = 0.1 * (1 - pi / 4) / 2
    side = 3 - less * (2 + 2**0.5)
    assert made.body("corner").volume_mm3() == pytest.approx(0.1 * side**2 / 2, rel=1e-9)


@pytest.mark.parametrize("turn", [0.0, 0.3])
@pytest.mark.parametrize(("walls", "width", "printed"), [
    ("arachne", 0.11, 0.0), ("arachne", 0.2, 0.34), ("arachne", 0.7, 0.7 - 0.1 * (1 - pi / 4)), ("classic", 0.43, 0.0),
    ("cura", 0.43, 0.0), ("cura", 0.5, 0.44), ("cura", 0.7, 0.61), ("cura", 0.9, 0.9), ("cura-gaps", 0.03, 0.0),
    ("cura-gaps", 0.05, 0.05), ("cura-5", 0.105, 0.0), ("cura-5", 0.11, 0.34), ("cura-5", 0.7, 0.7),
])  # fmt: skip
def test_a_strip_in_any_direction_is_as_wide_as_its_walls_print_it(walls, width, printed, turn):
    c, s = cos(turn), sin(turn)
    corners = [(2, width / 2), (-2, width / 2), (-2, -width / 2), (2, -width / 2)]
    strip = Prism("z", tuple((3 + c * u - s * v, 3 + s * u + c * v) for u, v in corners), 0, 0.1)
    made = layers(Scene((Body("strip", "x60", (strip,)),), (6.0, 6.0, 0.1)), tri().machine, tri().layers, walls)
    length = 4 + printed - width
    assert made[0].region("strip").area == pytest.approx(printed * length if printed else 0.0, rel=1e-9)


@pytest.mark.parametrize(
    ("sides", "area_mm2"), [(((0, 2, 0, 5), (2, 5, 0, 2)), 16), (RING, 8)], ids=["both ways", "hole"]
)
def test_boxes_of_a_layer_stay_boxes_and_keep_their_hole(sides, area_mm2):
    scene = Scene((Body("plate", "x60", tuple(box(*s, 0, 0.1) for s in sides)),), (5.0, 5.0, 0.1))
    made = estimate(scene, tri().machine, tri().layers, "cura-gaps")
    assert all(p.is_box() for p in made.body("plate").pieces)
    assert made.body("plate").volume_mm3() == pytest.approx(0.1 * area_mm2, rel=1e-12)


def test_an_unknown_way_of_walls():
    with pytest.raises(UnknownName, match="arachne"):
        estimate(tri().printed, tri().machine, tri().layers, "arachn")


@pytest.mark.parametrize("end_mm", [0.001, 0.3, 1.2, 1.98, 2.399])
def test_a_window_is_one_period_wherever_the_sensor_ends(end_mm):
    """Also where its end is an edge of a layer, but for rounding."""
    size = {"length_mm": 33 * 2.4 + end_mm, "period_mm": 2.4, "lower_height_mm": 0.2, "dielectric_mm": 0.2}
    d = design.make({"shape": "tri", "parameters": size})
    plan = window.window(d.printed, d.layers.boundaries_mm(d.printed.size_mm[2]))
    assert plan.sides_mm()[0] == pytest.approx(2.4)


def test_a_window_is_the_whole_where_nothing_repeats():
    d = design.make({"shape": "tri", "parameters": {"length_mm": 2.0}})
    plan = window.window(d.printed, d.layers.boundaries_mm(d.printed.size_mm[2]))
    assert (plan.x_mm, plan.y_mm) == ((0.0, 2.0), (0.0, 10.0))


def strips(bottom, top, *runs):
    """A layer of strips along y, 1 mm long, of one body."""
    return LayerRegions(bottom, top, {"a": shapely.multipolygons([shapely.box(a, 0.0, b, 1.0) for a, b in runs])}, "y")


def edges(layer):
    return layer.region("a").bounds[0::2]


@pytest.mark.parametrize(
    ("below", "above", "cut"),
    [((1.0, 2.0005), (1.001, 2.4), [(0.0, 1.0005), (0.0, 1.4)]), ((1.2, 2.0), (1.2, 2.001), [(0.2, 1.0005)] * 2)],
    ids=["at the window's side", "in their middle"],
)
def test_edges_that_rounding_parted_become_one(below, above, cut):
    found = window.cut([strips(0.0, 0.1, below), strips(0.1, 0.2, above)], window.Window((1.0, 3.0), (0.0, 1.0)))
    assert [edges(layer) for layer in found] == [pytest.approx(of, abs=1e-12) for of in cut]


def test_steps_that_overlap_by_less_than_any_printer_places_touch():
    """Else a weld of 3 um carries the load, and no mesh of it is fine enough."""
    plan = window.Window((0.0, 2.0), (0.0, 1.0))
    for overlap, touch in ((0.003, True), (0.006, False)):
        given = [strips(0.0, 0.1, (0.3, 0.8), (1.2, 1.7)), strips(0.1, 0.2, (0.8 - overlap, 1.2 + overlap))]
        lower, upper = window.joined(given, plan)
        places = shapely.bounds(shapely.get_parts(lower.region("a")))[:, [0, 2]].ravel()
        assert set(edges(upper)) <= set(places) if touch else set(edges(upper)).isdisjoint(places)


def test_a_cell_that_rounding_made_lopsided_is_its_own_mirror_image():
    given = [strips(0.0, 0.1, (0.25, 0.450363), (1.549638, 1.75)), strips(0.1, 0.2, (0.3, 1.7))]
    plan = window.Window((0.0, 2.0), (0.0, 1.0))
    found = window.evened(given, plan, 2e-3)
    places = [shapely.bounds(part)[[0, 2]] for part in shapely.get_parts(found[0].region("a"))]
    assert sorted(places[0]) == pytest.approx(sorted(2 - places[1]), abs=1e-12)
    aside = [strips(0.0, 0.1, (0.25, 0.5), (1.54, 1.75))]
    assert window.evened(aside, plan, 2e-3) == aside
    assert window.evened(aside, plan) != aside


def test_an_evened_cell_reaches_to_its_sides():
    """A 23rd of 100 mm has more decimals than edges are rounded to: no electrode may begin beside the end."""
    side = round(100 / 23, 9)
    given = [strips(0.0, 0.1, (0.0, side)), strips(0.1, 0.2, (0.0, 0.7), (side - 0.7, side))]
    even = window.evened(given, window.Window((0.0, side), (0.0, 1.0)), 2e-3)
    assert [edges(layer) for layer in even] == [(0.0, side)] * 2


def test_a_layer_that_is_lost_parts_what_is_above_from_what_is_below():
    like = Scene((Body("a", "x60", (box(0, 1, 0, 1, 0, 0.3),)),), (2.0, 1.0, 0.3))
    found = scene_of(
        [strips(0.0, 0.1, (0.5, 1.0)), LayerRegions(0.1, 0.2, {}, "y"), strips(0.2, 0.3, (0.5, 1.0))], like
    )
    assert sorted(p.span("z") for p in found.body("a").pieces) == [(0.0, 0.1), (0.2, 0.3)]


TIE = {"electrode_mm": 0.25, "dielectric_mm": 0.2, "length_mm": 12.0, "width_mm": 10.0}


@pytest.mark.parametrize("walls", ["arachne", "cura-gaps"])
def test_of_a_face_at_mid_height_the_body_below_is_printed(printed, walls):
    """Found so in PrusaSlicer 2.5 and 2.9, CuraEngine 4.13 and 5, in eight designs each way up."""
    variant, made = printed(walls, design.make({"shape": "reference", "parameters": TIE}))
    guess = layers(variant.printed, variant.machine, variant.layers, walls)
    assert [set(layer.regions) for layer in guess] == [set(layer.regions) for layer in made.first]
    assert "bottom_electrode" in guess[2].regions


@pytest.mark.parametrize("walls", ["arachne", pytest.param("cura-gaps", marks=pytest.mark.nightly)])
def test_the_range_of_a_sparse_film_holds_the_real_one(printed, walls):
    sizes = {"dielectric_mm": 0.2, "length_mm": 12.0, "width_mm": 10.0}
    sparse = design.make({"shape": "tri", "parameters": sizes, "infill": {"x60": {"percent": 50}}})
    variant, made = printed(walls, sparse)
    wanted = fem2d.capacitance(made.cell.scene, EPS, 1e-2).middle()
    guesses = estimated(variant, walls).cells.scenes.values()
    found = [fem2d.capacitance(scene, EPS, 1e-2).middle() for scene in guesses]
    assert min(found) < wanted < max(found)
    assert found[0] == pytest.approx(wanted, rel=0.05)


@pytest.mark.parametrize("film_mm", [0.13, 0.15, 0.2])
def test_the_cell_of_a_print_is_one_period(film_mm):
    """With a film of 0.15 mm the plane of the apexes is at mid-height of a layer, whose strips all but touch."""
    variant = design.make({"shape": "tri", "parameters": {"length_mm": 80, "period_mm": 3, "dielectric_mm": film_mm}})
    cells = estimated(variant).cells
    assert {scene.size_mm[0] for scene in cells.scenes.values()} == {3.0}
    assert cells.count == pytest.approx(80 / 3)


def test_a_sparse_part_has_its_walls_and_its_share():
    body = Body("plate", "x60", (box(0, 20, 0, 20, 0, 0.1), box(0, 20, 0, 20, 0.1, 0.2)))
    scene, laid = Scene((body,), (20.0, 20.0, 0.2)), {"x60": LineLayout(0.5, 1.0, 0.4)}
    made = layers(scene, tri().machine, tri().layers, "cura-gaps", laid, (0.0, 0.5))
    for layer in made:
        assert layer.region("plate").area == pytest.approx(20 * (2 + 0.4 * 18), rel=0.02)
        assert layer.region("plate").covers(shapely.box(0, 0, 1, 20))
    both = shapely.intersection(*(layer.region("plate") for layer in made))
    assert both.area == pytest.approx(20 * 2, rel=0.02)


def test_lines_of_the_design_decide_what_vanishes():
    strip = Body("strip", "x60", (box(1, 1.5, 0, 6, 0, 0.1),))
    scene = Scene((strip,), (6.0, 6.0, 0.1))
    wide = design.make({"shape": "reference", "profile": {"line_mm": {"x60": 0.6}}})
    assert layers(scene, wide.machine, wide.layers, "classic")[0].regions
    assert not layers(scene, wide.machine, wide.layers, "classic", lines(wide))[0].regions


@pytest.mark.parametrize(("line", "printed"), [(0.39, True), (0.4, True), (0.41, False)])
def test_cura_5_prints_a_quarter_of_a_line(line, printed):
    """CuraEngine 5.0 prints tips of 0.1 mm with lines of 0.4 mm, and not with its usual ones of 0.44 mm."""
    tip = Scene((Body("tip", "x60", (box(1, 1.1, 0, 6, 0, 0.1),)),), (6.0, 6.0, 0.1))
    assert bool(layers(tip, tri().machine, tri().layers, "cura-5", {"x60": LineLayout(line)})[0].regions) is printed
