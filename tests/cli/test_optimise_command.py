"""``sensorgen optimise``: the front against a plain loop, a planted optimum, doubts, limits, bad targets."""

import json
from pathlib import Path

import pytest

from sensorgen.core import cache
from sensorgen.core.errors import BadInput, OutOfRange, UnknownName
from sensorgen.core.records import checked
from sensorgen.design.design import make
from sensorgen.prediction import bodies
from sensorgen.prediction.evaluate import evaluate
from sensorgen.workflows.optimise import ladder, result
from sensorgen.workflows.optimise.search import search
from sensorgen.workflows.optimise.space import MOST, candidates
from sensorgen.workflows.optimise.target import Target, load

EPS0, EPS_X60 = 8.8541878128e-12, 4.68  # thesis, Table 3.2
PLATES = {
    "design": {"shape": "reference"},
    "parameters": {"dielectric_mm": {"from": 0.1, "to": 0.4}, "electrode_mm": {"from": 0.2, "to": 0.4}},
    "objectives": {"capacitance_pf": "maximise", "bottom_electrode_ohm": "maximise"},
    "accept_doubts": ["plate free"],
}
DANGLING = {"shape": "tri", "parameters": {"dielectric_mm": 0.2}, "profile": {"walls": "classic"}}


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.PLACE, str(tmp_path / "cache"))


def target(**changes):
    return checked(Target, PLATES | changes)


def found(**changes):
    wanted = target(**changes)
    return search(wanted, candidates(wanted))


def test_the_front_is_that_of_a_plain_loop():
    """Every plate evaluated by itself, each pair of them compared."""
    values = {}
    for film in (0.1, 0.2, 0.3, 0.4):
        for electrode in (0.2, 0.3, 0.4):
            plate = make({"shape": "reference", "parameters": {"dielectric_mm": film, "electrode_mm": electrode}})
            p = evaluate(bodies.estimated(plate), keep=False)
            values[film, electrode] = p.capacitance.value, p.resistance["bottom"].value
    best = {
        k for k, (c, r) in values.items()
        if not any(c2 >= c and r2 >= r and (c2 > c * (1 + 1e-9) or r2 > r * (1 + 1e-9)) for c2, r2 in values.values())
    }  # fmt: skip
    search_ = found()
    leads = {tuple(row.candidate.values.values()) for row in result.leads(search_)}
    assert leads == best == {(0.1, 0.2)}
    assert len(search_.rows) == 12
    assert len(search_.evaluated) + sum(bool(row.discarded) for row in search_.rows) == 12


def test_a_planted_optimum_is_found():
    """The film whose plate capacitor is nearest to a capacitance, by the closed form."""
    films = [k / 10 for k in range(1, 13)]
    wanted = 1e12 * EPS0 * EPS_X60 * 1e-3 / 0.7e-3 * 1.01  # 100 x 10 mm
    nearest = min(films, key=lambda d: abs(1e15 * EPS0 * EPS_X60 * 1e-3 / d - wanted))
    search_ = found(
        parameters={"dielectric_mm": {"from": 0.1, "to": 1.2}}, objectives={"capacitance_pf": {"near": wanted}}
    )
    assert search_.front[0].candidate.values == {"dielectric_mm": nearest} == {"dielectric_mm": 0.7}
    out = [row for row in search_.rows if row.discarded]
    assert out
    assert all(row.certified and row.discarded == "dominated" for row in out)
    assert len(search_.evaluated) < len(films)


def test_feet_in_free_fall_lose():
    """As printed by classic walls they fall 0.1 mm at no force: C doubles, and the resolution is an artefact."""
    wanted = checked(Target, {
        "design": DANGLING, "parameters": {"along": ["x"]}, "objectives": {"position_resolution_mm": "minimise"},
    })  # fmt: skip
    design = candidates(wanted)[0].design
    trial = ladder.everything(design, wanted.query(), "")
    assert any("hang free" in doubt for doubt in trial.doubts)
    assert trial.printed.position_resolution.value < 0.02  # better than as drawn
    assert any(name.startswith("doubt: feet hang free") for name in wanted.violated(trial))


def test_limits_are_proven_before_anything_is_evaluated():
    search_ = found(limits={"capacitance_pf": {"most": 150}})
    assert {row.candidate.values["dielectric_mm"] for row in search_.evaluated} <= {0.3, 0.4}
    assert [r for r in search_.reasons() if r[0] == "limit capacitance_pf"] == [("limit capacitance_pf", True, 6)]


def test_a_target_that_nothing_meets_names_the_nearest_and_what_binds():
    search_ = found(limits={"capacitance_pf": {"least": 5000}})
    answer = result.result("plates", search_)
    assert not answer.front
    assert answer.nearest.values == {
        "dielectric_mm": 0.1,
        "electrode_mm": pytest.approx(answer.nearest.values["electrode_mm"]),
    }
    assert (answer.binding[0].constraint, answer.binding[0].alone) == ("limit capacitance_pf", 12)
    words = " ".join(str(part) for part in answer.document())
    assert "none of 12 designs meets the target" in words
    assert "nearest: dielectric_mm 0.1" in words


