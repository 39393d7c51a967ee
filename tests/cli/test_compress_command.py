"""``sensorgen compress``: words in, curves out."""

import csv
import io
import json
import re
import sys
from functools import partial

import numpy as np
import pytest

from sensorgen.core import parallel
from sensorgen.core.bounds import Interval
from sensorgen.models import press2d, press3d, sandwich
from sensorgen.solvers.electrostatics.bounds import CrossedBounds

needs_mesher = pytest.mark.skipif("not __import__('importlib').util.find_spec('netgen')", reason="needs NGSolve")
PLATE = ("compress", "reference", "--sides", "symmetric", "--stress", "100", "--json")


@needs_mesher
def test_a_curve_as_json(run):
    found = run("compress", "tri", "--drawn", "--dielectric", "0.1", "--stress", "0:20:10kPa", "--json").clean.json
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
def test_the_table_and_the_picture(run, tmp_path):
    said = run("compress", "reference", "--sides", "symmetric", "--stress", "0.1MPa", "--plot", "a.png").ok
    assert "converged up to 100 kPa" in said.out
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert [file.name for file in tmp_path.glob("*a.png*")] == ["a.png"]


@needs_mesher
def test_a_known_answer_is_taken(run, monkeypatch):
    first = run(*PLATE)

    def anew(*_given, **_more):
        raise ArithmeticError

    monkeypatch.setattr(press2d, "press", anew)
    assert run(*PLATE).out == first.out
    with pytest.raises(ArithmeticError):
        run(*PLATE, "--no-cache")


def test_boxes_are_pressed_in_three_dimensions(run, monkeypatch):
    """On one brick per box: within 8 % of the solution, and below the bound of springs."""
    monkeypatch.setattr(press3d, "BrickCounts", partial(press3d.BrickCounts, 1))
    found = run("compress", "rect", "--drawn", "--dielectric", "0.1", "--stress", "100", "--json").json
    assert (found["model"], found["converged_kpa"], found["faults"]) == ("press3d", 100.0, [])
    assert found["displacement_um"][1] == pytest.approx(6.56, rel=0.08)
    assert found["lower_f_per_m2"][0] * 4e-6 < 0.812343e-12 < found["upper_f_per_m2"][0] * 4e-6
    springs = run("compress", "rect", "--drawn", "--stress", "100", "--model", "springs", "--json").json
    assert springs["lower_f_per_m2"] == [None, None]
    assert "at most this" in springs["doubts"][0]
    assert springs["displacement_um"][1] > found["displacement_um"][1]


def test_a_shape_that_a_model_cannot_speak_of_is_refused(run):
    assert "needs a scene of boxes" in run("compress", "tri", "--drawn", "--model", "press3d").line
    assert "must be solved in 3D" in run("compress", "rect", "--drawn", "--model", "press2d").line


@pytest.mark.parametrize("model", [pytest.param("press2d", marks=pytest.mark.nightly), "springs"])
def test_values_that_no_source_gives_are_told_with_their_ranges(run, model):
    """BVOH has none: its modulus is that of any filament, up to that of rigid plastics."""
    if model == "press2d":
        pytest.importorskip("netgen")
    words = ("--drawn", "--stress", "10", "--model", model, "--material", "dielectric=bvoh", "--json")
    doubts = run("compress", "tri", *words).json["doubts"]
    said = [doubt for doubt in doubts if doubt.endswith("no source gives it")]
    assert [doubt.partition(" of bvoh")[0] for doubt in said] == [
        "youngs_modulus_pa", "poisson_ratio", "relative_permittivity",
    ]  # fmt: skip
    assert "(1.1e+06 to 4e+09)" in said[0]


def test_three_electrodes_have_no_one_capacitance(run):
    assert "expected two, bottom and top" in run("compress", "double").line
    springs = run("compress", "double", "--model", "springs", "--stress", "10", "--json").json
    assert springs["displacement_um"][1] > 0


@needs_mesher
def test_a_print_is_pressed_in_place_of_the_drawing(run):
    """Plain Cura loses the foot: the cell comes down by the layer that is lost, and says so."""
    said = run("compress", "tri", "--size", "12x8", "--stress", "10", "--walls", "cura", "--json")
    found = json.loads(said.out)
    assert (said.code, found["model"], found["converged_kpa"]) == (0, "press2d", 10.0)
    assert 100 < found["displacement_um"][1] < 102
    assert any("falls 100 um" in doubt for doubt in found["doubts"])
    assert found["body"] == "printed, estimated (plain Cura)"


