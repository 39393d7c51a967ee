"""The plan of a run: random, the same for the same seed, within its limits."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from sensorgen.core.document import comma_separated
from sensorgen.core.errors import OutOfRange
from sensorgen.measure.signal.presses import RunPlan

PLAN = RunPlan(7, 400, (0.0, 6.0), (5.0, 95.0), 4.0, 6.0, repeats=1)


def test_forces_and_positions_are_even_within_limits_and_independent():
    steps = PLAN.steps()[:400]
    force, at = np.array([s.force_n for s in steps]), np.array([s.position_mm for s in steps])
    assert stats.kstest(force / 6, "uniform").pvalue > 0.01
    assert stats.kstest((at - 5) / 90, "uniform").pvalue > 0.01
    assert abs(stats.spearmanr(force, at).statistic) < 0.15
    assert abs(stats.spearmanr(force, np.arange(400)).statistic) < 0.15  # drift is no force
    assert abs(stats.spearmanr(at, np.arange(400)).statistic) < 0.15
    assert 0 <= force.min() < 0.1
    assert 5.9 < force.max() <= 6
    assert 5 <= at.min() < at.max() <= 95


def test_times_follow_and_every_point_comes_back_once():
    steps = PLAN.steps()
    assert steps[0].start_s == 6
    np.testing.assert_allclose(np.diff([s.start_s for s in steps]), 10)
    assert PLAN.seconds() == 6 + 800 * 10
    assert sorted(s.point for s in steps) == sorted([*range(1, 401)] * 2)
    assert [s.press for s in steps] == list(range(1, 801))
    by_point = {}
    for s in steps:
        by_point.setdefault(s.point, set()).add((s.force_n, s.position_mm))
    assert all(len(where) == 1 for where in by_point.values())
    assert [s.point for s in steps[:400]] != [s.point for s in steps[400:]]
    assert steps == PLAN.steps()
    assert replace(PLAN, seed=8).steps()[0] != steps[0]


def test_csv_says_all_of_it():
    rows = list(csv.DictReader(io.StringIO(comma_separated(next(PLAN.document())))))
    assert [{k: float(v) for k, v in row.items()} for row in rows] == [vars(s) for s in PLAN.steps()]


@pytest.mark.parametrize(
    "change",
    [
        {"presses": 0}, {"presses": 60_000, "repeats": 1}, {"repeats": -1}, {"force_n": (3.0, 1.0)}, {"dwell_s": 0.0},
        {"force_n": (-1.0, 1.0)}, {"position_mm": (0.0, np.inf)}, {"rest_s": -1.0}, {"dwell_s": np.nan},
    ],
)  # fmt: skip
def test_what_no_rig_can_run_is_refused(change):
    with pytest.raises(OutOfRange, match="expected"):
        replace(PLAN, **change)
