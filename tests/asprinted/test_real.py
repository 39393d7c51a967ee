"""What the real slicers print, against what was found by hand and against the estimate."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from electrode_lines import electrode_lines
from sensorgen.asprinted.beads import beads, layers
from sensorgen.asprinted.printed import body, cell, gap_mm, nominal, window
from sensorgen.checks.review import review
from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.models import fem2d, fem3d, traxels
from sensorgen.prediction.bodies import sliced
from sensorgen.prediction.evaluate import evaluate
from sensorgen.scene.layers import drawn
from sensorgen.scene.scene import area_mm2

from .conftest import small

REFERENCE = json.loads((Path(__file__).parents[1] / "reference/asprinted.json").read_text())
WALLS = ("arachne", "classic", "cura", "cura-gaps")
EPS = {"air": 1.00059, "x60": 4.68}
PLATE = small("reference", {"length_mm": 100.0, "width_mm": 10.0})
COG = "top_electrode_with_cogs"
LOST = ("7-printed", "error")
FEET = 4  # layer of the feet on the film, from 0


def cell_of(variant, layers_of):
    return cell(
        variant,
        layers_of,
        variant.printed.bodies,
        window(variant.printed, variant.layers.boundaries_mm(variant.printed.size_mm[2])),
    )


def plan_of(variant):
    return drawn(variant.printed, variant.layers.boundaries_mm(variant.printed.size_mm[2]))


def per_period(variant, layers_of):
    """Capacitance of one period of 2 mm [pF/m]."""
    scene = cell_of(variant, layers_of).scene
    found = fem2d.capacitance(scene, EPS, 1e-3).middle()
    return found / (scene.size_mm[0] * scene.size_mm[1] / 2 * 1e-3) * 1e12


@pytest.mark.parametrize("walls", WALLS)
def test_volumes_per_layer_are_those_found_by_hand(real, walls):
    variant, lines, version = real(walls)
    assert version.startswith(REFERENCE["slicers"]["cura" if walls.startswith("cura") else "prusa"])
    rows = nominal(variant, lines).rows
    found = {(r.bottom_mm, r.top_mm): r.ratio for r in rows if r.body == COG}
    for layer, ratio in zip(REFERENCE["layers_mm"], REFERENCE["printed_over_exact"][walls], strict=True):
        if ratio is not None:
            assert found[tuple(layer)] == pytest.approx(ratio, abs=0.03), layer  # shorter lines have more of their ends


@pytest.mark.parametrize("walls", WALLS)
def test_electrode_gap(printed, walls):
    _, made = printed(walls)
    assert {gap_mm(own.scene) for own in made.cells.values()} == {REFERENCE["gap_mm"][walls]}


# Cura thins one of two walls that overlap, and is read where its nozzle goes; by hand the feet were taken as drawn.
WITHIN = {"arachne": 0.02, "classic": 0.02, "cura": 0.04, "cura-gaps": 0.05}


@pytest.mark.parametrize("walls", WALLS)
def test_capacitance_by_every_convention(printed, walls):
    variant, made = printed(walls)
    for convention, wanted in REFERENCE["capacitance_pf_per_m"][walls].items():
        assert per_period(variant, made.layers[convention]) == pytest.approx(wanted, rel=WITHIN[walls]), convention


@pytest.mark.parametrize("walls", ["cura", "cura-gaps"])
@pytest.mark.parametrize("convention", ["vol", "deposit"])
def test_with_the_feet_as_drawn_curas_capacitance_is_that_found_by_hand(printed, walls, convention):
    if fem2d.why_not_applicable(small().drawn):
        pytest.skip("NGSolve is not installed")
    variant, made = printed(walls)
    found = list(made.layers[convention])
    meant = plan_of(variant)[FEET].region("film_and_lower")
    found[FEET] = found[FEET].mapped({**found[FEET].regions, "film_and_lower": meant})
    wanted = REFERENCE["capacitance_pf_per_m"][walls][convention]
    assert per_period(variant, found) == pytest.approx(wanted, rel=0.021)


def test_cura_thins_a_wall_to_the_distance_of_its_neighbour(real):
    """So its filament lies on the free side of the nozzle's path, by half of what the neighbour takes."""
    variant, lines, _ = real("cura")
    mine = beads(variant, lines)
    line_mm = variant.machine.line_mm()
    long = mine.of((np.abs(mine.end_mm - mine.start_mm)[:, 1] > 7.0) & (mine.layer >= FEET) & (mine.layer < 8))
    middle = (long.start_mm + long.end_mm)[:, 0] / 2
    thin = np.flatnonzero(long.width_mm < 0.9 * line_mm)
    assert len(thin) >= 10
    for k in thin:
        beside = (long.layer == long.layer[k]) & (long.body == long.body[k]) & (long.number != long.number[k])
        assert np.abs(middle[beside] - middle[k]).min() == pytest.approx(long.width_mm[k], abs=0.003)