@pytest.fixture
def no_mesher(monkeypatch, tmp_path):
    """Nothing that NGSolve brings can be imported, and nothing is known that was solved with it."""
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path / "cache"))
    for name in ("netgen", *(n for n in sys.modules if n.partition(".")[0] == "netgen")):
        monkeypatch.setitem(sys.modules, name, None)


INSTALL = "pip install 'sensorgen[fem]'"


def test_without_the_mesher_it_answers_with_what_it_has(run, no_mesher):
    """Springs for the displacement; at rest the bounds of ``cell``, which need none, hold the reference."""
    said = run("compress", "tri", "--drawn", "--dielectric", "0.1", "--stress", "10", "--json")
    found = json.loads(said.out)
    assert (said.code, said.err, found["model"], found["faults"]) == (0, "", "springs", [])
    assert found["displacement_um"] == pytest.approx([0.0, 18.49], rel=1e-3)  # docs/compression.md, closed forms
    (low, _), (high, none) = found["lower_f_per_m2"], found["upper_f_per_m2"]
    assert low * 2e9 < 159.65204 < high * 2e9
    assert none is None
    assert INSTALL in found["doubts"][-1]
    assert INSTALL in run("compress", "tri", "--stress", "10").out


def test_without_the_mesher_a_model_that_was_named_and_an_accuracy_are_not_met(run, no_mesher):
    for more in ((), ("--sweep", "dielectric_mm=0.1,0.2", "--jobs", "1")):
        said = run("compress", "tri", "--stress", "10", "--model", "press2d", *more)
        assert (said.code, said.out) == (2, "")
        assert INSTALL in said.line
    said = run("compress", "tri", "--stress", "10", "--accuracy", "1e-2", "--explain")
    assert (said.code, "> " in said.out) == (1, False)
    assert " ".join(said.out.split()).count(INSTALL) > 1
    assert "accuracy 0.01 not reached: error unknown" in said.line


def test_laws_of_a_plate(run):
    """B.49: thickness times stress over E; bonded, the law of tests/models/test_sandwich.py."""
    moved = {}
    for law in ("unconfined", "bonded"):
        said = run(*PLATE, "--model", law, "--set", "youngs_modulus_x60=3e6")
        moved[law] = json.loads(said.out)["displacement_um"]
    assert moved["unconfined"] == pytest.approx([0.0, 600 * 1e5 / 3e6])
    tied = sandwich.modulus_pa(3e6, 0.01, 6e-4, 5e9, electrode_pa=(22e6, 22e6), electrode_m=(3e-4, 3e-4))
    assert moved["bonded"] == pytest.approx([0.0, 600 * 1e5 / tied], rel=1e-3)
    for law in moved:
        assert "applies to a solid plate, tri is none" in run("compress", "tri", "--drawn", "--model", law).line
    soft = run(*PLATE, "--model", "unconfined", "--set", "youngs_modulus_x60=5e4")
    assert "100 kPa on x60 of 50 kPa" in soft.line


PLATE_1 = ("compress", "reference", "--sides", "symmetric", "--stress", "100", "--accuracy")


@needs_mesher
def test_a_plan_and_what_came_of_it(run):
    said = run(*PLATE_1, "1e-2", "--explain").ok
    plan, _, rest = said.out.partition("\n\n")
    assert "plan for an accuracy of 0.01 of the rise of C up to 100 kPa" in plan
    assert "displacement alone," in plan
    chosen = next(line for line in plan.splitlines() if line.startswith(">  press2d, mesh x 0.7"))
    expected, reached = re.findall(r"(\S+) in", chosen)
    assert max(float(expected), float(reached)) <= 1e-2
    assert "all levels together" not in plan
    assert "(target 0.01)" in rest
    found = run(*PLATE_1, "1e-2", "--json").json
    assert (found["reached"], found["accuracy"]) == (True, 1e-2)
    chosen = found["plan"]["levels"][0]
    assert (chosen["name"], chosen["chosen"]) == ("compression", "press2d, mesh x 0.7")
    error = [off / rise for off, rise in zip(found["rise_error_f_per_m2"], found["rise_f_per_m2"], strict=True) if rise]
    assert max(error) == pytest.approx(found["largest_rise_error"])
    assert max(error) <= 1e-2
    assert "an estimate" in found["bounds"]


@needs_mesher
def test_loads_of_next_to_nothing(run):
    """Linear from a thousandth of a pascal on, where rounding is as large as the load."""
    found = run("compress", "tri", "--stress", "1e-6,1e-4", "--json").json
    assert found["converged_kpa"] == 1e-4
    assert found["displacement_um"][2] == pytest.approx(100 * found["displacement_um"][1], rel=0.02)


