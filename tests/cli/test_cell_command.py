"""``sensorgen cell``: bounds, plan, cache and sweep, from the outside; and values of materials in words."""

import csv
import io
import json
import signal
import sys
import time
from pathlib import Path

import pytest

from sensorgen.design.settings import setting
from sensorgen.models import fem2d

# Known to 1e-9 and 3e-5; see tests/reference/README.md
KNOWN = json.loads((Path(__file__).parents[1] / "reference" / "cells.json").read_text("utf-8"))
TRI = {case["d"]: case["C_F_per_m"] / 2e-3 for case in KNOWN["tri"]}
RECT = {case["d"]: case["C_F"] / 4e-6 for case in KNOWN["rect"]}
LOADED = "import atexit; atexit.register(lambda: print('loaded:', *sys.modules))"


@pytest.mark.own_cache
@pytest.mark.parametrize("film", [0.1, 0.2])
@pytest.mark.parametrize("accuracy", ["1e-2", "1e-6"])
def test_bounds_hold_the_reference_and_are_as_near_as_asked(run, film, accuracy):
    found = run("cell", "tri", "--drawn", "--dielectric", film, "--accuracy", accuracy, "--json").ok.json
    lower, upper = found["lower_f_per_m2"], found["upper_f_per_m2"]
    assert lower * (1 - 1e-9) <= TRI[film] <= upper * (1 + 1e-9)
    assert (upper - lower) / TRI[film] <= float(accuracy) * (1 + 1e-9)
    assert (found["model"], found["reached"], found["known"]) == ("fem2d", True, False)
    assert 0 < found["seconds"] == pytest.approx(sum(c["seconds"] or 0 for c in found["plan"]))


def test_it_answers_for_the_print_unless_the_drawing_is_asked_for(run):
    """Each is another body, with a capacitance of its own."""
    bodies = {word: run("cell", "tri", *word, "--json").ok.json for word in ((), ("--walls", "cura"), ("--drawn",))}
    printed = [f"printed, estimated ({slicer})" for slicer in ("PrusaSlicer, Arachne walls", "plain Cura")]
    assert [found["body"] for found in bodies.values()] == [*printed, "drawn"]
    assert len({found["lower_f_per_m2"] for found in bodies.values()}) == 3
    assert "trix-d0.2, drawn: " in run("cell", "tri", "--drawn").out


def test_strips_in_three_dimensions(run):
    found = run("cell", "rect", "--drawn", "--dielectric", 0.2, "--accuracy", "5e-3", "--json").ok.json
    assert found["model"] == "fem3d"
    assert found["lower_f_per_m2"] <= RECT[0.2] * (1 + 3e-5)
    assert found["upper_f_per_m2"] >= RECT[0.2] * (1 - 3e-5)
    assert found["relative_width"] <= 5e-3


def test_set_values_reach_the_model(run):
    """Two of a kind: all permittivities times three give three times the capacitance."""
    one = run("cell", "tri", "--accuracy", "1e-5", "--json", "--set", "eps_x60=1.5", "--set", "eps_air=1").ok.json
    three = run("cell", "tri", "--accuracy", "1e-5", "--json", "--set", "eps_x60=4.5", "--set", "eps_air=3").ok.json
    assert three["lower_f_per_m2"] == pytest.approx(3 * one["lower_f_per_m2"], rel=1e-5, abs=0)
    values = {(v["material"], v["value"], v["source"]) for v in one["values"]}
    assert values == {("x60", 1.5, "set by the user"), ("air", 1, "set by the user")}


def test_a_known_answer_loads_no_numbers(run, real):
    first = run("cell", "tri", "--drawn", "--json").ok.json
    said = real("cell", "tri", "--drawn", "--json", before=LOADED)
    text, _, loaded = said.out.rpartition("loaded: ")
    assert not {"numpy", "ngsolve", "scipy", "build123d", "multiprocessing", "matplotlib"} & set(loaded.split())
    assert json.loads(text) == first | {"known": True}
    assert ", stored\n" in run("cell", "tri", "--drawn").out


