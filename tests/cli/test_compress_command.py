"""``sensorgen compress``: words in, curves out."""

import io
import json
import sys
from functools import partial

import click
import pytest

needs_mesher = pytest.mark.skipif("not __import__('importlib').util.find_spec('netgen')", reason="needs NGSolve")
PLATE = ("compress", "reference", "--stress", "100", "--json")


@pytest.fixture(autouse=True)
def _own_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path / "cache"))


@needs_mesher
def test_a_curve_as_json(run):
    said = run("compress", "tri", "--dielectric", "0.1", "--stress", "0:20:10kPa", "--json")
    assert (said.code, said.err) == (0, "")
    found = json.loads(said.out)
    assert found["stress_kpa"] == [0.0, 10.0, 20.0]
    assert found["displacement_um"] == pytest.approx([0.0, 6.1323, 10.5282], rel=0.01)  # tests/reference/contact.json
    assert found["lower_f_per_m2"][0] * 2e9 < 159.65204 < found["upper_f_per_m2"][0] * 2e9
    assert (found["converged_kpa"], found["model"], found["faults"]) == (20.0, "press2d", [])


@needs_mesher
def test_values_of_materials_are_taken(run):
    """Between fixed sides a plate gives way by thickness over E (1 - nu)/((1 + nu)(1 - 2 nu))."""
    film = 0.6e-3 * 1e5 * 1.4 * 0.2 / (0.6 * 3e6) * 1e6
    stiff = "youngs_modulus_etpu=1e12"
    said = run(*PLATE, "--set", "youngs_modulus_x60=3e6", "--set", "nu_x60=0.4", "--set", stiff)
    assert json.loads(said.out)["displacement_um"][1] == pytest.approx(film, rel=0.01)
    said = run(*PLATE, "--set", "eps_x60=2.34")
    assert json.loads(said.out)["lower_f_per_m2"][0] == pytest.approx(0.27625066e-12 / 4e-6 / 2, rel=1e-6, abs=0)
    said = run(*PLATE, "--set", "eps_x60=4.68")  # another question than the one before
    assert json.loads(said.out)["lower_f_per_m2"][0] == pytest.approx(0.27625066e-12 / 4e-6, rel=1e-6, abs=0)


@needs_mesher
def test_sides_that_give_way(run):
    free = json.loads(run(*PLATE, "--sides", "free", "--base", "sliding").out)
    fixed = json.loads(run(*PLATE).out)
    assert free["held"] == {"base": "sliding", "period": "free", "top": "even", "contact": "frictionless"}
    assert free["displacement_um"][1] > 400 * fixed["displacement_um"][1]


@needs_mesher
def test_the_table_and_the_picture(run, tmp_path):
    said = run("compress", "reference", "--stress", "0.1MPa", "--plot", "a.png")
    assert said.code == 0
    assert "converged up to 100 kPa" in said.out
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert [file.name for file in tmp_path.glob("*a.png*")] == ["a.png"]


@needs_mesher
def test_a_picture_that_has_no_place(run, tmp_path):
    (tmp_path / "a.png").mkdir()
    said = run("compress", "reference", "--stress", "100", "--plot", "a.png")
    assert said.code == 2
    assert "it is a folder" in said.line


@needs_mesher
def test_a_known_answer_is_taken(run, monkeypatch):
    from sensorgen.models import press2d

    first = run(*PLATE)

    def anew(*_given, **_more):
        raise ArithmeticError

    monkeypatch.setattr(press2d, "press", anew)
    assert run(*PLATE).out == first.out
    with pytest.raises(ArithmeticError):
        run(*PLATE, "--no-cache")


def test_boxes_are_pressed_in_three_dimensions(run, monkeypatch):
    """On one brick per box: within 8 % of the solution, and below the bound of springs."""
    from sensorgen.models import press3d

    monkeypatch.setattr(press3d, "Pieces", partial(press3d.Pieces, 1))
    found = json.loads(run("compress", "rect", "--dielectric", "0.1", "--stress", "100", "--json").out)
    assert (found["model"], found["converged_kpa"], found["faults"]) == ("press3d", 100.0, [])
    assert found["displacement_um"][1] == pytest.approx(6.56, rel=0.08)
    assert found["lower_f_per_m2"][0] * 4e-6 < 0.812343e-12 < found["upper_f_per_m2"][0] * 4e-6
    springs = json.loads(run("compress", "rect", "--stress", "100", "--model", "springs", "--json").out)
    assert springs["lower_f_per_m2"] == [None, None]
    assert "at most this" in springs["doubts"][0]
    assert springs["displacement_um"][1] > found["displacement_um"][1]


def test_a_shape_that_a_model_cannot_speak_of_is_refused(run):
    assert "needs a scene of boxes" in run("compress", "tri", "--model", "press3d").line
    assert "must be solved in 3D" in run("compress", "rect", "--model", "press2d").line


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--stress", "-1"], "expected 0 or more"),
        (["--stress", "0"], "expected a stress above 0"),
        (["--stress", "much"], "is not a stress"),
        (["--stress", "10:0:5"], "--stress"),
        (["--stress", "5mm"], "is not a stress"),
        (["--base", "glued"], "bonded"),
        (["--contact", "slippy"], "frictionless"),
        (["--model", "press4d"], "press2d"),
        (["--set", "nu_x60=0.6"], "0.5"),
        (["--set", "youngs_modulus_x60=0"], "youngs_modulus"),
        (["--set", "youngs_modulus_x6=1e6"], "x6"),
        (["--material", "dielectric=bvoh"], "bvoh"),
        (["--model", "springs", "--stress", "9000MPa"], "flat"),
        (["--set", "youngs_modulus_x60=5e4"], "100 kPa on x60 of 50 kPa"),
        (["--sides", "free"], "expected base 'sliding'"),
        (["--plot", "a.pdf"], ".png"),
        (["--walls", "cura"], "expected --as-printed"),
        (["--as-printed", "--slicer", "cura", "--walls", "cura"], "expected one"),
    ],
)
def test_wrong_words_end_with_2_and_one_line(run, words, said):
    found = run("compress", "tri", *words)
    assert found.code == 2
    assert said in found.line


