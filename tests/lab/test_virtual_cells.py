"""Cells of the virtual specimen, of sections and of bricks: closed forms, each other, other programs."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from cell_scenes import rect_cell
from click.testing import CliRunner
from laboratory import QUICK

from sensorgen.asprinted import printed
from sensorgen.cli import cli
from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import make
from sensorgen.measure.virtual import blank as virtual
from sensorgen.measure.virtual import cell
from sensorgen.measure.virtual.blank import bricks, raster
from sensorgen.measure.virtual.cell import (
    AIR,
    EPSILON_0,
    Solid,
    brick_grid,
    capacitance,
    conductance,
    pressed,
    section_grid,
)
from sensorgen.measure.virtual.specimen import PressedSpecimen
from sensorgen.scene.scene import Body, Scene, box

REFERENCE = Path(__file__).parents[1] / "reference"
X60, ETPU = Solid(6e6, 0.4999, 4.68), Solid(22e6, 0.4999, 5.73)
SOLIDS, EPS = [AIR, X60, ETPU], [AIR.permittivity, 4.68, 1.0]
NUMBERS = {"x60": 1, "etpu": 2}
ORDER = 4 / 3
TRI = {"shape": "tri", "parameters": {"dielectric_mm": 0.2}}
RECT = {"shape": "rect", "parameters": {"dielectric_mm": 0.2}}


@pytest.fixture(autouse=True)
def _stored(shared_cache):
    """Blanks are solved once for all tests."""


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    """Solves blanks on coarser meshes, which no other test finds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(virtual, "_SOLVED", {})
        patch.setattr(virtual, "_PRESSED", (0.35, 60))
        patch.setattr(virtual, "_AT_REST", (0.175, 500))
        patch.setattr(virtual, "FINE_MM", 0.05)
        patch.setattr(virtual.answers, "answer", lambda _, solve: solve())
        yield virtual.blank


def extrapolated(coarse, fine):
    return fine + (fine - coarse) / (2**ORDER - 1)


def bar(material, electrode):
    """Bricks of 0.5 x 0.4 x 1.2 mm, of layers upwards."""
    x, y, z = np.linspace(0, 0.5e-3, 3), np.linspace(0, 0.4e-3, 4), np.array([0, 0.3, 0.5, 0.9, 1.2]) * 1e-3
    return brick_grid(x, y, z, *(np.broadcast_to(of, (2, 3, 4)) for of in (material, electrode)))


def sinks(grid, places):
    """Mean displacements of the top, downwards."""
    z = np.zeros((len(places), len(grid.top_m)))
    z[:, grid.nodes] = places[..., -1]
    return (z[0] - z) @ grid.top_m / grid.top_m.sum()


def sides(grid):
    return np.ptp(grid.at_m[..., :2], axis=(0, 1))


def at_rest(scene, size_mm, most):
    """Capacitance of a scene, of bricks without size."""
    grids = [bricks(scene, NUMBERS, size_mm, most, n) for n in (1, 2)]
    times = scene.size_mm[0] * scene.size_mm[1] * 1e-6 / sides(grids[0]).prod()
    return times * extrapolated(*(capacitance(of, EPS, of.at_m) for of in grids))


def quarter():
    """Of a cell of rect as drawn: from the middle of a conductor's strip to that of a dielectric's, both ways."""
    whole = rect_cell(0.2)
    bodies = []
    for body in whole.bodies:
        ends = [[(max(a, 0.35) - 0.35, min(b, 1.35) - 0.35) for a, b in map(p.span, "xy")] for p in body.pieces]
        inside = zip(ends, body.pieces, strict=True)
        cut = (box(*x, *y, *p.span("z")) for (x, y), p in inside if x[0] < x[1] and y[0] < y[1])
        bodies.append(replace(body, pieces=tuple(cut)))
    return replace(whole, bodies=tuple(bodies), size_mm=(1.0, 1.0, whole.size_mm[2]))


def plate(middle=1, *, floats=0):
    """Plates of 0.3 mm, and 0.6 mm between them, the middle third of which may be of another material, or float."""
    z = np.array([0, 0.3, 0.5, 0.7, 0.9, 1.2]) * 1e-3
    material, electrode = (np.tile(of, (3, 1)).T for of in ([2, 1, middle, 1, 2], [1, 0, floats, 0, 2]))
    return section_grid(np.linspace(0, 1e-3, 4), np.tile(z[:, None], 4), material, electrode, repeats=False)


def test_a_plate_has_the_capacitance_of_one():
    found = capacitance(plate(), EPS, plate().at_m)
    assert found == pytest.approx(EPSILON_0 * 4.68 * 1e-3 / 0.6e-3, rel=1e-9)


def test_conductors_that_float_conduct():
    floating = plate(2, floats=3)
    found = capacitance(floating, EPS, floating.at_m)
    assert found == pytest.approx(EPSILON_0 * 4.68 * 1e-3 / 0.4e-3, rel=1e-9)


