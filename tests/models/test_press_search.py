"""Which faces a ray meets, and which outlines surround a point, against each pair by itself."""

import numpy as np
import pytest
import shapely

from sensorgen.solvers.contact.contact import Rays, hit, winding_number

RANDOM = np.random.default_rng(3)


def test_a_point_is_as_often_inside_as_outlines_surround_it():
    rings = [shapely.Point(x, y).buffer(r, quad_segs=5) for x, y, r in RANDOM.uniform(0.2, 1.0, (7, 3))]
    corners = [shapely.get_coordinates(ring)[::-1] for ring in rings]  # anticlockwise
    points = RANDOM.uniform(-0.5, 2.0, (300, 2))
    found = winding_number(points, *(np.concatenate([c[k : len(c) - 1 + k] for c in corners]) for k in (0, 1)))
    expected = [sum(ring.contains(shapely.Point(p)) for ring in rings) for p in points]
    assert found.tolist() == expected
    assert max(expected) > 2


@pytest.mark.parametrize("inwards", [False, True])
def test_a_ray_meets_the_nearest_face_of_all(inwards):
    """Straight faces: where both lines cross, by Cramer's rule."""
    middles, ways = RANDOM.uniform(0, [10, 1], (60, 2)), RANDOM.uniform(-0.2, 0.2, (60, 2))
    faces = middles[:, None] + np.array([-1, 0, 1])[:, None] * ways[:, None]
    places, turns = RANDOM.uniform(0, [10, 1], (120, 2)), RANDOM.uniform(0, 2 * np.pi, 120)
    turns[:4] = np.arange(4) * np.pi / 2
    tangents = np.column_stack([np.cos(turns), np.sin(turns)])
    normals = tangents[:, ::-1] * [1, -1]
    rays = Rays(places, normals, tangents[:, None])
    depth = np.full(120, 0.1)
    point, face, _, distance = hit(rays, faces, depth, inwards=inwards)
    expected = {}
    for k in range(120):
        met = []
        for j in range(60):
            t, s = np.linalg.solve(np.column_stack([normals[k], -ways[j]]), middles[j] - places[k])
            ahead = -t if inwards else t
            looks = ways[j][::-1] * [1, -1] / np.hypot(*ways[j])
            if abs(s) < 1 and ahead > -0.1 and looks @ normals[k] < -0.1:
                met.append((abs(ahead), ahead, j))
        if met:
            expected[k] = min(met)[1:]
    assert point.tolist() == list(expected)
    assert face.tolist() == [j for _, j in expected.values()]
    assert distance == pytest.approx([t for t, _ in expected.values()], rel=1e-6, abs=1e-12)
    assert len(expected) > 30
