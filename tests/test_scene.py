"""Scenes against closed forms, clipped periods and symmetries."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from sensorgen.design.shapes import rect, reference, tri
from sensorgen.scene.scene import PLANE, Body, Fill, Prism, Scene, area_mm2, box, clipped, rectangle

SUPPORTED = Fill(support="bvoh")


def volumes(scene: Scene) -> dict[str, float]:
    return {body.name: body.volume_mm3() for body in scene.bodies}


def total(scene: Scene) -> float:
    return sum(volumes(scene).values())


# Shares per period and mm depth: geometry.md, "tri". The top electrode and the film come on top of them.
@pytest.mark.parametrize("along", ["x", "y"])
@pytest.mark.parametrize("periods", [1, 3])
def test_tri_has_the_volume_shares_of_the_spec(along, periods):
    size = {"length_mm": 2.0 * periods, "width_mm": 7.0}
    if along == "y":
        size = {"length_mm": size["width_mm"], "width_mm": size["length_mm"]}
    got = volumes(tri.scene(tri.Params(**size, along=along, dielectric_mm=0.1), SUPPORTED))
    depth, floor = 7.0, 2.0 * periods * 7.0
    cells = periods * depth
    electrodes = {"bottom_electrode": 0.3 * floor, "top_electrode_with_cogs": 0.3 * floor + 0.25 * cells}
    between = {
        "film_and_lower": 0.1 * floor + 0.24 * cells,
        "support": 0.26 * cells,
        "hanging_dielectric": 0.25 * cells,
    }
    assert got == pytest.approx(electrodes | between, rel=1e-12)


# Volumes per mm2 of sensor: geometry.md, "Not everything fits".
@pytest.mark.parametrize("along", ["xy", "yx"])
def test_rect_has_the_volumes_of_the_spec(along):
    got = volumes(rect.scene(rect.Params(length_mm=8.0, width_mm=4.0, dielectric_mm=0.1, along=along), SUPPORTED))
    floor = 8.0 * 4.0
    assert got["top_electrode_with_cogs"] == pytest.approx((0.21 + 0.3) * floor, rel=1e-12)
    assert got["film_and_lower"] + got["hanging_dielectric"] == pytest.approx((0.21 + 0.1) * floor, rel=1e-12)
    assert got["support"] == pytest.approx(0.18 * floor, rel=1e-12)


def test_plate_is_three_plates():
    got = volumes(reference.scene(reference.Params(isolation_mm=0.1), Fill()))
    plates = {"bottom_electrode": 300.0, "dielectric": 600.0, "top_electrode": 300.0, "isolation": 100.0}
    assert got == pytest.approx(plates, rel=1e-12)


# By hand: the part of the default profile that lies left of a cut, in mm2 (tan gamma = 1, tan theta = 0.48).
# At 0.25 the cog's flank has come down to 0.25, and the half triangle on the film has fallen from 0.24 to 0.12.
@pytest.mark.parametrize(
    ("end", "cog", "hanging", "lower"),
    [
        (1.0, 0.25, 0.0, 0.12),
        (0.25 + 1.0, 0.25, 0.03125, 0.12 + (0.24 + 0.12) / 2 * 0.25),
        (0.5 + 1.0, 0.25, 0.125, 0.12 + 0.06),
        (2.0 + 0.25, 0.25 + 0.03125, 0.25, 0.24 + 0.045),
    ],
)
def test_a_partial_period_is_clipped_exactly(end, cog, hanging, lower):
    p = tri.Params(length_mm=end, width_mm=3.0, dielectric_mm=0.1)
    got = volumes(tri.scene(p, SUPPORTED))
    assert got["top_electrode_with_cogs"] == pytest.approx((cog + 0.3 * end) * 3.0, rel=1e-12)
    assert got.get("hanging_dielectric", 0.0) == pytest.approx(hanging * 3.0, rel=1e-12)
    assert got["film_and_lower"] == pytest.approx((lower + 0.1 * end) * 3.0, rel=1e-12)
    assert got["support"] == pytest.approx((0.5 * end - cog - hanging - lower) * 3.0, rel=1e-12)


@pytest.mark.parametrize(
    ("shape", "options"),
    [
        (tri, {}),
        (tri, {"length_mm": 7.13, "width_mm": 3.3, "along": "y", "isolation_mm": 0.1}),
        (tri, {"length_mm": 1.01, "dielectric_mm": 0.0}),
        (rect, {"length_mm": 7.13, "width_mm": 3.3, "isolation_mm": 0.1}),
        (reference, {"length_mm": 7.13}),
    ],
)
@pytest.mark.parametrize("film", ["x60", "pla"])
def test_support_fills_exactly_the_air(shape, options, film):
    scene = shape.scene(shape.Params(**options), Fill(support="bvoh", film=film))
    assert total(scene) == pytest.approx(np.prod(scene.size_mm), rel=1e-12)


@pytest.mark.parametrize("shape", [tri, rect, reference])
def test_upside_down_twice_is_as_drawn(shape):
    binary = {"electrode_mm": 0.25, "dielectric_mm": 0.125, "isolation_mm": 0.5}  # sums without rounding
    scene = shape.scene(shape.Params(length_mm=7.13, width_mm=3.3, **binary), SUPPORTED)
    assert scene.turned_over().turned_over() == scene
    assert volumes(scene.turned_over()) == pytest.approx(volumes(scene), rel=1e-12)


@pytest.mark.parametrize("axis", "xyz")
def test_half_a_turn_about_x_keeps_x_and_turns_y_and_z(axis):
    """A skew triangle, by its corners: no mirror image."""
    prism = Prism(axis, ((0.0, 0.0), (2.0, 0.0), (0.5, 1.0)), 3.0, 3.5)
    (turned,) = Scene((Body("skew", "x60", (prism,)),), (9.0, 8.0, 7.0)).turned_over().bodies[0].pieces

    def corners(p: Prism) -> set[tuple[float, ...]]:
        ends = (p.start_mm, p.end_mm)
        places = ({p.axis: at} | dict(zip(PLANE[p.axis], c, strict=True)) for c in p.outline for at in ends)
        return {tuple(place[a] for a in "xyz") for place in places}

    assert corners(turned) == {(x, 8.0 - y, 7.0 - z) for x, y, z in corners(prism)}
    assert area_mm2(turned.outline) == area_mm2(prism.outline)


def test_triy_is_trix_with_length_and_width_exchanged():
    along_x = tri.scene(tri.Params(length_mm=7.13, width_mm=3.3, along="x"), SUPPORTED)
    along_y = tri.scene(tri.Params(length_mm=3.3, width_mm=7.13, along="y"), SUPPORTED)
    for a, b in zip(along_x.bodies, along_y.bodies, strict=True):
        assert [replace(p, axis="x") for p in a.pieces] == list(b.pieces)


def test_sqyx_is_sqxy_with_length_and_width_exchanged():
    def boxes(scene: Scene, first: str, second: str) -> list[set]:
        return [{(p.span(first), p.span(second), p.span("z")) for p in body.pieces} for body in scene.bodies]

    xy = rect.scene(rect.Params(length_mm=7.13, width_mm=3.3, along="xy"), SUPPORTED)
    yx = rect.scene(rect.Params(length_mm=3.3, width_mm=7.13, along="yx"), SUPPORTED)
    assert boxes(xy, "x", "y") == boxes(yx, "y", "x")


@pytest.mark.parametrize("shape", [tri, rect, reference])
def test_stretching_enlarges_the_plane_only(shape):
    scene = shape.scene(shape.Params(length_mm=7.13, width_mm=3.3), Fill())
    larger = scene.stretched(1.25)
    assert larger.size_mm == pytest.approx((7.13 * 1.25, 3.3 * 1.25, scene.size_mm[2]))
    assert volumes(larger) == pytest.approx({name: v * 1.25**2 for name, v in volumes(scene).items()}, rel=1e-11)


TRIANGLE = ((0.0, 0.0), (2.0, 0.0), (1.0, 1.0))


# A triangle of base 2 and height 1, extruded from 3 to 5, cut by planes square to each axis.
@pytest.mark.parametrize(
    ("prism", "axis", "at", "expected"),
    [
        (Prism("y", TRIANGLE, 3, 5), "z", 0.25, [rectangle(0.25, 1.75, 3, 5)]),
        (Prism("y", TRIANGLE, 3, 5), "y", 4, [TRIANGLE]),
        (Prism("x", TRIANGLE, 3, 5), "z", 0.25, [rectangle(3, 5, 0.25, 1.75)]),
        (Prism("z", TRIANGLE, 3, 5), "y", 0.25, [rectangle(0.25, 1.75, 3, 5)]),
        (Prism("y", TRIANGLE, 3, 5), "z", 1.5, []),
        (Prism("y", TRIANGLE, 3, 5), "y", 2.9, []),
        (box(0, 1, 0, 2, 0, 3), "z", 0.5, [rectangle(0, 1, 0, 2)]),
    ],
)
def test_a_prism_is_cut_as_by_hand(prism, axis, at, expected):
    got = prism.cut(axis, at)
    assert len(got) == len(expected)
    for a, b in zip(got, expected, strict=True):
        assert np.array(a) == pytest.approx(np.array(b), abs=1e-15)


@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("along", "xyz")
def test_the_areas_of_the_cuts_integrate_to_the_volume(axis, along):
    """Cavalieri; areas are linear between corners, so Gauss' rule is exact there."""
    prism = Prism(along, ((0, 0), (4, 0), (3, 1), (2, 0.2), (1, 1)), 0.5, 2.0)
    ends = sorted({0.5, 2.0} if axis == along else {p[PLANE[along].index(axis)] for p in prism.outline})
    node = 0.5 / np.sqrt(3)
    got = 0.0
    for a, b in pairwise(ends):
        for at in ((a + b) / 2 - node * (b - a), (a + b) / 2 + node * (b - a)):
            got += (b - a) / 2 * sum(map(area_mm2, prism.cut(axis, at)))
    assert got == pytest.approx(prism.volume_mm3(), rel=1e-14)


