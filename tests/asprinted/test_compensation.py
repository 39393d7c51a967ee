"""What is changed so that what was asked for comes out: by the estimate, and by a real slicer."""

import pytest

from sensorgen.asprinted.printed import body, gap_mm, nominal
from sensorgen.checks.review import Review, review
from sensorgen.core.errors import OutOfRange
from sensorgen.core.findings import Finding
from sensorgen.design import design
from sensorgen.prediction.bodies import drawn, estimated, sliced
from sensorgen.prediction.rest_state import rest_state
from sensorgen.workflows import compensation
from sensorgen.workflows.compensation import BAKE, CAPACITANCE, GAP, STIFFNESS, compensated, of_body, printable

from .conftest import small

PRINTED = ("electrode gap as printed [mm]", "capacitance as printed [pF]")
SHORT = {"length_mm": 6.0, "width_mm": 4.0}  # three periods, which are found and solved in half the time of six


def changed(changes):
    return {c.what: (c.before, c.after) for c in changes}


def capacitance_f(body):
    """By the prediction of the whole sensor, at another accuracy than the search's [F]."""
    return rest_state(body, ranges=False).capacitance.value


def estimated_gap(variant, walls):
    return gap_mm(body(variant, walls=walls).cell.scene)


@pytest.mark.parametrize(
    ("film", "walls", "quality"),
    [
        (0.25, "arachne", "fine"),  # in layers of 0.083 mm what was asked for would print another gap, of 0.332 mm
        pytest.param(0.2, "arachne", "fine", marks=pytest.mark.nightly),
        pytest.param(0.3, "classic", "fine", marks=pytest.mark.nightly),
        pytest.param(0.2, "cura-gaps", "fine", marks=pytest.mark.nightly),  # nothing is lost, but what is thin swells
    ],
)
def test_gap_and_capacitance_that_were_asked_for_come_out(film, walls, quality):
    asked = small(parameters=SHORT | {"dielectric_mm": film}, quality=quality)
    made, changes = compensated(asked, walls)
    assert made.params.dielectric_mm >= 2 * made.layers.layer_mm - 1e-9
    assert estimated_gap(made, walls) == pytest.approx(made.layers.layer_mm * round(film / made.layers.layer_mm))
    assert estimated_gap(made, walls) == pytest.approx(film, rel=0.03)
    for factor in (1 / 1.04, 1.04):  # no line is at its limit
        near = compensation.moves.changed(made, {compensation.PERIOD: made.params.period_mm * factor})
        assert estimated_gap(near, walls) == pytest.approx(estimated_gap(made, walls))
    wanted, printed = (capacitance_f(each) for each in (drawn(asked), estimated(made, walls)))
    assert printed == pytest.approx(wanted, rel=0.03)
    uncompensated = capacitance_f(estimated(asked, walls))
    assert abs(uncompensated / wanted - 1) > 0.03 or estimated_gap(asked, walls) > film + 0.01
    gap, capacitance = (changed(changes)[what] for what in PRINTED)
    assert gap == pytest.approx([estimated_gap(one, walls) for one in (asked, made)])
    assert capacitance == pytest.approx([uncompensated * 1e12, printed * 1e12], rel=0.03)


def test_a_print_that_layers_alone_change_is_shown_too():
    made, changes = compensated(design.make({"shape": "reference", "parameters": {"dielectric_mm": 0.25}}))
    assert made.params.dielectric_mm == 0.249
    assert changed(changes)[PRINTED[0]] == pytest.approx((0.3, 0.249))


@pytest.mark.nightly
def test_what_prints_in_air_alone_is_refused_with_the_finding():
    asked = small(parameters=SHORT | {"dielectric_mm": 0.12}, quality="extrafine")
    with pytest.raises(
        OutOfRange, match=r"9-bridge, an island 0\.\d+ mm wide starts in mid-air.*; nearest: a gap of 0\.12"
    ):
        compensated(asked, "arachne")


def test_a_film_of_one_layer_is_refused_with_the_nearest(monkeypatch, shared_cache):
    """The printer's thinnest layers make 0.12 mm of two: the nearest of a few tries says so, and what it costs."""
    monkeypatch.setattr(compensation, "_MOST_SOLVED", 3)
    with pytest.raises(OutOfRange, match=r"2 layers at least, 0\.12 mm at layers of 0\.06 mm; nearest: ") as refused:
        compensated(small("rect", SHORT | {"dielectric_mm": 0.1}))
    for words in ("a gap of 0.12 mm and", "quality extrafine", "gap is off by +20%", "22 layers for 13"):
        assert words in str(refused.value)