def test_layers_between_sides_that_hold_are_springs_of_their_constrained_modulus():
    mu, ratio = 6e6 / 2 / 1.4999, 1000.0  # the raster's bulk over its shear modulus, at most
    stiff = mu * (ratio + 2)
    assert sinks(plate(), pressed(plate(), SOLIDS, [0.0, 1e3]))[1] == pytest.approx(
        1e3 * (0.6e-3 / stiff + 0.6e-3 / (stiff * 22 / 6)), rel=1e-3
    )


def test_air_closes_and_then_bears():
    found = sinks(plate(0), pressed(plate(0), SOLIDS, [0.0, 10.0, 1e3, 1e5]))
    assert 0.0 < found[1] < found[2] < found[3] < 0.21e-3
    assert found[3] > 0.19e-3


def test_the_cell_of_triangles_is_that_of_other_programs():
    """Sharp apexes, which coarse elements make blunt: C to 2 %, its rise to 15 %; prints have level faces instead."""
    known = json.loads((REFERENCE / "contact.json").read_text())["tri_d0.2"]
    exact = next(c for c in json.loads((REFERENCE / "cells.json").read_text())["tri"] if c["d"] == 0.2)
    scene = make({"shape": "tri", "parameters": {"dielectric_mm": 0.2, "length_mm": 2}}).in_use
    grid = raster(scene, {"x60": 1, "etpu": 2}, 0.05)
    at = pressed(grid, SOLIDS, [0.0, 2.5e4, 5e4])
    c = [capacitance(grid, EPS, place) for place in (at[0], at[-1])]
    assert c[0] == pytest.approx(exact["C_F_per_m"], rel=0.02)
    rise = known["C_pF_per_m"][5] / known["C_pF_per_m"][0] - 1
    assert c[1] / c[0] - 1 == pytest.approx(rise, rel=0.15)


def test_layers_between_plates_are_capacitors_in_series():
    layered = bar([2, 1, 0, 2], [1, 0, 0, 2])
    found = capacitance(layered, EPS, layered.at_m)
    assert found == pytest.approx(EPSILON_0 * 0.2e-6 / (0.2e-3 / 4.68 + 0.4e-3 / 1.00059), rel=1e-9)


def test_blocks_between_plates_are_capacitors_side_by_side():
    material = np.tile([2, 1, 1, 2], (2, 3, 1))
    material[1, :, 1:3] = 0
    beside = bar(material, [1, 0, 0, 2])
    found = capacitance(beside, EPS, beside.at_m)
    assert found == pytest.approx(EPSILON_0 * 0.1e-6 / 0.6e-3 * (4.68 + 1.00059), rel=1e-9)


def test_a_large_field_is_solved_by_iterations_to_the_same(monkeypatch):
    layered = bar([2, 1, 0, 2], [1, 0, 0, 2])
    direct = capacitance(layered, EPS, layered.at_m)
    monkeypatch.setattr(cell, "_MOST_DIRECT", 10)
    assert capacitance(layered, EPS, layered.at_m) == pytest.approx(direct, rel=1e-6)


def test_a_conductance_is_a_cross_section_over_a_length():
    assert conductance(bar([2, 1, 0, 2], [1, 0, 0, 2]), 2) == pytest.approx(0.4e-3 * 0.3e-3 / 0.5e-3, rel=1e-9)
    assert conductance(plate(), 1) == pytest.approx(0.3, rel=1e-9)


def test_bricks_of_one_section_are_that_section():
    """A strip beside air on a film: displacement and capacitance per depth to rounding."""
    x, y, z = (np.array(of) * 1e-3 for of in ([0, 0.2, 0.4, 0.7, 1.0], [0, 0.7], [0, 0.2, 0.4, 0.7, 1.0]))
    material, electrode = np.full((4, 4), 2), np.zeros((4, 4), int)
    material[:, 1], material[2:, 2] = 1, 0
    electrode[:, 0], electrode[material == 2] = 1, 2
    electrode[:, 0] = 1
    flat = section_grid(x, np.tile(z[:, None], len(x)), material.T, electrode.T, repeats=False)
    deep = brick_grid(x, y, z, material[:, None], electrode[:, None])
    loads = [0.0, 1e4, 2e5]
    two, three = pressed(flat, SOLIDS, loads), pressed(deep, SOLIDS, loads)
    assert sinks(deep, three) == pytest.approx(sinks(flat, two), rel=1e-6)
    for section, whole in zip(two, three, strict=True):
        assert capacitance(deep, EPS, whole) / 0.7e-3 == pytest.approx(capacitance(flat, EPS, section), rel=1e-9)


def test_the_part_that_mirrors_repeat_is_solved():
    """A quarter of a printed cell; of a whole sensor in which the cells do not go up evenly, the same."""
    part = bricks(printed.body(make(RECT)).cell.scene, NUMBERS, 0.175, 500)
    assert sides(part) == pytest.approx([1e-3, 1e-3])
    blocks = [box(x, x + 1.4, y, y + 0.9, 0.5, 0.8) for x in np.arange(0.3, 40, 2) for y in np.arange(0.2, 20, 1)]
    whole = Scene((Body("blocks", "x60", tuple(blocks)),), (40.0, 20.3, 1.4))
    many = bricks(whole, NUMBERS, 0.175, 500)
    assert sides(many) == pytest.approx([1e-3, 0.5e-3])


