"""Prints under pressure: their cell against one built by hand, feet that hang free, and the sensor that they make."""

from functools import partial

import numpy as np
import pytest

from sensorgen.asprinted.printed import body
from sensorgen.core.errors import SensorgenError
from sensorgen.design.tip import Tip
from sensorgen.design.walls import WALLS
from sensorgen.models import press2d, press3d
from sensorgen.models.press2d import BoundaryConditions, Elastic, Fineness
from sensorgen.prediction import compression as compressed
from sensorgen.prediction import compression_law as celllaw
from sensorgen.prediction.bodies import drawn, estimated
from sensorgen.prediction.compression import PressQuestion
from sensorgen.prediction.rest_state import rest_state
from sensorgen.prediction.sensor_model import build_sensor, piece
from sensorgen.scene.scene import Body, Prism, Scene, rectangle

from .conftest import small

needs_mesher = pytest.mark.skipif("not __import__('importlib').util.find_spec('netgen')", reason="needs NGSolve")
SOLIDS = {"x60": Elastic(6e6, 0.4999), "etpu": Elastic(22e6, 0.4999)}
EPS = {"x60": 4.68, "air": 1.00059}
EVENLY = Tip(block="even")
QUICK = Fineness(corner_mm=0.08, coarse_mm=0.2)
# Half widths by layer of 0.1 mm from the film up, of both kinds of feet, found by hand from sliced triX; of the film's
# own feet by the slicer's rules.
BY_HAND = {
    "arachne": ((0, 0.170, 0.239, 0.340, 0.440), (0.385, 0.177)),
    "classic": ((0, 0, 0.239, 0.339, 0.439), (0.385,)),
}


@pytest.fixture(scope="module")
def pressed_once(tmp_path_factory):
    """Presses on these coarse meshes are kept for the tests of this file alone."""
    return tmp_path_factory.mktemp("pressed")


@pytest.fixture(autouse=True)
def _quick(monkeypatch, pressed_once):
    monkeypatch.setenv("SENSORGEN_CACHE", str(pressed_once))
    monkeypatch.setattr(press2d, "Fineness", partial(Fineness, corner_mm=0.08, coarse_mm=0.2))
    monkeypatch.setattr(celllaw, "STRESS_PA", (0.0, 1e4, 2e4))


def built(widths, film=0.1):
    """A cell of bars of given half widths: the film's feet under x = 0.5, a cog at 1, hanging feet at 0."""
    floor, roof = 0.3 + film, 0.8 + film

    def bars(name, *places):
        return [
            (max(x - w, 0), min(x + w, 2), floor + 0.1 * k, floor + 0.1 * (k + 1))
            for x in places for k, w in enumerate(widths[name]) if w
        ]  # fmt: skip

    def body(name, material, terminal, *boxes):
        return Body(name, material, tuple(Prism("y", rectangle(*box), 0.0, 8.0) for box in boxes), terminal)

    bodies = (
        body("bottom_electrode", "etpu", "bottom", (0, 2, 0, 0.3)),
        body("film_and_lower", "x60", "", (0, 2, 0.3, floor), *bars("low", 0.5, 1.5)),
        body("hanging", "x60", "", *bars("feet", 0, 2)),
        body("top_electrode", "etpu", "top", (0, 2, roof, roof + 0.3), *bars("cog", 1)),
    )
    return press2d.cell(Scene(bodies, (2.0, 8.0, roof + 0.3)), 2.0)


def answered(body, *kpa, tip=None):
    return compressed.answer(body, PressQuestion((0.0, *kpa), BoundaryConditions(), tip=tip))


@needs_mesher
@pytest.mark.parametrize(
    ("walls", "fall_um"), [pytest.param("arachne", 0.0, marks=pytest.mark.nightly), ("classic", 100.0)]
)
def test_a_printed_cell_gives_way_like_one_built_by_hand(walls, fall_um):
    """Classic walls lose the foot's lowest layer too: it hangs free, and falls by what was lost."""
    design = small()
    found = answered(estimated(design, walls), 20.0, tip=EVENLY)  # no block stands on the one by hand
    both, low = BY_HAND[walls]
    hand = press2d.press(built({"cog": both, "feet": both, "low": low}), SOLIDS, [0.0, 2e4], EPS, fineness=QUICK)
    assert (found.model, found.faults, hand.faults) == ("press2d", (), ())
    moved = np.array(found.displacement_um[1:]) - fall_um
    assert moved == pytest.approx((hand.displacement_m[1:] - hand.fall_m) * 1e6, rel=0.01)
    assert hand.fall_m * 1e6 == pytest.approx(fall_um, rel=1e-6, abs=1e-6)
    assert (f"falls {fall_um:g} um" in "".join(found.doubts)) == (fall_um > 0)
    middle = (np.array(found.lower_f_per_m2) + np.array(found.upper_f_per_m2)) / 2
    assert middle == pytest.approx([c.middle() for c in hand.capacitance_f_per_m2], rel=0.01)
    assert found.body == f"printed, estimated ({WALLS[walls]})"