def test_a_film_of_one_layer_that_prints_as_two_is_refused_all_the_same(monkeypatch):
    """A print with the nearest gap that can be had, and the capacitance asked for, is not what was asked for."""
    asked = small(parameters={"dielectric_mm": 0.1})
    two = of_body(drawn(asked)) | {GAP: 0.12}
    monkeypatch.setattr(compensation.CompensationSearch, "_at_rest", lambda *_: two)
    with pytest.raises(OutOfRange, match=r"2 layers at least.*nearest: a gap of 0\.12 mm and"):
        compensated(asked)


def test_heights_become_whole_layers():
    asked = small(parameters={"dielectric_mm": 0.2, "electrode_mm": 0.32, "isolation_mm": 0.01}, quality="extrafine")
    made, changes = printable(asked)
    found = changed(changes)
    assert found["electrode_mm"] == (0.32, 0.3)
    assert found["isolation_mm"] == (0.01, 0.06)
    assert found["dielectric_mm"] == (0.2, 0.18)
    assert found["hang_height_mm"] == (0.5, 0.48)
    assert "lower_height_mm" not in found  # 0.24 is four layers
    assert "period_mm" not in found
    levels = {round(z, 6) for b in made.drawn.bodies for p in b.pieces for z in p.span("z")}
    assert all(abs(z / 0.06 - round(z / 0.06)) < 1e-6 for z in levels)


@pytest.mark.parametrize(
    ("quality", "film", "layer", "named"),
    [
        ("extrafine", 0.2, 0.067, "extrafine-0.067"),  # 0.18 and 0.24 mm of its own layers are 10 and 20 % off
        ("fine", 0.18, 0.09, "fine-0.09"),
        ("fine", 0.12, 0.06, "extrafine"),
        ("fine", 0.4, 0.1, "fine"),
        ("fine", 0.1, 0.06, "extrafine"),  # of which two are too many: the nearest that can be printed
    ],
)
def test_layers_are_those_that_make_up_the_gap(quality, film, layer, named):
    made, changes = printable(small(parameters={"dielectric_mm": film}, quality=quality), gap_mm=film)
    assert (made.layers.layer_mm, made.layers.first_layer_mm, made.quality) == (layer, layer, named)
    assert ("layers [mm]" in changed(changes)) == (named != quality)
    if film > 0.1:
        assert made.params.dielectric_mm == pytest.approx(film, rel=0.03)
    levels = {round(z, 6) for b in made.drawn.bodies for p in b.pieces for z in p.span("z")}
    assert all(abs(z / layer - round(z / layer)) < 1e-6 for z in levels)


@pytest.mark.parametrize("walls", ["arachne", "cura-gaps"])
def test_strips_of_crossed_strips_are_changed(walls):
    """Their period follows from widths, and is no parameter; by Cura strips are whole lines, and the air changes."""
    asked = small("rect", {"length_mm": 11.2, "width_mm": 5.6, "dielectric_mm": 0.3, "x60_width_mm": 1.5})
    made, _ = compensated(asked, walls)
    wanted, printed = (capacitance_f(each) for each in (drawn(asked), estimated(made, walls)))
    assert printed == pytest.approx(wanted, rel=0.03)
    assert estimated_gap(made, walls) == 0.3
    lines = [made.params.etpu_width_mm / 0.44, made.params.x60_width_mm / 0.44]
    assert all(abs(n - round(n)) < 1e-6 for n in lines) == (walls == "cura-gaps")


def test_an_array_keeps_its_period():
    """Another one leaves rims without structures: 8 cells of 1.181 mm cover 9.45 of 10 mm."""
    names = [key[-1] for key in compensation._widths(design.make({"shape": "cone"}), "arachne")]
    assert names == ["root_mm", "tip_mm"]
    cones = design.make({"shape": "cone", "parameters": {"length_mm": 10.0, "width_mm": 10.0, "period_mm": 1.5}})
    larger = design.make({"shape": "cone", "parameters": {"length_mm": 9.0, "width_mm": 9.0, "period_mm": 1.5}})
    one, other = (compensation.quantities(each, drawn)[CAPACITANCE] for each in (cones, larger))
    assert one == pytest.approx(other, rel=1e-6)  # both have 36 cells


