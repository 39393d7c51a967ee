"""Surfaces become the prisms that they were drawn as."""

import numpy as np
import pytest
import trimesh

from sensorgen.core import lazy as registry
from sensorgen.design import shapes
from sensorgen.scene.geometry import surfaces
from sensorgen.scene.geometry.meshes import mesh
from sensorgen.scene.geometry.surfaces import pieces
from sensorgen.scene.polyhedra import Polyhedron
from sensorgen.scene.scene import Body, Fill, Prism


def again(body):
    made = mesh(body)
    found = surfaces.closed(made.vertices_mm, made.triangles.astype(np.int64))
    assert not found.faults
    return pieces(found.shells)


@pytest.mark.parametrize(
    ("name", "given"), [("tri", {"along": "x"}), ("tri", {"along": "y"}), ("rect", {"along": "xy"}), ("reference", {})]
)
def test_bodies_of_shapes_are_prisms_again(name, given):
    shape = registry.load(shapes, name)
    scene = shape.scene(shape.Params(length_mm=5.3, width_mm=4.7, isolation_mm=0.1, **given), Fill(support="bvoh"))
    for body in scene.bodies:
        found = again(body)
        assert all(isinstance(piece, Prism) for piece in found)
        assert sum(piece.volume_mm3() for piece in found) == pytest.approx(body.volume_mm3(), rel=1e-9)
        if not all(piece.is_box() for piece in body.pieces):
            corners = {(p.axis, p.start_mm, frozenset(p.outline)) for p in found}
            assert corners == {(p.axis, p.start_mm, frozenset(_bent(p.outline))) for p in body.pieces}


def _bent(outline):
    """Corners of an outline where it changes its direction."""
    turned = zip(outline[-1:] + outline[:-1], outline, outline[1:] + outline[:1], strict=True)
    return [
        tuple(round(v, 9) for v in b)
        for a, b, c in turned
        if abs((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])) > 1e-9
    ]


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_an_extrusion_along_any_axis_is_one_prism(axis):
    outline = ((0.0, 0.0), (3.0, 0.0), (2.0, 1.0), (2.5, 2.0), (0.0, 2.0))
    (found,) = again(Body("a", "m", (Prism(axis, outline, 1.0, 4.0),)))
    assert (found.axis, set(found.outline), found.start_mm, found.end_mm) == (axis, set(outline), 1.0, 4.0)


def test_plates_with_holes_and_steps_are_stacks_of_prisms():
    plate = trimesh.creation.extrude_polygon(trimesh.path.polygons.Polygon(
        [(0, 0), (8, 0), (8, 5), (0, 5)], [[(2, 2), (4, 3), (2, 4)]]), 0.5)  # fmt: skip
    found = pieces(surfaces.closed(plate.vertices, plate.faces.astype(np.int64)).shells)
    assert {piece.axis for piece in found} == {"z"}
    assert sum(piece.volume_mm3() for piece in found) == pytest.approx((40 - 2) * 0.5)
    step = trimesh.boolean.union([plate, trimesh.creation.cylinder(1.0, 1.0).apply_translation((6, 2.5, 0.5))])
    found = pieces(surfaces.closed(step.vertices, step.faces.astype(np.int64)).shells)
    assert all(isinstance(piece, Prism) for piece in found)
    assert sum(piece.volume_mm3() for piece in found) == pytest.approx(step.volume, rel=1e-6)
    assert {round(z, 6) for piece in found for z in piece.span("z")} == {0.0, 0.5, 1.0}


def test_what_is_slanted_or_round_stays_a_polyhedron():
    ball = trimesh.creation.icosphere(2, 2.0)
    (found,) = pieces(surfaces.closed(ball.vertices, ball.faces.astype(np.int64)).shells)
    assert isinstance(found, Polyhedron)
    assert found.volume_mm3() == pytest.approx(ball.volume, rel=1e-9)