def test_finer_bricks_converge_in_the_order_that_extrapolates_them():
    scene = quarter()
    c = [capacitance(of, EPS, of.at_m) for of in (bricks(scene, NUMBERS, 0.175, 500, n) for n in (1, 2, 4))]
    assert 2**ORDER * 0.85 < (c[0] - c[1]) / (c[1] - c[2]) < 2**ORDER * 1.4


@pytest.mark.parametrize(
    "design", [RECT, {"shape": "pillar"}, pytest.param({"shape": "pyramid"}, marks=pytest.mark.nightly)]
)
def test_bricks_at_rest_lie_between_certified_bounds(design):
    from sensorgen.models import fem3d

    scene = printed.body(make(design)).cell.scene
    bounds = next(fem3d.steps(scene, {"x60": 4.68, "air": 1.00059})).interval
    assert bounds.lower * 0.999 < at_rest(scene, 0.07, 5500) < bounds.upper * 1.001


def test_a_blank_has_the_capacitance_of_its_cells_over_its_length(coarse):
    cells = printed.body(make(RECT)).cell
    expected = at_rest(cells.scene, 0.175, 500) * cells.count / 0.1
    assert coarse(make(RECT)).capacitance_f_per_m(0.0) == pytest.approx(expected, rel=1e-6)


@pytest.mark.nightly
def test_rect_sinks_and_rises_as_in_another_program():
    """NGSolve at small strain; press3d's curve up to 100 kPa: displacement to 3 %, rise to 6 %."""
    known = json.loads((REFERENCE / "rect_rise.json").read_text())["cells"][1]
    assert known["dielectric_mm"] == 0.2
    exact = known["meshes"][-1]
    loads = [0.0, 1e4, 1e5]
    c, sink = [], []
    for n in (1, 2):
        grid = bricks(quarter(), NUMBERS, 0.175, 500, n)
        found = pressed(grid, SOLIDS, loads)
        c.append(np.array([capacitance(grid, EPS, place) for place in found]))
        sink.append(sinks(grid, found))
    limit = extrapolated(*c)
    assert extrapolated(*sink)[1] == pytest.approx(exact["displacement_um"] * 1e-6, rel=0.03)
    assert limit[1:] / limit[0] - 1 == pytest.approx([exact["rise"], 0.0107451], rel=0.06)


def test_patterns_without_mirrors_are_refused():
    with pytest.raises(OutOfRange, match="pattern without mirrors; expected strips along or across the sensor"):
        _ = PressedSpecimen(make({"shape": "rect", "parameters": {"angle_deg": 60}})).capacitance_f_per_m


def test_cells_of_too_many_faces_are_refused():
    whole = make({"shape": "rect", "parameters": {"length_mm": 33.3, "width_mm": 10.7}}).in_use
    with pytest.raises(OutOfRange, match="faces along x, y and z; expected a pattern that repeats"):
        bricks(whole, NUMBERS, 0.175, 500)


@pytest.mark.nightly
def test_a_very_soft_dielectric_is_pressed_as_far_as_it_bears(coarse):
    soft = make({**TRI, "material_values": {"x60": {"youngs_modulus_pa": 2e6}}})
    specimen = PressedSpecimen(soft)
    pressure, rise = specimen.blank.rise(0.0, 0.0)
    assert 3.5e4 <= pressure[-1] < 4e5
    assert (np.diff(rise) > 0).all()
    ends = [specimen.rise(force, 5e-3) for force in np.array([0.9, 1.0, 2.0]) * pressure[-1] * 10e-3 * 5e-3]
    assert ends[0] < ends[1] < ends[2]


def test_a_cell_that_bears_nothing_is_refused():
    layered = bar([2, 1, 0, 2], [1, 0, 0, 2])
    assert len(pressed(layered, SOLIDS, [0.0, 1e3, 1e12], least=2)) == 2
    with pytest.raises(OutOfRange, match="no equilibrium that the raster can find above"):
        pressed(layered, SOLIDS, [0.0, 1e3, 1e12])


def test_a_bench_presses_crossed_strips(tmp_path, monkeypatch, coarse):
    monkeypatch.setenv("SENSORGEN_LOG", str(tmp_path / "log.db"))
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(yaml.safe_dump(RECT), "utf-8")
    plan = [{"hold": {"position_mm": 40, "force_n": 4.0, "hold_s": 1.0, "rest_s": 2.0}}]
    asked = {"specimen": "S1", "virtual": {"seed": 3}, "plan": plan, "approach": QUICK}
    Path("first.yaml").write_text(yaml.safe_dump(asked), "utf-8")
    for words in (["log", "specimen", "S1", "--design", "mine.yaml"], ["bench", "run", "first.yaml", "--simulate"]):
        done = CliRunner().invoke(cli, words)
        assert done.exit_code == 0, done.output
    assert "1 of 1 presses, simulated" in done.output