def test_a_search_that_is_stopped_goes_on_where_it_was(monkeypatch):
    wanted, tried = target(), []
    trial = ladder.trial

    def counted(design, *given, **more):
        tried.append(design.name)
        if len(tried) == 3:
            raise KeyboardInterrupt
        return trial(design, *given, **more)

    monkeypatch.setattr(ladder, "trial", counted)
    with pytest.raises(KeyboardInterrupt):
        search(wanted, candidates(wanted))
    search_ = search(wanted, candidates(wanted))
    assert len(tried) == len(set(tried)) + 1 == len(search_.evaluated) + 1  # the one that was stopped


def test_discards_on_a_coarse_mesh_hold_or_are_taken_back(monkeypatch):
    """A coarse mesh that is wrong by more than the margin is seen, and what it discarded is evaluated."""

    def lying(design, query, solve):
        film = design.params.dielectric_mm
        return {"force_resolution_n": ladder.Known(film if film != 0.4 else 9.0, film if film != 0.4 else 9.0, False)}

    monkeypatch.setattr(ladder, "known", lying)
    search_ = found(objectives={"force_resolution_n": "minimise"})
    assert search_.largest > 1.5
    assert search_.margin > search_.largest
    assert not any(row.discarded == "dominated" for row in search_.rows if row.candidate.values["dielectric_mm"] == 0.4)


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"parameters": {"dielectric": [0.1]}}, UnknownName, "did you mean 'dielectric_mm'"),
        ({"parameters": {"dielectric_mm": {"from": 0.11, "to": 0.19}}}, BadInput, "no printable value of dielectric"),
        ({"parameters": {"dielectric_mm": {"from": 0.4, "to": 0.1}}}, BadInput, "from 0.4 to 0.1 is empty"),
        ({"objectives": {"capacitance": "maximise"}}, BadInput, "did you mean 'capacitance_pf'"),
        ({"objectives": {"hysteresis": "minimise"}}, BadInput, "no material file has the viscoelastic data"),
        ({"objectives": {"print_time_min": "minimise"}}, BadInput, "add slicer: prusa"),
        ({"limits": {"capacitance_pf": {"least": 9, "most": 1}}}, BadInput, "contradict"),
        (
            {"objectives": {"capacitance_pf": {"near": 50}}, "limits": {"capacitance_pf": {"most": 20}}}, BadInput,
            "contradicts its limit",
        ),
        ({"load": {"pressures_kpa": [5, 1]}}, OutOfRange, "pressures that rise"),
    ],
)  # fmt: skip
def test_a_bad_target_is_one_line(changes, error, words):
    def read():
        wanted = target(**changes)
        return wanted.query(), candidates(wanted)

    with pytest.raises(error) as said:
        read()
    assert words in str(said.value)
    assert "\n" not in str(said.value)


def test_a_huge_space_is_refused_with_its_size():
    parameters = {
        name: {"from": 0.1, "to": 10, "step": 0.01} for name in ("dielectric_mm", "electrode_mm", "length_mm")
    }
    with pytest.raises(BadInput, match=rf"9.73e\+08 designs; expected at most {MOST}"):
        candidates(target(parameters=parameters))


def test_the_example_of_the_page_is_a_target(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "optimise.md").read_text()
    (tmp_path / "sensor.yaml").write_text(page.partition("```yaml\n")[2].partition("```")[0])
    assert load(tmp_path / "sensor.yaml").query().force_n == 6.0
    assert load(Path(__file__).parents[2] / "bench" / "best-tri.yaml").refuse_warnings == ("2-film",)


def test_the_best_are_built_and_the_page_needs_nothing_else(tmp_path, run):
    (tmp_path / "plates.yaml").write_text(json.dumps(PLATES))
    said = run("optimise", "plates.yaml", "--no-gcode", "--jobs", "1")
    assert said.code == 0, said.err
    assert "no design in this space of 12 is better" in said.words
    for name in (
        "plates.html",
        "plates.json",
        "plates.csv",
        "plates-capacitance/design.json",
        "plates-capacitance.yaml",
    ):
        assert (tmp_path / "out" / name).exists(), name
    page = (tmp_path / "out" / "plates.html").read_text()
    assert "src=" not in page.partition("<script>")[0]
    assert "prefers-color-scheme: dark" in page
    assert len((tmp_path / "out" / "plates.csv").read_text().splitlines()) == 13
    assert load(tmp_path / "plates.yaml").objectives["capacitance_pf"] == "maximise"
    assert run("optimise", "nothing.yaml").code == 2
