"""Boxes under pressure: closed forms, the plane-strain model, another field solver, and what must not change."""

from itertools import pairwise, product

import numpy as np
import pytest
from neo_hooke import check_derivatives, stretches
from scipy.sparse import csr_matrix

from sensorgen.core.bounds import Interval
from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.design.design import make
from sensorgen.models import fem2d, press2d, press3d, springs
from sensorgen.models.press3d import BoundaryConditions, BrickCounts, Elastic
from sensorgen.prediction.mesh_ladder import limit
from sensorgen.scene.scene import Body, Scene, box
from sensorgen.solvers.contact import contact, element, factors, mapped_field
from sensorgen.solvers.contact import mapped_field as air
from sensorgen.solvers.contact.bricks import Bricks, mesh_of
from sensorgen.solvers.contact.cell import Region
from sensorgen.solvers.contact.mapped_field import FieldOrders

EPS = {"x60": 4.68, "air": 1.00059}
REGIONS = (Region("air", ""), Region("x60", ""), Region("etpu", "bottom"), Region("etpu", "top"))
COARSE = BrickCounts(2, 0.5)


def solids(nu=0.4999, x60=6e6, etpu=22e6):
    return {"x60": Elastic(x60, nu), "etpu": Elastic(etpu, nu)}


def rect(film=0.1, **more):
    return make({"shape": "rect", "parameters": {"dielectric_mm": film, **more}}).in_use


def boxes(planes_mm, fill):
    x, y, z = (np.array(p, float) * 1e-3 for p in planes_mm)
    return Bricks((x, y, z), np.array(fill), REGIONS)


@pytest.fixture(scope="module")
def pressed_rect():
    """At 0, 50 and 100 kPa on a coarse mesh."""
    return press3d.press(press3d.cell(rect()), solids(), [0.0, 5e4, 1e5], EPS, fineness=COARSE)


@pytest.mark.parametrize(
    ("nu", "period"),
    [(0.4999, "fixed"), (0.3, "free"), (0.5, "free")],
)
def test_a_block_follows_the_closed_form(nu, period):
    """Homogeneous neo-Hookean block: stretch a across in both directions, b along the load; at a third of E."""
    block = boxes(((0, 0.3, 1), (0, 0.6, 1), (0, 0.2, 1)), np.ones((2, 2, 2), int))
    found = press3d.press(
        block, solids(nu), [0.0, 1e6, 2e6], None, BoundaryConditions("sliding", period), BrickCounts(1)
    )

    exact = [1 - stretches(s, 6e6, nu, period, 2)[1] for s in (1e6, 2e6)]
    assert found.faults == ()
    assert found.displacement_m[1:] == pytest.approx(np.array(exact) * 1e-3, rel=1e-6, abs=0)


def test_the_tangent_is_the_derivative_of_the_residual_and_that_of_the_energy():
    mesh = mesh_of(boxes(((0, 1, 1.7), (0, 0.6), (0, 0.5, 2)), np.ones((2, 1, 2), int)), np.ones((2, 1, 2), bool))
    m, rng = len(mesh.nodes), np.random.default_rng(1)
    u = rng.normal(size=3 * len(mesh.points_m)) * 2e-5
    inner = element.Inner(rng.normal(size=(m, 3)) * 1e-5, rng.normal(size=(m, 4)))
    moved, moved_inner = rng.normal(size=len(u)) * 1e-3, rng.normal(size=(m, 7)) * ([1e-3] * 3 + [1] * 4)
    elements = element.Elements(mesh, element.law(np.full(m, 6.0), np.full(m, 0.49)))
    check_derivatives(elements, u, inner, moved, moved_inner)


