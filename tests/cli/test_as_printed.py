"""The print beside the drawing: options, exit codes, errors; without a slicer."""

import json
from dataclasses import replace
from hashlib import sha256

import pytest
from filled import filled

from sensorgen.cli import designs
from sensorgen.core.bounds import Bounds
from sensorgen.design.design import make
from sensorgen.prediction.bodies import default_body, estimated, registered
from sensorgen.workflows import build, compensation
from sensorgen.workflows.trial import Numbers, Trial

SMALL = ["tri", "--size", "12x8"]
SIZE = {"length_mm": 12.0, "width_mm": 8.0}

pytestmark = pytest.mark.usefixtures("unpressed")  # gaps, capacitances at rest and plates need no mesh


def predicted(run, *words):
    return run("predict", *words, "--json").json


@pytest.mark.usefixtures("at_rest")
def test_predict_shows_the_print_beside_the_drawing(run):
    said = run("predict", *SMALL, "--dielectric", "0.1", "--walls", "classic").clean
    head, gap = said.out.splitlines()[1:3]
    assert head.split()[:2] == ["drawn", "printed"]
    assert " ".join(gap.split()) == "electrode gap 0.1 mm 0.3 mm (0.28 to 0.32)"


@pytest.mark.usefixtures("at_rest")
def test_the_drawing_alone(run):
    said = run("predict", *SMALL, "--drawn")
    assert "printed" not in said.out.splitlines()[1]
    found = predicted(run, *SMALL, "--drawn")
    assert (found["body"], found["drawn"]) == ("drawn", None)
    assert found["capacitance"] == predicted(run, *SMALL)["drawn"]["capacitance"]


def test_a_sliced_file_of_this_very_design_is_the_body(tmp_path):
    design, other = (make({"shape": "tri", "parameters": {"dielectric_mm": film}}) for film in (0.1, 0.2))
    file = tmp_path / "a.prusa.gcode"
    file.write_text("G28\n")
    none = dict.fromkeys(("lines", "moves", "layers", "time_s", "tool_changes"), 0) | {"tools": [], "findings": []}
    travel = {"tools": [], "layers": []}
    note = none | {
        "slicer": {"name": "PrusaSlicer", "version": "2.5"}, "design": design.id(), "box_mm": None, "name": "a",
        "refused": False, "sensorgen": "1", "printer": "p", "quality": "q", "printed": {"layers": [], "findings": []},
        "lifting": {"before": travel, "after": travel, "lifts": 0, "retractions": 0, "added_s": 0.0},
    }  # fmt: skip
    note["sha256"] = sha256(file.read_bytes()).hexdigest()
    (tmp_path / "a.prusa.gcode.json").write_text(json.dumps(note))
    assert default_body(design, tmp_path).provenance == "printed, PrusaSlicer 2.5, a.prusa.gcode"
    assert default_body(design, tmp_path).kind == "sliced"
    assert default_body(other, tmp_path).kind == "estimated"
    file.write_text("G28 X\n")  # no longer what was sliced
    assert default_body(design, tmp_path).kind == "estimated"


@pytest.mark.usefixtures("at_rest")
def test_a_plate_prints_as_drawn(run):
    found = predicted(run, "reference", "--size", "12x8")
    assert found["gap"]["value"] == pytest.approx(6e-4) == found["drawn"]["gap"]["value"]
    assert found["capacitance"]["value"] == pytest.approx(found["drawn"]["capacitance"]["value"], rel=1e-9)


def test_the_gap_is_that_of_any_two_electrodes(run):
    found = predicted(run, "double", "--size", "12x8")
    assert found["gap"]["value"] == pytest.approx(6e-4)
    assert found["status"] == "not predicted"
    assert found["reason"].count("more than two electrodes") == 1  # the same reason of all models once


