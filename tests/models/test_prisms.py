"""Prisms of polygons against closed forms, the solvers of sections and boxes, and two resistor networks on voxels."""

import importlib.util
from dataclasses import replace
from math import cos, pi, sin, sqrt

import numpy as np
import pytest
import shapely
import voxels

from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.design.shapes import rect
from sensorgen.models import fem2d, fem3d, prisms
from sensorgen.scene.layers import outlines
from sensorgen.scene.repetition import Repeat
from sensorgen.scene.scene import FLOATING, Body, Fill, Prism, Scene, box, rounded
from sensorgen.solvers.electrostatics import bounds as fem
from sensorgen.solvers.electrostatics.bounds import Unsolved
from sensorgen.solvers.electrostatics.enclosed import enclosing
from sensorgen.solvers.electrostatics.prisms import LayerCell, PrismMesh, solved

if importlib.util.find_spec("ngsolve") is None:
    pytest.skip("NGSolve is not installed", allow_module_level=True)

EPS = {"x60": 4.68, "air": 1.00059}
MM = 1e-3


def sensor(pattern, size=(3.0, 3.0), more=(), axis="z"):
    """A pattern of 0.4 mm that hangs on a plate, down to a film of 0.1 mm."""

    def plate(low, high):
        return (box(0, size[0], 0, size[1], low, high),)

    hanging = tuple(Prism("z", outline, 0.3, 0.7) for outline in pattern)
    bodies = (
        Body("low", "etpu", plate(0, 0.2), "bottom"),
        Body("film", "x60", plate(0.2, 0.3)),
        *((Body("pattern", "etpu", hanging, "top"),) if hanging else ()),
        *more,
        Body("high", "etpu", plate(0.7, 0.9), "top"),
    )
    return Scene(bodies, (*size, 0.9))


def post(x, y, radius, corners=32, turn=0.0):
    angles = turn + np.arange(corners) * 2 * pi / corners
    return tuple((rounded(x + radius * cos(a)), rounded(y + radius * sin(a))) for a in angles)


def rounded_all(region):
    return [tuple((rounded(x), rounded(y)) for x, y in outline) for outline in outlines(region)]


def holds(found, exact, width):
    """Whether an interval holds another that is known, and is as narrow as asked."""
    assert found.width() <= width
    assert found.lower <= exact.upper
    assert exact.lower <= found.upper
    assert (found.lower + found.upper) / (exact.lower + exact.upper) == pytest.approx(1, abs=width)


def test_a_sensor_that_ends_within_a_cell_counts_its_own_part():
    scene = rect.scene(rect.Params(length_mm=12.6, width_mm=4.0, dielectric_mm=0.1), Fill())
    found, boxes = prisms.capacitance(scene, EPS, 6e-2), fem3d.capacitance(scene, EPS, 1e-2)
    assert found.lower <= boxes.upper
    assert boxes.lower <= found.upper


def test_slanted_strips_are_straight_ones_turned():
    """Strips at 45 degrees, of which only shifts make a cell, have the capacitance per area of a cross-section."""
    side = 4.0
    lines = [((k, 0), (k + 0.8, 0), (k + 0.8 + side, side), (k + side, side)) for k in range(-6, 6, 2)]
    plan = shapely.clip_by_rect(shapely.union_all([shapely.Polygon(o) for o in lines]), 0, 0, side, side)
    scene = sensor(rounded_all(plan), (side, side))
    found = prisms.capacitance(scene, EPS, 1e-2)
    period, wide = sqrt(2), 0.4 * sqrt(2)
    starts = rounded(period), rounded(period + wide)
    straight = sensor([((s, 0.0), (s + wide, 0.0), (s + wide, 1.0), (s, 1.0)) for s in (0.0, *starts[:1])],
                      (rounded(2 * period), 1.0))  # fmt: skip
    exact = fem2d.capacitance(straight, EPS, 1e-4).times(side**2 / (2 * period))
    holds(found, exact, 1e-2)


def test_turned_square_posts_on_a_turned_lattice_are_the_same_posts():
    """Posts of 1 mm, 2 mm apart, along the axes for boxes; turned by 45 degrees they need polygons."""
    apart = rounded(2 * sqrt(2))
    places = [(0.5, 0.5), (1.5, 0.5), (0.5, 1.5), (1.5, 1.5), (1, 1), (0, 1), (2, 1), (1, 0), (1, 2), (0, 0), (2, 0)]
    plan = shapely.union_all(
        [shapely.Polygon(post(x * apart, y * apart, sqrt(0.5), 4)) for x, y in (*places, (0, 2), (2, 2))]
    )
    turned = sensor(rounded_all(shapely.clip_by_rect(plan, 0, 0, 2 * apart, 2 * apart)), (2 * apart,) * 2)
    square = [((x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)) for x in (0.5, 2.5) for y in (0.5, 2.5)]
    exact = fem3d.capacitance(sensor(square, (4.0, 4.0)), EPS, 1e-3).times(2 * apart**2 / 8)
    holds(prisms.capacitance(turned, EPS, 3e-2), exact, 3e-2)