@pytest.mark.parametrize(("thick", "stiffer"), [(0.2, 830.4)])
def test_a_bonded_strip_does_not_lock(thick, stiffer):
    """Upper half of a strip 10 mm wide bonded to stiff plates, sides free, incompressible: solved in 2D elsewhere."""
    x = np.append(5 * (1 - (1 - np.linspace(0, 1, 25)) ** 1.5), 5.5)
    fill = np.ones((25, 1, 3), int)
    fill[-1] = 0
    block = boxes((x, (0, 0.1), np.linspace(0, thick / 2, 4)), fill)
    stress = 1e-4 * stiffer * 6e6
    found = press3d.press(block, solids(0.5), [0.0, stress], None, BoundaryConditions(top="rigid"), BrickCounts(1))
    strain = found.displacement_m[-1] / (thick / 2 * 1e-3)
    assert stress / strain / 6e6 == pytest.approx(stiffer, rel=0.02)


def test_a_plate_between_mirrors_is_confined_and_a_free_one_widens():
    plate = press3d.cell(make({"shape": "reference"}).in_use)
    found = press3d.press(plate, solids(), [0.0, 1e5], EPS, fineness=BrickCounts(1))
    confined = {k: s.youngs_modulus_pa * (1 - 0.4999) / (1.4999 * 2e-4) for k, s in solids().items()}
    assert found.displacement_m[-1] == pytest.approx(1e5 * 0.6e-3 * sum(1 / m for m in confined.values()), rel=1e-4)
    assert found.capacitance_f_per_m2[0].middle() == pytest.approx(0.27625066e-12 / 4e-6, rel=1e-6, abs=0)
    rise = found.capacitance_f_per_m2[1].middle() / found.capacitance_f_per_m2[0].middle() - 1
    assert rise == pytest.approx(1e5 / confined["x60"], rel=1e-3)
    loose = press3d.press(plate, solids(), [0.0, 1e3], EPS, BoundaryConditions("sliding", "free"), BrickCounts(1))
    rise = loose.capacitance_f_per_m2[1].middle() / loose.capacitance_f_per_m2[0].middle() - 1
    biaxial = {k: s.youngs_modulus_pa / (1 - 0.4999) for k, s in solids().items()}  # all layers widen alike
    wide = 1e3 * 0.4999 * sum(1.2e-3 / 2 / 0.5001 for _ in range(2)) / sum(0.6e-3 * m for m in biaxial.values())
    thinner = 1e3 * (1 - 2 * 0.4999) * 1.4999 / (0.5001 * 6e6) + 2 * 0.4999 / 0.5001 * wide
    assert rise == pytest.approx(thinner + 2 * wide, rel=5e-3)  # of the whole sensor, over its area as drawn


def test_rect_is_softer_than_solid_stiffer_than_springs_and_work_is_stored(pressed_rect):
    moved = pressed_rect.displacement_m
    assert pressed_rect.faults == ()
    assert pressed_rect.doubts == ()
    assert moved[2] * 1e6 == pytest.approx(6.56, rel=0.03)  # extrapolated from finer meshes; 6.6 published
    bound = springs.displacement_m(rect(), {"x60": 6e6, "etpu": 22e6}, [1e5])[0]
    assert 100 * 0.007634e-6 < moved[2] < bound
    assert moved[2] / moved[1] == pytest.approx(2, rel=0.02)
    assert abs(pressed_rect.imbalance[-1]) < 1e-3
    rises = [[getattr(c, k) for c in pressed_rect.capacitance_f_per_m2] for k in ("lower", "upper")]
    assert [r[2] / r[0] - 1 for r in rises] == pytest.approx([0.0101, 0.0101], rel=0.08)  # 1.0 % published


def test_bounds_hold_the_reference_and_close_in():
    widths = []
    for fineness, orders in (
        (BrickCounts(2, 0.4), FieldOrders(2, 1)),
        (BrickCounts(2, 0.4), FieldOrders()),
        (BrickCounts(3, 0.3), FieldOrders()),
    ):
        bricks = press3d.cell(rect()).cut(fineness.pieces, fineness.shrink)
        found = unmoved(bricks, orders).times(4e-6)
        assert found.lower < 0.812343e-12 < found.upper  # by two other solvers, to 2.6e-5
        widths.append(found.width())
    assert all(after < 0.6 * before for before, after in pairwise(widths))


def unmoved(bricks, orders):
    mesh = mesh_of(bricks, np.ones(bricks.fill.shape, bool))
    return mapped_field.MappedField(mesh, EPS, orders).capacitance(np.zeros(3 * len(mesh.points_m)))


