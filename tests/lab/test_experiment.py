"""Experiment files: what is read, and what is refused before anything moves."""

import re
from itertools import pairwise

import pytest

from sensorgen.core.errors import SensorgenError
from sensorgen.core.records import checked
from sensorgen.measure.lab import experiment, run
from sensorgen.measure.signal.presses import GUARD_S, WINDOW_S

RANDOM = {"random": {"presses": 40, "seed": 3}}


def made(**changes):
    return checked(experiment.Experiment, {"specimen": "24 triX .2mm", "plan": [RANDOM]} | changes)


def test_the_template_passes_its_own_check(tmp_path, monkeypatch):
    from sensorgen.workflows.templates import new

    monkeypatch.chdir(tmp_path)
    new("experiment", "mine")
    plan = run.planned(experiment.read(tmp_path / "mine.yaml"))
    assert len(plan.steps) == 30
    assert plan.length_mm == 100


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"plan": [{"randon": {}}]}, r"unknown key of plan\.0 'randon'; did you mean 'random'"),
        ({"plan": [{"random": {"presses": 3, "seeed": 1, "seed": 1}}]}, "did you mean 'seed'"),
        ({"plan": [{"random": {"presses": 0, "seed": 1}}]}, r"plan\.0\.random\.presses is 0; expected 1 or more"),
        ({"plan": []}, "plan is.*expected at least one entry"),
        ({"plan": [{**RANDOM, "hold": {"position_mm": 5, "force_n": 1.0, "hold_s": 3}}]}, "a part of hold, random;"),
        ({"limits": {"force": 3.0}}, "did you mean 'force_n'"),
        ({"tip": "round"}, "tip is 'round'; expected 'flat' or 'soft'"),
        ({"devices": {"actuator": {"kind": "smac-lcc10"}}}, r"devices\.stage is missing"),
        ({"stop": {"presses": 1.5}}, r"stop\.presses is 1\.5; expected a whole number"),
        ({"specimen": ""}, "specimen is ''; expected at least 1 characters"),
    ],
)
def test_wrong_keys_and_values_are_named(changes, message):
    with pytest.raises(SensorgenError, match=message):
        made(**changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"tip": {"length_mm": 120.0}}, "tip: 120 mm is longer than the specimen, 100 mm"),
        ({"plan": [{"random": {"presses": 3, "seed": 1, "force_n": [1, 6.8]}}]}, r"plan\.0\.random\.force_n: 6\.8 N"),
        ({"plan": [{"random": {"presses": 3, "seed": 1, "force_n": [3, 2]}}]}, "numbers above 0 that rise"),
        ({"plan": [RANDOM, {"hold": {"position_mm": 99, "force_n": 2.0, "hold_s": 5}}]}, r"plan\.1\.hold\.position_mm"),
        ({"plan": [{"sine": {"position_mm": 50, "mean_n": 5.0, "amplitude_n": 3.0, "frequency_hz": 1}}]}, "mean_n \\+"),
        ({"plan": [{"sine": {"position_mm": 50, "mean_n": 2.0, "amplitude_n": 2.0, "frequency_hz": 1}}]}, "lifts the"),
        ({"plan": [{"hold": {"position_mm": 50, "force_n": 2.0, "hold_s": 1e5}}]}, r"takes about 27\.8 h"),
        ({"limits": {"places_mm": [1, 50]}}, r"limits\.places_mm: 1 to 50 mm; expected from 2\.5 to 97\.5 mm"),
        ({"limits": {"travel_mm": [0, 50]}}, r"limits\.travel_mm"),
        ({"approach": {"place_mm": 99}}, r"approach\.place_mm: 99 mm; expected 2\.5 to 97\.5 mm"),
        ({"approach": {"contact_n": 5.0}}, r"approach\.contact_n"),
        ({"specimen": "nonsense?"}, "specimen: "),
    ],
)
def test_cross_checks_before_anything_moves(changes, message):
    with pytest.raises(SensorgenError, match=message):
        run.planned(made(**changes))


def test_a_file_that_is_wrong_is_named(tmp_path):
    file = tmp_path / "e.yaml"
    file.write_text("specimen: a\nplan: [{random: {presses: x, seed: 1}}]\n")
    with pytest.raises(SensorgenError, match=re.escape(str(file)) + r".*plan\.0\.random\.presses is 'x'"):
        experiment.read(file)


def test_random_presses_are_seeded_inside_the_sensor_and_half_from_above():
    steps, again = (experiment.steps(made(), 100.0) for _ in range(2))
    assert steps == again
    assert sum(step.peak_n > step.force_n for step in steps) == 20
    assert all(2.5 <= step.place_mm <= 97.5 and 0.4 <= step.force_n <= step.peak_n <= 6 for step in steps)
    holds = [step.hold_s for step in steps]
    assert 0.3 <= min(holds) < 1 < 10 < max(holds) <= 30


def test_the_course_of_a_press_rises_over_its_peak_and_is_held_for_the_average():
    step = next(s for s in experiment.steps(made(), 100.0) if s.peak_n > s.force_n)
    course = [step.force_at(0.01 * k) for k in range(round(step.seconds * 100) + 1)]
    assert max(course) == pytest.approx(step.peak_n)
    assert course[-1] == step.force_n
    held = sum(abs(force - step.force_n) < 1e-9 for force in course) * 0.01
    assert held == pytest.approx(step.hold_s + WINDOW_S + GUARD_S, abs=0.05)
    assert max(abs(a - b) for a, b in pairwise(course)) <= 20 * 0.01 + 1e-9  # 20 N/s


def test_ramp_sine_and_sweep_have_the_forces_and_places_that_were_asked_for():
    plan = [
        {"ramp": {"position_mm": 20, "force_n": 4.0, "rate_n_s": 2.0, "repeats": 2}},
        {"sine": {"position_mm": 50, "mean_n": 3.0, "amplitude_n": 1.0, "frequency_hz": 0.5, "cycles": 4}},
        {"sweep": {"force_n": 2.0, "position_mm": [80, 20], "places": 4}},
    ]
    ramp, _, sine, *sweep = experiment.steps(made(plan=plan), 100.0)
    assert ramp.force_at(ramp.seconds / 2) == pytest.approx(4.0)
    assert ramp.seconds == pytest.approx(2 * 3.7 / 2)
    rise = (3.0 - 0.3) / 20
    assert [sine.force_at(rise + t) for t in (0.5, 1.5, 2.5)] == pytest.approx([4.0, 2.0, 4.0])
    assert [step.place_mm for step in sweep] == [80, 60, 40, 20]
