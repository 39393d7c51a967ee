"""Closed surfaces from triangles in any state: each fault planted, then seen, placed or put right."""

import numpy as np
import pytest
import trimesh

from sensorgen.scene.geometry import surfaces
from sensorgen.scene.geometry.meshes import Mesh


def cube(size=1.0, at=(0.0, 0.0, 0.0)):
    made = trimesh.creation.box((size,) * 3)
    return made.vertices + size / 2 + at, made.faces.astype(np.int64)


def soup(*bodies):
    """Triangles that share no corners, as STL has them."""
    points = np.concatenate([vertices[faces].reshape(-1, 3) for vertices, faces in bodies])
    return points, np.arange(len(points)).reshape(-1, 3)


def volumes(found):
    return [pytest.approx(shell.volume_mm3()) for shell in found.shells]


def test_a_soup_is_one_surface():
    found = surfaces.closed(*soup(cube()))
    assert (volumes(found), found.repairs, found.faults) == ([1.0], (), ())
    assert len(found.shells[0].vertices_mm) == 8


@pytest.mark.parametrize("at", [(1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (1.0, 1.0, 1.0)], ids=["face", "edge", "corner"])
def test_solids_that_touch_stay_two(at):
    found = surfaces.closed(*soup(cube(), cube(at=at)))
    assert (volumes(found), found.repairs, found.faults) == ([1.0, 1.0], (), ())
    for shell in found.shells:
        assert trimesh.Trimesh(shell.vertices_mm, shell.triangles, process=False).is_watertight


def test_a_missing_face_is_closed_and_said_so():
    points, faces = cube()
    whole = [face for face in faces if not np.allclose(points[face][:, 2], 1.0)]
    found = surfaces.closed(points, np.array(whole))
    assert volumes(found) == [1.0]
    assert found.repairs == ("a flat opening of 4 sides closed at x 0.5, y 0.5, z 1 mm",)


def test_an_opening_that_is_not_flat_is_refused_with_its_place():
    made = trimesh.creation.icosphere(2, 3.0)
    high = made.vertices[made.faces].mean(1)
    found = surfaces.closed(made.vertices, made.faces[(high[:, 0] < 2.0) | (abs(high[:, 2]) > 1.0)].astype(np.int64))
    assert not found.shells
    (fault,) = found.faults
    assert "a gap with an edge of" in fault.message
    assert np.linalg.norm(np.array(fault.place_mm) - (2.8, 0.0, 0.0)) < 1.0


def test_faces_turned_inwards_are_turned_out():
    points, faces = cube()
    faces[[2, 7]] = faces[[2, 7], ::-1]
    found = surfaces.closed(points, faces)
    assert volumes(found) == [1.0]
    assert found.repairs == ("2 faces turned to look outwards like their neighbours",)
    inside_out = surfaces.closed(points, cube()[1][:, ::-1])
    assert volumes(inside_out) == [1.0]
    assert inside_out.repairs == ("1 surfaces that were inside out turned",)


def test_faces_that_are_there_twice_go():
    points, faces = cube()
    found = surfaces.closed(points, np.concatenate([faces, faces[3:5]]))
    assert (volumes(found), found.repairs) == ([1.0], ("2 faces that are there twice removed",))


def test_gaps_of_rounding_close():
    points, faces = soup(cube())
    shaken = points + np.random.default_rng(1).uniform(-2e-4, 2e-4, points.shape)
    found = surfaces.closed(shaken, faces)
    assert found.shells[0].volume_mm3() == pytest.approx(1.0, abs=2e-3)
    assert found.repairs == ("gaps of up to 0.001 mm closed",)


def test_a_cavity_stays_one():
    inner, faces = cube(0.5, (0.25, 0.25, 0.25))
    found = surfaces.closed(*soup(cube(), (inner, faces[:, ::-1])))
    assert (volumes(found), found.repairs) == ([1.0, -0.125], ())


@pytest.mark.parametrize(
    ("points", "faces", "message"),
    [
        ([(0, 0, 0), (4, 0, 0), (4, 2, 0)], [(0, 1, 2), (0, 2, 1)], "encloses nothing"),
        ([(np.nan, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)], "are no numbers"),
    ],
)
def test_what_is_no_body_is_refused(points, faces, message):
    found = surfaces.closed(np.array(points, float), np.array(faces))
    assert not found.shells
    assert message in found.faults[0].message


def test_a_fin_inside_a_body_is_refused_where_it_is():
    points, faces = cube()
    corner = [np.flatnonzero((points == at).all(1))[0] for at in ((0, 0, 0), (1, 1, 0), (1, 1, 1), (0, 0, 1))]
    fin = [[corner[0], corner[1], corner[2]], [corner[0], corner[2], corner[3]]]
    found = surfaces.closed(points, np.concatenate([faces, fin]))
    assert not found.shells
    assert all(0.0 <= value <= 1.0 for fault in found.faults for value in fault.place_mm)


def test_faces_that_pass_through_each_other_are_placed():
    points, faces = cube()
    subdivided = trimesh.Trimesh(points, faces).subdivide().subdivide()
    vertices = subdivided.vertices.copy()
    top = np.flatnonzero((abs(vertices - (0.5, 0.5, 1.0)) < 1e-9).all(1))
    assert surfaces.crossing(Mesh(vertices, subdivided.faces.astype(np.int32))) is None
    vertices[top] = 0.4, 0.4, -1.0  # pulled through the bottom
    place = surfaces.crossing(Mesh(vertices, subdivided.faces.astype(np.int32)))
    assert place is not None
    assert place[2] == pytest.approx(0.0, abs=0.3)
    assert np.hypot(place[0] - 0.45, place[1] - 0.45) < 0.3
