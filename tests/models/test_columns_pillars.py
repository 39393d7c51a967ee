"""Bounds of upright pillars of any outline: closed forms, a field solver, springs of the same boxes."""

from dataclasses import replace
from math import cos, pi, sin, tau

import pytest
from cell_scenes import close

from sensorgen.core.errors import BadInput
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import fem3d
from sensorgen.models.columns import capacitance, why_not_applicable
from sensorgen.models.springs import displacement_m
from sensorgen.scene.scene import Body, Outline, Prism, Scene, box

EPS = {"x60": 4.68, "air": 1.00059}
MM = 1e-3
FILM_MM, PILLAR_MM = 0.2, 0.5


def pillars(*outlines: Outline, size: tuple[float, float] = (2.0, 2.0)) -> Scene:
    """Pillars on a film between plates."""
    low, film, high = 0.3, 0.3 + FILM_MM, 0.3 + FILM_MM + PILLAR_MM
    return Scene(
        (
            Body("low", "etpu", (box(0, size[0], 0, size[1], 0, low),), "bottom"),
            Body("film", "x60", (box(0, size[0], 0, size[1], low, film),)),
            Body("pillar", "x60", tuple(Prism("z", outline, film, high) for outline in outlines)),
            Body("high", "etpu", (box(0, size[0], 0, size[1], high, high + 0.3),), "top"),
        ),
        (*size, high + 0.3),
    )


def square(half: float, at: tuple[float, float] = (1.0, 1.0)) -> Outline:
    x, y = at
    return ((x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half))


def with_one_corner_more(outline: Outline) -> Outline:
    """The same area, but no box any more."""
    a, b = outline[:2]
    return (a, ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2), *outline[1:])


def regular(corners: int, radius: float, turn: float = 0.0) -> Outline:
    angles = [turn + tau * k / corners for k in range(corners)]
    return tuple((1.0 + radius * cos(a), 1.0 + radius * sin(a)) for a in angles)


def by_share(share: float, area_mm2: float = 4.0) -> tuple[float, float]:
    """Bounds in closed form, by the share of the area that pillars stand on: columns, and levels in series [F]."""
    x60, air = EPS["x60"], EPS["air"]
    column = share / (FILM_MM / x60 + PILLAR_MM / x60) + (1 - share) / (FILM_MM / x60 + PILLAR_MM / air)
    level = 1 / (FILM_MM / x60 + PILLAR_MM / (share * x60 + (1 - share) * air))
    return EPS0_F_PER_M * area_mm2 * MM * column, EPS0_F_PER_M * area_mm2 * MM * level


@pytest.mark.parametrize("half", [0.2, 0.9])
def test_a_field_solver_of_boxes_lies_within_the_bounds_of_polygons(half):
    solved = fem3d.capacitance(pillars(square(half)), EPS, 1e-3)
    found = capacitance(pillars(with_one_corner_more(square(half))), EPS)
    assert solved.width() < 1e-3
    assert found.lower < solved.lower
    assert solved.upper < found.upper


@pytest.mark.parametrize(("corners", "turn"), [(3, 0.0), (64, 0.1)])
def test_pillars_have_the_bounds_of_their_share_of_the_area(corners, turn):
    found = capacitance(pillars(regular(corners, 0.8, turn)), EPS)
    share = corners / 2 * 0.8**2 * sin(tau / corners) / 4
    assert (found.lower, found.upper) == close(by_share(share), 1e-10)


def test_an_electrode_of_pillars_counts_from_its_lowest_place():
    """A foot of the upper electrode over half a film: columns in parallel, and the film alone below the foot."""
    scene = pillars(regular(8, 0.8))
    foot = replace(scene.body("pillar"), material="etpu", terminal="top")
    found = capacitance(replace(scene, bodies=tuple(foot if b.name == "pillar" else b for b in scene.bodies)), EPS)
    share = 4 * 0.8**2 * sin(pi / 4) / 4
    parallel = share / (FILM_MM / 4.68) + (1 - share) / (FILM_MM / 4.68 + PILLAR_MM / 1.00059)
    assert found.lower == close(EPS0_F_PER_M * 4 * MM * parallel, 1e-11)
    assert found.upper == close(EPS0_F_PER_M * 4 * MM * 4.68 / FILM_MM, 1e-11)


def test_a_step_of_the_lower_electrode_is_no_hindrance():
    """Nothing but air over a step: the upper bound is that of a plate at the step's height."""
    scene = pillars(square(0.5))
    step = Body("step", "etpu", (box(0.5, 1.5, 0.5, 1.5, 0.3, 0.7),), "bottom")
    stepped = replace(scene, bodies=(scene.body("low"), step, scene.body("high")))
    found, solved = capacitance(stepped, EPS), fem3d.capacitance(stepped, EPS, 1e-2)
    assert found.upper == close(EPS0_F_PER_M * 4 * MM * EPS["air"] / 0.3, 1e-11)
    assert found.lower == close(EPS0_F_PER_M * MM * EPS["air"] * (1 / 0.3 + 3 / 0.7), 1e-11)
    assert found.lower < solved.lower
    assert solved.upper < found.upper


@pytest.mark.parametrize(
    ("outlines", "reason"),
    [
        ((regular(8, 0.8), regular(5, 0.3)), "overlap in plan: pillar and pillar"),
        ((((0, 0), (2, 0), (1, 1), (2, 1.5)),), "crosses itself"),
        ((tuple((x + 1, y) for x, y in regular(8, 0.8)),), "does not cover"),
    ],
)
def test_what_is_no_plan_is_told(outlines, reason):
    assert reason in (why_not_applicable(pillars(*outlines)) or "")


def test_springs_of_pillars_give_way_by_what_stands():
    """Under p, film and pillars carry p A / (share A) at the pillars, and nothing between them."""
    moved = displacement_m(pillars(regular(8, 0.8)), {"x60": 6e6, "etpu": 12e6}, [0.0, 1e3])
    share = 4 * 0.8**2 * sin(pi / 4) / 4
    exact = 1e3 / share * (0.6 / 12e6 + (FILM_MM + PILLAR_MM) / 6e6) * MM
    assert moved.tolist() == close([0.0, exact], 1e-9)


def test_springs_of_a_box_told_as_a_polygon_are_the_same_springs():
    """From sections of two depths, and from the plan."""
    scenes = pillars(square(0.2)), pillars(with_one_corner_more(square(0.2)))
    boxes, told = (displacement_m(scene, {"x60": 6e6, "etpu": 12e6}, [1e2, 1e3]) for scene in scenes)
    assert told.tolist() == close(boxes.tolist(), 1e-12)


def test_springs_of_what_has_no_columns_say_so():
    wedge = Body("wedge", "x60", (Prism("y", ((0.0, 0.5), (0.2, 0.5), (0.1, 0.8)), 0.0, 2.0),))
    scene = pillars(regular(8, 0.8))
    with pytest.raises(BadInput, match="no springs of columns: wedge is slanted or curved in elevation"):
        displacement_m(replace(scene, bodies=(*scene.bodies, wedge)), {"x60": 6e6, "etpu": 12e6}, [1e3])
