"""Rings of triangles at corners: what they fill, where they stand, and that the field's bounds close in by them."""

import numpy as np
import pytest

pytest.importorskip("netgen", reason="pip install 'sensorgen[fem]'")

from sensorgen.models import fem2d, press2d
from sensorgen.models.press2d import Fineness
from sensorgen.scene.scene import Body, Scene, box
from sensorgen.solvers.contact import mesh, plane_field
from sensorgen.solvers.contact.cell import OUTSIDE, ContactCell, Region

EPS = {"x60": 4.68, "air": 1.00059}
LEVELS = (Fineness(), Fineness().finer())


def stairs():
    """Two steps on each side of a foot that stands on a film, between plates, two periods of 2 mm."""
    bars = [box(c - w, c + w, 0, 8, z, z + 0.1) for c in (1.0, 3.0) for w, z in ((0.3, 0.4), (0.6, 0.5))]
    bodies = (
        Body("bottom_electrode", "etpu", (box(0, 4, 0, 8, 0, 0.3),), "bottom"),
        Body("film", "x60", (box(0, 4, 0, 8, 0.3, 0.4),)),
        Body("feet", "x60", tuple(bars)),
        Body("top_electrode", "etpu", (box(0, 4, 0, 8, 0.6, 0.9),), "top"),
    )
    return Scene(bodies, (4.0, 8.0, 0.9))


def test_corners_are_where_solid_and_air_or_plates_turn_and_where_three_meet():
    cell = press2d.cell(stairs(), 2.0)
    found = {(round(x, 6), round(y, 6)) for x, y in mesh.sharp_corners(cell.edges, cell.left_mm, cell.right_mm)}
    if cell.left_mm == 0.0:  # half a period from the gap's middle to the foot's
        expected = {(0.7, 0.4), (0.7, 0.5), (0.4, 0.5), (0.4, 0.6)}
    else:
        expected = {(1.3, 0.4), (1.3, 0.5), (1.6, 0.5), (1.6, 0.6)}
    assert found == expected


def test_the_bounds_of_stairs_hold_those_of_other_elements_and_are_narrow():
    cell, known = press2d.cell(stairs(), 2.0), fem2d.capacitance(stairs(), EPS, 1e-5).times(1 / (4e-3 * 8e-3))
    found, coarse = (
        plane_field.capacitance(cell, plane_field.meshed(cell, cell.width_mm() / 4, 0.5, rings), EPS)
        for rings in (6, 0)
    )
    assert found.lower < known.lower < known.upper < found.upper
    assert found.width() < 2e-3
    assert coarse.width() > 4 * found.width()


def test_notches_are_where_solids_fill_more_than_half_a_turn_mirrors_included():
    cell = press2d.cell(stairs(), 2.0)
    found = {(round(x, 6), round(y, 6)) for x, y in mesh.notches(cell)}
    assert found == {(0.7, 0.4), (0.7, 0.5), (0.4, 0.6)}  # and not (0.4, 0.5), where the air does


def test_a_blunt_corner_at_a_mirror_is_a_notch_and_where_two_solids_meet_there_is_none():
    """Two solids, one on the other, over air; under the lower one a slope from one wall to the other."""
    edges = {
        ((0.0, 0.3), (1.0, 0.0)): (1, OUTSIDE),
        ((1.0, 0.0), (1.0, 0.6)): (1, OUTSIDE),
        ((0.0, 0.6), (1.0, 0.6)): (2, 1),
        ((0.0, 0.3), (0.0, 0.6)): (OUTSIDE, 1),
        ((1.0, 0.6), (1.0, 0.8)): (2, OUTSIDE),
        ((0.0, 0.8), (1.0, 0.8)): (OUTSIDE, 2),
        ((0.0, 0.6), (0.0, 0.8)): (OUTSIDE, 2),
    }
    solids = (Region("x60", ""), Region("etpu", "top"))
    assert mesh.notches(ContactCell(edges, solids, 0.0, 1.0, mirrored=True)) == [(0.0, 0.3)]


def test_stairs_are_near_their_limit_on_the_mesh_that_is_used():
    """Rings at the notches: displacement and rise of C within 0.7 % of a mesh half as coarse; 1.4 % without."""
    solids, stress = {"x60": press2d.Elastic(6e6, 0.4999), "etpu": press2d.Elastic(22e6, 0.4999)}, [0.0, 2e4]
    used, finer = (press2d.press(press2d.cell(stairs(), 2.0), solids, stress, EPS, fineness=f) for f in LEVELS)
    assert used.displacement_m[1] == pytest.approx(finer.displacement_m[1], rel=7e-3)
    grown = [f.capacitance_f_per_m2[1].middle() - f.capacitance_f_per_m2[0].middle() for f in (used, finer)]
    assert grown[0] == pytest.approx(grown[1], rel=7e-3)


def test_a_wedge_is_filled_though_its_corners_lie_on_a_line():
    places = [(0.0, 0.0), (1.0, 0.02), (2.0, 0.04), (3.0, 0.06), (3.1, 0.5), (2.0, 0.3), (1.0, 0.15)]
    found = plane_field.filled(range(len(places)), places)
    u, v = (np.array([np.subtract(places[t[k]], places[t[0]]) for t in found]) for k in (1, 2))
    area = (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    x, y = np.array(places).T
    assert area.min() > 1e-3
    assert area.sum() == pytest.approx((x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2, rel=1e-12)
    assert len(found) == len(places) - 2


def test_a_wedge_ends_before_the_way_across_would_cut_its_side():
    """Air between a slope and a step below it; the way across from the slope to the step's foot runs below its head."""
    tip, slope, head, foot = (85.3, 13.4), (42.3, 18.4), (32.6, 15.2), (32.55, 0.0)
    outline = [tip, slope, (0.5, 25.3), (0.0, -15.0), (32.5, -15.0), foot, head]
    edges = dict.fromkeys(zip(outline, [*outline[1:], tip], strict=True), (1, 2))
    assert plane_field.Wedge((tip, slope), (tip, head)) in plane_field.wedges(edges, 1)


def test_a_wedge_ends_before_another_body_stands_in_it():
    """The mesher would not end where the way across runs through the corner of a body."""
    tip, out, beyond, into = (0.0, 0.0), (0.66, 0.88), (1.17, -1.98), (1.38, 3.11)
    outline = [tip, out, beyond, (9.0, -9.0), (9.0, 9.0), into]
    body = [(1.32, 2.87), (3.6, 4.46), (1.5, 2.05)]
    rings_ = [(outline, (1, 2)), (body, (3, 1))]
    edges = {(p, q): sides for ring, sides in rings_ for p, q in zip(ring, [*ring[1:], ring[0]], strict=True)}
    assert plane_field.Wedge((tip, out), (tip, into)) in plane_field.wedges(edges, 1)
