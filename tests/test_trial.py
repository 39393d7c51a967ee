"""One design tried: the verdict is the build's, the numbers are the prediction's, doubts are apart."""

import pickle
import re
from dataclasses import replace

import pytest
from pydantic import TypeAdapter

from sensorgen.checks.review import review
from sensorgen.core.bounds import Bounds, Interval
from sensorgen.core.document import text, to_json
from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import make
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.identifiability.results import StandardErrors
from sensorgen.prediction.query import DEFAULT, Query, Tip
from sensorgen.prediction.results import Prediction, UnderTop
from sensorgen.prediction.slices import reviewed
from sensorgen.workflows.build import build
from sensorgen.workflows.decision import decision
from sensorgen.workflows.trial import Numbers, Trial, trial


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    "data", [{"shape": "reference"}, {"shape": "tri", "parameters": {"dielectric_mm": 0.1}}], ids=["plate", "tri"]
)
def test_verdict_and_numbers_are_those_of_the_build(data, tmp_path):
    design = make(data)
    built = build(design, tmp_path / "files", cad=False, force=True)
    tried = trial(design)
    assert tried.verdict == built.verdict
    assert tried.findings == tuple(f for f in built.findings if not f.waiver)
    assert tried.printed.capacitance == built.prediction.capacitance
    of_tip = built.prediction.drawn.force_resolution  # the trial has that of the worst top
    assert of_tip.value <= tried.drawn.force_resolution.value < 1.02 * of_tip.value
    calibrated = built.prediction.identifiability.calibrated
    assert tried.printed.force_calibrated.value == calibrated.sigma_force_n
    assert tried.printed.bench() == built.prediction.bench()
    assert TypeAdapter(Trial).validate_json(to_json(tried)) == tried == pickle.loads(pickle.dumps(tried))
    assert next(iter(text(tried.document()))).startswith(tried.verdict)


def test_on_a_bench_the_worst_top_gives_the_value_and_all_tops_the_range():
    """A top of smaller value may have the wider range: check said <110 to 1500 mN, predict <59 to 1500."""
    calibrated = StandardErrors(sigma_force_n=0.5, sigma_position_m=0.02)
    tops = (
        UnderTop("block", Bounds.of(0.4, "N", model=Interval(0.1, 0.9)), calibrated=calibrated),
        UnderTop("stiff plate", Bounds.of(0.5, "N", model=Interval(0.3, 0.6)), calibrated=calibrated),
    )
    predicted = Prediction(1, "two tops", "id", "drawn", "predicted", 1.0, 0.05, tops=tops)
    force, place = Numbers.of(predicted).bench()
    assert (force, place) == predicted.bench()
    assert (force.value, force.lower, force.upper) == pytest.approx((0.5, 0.125, 1.125))


def test_without_electrical_numbers_no_design_is_plainly_printed(tmp_path):
    """A film of two permittivities of which none is the default: the verdict was PRINT."""
    (tmp_path / "materials").mkdir()
    values = "[{value: 3.0, source: a}, {value: 5.0, source: b}]"
    (tmp_path / "materials" / "film.yaml").write_text(
        "title: film\nabout: film\ncolour: '#cccccc'\nconductor: false\ncitations: {a: a, b: b}\n"
        f"properties: {{relative_permittivity: {values}}}\n", "utf-8",
    )  # fmt: skip
    design = make(
        {"shape": "reference", "materials": {"dielectric": "film"}, "tools": {"film": 2}}, str(tmp_path / "d.yaml")
    )
    tried = trial(design)
    assert tried.printed.capacitance is None
    assert tried.verdict == "PRINT WITH WARNINGS"
    assert [f.rule for f in tried.findings if f.severity == "warning"] == ["12-numbers"]
    said = " ".join(" ".join(text(decision(design, reviewed(design), 0.0).document())).split())
    assert said.startswith("PRINT WITH WARNINGS")
    assert "not predicted: film has no default relative_permittivity" in said
    alone = " ".join(text(decision(design, reviewed(design), 0.0, predict=False).document()))
    assert "not predicted: checks alone" in alone
    assert all(re.match(r"PRINT WITH WARNINGS .*estimated \(.*\); not predicted ", words) for words in (said, alone))


def test_the_first_screen_says_what_is_doubtful():
    design = make({"shape": "reference", "parameters": {"length_mm": 30.0}})
    said = " ".join(" ".join(text(decision(design, reviewed(design), 0.0).document())).split())
    assert "doubtful: plate bonded to electrodes that it stretches: " in said


def test_waived_findings_do_not_count():
    data = {"shape": "reference", "parameters": {"dielectric_mm": 0.1}}
    open_, waived = make(data), make(data | {"waivers": [{"rule": "2-film", "reason": "a study of pinholes"}]})
    assert [f.rule for f in review(open_).findings] == ["2-film"]
    assert (trial(open_).verdict, trial(waived).verdict) == ("PRINT WITH WARNINGS", "PRINT")


def test_sensitivity_between_two_pressures():
    """Of a free plate: C(p) = C / (1 - p / E), so between p and q (E - p) / (E - q) - 1 over q - p."""
    design, e_kpa = make({"shape": "reference"}), 6e3  # thesis, Table 3.2
    for low, high in ((0.0, 60.0), (10.0, 30.0)):
        found = evaluate(bodies.drawn(design), Query(law="unconfined", range_kpa=(low, high))).sensitivity
        assert found.value == pytest.approx(((e_kpa - low) / (e_kpa - high) - 1) / (high - low), rel=1e-9)
    with pytest.raises(OutOfRange, match="pressures that rise"):
        Query(range_kpa=(5.0, 5.0))


def test_a_tip_over_few_periods_is_doubted():
    """10 mm over the thesis's 2 mm are five; a tip of 2.5 mm covers one and a quarter."""
    design = make({"shape": "tri", "parameters": {"dielectric_mm": 0.1}})
    assert not [d for d in evaluate(bodies.drawn(design)).doubts if "periods" in d]
    shorter = evaluate(bodies.drawn(design), replace(DEFAULT, tip=Tip(2.5e-3), force_n=1.0))
    assert [d for d in shorter.doubts if "covers 1.2 periods, less than 1.5" in d]