@pytest.mark.own_cache
def test_no_cache_solves_anew_and_keeps_nothing(run):
    words = ("cell", "tri", "--drawn", "--json")
    known = [run(*words, *more).ok.json["known"] for more in (["--no-cache"], [], ["--no-cache"], [])]
    assert known == [False, False, False, True]


def test_explain_tells_the_plan_and_what_came_of_it(run):
    said = run("cell", "tri", "--drawn", "--explain", "--no-cache")
    plan, _, found = said.out.partition("\n\n")
    assert said.code == 0
    assert plan.startswith("plan for a relative width of 0.001\n")
    rows = {line.lstrip("> ").split()[0]: line for line in plan.splitlines()[2:]}
    assert rows["fem2d"].startswith(">  fem2d")
    assert " ms" in rows["fem2d"]
    assert "not needed" in rows["fem3d"]
    assert "fem2d" in found


def test_an_accuracy_below_what_is_possible(run):
    said = run("cell", "tri", "--drawn", "--accuracy", "1e-3", "--model", "columns")
    assert said.code == 1
    assert "accuracy 0.001 not reached: 0.5, by columns" in said.line
    assert "F/m2" in said.out


@pytest.fixture
def no_solver(monkeypatch):
    """Nothing that NGSolve brings can be imported."""
    for name in ("netgen", "ngsolve", *(n for n in sys.modules if n.partition(".")[0] in ("netgen", "ngsolve"))):
        monkeypatch.setitem(sys.modules, name, None)


def test_it_needs_no_optional_solver(run, no_solver):
    found = run("cell", "tri", "--drawn", "--dielectric", 0.1, "--accuracy", "1e-6", "--json").ok.json
    assert (found["model"], found["reached"]) == ("fem2d", True)
    assert found["lower_f_per_m2"] <= TRI[0.1] <= found["upper_f_per_m2"]


def test_predict_takes_an_accuracy(run):
    found = run("predict", "tri", "--drawn", "--dielectric", 0.1, "--accuracy", "1e-3", "--json").ok.json
    bounds, area_m2 = found["capacitance"]["model"], 100e-3 * 10e-3
    assert [level["chosen"] for level in found["plan"]["levels"] if level["name"] == "cell"] == ["fem2d"]
    assert bounds["lower"] <= TRI[0.1] * area_m2 <= bounds["upper"]
    assert bounds["upper"] / bounds["lower"] - 1 <= 1.001e-3
    assert found["capacitance"]["certified"]


def test_predict_says_when_an_accuracy_is_not_reached(run, monkeypatch):
    monkeypatch.setattr(fem2d, "why_not_applicable", lambda scene: "not today")
    said = run("predict", "tri", "--drawn", "--accuracy", "1e-4", "--json")
    assert said.code == 1
    assert "accuracy 0.0001 not reached: " in said.line
    assert "0.29; cell 0.5 (columns); compression" in said.line
    cell = next(level for level in json.loads(said.out)["plan"]["levels"] if level["name"] == "cell")
    assert {c["model"]: c["passed_over"] for c in cell["candidates"]}["fem2d"] == "not today"


SWEEP = ["cell", "tri", "--drawn", "--dielectric", "0.3", "--sweep", "dielectric_mm=0.1:0.2:0.1", "--jobs", "2"]


@pytest.mark.own_cache
def test_a_sweep_as_csv_and_json(run):
    rows = list(csv.DictReader(io.StringIO(run(*SWEEP, "--csv").out)))
    assert [float(row["dielectric_mm"]) for row in rows] == [0.1, 0.2]
    for row in rows:
        film = float(row["dielectric_mm"])
        assert float(row["lower_f_per_m2"]) <= TRI[film] <= float(row["upper_f_per_m2"])
        assert (row["model"], row["reached"], row["reason"]) == ("fem2d", "true", "")
    found = run(*SWEEP, "--json").ok.json
    assert [entry["known"] for entry in found] == [True, True]
    assert [repr(entry["lower_f_per_m2"]) for entry in found] == [row["lower_f_per_m2"] for row in rows]
    longer = run("cell", "tri", "--drawn", "--sweep", "dielectric_mm=0.1,0.15,0.2", "--json").ok.json
    assert [entry["known"] for entry in longer] == [True, False, True]
    lowers = [entry["lower_f_per_m2"] for entry in longer]
    assert lowers == sorted(lowers, reverse=True)
    assert lowers[::2] == [entry["lower_f_per_m2"] for entry in found]


