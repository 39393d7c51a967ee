"""Who is asked, in which order, and what is told of it."""

import json
import math
from functools import partial

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


def ran(allowed, candidates=RUNGS, **answers):
    """Answer of a run, models in the order in which they were asked, and the level; errors are raised."""
    asked = []

    def find(name):
        asked.append(name)
        if isinstance(answers[name], SensorgenError):
            raise answers[name]
        return answers[name]

    found, came = run_until_within(
        level(allowed, candidates=candidates), {name: partial(find, name) for name in answers}, float
    )
    return found, asked, came


@pytest.mark.parametrize(("allowed", "chosen"), [(0.1, "coarse"), (0.05, "fine"), (1e-4, "fine")])
def test_the_first_that_should_do_is_chosen_or_the_one_that_should_come_nearest(allowed, chosen):
    assert level(allowed).chosen == chosen


def test_one_that_was_never_measured_is_tried_and_one_that_cannot_speak_is_not():
    assert cheapest((PlanCandidate("new"), *RUNGS), 1e-9) == "new"
    assert cheapest(RUNGS[:1], 1.0) == ""


FAILS = BadInput("does not converge")


@pytest.mark.parametrize(
    ("allowed", "answers", "found", "asked"),
    [
        (0.2, {"coarse": 0.2, "fine": 0.004}, 0.2, ["coarse"]),  # just accurate enough
        (0.2, {"coarse": 0.3, "fine": 0.004}, 0.004, ["coarse", "fine"]),  # an expectation that does not hold
        (0.05, {"coarse": 0.08, "fine": FAILS}, 0.08, ["fine", "coarse"]),
        (0.05, {"coarse": 0.08, "fine": 0.06}, 0.06, ["fine"]),  # not accurate enough; coarser models are left out
    ],
)
def test_which_are_asked_and_which_answers(allowed, answers, found, asked):
    known, order, came = ran(allowed, **answers)
    assert (known, order) == (found, asked)
    assert [c.width for c in came.candidates if c.model == came.chosen] == [found]
    assert [c.passed_over for c in came.candidates if c.model in answers and answers[c.model] is FAILS] in (
        [], ["does not converge"],
    )  # fmt: skip


def test_the_nearest_is_taken_where_none_is_near_enough():
    """Here the finer mesh does worse, as meshes may."""
    found, asked, came = ran(0.015, (*RUNGS[:2], PlanCandidate("fine", 0.2, 5.0)), coarse=0.02, fine=0.03)
    assert (found, asked, came.chosen) == (0.02, ["coarse", "fine"], "coarse")


def test_of_coarser_ones_the_finest_is_asked_first():
    candidates = (*RUNGS, PlanCandidate("finest", 0.001, 9.0))
    assert ran(0.002, candidates, coarse=0.08, fine=0.06, finest=FAILS)[:2] == (0.06, ["finest", "fine"])


def test_what_the_last_one_said_is_raised_where_none_can_answer():
    with pytest.raises(BadInput, match="no mesh"):
        ran(0.05, coarse=BadInput("no mesh"), fine=BadInput("no memory"))


def test_an_unknown_error_is_null_in_json():
    candidates = (PlanCandidate("a", math.inf, 0.0, width=math.inf), PlanCandidate("b", 0.1, 1.0, width=0.2))
    data = json.loads(to_json(Plan(0.1, "C", (level(0.1, candidates=candidates),), math.inf)))
    assert data["width"] is None
    first, second = data["levels"][0]["candidates"]
    assert (first["expected_width"], first["width"]) == (None, None)
    assert (second["expected_width"], second["width"]) == (0.1, 0.2)
