"""Thickness of a film as printed: what heights of tools change, against closed forms and an independent solution."""

import json
from dataclasses import replace

import pytest

from sensorgen.asprinted import film
from sensorgen.design.body import DRAWN
from sensorgen.design.design import make
from sensorgen.models import columns, fem3d
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.rest_state import rest_state

EPS = {"x60": 4.68, "air": 1.00059}


def near(value, rel=1e-9):
    return pytest.approx(value, rel=rel, abs=0)


def test_a_plates_range_is_that_of_its_thickness():
    """0.6 mm between plates, 0.02 mm more or less."""
    found = evaluate(bodies.estimated(make({"shape": "reference"})))
    c = found.capacitance
    assert (c.print.lower, c.print.upper) == (near(c.value * 0.6 / 0.62), near(c.value * 0.6 / 0.58))
    assert (found.gap.lower, found.gap.upper) == (near(0.58e-3), near(0.62e-3))
    term = next(t for t in found.budget.terms if t.name == "film thickness")
    assert term.kind == "print"
    assert "0.02 mm (diabase-h5)" in term.what
    assert found.drawn.capacitance.print.lower == found.drawn.capacitance.print.upper
    assert "film thickness" not in [t.name for t in found.drawn.budget.terms]


def test_the_printers_file_says_how_much(tmp_path):
    shipped, own = make({"shape": "reference"}).machine, tmp_path / "rough.yaml"
    own.write_text(json.dumps(shipped.model_dump(exclude={"name"}) | {"tool_height_error_mm": 0.06}), "utf-8")
    design = make({"shape": "reference", "printer": str(own)})
    c = rest_state(bodies.estimated(design)).capacitance
    assert (c.print.lower, c.print.upper) == (near(c.value / 1.1), near(c.value / 0.9))
    usual = bodies.estimated(make({"shape": "reference"}))
    assert bodies.estimated(design).identity != usual.identity


def test_an_exact_printer_is_the_same_sensor():
    """How exact a printer is decides no design: names and logs of old ones hold."""
    design = make({"shape": "reference"})
    machine = design.machine.model_copy(update={"tool_height_error_mm": 0.0})
    same = design.model_copy()
    same.__dict__["machine"] = machine
    assert same.id() == design.id()
    assert bodies.estimated(same).cells.film is None


def test_crossed_strips_change_as_an_independent_program_found():
    """Film of 0.1 mm, 0.02 mm less or more: +19 and -13 % by finite elements that no sensorgen made."""
    scene = bodies.drawn(
        make({"shape": "rect", "parameters": {"dielectric_mm": 0.1, "length_mm": 2.0, "width_mm": 2.0}})
    ).cells.scenes[DRAWN]
    usual = fem3d.capacitance(scene, EPS, 3e-2).middle()
    thin, thick = (fem3d.capacitance(film.thicker(scene, by), EPS, 3e-2).middle() / usual for by in (-0.02, 0.02))
    assert (thin, thick) == (near(1.19, 5e-3), near(0.87, 5e-3))


def test_only_what_lies_between_the_electrodes_is_stretched():
    scene = bodies.drawn(make({"shape": "tri", "parameters": {"dielectric_mm": 0.2}})).cells.scenes[DRAWN]
    found = film.thicker(scene, 0.05)
    assert film.span_mm(scene) == (0.3, 0.5)
    assert film.span_mm(found) == (0.3, 0.55)
    assert found.size_mm == (*scene.size_mm[:2], near(scene.size_mm[2] + 0.05))
    assert film.thicker(found, -0.05) == scene
    assert columns.capacitance(found, EPS).upper < columns.capacitance(scene, EPS).upper


def test_a_film_that_may_be_none_has_no_upper_bound():
    scene = bodies.drawn(make({"shape": "tri", "parameters": {"dielectric_mm": 0.2}})).cells.scenes[DRAWN]
    assert film.thicker(scene, -0.2) is None
    touching = replace(scene, bodies=tuple(b for b in scene.bodies if b.terminal != "top"))
    assert film.thicker(touching, 0.1) is None
    body = bodies.estimated(make({"shape": "reference"}))
    cells = replace(body.cells, film=replace(body.cells.film, thinner=None))
    found = rest_state(replace(body, make=lambda: cells)).capacitance
    assert found.open == "upper"
    assert found.lower == near(found.value * 0.6 / 0.62)
