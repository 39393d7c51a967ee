"""Rules 3 and 4 at their limits: faces on layer boundaries, and parts that no sample meets. Layers of 0.1 mm."""

import pytest

from sensorgen.design.shapes import tri
from sensorgen.scene.scene import Body, Fill, Prism, box

HAIR = 1e-6


def patch(z0: float, z1: float, *more: tuple[float, float]) -> Body:
    """Boxes of 5 x 5 mm on top of the sensor, which ends at 1.2 mm."""
    return Body("patch", "pla", tuple(box(5, 10, 5, 10, a, b) for a, b in ((z0, z1), *more)))


@pytest.mark.parametrize(
    ("top_mm", "off"), [(1.5 - HAIR, True), (1.5 - 5e-10, False), (1.5, False), (1.5 + HAIR, True)]
)
def test_a_face_off_the_grid_is_a_warning(sensor, findings, top_mm, off):
    found = findings(sensor(patch(1.2, top_mm)), "3-", "patch")
    assert [f.severity for f in found] == ["warning"] * off
    if off:
        assert (found[0].value_mm, found[0].limit_mm) == (pytest.approx(top_mm), 1.5)
        assert found[0].place_mm[2] == pytest.approx(top_mm)
        assert "1.5" in found[0].advice


# Faces come out at the boundary after the last sample below them.
@pytest.mark.parametrize(("top_mm", "printed_mm"), [(1.54, 0.3), (1.56, 0.4)])
def test_the_printed_thickness_is_told(sensor, findings, top_mm, printed_mm):
    (found,) = findings(sensor(patch(1.2, top_mm)), "3-", "patch")
    assert f"prints {printed_mm:g} mm thick instead of {top_mm - 1.2:g}" in found.message


def test_the_grid_starts_with_the_first_layer(sensor, findings, fine):
    thick_first = fine.model_copy(update={"first_layer_mm": 0.25})
    assert findings(sensor(), "3-") == []
    found = findings(sensor(), "3-", quality=thick_first)
    assert {f.body for f in found} == {"low", "film", "high"}
    assert findings(sensor(bottom_mm=0.35), "3-", quality=thick_first) == []


def test_triangles_of_0_24_print_as_0_20(findings):
    """Measured (files-and-slicers.md): film and triangles together."""
    scene = tri.scene(tri.Params(length_mm=8.0, width_mm=4.0, dielectric_mm=0.1), Fill())
    (found,) = findings(scene, "3-", "film_and_lower")
    assert "prints 0.3 mm thick instead of 0.34" in found.message


# Samples lie at 1.25, 1.35, ...: a part of the body from 1.26 to 1.34 is met by none.
@pytest.mark.parametrize(
    ("low", "high", "lost"),
    [(1.26, 1.34, True), (1.25 + HAIR, 1.35 - HAIR, True), (1.25 - HAIR, 1.34, False), (1.26, 1.35 + HAIR, False)],
)
def test_a_part_that_no_sample_meets_is_an_error(sensor, findings, low, high, lost):
    found = [f for f in findings(sensor(patch(low, high)), "4-", "patch") if f.severity == "error"]
    assert len(found) == lost
    if lost:
        assert found[0].value_mm == pytest.approx(high - low)
        assert found[0].limit_mm == 0.05
        assert low <= found[0].place_mm[2] <= high
        assert found[0].advice


def test_a_part_on_a_sample_belongs_to_the_body_below_it(sensor, findings):
    """The sample at 1.25 lies on the face between two patches: the lower one prints there, up to 1.3."""
    upper = Body("upper", "x60", (box(5, 10, 5, 10, 1.25, 1.5),))
    scene = sensor(patch(1.2, 1.25), upper)
    assert findings(scene, "4-", "patch") == []
    (found,) = findings(scene, "4-", "upper")
    assert (found.severity, found.value_mm) == ("warning", 0.05)
    assert findings(scene, "9-") == []
    assert "at mid-height of a layer: the estimate assumes" in findings(scene, "3-", "patch")[0].message


def test_several_lost_parts_count(sensor, findings):
    two = Body("patch", "pla", tuple(box(x, x + 2, 0, 2, 1.26, 1.34) for x in (0, 5)))
    (found,) = findings(sensor(two), "4-", "patch")
    assert found.count == 2


# An end short of mid-height leaves its layer empty; beyond it the layer prints whole.
@pytest.mark.parametrize(("top_mm", "short"), [(1.44, True), (1.45 - HAIR, True), (1.45 + HAIR, False), (1.5, False)])
def test_an_end_short_of_mid_height_is_a_warning(sensor, findings, top_mm, short):
    found = findings(sensor(patch(1.2, top_mm)), "4-", "patch")
    assert [(f.severity, f.layer) for f in found] == [("warning", 15)] * short
    if short:
        assert found[0].value_mm == pytest.approx(top_mm - 1.4)
        assert found[0].limit_mm == 0.05


def test_an_apex_short_of_mid_height_is_a_warning(sensor, findings):
    """A ridge whose last 0.04 mm are not met by a sample."""
    ridge = Body("patch", "pla", (Prism("y", ((5, 1.2), (10, 1.2), (7.5, 1.44)), 0.0, 20.0),))
    (found,) = findings(sensor(ridge), "4-", "patch")
    assert (found.severity, found.layer, found.value_mm) == ("warning", 15, 0.04)
