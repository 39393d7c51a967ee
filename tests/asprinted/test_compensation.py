"""What is changed so that what was asked for comes out: by the estimate, and by a real slicer."""

import pytest

from sensorgen.asprinted.compensation import BAKE, compensated
from sensorgen.asprinted.printed import body, gap_mm, rule7
from sensorgen.design import design

from .conftest import small


def changed(found):
    return {c.what: (c.before, c.after) for c in found}


def estimated_gap(variant, walls):
    return body(variant, walls=walls).gap_mm[0]


@pytest.mark.parametrize(
    ("film", "walls", "quality", "expected"),
    [
        (0.2, "arachne", "fine", {"dielectric_mm": (0.2, 0.1)}),  # one layer of tips is lost
        (0.3, "classic", "fine", {"dielectric_mm": (0.3, 0.1)}),  # two
        (0.3, "cura", "fine", {"dielectric_mm": (0.3, 0.1)}),
        (0.1, "cura-gaps", "fine", {}),  # none
        (0.1, "arachne", "fine", {"period_mm": (2.0, 2.5)}),  # no film to spare: tips of 0.12 mm and a little more
    ],
)
def test_the_gap_that_was_asked_for_comes_out(film, walls, quality, expected):
    asked = small(parameters={"dielectric_mm": film}, quality=quality)
    made, changes = compensated(asked, walls)
    found = changed(changes)
    assert {k: v for k, v in found.items() if k in ("dielectric_mm", "period_mm")} == expected
    assert estimated_gap(made, walls) == pytest.approx(film, abs=1e-9)
    if expected:
        before, after = found["electrode gap as printed [mm]"]
        assert before > after == film


def test_heights_become_whole_layers():
    asked = small(parameters={"dielectric_mm": 0.2, "electrode_mm": 0.32, "isolation_mm": 0.01}, quality="extrafine")
    made, changes = compensated(asked, "cura-gaps")
    found = changed(changes)
    assert found["electrode_mm"] == (0.32, 0.3)
    assert found["isolation_mm"] == (0.01, 0.06)
    assert found["dielectric_mm"] == (0.2, 0.18)
    assert found["hang_height_mm"] == (0.5, 0.48)
    assert "lower_height_mm" not in found  # 0.24 is four layers
    assert "period_mm" not in found
    levels = {round(z, 6) for b in made.drawn.bodies for p in b.prisms for z in p.span("z")}
    assert all(abs(z / 0.06 - round(z / 0.06)) < 1e-6 for z in levels)


def test_strips_become_a_line_and_gaps_stay_open():
    asked = small("rect", {"etpu_width_mm": 0.3, "air_width_mm": 0.05})
    made, changes = compensated(asked, "cura")
    assert changed(changes) == {"etpu_width_mm": (0.3, 0.44), "air_width_mm": (0.05, 0.1)}
    assert (made.params.etpu_width_mm, made.params.air_width_mm, made.params.x60_width_mm) == (0.44, 0.1, 0.7)


def test_the_bake_is_printed_against_once():
    made, changes = compensated(design.make({"shape": "reference"}), bake=True)
    assert changed(changes) == {"shrinkage": (0.0, BAKE)}
    assert made.printed.size_mm[:2] == pytest.approx((125.0, 12.5))
    own, changes = compensated(design.make({"shape": "reference", "shrinkage": 0.1}), bake=True)
    assert (own.shrinkage, changes) == (0.1, [])


def test_what_needs_no_change_is_left_as_it_is():
    asked = design.make({"name": "mine", "shape": "reference"})
    assert compensated(asked) == (asked, [])


def test_a_named_design_gets_a_name_of_its_own():
    made, _ = compensated(small(name="mine", parameters={"dielectric_mm": 0.2}))
    assert made.name == "mine-compensated"
    assert compensated(made, "cura-gaps")[0].name == "mine-compensated"


def test_a_gap_that_cannot_be_kept_is_told():
    asked = small(parameters={"hang_height_mm": 3.0, "length_mm": 60.0, "width_mm": 4.0})
    _, changes = compensated(asked, "classic")
    assert "NOT KEPT" in changes[-1].why


@pytest.mark.parametrize("film", [0.1, 0.2])
def test_a_real_slicer_prints_the_asked_gap(printed, real, film):
    asked = small(parameters={"dielectric_mm": film})
    made, _ = compensated(asked)
    variant, found = printed("arachne", made)
    assert gap_mm(found.cell.scene) == pytest.approx(film, abs=1e-9)
    _, before = printed("arachne", asked)
    assert gap_mm(before.cell.scene) == pytest.approx(film + 0.1, abs=1e-9)
    assert rule7(variant, real("arachne", made)[1])[0]
