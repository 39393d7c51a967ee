"""Pieces beyond prisms: volumes and cuts against closed forms, and what is refused."""

import pickle
from itertools import pairwise
from math import inf, log, nan, pi, sqrt, tan

import numpy as np
import pytest
import shapely

from sensorgen.core.errors import BadInput
from sensorgen.scene.geometry import meshes
from sensorgen.scene.layers import outlines
from sensorgen.scene.polyhedra import Loft, Polyhedron
from sensorgen.scene.revolved import CHORD_MM, Revolved
from sensorgen.scene.scene import Body, Move, Prism, Scene, area_mm2, box, content, rectangle

QUARTER = tan(pi / 8)  # bulge of a quarter of a circle
HEMISPHERE = Revolved(1.0, 2.0, ((0, 0), (0.5, 0), (0, 0.5)), (0, QUARTER, 0))
CONE = Revolved(0.0, 0.0, ((0, 0), (0.6, 0), (0, 0.9)))
FRUSTUM = Revolved(0.0, 0.0, ((0, 0), (0.6, 0), (0.2, 0.6), (0, 0.6)))
RING = Revolved(-3.0, 1.0, ((0.8, 0.3), (1.2, 0.3)), (1, 1))
TUBE = Revolved(0.0, 0.0, ((0.3, 0), (0.5, 0), (0.5, 1), (0.3, 1)))
PYRAMID = Loft(rectangle(0, 2, 0, 2), ((1, 1),) * 4, 0, 1)
ELBOW = Loft(
    ((0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)), ((0, 0), (2, 0), (2, 0.5), (0.5, 0.5), (0.5, 2), (0, 2)), 0, 2
)
ROUND = {"hemisphere": HEMISPHERE, "cone": CONE, "frustum": FRUSTUM, "ring": RING, "tube": TUBE}
FLAT = {"pyramid": PYRAMID, "elbow": ELBOW, "mesh": ELBOW.polyhedron()}
EVERY = ROUND | FLAT | {"lying": Prism("y", ((0, 0), (2, 0), (1, 1)), 0, 3)}


def area(outlines) -> float:
    return sum(area_mm2(outline) for outline in outlines)


@pytest.mark.parametrize(
    ("piece", "exact"),
    [
        (HEMISPHERE, 2 / 3 * pi * 0.5**3),
        (CONE, pi * 0.6**2 * 0.9 / 3),
        (FRUSTUM, pi * 0.6 / 3 * (0.6**2 + 0.6 * 0.2 + 0.2**2)),
        (RING, 2 * pi**2 * 1.0 * 0.2**2),  # Pappus
        (TUBE, pi * (0.5**2 - 0.3**2)),
        (PYRAMID, 4 / 3),
        (ELBOW, 6.5),  # areas 5, 3.1875 and 1.75 at its bottom, middle and top
        (ELBOW.polyhedron(), 6.5),
    ],
)
def test_volume(piece, exact):
    assert piece.volume_mm3() == pytest.approx(exact, rel=1e-13)


def test_volume_between_two_heights():
    assert HEMISPHERE.volume_mm3(0.1, 0.3) == pytest.approx(pi * (0.25 * 0.2 - (0.3**3 - 0.1**3) / 3), rel=1e-13)
    assert RING.volume_mm3(0.3) == pytest.approx(RING.volume_mm3() / 2, rel=1e-13)
    assert PYRAMID.volume_mm3(0.5) == pytest.approx(1 / 6, rel=1e-13)


@pytest.mark.parametrize("piece", EVERY.values(), ids=EVERY)
def test_layers_add_up_and_areas_are_their_derivative(piece):
    low, high = piece.span("z")
    heights = np.linspace(low - 0.1, high + 0.1, 14)
    layers = [piece.volume_mm3(a, b) for a, b in pairwise(heights)]
    assert sum(layers) == pytest.approx(piece.volume_mm3(), rel=1e-12)
    middle = low + 0.37 * (high - low)
    thin = piece.volume_mm3(middle - 1e-6, middle + 1e-6) / 2e-6
    assert area(piece.cut("z", middle)) == pytest.approx(thin, rel=8e-3 if piece in ROUND.values() else 1e-5)


@pytest.mark.parametrize("piece", EVERY.values(), ids=EVERY)
@pytest.mark.parametrize("axis", "xyz")
def test_cuts_add_up_to_the_volume(piece, axis):
    low, high = piece.span(axis)
    middles = low + (np.arange(200) + 0.5) / 200 * (high - low)
    found = np.mean([area(piece.cut(axis, at)) for at in middles]) * (high - low)
    assert found == pytest.approx(piece.volume_mm3(), rel=8e-3 if piece in ROUND.values() else 1e-3)