def test_strips_become_a_line_and_gaps_stay_open():
    asked = small("rect", {"etpu_width_mm": 0.3, "air_width_mm": 0.05})
    made, changes = printable(asked)
    assert changed(changes) == {"etpu_width_mm": (0.3, 0.44), "air_width_mm": (0.05, 0.1)}
    assert (made.params.etpu_width_mm, made.params.air_width_mm, made.params.x60_width_mm) == (0.44, 0.1, 0.7)


def test_the_bake_is_printed_against_once():
    made, changes = compensated(design.make({"shape": "reference"}), bake=True)
    assert changed(changes) == {"shrinkage": (0.0, BAKE)} | dict.fromkeys(PRINTED, pytest.approx((0.6, 0.6))) | {
        PRINTED[1]: pytest.approx([capacitance_f(drawn(made)) * 1e12] * 2, rel=0.01)
    }
    assert made.printed.size_mm[:2] == pytest.approx((125.0, 12.5))
    own, changes = compensated(design.make({"shape": "reference", "shrinkage": 0.1}), bake=True)
    assert (own.shrinkage, changes) == (0.1, [])


def taller(design, kinds):
    """Of all heights one layer more of the hanging prisms."""
    return [(("parameters", "hang_height_mm"), 0.536)]


def test_a_period_that_leaves_an_island_in_the_air_becomes_one_that_fits_the_length(monkeypatch, shared_cache):
    """The nearest, of 4.422 mm, leaves 0.16 mm of a hanging prism at the end of 100 mm."""
    monkeypatch.setattr(compensation.moves, "steps", taller)
    asked = design.make({"shape": "tri", "quality": "extrafine", "parameters": {"dielectric_mm": 0.2}})
    made, _ = compensated(asked)
    periods = made.params.length_mm / made.params.period_mm
    assert periods == pytest.approx(round(periods), abs=1e-9)
    assert not review(made).errors()
    wanted, printed = (capacitance_f(each) for each in (drawn(asked), estimated(made, "arachne")))
    assert printed == pytest.approx(wanted, rel=0.03)


def test_a_cut_period_is_a_length_in_the_plane_and_its_island_goes_too():
    """The end of 9.09 periods moves up and down with the period, which made it a height; drawn, it has the island."""
    cut = {"dielectric_mm": 0.2, "length_mm": 30.0, "width_mm": 6.0, "period_mm": 3.3}
    asked = design.make({"shape": "tri", "parameters": cut})
    assert ("period_mm", 3.3, False) in list(compensation.moves.lengths(asked))
    assert [f.rule for f in review(asked).errors()] == ["9-bridge"]
    made, _ = compensated(asked, "cura-gaps")
    assert made.params.period_mm != 3.3
    assert not review(made, walls="cura-gaps").errors()


def test_what_rules_refuse_in_whole_periods_too_is_refused_with_the_rule(monkeypatch, shared_cache):
    def with_an_island(design, walls=""):
        island = Finding("9-bridge", "error", "film", "an island starts in mid-air", "")
        return Review(design, [island] * (design.params.period_mm != 2.0))

    monkeypatch.setattr(compensation, "review", with_an_island)
    monkeypatch.setattr(compensation, "_MOST_SOLVED", 9)
    with pytest.raises(OutOfRange, match=r"walls without an error \(9-bridge, an island .* mid-air\); nearest: "):
        compensated(small(parameters=SHORT | {"dielectric_mm": 0.2}))


def test_what_needs_no_change_is_left_as_it_is():
    asked = design.make({"name": "mine", "shape": "reference"})
    assert compensated(asked) == (asked, [])


def test_a_named_design_gets_a_name_of_its_own():
    made, _ = printable(small(name="mine", parameters={"dielectric_mm": 0.25}))
    assert made.name == "mine-compensated"
    assert printable(made, bake=True)[0].name == "mine-compensated"


