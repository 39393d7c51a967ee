"""Predictions as near as asked: what is planned, what it comes to, and whether the truth is within it."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import make
from sensorgen.design.tip import EVEN
from sensorgen.models import fem2d, press2d
from sensorgen.models.compression import curve_of
from sensorgen.models.press2d import BoundaryConditions
from sensorgen.prediction import compression_law as celllaw
from sensorgen.prediction import rest_state, sensor_model
from sensorgen.prediction.bodies import drawn, estimated
from sensorgen.prediction.capacitance import PLANE, Answer
from sensorgen.prediction.mesh_ladder import Case, pressed
from sensorgen.prediction.query import Load as Press
from sensorgen.prediction.query import Tip
from sensorgen.prediction.sensor_model import piece

GAPS = Answer("columns", Interval(1e-10, 2e-10), ())
TONES = (1.1e3, 99.7e3)
PRESS = Press(TONES, 6.0, 0.05)
needs_mesher = pytest.mark.skipif("not __import__('importlib').util.find_spec('netgen')", reason="needs NGSolve")


def tri(dielectric_mm):
    return make({"shape": "tri", "parameters": {"dielectric_mm": dielectric_mm}})


def reference(name):
    return json.loads((Path(__file__).parent / "reference" / f"{name}.json").read_text("utf-8"))


def rise(law, load):
    """Rise of C by a law, under the pressure of a load of a reference."""
    return float(1 / (1 - law.capacitive_strain(np.asarray(1e3 * load["pressure_kpa"]))[0]) - 1)


def worked_out(design, accuracy, press=PRESS, law="", **tip):
    return sensor_model.execute(sensor_model.plan(drawn(design), press, accuracy, law, Tip(**tip)))


def chosen(plan):
    return {level.name: level.chosen for level in plan.levels}


def off(one, other, press=PRESS):
    """Relative difference of abs(Z) of two sensors at the worst tone."""
    z, of = (abs(s.impedance(np.asarray(press.frequency_hz), press.force_n, press.position_m)) for s in (one, other))
    return float(max(abs(z / of - 1)))


def test_without_an_accuracy_the_capacitance_is_known_to_the_default():
    sensed, plan = worked_out(tri(0.1), None)
    assert plan.accuracy == sensor_model.ACCURACY
    assert sensed.rest.answer.model == "fem2d"
    assert sensed.rest.capacitance.model.width() <= PLANE


def test_without_an_accuracy_no_cell_is_solved_in_3d():
    sensed, plan = worked_out(make({"shape": "rect", "parameters": {"dielectric_mm": 0.15}}), None)
    assert chosen(plan)["compression"] == "nearest prototype"
    assert not sensed.law.bounded
    assert "--compression solved" in sensed.law.doubts[0]


def test_a_cell_in_3d_has_an_interval_far_beyond_its_prototype():
    """At 1103 kPa: the rise by another program, neo-Hookean, lies within."""
    large = reference("rect_rise")["large"]
    cell = make({"shape": "rect", "parameters": {k: v for k, v in large.items() if k != "meshes"}})
    exact = large["meshes"][-1]["loads"][-1]
    law = worked_out(cell, None, Press(TONES, exact["pressure_kpa"] * 1e3 * 1e-4, 0.05))[0].law  # on 1 cm2
    least, most = (rise(c, exact) for c in law.others)
    assert law.bounded
    assert least < 0.01 < exact["rise"] < most < 4
    assert any("none and that of the closed cell" in doubt for doubt in law.doubts)


def test_the_printed_prototype_in_3d_is_stored_up_to_table_1_1():
    """Range of the stored law holds what another program gives on two meshes; other films have none stored."""
    large = reference("rect_rise")["large"]
    ends = {}
    for film_mm in (0.2, 0.1):
        cell = make({"shape": "rect", "parameters": {"dielectric_mm": film_mm}})
        law = celllaw.law_of(cell, GAPS, printed=piece(estimated(cell, "arachne")), tip=Tip(block=EVEN), until_pa=1.1e6)
        ends[film_mm] = law.others
    assert ends[0.1] == ()
    for mesh in large["meshes"][1:]:
        for load in mesh["loads"]:
            least, most = (rise(c, load) for c in ends[0.2])
            assert least < load["rise"] < most < 1.4 * least


@needs_mesher
@pytest.mark.nightly
@pytest.mark.parametrize("cell", [0, 1])
def test_a_drawn_section_solved_up_to_table_1_1_holds_another_program(cell):
    """At 345, 600 and 1103 kPa, where the flanks of tri have rolled onto each other: NGSolve on two meshes."""
    known = reference("tri_contact")["cells"][cell]
    law = celllaw.solved(tri(known["parameters"]["dielectric_mm"]), tip=Tip(block=EVEN), until_pa=1.103e6)
    for load in (load for mesh in known["meshes"] for load in mesh["loads"]):
        least, most = (rise(c, load) for c in law.others)
        assert least < load["rise"] < most < 1.06 * least


def test_the_cheapest_of_each_level_is_taken_and_the_whole_holds_the_truth():
    """Of a prototype, whose law is stored: against the capacitance to 1e-7."""
    exact, _ = worked_out(tri(0.1), 1e-7)
    for accuracy, model in ((2.0, "fem2d"), (1e-2, "fem2d"), (2e-4, "fem2d")):
        sensed, plan = worked_out(tri(0.1), accuracy)
        assert chosen(plan) == {"cell": model, "compression": "solved", "line": "line, 1 section"}
        assert off(sensed.sensor, exact.sensor) <= plan.width <= accuracy
    assert [level.name for level in plan.levels] == ["cell", "compression", "line"]


@needs_mesher
def test_an_unknown_cell_is_pressed_no_more_finely_than_it_takes(monkeypatch):
    """The film of 0.15 mm on the coarsest mesh, against the finest: nearer than claimed."""
    monkeypatch.setattr(celllaw, "STRESS_PA", (0.0, 3e4, 6e4))
    rough, plan = worked_out(tri(0.15), 1e-2)
    assert chosen(plan)["compression"] == "press2d, mesh x 1.5"
    fine = replace(rough.sensor, compression=celllaw.solved(tri(0.15)).compression)
    claimed = next(c.width for c in plan.levels[1].candidates if c.model == "press2d, mesh x 1.5")
    assert 1e-6 < off(rough.sensor, fine) < claimed < 1e-2 / 2
    assert plan.width < 1e-2


def test_a_plate_is_known_no_better_than_how_it_is_held():
    """At a low tone all is C: under the tip it rises by s/(1 - s); a base slides or holds (11.77 and 2.87 E)."""
    press = Press((1.0,), 6.0, 0.05)
    _, plan = worked_out(make({"shape": "reference"}), 1e-5, press)
    share, stress = 0.1, 6.0 / 1e-4
    free, tied = (1 - stress / (6e6 * times) for times in (2.8718, 11.7667))  # tests/reference/bonded_plates.json
    z = [1 / (1 - share + share / s) for s in (free, tied)]
    assert plan.width == pytest.approx(z[1] / z[0] - 1, rel=0.05)
    assert chosen(plan) == {"cell": "columns", "compression": "bonded", "line": "line, 1 section"}


def test_a_round_tip_has_as_many_sections_as_it_takes():
    accuracy = 1e-6
    sensed, plan = worked_out(tri(0.1), accuracy, profile="parabola")
    fine = replace(sensed.sensor, pieces=2048)
    line = plan.levels[-1]
    claimed = next(c.width for c in line.candidates if c.model == line.chosen)
    assert off(sensed.sensor, fine) == pytest.approx(claimed, rel=0.1)
    assert claimed <= line.allowed
    assert line.chosen == f"line, {sensed.sensor.pieces} sections"
    coarser = [c.width for c in line.candidates if c.model != line.chosen]
    assert all(width > line.allowed for width in coarser)


def test_a_flat_tip_is_one_section_and_others_are_still_cut():
    """The budget holds it against round ones, whose pressure differs."""
    sensed, _ = worked_out(tri(0.1), 1e-2)
    assert off(replace(sensed.sensor, profile="parabola"), sensed.sensor) > 1e-5


def test_without_force_nothing_has_to_give_way():
    _, plan = worked_out(tri(0.15), 1e-3, Press(TONES, 0.0, 0.05))
    assert chosen(plan)["compression"] == "unconfined"
    assert plan.width <= 1e-3


def test_bounds_far_apart_are_felt_most_at_the_lower_one(monkeypatch):
    """At a low tone abs(Z) goes with 1/C: half of a large width would say too little."""
    for module in (sensor_model, rest_state):
        monkeypatch.setattr(module, "default_width", lambda scene: 2.0)
    sensed, plan = worked_out(tri(0.1), 2.0, Press((1.0,), 0.0, 0.05))
    bounds = sensed.rest.answer.capacitance_f
    assert bounds.width() > 0.3
    assert plan.width == pytest.approx(bounds.middle() / bounds.lower - 1, rel=1e-6)


def test_a_law_that_is_asked_for_is_taken_whatever_its_error():
    sensed, plan = worked_out(tri(0.1), 1e-3, law="unconfined")
    assert (sensed.law.compression.name, plan.width) == ("unconfined", math.inf)


def test_the_outline_says_what_is_expected_and_asks_nothing_dear(monkeypatch):
    for model in (fem2d, press2d):
        monkeypatch.setattr(model, "press" if model is press2d else "capacitance", None)
    outline = sensor_model.plan(drawn(tri(0.15)), PRESS, 1e-2)
    cell, compression, line = outline.plan.levels
    assert (cell.chosen, compression.chosen, line.chosen) == ("fem2d", "press2d, mesh x 1.5", "line, 1 section")
    assert compression.candidates[0].expected_width == math.inf
    widths = [c.expected_width for c in compression.candidates[1:]]
    assert widths == sorted(widths, reverse=True)
    assert outline.plan.width is None


def test_an_accuracy_is_above_0():
    with pytest.raises(OutOfRange, match="above 0"):
        sensor_model.plan(drawn(tri(0.1)), PRESS, math.nan)


@needs_mesher
def test_a_light_press_below_the_first_stress_of_a_curve_is_within_what_is_claimed():
    """A contact grows from nothing: the stored curve begins at 10 kPa, the same cell is solved at 1, 2 and 5."""
    design = tri(0.1)
    press = Press((1.0,), 0.2, 0.05)
    sensed, plan = worked_out(design, 1e-3, press)
    of = piece(drawn(design))
    eps = {t.material: t.value for t in sensed.values if t.quantity == "relative_permittivity"}
    case = Case(of, "press2d", celllaw.elastic(design, of.scene), eps, BoundaryConditions())
    fine = curve_of(pressed(case, (0.0, 1e3, 2e3, 5e3)))
    claimed = next(c.width for c in plan.levels[1].candidates if c.model == "solved")
    assert off(sensed.sensor, replace(sensed.sensor, compression=fine), press) < claimed < 1e-3