MODULI = (
    "compress", "reference", "--sides", "symmetric", "--stress", "50,100",
    "--sweep", "youngs_modulus_x60=1e4,3e6,6e6", "--jobs", "1",
)  # fmt: skip


@pytest.fixture
def asked(monkeypatch, tmp_path):
    """Moduli of X60 that a stub of press2d was asked about: the film gives way by 600 um times stress over E."""
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path / "cache"))
    moduli = []

    def press(cell, solids, stress_pa, permittivity, held, mesh, step=None, **how):
        modulus = solids["x60"].youngs_modulus_pa
        moduli.extend([modulus] * (mesh == press2d.Fineness()))  # not the coarser one that it is compared with
        if modulus == 7e6:
            raise ZeroDivisionError("no pivot")
        if modulus == 8e6:
            raise CrossedBounds("lower bound above")
        p = np.asarray(stress_pa)
        bounds = tuple(Interval(c, 1.001 * c) for c in (1e-8 * (1 + p / modulus)).tolist())
        faults = ("faces run into each other",) if modulus == 9e6 else ()
        return press2d.Pressed(p, 6e-4 * p / modulus, bounds, (), p, p, p, 0.0, faults)

    monkeypatch.setattr(press2d, "press", press)
    return moduli


def test_a_sweep_solves_only_what_is_not_known(run, asked, monkeypatch):
    """The first point is too soft for its load: a reason in place of numbers, and exit code 1."""
    handed, in_parallel = [], parallel.in_parallel

    def counted(work, points, jobs, **more):
        handed.append(len(points))
        return in_parallel(work, points, jobs, **more)

    monkeypatch.setattr(parallel, "in_parallel", counted)
    said = run(*MODULI, "--json")
    soft, *rest = json.loads(said.out)
    assert (said.code, soft["model"], asked) == (1, None, [3e6, 6e6])
    assert "100 kPa on x60 of 10 kPa" in soft["reason"]
    assert said.line == f"sensorgen: {soft['design']}: no answer: {soft['reason']}"
    for row, modulus in zip(rest, (3e6, 6e6), strict=True):
        assert row["youngs_modulus_x60"] == modulus
        assert row["displacement_um"] == pytest.approx([600 * p / modulus for p in (0, 5e4, 1e5)])
    alone = run(*PLATE[:4], "--stress", "50,100", "--set", "youngs_modulus_x60=6e6", "--json").json
    assert rest[1] == alone | {key: rest[1][key] for key in ("youngs_modulus_x60", "design")}
    longer = run(*MODULI, "--json", "--sweep", "youngs_modulus_x60=3e6,5e6,6e6").json
    assert asked == [3e6, 6e6, 5e6]
    assert longer[::2] == rest
    run(*MODULI, "--no-cache", "--sweep", "youngs_modulus_x60=3e6,5e6")
    assert asked[3:] == [3e6, 5e6]
    assert handed == [2, 1, 2]


def test_what_is_not_to_be_trusted_is_said_with_exit_code_1(run, asked):
    found = run(*PLATE[:-1], "--set", "youngs_modulus_x60=9e6")
    assert (found.code, asked) == (1, [9e6])
    assert "not to be trusted: faces run into each other" in found.line


def test_a_sweep_as_csv_and_table(run, asked):
    rows = list(csv.DictReader(io.StringIO(run(*MODULI, "--csv").out)))
    assert [row["youngs_modulus_x60"] for row in rows] == ["10000.0", *["3000000.0"] * 3, *["6000000.0"] * 3]
    assert "100 kPa on x60" in rows[0]["reason"]
    assert (rows[0]["stress_kpa"], rows[0]["model"]) == ("", "")
    assert [float(row["stress_kpa"]) for row in rows[1:4]] == [0, 50, 100]
    assert float(rows[3]["displacement_um"]) == pytest.approx(20)
    rest = (float(rows[1]["lower_f_per_m2"]) + float(rows[1]["upper_f_per_m2"])) / 2
    assert float(rows[3]["rise_f_per_m2"]) / rest == pytest.approx(1 / 30, rel=1e-3)
    assert (rows[3]["model"], rows[3]["converged_kpa"], rows[3]["reason"]) == ("press2d", "100.0", "")
    table = run(*MODULI).out.splitlines()
    assert table[1].split() == ["10000", *"–" * 7]
    modulus, stress, displacement, off, rise, rise_unit, *_, lower, _, upper, unit = table[4].split()
    assert (modulus, stress, displacement, rise_unit, unit) == ("3e+06", "100", "20", "nF/m2", "nF/m2")
    assert float(off) == pytest.approx(float(rows[3]["displacement_error_um"]), rel=0.05)
    assert float(rise) == pytest.approx(1e9 * float(rows[3]["rise_f_per_m2"]), rel=1e-3)
    assert float(lower) == pytest.approx(1e9 * float(rows[3]["lower_f_per_m2"]), rel=1e-6)
    assert float(upper) == pytest.approx(1e9 * float(rows[3]["upper_f_per_m2"]), rel=1e-6)
    below = " ".join(" ".join(table[8:]).split())
    assert below.startswith("no answer: 100 kPa on x60")
    assert "(youngs_modulus_x60 10000) press2d: base bonded, period fixed, top even, contact frictionless" in below
    assert "(youngs_modulus_x60 3e+06, 6e+06) body: printed, estimated (" in below