@pytest.mark.parametrize(
    ("walls", "within"), [("arachne", 0.02), ("classic", 0.02), ("cura", 0.07), ("cura-gaps", 0.07)]
)
def test_the_estimate_comes_near_the_real_slicers(printed, walls, within):
    variant, made = printed(walls)
    guess = body(variant, walls=walls)
    found = per_period(variant, next(iter(guess.layers.values())))
    assert found == pytest.approx(per_period(variant, made.layers["vol"]), rel=within)


@pytest.mark.parametrize(("walls", "slicer"), [("arachne", "prusa"), ("cura-gaps", "cura")])
def test_crossed_strips(printed, walls, slicer):
    _, made = printed(walls, small("rect"))
    scene, cells = made.cell.scene, made.cell.count
    wide = sum(abs(area_mm2(o)) for p in scene.body(COG).pieces for o in p.cut("z", 0.55)) / 2.0
    assert wide == pytest.approx(REFERENCE["crossed_strip_mm"][slicer], abs=0.003)
    found = fem3d.capacitance(scene, EPS, 1e-2).middle() * 1e12
    assert found == pytest.approx(REFERENCE["crossed_cell_pf"][slicer], rel=0.02)
    assert cells == pytest.approx(16.0)


@pytest.mark.parametrize("slicer", ["arachne", "cura-gaps"])
@pytest.mark.parametrize(
    "variant",
    [
        pytest.param(small(orientation="upside-down"), id="upside-down"),
        pytest.param(small(quality="extrafine"), id="extrafine", marks=pytest.mark.nightly),
        pytest.param(small(parameters={"along": "y"}), id="triY", marks=pytest.mark.nightly),
    ],
)
def test_every_variant_is_read_back(printed, slicer, variant):
    variant, made = printed(slicer, variant)
    real_mm, guess_mm = (gap_mm(found.cell.scene) for found in (made, body(variant, walls=slicer)))
    assert real_mm == pytest.approx(guess_mm, abs=variant.layers.layer_mm * 1.01)
    scene = made.cell.scene
    plates = scene.body("bottom_electrode").volume_mm3(), variant.drawn.body("bottom_electrode").volume_mm3()
    area = scene.size_mm[0] * scene.size_mm[1] / (12.0 * 8.0)
    assert plates[0] == pytest.approx(plates[1] * area, rel=0.01)


def test_lost_layers_are_errors_and_can_be_waived(real):
    variant, lines, _ = real("classic")
    found = nominal(variant, lines).findings()
    lost = [f for f in found if f.severity == "error"]
    assert [(f.layer, f.last_layer) for f in lost if f.body == COG] == [(5, 6)]
    assert (7, 8) in {(f.layer, f.last_layer) for f in found if f.severity == "warning" and f.body == COG}  # too full
    waived = small(waivers=[{"rule": "7", "reason": "the gap is known to be larger"}])
    assert all(f.waiver for f in nominal(waived, lines).findings())


@pytest.mark.parametrize(
    ("walls", "variant"),
    [
        ("arachne", small()), ("arachne", small(parameters={"dielectric_mm": 0.2})), ("classic", small()),
        ("cura-gaps", small()), ("arachne", small(parameters={"along": "y"})), ("arachne", small("rect")),
        ("arachne", small(orientation="upside-down")),
    ],
    ids=["tri", "tri film 0.2", "classic walls", "cura", "triY", "rect", "upside-down"],
)  # fmt: skip
def test_check_reports_the_errors_of_slice_before_slicing(real, walls, variant):
    """Word for word: the same layers, bodies and severity."""
    variant, lines, _ = real(walls, variant)

    def errors(findings):
        return {(f.body, f.layer, f.last_layer, f.message) for f in findings if (f.rule, f.severity) == LOST}

    expected = errors(nominal(variant, lines).findings())
    assert errors(review(variant, walls=walls).findings) == expected
    assert bool(expected) == (variant.shape == "tri" and walls != "cura-gaps")