def test_bounds_from_the_factors_of_an_earlier_load_hold_those_of_new_ones(monkeypatch):
    """Unfinished solutions are certified too: outside those that are solved anew, and how far is known."""
    bricks = press3d.cell(rect(0.1)).cut(1, 0.3)
    mesh = mesh_of(bricks, np.ones(bricks.fill.shape, bool))
    u = np.zeros((len(mesh.points_m), 3))
    u[:, 2] = -20e-6 * np.clip((mesh.points_m[:, 2] - 0.3e-3) / 0.1e-3, 0, 1)
    for small in (1e-2, 1e-7):
        monkeypatch.setattr(mapped_field, "_SMALL", small)
        cell = mapped_field.MappedField(mesh, EPS, FieldOrders())
        cell.capacitance(0 * u.ravel())
        made = {name: kept.factors for name, kept in cell.systems.items()}
        for share in (0.5, 1.0, -1.0):
            found = cell.capacitance(share * u.ravel())
            monkeypatch.setattr(mapped_field, "_SMALL", 1e-12)
            new = mapped_field.MappedField(mesh, EPS, FieldOrders()).capacitance(share * u.ravel())
            monkeypatch.setattr(mapped_field, "_SMALL", small)
            assert new.lower * (1 - 2 * small) < found.lower <= new.lower * (1 + 1e-12)
            assert new.upper * (1 - 1e-12) <= found.upper < new.upper * (1 + 2 * small)
        assert all(kept.factors is made[name] for name, kept in cell.systems.items())


def test_where_a_plates_inner_places_go_does_not_matter():
    """The same plate mapped to itself in any way: its capacitance stays between the bounds, which close in."""
    planes = (np.linspace(0, 1, 4), np.linspace(0, 1, 4), (0, 0.1, 0.3, 0.5, 0.7, 0.8))
    fill = np.ones((3, 3, 5), int)
    fill[..., 0], fill[..., -1] = 2, 3
    mesh = mesh_of(boxes(planes, fill), np.ones((3, 3, 5), bool))
    x, y, z = mesh.points_m.T * 1e3
    bump = np.sin(np.pi * x) * np.sin(np.pi * y) * np.sin(np.pi * np.clip((z - 0.1) / 0.6, 0, 1))
    u = 1e-3 * np.column_stack([0.08 * bump, -0.05 * bump, 0.07 * bump])
    exact = 8.8541878128e-12 * 4.68 / 0.6e-3
    widths = []
    for orders in (FieldOrders(2, 1), FieldOrders(4, 3)):
        found = mapped_field.MappedField(mesh, EPS, orders).capacitance(u.ravel())
        assert found.lower < exact < found.upper
        widths.append(found.width())
    assert widths[1] < 0.02 * widths[0]
    with pytest.raises(mapped_field.Folded):
        mapped_field.MappedField(mesh, EPS, FieldOrders(2, 1)).capacitance(12 * u.ravel())


def stairs(*widths, lift=0.0, film=0.1):
    """A top on bars along y: half widths of the layers of 0.1 mm from below, around x = 0.5 and 2.5."""
    floor, deep = 0.3 + film + lift, 8.0
    bars = [
        box(c - w, c + w, 0, deep, floor + 0.1 * k, floor + 0.1 * (k + 1))
        for c in (0.5, 2.5)
        for k, w in enumerate(widths)
    ]
    roof = floor + 0.1 * len(widths)
    bodies = (
        Body("bottom_electrode", "etpu", (box(0, 4, 0, deep, 0, 0.3),), "bottom"),
        Body("film", "x60", (box(0, 4, 0, deep, 0.3, 0.3 + film),)),
        Body("feet", "x60", tuple(bars)),
        Body("top_electrode", "etpu", (box(0, 4, 0, deep, roof, roof + 0.3),), "top"),
    )
    return Scene(bodies, (4.0, deep, roof + 0.3))


