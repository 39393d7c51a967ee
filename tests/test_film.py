"""Thickness of a film as printed: what heights of tools change, against closed forms and an independent solution."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sensorgen.asprinted import film
from sensorgen.design.body import DRAWN
from sensorgen.design.design import make
from sensorgen.models import columns, fem3d, sandwich
from sensorgen.prediction import bodies
from sensorgen.prediction.compression_law import solved
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.query import TONES_HZ, Query
from sensorgen.prediction.rest_state import rest_state
from sensorgen.prediction.sensor_model import build_sensor, piece, sensor_model

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
    assert ("0.02 mm" in term.what, term.source) == (True, "diabase-h5")
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
    cells = bodies.estimated(same).cells
    assert cells.film.error_mm == 0.0
    assert cells.film.thinner == cells.film.thicker == cells.first()


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
    least = found.material.lower / found.value  # of a permittivity of one source, beside the thicker film
    assert found.lower == near(found.value * 0.6 / 0.62 * least)


def test_a_bonded_plate_is_stiffer_the_thinner_it_is():
    """As the law of tests/models/test_sandwich.py is, at 0.58 and 0.62 mm."""
    found = evaluate(bodies.estimated(make({"shape": "reference"})), Query(law="bonded", force_n=6.0))
    electrodes = {"electrode_pa": (22e6, 22e6), "electrode_m": (3e-4, 3e-4)}
    bulk = 6e6 / (3 * (1 - 2 * 0.4999))
    strain = [60e3 / sandwich.modulus_pa(6e6, 0.01, d * 1e-3, bulk, **electrodes) for d in (0.58, 0.6, 0.62)]
    thin, usual, thick = (s / (1 - s) / 60 for s in strain)
    nm = 1e-6  # of 0.6 mm: what heights are rounded to
    assert found.sensitivity.value == near(usual, nm)
    assert (found.sensitivity.print.lower, found.sensitivity.print.upper) == (near(thin, nm), near(thick, nm))
    assert found.force_resolution.print.lower < found.force_resolution.value < found.force_resolution.print.upper


def test_a_pressed_plates_range_is_that_of_plates_drawn_thinner_and_thicker():
    query, responses, resolutions = Query(law="bonded", force_n=6.0), [], []
    for film_mm in (0.6, 0.58, 0.62):
        plate = bodies.drawn(make({"shape": "reference", "parameters": {"dielectric_mm": film_mm}}))
        resolutions.append(evaluate(plate, query).force_resolution.value)
        responses.append(abs(sensor_model(plate, query)[0].sensor.response(TONES_HZ, 6.0, 0.05)[0]))
    change = max(float(abs(z / responses[0] - 1).max()) for z in responses[1:])
    found = evaluate(bodies.estimated(make({"shape": "reference"})), query)
    term = next(t for t in found.budget.terms if t.name == "film thickness")
    assert term.changes.magnitude == near(change, 2e-2)
    ends = found.force_resolution.print
    assert (ends.lower, ends.upper) == (near(min(resolutions), 2e-3), near(max(resolutions), 2e-3))


def test_a_prints_range_has_law_and_capacitance_of_the_same_film():
    """Cells with the teeth moved by 0.02 mm, as bodies of their own with stored curves, and by capacitance alone."""
    body, query = bodies.estimated(make({"shape": "tri", "parameters": {"dielectric_mm": 0.2}})), Query(force_n=6.0)
    scene, tip = body.cells.first(), query.tip_of(body.design)
    models = [build_sensor(of_scene(body, moved(scene, by)), tip=tip) for by in (0.0, -0.02, 0.02)]
    assert all(model.law.bounded for model in models)
    usual, *others = (model.sensor for model in models)
    others += [replace(usual, capacitance_f_per_m=other.capacitance_f_per_m) for other in others]
    own, *moved_by = (np.array(sensor.response(TONES_HZ, 6.0, 0.05)[:2]) for sensor in (usual, *others))
    expected = np.max([abs(of / own - 1).max(axis=1) for of in moved_by], axis=0)
    found = evaluate(of_scene(body, scene, body.cells.film), query)
    term = next(t for t in found.budget.terms if t.name == "film thickness")
    assert (term.changes.magnitude, term.changes.by_force) == (near(expected[0], 1e-3), near(expected[1], 1e-3))
    assert not term.at_least


@pytest.mark.nightly
def test_a_pressed_prints_range_is_that_of_cells_drawn_thinner_and_thicker():
    """Cells with the teeth moved by 0.02 mm, solved on another mesh as bodies of their own."""
    body = bodies.estimated(make({"shape": "tri", "parameters": {"dielectric_mm": 0.2}}))
    scene = body.cells.first()
    found = evaluate(of_scene(body, scene, body.cells.film), Query(force_n=6.0), keep=False)
    thin, thinner = pressed(of_scene(body, moved(scene, -0.02)))
    thick, thicker = pressed(of_scene(body, moved(scene, 0.02)))
    usual = abs(build_sensor(of_scene(body, scene)).sensor.response(TONES_HZ, 6.0, 0.05)[0])
    range_of = found.sensitivity.print
    assert (range_of.lower, range_of.upper) == (near(thick, 1e-2), near(thin, 1e-2))
    change = max(float(abs(z / usual - 1).max()) for z in (thinner, thicker))
    term = next(t for t in found.budget.terms if t.name == "film thickness")
    assert term.changes.magnitude == near(change, 2e-2)
    assert not term.at_least


def pressed(body):
    """Rise of the capacitance per kPa, and abs(Z) at all frequencies; 6 N are 60 kPa."""
    law = solved(body.design, piece(body), level=-1)
    strain = float(law.compression.capacitive_strain(np.asarray(60e3))[0])
    return strain / (1 - strain) / 60, abs(build_sensor(body, law).sensor.response(TONES_HZ, 6.0, 0.05)[0])


def of_scene(body, scene, thickness=None):
    """A print of one cell alone."""
    cells = replace(body.cells, scenes={"printed": scene}, film=thickness)
    return replace(body, make=lambda: cells)


def moved(scene, by_mm):
    """Upright prisms from 0.6 mm on, where the top electrode begins, are higher; those from 0.3 mm on are stretched."""
    heights = [0.0, 0.3, 0.6, 2.0], [0.0, 0.3, 0.6 + by_mm, 2.0 + by_mm]
    bodies = []
    for body in scene.bodies:
        ends = [[round(float(np.interp(z, *heights)), 9) for z in (p.start_mm, p.end_mm)] for p in body.pieces]
        prisms = [replace(p, start_mm=a, end_mm=b) for p, (a, b) in zip(body.pieces, ends, strict=True)]
        bodies.append(replace(body, pieces=tuple(prisms)))
    return replace(scene, bodies=tuple(bodies), size_mm=(*scene.size_mm[:2], scene.size_mm[2] + by_mm))