def test_the_first_to_be_printed_keeps_its_place_or_the_electrode(real):
    """An electrode pushed 0.1 mm into its neighbour, which came first."""
    variant, lines, _ = real("arachne", small("rect"))
    mine = beads(variant, lines)
    electrode = next(k for k, b in enumerate(variant.printed.bodies) if b.terminal == "top")
    other = next(k for k, b in enumerate(variant.printed.bodies) if b.name == "film_and_lower")
    layer = 4
    wider = np.where((mine.layer == layer) & np.isin(mine.body, [electrode, other]), mine.width_mm + 0.4, mine.width_mm)
    fat = replace(mine, width_mm=wider)
    first = next(
        variant.printed.bodies[k].name
        for k in (electrode, other)
        if mine.number[(mine.layer == layer) & (mine.body == k)].min() == mine.number[mine.layer == layer].min()
    )
    kept, won = (layers(variant, fat, electrode_wins=wins)[layer] for wins in (False, True))
    width = {name: region.area for name, region in kept.regions.items()}
    loser = ({COG, "film_and_lower"} - {first}).pop()
    assert width[first] > width[loser]
    assert won.region(COG).area == pytest.approx(max(width.values()), rel=0.05)


def test_a_print_is_predicted_beside_its_drawing(real, at_rest):
    variant, lines, version = real("arachne", small(parameters={"length_mm": 16.0}))
    made = sliced(variant, lambda: body(variant, lines, slicer=version), version, b"file")
    found = evaluate(made)
    assert (found.gap.value, found.gap.lower, found.gap.upper) == pytest.approx(
        (2e-4, 1.8e-4, 2.2e-4)
    )  # heights of two tools to 0.02 mm
    assert found.drawn.gap.value == pytest.approx(1e-4)
    assert version in found.body
    assert found.capacitance.value < found.drawn.capacitance.value
    for end, drawn_ in found.drawn.resistance.items():
        assert found.resistance[end].value == pytest.approx(drawn_.value, rel=0.1)


def test_g_code_of_another_place_or_piece(real):
    variant, lines, _ = real()
    with pytest.raises(BadInput, match="was it sliced from this design"):
        body(variant, lines, centre_mm=(100.0, 50.0))
    made = nominal(variant, lines, centre_mm=(100.0, 50.0))
    rows, found = made.rows, made.findings()
    assert all(row.printed_mm3 == 0 for row in rows)
    assert {f.severity for f in found} == {"error", "warning"}


def test_an_unknown_convention(real):
    variant, lines, _ = real()
    with pytest.raises(UnknownName, match="vol"):
        layers(variant, beads(variant, lines), "volume")


@pytest.mark.parametrize("degrees", [pytest.param("0", marks=pytest.mark.nightly), "90"])
def test_resistance_of_the_sliced_electrode(real, degrees):
    """PrusaSlicer's 100 x 10 x 0.3 mm electrode against another network of its lines."""
    variant, lines, _ = real(f"angle-{degrees}", PLATE)
    lines = electrode_lines(variant, beads(variant, lines), "bottom")
    wanted = REFERENCE["electrode_ratio"]
    for contact, ratio in zip(wanted["contact_ohm_m2"], wanted[degrees], strict=True):
        found = traxels.resistance(lines, 0.2, contact, (-48.9e-3, 48.9e-3), 3e-6).ratio
        assert found == pytest.approx(ratio, rel=0.01 if contact <= 1e-5 else 0.05), contact


def test_sparse_infill_thins_the_film_and_not_what_is_walls_alone(real):
    full, sparse = (
        {(r.body, r.layer): r.ratio for r in nominal(v, real("arachne", v)[1]).rows}
        for v in (small(), small(infill={"x60": {"percent": 50}}))
    )
    assert sparse["film_and_lower", 4] < 0.85 * full["film_and_lower", 4]
    for layer in (7, 8, 9):
        assert sparse["hanging_dielectric", layer] == pytest.approx(full["hanging_dielectric", layer], rel=1e-3)