@pytest.mark.parametrize("slid_mm", [0.02, -0.02])
def test_a_foot_that_has_landed_and_widened_is_one_drawn_so(slid_mm):
    """Most of a brick's half sideways, onto a film that stays: the field of the drawn foot, by another solver."""
    bricks = press3d.cell(stairs(0.2, lift=0.02)).cut(3, 0.3)
    whole, solid = (mesh_of(bricks, w) for w in (np.ones(bricks.fill.shape, bool), bricks.fill > 0))
    x, _, z = solid.points_m.T * 1e3
    above = z > 0.41
    moved = np.zeros_like(solid.points_m)
    moved[above, 0] = 1e-3 * np.interp(x[above], [0.5, 0.7, 1.5], [0.0, slid_mm, 0.0])
    moved[above, 2] = -2e-5
    u = air.AirMap(whole, solid).displacements_m(moved, 1e-4)
    found = mapped_field.MappedField(whole, EPS, FieldOrders()).capacitance(u)
    drawn = fem2d.capacitance(stairs(0.2 + slid_mm), EPS, 1e-5).times(1 / 32e-6)
    assert found.width() < 2e-3
    assert found.lower < drawn.upper * (1 + 1e-4)
    assert drawn.lower < found.upper * (1 + 1e-4)


@pytest.mark.parametrize("lift", [pytest.param(0.0, marks=pytest.mark.nightly), 0.02])
def test_stairs_as_boxes_are_stairs_as_a_cross_section(lift):
    """Bars along y are pressed alike by both models, bonded or falling onto the film and slipping on it."""
    scene, stress = stairs(0.2, 0.3, lift=lift), [0.0, 1e4, 2e4]
    flat = press2d.press(press2d.cell(scene, 2.0), solids(), stress, EPS)
    solid = press3d.press(press3d.cell(scene), solids(), stress, EPS, fineness=BrickCounts(2, 0.4))
    assert flat.faults == solid.faults == ()
    assert solid.fall_m == pytest.approx(lift * 1e-3, rel=1e-9)
    own = [f.displacement_m[1:] - f.fall_m for f in (flat, solid)]
    assert own[1] == pytest.approx(own[0], rel=0.033 if lift else 0.02)
    assert ("faces of gaps touch, without friction" in solid.doubts) == (lift > 0)
    grown = [[c.middle() for c in f.capacitance_f_per_m2] for f in (flat, solid)]
    assert grown[1] == pytest.approx(grown[0], rel=2e-3)
    assert grown[1][2] / grown[1][0] - 1 == pytest.approx(grown[0][2] / grown[0][0] - 1, rel=0.01 if lift else 0.04)


def test_feet_that_stick_are_stiffer_by_as_much_as_in_a_cross_section():
    """By how much sticking stiffens, against a fine mesh of the plane model: its first one is 4 % off in that."""
    scene, stress = stairs(0.3, lift=0.02), [0.0, 2e4]
    moved = {}
    for kind in ("frictionless", "stick"):
        held = BoundaryConditions(contact=kind)
        flat = press2d.press(press2d.cell(scene, 2.0), solids(), stress, None, held, press2d.Fineness().finer())
        solid = press3d.press(press3d.cell(scene), solids(), stress, None, held, BrickCounts(2, 0.4))
        assert flat.faults == solid.faults == ()
        assert abs(solid.imbalance[-1]) < 2e-3
        moved[kind] = flat.displacement_m[1], solid.displacement_m[1]
    less = [moved["stick"][k] / moved["frictionless"][k] - 1 for k in range(2)]
    assert less[1] == pytest.approx(less[0], rel=0.03)
    assert less[1] < -1e-3
    assert "faces of gaps touch, and hold fast" in solid.doubts


