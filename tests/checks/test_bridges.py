"""Rule 9 at its limits: bridges (0.44 and 5 mm), overhangs (half a line and a line), islands, and supports."""

from itertools import pairwise

import pytest

from sensorgen.checks.review import review
from sensorgen.design.design import make
from sensorgen.scene.scene import Body, Scene, box

HAIR = 1e-6


def walls(*spans: tuple[float, float], axis: str = "x", roof: tuple[float, float] | None = None) -> list[Body]:
    """Walls from 1.2 to 1.4 mm on top of the sensor, and a roof over them from 1.4 to 1.6 mm."""
    low, high = roof or (spans[0][0], spans[-1][1])

    def block(a: float, b: float, z0: float, z1: float):
        return box(a, b, 0, 20, z0, z1) if axis == "x" else box(0, 20, a, b, z0, z1)

    return [
        Body("walls", "x60", tuple(block(a, b, 1.2, 1.4) for a, b in spans)),
        Body("roof", "etpu", (block(low, high, 1.4, 1.6),)),
    ]


@pytest.mark.parametrize("axis", "xy")
@pytest.mark.parametrize(
    ("gap", "severity", "limit"),
    [(0.44, None, None), (0.44 + HAIR, "warning", 0.44), (5.0, "warning", 0.44), (5.0 + HAIR, "error", 5.0)],
)
def test_a_bridge_is_judged_by_its_length(sensor, findings, axis, gap, severity, limit):
    found = findings(sensor(*walls((2, 4), (4 + gap, 12), axis=axis)), "9-")
    assert [(f.severity, f.limit_mm) for f in found] == [(severity, limit)] * bool(severity)
    if severity:
        assert (found[0].body, found[0].layer) == ("roof", 15)
        assert found[0].value_mm == pytest.approx(gap)
        assert "a bridge" in found[0].message
        assert found[0].advice


def test_the_limits_of_a_bridge_are_those_of_the_quality(sensor, findings, fine):
    strict = fine.model_copy(update={"bridge_warning_mm": 0.1, "bridge_error_mm": 0.2})
    scene = sensor(*walls((2, 4), (4.3, 12)))
    assert findings(scene, "9-") == []
    assert [(f.severity, f.limit_mm) for f in findings(scene, "9-", quality=strict)] == [("error", 0.2)]


# A line of 0.44 mm holds on to half of itself.
@pytest.mark.parametrize("axis", "xy")
@pytest.mark.parametrize(
    ("beyond", "severity", "limit"),
    [(0.22, None, None), (0.22 + HAIR, "warning", 0.22), (0.44, "warning", 0.22), (0.44 + HAIR, "error", 0.44)],
)
def test_an_overhang_is_judged_by_the_line(sensor, findings, axis, beyond, severity, limit):
    found = findings(sensor(*walls((2, 12), axis=axis, roof=(2, 12 + beyond))), "9-")
    assert [(f.severity, f.limit_mm) for f in found] == [(severity, limit)] * bool(severity)
    if severity:
        assert "an overhang" in found[0].message


def test_another_nozzle_hangs_over_less(sensor, findings, printer):
    small = printer.model_copy(update={"nozzle_mm": 0.25})  # line 0.275
    scene = sensor(*walls((2, 12), roof=(2, 12.22)))
    assert findings(scene, "9-") == []
    assert [f.limit_mm for f in findings(scene, "9-", printer=small)] == [0.1375]


def test_any_body_below_supports(sensor, findings):
    """The gap that would be a bridge of 6 mm, filled by a third body."""
    filler = Body("filler", "bvoh", (box(4, 10, 0, 20, 1.2, 1.4),))
    bare, filled = sensor(*walls((2, 4), (10, 12))), sensor(*walls((2, 4), (10, 12)), filler)
    assert [f.severity for f in findings(bare, "9-")] == ["error"]
    assert findings(filled, "9-") == []


def test_a_hole_is_bridged_over_its_narrow_side(sensor, findings):
    """A hole of 4 x 1 mm in a block of 10 x 10."""
    around = ((2, 12, 2, 5), (2, 12, 6, 12), (2, 4, 5, 6), (8, 12, 5, 6))
    bodies = [
        Body("walls", "x60", tuple(box(*sides, 1.2, 1.4) for sides in around)),
        Body("roof", "etpu", (box(2, 12, 2, 12, 1.4, 1.6),)),
    ]
    (found,) = findings(sensor(*bodies), "9-")
    assert "a bridge of 1 mm" in found.message


@pytest.mark.parametrize(("beyond", "severities"), [(0.2, []), (0.3, ["warning"]), (0.5, ["error"])])
def test_the_corners_of_a_cap_hold_on_to_its_sides(sensor, findings, beyond, severities):
    """They have nothing below in either direction, and are no islands."""
    pillar = Body("pillar", "x60", (box(5, 10, 5, 10, 1.2, 1.4),))
    cap = Body("cap", "etpu", (box(5 - beyond, 10 + beyond, 5 - beyond, 10 + beyond, 1.4, 1.6),))
    found = findings(sensor(pillar, cap), "9-")
    assert [f.severity for f in found] == severities
    assert all("an overhang" in f.message for f in found)


