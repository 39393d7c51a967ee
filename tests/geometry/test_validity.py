"""Faults are planted one by one, and seen; the electrode gap is exact."""

from dataclasses import replace

import numpy as np
import pytest

from sensorgen.design.shapes import rect, reference, tri
from sensorgen.scene.geometry.meshes import Mesh, electrode_gap_mm, faults, mesh
from sensorgen.scene.scene import Body, Fill, Prism, Scene, box


def two_plates(*extra: Body, gap_mm: float = 0.2) -> Scene:
    low = Body("low", "etpu", (box(0, 4, 0, 4, 0, 0.3),), "bottom")
    high = Body("high", "etpu", (box(0, 4, 0, 4, 0.3 + gap_mm, 0.6 + gap_mm),), "top")
    return Scene((low, *extra, high), (4, 4, 0.6 + gap_mm))


def made(scene: Scene) -> dict[str, Mesh]:
    return {body.name: mesh(body) for body in scene.bodies}


def found(scene: Scene, **spoiled: Mesh) -> list[tuple[str, str]]:
    return faults(scene, made(scene) | spoiled)


FILM = Body("film", "x60", (box(0, 4, 0, 4, 0.3, 0.5),))


def test_bodies_that_only_share_faces_are_valid():
    assert found(two_plates(FILM)) == []


def spoiled(good, how):
    triangles = good.triangles.copy()
    if how == "a triangle is missing":
        return triangles[1:]
    if how == "open below":
        return triangles[~(good.vertices_mm[triangles][:, :, 2] == 0.3).all(axis=1)]
    triangles[0] = triangles[0, ::-1]
    return triangles


@pytest.mark.parametrize("how", ["a triangle is missing", "open below", "a triangle is flipped"])
def test_a_surface_that_is_not_closed_is_seen(how):
    good = mesh(FILM)
    ((body, what),) = found(two_plates(FILM), film=replace(good, triangles=spoiled(good, how)))
    assert body == "film"
    assert "not a closed oriented surface" in what


def test_a_mesh_turned_inside_out_is_seen():
    good = mesh(FILM)
    ((body, what),) = found(two_plates(FILM), film=replace(good, triangles=good.triangles[:, ::-1]))
    assert (body, what) == ("film", "encloses -3.2 mm3, not 3.2 mm3")


def test_a_seam_with_four_triangles_is_seen():
    """Two cubes that touch along an edge, their vertices welded: manifold3d says NoError, readers of 3MF refuse it."""
    body = Body("cubes", "x60", (box(0, 1, 0, 1, 0, 1), box(1, 2, 1, 2, 0, 1)))
    good = mesh(body)
    places, number = np.unique(good.vertices_mm, axis=0, return_inverse=True)
    welded = Mesh(places, number.reshape(-1)[good.triangles].astype(np.int32))
    scene = Scene((body,), (2, 2, 1))
    assert found(scene) == []
    assert "welded along an edge" in found(scene, cubes=welded)[0][1]


def test_nan_is_seen():
    good = mesh(FILM)
    vertices = good.vertices_mm.copy()
    vertices[0, 0] = np.nan
    assert found(two_plates(FILM), film=replace(good, vertices_mm=vertices))[0][0] == "film"


@pytest.mark.parametrize(("off", "seen"), [(1e-8, True), (1e-10, False)])
def test_a_wrong_volume_is_seen_from_1e_9_on(off, seen):
    taller = mesh(Body("film", "x60", (box(0, 4, 0, 4, 0.3, 0.5 + 0.2 * off),)))
    assert bool(found(two_plates(FILM), film=taller)) is seen


@pytest.mark.parametrize("depth", [1e-3, 1e-6])
def test_overlapping_bodies_are_seen(depth):
    """The film reaches into the lower plate: the volume is by hand."""
    scene = two_plates(Body("film", "x60", (box(0, 4, 0, 4, 0.3 - depth, 0.5),)))
    assert found(scene) == [("low / film", f"overlap by {16 * depth:.3g} mm3")]


def test_prisms_of_one_body_that_overlap_are_seen():
    """Two triangles of base 2 and height 1 whose bases share 1: they share a triangle of area 0.25, 4 deep."""
    teeth = tuple(Prism("y", ((x, 0.3), (x + 2, 0.3), (x + 1, 1.3)), 0.0, 4.0) for x in (0.0, 1.0))
    scene = Scene((Body("teeth", "x60", teeth),), (4, 4, 1.3))
    assert found(scene) == [("teeth", "overlaps itself by 1 mm3")]


def test_boxes_of_one_body_that_overlap_are_seen():
    both = Body("boxes", "x60", (box(0, 2, 0, 1, 0, 1), box(1, 3, 0, 1, 0, 1)))
    assert found(Scene((both,), (3, 1, 1))) == [("boxes", "encloses 3 mm3, not 4 mm3")]


@pytest.mark.parametrize("shape", [tri, rect])
def test_without_a_film_everything_is_valid_but_the_gap(shape):
    """A short passes every test of the bodies (files-and-slicers.md, Meshes): only the gap finds it."""
    scene = shape.scene(shape.Params(length_mm=4.5, width_mm=3.3, dielectric_mm=0.0), Fill())
    assert found(scene) == []
    assert electrode_gap_mm(scene, made(scene)) == 0.0


@pytest.mark.parametrize(("film_mm", "turned"), [(1e-6, False), (0.2, True)])
@pytest.mark.parametrize("shape", [tri, rect, reference])
def test_the_gap_is_the_film(shape, film_mm, turned):
    scene = shape.scene(shape.Params(length_mm=4.5, width_mm=3.3, dielectric_mm=film_mm), Fill())
    scene = scene.turned_over() if turned else scene
    assert electrode_gap_mm(scene, made(scene)) == pytest.approx(film_mm, abs=1e-12)


@pytest.mark.parametrize(("along_x", "along_z", "gap"), [(3, 4, 5.0), (12, 5, 13.0)])  # less and more than the height
def test_the_gap_is_measured_across_a_corner(along_x, along_z, gap):
    low = Body("low", "etpu", (box(0, 1, 0, 1, 0, 1),), "bottom")
    high = Body("high", "etpu", (box(1 + along_x, 2 + along_x, 0, 1, 1 + along_z, 2 + along_z),), "top")
    scene = Scene((low, high), (2 + along_x, 1, 2 + along_z))
    assert electrode_gap_mm(scene, made(scene)) == pytest.approx(gap, abs=1e-12)