def test_points_meet_the_nearest_face_along_their_normal():
    """A bent sheet over a flat one: the place on it, its distance and normal, are those of the parabola that it is."""
    gap = boxes(((0, 1, 2), (0, 1), (0, 0.1, 0.3, 0.4)), [[[1, 0, 1]]] * 2)
    mesh = mesh_of(gap, gap.fill > 0)
    x, y, z = mesh.points_m.T
    moved = mesh.points_m.copy()
    above = z > 0.2e-3
    moved[above, 2] += 100 * x[above] ** 2 - 1e-4 * y[above] * 1e3
    moved[above, 0] += 2e-4 + 50 * x[above] * y[above]
    faces = contact.brick_faces_of(mesh)
    rays = faces.rays(moved)
    point, face, s, distance = contact.hit(rays, moved[faces.nodes], np.full(len(rays.here_m), 1e-3))
    flat = np.abs(rays.here_m[:, 2] - 1e-4) < 1e-9
    drawn = (rays.here_m[:, 0] - 2e-4) / (1 + 50 * rays.here_m[:, 1])
    up = flat[point]
    assert point[up].tolist() == np.flatnonzero(flat & (drawn > 0)).tolist()
    here, drawn, distance = rays.here_m[point[up]], drawn[point[up]], distance[up]
    assert distance == pytest.approx(0.3e-3 + 100 * drawn**2 - 0.1 * here[:, 1] - here[:, 2], rel=1e-9, abs=0)
    place, normal = contact.on_faces(s[up], moved[faces.nodes[face[up]]])
    assert place == pytest.approx(here + np.outer(distance, [0, 0, 1]), abs=1e-15)
    sideways = 200 * drawn / (1 + 50 * here[:, 1])
    slopes = np.column_stack([sideways, -0.1 - sideways * 50 * drawn])
    assert normal[:, :2] / -normal[:, 2:] == pytest.approx(slopes, rel=1e-9)


def test_a_block_that_bulges_to_a_mirror_meets_its_image():
    """Two soft blocks beside a slot, and one of them beside the mirror in its middle."""
    soft = {"x60": Elastic(1e6, 0.49), "etpu": Elastic(1e9, 0.3)}
    stress = [0.0, 1e5, 2e5, 3e5]
    twice = boxes(((0, 0.4, 0.404, 0.804), (0, 0.2), (0, 0.1, 0.5, 0.6)), [[[2, 1, 3]], [[2, 0, 3]], [[2, 1, 3]]])
    once = boxes(((0, 0.4, 0.402), (0, 0.2), (0, 0.1, 0.5, 0.6)), [[[2, 1, 3]], [[2, 0, 3]]])
    both, half = (press3d.press(cell, soft, stress, None, fineness=BrickCounts(2, 0.6)) for cell in (twice, once))
    assert both.faults == half.faults == ()
    assert half.displacement_m == pytest.approx(both.displacement_m, rel=2e-3, abs=1e-15)
    moved = np.diff(half.displacement_m)
    assert moved[2] < 0.65 * moved[0]


def test_incompressible_is_the_limit():
    softer, limit = (
        press3d.press(press3d.cell(rect()), solids(nu), [0.0, 2e4], fineness=BrickCounts(1)).displacement_m[-1]
        for nu in (0.4999, 0.5)
    )
    assert softer > limit > 0.995 * softer


def test_what_is_wrong_is_refused():
    with pytest.raises(BadInput, match="needs a scene of boxes"):
        press3d.cell(make({"shape": "tri"}).in_use)
    assert "needs a scene of boxes" in press3d.why_not_applicable(make({"shape": "tri"}).in_use)
    over = Scene((Body("a", "x60", (box(0, 1, 0, 1, 0, 1),)), Body("b", "etpu", (box(0, 1, 0, 1, 0.5, 2),))), (1, 1, 2))
    with pytest.raises(BadInput, match="b overlaps"):
        press3d.cell(over)
    touching = boxes(((0, 1), (0, 1), (0, 1, 2, 3)), [[[2, 3, 1]]])
    with pytest.raises(BadInput, match="no dielectric lies between"):
        unmoved(touching, FieldOrders())
    shorted = boxes(((0, 1, 2), (0, 1), (0, 1, 2, 3)), [[[2, 1, 3]], [[2, 3, 3]]])
    with pytest.raises(OutOfRange, match="electrodes touch"):
        unmoved(shorted, FieldOrders())
    open_ended = boxes(((0, 1, 2), (0, 1), (0, 1, 2, 3)), [[[2, 1, 3]], [[2, 1, 1]]])
    with pytest.raises(BadInput, match="does not cover"):
        unmoved(open_ended, FieldOrders())


