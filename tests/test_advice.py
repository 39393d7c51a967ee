"""Changes that are tried: the nearest that removes findings, checked again by hand, and written into the file."""

from dataclasses import replace
from math import log
from pathlib import Path

import pytest

from sensorgen.checks.review import review
from sensorgen.core import yamlfile
from sensorgen.core.bounds import Bounds
from sensorgen.core.errors import BadInput
from sensorgen.design import best
from sensorgen.design.design import load, make
from sensorgen.prediction.results import resolved
from sensorgen.prediction.slices import reviewed
from sensorgen.workflows import moves
from sensorgen.workflows.advice import AdviceSearch, advise, advised
from sensorgen.workflows.decision import decision
from sensorgen.workflows.trial import effects, trial

DOCS = Path(__file__).parents[1] / "docs"
OFF_GRID = """# my plate
shape: reference   # no pattern

parameters:
  dielectric_mm: 0.57  # between two layers
  length_mm: 30
quality: fine
"""


def warnings(design):
    return [f for f in review(design).findings if f.severity in ("error", "warning") and not f.waiver]


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    """A plate whose film ends between two layers, its trial, and the advice."""
    path = tmp_path_factory.mktemp("advice") / "plate.yaml"
    path.write_text(OFF_GRID, "utf-8")
    design = load(path)
    made = trial(design)
    return design, made, advise(design, made, 1e9)


def test_the_nearest_change_is_the_nearest_whole_layer(plate):
    """By hand: 0.6 mm is ln(0.6 / 0.57) away, 0.5 mm ln(0.57 / 0.5); nothing else removes the warnings."""
    design, made, advice = plate
    assert made.verdict == "PRINT WITH WARNINGS"
    assert advice.complete
    changes = [{c.key: c.after for c in one.changes} for one in advice.tried]
    assert changes[0] == {"parameters.dielectric_mm": 0.6}
    assert advice.tried[0].distance == pytest.approx(log(0.6 / 0.57))
    for one in advice.tried:  # every one is checked again here, from its values alone
        again = moves.changed(design, {tuple(c.key.split(".")): c.after for c in one.changes})
        assert len(warnings(again)) < len(warnings(design))
        assert again.id() == one.trial.design
        assert not one.trial.errors()
    assert [one.distance for one in advice.tried] == sorted(one.distance for one in advice.tried)


def test_numbers_of_a_change_are_those_of_its_own_trial(plate):
    """The plate's capacitance between two plates, eps A / d, which the trial has not computed that way."""
    eps = 4.68 * 8.8541878128e-12
    first = plate[2].tried[0]
    assert first.trial.printed.capacitance.value == pytest.approx(eps * 0.03 * 0.01 / 0.6e-3, rel=1e-3)
    assert first.words().startswith("dielectric_mm 0.57 -> 0.6: 0 errors, 0 warnings; C ")


def test_no_change_of_a_design_without_findings():
    design = make({"shape": "reference", "parameters": {"length_mm": 30.0}})
    held = reviewed(design)
    decided = decision(design, held, 5.0)
    assert (decided.verdict, decided.advice) == ("PRINT", None)


def test_advice_is_stored_and_read_again(plate, shared_cache, monkeypatch):
    design, made, _ = plate
    first = advised(design, made, 1e6)
    monkeypatch.setattr("sensorgen.workflows.advice.advise", None)
    assert advised(design, made, 1e6) == first
    assert advised(design, made, 0.0) == first


