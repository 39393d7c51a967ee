"""Rings of triangles at corners: what they fill, where they stand, and that the field's bounds close in by them."""

import numpy as np
import pytest

pytest.importorskip("netgen", reason="pip install 'sensorgen[fem]'")

from sensorgen.models import fem2d, press2d
from sensorgen.models._press import field, mesh, rings
from sensorgen.scene import Body, Scene, box

EPS = {"x60": 4.68, "air": 1.00059}


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


def test_rings_fill_the_same_place_and_share_all_sides():
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.4, 0.5]], float)
    triangles = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    found, cut, region = rings.ringed(points, triangles, np.array([1, 2, 3, 4]), [4, 0])
    u, v = (found[cut[:, k]] - found[cut[:, 0]] for k in (1, 2))
    area = (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    assert area.min() > 0
    assert np.bincount(region, area)[1:] == pytest.approx([0.25, 0.3, 0.25, 0.2], rel=1e-12)
    inner, outer = mesh.of_triangles(found, cut, region), mesh.of_triangles(points, triangles, np.arange(4))
    assert inner.lengths_m().sum() == pytest.approx(outer.lengths_m().sum(), rel=1e-12)  # no gaps within
    near = np.sort(np.hypot(*(found - points[4]).T))[1:5]
    assert near == pytest.approx(np.sort(np.hypot(*(points[:4] - points[4]).T)) / 64, rel=0.5)


def test_corners_are_where_solid_and_air_or_plates_turn_and_where_three_meet():
    cell = press2d.cell(stairs(), 2.0)
    found = {(round(x, 6), round(y, 6)) for x, y in rings.corners(cell.edges, cell.left_mm, cell.right_mm)}
    if cell.left_mm == 0.0:  # half a period from the gap's middle to the foot's
        expected = {(0.7, 0.4), (0.7, 0.5), (0.4, 0.5), (0.4, 0.6)}
    else:
        expected = {(1.3, 0.4), (1.3, 0.5), (1.6, 0.5), (1.6, 0.6)}
    assert found == expected


def test_the_bounds_of_stairs_hold_those_of_other_elements_and_are_narrow(monkeypatch):
    cell, known = press2d.cell(stairs(), 2.0), fem2d.capacitance(stairs(), EPS, 1e-5).times(1 / (4e-3 * 8e-3))
    found = field.capacitance(cell, EPS, cell.width_mm() / 4, 0.5)
    assert found.lower < known.lower < known.upper < found.upper
    assert found.width() < 2e-3
    monkeypatch.setattr(rings, "_RINGS", 0)
    assert field.capacitance(cell, EPS, cell.width_mm() / 4, 0.5).width() > 4 * found.width()