def test_a_sweep_over_a_material_and_over_words(run):
    found = run("cell", "reference", "--sweep", "eps_x60=2,4", "--json", "--jobs", "1").ok.json
    assert [entry["eps_x60"] for entry in found] == [2, 4]
    assert found[1]["lower_f_per_m2"] == pytest.approx(2 * found[0]["lower_f_per_m2"], rel=1e-12, abs=0)
    words = ("--sweep", "along=xy,yx", "--model", "columns", "--accuracy", "2", "--jobs", "1")
    table = run("cell", "rect", *words).out.splitlines()
    assert [line.split()[0] for line in table[1:3]] == ["xy", "yx"]
    assert table[1].split()[1] == table[2].split()[1]  # turned by a right angle


def test_a_point_without_an_answer_leaves_the_others(run):
    said = run("cell", "tri", "--drawn", "--sweep", "dielectric_mm=0,0.2", "--csv", "--jobs", "1")
    bad, good = csv.DictReader(io.StringIO(said.out))
    assert (said.code, bad["model"], bad["lower_f_per_m2"]) == (1, "", "")
    assert "the electrodes touch" in bad["reason"]
    assert good["model"] == "fem2d"
    assert "trix-d0: no answer: " in said.line


@pytest.mark.nightly
def test_ctrl_c_leaves_nothing_half_written(start, contents, tmp_path):
    """Some points are solved by then, and known the next time; others are not, and nobody works on."""
    words = ["cell", "tri", "--sweep", "dielectric_mm=0.1:0.4:0.01", "--accuracy", "1e-5", "--jobs", "2", "-o", "s.csv"]
    cache = tmp_path / "kept"
    process = start(*words, "--csv", SENSORGEN_CACHE=str(cache))
    until = time.monotonic() + 100
    while not list(cache.rglob("*.json")) and time.monotonic() < until:
        time.sleep(0.05)
    children = children_of(process.pid)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert (process.returncode, out) == (130, "")
    assert err.strip() == "sensorgen: interrupted; no file is half-written"
    names = list(contents(tmp_path))
    assert names
    assert all(name.startswith("kept/") and name.endswith(".json") for name in names)
    assert len(names) < 31
    assert children
    assert not [pid for pid in children if alive(pid)]


def children_of(pid):
    return [int(p.name) for p in Path("/proc").glob("[0-9]*") if stat(p.name).get("PPid") == str(pid)]


def alive(pid):
    """Whether a process still runs, a moment of grace given."""
    for _ in range(100):
        if stat(pid).get("State", "Z").startswith("Z"):
            return False
        time.sleep(0.05)
    return True


def stat(pid):
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
    except OSError:
        return {}
    return {key: value.strip() for key, _, value in (line.partition(":") for line in lines)}


@pytest.mark.parametrize(
    ("word", "quantity", "value"),
    [
        ("eps_x60=3.0", "relative_permittivity", 3.0),
        ("youngs_modulus_x60=3e6", "youngs_modulus_pa", 3e6),
        ("nu_x60=0.45", "poisson_ratio", 0.45),
        ("piezoresistance_x60=-2e-6", "piezoresistance_per_pa", -2e-6),
        ("material_values.x60.poisson_ratio=0.3", "poisson_ratio", 0.3),
    ],
)
def test_values_of_materials_in_words(word, quantity, value):
    key, _, typed = word.partition("=")
    assert setting(key, typed, {"dielectric_mm"}) == {"material_values": {"x60": {quantity: value}}}