@needs_mesher
def test_the_printed_sensor_has_the_law_of_its_own_cell():
    """Rise is what compressing the print says, and capacitance lies between all widths of a line."""
    printed = estimated(small(), "arachne")
    sensed = build_sensor(printed, "solved", EVENLY)

    def compared(tip, *laws):
        """Rises that compressing the print says, and of each law."""
        found, stress_pa = answered(printed, 10.0, 20.0, tip=tip), np.array([1e4, 2e4])
        middle = (np.array(found.lower_f_per_m2) + np.array(found.upper_f_per_m2)) / 2
        return middle[1:] / middle[0] - 1, *(1 / (1 - law.capacitive_strain(stress_pa)[0]) - 1 for law in laws)

    said, own = compared(EVENLY, sensed.sensor.compression)
    assert 1 + own == pytest.approx(1 + said, rel=1e-4)
    said, low, high = compared(Tip(), *build_sensor(printed, "solved").law.others)  # the stored law knows no block
    assert (low < said).all()
    assert (said < high).all()
    assert sensed.law.bounded
    c = sensed.rest.capacitance
    assert sensed.sensor.capacitance_f() == pytest.approx(c.value, rel=1e-12, abs=0)
    assert c.model.lower < c.value < c.model.upper
    assert piece(printed).period_mm == 2.0


@needs_mesher
def test_feet_that_land_are_told_of():
    design = small(parameters={"dielectric_mm": 0.2})
    sensed = build_sensor(estimated(design, "classic"), "solved")
    assert any("mostly their fall" in doubt for doubt in sensed.doubts)
    assert sensed.sensor.compression.ratio[1] > 1.9  # the cog stands on the film where 0.1 mm of air was


def test_crossed_strips_are_pressed_in_three_dimensions(monkeypatch):
    """On one brick per box: printed strips of 0.68 mm in place of 0.70 give way a little more than drawn."""
    monkeypatch.setattr(press3d, "BrickCounts", partial(press3d.BrickCounts, 1))
    design = small("rect")
    found, sharp = answered(estimated(design, "arachne"), 100.0), answered(drawn(design), 100.0)
    assert (found.model, found.faults) == ("press3d", ())
    assert 1.0 < found.displacement_um[1] / sharp.displacement_um[1] < 1.15
    assert found.lower_f_per_m2[0] * 4e-6 < 0.79334e-12 < found.upper_f_per_m2[0] * 4e-6  # found by hand


def test_a_print_is_the_same_scene_in_every_process():
    """Else no answer about it would be found again: boxes of a layer from left to right, layers from below."""
    scene = body(small()).cell.scene
    for each in scene.bodies:
        places = [(prism.span("z")[0], prism.span("x")[0]) for prism in each.pieces]
        assert places == sorted(places)


@pytest.mark.parametrize("walls", ["arachne", "classic", "cura", "cura-gaps"])
def test_support_takes_no_place_from_what_stays(walls):
    """It swells too where it is narrow; PrusaSlicer prints the same feet with it as without."""
    bare, held = (piece(estimated(design, walls)) for design in (small(), small(materials={"support": "bvoh"})))
    assert held == bare


@needs_mesher
def test_the_staircase_whose_cog_ends_short_of_the_film():
    """Published: 47 um, C' from 88 to 112 pF/m; feet of X60 at mid-layer, the cog narrowest, base and sides free."""
    bars = {"cog": (0, 0, 0.2, 0.3, 0.4), "feet": (0.05, 0.15, 0.25, 0.35, 0.45), "low": (0.3958,)}
    free = BoundaryConditions(base="sliding", period="free")
    found = press2d.press(built(bars), SOLIDS, [0.0, 1e5], EPS, free, QUICK)
    assert found.faults == ()
    assert found.displacement_m[1] * 1e6 == pytest.approx(47, rel=0.03)
    assert [c.middle() * 2e9 for c in found.capacitance_f_per_m2] == pytest.approx([88, 112], rel=0.03)


def test_a_plate_has_no_period():
    """Free its modulus is that of the material; bonded 11.77 E by finite elements, the closed form to 4 %."""
    design = small("reference", {"length_mm": 20.0, "width_mm": 10.0})
    printed = estimated(design)
    assert piece(printed).period_mm is None
    sensed = build_sensor(printed)
    assert sensed.sensor.compression.modulus_pa == pytest.approx(11.7667 * 6e6, rel=0.04)  # bonded_plates.json
    assert build_sensor(printed, "unconfined").sensor.compression.modulus_pa == 6e6
    assert sensed.sensor.capacitance_f() == pytest.approx(69.06266e-12 * 20 * 10 / 1000, rel=1e-6, abs=0)


def test_infill_is_pressed_as_the_sensor_that_it_makes():
    """Cell and sensor at rest and under 60 kPa, by one law."""
    design = small("reference", {"length_mm": 12.0, "width_mm": 6.0}, infill={"x60": {"percent": 80}})
    printed = estimated(design)
    law = build_sensor(printed, rest=rest_state(printed, ranges=False)).sensor.compression
    found = answered(printed, 60.0)
    thinning, _ = law.capacitive_strain(np.array([6e4]))
    rest = (found.lower_f_per_m2[0] + found.upper_f_per_m2[0]) / 2
    assert (found.model, law.name) == ("infill", "infill")
    assert found.rise_f_per_m2[1] / rest == pytest.approx(thinning[0] / (1 - thinning[0]), rel=1e-6)


def test_a_print_that_no_model_can_speak_of_is_refused():
    design = small("double", {"length_mm": 12.0, "width_mm": 8.0})
    with pytest.raises(SensorgenError, match="two electrodes"):
        build_sensor(estimated(design))