def test_a_round_post_lies_within_two_networks_on_voxels():
    found = prisms.capacitance(sensor([post(1.5, 1.5, 0.5)]), EPS, 3e-2)

    def part(x, y):
        return (x - 1.5) ** 2 + (y - 1.5) ** 2 < 0.25

    h = 0.05
    eps, above, below = voxels.voxels((1.5, 1.5, 0.5 + 2 * h), h, part, 0.1)
    low, high = (4 * EPS0_F_PER_M * MM * end for end in (voxels.lower(eps, below, h), voxels.upper(eps, above, h)))
    assert low < found.lower
    assert found.upper < high
    assert high / low < 1.25


def test_a_floating_plate_makes_two_capacitors_in_series():
    plate = Body("loose", "etpu", (box(0, 3, 0, 3, 0.4, 0.5),), FLOATING)
    found = prisms.capacitance(sensor([], more=(plate,)), EPS)
    exact = EPS0_F_PER_M * 9 * MM / (0.1 / EPS["x60"] + 0.3 / EPS["air"])
    assert (found.lower, found.upper) == pytest.approx((exact, exact), rel=1e-8, abs=0)


def test_floating_boxes_half_way_are_at_half_the_voltage():
    """So that the lower half, with a plate in the middle that they hang from, has twice the capacitance."""
    blocks = tuple(box(x, x + 1, y, y + 1, 0.35, 0.55) for x in (0.5, 2.5) for y in (0.5, 2.5))
    plates = [(box(0, 4, 0, 4, low, high),) for low, high in ((0, 0.2), (0.7, 0.9), (0.45, 0.65))]
    low, high, middle = (Body("plate", "etpu", p, end) for p, end in zip(plates, ("bottom", "top", "top"), strict=True))
    whole = Scene((low, high, Body("loose", "etpu", blocks, FLOATING)), (4.0, 4.0, 0.9))
    feet = tuple(replace(b, end_mm=0.45) for b in blocks)
    half = Scene((low, middle, Body("feet", "etpu", feet, "top")), (4.0, 4.0, 0.65))
    found = prisms.capacitance(whole, EPS, 1e-2)
    holds(found, fem3d.capacitance(half, EPS, 1e-3).times(0.5), 1e-2)
    assert "a conductor floats" in str(fem3d.why_not_applicable(whole))
    assert "a conductor floats" in str(fem2d.why_not_applicable(whole))


@pytest.mark.parametrize("at", [(1.0, 1.0), (2.0, 2.0)], ids=["face", "edge"])
def test_a_loose_piece_that_touches_an_electrode_is_that_electrode(at):
    square = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0))
    x, y = at
    piece = (Prism("z", ((x, y), (x + 0.5, y), (x + 0.5, y + 0.5), (x, y + 0.5)), 0.5, 0.6),)
    loose, joined = (Body("piece", "etpu", piece, terminal) for terminal in (FLOATING, "top"))
    if at == (1.0, 1.0):
        loose, joined = (replace(b, pieces=(replace(piece[0], start_mm=0.25, end_mm=0.3),)) for b in (loose, joined))
        film = Body("film", "x60", (box(0, 3, 0, 3, 0.2, 0.25),))
        scenes = [sensor([square], more=(b,)) for b in (loose, joined)]
        scenes = [replace(s, bodies=tuple(film if b.name == "film" else b for b in s.bodies)) for s in scenes]
    else:
        scenes = [sensor([square], more=(b,)) for b in (loose, joined)]
    ends = [prisms.capacitance(scene, EPS, 0.5) for scene in scenes]
    assert ends[0].lower == pytest.approx(ends[1].lower, rel=1e-9, abs=0)
    assert ends[0].upper == pytest.approx(ends[1].upper, rel=1e-9, abs=0)


def test_what_is_no_layers_of_polygons_is_said():
    assert "touch" in str(prisms.why_not_applicable(sensor([], more=(
        Body("pin", "etpu", (box(1, 2, 1, 2, 0.3, 0.7),), "bottom"),))))  # fmt: skip
    wedge = Body("wedge", "x60", (Prism("y", ((0.0, 0.3), (0.2, 0.3), (0.1, 0.6)), 0.0, 3.0),))
    assert "slanted or curved in elevation" in str(prisms.why_not_applicable(sensor([], more=(wedge,))))


def test_slivers_are_refused_not_believed():
    """Outlines 2e-7 mm apart on a grid that resolves them: the flux no longer balances."""
    full = shapely.box(0, 0, 2, 2)
    nearly = [shapely.box(0.5 - k * 2e-7, 0.5, 1.5 + k * 3e-7, 1.5 + k * 1e-7) for k in range(3)]
    layers = LayerCell(
        (2.0, 2.0), np.array([0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]),
        [{0: full}, {2: full}, *({1: n} for n in nearly), {1: full}], 2, [4.68, 1.0],
    )  # fmt: skip
    mesh = PrismMesh.of(layers, (0.2, 0.05), 1e-8)
    with pytest.raises(Unsolved, match="energy and charges differ"):
        solved(mesh, mesh, 3, np.zeros(1))


