"""Verdicts that one fault of a print leads to: designs at the edge, by sums on paper.

Nozzle 0.4 mm, lines of 0.44 mm, layers of 0.1 mm. Arachne prints a stretch of 0.12 mm and more, classic walls a line.
"""

import json
from types import SimpleNamespace

import pytest

from sensorgen.analysis.preview import _tornado
from sensorgen.design.design import make
from sensorgen.prediction import bodies
from sensorgen.prediction.error_budget import by_first_layer, by_walls
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.results import Changes, ErrorBudget, Term
from sensorgen.scene.scene import Body, Scene, box


def terms(data):
    return {t.name: t for t in evaluate(bodies.estimated(make(data)), beside=False).budget.terms}


@pytest.mark.parametrize(
    ("width_mm", "walls", "turns"),
    [(0.43, None, "CHANGE"), (0.45, None, ""), (0.43, "arachne", ""), (0.11, None, "")],
)  # fmt: skip
def test_walls_lose_cogs_that_are_narrower_than_a_line(width_mm, walls, turns):
    """Of 0.11 mm: CHANGE by the drawing's own rule, whatever walls print them."""
    data = {"shape": "cog", "parameters": {"cog_width_mm": width_mm, "dielectric_mm": 0.2}}
    design = make(data | ({"profile": {"walls": walls}} if walls else {}))
    assert by_walls(design) == turns


def test_walls_that_fill_gaps_print_what_arachne_loses():
    """Apexes of tri 0.2: at mid-layer 0.05 mm wide."""
    assert by_walls(make({"shape": "tri", "parameters": {"dielectric_mm": 0.2}})) == "PRINT"


@pytest.mark.parametrize(("film_mm", "turns", "more"), [(0.1, "CHANGE", None), (0.2, "", 1.0), (0.3, "", 0.5)])
def test_a_film_of_one_layer_is_none_without_it(film_mm, turns, more):
    """C of a plate is as one over its film: 0.2 mm less 0.1 have twice, 0.3 less 0.1 have 1.5 times."""
    term = terms({"shape": "reference", "parameters": {"dielectric_mm": film_mm}})["film a layer thinner"]
    assert (term.turns, term.at_least) == (turns, not more)
    if more:
        assert term.changes.capacitance == pytest.approx(more, rel=1e-6)


@pytest.mark.parametrize(("error_mm", "turns"), [(0.0, ""), (0.09, ""), (0.1, "CHANGE")])
def test_a_film_is_none_where_tools_differ_by_it(error_mm, turns, tmp_path):
    shipped, own = make({"shape": "reference"}).machine, tmp_path / "rough.yaml"
    own.write_text(json.dumps(shipped.model_dump(exclude={"name"}) | {"tool_height_error_mm": error_mm}), "utf-8")
    data = {"shape": "reference", "parameters": {"dielectric_mm": 0.1}, "printer": str(own)}
    listed = terms(data)
    assert (listed["film thickness"].turns, listed["film a layer thinner"].turns) == (turns, "CHANGE")


@pytest.mark.parametrize(("squeezed_mm", "turns"), [(0.09, ""), (0.1, "CHANGE")])
def test_no_first_layer_is_left(squeezed_mm, turns):
    for key, name in (("squeezed_mm", "first layer squeezed"), ("bed_mm", "bed uneven")):
        assert terms({"shape": "reference", "effects": {key: squeezed_mm}})[name].turns == turns


@pytest.mark.parametrize(("gap_mm", "turns"), [(0.43, "CHANGE"), (0.45, "")])
def test_electrodes_side_by_side_touch_in_a_squeezed_layer(gap_mm, turns):
    """Squeezed to half, a line of 0.44 mm is 0.88 mm wide: 0.22 mm further to each side."""
    sides = (("bottom", 0.0), ("top", 5.0 + gap_mm))
    pair = tuple(Body(end, "etpu", (box(x, x + 5.0, 0, 5, 0, 0.1),), end) for end, x in sides)
    design = make({"shape": "reference"})
    side_by_side = SimpleNamespace(
        printed=Scene(pair, (10.0 + gap_mm, 5.0, 0.1)), layers=design.layers, machine=design.machine
    )
    assert by_first_layer(side_by_side, 0.05) == turns


ASSUMED = {
    "boundary", "tip off the middle", "tip tilted", "stiffness", "resistivity", "permittivity of x60", "bed uneven",
    "slicer's walls", "film thickness", "film a layer thinner", "first layer squeezed", "lead capacitance",
    "piezoresistance", "contact resistance", "meter's gain", "meter: series or parallel", "permittivity, temperature",
    "permittivity, humidity", "resistivity, temperature", "resistivity, humidity", "dispersion", "creep", "person",
    "hysteresis",
}  # fmt: skip


@pytest.mark.parametrize("shape", ["reference", "tri"])
def test_every_assumption_is_listed_with_its_range_and_source(shape):
    budget = evaluate(bodies.estimated(make({"shape": shape})), beside=False).budget
    effects, _, ranges = budget.assumed()
    names = [row[0] for row in effects.cells]
    assert {"cell", "compression", "line", "tip"} | ASSUMED == set(names)
    assert [row[0] for row in ranges.cells] == names
    assert not [words for _, words in ranges.cells if words.startswith(" ") or words.endswith("()")]
    assert None not in {cell for row in effects.cells for cell in row}


def test_the_picture_has_effects_at_rest_beside_those_on_a_press():
    """Of 6 N on 100 mm: 3 N are half, 30 N all, 25 mm a quarter."""
    changes = Changes(re=12.0, capacitance=0.002), Changes(force_n=3.0, position_m=0.025), Changes(force_n=30.0)
    terms = (*(Term(str(k), "", "meter", c) for k, c in enumerate(changes)), Term("none", "", "meter", Changes()))
    bars = list(_tornado(SimpleNamespace(budget=ErrorBudget(6.0, 0.05, terms, None, at_least=False))))
    assert [(bar.term.name, bar.term.at_rest(), bar.shares) for bar in bars] == [
        ("2", "", (100.0, 0.0)), ("1", "", (50.0, 25.0)), ("0", "C 0.2 %, R 1200 %", (0.0, 0.0)),
    ]  # fmt: skip