def test_many_heights_go_to_the_grid_at_once(shared_cache, monkeypatch):
    """Before single steps, of which there may be more than are tried: one alone leaves the findings of the other."""
    size = {"length_mm": 6.0, "electrode_mm": 0.45, "dielectric_mm": 0.25, "height_mm": 0.35}
    together = {"electrode_mm": 0.4, "dielectric_mm": 0.2, "height_mm": 0.3}
    design = make({"shape": "cog", "parameters": size})
    left = len(warnings(make({"shape": "cog", "parameters": size | together})))
    for one in together:
        assert len(warnings(make({"shape": "cog", "parameters": size | {one: together[one]}}))) > left
    monkeypatch.setattr("sensorgen.workflows.advice.MOST_CHECKED", 9)
    advice = advise(design, trial(design), 1e9)
    found = [{c.key.removeprefix("parameters."): c.after for c in one.changes} for one in advice.tried]
    assert together in found


def test_the_most_that_are_tried_are_stated(plate, monkeypatch):
    design, made, _ = plate
    monkeypatch.setattr("sensorgen.workflows.advice.MOST_CHECKED", 1)
    last = list(advise(design, made, 1e9).document())[-1]
    assert last.startswith("(1 designs checked, 1 predicted; that many are tried at most; not tried:")


def test_a_change_that_senses_nothing_is_not_advice(plate, monkeypatch):
    """Planted: the design senses, its changes do not."""
    design, made, _ = plate
    monkeypatch.setattr("sensorgen.workflows.trial.grade", lambda one: (2, 2) if one is made else (0, 0))
    advice = advise(design, made, 1e9)
    assert advice.tried == ()
    assert "no change was found" in next(iter(advice.document()))


def test_a_range_ends_at_the_sensor():
    assert resolved(Bounds(0.02, 0.001, 41.0, "m", *(None,) * 3), 0.1, "cannot locate") == "20 mm (1 to >100)"


def test_a_change_that_is_not_needed_is_dropped(plate):
    """Planted: the whole layer that removes the warnings, with a length and a width that do nothing."""
    design, made, _ = plate
    search = AdviceSearch(design, made, 1e9, lambda _: None, 0.0)
    idle = {("parameters", "length_mm"): 27.0, ("parameters", "width_mm"): 9.0}
    search.run(search.changed(idle | {("parameters", "dielectric_mm"): 0.6}))
    assert [one.values for one in search.nearest] == [{("parameters", "dielectric_mm"): 0.6}]


def test_a_prediction_that_would_outrun_the_budget_is_not_begun(plate):
    """Of the longest so far: here the design's own, of a minute."""
    design, made, _ = plate
    assert not advise(design, made, 1e9, spent_s=0.6e9).predicted
    assert advise(design, made, 1e9, spent_s=0.4e9).predicted


@pytest.mark.parametrize(("text", "values", "after"), [
    ("a: 1  # one\nb: two\n", {("a",): 2.5}, "a: 2.5  # one\nb: two\n"),
    ("a: 'x'\r\nb:\r\n  c: 1\r\n  # end\r\n", {("b", "d"): 3.0},
     "a: 'x'\r\nb:\r\n  c: 1\r\n  d: 3\r\n  # end\r\n"),
    ("p: {c: 1, d: [1, 2]}", {("p", "c"): 2.0, ("p", "e"): "on"}, 'p: {c: 2, d: [1, 2], e: "on"}'),
    ("a: 1", {("profile", "walls"): "classic"}, "a: 1\nprofile:\n  walls: classic\n"),
    ("p: {}\na: 1\n", {("p", "x"): 1.0}, "p: {x: 1}\na: 1\n"),
    ("w:\n- rule: '5'\n  reason: |\n    several\n    lines\n", {("q",): "fine"},
     "w:\n- rule: '5'\n  reason: |\n    several\n    lines\nq: fine\n"),
    ("a:\nb: 1\n", {("a",): 2.0}, "a: 2\nb: 1\n"),
])  # fmt: skip
def test_a_value_is_changed_in_place(text, values, after):
    assert yamlfile.changed(text, values, "x.yaml") == after
    for path, value in values.items():
        at = yamlfile.parse(after, "x.yaml")
        for key in path:
            at = at[key]
        assert at == value


