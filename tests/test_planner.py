"""The planner: which model is asked, on what grounds, and what is kept."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from sensorgen import models as model_files
from sensorgen.core import cache
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import OutOfRange, UnknownName
from sensorgen.design.design import make
from sensorgen.prediction import capacitance as planner
from sensorgen.prediction.capacitance import Contradiction, Unpredictable, capacitance
from sensorgen.scene.scene import Body, Prism, Scene, box
from sensorgen.solvers.electrostatics.bounds import CrossedBounds, Unsolved

pytestmark = pytest.mark.own_cache

EPS = {"x60": 4.68, "air": 1.00059}
LOW = Body("low", "etpu", (box(0, 10, 0, 1, 0, 0.3),), "bottom")
HIGH = Body("high", "etpu", (box(0, 10, 0, 1, 0.9, 1.2),), "top")
PLATE = Scene((LOW, Body("film", "x60", (box(0, 10, 0, 1, 0.3, 0.9),)), HIGH), (10, 1, 1.2))


def is_known(*question):
    """Whether an answer is stored."""
    try:
        with cache.only_known():
            return capacitance(*question).known
    except cache.Unknown:
        return False


class Fake:
    """Models that note what they are asked; ``width`` is what they give, or a function of what is wanted."""

    def __init__(self, monkeypatch):
        self.models, self.expected, self.asked = {}, {}, []
        monkeypatch.setattr(planner, "capacitance_models", lambda: dict(self.models))
        monkeypatch.setattr(planner, "measured", lambda: self.expected)

    def add(self, name, cost, width, *points, why_not_applicable=None, middle=1.0):
        def work(scene, permittivity, wanted=None):
            self.asked.append((name, wanted))
            apart = (1 - 1e-9) * (width(wanted) if callable(width) else width)
            return Interval(middle - apart / 2, middle + apart / 2)

        model = SimpleNamespace(COST=cost, why_not_applicable=lambda scene: why_not_applicable, capacitance=work)
        if cost > 1:
            model.WIDTH = 1e-3
        self.models[name] = model
        if points:
            self.expected[name] = planner.MeasuredCost("plate", "bands", 3, 1.0, list(points))

    @property
    def names(self):
        return [name for name, _ in self.asked]


@pytest.fixture
def fake(monkeypatch):
    return Fake(monkeypatch)


def ladder(fake, **changes):
    """A cheap model, and two dear ones that do as they are expected to."""
    fake.add("cheap", 1, changes.get("cheap", 0.4), (0.4, 1e-3))
    fake.add("mid", 2, changes.get("mid", lambda w: max(w, 1e-8)), (1e-2, 0.1), (1e-4, 0.2), (1e-8, 1.0))
    fake.add("dear", 3, changes.get("dear", lambda w: max(w, 1e-4)), (1e-2, 5.0), (1e-4, 60.0))


@pytest.mark.parametrize(
    ("width", "asked", "taken"),
    [
        (0.4, ["cheap"], "cheap"),
        (0.399, ["cheap", "mid"], "mid"),
        (1e-9, ["cheap", "mid"], "mid"),  # dear is not expected to come near what mid reached
    ],
)
def test_the_cheapest_that_will_do(fake, width, asked, taken):
    ladder(fake)
    found = capacitance(PLATE, EPS, width)
    assert (fake.names, found.model) == (asked, taken)
    assert found.reached() == (width > 1e-9)
    assert [w for name, w in fake.asked if name == "mid"] == [width] * (len(asked) - 1)


def test_a_model_that_falls_short_is_followed_by_the_next(fake):
    ladder(fake, mid=0.1)
    found = capacitance(PLATE, EPS, 1e-4)
    assert fake.names == ["cheap", "mid", "dear"]
    assert (found.model, found.reached()) == ("dear", True)
    assert [c.width for c in found.plan] == pytest.approx([0.4, 0.1, 1e-4])
    assert found.seconds() == pytest.approx(sum(c.seconds for c in found.plan))


def test_a_dear_model_that_should_do_comes_before_one_that_should_not(fake):
    fake.add("weak", 2, 1e-2, (1e-2, 0.1))
    fake.add("strong", 3, 1e-6, (1e-6, 9.0))
    assert capacitance(PLATE, EPS, 1e-5).model == "strong"
    assert fake.names == ["strong"]
    fake.asked.clear()
    assert capacitance(PLATE, EPS, 1e-8).model == "strong"  # neither should: the nearest first, the other is no use
    assert fake.names == ["strong"]


def test_a_model_that_should_come_no_nearer_is_passed_over(fake):
    fake.add("cheap", 1, 0.4)
    fake.add("as near", 2, 0.1, (0.4, 0.1))
    found = capacitance(PLATE, EPS, 1e-3)
    assert fake.names == ["cheap"]
    assert found.plan[1].passed_over == "not expected to come nearer than 0.4"


def test_what_is_expected_is_the_quickest_measurement_that_does(fake):
    ladder(fake)
    plan = {c.model: c for c in planner.weighed(PLATE, 1e-3)}
    assert (plan["mid"].expected_width, plan["mid"].expected_seconds) == (1e-4, 0.2)
    assert (plan["dear"].expected_width, plan["dear"].expected_seconds) == (1e-4, 60.0)
    assert (plan["cheap"].expected_width, plan["cheap"].expected_seconds) == (0.4, 1e-3)
    assert [c.model for c in planner.weighed(PLATE, 1e-6)] == ["cheap", "mid", "dear"]
    assert {c.model: c for c in planner.weighed(PLATE, 1e-6)}["dear"].expected_width == 1e-4


def test_refusals_are_told_and_others_answer(fake):
    ladder(fake)
    fake.models["mid"].why_not_applicable = lambda scene: "it is not installed"
    found = capacitance(PLATE, EPS, 1e-2)
    assert (found.model, found.refused) == ("dear", ("mid: it is not installed",))
    assert {c.model: c.passed_over for c in found.plan}["mid"] == "it is not installed"


def test_nobody_can_speak(fake):
    fake.add("one", 1, 0.1, why_not_applicable="too round")
    fake.add("two", 2, 0.1, why_not_applicable="too flat")
    with pytest.raises(Unpredictable, match=r"^one: too round; two: too flat$"):
        capacitance(PLATE, EPS, 1e-3)
    fake.add("three", 2, 0.1, why_not_applicable="too round")
    with pytest.raises(Unpredictable, match=r"^one, three: too round; two: too flat$"):
        capacitance(PLATE, EPS, 1e-3)


def test_a_model_by_name(fake):
    ladder(fake)
    found = capacitance(PLATE, EPS, 1e-9, "dear")
    assert (fake.names, found.model, found.reached()) == (["dear"], "dear", False)
    with pytest.raises(UnknownName, match="model of capacitance 'deer'; did you mean 'dear'"):
        capacitance(PLATE, EPS, 1e-3, "deer")
    fake.models["dear"].why_not_applicable = lambda scene: "too round"
    with pytest.raises(Unpredictable, match=r"^dear: too round$"):
        capacitance(PLATE, EPS, 1e-3, "dear")


def test_bounds_that_exclude_each_other_stop(fake):
    fake.add("cheap", 1, 0.4)
    fake.add("wrong", 2, 1e-6, middle=1.3)
    with pytest.raises(Contradiction, match=r"wrong says at least 1.2999995 F, cheap at most 1.2 F"):
        capacitance(PLATE, EPS, 1e-3)


def test_accuracies_that_mean_nothing():
    with pytest.raises(OutOfRange, match="expected a number above 0"):
        capacitance(PLATE, EPS, float("nan"))


def test_known_answers(fake):
    ladder(fake)
    first = capacitance(PLATE, EPS, 1e-4)
    assert not first.known
    assert is_known(PLATE, EPS, 1e-4)
    again = capacitance(PLATE, EPS, 1e-4)
    assert fake.names == ["cheap", "mid"]
    assert again == replace(first, known=True)


def test_what_makes_a_question_another_one(fake):
    ladder(fake)
    capacitance(PLATE, EPS, 1e-4)
    thicker = replace(PLATE, size_mm=(10, 1, 1.3))
    body = replace(PLATE.bodies[1], pieces=(box(0, 10, 0, 1, 0.3, 0.9 + 1e-9),))
    moved = replace(PLATE, bodies=(PLATE.bodies[0], body, PLATE.bodies[2]))
    swapped = replace(PLATE, bodies=(*PLATE.bodies[:2], replace(PLATE.bodies[2], terminal="")))
    others = [
        (thicker, EPS, 1e-4), (moved, EPS, 1e-4), (swapped, EPS, 1e-4), (PLATE, EPS | {"x60": 4.69}, 1e-4),
        (PLATE, EPS, 1e-5), (PLATE, EPS, 1e-4, "mid"),
    ]  # fmt: skip
    assert not any(is_known(*other) for other in others)


def test_any_width_and_no_cache_keep_nothing(fake):
    ladder(fake)
    capacitance(PLATE, EPS)
    capacitance(PLATE, EPS, 1e-2, keep=False)
    assert not is_known(PLATE, EPS, float("inf"))
    assert not is_known(PLATE, EPS, 1e-2)


BOWTIE = ((0, 0.3), (10, 0.3), (2, 0.6), (10, 0.9))


@pytest.mark.parametrize(
    ("prisms", "named"),
    [
        ([(box(0, 10, 0, 1, 0.3, 0.9),), (box(4, 5, 0, 1, 0.5, 0.6),)], "film1 and film0"),
        ([(box(0, 10, 0, 1, 0.2, 0.9),)], "low and film0"),
        ([(Prism("y", BOWTIE, 0, 1),)], "film0"),
    ],
)
def test_overlapping_outlines_are_refused_before_any_model(fake, prisms, named):
    ladder(fake)
    films = [Body(f"film{k}", "x60", p) for k, p in enumerate(prisms)]
    scene = replace(PLATE, bodies=(PLATE.bodies[0], *films, PLATE.bodies[2]))
    with pytest.raises(Unpredictable, match=f"outlines overlap near x = .* mm: {named}; expected each place"):
        capacitance(scene, EPS)
    assert fake.asked == []


def test_bodies_that_only_touch_do_not_overlap():
    for shape in ("tri", "rect", "reference", "double"):
        assert planner.overlap(make({"shape": shape}).in_use) is None


def test_expectations_are_of_models_that_exist_and_fall():
    found = planner.measured()
    assert set(found) <= set(model_files.names())
    for entry in found.values():
        widths, seconds = zip(*entry.points, strict=True)
        assert list(widths) == sorted(widths, reverse=True)
        assert list(seconds) == sorted(seconds)
        assert min(seconds) > 0
        shape, film = entry.scene.removesuffix(" mm").split(", ")
        scene = make({"shape": shape, "parameters": {"dielectric_mm": float(film)}}).in_use
        assert entry.parts == planner.COUNTED[entry.counted](scene).parts


def test_time_grows_with_the_parts_of_a_cell(fake):
    """A plate of two layers has four bands in its cell, one of one layer three; however long it is."""
    ladder(fake)
    halves = [Body(f"f{k}", m, (box(0, 10, 0, 1, 0.3 + 0.3 * k, 0.6 + 0.3 * k),)) for k, m in enumerate(("x60", "y"))]
    layers = replace(PLATE, bodies=(PLATE.bodies[0], *halves, PLATE.bodies[2]))
    assert planner.expected("mid", PLATE, 1e-3) == (1e-4, 0.2)
    assert planner.expected("mid", layers, 1e-3) == (1e-4, pytest.approx(0.2 * 4 / 3))
    one, many = (make({"shape": "tri", "parameters": {"length_mm": length}}).in_use for length in (2.0, 100.0))
    assert planner.expected("mid", one, 1e-3) == planner.expected("mid", many, 1e-3)
    assert planner.expected("other", PLATE, 1e-3) == (None, None)
    strips = make({"shape": "rect"}).in_use  # no bands: three cross-sections
    fake.expected["boxed"] = planner.MeasuredCost("rect", "boxes", 21, 2.0, [(1e-3, 1.0)])
    assert planner.expected("boxed", strips, 1e-3) == (1e-3, 1.0)
    shorted = make({"shape": "rect", "parameters": {"dielectric_mm": 0.0}}).in_use
    assert planner.expected("boxed", shorted, 1e-3) == (1e-3, 1.0)


def test_a_sensor_that_is_cut_amid_a_cell_needs_twice_the_digits(fake):
    ladder(fake)
    cut = make({"shape": "tri", "parameters": {"length_mm": 7.3}}).in_use
    width, _ = planner.expected("mid", cut, 1e-3)
    assert width == pytest.approx(1e-4)  # the root of 1e-8
    assert planner.expected("mid", cut, 1e-5)[0] == pytest.approx(1e-4)  # no more


@pytest.fixture
def failing(fake):
    """A cheap model that is not near enough, and a nearer one that raises."""

    def raising(error):
        def fails(scene, permittivity, width):
            raise error("too slender")

        fake.add("cheap", 1, 0.4)
        fake.add("weak", 2, 1e-6)
        fake.models["weak"].capacitance = fails

    return raising


def test_a_solver_that_fails_on_a_scene_leaves_it_to_the_others(failing):
    failing(Unsolved)
    found = capacitance(PLATE, EPS, 1e-3)
    assert (found.model, found.reached()) == ("cheap", False)
    assert found.refused == ("weak: too slender",)
    assert is_known(PLATE, EPS, 1e-3)


def test_bounds_that_cross_stop_everything(failing):
    failing(CrossedBounds)
    with pytest.raises(CrossedBounds):
        capacitance(PLATE, EPS, 1e-3)
    assert not is_known(PLATE, EPS, 1e-3)
