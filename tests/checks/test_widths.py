"""Rules 5 and 6 at their limits, with the thesis's nozzle (0.4 mm, line 0.44 mm), another nozzle and another printer.

Limits: files-and-slicers.md, rules 5 and 6; as-printed.md, "Mid-plane rules".
"""

import math

import numpy as np
import pytest

from sensorgen.design.shapes import tri
from sensorgen.scene.scene import Body, Fill, Prism, box

HAIR = 1e-6


def strip(width_mm: float, axis: str = "x") -> Body:
    """A strip on top of the sensor (1.2 mm), three layers high, narrow along an axis."""
    x, y = ((5.0, 5.0 + width_mm), (0.0, 20.0)) if axis == "x" else ((0.0, 20.0), (5.0, 5.0 + width_mm))
    return Body("strip", "pla", (box(*x, *y, 1.2, 1.5),))


BANDS = [
    (0.12 - HAIR, "error", "vanishes", 0.12),
    (0.12, "error", "vanishes", 0.12),
    (0.12 + HAIR, "warning", "prints 0.34 mm wide", 0.34),
    (0.34 + HAIR, "warning", "narrower than a line", 0.44),
    (0.44, "info", "1.2 to 1.8 times its material", 0.70),  # a whole line prints
    (0.70, "info", "1.2 to 1.8 times its material", 0.70),  # sqXY's strips: deposited 1.24 times (as-printed.md)
]


@pytest.mark.parametrize("axis", "xy")
@pytest.mark.parametrize(("width", "severity", "words", "limit"), BANDS)
def test_every_band_of_widths(sensor, findings, axis, width, severity, words, limit):
    (found,) = findings(sensor(strip(width, axis)), "5-", "strip")
    assert (found.severity, found.layer, found.last_layer) == (severity, 13, 15)
    assert words in found.message
    assert found.value_mm == pytest.approx(width)
    assert found.limit_mm == limit
    assert found.advice
    assert found.place_mm == pytest.approx((5 + width / 2, 10.0, 1.25) if axis == "x" else (10.0, 5 + width / 2, 1.25))


def test_a_width_just_below_a_line_is_written_with_the_digits_that_show_it(sensor, findings):
    (found,) = findings(sensor(strip(0.43996)), "5-", "strip")
    assert "a stretch 0.43996 mm wide" in found.message
    assert "widen it to 0.44 mm" in found.advice


@pytest.mark.parametrize("width", [0.70 + HAIR, 1.0])
def test_wide_strips_are_fine(sensor, findings, width):
    assert findings(sensor(strip(width)), "5-", "strip") == []


def test_following_the_advice_leaves_no_warning(sensor, findings):
    (found,) = findings(sensor(strip(0.2)), "5-", "strip")
    advised = float(found.advice.split("to ")[1].split(" mm")[0])
    assert [f.severity for f in findings(sensor(strip(advised)), "5-", "strip")] == ["info"]


# With a nozzle of 0.25 mm all limits shrink in proportion: 0.075, 0.2125, 0.275, 0.4375.
@pytest.mark.parametrize(
    ("width", "severities"),
    [(0.075, ["error"]), (0.076, ["warning"]), (0.274, ["warning"]), (0.275, ["info"]), (0.438, [])],
)
def test_another_nozzle_has_other_limits(sensor, findings, printer, width, severities):
    small = printer.model_copy(update={"nozzle_mm": 0.25})
    assert [f.severity for f in findings(sensor(strip(width)), "5-", "strip", printer=small)] == severities


def test_a_thin_strip_between_two_others_of_its_body_is_not_thin(sensor, findings):
    pieces = tuple(box(5 + k, 5 + k + w, 0, 20, 1.2, 1.5) for k, w in ((0.0, 1.0), (1.0, 0.1), (1.1, 1.0)))
    assert findings(sensor(Body("strip", "pla", pieces)), "5-", "strip") == []


def test_strips_of_one_width_are_counted(sensor, findings):
    pieces = tuple(box(x, x + 0.3, 0, 20, 1.2, 1.5) for x in (2, 5, 9))
    (found,) = findings(sensor(Body("strip", "pla", pieces)), "5-", "strip")
    assert found.count == 3


def test_a_strip_with_a_break_in_height_is_told_twice(sensor, findings):
    pieces = (box(5, 5.3, 0, 20, 1.2, 1.5), box(5, 10, 0, 20, 1.5, 1.7), box(5, 5.3, 0, 20, 1.7, 1.9))
    found = findings(sensor(Body("strip", "pla", pieces)), "5-", "strip")
    assert [(f.layer, f.last_layer) for f in found] == [(13, 15), (18, 19)]


def spike(base_mm: float, height_mm: float) -> Body:
    """A ridge on top of the sensor."""
    left, right = 5 - base_mm / 2, 5 + base_mm / 2
    return Body("strip", "pla", (Prism("y", ((left, 1.2), (right, 1.2), (5, 1.2 + height_mm)), 0, 20),))


def test_a_tip_that_runs_out_is_a_warning(sensor, findings):
    """Widths at the samples: 0.9, 0.7, 0.5, 0.3, 0.1; only the last vanishes, and it is a tip."""
    found = findings(sensor(spike(1.0, 0.5)), "5-", "strip")
    assert [(f.severity, f.layer, f.last_layer, f.value_mm) for f in found] == [
        ("warning", 16, None, 0.3), ("warning", 17, None, 0.1), ("info", 14, 15, 0.5)
    ]  # fmt: skip
    assert "a tip 0.1 mm wide" in found[1].message
    assert "a stretch 0.5 to 0.7 mm wide" in found[2].message