def test_upright_cuts_of_a_cone_are_hyperbolas():
    """Area of a cone's cut at a distance from its axis, in closed form."""
    r, h, d = 0.6, 0.9, 0.25
    half = sqrt(r * r - d * d)
    exact = h / r * (r * half - d * d * log((half + r) / d))
    (outline,) = CONE.cut("x", d)
    assert area_mm2(outline) == pytest.approx(exact, rel=5e-3)
    assert max(abs(z - h * (1 - sqrt(u * u + d * d) / r)) for u, z in outline if z) < 1e-12  # on the surface


@pytest.mark.parametrize("away", [0.0, 0.2, 0.45, 0.499])
def test_upright_cuts_of_a_hemisphere_are_half_circles(away):
    (outline,) = HEMISPHERE.cut("y", 2.0 + away)
    radius = sqrt(0.25 - away**2)
    assert all(abs((u - 1.0) ** 2 + z**2 - radius**2) < 1e-12 or z == 0 for u, z in outline)
    middles = (np.array(outline) + np.roll(outline, -1, 0)) / 2
    sagitta = radius - np.hypot(middles[:, 0] - 1.0, middles[:, 1])
    assert sagitta[middles[:, 1] > 1e-9].max() <= CHORD_MM


@pytest.mark.parametrize(("away", "outlines"), [(0.0, 2), (0.5, 2), (0.8, 2), (0.9, 1), (1.1, 1)])
def test_upright_cuts_of_a_ring(away, outlines):
    found = RING.cut("x", -3.0 + away)
    assert len(found) == outlines
    assert all(shapely.Polygon(outline).is_valid and area_mm2(outline) > 0 for outline in found)
    across = np.linspace(0.0, sqrt(1.2**2 - away**2), 20001)
    height = 2 * np.sqrt(np.maximum(0.2**2 - (np.hypot(across, away) - 1.0) ** 2, 0.0))
    assert area(found) == pytest.approx(2 * np.trapezoid(height, across), rel=8e-3)


def test_level_cuts_have_no_holes():
    halves = TUBE.cut("z", 0.5)
    assert len(halves) == 2
    assert area(halves) == pytest.approx(pi * 0.16, rel=8e-3)
    assert shapely.Polygon(halves[0]).intersection(shapely.Polygon(halves[1])).area < 1e-9
    hollow = _hollow_cube()
    assert area(hollow.cut("z", 1.5)) == pytest.approx(8.0, rel=1e-12)
    assert len(hollow.cut("z", 0.5)) == 1


def _hollow_cube() -> Polyhedron:
    """A cube of 3 mm around a cavity of 1 mm."""
    outer, inner = (Loft(rectangle(a, b, a, b), rectangle(a, b, a, b), a, b).polyhedron() for a, b in ((0, 3), (1, 2)))
    inside = tuple(tuple(k + len(outer.vertices) for k in t[::-1]) for t in inner.triangles)
    return Polyhedron(outer.vertices + inner.vertices, outer.triangles + inside)


def test_holes_that_nearly_begin_at_one_line_are_cut_as_if_they_did():
    """A round line's rounding parted two holes by 5e-6 um, and GEOS refused to clip a print to nothing."""
    off = 5e-9
    holes = [shapely.box(4, 1, 6, 3), shapely.box(4 + off, 5, 6, 8), shapely.box(4 + 3 * off, 9, 5, 9.5)]
    cut = list(outlines(shapely.box(0, 0, 10, 10) - shapely.union_all(holes)))
    assert area(cut) == pytest.approx(100 - 4 - 6 - 0.5, abs=1e-6)
    assert min(np.ptp(outline, axis=0).min() for outline in cut) == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("piece", EVERY.values(), ids=EVERY)
def test_its_spans_hold_its_cuts(piece):
    for axis, (first, second) in {"x": "yz", "y": "xz", "z": "xy"}.items():
        low, high = piece.span(axis)
        assert piece.cut(axis, low - 1e-6) == piece.cut(axis, high) == []
        for outline in piece.cut(axis, low + 0.3 * (high - low)):
            for values, other in zip(zip(*outline, strict=True), (first, second), strict=True):
                a, b = piece.span(other)
                assert a - 1e-9 <= min(values) < max(values) <= b + 1e-9


@pytest.mark.parametrize("piece", EVERY.values(), ids=EVERY)
def test_turned_over_and_stretched(piece):
    size = (7.0, 5.0, 4.0)
    turned = piece.moved(Move((1, -1, -1), (0, *size[1:])))
    assert turned.volume_mm3() == pytest.approx(piece.volume_mm3(), rel=1e-12)
    for axis, whole in (("y", 5.0), ("z", 4.0)):
        assert turned.span(axis) == pytest.approx([whole - v for v in piece.span(axis)[::-1]], abs=1e-12)
    assert area(turned.cut("z", 3.8)) == pytest.approx(area(piece.cut("z", 0.2)), rel=1e-6)
    for factor in (0.98, 1.02):
        stretched = piece.moved(Move((factor, factor, 1)))
        assert stretched.volume_mm3() == pytest.approx(factor**2 * piece.volume_mm3(), rel=1e-6)
    assert pickle.loads(pickle.dumps(piece)) == piece