def test_a_seam_through_conductors_that_do_not_fit_is_one_place_of_many():
    """Beads differ from period to period: one period, cut elsewhere, is the same pattern."""
    ends = []
    for shift in (0.0, 0.9):
        plan = [
            shapely.box(x + shift, y, x + shift + 0.6, y + 0.7)
            for x, y in ((-0.6, 0.8), (0.0, 0.6), (2.0, 0.6), (1.4, 0.8))
        ]
        inside = shapely.clip_by_rect(shapely.union_all(plan), 0, 0, 2, 2)
        scene = replace(sensor(rounded_all(inside), (2.0, 2.0)), repeats=(True, True))
        ends.append(prisms.capacitance(scene, EPS, 5e-2))
    holds(ends[0], ends[1], 5e-2)


@pytest.mark.parametrize("kind", [1, 2], ids=["conductor", "dielectric"])
def test_rounded_outlines_enclose_the_exact_ones(kind):
    """Of conductors and of dielectrics, posts a little narrower than the layer below; far layers drawn together."""
    full = shapely.box(0, 0, 1, 1)
    discs = [shapely.Polygon(post(0.0131, -0.0077, 0.4 - k * 0.004, corners=8, turn=0.3)) for k in range(3)]
    discs = [shapely.intersection(disc, full) for disc in discs]
    regions = [{0: full}, {2: full}, *({kind: disc} for disc in discs), {1: full}]
    cell = LayerCell((1.0, 1.0), np.arange(7) / 10, regions, 2, [4.68, 1.0])
    beside, far = (0.2, 0.04), 0.15
    exact = PrismMesh.of(cell, beside, 1e-6, far)
    exact = solved(exact, exact, 2, np.zeros(1))
    ends = [enclosing(cell, 3e-3, far, 0.005, outwards=way) for way in (False, True)]
    if kind == 1:
        assert all(end.regions[3] == end.regions[4] != end.regions[2] for end in ends)
    inner, outer = (PrismMesh.of(end, beside, 3e-3, far) for end in ends)
    found, swapped = solved(inner, outer, 2, np.zeros(1)), solved(outer, inner, 2, np.zeros(1))
    assert exact.lower / 1.04 < found.lower < exact.lower
    assert exact.upper < found.upper < exact.upper * 1.04
    assert swapped.lower > exact.lower  # planted: the wrong cell for each bound
    assert swapped.upper < exact.upper


def test_outlines_of_all_ranks_move_one_way():
    """So that no slit opens between a conductor and the dielectric beside it."""
    full, half = shapely.box(0, 0, 2, 2), shapely.box(0, 0, 1, 2)
    cell = LayerCell((2.0, 2.0), np.array([0, 0.1, 0.2, 0.3]), [{0: full}, {1: half, 2: full - half}, {1: full}], 2,
                     [4.68, 1.0])  # fmt: skip
    for outwards in (False, True):
        layer = enclosing(cell, 1e-2, 1.0, 0.0, outwards=outwards).regions[1]
        assert layer[1].area == pytest.approx(2 + (0.03 if outwards else -0.03))
        assert layer[1].area + layer[2].area == pytest.approx(4)


def test_conductors_nearer_than_the_grid_are_refused():
    full, one, other = shapely.box(0, 0, 2, 2), shapely.box(0.5, 0.5, 1, 1.5), shapely.box(1.001, 0.5, 1.5, 1.5)
    cell = LayerCell((2.0, 2.0), np.array([0, 0.1, 0.2, 0.3]), [{0: full}, {2: one, 3: other}, {1: full}], 4, [1.0])
    with pytest.raises(Unsolved, match="nearer than the grid"):
        enclosing(cell, 1e-3, 0.1, 0.0, outwards=True)


@pytest.mark.parametrize("enclosed", [False, True])
def test_a_part_that_occurs_more_often_is_enclosed_too(enclosed):
    """A quarter of the energy twice: what a larger cell adds may all lie there."""
    found = fem.whole(fem.Energies(0.98, 1.0, 0.25, 1, enclosed=enclosed), [1.0, 2.0])
    least = 0.98 + (0.5 - (1 + enclosed) * 0.02**0.5) ** 2
    assert found.lower == pytest.approx(least, rel=1e-8)


@pytest.mark.parametrize(("low", "size", "whole"), [(0.3, 1.0, 2.8), (0.75, 1.0, 5.2), (0.0, 2.0, 9.0)])
@pytest.mark.parametrize("shifts", [False, True])
def test_parts_of_a_cell_occur_as_often_as_they_are_unfolded(low, size, whole, shifts):
    """Places of the whole, each folded into the cell by mirrors or shifts, counted one by one."""
    of = Repeat.of(low, low + size, shifts, whole)
    x = (np.arange(200_000) + 0.5) / 200_000 * whole - low
    folded = x % size if shifts else size - np.abs(x % (2 * size) - size)
    counted = np.histogram(folded + low, of.places_mm)[0] * whole / 200_000
    assert counted == pytest.approx(of.shares * np.diff(of.places_mm), abs=1e-3)
