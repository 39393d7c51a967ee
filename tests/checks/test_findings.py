"""What holds for the findings of all rules: order, form, merging, waivers, and clean sensors."""

import re
from pathlib import Path

import pytest

from sensorgen.checks import rules as checks
from sensorgen.checks.review import review
from sensorgen.core.findings import SEVERITIES, Finding
from sensorgen.design.design import make
from sensorgen.scene.scene import Body, box

BAD = {
    "shape": "tri",
    "parameters": {"length_mm": 8.3, "width_mm": 4.0, "dielectric_mm": 0.14},
    "orientation": "upside-down",
}


def test_findings_come_with_the_worst_first_and_complete():
    found = review(make(BAD)).findings
    order = [SEVERITIES.index(f.severity) for f in found]
    assert order == sorted(order)
    assert {"error", "warning", "info"} == {f.severity for f in found}
    for f in found:
        assert f.rule[0].isdigit()
        assert f.body
        assert f.message
        assert f.advice
        assert f.rule in ("7-printed", "9-support") or None not in (f.value_mm, f.limit_mm)
        assert f.layer is not None or f.place_mm is not None


@pytest.mark.own_cache
def test_a_review_is_read_again_and_made_anew_for_other_waivers_walls_or_values(monkeypatch):
    first, steps = review(make(BAD)), []
    again = review(make(BAD), steps.append)
    assert (again.findings, again.fits, again.meshes.keys(), steps) == (
        first.findings, first.fits, first.meshes.keys(), []
    )  # fmt: skip
    others = (make(BAD | {"waivers": [{"rule": "5", "reason": "known"}]}), ""), (make(BAD), "classic"), (
        make(BAD | {"parameters": BAD["parameters"] | {"width_mm": 4.5}}), ""
    )  # fmt: skip
    for other, walls in others:
        review(other, steps.append, walls)
        assert "checks" in steps
        steps.clear()
    large = make({"shape": "reference", "parameters": {"length_mm": 900.0}})
    assert review(large).fits is review(large).fits is False


def test_the_margin_is_negative_on_either_side_of_the_limit():
    assert Finding("9-bridge", "error", "b", "m", "a", value_mm=0.3, limit_mm=0.22).margin_mm == -0.08
    assert Finding("5-width", "error", "b", "m", "a", value_mm=0.1, limit_mm=0.12).margin_mm == -0.02
    assert Finding("5-width", "info", "b", "m", "a").margin_mm is None


def test_the_same_finding_in_layer_after_layer_is_one(sensor, findings):
    strips = (box(5, 5.3, 0, 20, 1.2, 1.5), box(5, 10, 0, 20, 1.5, 1.6), box(5, 5.3, 0, 20, 1.6, 1.7))
    found = findings(sensor(Body("strip", "pla", strips)), "5-", "strip")
    assert [(f.layer, f.last_layer) for f in found] == [(13, 15), (17, None)]


def waived(*waivers: dict[str, str]) -> list[Finding]:
    return review(make(BAD | {"waivers": list(waivers)})).findings


@pytest.mark.parametrize(
    ("waiver", "covers"),
    [
        ({"rule": "5-width"}, lambda f: f.rule == "5-width"),
        ({"rule": "5"}, lambda f: f.rule == "5-width"),
        ({"rule": "2"}, lambda f: f.rule.startswith("2-")),
        ({"rule": "2-film"}, lambda f: f.rule == "2-film"),
        ({"rule": "5", "body": "film_and_lower"}, lambda f: f.rule == "5-width" and f.body == "film_and_lower"),
        ({"rule": "5", "body": "film"}, lambda f: False),
        ({"rule": "1"}, lambda f: False),
        ({"rule": "10"}, lambda f: False),
    ],
)
def test_a_waiver_silences_only_what_it_names(waiver, covers):
    found = waived(waiver | {"reason": "tried on the bench"})
    found = [f for f in found if f.rule != "10-waiver"]
    assert len(found) == len(waived())
    assert [bool(f.waiver) for f in found] == [covers(f) for f in found]
    assert {f.waiver for f in found if f.waiver} <= {"tried on the bench"}


def test_what_is_waived_stops_nothing():
    with_all = review(make(BAD | {"waivers": [{"rule": r, "reason": "tried on the bench"} for r in "234579"]}))
    assert with_all.errors(strict=True) == []
    assert with_all.counts() == {"error": 0, "warning": 0, "info": 0, "waived": len(with_all.findings)}
    assert review(make(BAD)).errors() != []


def test_the_quality_decides_which_faces_are_off_the_grid():
    plate = {"shape": "reference", "parameters": {"dielectric_mm": 0.6, "electrode_mm": 0.3}}
    assert review(make(plate | {"quality": "fine"})).findings == []
    assert review(make(plate | {"quality": "extrafine"})).findings == []  # 0.3 and 0.6 are whole layers of both
    found = review(make(plate | {"quality": "extrafine", "parameters": {"dielectric_mm": 0.7}})).findings
    assert {f.rule for f in found} == {"2-film", "2-printed-gap", "3-grid", "4-unsampled"}


def test_every_rule_has_a_name_that_a_target_may_refuse():
    """Rules are names such as 2-film in the source; RULES lists them all."""
    source = Path(checks.__file__).parents[1]
    text = "".join(file.read_text("utf-8") for file in source.rglob("*.py"))
    assert set(re.findall(r'"(\d+-[a-z-]+)"', text)) == set(checks.RULES)