@pytest.mark.usefixtures("at_rest")
def test_all_walls_are_in_the_range_of_the_print(run):
    found = predicted(run, *SMALL, "--dielectric", "0.1")["gap"]
    design = make({"shape": "tri", "parameters": {"length_mm": 12, "width_mm": 8, "dielectric_mm": 0.1}})
    prints = [estimated(design, walls) for walls in ("arachne", "classic", "cura", "cura-gaps")]
    each = [next(iter(body.cells.gap_mm.values())) * 1e-3 for body in prints]
    heights = 2e-5  # of two tools
    ends = each[0], min(each) - heights, max(each) + heights
    assert (found["value"], found["lower"], found["upper"]) == pytest.approx(ends)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--slicer", "prusa", "--walls", "cura"], "expected one"),
        (["--drawn", "--walls", "cura"], "expected one"),
        (["--walls", "arachn"], "arachne"),
        (["--slicer", "pruser"], "prusa"),
    ],
)
def test_words_that_do_not_go_together(run, words, told):
    assert told in run("predict", *SMALL, *words).refusal


def loaded(run, *words):
    said = run("predict", *words, "--force", "0:6:3", "--position", "6", "--frequencies", "1.1kHz", "--json").ok
    return json.loads(said.out)


def test_loads_are_of_the_printed_capacitance(run):
    """X at rest and low frequency is 1 / (2 pi f C), and C of the print is what it is told to be at rest."""
    words = (*SMALL, "--dielectric", "0.1", "--compression", "unconfined")
    at_rest = predicted(run, *words, "--walls", "classic")["capacitance"]["value"]
    x = loaded(run, *words, "--walls", "classic")["im_ohm"][0][0][0]
    assert x == pytest.approx(-1 / (2 * 3.14159265 * 1.1e3 * at_rest), rel=1e-6)


def test_the_drawing_has_printed_outlines_and_rule_7(run):
    plain = run("draw", *SMALL, "--drawn", "-o", "-").out
    printed = run("draw", *SMALL, "-o", "-").out
    assert 'class="printed"' not in plain
    assert printed.count('class="printed"') == 4  # bodies
    assert "7-printed" in printed


@pytest.mark.usefixtures("at_rest")
def test_a_build_is_compensated(run, contents, tmp_path):
    said = run("build", "tri", "--size", "6x4", "--dielectric", "0.2", "--no-cad", "--compensate", "print").ok
    assert "period_mm                      2 -> 3.298: gap and capacitance" in said.out
    assert "0.3 -> 0.2: 0.2 mm asked" in said.out
    assert any("period3.298" in name for name in contents(tmp_path / "out"))


def test_a_compensation_is_by_prints_of_the_slicer_that_decides(monkeypatch):
    asked, calls = make({"shape": "reference"}), []

    def by(design, walls, *, sliced, **_):
        calls.append((design, walls, sliced))
        return design, []

    monkeypatch.setattr(compensation, "compensated", by)
    monkeypatch.setenv("SENSORGEN_SLICER", "cura")
    designs.compensated(asked, "print")
    monkeypatch.setenv("SENSORGEN_SLICER", "none")
    designs.compensated(asked, "print")
    (_, walls, by_slicer), by_estimate = calls
    assert (walls, by_slicer.func) == ("cura-gaps", designs.sliced)
    assert by_estimate == (asked, "arachne", None)


@pytest.mark.usefixtures("at_rest")
def test_nothing_to_compensate(run):
    assert "nothing to change" in run("build", "reference", "--size", "12x8", "--no-cad", "--compensate", "print").err


@pytest.mark.usefixtures("at_rest")
def test_the_print_by_any_file(run, program, tmp_path):
    program("prusa-slicer", "prusa-slicer")
    words = [*SMALL, "--dielectric", "0.1"]
    assert run("slice", *words, "--out", str(tmp_path / "elsewhere")).code == 1  # tips are lost
    (file,) = (tmp_path / "elsewhere").rglob("*.gcode")
    found, sliced = (predicted(run, *words, *how) for how in (("--gcode", str(file)), ("--slicer", "prusa")))
    assert found["body"] == f"printed, {file.name}"
    assert found["capacitance"]["value"] == pytest.approx(sliced["capacitance"]["value"], rel=1e-5, abs=0)
    both = run("predict", *words, "--gcode", str(file), "--drawn")
    assert (both.code, both.line) == (2, "sensorgen: --drawn and --gcode at once; expected one of them")
    missing = run("predict", *words, "--gcode", "none.gcode")
    assert (missing.code, missing.line) == (2, "sensorgen: cannot read 'none.gcode': No such file or directory")


