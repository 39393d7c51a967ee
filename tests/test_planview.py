"""Pieces of the plan against another polygon library, closed forms and symmetries."""

from dataclasses import replace
from math import cos, pi, sin, tau

import numpy as np
import pytest
import shapely
from manifold3d import CrossSection, FillRule

from sensorgen.scene.layers import inside, overlay_parts
from sensorgen.scene.scene import Body, Outline, Prism, Scene, area_mm2, box, rectangle, rounded

SIZE = (4.0, 3.0)


def regular(corners: int, radius: float, at: tuple[float, float] = (2.0, 1.5), turn: float = 0.0) -> Outline:
    """A regular polygon, by the radius of its corners."""
    angles = [turn + tau * k / corners for k in range(corners)]
    return tuple((rounded(at[0] + radius * cos(a)), rounded(at[1] + radius * sin(a))) for a in angles)


def upright(name: str, outline: Outline, low: float, high: float) -> Body:
    return Body(name, name, (Prism("z", outline, low, high),))


def floor(size: tuple[float, float] = SIZE) -> Body:
    return Body("floor", "etpu", (box(0, size[0], 0, size[1], 0, 0.3),), "bottom")


def scene(*bodies: Body, size: tuple[float, float] = SIZE) -> Scene:
    return Scene((floor(size), *bodies), (*size, 2.0))


def areas(found: Scene) -> dict[tuple[str, ...], float]:
    """Area by the names of what lies there, from bottom to top [mm2]."""
    (part,) = overlay_parts(found)
    named = {tuple(layer.body.name for layer in c.layers): c.right_mm - c.left_mm for c in part.columns}
    assert len(named) == len(part.columns)
    assert part.depth_mm == 1.0
    return named


def random_outline(seed: int) -> Outline:
    """A star of up to ten corners, some of it beyond the middle of the plan, never beyond the sensor."""
    rng = np.random.default_rng(seed)
    corners = int(rng.integers(3, 11))
    angles = np.sort(rng.uniform(0, tau, corners))
    radii, (x, y) = rng.uniform(0.2, 1.2, corners), rng.uniform((1.5, 1.3), (2.5, 1.7))
    points = tuple((rounded(x + r * cos(a)), rounded(y + r * sin(a))) for r, a in zip(radii, angles, strict=True))
    return points if area_mm2(points) > 0 else points[::-1]


def library(outline: Outline) -> CrossSection:
    return CrossSection([outline], FillRule.Positive)


@pytest.mark.parametrize("seed", range(12))
def test_three_outlines_over_each_other_are_cut_as_another_library_cuts_them(seed):
    """Seven pieces and the rest; the library rounds coordinates to 1e-8 mm."""
    a, b, c = (random_outline(3 * seed + k) for k in range(3))
    found = areas(scene(upright("a", a, 0.3, 0.5), upright("b", b, 0.5, 0.9), upright("c", c, 0.9, 1.0)))
    ra, rb, rc = map(library, (a, b, c))
    expected = {
        "a": ra - rb - rc, "b": rb - ra - rc, "c": rc - ra - rb, "ab": (ra ^ rb) - rc, "ac": (ra ^ rc) - rb,
        "bc": (rb ^ rc) - ra, "abc": ra ^ rb ^ rc,
    }  # fmt: skip
    for names, shape in expected.items():
        assert found.pop(("floor", *names), 0.0) == pytest.approx(shape.area(), abs=2e-7)
    assert found[("floor",)] == pytest.approx(SIZE[0] * SIZE[1] - (ra + rb + rc).area(), abs=2e-7)


@pytest.mark.parametrize(("corners", "turn"), [(3, 0.0), (5, 0.1), (100, pi / 8)])
def test_a_regular_polygon_has_its_area_whichever_way_it_is_turned(corners, turn):
    found = areas(scene(upright("pillar", regular(corners, 1.0, turn=turn), 0.3, 1.0)))
    exact = corners / 2 * sin(tau / corners)
    assert found["floor", "pillar"] == pytest.approx(exact, rel=1e-10)
    assert found["floor",] == pytest.approx(12.0 - exact, rel=1e-10)