@pytest.mark.parametrize("axis", "xyz")
def test_a_plane_through_a_shared_face_cuts_one_of_the_two(axis):
    """Else a slicer's sample on a face would see a hole through the whole sensor."""
    cubes = {"x": (box(0, 1, 0, 1, 0, 1), box(1, 2, 0, 1, 0, 1)), "y": (box(0, 1, 0, 1, 0, 1), box(0, 1, 1, 2, 0, 1))}
    below, above = cubes.get(axis, (box(0, 1, 0, 1, 0, 1), box(0, 1, 0, 1, 1, 2)))
    assert [below.cut(axis, 1.0), above.cut(axis, 1.0)] == [[], [rectangle(0, 1, 0, 1)]]


@pytest.mark.parametrize(("end", "area"), [(3.0, 1.0), (1.5, 0.875), (0.5, 0.125)])
def test_clipping_a_triangle_leaves_its_left_part(end, area):
    left = clipped(((0.0, 0.0), (2.0, 0.0), (1.0, 1.0)), end)
    assert area_mm2(left) == pytest.approx(area, rel=1e-12)


@pytest.mark.parametrize(("end", "left"), [(0.9e-6, False), (1.1e-6, True)])
def test_less_than_a_nanometre_is_no_geometry(end, left):
    assert bool(clipped(((0.0, 0.0), (2.0, 0.0), (1.0, 1.0)), end)) is left


@pytest.mark.parametrize("along", ["x", "y"])
def test_what_is_shorter_than_its_pattern_has_no_empty_bodies(along):
    """Half a period holds one cog, and no hanging dielectric."""
    scene = tri.scene(tri.Params(length_mm=1.0, width_mm=1.0, along=along), Fill())
    assert [b.name for b in scene.bodies] == ["bottom_electrode", "film_and_lower", "top_electrode_with_cogs"]


@pytest.mark.parametrize("axis", "xyz")
def test_an_outline_may_be_told_either_way_round(axis):
    way = ((0.0, 0.0), (2.0, 0.0), (0.5, 1.0))
    there, back = Prism(axis, way, 3.0, 3.5), Prism(axis, way[::-1], 3.0, 3.5)
    assert there.outline == back.outline == way
    assert there.volume_mm3() == back.volume_mm3() == 0.5