@pytest.mark.parametrize("text", ["a: [1, 2]\n", "a: {b: 1}\n", "- a\n", "a: &x 1\nb: *x\n"])
def test_what_cannot_be_changed_in_place_is_refused(text):
    with pytest.raises(BadInput):
        yamlfile.changed(text, {("a",): 1.0}, "x.yaml")


def test_the_budget_includes_what_the_prediction_took(plate):
    design, made, _ = plate
    late = advise(design, made, 30.0, spent_s=31.0)
    assert (late.checked, late.complete, late.tried) == (0, False, ())
    words = [part for part in late.document() if isinstance(part, str)]
    assert words[0].startswith("no change was tried: the design's own prediction took the budget")


def numbers(one, **changed):
    """A trial whose print has other resolutions [N, m] and sensitivity [1/kPa]."""
    values = {"force_resolution": 0.4, "position_resolution": 0.02, "sensitivity": 1e-3} | changed
    units = {"force_resolution": "N", "position_resolution": "m", "sensitivity": "1/kPa"}
    bounds = {key: Bounds.of(value, units[key]) for key, value in values.items()}
    rest = {"force_calibrated": bounds["force_resolution"], "position_calibrated": bounds["position_resolution"]}
    return replace(one, force_n=6.0, position_m=0.05, printed=replace(one.printed, **bounds, **rest))


@pytest.mark.parametrize(
    ("changed", "better", "words"),
    [
        ({"force_resolution": 0.2}, True, "force resolution 2 x better"),
        ({"force_resolution": 1.2}, False, "force resolution 3 x worse"),
        ({"force_resolution": 0.2, "position_resolution": 0.025}, False,
         "force resolution 2 x better, position resolution 1.2 x worse"),
        ({"position_resolution": 0.04}, False, "position resolution lost"),  # more than 100 mm / sqrt(12)
        ({"sensitivity": 5e-4}, False, "sensitivity 2 x worse"),
        ({"sensitivity": 1.01e-3}, False, ""),
    ],
)  # fmt: skip
def test_what_a_change_does_to_the_sensor_is_said(plate, changed, better, words):
    _, made, _ = plate
    assert effects(numbers(made), numbers(made, **changed)) == (better, words)


def test_what_improves_the_sensor_is_first_and_losses_are_in_its_line(plate, monkeypatch):
    """Planted: the whole layer makes force three times worse; a known plate, further away, makes it twice as good."""
    design, made, _ = plate
    own = {"quality": "extrafine", "parameters": {"dielectric_mm": 0.3}}
    known = best.KnownDesign(about="best known plate", numbers="0.2 N", seconds=1.0, **own)

    def planted(one, **_):
        good = one.params.dielectric_mm == 0.3
        return numbers(replace(made, findings=()), force_resolution=0.2 if good else 1.2)

    monkeypatch.setattr(best, "of", lambda shape: (known,) if shape == "reference" else ())
    monkeypatch.setattr("sensorgen.workflows.trial.trial", planted)
    advice = advise(design, numbers(made), 1e9)
    first, *others = [one.words() for one in advice.tried]
    assert first.startswith("best known plate: quality fine -> extrafine, dielectric_mm 0.57 -> 0.3: ")
    assert first.endswith("force resolution 2 x better")
    assert others
    assert all(words.endswith("force resolution 3 x worse") for words in others)
    short = advise(design, numbers(made), 0.5)  # s: less than the known plate takes
    assert any("--budget" in part and "(0.2 N)" in part for part in short.document() if isinstance(part, str))


def test_the_best_known_designs_are_those_of_the_documentation():
    """A user's machine has no docs: the values are packaged, too."""
    pages = [load(DOCS / f"{name}-tri.yaml") for name in ("best", "locates")]
    for one, page in zip(best.of("tri"), pages, strict=True):
        made = make({"shape": "tri", **one.data()})
        assert (made.params, made.quality) == (page.params, page.quality)
    assert best.of("reference") == ()