def test_two_squares_one_turned_by_an_eighth_share_an_octagon():
    """Of a square of side 2 and the same turned by 45 degrees: 8 (sqrt 2 - 1)."""
    square, diamond = rectangle(1.0, 3.0, 0.5, 2.5), regular(4, 2**0.5)
    found = areas(scene(upright("square", square, 0.3, 0.5), upright("diamond", diamond, 0.5, 1.0)))
    exact = 8 * (2**0.5 - 1)
    assert found["floor", "square", "diamond"] == pytest.approx(exact, rel=1e-11)
    assert found["floor", "square"] == pytest.approx(4 - exact, rel=1e-10)
    assert found["floor", "diamond"] == pytest.approx(4 - exact, rel=1e-10)


def test_prisms_of_one_body_at_one_height_are_one_piece():
    spots = [(x, y) for x in (0.5, 1.5, 2.5) for y in (0.5, 2.0)]
    pillars = Body("pillar", "x60", tuple(Prism("z", regular(8, 0.3, at), 0.3, 1.0) for at in spots))
    assert areas(scene(pillars))["floor", "pillar"] == pytest.approx(6 * 4 * 0.09 * sin(pi / 4), rel=1e-11)


def test_outlines_that_share_edges_leave_nothing_between_them():
    left = ((0.0, 0.0), (2.0, 0.0), (1.3, 3.0), (0.0, 3.0))
    right = ((2.0, 0.0), (4.0, 0.0), (4.0, 3.0), (1.3, 3.0))
    found = areas(scene(upright("left", left, 0.3, 1.0), upright("right", right, 0.3, 1.0)))
    assert set(found) == {("floor", "left"), ("floor", "right")}
    assert sum(found.values()) == pytest.approx(12.0, rel=1e-12)


def test_what_lies_beyond_the_sensor_or_under_nothing_is_told():
    amid, beyond = (
        upright(n, regular(8, 0.5, at), 0.3, 1.0) for n, at in (("pillar", (4.0, 1.5)), ("far", (2.0, 4.0)))
    )
    (part,) = overlay_parts(replace(scene(amid, beyond), size_mm=(5.0, 3.0, 2.0)))
    looks = {tuple(layer.body.name for layer in c.layers): c.right_mm for c in part.columns}
    assert looks["pillar",] == pytest.approx(looks["floor", "pillar"], rel=1e-10)
    assert looks[()] == pytest.approx(3.0 - looks["pillar",], rel=1e-10)


WEDGE = Prism("y", ((0.0, 0.3), (1.0, 0.3), (0.5, 0.8)), 0.0, 3.0)


@pytest.mark.parametrize(
    ("bodies", "said"),
    [
        ([upright("a", regular(8, 1.0), 0.3, 1.0), upright("b", regular(8, 0.5), 0.9, 1.2)], "a and b at z = 0.9"),
        ([Body("a", "x60", tuple(Prism("z", regular(5, 0.5, (x, 1.0)), 0.3, 1.0) for x in (1.0, 1.5)))], "a and a"),
        ([upright("a", ((0, 0), (3, 0), (1, 1), (3, 1.5)), 0.3, 1.0)], "a crosses itself: Self-intersection"),
        ([upright("a", regular(8, 1.0), 0.3, 1.0), Body("wedge", "x60", (WEDGE,))], "wedge is slanted or curved"),
    ],
)
def test_what_has_no_plan_is_refused(bodies, said):
    with pytest.raises(ValueError, match=said):
        overlay_parts(scene(*bodies))


def test_places_of_a_grid_are_inside_as_shapely_says_of_each():
    random = np.random.default_rng(5)
    discs = [shapely.Point(*at).buffer(r, quad_segs=3) for *at, r in random.uniform(0, [10, 5, 0.8], (80, 3))]
    region = shapely.union_all(discs[:40]) - shapely.union_all(discs[40:])
    x, y = np.sort(random.uniform(-1, 11, 90)), np.sort(random.uniform(-1, 6, 60))
    expected = shapely.contains_xy(region, *np.meshgrid(x, y, indexing="ij"))
    assert np.array_equal(inside(region, x, y), expected)
    assert 0.05 < expected.mean() < 0.95
    assert not inside(shapely.Polygon(), x, y).any()