def test_a_point_at_which_a_model_fails_leaves_the_others(run, asked):
    said = run(*MODULI, "--sweep", "youngs_modulus_x60=6e6,7e6,9e6", "--csv")
    rows = list(csv.DictReader(io.StringIO(said.out)))
    assert [row["reason"] for row in rows[:3]] == [""] * 3
    assert rows[3]["reason"].startswith("ZeroDivisionError: no pivot")
    assert [row["reason"] for row in rows[4:]] == ["faces run into each other"] * 3
    assert (said.code, "ZeroDivisionError: no pivot" in said.line, "(2 of 3 like this)" in said.line) == (1, True, True)
    again = run(*MODULI, "--sweep", "youngs_modulus_x60=6e6,9e6").out
    assert "fault: faces run into each other (youngs_modulus_x60 9e+06)" in again
    assert asked == [6e6, 7e6, 9e6]


def test_bounds_that_cross_stop_a_sweep_and_what_was_solved_is_known(run, asked):
    said = run(*MODULI, "--sweep", "youngs_modulus_x60=6e6,8e6,9e6")
    assert (said.code, said.out, "lower bound above" in said.line) == (2, "", True)
    run(*MODULI, "--sweep", "youngs_modulus_x60=6e6,9e6")
    assert asked == [6e6, 8e6, 9e6]


@pytest.mark.parametrize(
    "body",
    [(), pytest.param(("--infill", "80"), marks=pytest.mark.nightly)],  # two minutes
)
def test_predict_and_compress_give_a_plate_one_answer(run, body):
    curve = run("compress", "reference", *body, "--stress", "60", "--json").json
    rest = (curve["lower_f_per_m2"][0] + curve["upper_f_per_m2"][0]) / 2
    found = run("predict", "reference", *body, "--json").json
    assert curve["rise_f_per_m2"][1] / rest / 60 == pytest.approx(found["sensitivity"]["value"], rel=1e-3)
    assert curve["model"] == ("infill" if "--infill" in body else "bonded")
    known = 2.1e-4 if "--infill" in body else 1.42e-5  # of 11.77 E
    assert found["sensitivity"]["value"] == pytest.approx(known, rel=0.05)


@pytest.mark.parametrize("command", ["predict", "compress"])
def test_a_solid_with_cogs_is_no_softer_or_stiffer_than_plates(run, command):
    """Of 0.02 mm under the top electrode: as the plate as thick, 1.9e-6 1/kPa between stiff faces (4/3 E (1 + S^2))."""
    words = ("--size", "20x10", "--drawn", "--json", *(("--stress", "60") if command == "compress" else ()))
    shapes = (
        ("cog", "--cog-width", "0.1", "--height", "0.02", "--dielectric", "0.3"),
        ("reference", "--dielectric", "0.32"),
    )
    cog, plate = (run(command, *shape, *words).json for shape in shapes)
    if command == "predict":
        assert cog["sensitivity"]["value"] == pytest.approx(plate["sensitivity"]["value"], rel=0.05)
        assert cog["sensitivity"]["lower"] < 1.9e-6 < cog["sensitivity"]["upper"]
        assert any("a solid with cogs" in doubt for doubt in cog["doubts"])
    else:
        assert cog["rise_f_per_m2"][1] == pytest.approx(plate["rise_f_per_m2"][1], rel=0.1)
        assert (cog["model"], plate["model"]) == ("bonded", "bonded")
        assert sum("a solid with cogs" in doubt for answer in (cog, plate) for doubt in answer["doubts"]) == 1


def test_infill_beside_the_drawing_is_refused(run):
    for command in ("predict", "compress"):
        assert "a drawing is solid" in run(command, "reference", "--drawn", "--infill", "20").line