@pytest.mark.parametrize("height", [0.5, 0.53, 0.549, 0.59])
def test_a_tip_is_a_tip_wherever_it_ends_in_the_layer(sensor, findings, height):
    """Also where its last hundredths miss their own sample and the layer before them is too narrow."""
    assert [f for f in findings(sensor(spike(height * 2, height)), "5-", "strip") if f.severity == "error"] == []


@pytest.mark.parametrize(("quality", "film_mm"), [("fine", 0.1), ("fine", 0.15), ("extrafine", 0.2)])
def test_tips_of_triangles_cut_at_the_edge_are_tips_too(findings, request, quality, film_mm):
    """Half triangles at x = 0 taper to one side."""
    scene = tri.scene(tri.Params(length_mm=8.0, width_mm=4.0, dielectric_mm=film_mm), Fill())
    found = findings(scene, "5-", quality=request.getfixturevalue(quality))
    assert [f for f in found if f.severity == "error"] == []


def test_a_tall_spike_is_more_than_a_tip(sensor, findings):
    """0.1 mm wide and 0.5 high: five layers vanish, not one."""
    found = findings(sensor(spike(0.1, 0.5)), "5-", "strip")
    assert [(f.layer, f.last_layer) for f in found if f.severity == "error"] == [(13, 16)]
    assert [f.layer for f in found if f.severity == "warning"] == [17]


def test_a_thin_wall_one_layer_high_is_no_tip(sensor, findings):
    low = Body("strip", "pla", (box(5, 5.1, 0, 20, 1.2, 1.3),))
    assert [f.severity for f in findings(sensor(low), "5-", "strip")] == ["error"]


# Rule 6: "gaps inside one body under 0.1 close".
@pytest.mark.parametrize(("gap", "closes"), [(0.05, True), (0.1 - HAIR, True), (0.1, False), (0.1 + HAIR, False)])
@pytest.mark.parametrize("axis", "xy")
def test_a_narrow_gap_within_a_body_closes(sensor, findings, gap, closes, axis):
    if axis == "x":
        walls = (box(5, 7, 0, 20, 1.2, 1.5), box(7 + gap, 9, 0, 20, 1.2, 1.5))
    else:
        walls = (box(0, 20, 5, 7, 1.2, 1.5), box(0, 20, 7 + gap, 9, 1.2, 1.5))
    found = findings(sensor(Body("walls", "pla", walls)), "6-", "walls")
    assert [(f.severity, f.layer, f.last_layer) for f in found] == [("warning", 13, 15)] * closes
    if closes:
        assert (found[0].value_mm, found[0].limit_mm) == (pytest.approx(gap), 0.1)
        assert "0.1 mm" in found[0].advice


def test_a_gap_between_two_bodies_is_not_within_one(sensor, findings):
    left = Body("left", "pla", (box(5, 7, 0, 20, 1.2, 1.5),))
    right = Body("right", "pla", (box(7.05, 9, 0, 20, 1.2, 1.5),))
    assert findings(sensor(left, right), "6-") == []


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi / 4])
@pytest.mark.parametrize(("width", "severity", "words", "limit"), BANDS)
def test_strips_in_any_direction_have_their_width(sensor, findings, width, severity, words, limit, turn):
    """A strip of 8 mm, turned in plan."""
    c, s = math.cos(turn), math.sin(turn)
    corners = [(4, width / 2), (-4, width / 2), (-4, -width / 2), (4, -width / 2)]
    outline = tuple((10 + c * u - s * v, 10 + s * u + c * v) for u, v in corners)
    found = findings(sensor(Body("strip", "pla", (Prism("z", outline, 1.2, 1.5),))), "5-", "strip")
    assert [(f.severity, f.limit_mm, f.count) for f in found] == [(severity, limit, 1)]
    assert found[0].value_mm == pytest.approx(width)
    assert words in found[0].message


def test_a_round_post_has_its_width_once(sensor, findings):
    """Of 32 corners, 0.4 mm from side to side."""
    radius = 0.2 / math.cos(math.pi / 32)
    outline = tuple((10 + radius * math.cos(a), 10 + radius * math.sin(a)) for a in np.arange(32) * math.pi / 16)
    (found,) = findings(sensor(Body("post", "pla", (Prism("z", outline, 1.2, 1.5),))), "5-", "post")
    assert (found.severity, found.count, found.value_mm) == ("warning", 1, pytest.approx(0.4))


def test_a_gap_between_slanted_walls_closes(sensor, findings):
    walls = [((5, 5), (10, 10), (9, 11), (4, 6)), ((5.05, 4.95), (7.05, 2.95), (12.05, 7.95), (10.05, 9.95))]
    found = findings(sensor(Body("walls", "pla", tuple(Prism("z", o, 1.2, 1.5) for o in walls))), "6-", "walls")
    assert [f.value_mm for f in found] == [pytest.approx(0.05 * 2**0.5)]


def test_a_wide_slanted_outline_is_fine(sensor, findings):
    wedge = Body("wedge", "pla", (Prism("z", ((5, 5), (10, 5), (5, 10)), 1.2, 1.5),))
    assert findings(sensor(wedge), "", "wedge") == []