def test_a_compensated_build_says_how_it_senses_against_what_was_asked(run, monkeypatch, tmp_path):
    """Printed against the bake, a plate is in use the plate that was asked for; not predicted, nothing is known."""
    monkeypatch.setenv("SENSORGEN_CACHE", str(tmp_path / "cache"))
    plate = ("build", "reference", "--size", "12.5x8", "--no-cad")
    assert "aimed at these alone: the print may sense" in run(*plate, "--compensate", "bake").out
    run(*plate)
    found = run(*plate, "--compensate", "bake", "--json").json
    assert "what was asked for: it senses as that does" in found["compared"]
    change = found["compensated"][0]
    assert (change["what"], change["before"], change["after"]) == ("shrinkage", 0.0, 0.2)


def test_a_compensation_that_senses_worse_says_so(monkeypatch):
    """Half as fine a force resolution, and a position that is lost."""
    asked = make({"shape": "reference"})
    made = Trial("a", "b", "", "predicted", "", "PRINT", (), 6.0, 0.05, 0.1, Numbers(), Numbers())
    both = ((Bounds.of(0.1, "N"), Bounds.of(0.01, "m")), (Bounds.of(0.2, "N"), Bounds.of(0.2, "m")))
    numbers = (Numbers(force_resolution=n, position_resolution=m) for n, m in both)
    fine, coarse = (replace(made, printed=one) for one in numbers)
    monkeypatch.setattr(build, "trial", lambda *_, **__: fine)
    monkeypatch.setattr(build.decision, "is_known", lambda _: True)
    assert build._compared(asked, coarse).endswith(": force resolution 2 x worse, position resolution lost")


@pytest.mark.usefixtures("at_rest")
def test_a_file_of_another_design_is_not_taken_without_a_word(run, tmp_path):
    """Higher than the drawing it is refused; as high, its record says so; without a record it is taken."""
    plate, file = ("reference", "--size", "12x8"), tmp_path / "other.gcode"
    other = make({"shape": "reference", "name": "other", "parameters": SIZE | {"dielectric_mm": 0.4}})
    file.write_text(filled(other))
    how = ("--gcode", str(file), "--json")
    assert run("predict", *plate, "--dielectric", "0.4", *how).json["doubts"] == []
    record = {"name": "other", "design": other.id(), "sha256": sha256(file.read_bytes()).hexdigest()}
    file.with_name("other.gcode.json").write_text(json.dumps(record))
    assert run("predict", *plate, "--dielectric", "0.4", *how).json["doubts"] == []
    lower = run("predict", *plate, "--dielectric", "0.3", *how)
    assert (lower.code, json.loads(lower.out)["status"]) == (2, "not predicted")
    assert "prints up to Z 1 mm, above the top of reference-length12-width8-dielectric0.3 at 0.9 mm" in lower.line
    same = (*plate, "--dielectric", "0.2", "--electrode", "0.4")
    doubt, of_bodies = run("predict", *same, *how).json["doubts"]
    assert of_bodies.startswith("tool 4 prints 96 mm2")
    assert doubt.startswith("the record beside other.gcode names another design, 'other'")
    assert doubt in run("export", *same, "--gcode", str(file), "-o", "body.stl").out
    assert doubt in {f.message for f in registered(make({"shape": "reference", "parameters": SIZE | {
        "dielectric_mm": 0.2, "electrode_mm": 0.4}}), file).findings()}  # fmt: skip
    higher = run("predict", *plate, "--dielectric", "0.6", *how).json
    assert any("is missing: nothing of" in one for one in higher["doubts"])
