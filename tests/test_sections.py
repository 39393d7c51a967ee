"""Sections and columns: together they are the scene."""

from itertools import combinations, pairwise

import numpy as np
import pytest

from sensorgen.design.shapes import rect, reference, tri
from sensorgen.scene.scene import Body, Fill, Prism, Scene, area_mm2, box
from sensorgen.scene.sections import alike, columns, sections

SCENES = {
    "tri": tri.scene(tri.Params(length_mm=7.13, width_mm=3.3), Fill(support="bvoh")),
    "tri along y": tri.scene(tri.Params(length_mm=3.3, width_mm=7.13, along="y", isolation_mm=0.1), Fill()),
    "tri upside down": tri.scene(tri.Params(length_mm=7.13, width_mm=3.3), Fill()).turned_over(),
    "rect": rect.scene(rect.Params(length_mm=7.13, width_mm=3.3), Fill(support="bvoh")),
    "rect, two films": rect.scene(rect.Params(length_mm=4.5, width_mm=5.9, along="yx"), Fill(film="pla")),
    "plate": reference.scene(reference.Params(length_mm=7.0), Fill()),
}


@pytest.fixture(params=SCENES)
def scene(request):
    return SCENES[request.param]


def test_areas_times_depths_are_the_volumes(scene):
    for body in scene.bodies:
        total = sum(s.depth_mm * area_mm2(o) for s in sections(scene) for b, o in s.regions if b.name == body.name)
        assert total == pytest.approx(body.volume_mm3(), rel=1e-12)


def test_layers_of_the_columns_are_the_volumes(scene):
    def area(column, layer) -> float:
        heights = [top - bottom for bottom, top in zip(layer.bottom_mm, layer.top_mm, strict=True)]
        return (column.right_mm - column.left_mm) * sum(heights) / 2

    for body in scene.bodies:
        parts = ((s, c, layer) for s in sections(scene) for c in columns(s) for layer in c.layers)
        total = sum(s.depth_mm * area(c, layer) for s, c, layer in parts if layer.body.name == body.name)
        assert total == pytest.approx(body.volume_mm3(), rel=1e-9)


def test_columns_cover_the_section_and_layers_do_not_overlap(scene):
    for section in sections(scene):
        cells = columns(section)
        size = scene.size_mm["xy".index(section.across)]
        assert (cells[0].left_mm, cells[-1].right_mm) == (0.0, size)
        assert all(a.right_mm == b.left_mm for a, b in pairwise(cells))
        for cell in cells:
            for low, high in pairwise(cell.layers):
                assert all(t <= b + 1e-12 for t, b in zip(low.top_mm, high.bottom_mm, strict=True))


@pytest.mark.parametrize(
    ("shape", "options", "depths"),
    [
        (reference, {}, [10.0]),
        (tri, {}, [10.0]),
        (tri, {"along": "y"}, [100.0]),
        # Five periods over the width of 10: through the conductor strips (0.7 each), air (0.3 twice), dielectric (0.7).
        (rect, {}, [3.5, 3.0, 3.5]),
    ],
)
def test_a_section_that_repeats_is_found_once_with_all_its_depth(shape, options, depths):
    found = sections(shape.scene(shape.Params(**options), Fill()))
    assert [s.depth_mm for s in found] == pytest.approx(depths, rel=1e-12)


def test_the_direction_with_fewer_sections_is_taken():
    """Strips along x look alike all along x, and differ across it."""
    strips = tuple(box(0, 4, y, y + 1, 0, 1) for y in (0.0, 2.0))
    (only,) = sections(Scene((Body("strips", "x60", strips),), (4, 3, 1)))
    assert (only.across, only.depth_mm) == ("y", 4.0)


def test_a_section_that_repeats_shows_the_prisms_of_its_own_place():
    """Every region is cut where its own prisms are: a mix of places once lost the later strips, and their volume."""
    scene = rect.scene(rect.Params(), Fill())
    for section in sections(scene):
        here = {(body.name, outline) for body, outline in section.regions}
        normal = "yx"["xy".index(section.across)]
        expected = {(body.name, o) for body in scene.bodies for p in body.pieces for o in p.cut(normal, section.at_mm)}
        assert here == expected


def _with(prism: Prism) -> Scene:
    return Scene((Body("odd", "x60", (prism, box(0, 1, 0, 1, 2, 3))),), (4, 4, 3))


SLANT = ((0.0, 0.0), (2.0, 0.0), (1.0, 1.0))


def test_an_outline_slanted_in_plan_has_no_constant_section():
    with pytest.raises(ValueError, match="constant cross-sections"):
        sections(_with(Prism("z", SLANT, 0, 1)))


def test_slants_both_ways_have_no_constant_section():
    ridges = (Body(axis, "x60", (Prism(axis, SLANT, 0, 4),)) for axis in "xy")
    both = Scene(tuple(ridges), (4, 4, 1))
    with pytest.raises(ValueError, match="constant cross-sections"):
        sections(both)


def test_columns_are_alike_that_are_as_wide_with_the_same_at_the_same_heights(scene):
    """Each pair compared, by what differs between them."""
    for section in sections(scene):
        for (a, first), (b, second) in combinations(zip(columns(section), alike(section), strict=True), 2):
            assert (first == second) == (difference(a, b) < 1e-9)


def difference(a, b) -> float:
    """Largest of their widths' and heights'; infinite where bodies differ."""
    if [layer.body.name for layer in a.layers] != [layer.body.name for layer in b.layers]:
        return np.inf
    sizes = [
        (c.right_mm - c.left_mm, *(v for layer in c.layers for v in (*layer.bottom_mm, *layer.top_mm))) for c in (a, b)
    ]
    return float(np.abs(np.subtract(*sizes)).max())


def test_a_long_sensor_has_no_more_looks_than_its_period():
    long, one = (sections(tri.scene(tri.Params(length_mm=x, width_mm=1.0), Fill()))[0] for x in (200.0, 2.0))
    assert len(set(alike(long))) == len(set(alike(one))) == len(columns(one)) == len(columns(long)) / 100