def test_what_cannot_be_had_is_refused_with_the_nearest(monkeypatch, shared_cache):
    """After fewer tries than usual."""
    monkeypatch.setattr(compensation, "_MOST_TRIED", 30)
    monkeypatch.setattr(compensation, "_MOST_SOLVED", 2)
    asked = small(parameters={"dielectric_mm": 0.3, "hang_height_mm": 3.0, "length_mm": 6.0, "width_mm": 4.0})
    with pytest.raises(OutOfRange, match=r"cannot be printed of .*; nearest: "):
        compensated(asked, "classic")


def test_a_real_slicer_prints_gap_and_capacitance(printed, real):
    asked = small(parameters=SHORT | {"dielectric_mm": 0.2})
    slices = []

    def by_slicer(design):
        slices.append(design.name)
        found = printed("arachne", design)[1]
        return sliced(design, lambda: found, "PrusaSlicer", design.id().encode())

    made, _ = compensated(asked, sliced=by_slicer)
    assert 2 <= len(slices) <= 9
    assert gap_mm(printed("arachne", made)[1].cell.scene) == pytest.approx(0.2, abs=1e-9)
    wanted = capacitance_f(drawn(asked))
    assert capacitance_f(by_slicer(made)) == pytest.approx(wanted, rel=0.03)
    assert gap_mm(printed("arachne", asked)[1].cell.scene) == pytest.approx(0.3, abs=1e-9)
    assert nominal(made, real("arachne", made)[1]).rows


def test_the_stiffness_is_that_of_the_solved_cell():
    """The stored cell came down by 36.44 um under 100 kPa, on another mesh."""
    asked = design.make({"shape": "tri", "parameters": {"dielectric_mm": 0.2}})
    assert of_body(drawn(asked), stiffness=True)[STIFFNESS] == pytest.approx(100 / 36.44e-3, rel=0.03)
    plate = of_body(drawn(design.make({"shape": "reference"})), stiffness=True)
    # 6 MPa over 0.6 mm, times 11.77 of finite elements where it is bonded (reference/bonded_plates.json), which the
    # closed form of such plates holds to 4 %
    assert plate[STIFFNESS] == pytest.approx(11.7667 * 6e3 / 0.6, rel=0.04)


def test_a_stiffness_of_a_cell_in_3d_is_refused():
    with pytest.raises(OutOfRange, match=r"stiffness is not known without solving it in 3D.*--compensate print"):
        compensated(small("rect"), stiffness=True)


def few(design, kinds):
    """Of all heights one layer more of the lower prisms."""
    return [(("parameters", "lower_height_mm"), 0.3)]


def stiff(of_print):
    """``of_body`` with a stiffness of 1000 kPa/mm per mm of the lower prisms' height; of a print, of another height."""

    def with_stiffness(body, *, stiffness=False):
        height = body.design.params.lower_height_mm
        stiff = {STIFFNESS: 1e3 * (height if body.is_drawn else of_print(height))} if stiffness else {}
        return of_body(body) | stiff

    return with_stiffness


def test_a_stiffness_that_was_asked_for_comes_out_with_gap_and_capacitance(monkeypatch, shared_cache):
    """0.24 mm as drawn are 0.2 mm in whole layers; it is 0.3 mm that print as stiff."""
    asked = small(parameters={"dielectric_mm": 0.2})
    monkeypatch.setattr(compensation.moves, "steps", few)
    monkeypatch.setattr(compensation, "of_body", stiff(lambda height: height - 0.06))
    made, changes = compensated(asked, stiffness=True)
    assert made.params.lower_height_mm == pytest.approx(0.3)
    assert changed(changes)["stiffness as printed [kPa/mm]"][1] == pytest.approx(240.0)
    wanted, printed = (capacitance_f(each) for each in (drawn(asked), estimated(made, "arachne")))
    assert printed == pytest.approx(wanted, rel=0.03)
    assert estimated_gap(made, "arachne") == pytest.approx(0.2, abs=1e-9)


def test_a_stiffness_that_cannot_be_had_is_refused_with_the_nearest(monkeypatch, shared_cache):
    monkeypatch.setattr(compensation.moves, "steps", few)
    monkeypatch.setattr(compensation, "of_body", stiff(lambda height: 10 * height))
    monkeypatch.setattr(compensation, "_MOST_SOLVED", 8)
    with pytest.raises(OutOfRange, match=r"and 240 kPa/mm cannot be printed.*nearest: a gap of 0\.2 mm, .* kPa/mm by"):
        compensated(small(parameters=SHORT | {"dielectric_mm": 0.2}), stiffness=True)
