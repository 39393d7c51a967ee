"""Who is asked, in which order, and what is told of it."""

import json
import math

import pytest

from sensorgen.core.document import to_json
from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.prediction.plan import Level, Plan, PlanCandidate, cheapest, run_until_within

RUNGS = (
    PlanCandidate("none", passed_over="it knows no gaps"),
    PlanCandidate("coarse", 0.1, 1.0),
    PlanCandidate("fine", 0.01, 5.0),
)


def level(allowed, *, candidates=RUNGS):
    return Level("compression", "|Z| off by", allowed, candidates, cheapest(candidates, allowed))


class Models:
    """Answers by name, an error where that is the answer; remembers who was asked."""

    def __init__(self, **answers):
        self.asked = []
        self.find = {name: lambda name=name, answer=answer: self._say(name, answer) for name, answer in answers.items()}

    def _say(self, name, answer):
        self.asked.append(name)
        if isinstance(answer, SensorgenError):
            raise answer
        return answer


@pytest.mark.parametrize(("allowed", "chosen"), [(0.5, "coarse"), (0.1, "coarse"), (0.05, "fine"), (1e-4, "fine")])
def test_the_first_that_should_do_is_chosen_or_the_one_that_should_come_nearest(allowed, chosen):
    assert level(allowed).chosen == chosen


def test_one_that_was_never_measured_is_tried_and_one_that_cannot_speak_is_not():
    assert cheapest((PlanCandidate("new"), *RUNGS), 1e-9) == "new"
    assert cheapest(RUNGS[:1], 1.0) == ""


def test_it_ends_with_the_first_that_is_near_enough():
    models = Models(coarse=0.08, fine=0.004)
    found, came = run_until_within(level(0.2), models.find, float)
    assert (found, models.asked, came.chosen) == (0.08, ["coarse"], "coarse")
    assert [c.width for c in came.candidates] == [None, 0.08, None]
    assert came.candidates[1].seconds >= 0


def test_an_expectation_that_does_not_hold_costs_one_more():
    models = Models(coarse=0.3, fine=0.004)
    found, came = run_until_within(level(0.2), models.find, float)
    assert (found, models.asked, came.chosen) == (0.004, ["coarse", "fine"], "fine")


def test_the_nearest_is_taken_where_none_is_near_enough():
    """Here the finer mesh does worse, as meshes may."""
    models = Models(coarse=0.02, fine=0.03)
    found, came = run_until_within(
        level(0.015, candidates=(*RUNGS[:2], PlanCandidate("fine", 0.2, 5.0))), models.find, float
    )
    assert (found, models.asked, came.chosen) == (0.02, ["coarse", "fine"], "coarse")


def test_coarser_ones_are_asked_where_finer_ones_fail():
    models = Models(coarse=0.08, fine=BadInput("does not converge"))
    found, came = run_until_within(level(0.05), models.find, float)
    assert (found, models.asked) == (0.08, ["fine", "coarse"])
    assert came.candidates[2].passed_over == "does not converge"


def test_coarser_ones_are_not_asked_where_a_finer_one_answers_though_not_near_enough():
    models = Models(coarse=0.08, fine=0.06)
    assert run_until_within(level(0.05), models.find, float)[0] == 0.06
    assert models.asked == ["fine"]


def test_what_is_just_near_enough_will_do():
    models = Models(coarse=0.2, fine=0.004)
    assert run_until_within(level(0.2), models.find, float)[0] == 0.2
    assert models.asked == ["coarse"]


def test_of_coarser_ones_the_finest_is_asked_first():
    models = Models(coarse=0.08, fine=0.06, finest=BadInput("does not converge"))
    candidates = (*RUNGS, PlanCandidate("finest", 0.001, 9.0))
    assert run_until_within(level(0.002, candidates=candidates), models.find, float)[0] == 0.06
    assert models.asked == ["finest", "fine"]


def test_what_the_last_one_said_is_raised_where_none_can_answer():
    models = Models(coarse=BadInput("no mesh"), fine=BadInput("no memory"))
    with pytest.raises(BadInput, match="no mesh"):
        run_until_within(level(0.05), models.find, float)


def test_an_unknown_error_is_null_in_json():
    candidates = (PlanCandidate("a", math.inf, 0.0, width=math.inf), PlanCandidate("b", 0.1, 1.0, width=0.2))
    data = json.loads(to_json(Plan(0.1, "C", (level(0.1, candidates=candidates),), math.inf)))
    assert data["width"] is None
    first, second = data["levels"][0]["candidates"]
    assert (first["expected_width"], first["width"]) == (None, None)
    assert (second["expected_width"], second["width"]) == (0.1, 0.2)