def test_every_piece_has_another_content():
    contents = [repr(content(p)) for p in (*EVERY.values(), *(p.moved(Move((1.01, 1.01, 1))) for p in EVERY.values()))]
    assert len(set(contents)) == len(contents)


def test_only_boxes_are_boxes():
    square = rectangle(0, 2, 0, 1)
    cube = Loft(square, square, 0, 1)
    assert cube.is_box()
    assert cube.polyhedron().is_box()
    assert not any(piece.is_box() for piece in EVERY.values())
    assert cube.cut("x", 0.0) == cube.polyhedron().cut("x", 0.0) == box(0, 2, 0, 1, 0, 1).cut("x", 0.0)
    cylinder = Revolved(0, 0, ((0, 0), (1, 0), (1, 1), (0, 1)))
    assert not any(cylinder.is_constant(axis) for axis in "xyz")


@pytest.mark.parametrize("piece", EVERY.values(), ids=EVERY)
def test_its_mesh_is_closed_and_has_its_volume(piece):
    body = Body("it", "x60", (piece,))
    scene = Scene((body,), (10.0, 10.0, 10.0))
    found = meshes.mesh(body)
    assert meshes.faults(scene, {"it": found}) == []
    assert found.volume_mm3() == pytest.approx(piece.volume_mm3(), rel=1e-2 if piece in ROUND.values() else 1e-12)


def test_corners_may_be_given_either_way_round():
    assert Revolved(0, 0, CONE.outline[::-1]) == CONE
    clockwise = Revolved(1.0, 2.0, ((0, 0.5), (0.5, 0), (0, 0)), (-QUARTER, 0, 0))
    assert clockwise == HEMISPHERE
    assert Loft(PYRAMID.lower[::-1], PYRAMID.upper, 0, 1) == PYRAMID
    inside_out = tuple(t[::-1] for t in PYRAMID.polyhedron().triangles)
    assert Polyhedron(PYRAMID.polyhedron().vertices, inside_out).volume_mm3() == pytest.approx(4 / 3)


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: Revolved(0, 0, ((0, 0), (1, 0))), "is open|encloses nothing"),
        (lambda: Revolved(0, 0, ()), "is open"),
        (lambda: Revolved(0, 0, ((-0.1, 0), (1, 0), (1, 1))), "beyond the axis"),
        (lambda: Revolved(0, 0, ((0, 0), (0, 1), (1, 1)), (-0.5, 0, 0)), "beyond the axis"),
        (lambda: Revolved(0, 0, ((0, 0), (1, 0), (1, 1)), (0.0, 0.0)), "2 bulges; expected one for each of its 3"),
        (lambda: Revolved(0, 0, ((0, 0), (1, 0), (1, 1)), (0.0, 1.5, 0.0)), "from -1 to 1"),
        (lambda: Revolved(0, 0, ((0, 0), (1, 0), (1, 1)), (0.0, nan, 0.0)), "from -1 to 1"),
        (lambda: Revolved(0, inf, ((0, 0), (1, 0), (1, 1))), "nowhere"),
        (lambda: Revolved(0, 0, ((0, 0), (1, nan), (1, 1))), "nowhere"),
        (lambda: Revolved(0, 0, ((0, 0), (0, 0), (1, 1))), "same corner twice"),
        (lambda: Loft(rectangle(0, 1, 0, 1), ((0, 0), (1, 0), (1, 1)), 0, 1), "joins 4 corners to 3"),
        (lambda: Loft(rectangle(0, 1, 0, 1), ((0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5)), 0, 1), "not flat"),
        (lambda: Loft(rectangle(0, 1, 0, 1), rectangle(0, 1, 0, 1)[::-1], 0, 1), "not flat|different senses"),
        (lambda: Loft(rectangle(0, 1, 0, 1), ((1, 1), (0, 1), (0, 0), (1, 0)), 0, 1), "crosses itself"),
        (lambda: Loft(((0, 0),) * 4, ((1, 1),) * 4, 0, 1), "encloses nothing"),
        (lambda: Loft(rectangle(0, 1, 0, 1), rectangle(0, 1, 0, 1), 1, 1), "no height"),
        (lambda: Loft(rectangle(0, nan, 0, 1), rectangle(0, 1, 0, 1), 0, 1), "nowhere"),
        (lambda: Polyhedron(PYRAMID.polyhedron().vertices, PYRAMID.polyhedron().triangles[1:]), "open"),
        (lambda: Polyhedron(((0, 0, 0), (1, 0, 0), (0, 1, 0)), ((0, 1, 2), (0, 2, 1))), "encloses nothing"),
        (lambda: Polyhedron(((0, 0, 0), (1, 0, 0)), ((0, 1, 2),)), "does not have"),
        (lambda: Polyhedron(((0, 0, nan),), ()), "nowhere"),
        (lambda: Polyhedron((), ()), "encloses nothing"),
    ],
)  # fmt: skip
def test_what_no_body_can_be_is_refused(make, reason):
    with pytest.raises(BadInput, match=reason):
        make()