def test_a_roof_over_a_bay_is_held_at_its_sides_rather_than_at_its_back(sensor, findings):
    """A bay 1 mm wide and 0.6 mm deep: a bridge of 1 mm sags less than an overhang of 0.6."""
    bay = (box(2, 12, 2, 5, 1.2, 1.4), box(2, 6, 5, 5.6, 1.2, 1.4), box(7, 12, 5, 5.6, 1.2, 1.4))
    roof = Body("roof", "etpu", (box(2, 12, 2, 5.6, 1.4, 1.6),))
    (found,) = findings(sensor(Body("bay", "x60", bay), roof), "9-")
    assert (found.severity, found.message) == ("warning", "a bridge of 1 mm over air")


def test_an_arm_round_a_corner_is_an_overhang_of_its_own_length(sensor, findings):
    """The first arm is held by the pillar and sticks out 0.2 mm; the second leaves it sideways by 3 mm."""
    pillar = Body("pillar", "x60", (box(5, 10, 5, 6, 1.2, 1.4),))
    arms = Body("arms", "etpu", (box(5, 10.2, 5, 6, 1.4, 1.6), box(10, 10.2, 6, 9, 1.4, 1.6)))
    (found,) = findings(sensor(pillar, arms), "9-")
    assert (found.severity, found.value_mm) == ("error", pytest.approx(3.0))


# What is up to 0.12 mm wide vanishes anyway (rule 5): it cannot fall.
@pytest.mark.parametrize(("width", "starts"), [(0.12, False), (0.12 + HAIR, True), (3.0, True)])
def test_an_island_is_an_error(sensor, findings, width, starts):
    island = Body("island", "x60", (box(5, 5 + width, 5, 10, 1.4, 1.6),))
    found = findings(sensor(island), "9-bridge", "island")
    assert [(f.severity, f.layer) for f in found] == [("error", 15)] * starts
    if starts:
        assert found[0].value_mm == pytest.approx(width)
        assert "--support" in found[0].advice


def test_stairs_as_steep_as_half_a_line_hold(sensor, findings):
    """Every layer is judged against the one below it, not against the foot."""
    steps = [(2.0 + 0.2 * k, 1.2 + 0.1 * k) for k in range(5)]
    stairs = tuple(box(0, a, 0, 20, z, z + 0.1) for (a, z), _ in pairwise(steps))
    assert findings(sensor(Body("stairs", "x60", stairs)), "9-") == []


def reviewed(**data):
    return [f for f in review(make(data)).findings if f.rule == "9-bridge"]


SMALL = {"length_mm": 8.0, "width_mm": 4.0}


@pytest.mark.parametrize("along", ["x", "y"])
def test_upside_down_the_lower_triangles_start_in_mid_air(along):
    """Their apexes come first, over the air: printable with support only."""
    (found,) = reviewed(shape="tri", parameters=SMALL | {"along": along}, orientation="upside-down")
    assert (found.severity, found.body) == ("error", "film_and_lower")
    assert "island" in found.message
    assert "support" in found.advice


@pytest.mark.parametrize("shape", ["tri", "rect"])
@pytest.mark.parametrize("orientation", ["as-drawn", "upside-down"])
def test_with_support_nothing_is_printed_over_air(shape, orientation):
    assert reviewed(shape=shape, parameters=SMALL, orientation=orientation, materials={"support": "bvoh"}) == []


# Strips of 0.7 over air of 0.3 are bridges that a bead spans; wider air is a bridge to warn of.
@pytest.mark.parametrize(("air", "severity"), [(0.3, None), (0.44, None), (0.45, "warning"), (5.1, "error")])
def test_crossed_strips_bridge_the_air_between_the_lower_ones(air, severity):
    size = {"length_mm": 2 * 0.7 + air, "width_mm": 2 * 0.7 + air}  # from strip to strip: nothing hangs over the edge
    found = reviewed(shape="rect", parameters=size | {"air_width_mm": air})
    assert {f.severity for f in found} == ({severity} if severity else set())
    assert all("a bridge" in f.message and f.value_mm == pytest.approx(air) for f in found)


@pytest.mark.parametrize("pin", [0.0, 1.0])
def test_what_support_alone_holds_is_loose(sensor, findings, pin):
    """A lid over support falls off once that is washed out, unless a pin of 1 mm joins it to what lies below."""
    lid, support = box(0, 20, 0, 20, 1.4, 1.6), box(0, 20 - pin, 0, 20, 1.2, 1.4)
    pins = [Body("pin", "x60", (box(20 - pin, 20, 0, 20, 1.2, 1.4),))] if pin else []
    found = findings(sensor(*pins, Body("support", "bvoh", (support,)), Body("lid", "etpu", (lid,))), "9-loose")
    assert [(f.severity, f.body, f.layer) for f in found] == [("error", "lid", 15)] * (not pin)


def test_a_raft_frees_the_sensor_and_one_of_two_lids_falls(sensor, findings):
    """Support below everything holds nothing up; of two lids of one body the one over support alone falls."""
    layers = [("support", "bvoh", -0.2), ("low", "etpu", 0.2), ("film", "x60", 0.6), ("high", "etpu", 1.0)]
    raft = Scene(
        tuple(Body(name, of, (box(0, 20, 0, 20, max(z, 0), z + 0.4),)) for name, of, z in layers), (20.0, 20.0, 1.4)
    )
    assert not findings(raft, "9-loose")
    lids = Body("lids", "etpu", (box(0, 5, 0, 20, 1.2, 1.6), box(10, 15, 0, 20, 1.4, 1.6)))
    below = Body("support", "bvoh", (box(10, 15, 0, 20, 1.2, 1.4),))
    assert [(f.body, f.layer) for f in findings(sensor(below, lids), "9-loose")] == [("lids", 15)]
