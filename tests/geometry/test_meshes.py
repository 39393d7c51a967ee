"""Meshes against closed forms, and against trimesh and manifold3d as second programs."""

from itertools import product

import manifold3d
import numpy as np
import pytest
import trimesh

from sensorgen.design.shapes import rect, reference, tri
from sensorgen.scene.geometry.meshes import Mesh, mesh
from sensorgen.scene.scene import Body, Fill, Prism, box


def second_program(made: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(made.vertices_mm, made.triangles, process=False)


def assert_solid(made: Mesh, volume_mm3: float, shells: int | None = None) -> None:
    """Closed, oriented outwards and of that volume, says each of two other programs."""
    other = second_program(made)
    assert other.is_watertight
    assert other.is_winding_consistent
    assert other.volume == pytest.approx(volume_mm3, rel=1e-9)
    third = made.solid()
    assert third.status() == manifold3d.Error.NoError
    assert third.volume() == pytest.approx(volume_mm3, rel=1e-9)
    assert made.volume_mm3() == pytest.approx(volume_mm3, rel=1e-9)
    if shells is not None:
        assert other.body_count == shells


def cubes(*corners: tuple[int, int, int]) -> Body:
    """Unit cubes at some corners."""
    return Body("cubes", "x60", tuple(box(x, x + 1, y, y + 1, z, z + 1) for x, y, z in corners))


ODD = {"length_mm": 7.13, "width_mm": 3.3, "electrode_mm": 0.31, "isolation_mm": 0.07}
VARIANTS = [
    (tri, ODD | {"along": "y"}),
    (tri, ODD | {"period_mm": 0.7, "hang_height_mm": 1.3, "lower_height_mm": 0.01, "dielectric_mm": 1e-6}),
    (tri, {"length_mm": 1.001, "dielectric_mm": 0.0}),
    (rect, ODD | {"along": "yx", "etpu_width_mm": 0.13, "air_width_mm": 0.29, "dielectric_mm": 0.0}),
    (reference, ODD),
]


@pytest.mark.parametrize(("shape", "options"), VARIANTS)
def test_every_body_is_a_solid_of_its_closed_form_volume(shape, options):
    """The bodies' own volumes are held against closed forms in test_scene.py and properties/test_bodies.py."""
    scene = shape.scene(shape.Params(**options), Fill(support="bvoh", film="pla"))
    for changed in (scene, scene.turned_over(), scene.stretched(1 / (1 - 0.2))):
        for body in changed.bodies:
            assert_solid(mesh(body), body.volume_mm3())


@pytest.mark.parametrize("axis", "xyz")
def test_a_prism_stands_where_it_should(axis):
    """A triangle of base 2 and height 1 from 3 to 5: volume 2, centroid by hand."""
    prism = Prism(axis, ((0.0, 0.0), (2.0, 0.0), (1.0, 1.0)), 3.0, 5.0)
    made = second_program(mesh(Body("prism", "x60", (prism,))))
    first, second = ("xyz".index(a) for a in {"x": "yz", "y": "xz", "z": "xy"}[axis])
    centroid = np.full(3, 4.0)
    centroid[[first, second]] = 1.0, 1 / 3
    assert made.volume == pytest.approx(2.0, rel=1e-14)
    assert made.center_mass == pytest.approx(centroid, rel=1e-12)


def test_a_concave_outline_is_filled_once():
    """A sawtooth with three teeth of 1 x 1 / 2 on a plate of 3 x 0.5, and 2 deep."""
    teeth = ((3.0, 0.5), (2.5, 1.5), (2.0, 0.5), (1.5, 1.5), (1.0, 0.5), (0.5, 1.5), (0.0, 0.5))
    body = Body("teeth", "x60", (Prism("y", ((0.0, 0.0), (3.0, 0.0), *teeth), 0.0, 2.0),))
    assert_solid(mesh(body), (1.5 + 1.5) * 2.0, shells=1)


def test_cubes_that_share_a_face_are_one_shell():
    made = mesh(cubes((0, 0, 0), (1, 0, 0)))
    assert_solid(made, 2.0, shells=1)
    assert len(made.vertices_mm) == 12


@pytest.mark.parametrize("diagonal", [(1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 1, 1)])
def test_cubes_that_touch_along_an_edge_or_at_a_corner_keep_their_own_vertices(diagonal):
    made = mesh(cubes((0, 0, 0), diagonal))
    assert_solid(made, 2.0, shells=2)
    assert len(made.vertices_mm) == 16


def test_all_ways_of_eight_cubes_around_a_point_are_solids():
    """Every one of the 255 patterns: edges, corners, rings and hollows in all orientations."""
    corners = list(product((0, 1), repeat=3))
    for pattern in range(1, 256):
        body = cubes(*(c for k, c in enumerate(corners) if pattern >> k & 1))
        made = mesh(body)
        assert made.solid().status() == manifold3d.Error.NoError, pattern
        assert made.volume_mm3() == pytest.approx(len(body.pieces), rel=1e-12), pattern
        edges = np.sort(made.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        assert set(np.unique(edges, axis=0, return_counts=True)[1]) == {2}, pattern


def test_a_block_with_a_hole_has_the_euler_number_of_a_torus():
    ring = cubes(*(c for c in product((0, 1, 2), (0, 1, 2), (0,)) if c != (1, 1, 0)))
    made = second_program(mesh(ring))
    assert_solid(mesh(ring), 8.0, shells=1)
    assert made.euler_number == 0


def test_crossed_strips_are_one_shell_and_separate_strips_are_many():
    scene = rect.scene(rect.Params(length_mm=8.0, width_mm=4.0), Fill())
    assert second_program(mesh(scene.body("top_electrode_with_cogs"))).body_count == 1
    assert second_program(mesh(scene.body("hanging_dielectric"))).body_count == 2  # one per period over the width