def test_many_boxes_are_cut_into_fewer_pieces_and_that_is_said(monkeypatch):
    monkeypatch.setattr(press3d, "_MOST", 50)
    found = press3d.press(press3d.cell(rect()), solids(), [0.0, 1e4])
    assert "cut into 1 pieces along each axis, not 3" in found.doubts[0]


def test_conjugate_gradients_make_new_factors_where_the_old_ones_do_not_serve():
    rng = np.random.default_rng(3)
    places = np.array(list(product(range(0, 12, 2), repeat=3)))
    near = abs(places[:, None] - places[None]).max(axis=2) <= 2
    solver = factors.Solver(places, 1e-9)
    for scale in (1.0, 1.01, 1e4):
        full = np.where(near, -1.0, 0.0) + np.diag(27 + rng.random(216) * scale)
        right = rng.normal(size=216)
        assert full @ solver(csr_matrix(full), right) == pytest.approx(right, abs=1e-6)
    assert solver(csr_matrix(full - 1e6 * np.eye(216)), right) is None


def mesh_of_order_two(pieces, stress, rise=2e-9, moved=1e-6, error=0.3):
    """What a mesh would give whose error falls with the square of the pieces."""
    share = (1 - error / pieces**2) * np.asarray(stress) / 1e5
    field = 1e-10 / pieces * (1 + 0.01 * share)
    bounds = tuple(Interval(2e-7 + rise * s - f, 2e-7 + rise * s + f) for s, f in zip(share, field, strict=True))
    nothing = np.zeros(len(stress))
    return press3d.Pressed(
        np.array(stress), 1e-7 + moved * share, bounds, (), 1 + nothing, nothing, nothing, 1e-7, ()
    )  # fmt: skip


def test_two_meshes_lead_to_their_limit():
    every, some = [0.0, 2e4, 5e4, 1e5, 1.2e5], [0.0, 5e4, 1e5]
    fine = mesh_of_order_two(3, every)
    found = limit(fine, mesh_of_order_two(2, some), 3)
    assert found.rise_f_per_m2 == pytest.approx(2e-9 * np.array(every) / 1e5, rel=1e-6)
    assert found.found.displacement_m - 1e-7 == pytest.approx(1e-6 * np.array(every) / 1e5, rel=1e-9)
    beyond = 0.3 / 9 * found.rise_f_per_m2[:4]
    assert found.rise_error_f_per_m2[:4] == pytest.approx(0.5 * beyond, rel=0.02)
    assert found.displacement_error_m[:4] == pytest.approx(0.5 * 0.3 / 9 * 1e-6 * np.array(every[:4]) / 1e5, rel=1e-9)
    assert np.isinf([found.rise_error_f_per_m2[4], found.displacement_error_m[4]]).all()
    assert [c.upper - c.lower for c in found.found.capacitance_f_per_m2] == pytest.approx(
        [c.upper - c.lower for c in fine.capacitance_f_per_m2], rel=1e-6
    )
    one = limit(fine, mesh_of_order_two(3, some), 3)  # too many boxes to be cut further
    assert np.isinf(one.rise_error_f_per_m2[1:]).all()
    assert (one.rise_error_f_per_m2[0], one.displacement_error_m[0]) == (0.0, 0.0)


def test_air_goes_along_evenly_with_what_is_stretched_evenly():
    """Walls, mirrors and a top that move by a linear map take all air along by the same, also where it ends a cell."""
    fill = [[[2, 1, 3]], [[2, 0, 3]], [[2, 1, 3]], [[2, 0, 3]]]
    bricks = boxes(((0, 0.3, 0.6, 1.0, 1.2), (0, 1), (0, 0.2, 0.6, 0.8)), fill).cut(2, 0.5)
    whole, solid = (mesh_of(bricks, w) for w in (np.ones(bricks.fill.shape, bool), bricks.fill > 0))
    stretched = np.array([0.03, 0.02, -0.1])
    found = air.AirMap(whole, solid).displacements_m(solid.points_m * stretched, 1e-4).reshape(-1, 3)
    assert found == pytest.approx(whole.points_m * stretched, abs=1e-12)