def test_three_electrodes_have_no_one_capacitance(run):
    assert "expected two, bottom and top" in run("compress", "double").line
    springs = json.loads(run("compress", "double", "--model", "springs", "--stress", "10", "--json").out)
    assert springs["displacement_um"][1] > 0


@needs_mesher
def test_a_print_is_pressed_in_place_of_the_drawing(run):
    """Plain Cura loses the foot: the cell comes down by the layer that is lost, and says so."""
    said = run("compress", "tri", "--size", "12x8", "--stress", "10", "--as-printed", "--walls", "cura", "--json")
    found = json.loads(said.out)
    assert (said.code, found["model"], found["converged_kpa"]) == (0, "press2d", 10.0)
    assert 100 < found["displacement_um"][1] < 102
    assert "falls 100 um" in found["doubts"][0]
    assert found["printed"] == "estimate from mid-planes, cura walls, lines by mid-plane"


def test_without_the_mesher_it_says_how_to_install_it(run, monkeypatch):
    for name in [n for n in sys.modules if n.partition(".")[0] == "netgen"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "netgen", None)
    found = run("compress", "tri", "--stress", "10")
    assert found.code == 2
    assert "pip install 'sensorgen[fem]'" in found.line


@needs_mesher
def test_what_is_not_to_be_trusted_is_said_with_exit_code_1(run, monkeypatch):
    from sensorgen.models import press2d

    solved = press2d.press

    def stalled(*args, **more):
        from dataclasses import replace

        return replace(solved(*args, **more), faults=("converged up to 5 of 100 kPa",))

    monkeypatch.setattr(press2d, "press", stalled)
    found = run("compress", "reference", "--stress", "5")
    assert found.code == 1
    assert "not to be trusted: converged up to 5 of 100 kPa" in found.line


def test_the_bar_goes_on_where_a_cell_is_pressed_again_on_another_mesh(monkeypatch):
    from sensorgen.cli import compress_command

    shown = []
    bar = click.progressbar(length=4, file=io.StringIO())
    monkeypatch.setattr(click, "progressbar", lambda **_: bar)
    with compress_command._bar((0.0, 10.0, 20.0, 30.0)) as step:
        for reached_pa in (0.0, 1e4, 0.0, 1e4, 2e4, 3e4):
            step(reached_pa)
            shown.append(bar.pos)
    assert shown == [1, 2, 2, 2, 3, 4]


PLATE_1 = ("compress", "reference", "--stress", "100", "--accuracy")


@needs_mesher
def test_a_plan_and_what_came_of_it(run):
    said = run(*PLATE_1, "1e-2", "--explain")
    assert said.code == 0
    plan, _, rest = said.out.partition("measured")
    assert "plan for an accuracy of 0.01 of C up to 100 kPa" in plan
    assert "  > press2d, mesh x 1.5       within 0.01 in about" in plan
    assert "springs know no capacitance" in plan
    came = next(line for line in rest.splitlines() if line.startswith("  > press2d, mesh x 1.5"))
    assert float(came.split()[5]) <= 1e-2
    assert "all levels together" not in rest
    assert "wanted" in rest
    found = json.loads(run(*PLATE_1, "1e-2", "--json").out)
    assert (found["reached"], found["accuracy"]) == (True, 1e-2)
    chosen = found["plan"]["levels"][0]
    assert (chosen["name"], chosen["chosen"]) == ("compression", "press2d, mesh x 1.5")
    width = [2 * (b - a) / (b + a) for a, b in zip(found["lower_f_per_m2"], found["upper_f_per_m2"], strict=True)]
    assert max(width) == pytest.approx(found["relative_width"])
    assert max(width) <= 1e-2
    assert "an estimate" in found["bounds"]


@needs_mesher
def test_an_accuracy_below_what_is_possible_says_the_best(run):
    said = run(*PLATE_1, "1e-12")
    assert said.code == 1
    assert "an accuracy of 1e-12 was not reached; the best is" in said.err


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--explain"], "--explain without --accuracy"),
        (["--accuracy", "1e-2", "--explain", "--json"], "--json is not; it holds the plan too"),
        (["--accuracy", "1e-2", "--check-mesh"], "at once"),
        (["--accuracy", "0"], "above 0"),
        (["--accuracy", "1e-2", "--model", "springs"], "springs know no capacitance; leave out --accuracy"),
    ],
)
def test_an_accuracy_that_makes_no_sense(run, words, expected):
    said = run("compress", "tri", *words)
    assert said.code == 2
    assert expected in said.line


@needs_mesher
def test_loads_of_next_to_nothing(run):
    """Linear from a thousandth of a pascal on, where rounding is as large as the load."""
    found = json.loads(run("compress", "tri", "--stress", "1e-6,1e-4", "--json").out)
    assert found["converged_kpa"] == 1e-4
    assert found["displacement_um"][2] == pytest.approx(100 * found["displacement_um"][1], rel=0.02)
