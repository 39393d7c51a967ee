"""Bounds of a porous dielectric against closed forms, limits and a field solve of its lines."""

import numpy as np
import pytest
from resistors import potentials

from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import EPS0_F_PER_M, M_PER_MM
from sensorgen.design.design import make
from sensorgen.design.shapes import gaps
from sensorgen.design.shapes import porous as shape
from sensorgen.models import porous
from sensorgen.prediction import quantities
from sensorgen.prediction.bodies import drawn, estimated
from sensorgen.prediction.capacitance import is_plate
from sensorgen.prediction.compression import law_name
from sensorgen.prediction.compression_law import infill, law_of
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.mesh_ladder import PressedPiece
from sensorgen.prediction.rest_state import rest_state
from sensorgen.prediction.sensor_model import piece
from sensorgen.scene.scene import Fill


def wiener(solid, share):
    """Bounds of the permittivity of a solid with air."""
    return 1 / (share / solid + 1 - share), share * solid + 1 - share


def test_capacitance_of_crossed_lines_lies_within_the_bounds():
    fem3d = pytest.importorskip("sensorgen.models.fem3d")
    p = shape.Params(length_mm=40.5, width_mm=40.5, dielectric_mm=0.4, layer_mm=0.2, space_mm=0.5)
    found = fem3d.capacitance(shape.scene(p, Fill()), {"x60": 4.68, "air": 1.0}, 0.02)
    plate = EPS0_F_PER_M * 40.5**2 * M_PER_MM / 0.4
    lower, upper = wiener(4.68, 0.5)  # of half solid, but for the last line
    assert lower < found.lower / plate < found.upper / plate < upper
    assert found.width() < 0.02


def gyroid(period_mm, share, layers=6, height_mm=0.1, n=20, up=2):
    """Permittivity of voxels over that of air: lines of a gyroid at the middle of each layer, X60 in air.

    Finite volumes between two electrodes, periodic in the plane; an estimate that shares no line with the package.
    """
    x = 2 * np.pi * (np.arange(n) + 0.5) / n
    s, c, z = np.sin(x), np.cos(x), 2 * np.pi * (np.arange(layers) + 0.5) * height_mm / period_mm
    near = abs((s[:, None] * c)[..., None] + s[:, None] * np.cos(z) + np.sin(z) * c[:, None, None])
    solid = near < np.quantile(near, share, axis=(0, 1))
    eps = np.repeat(np.where(solid, 4.68, 1.0), up, axis=2)
    dx, dz, number = period_mm / n, height_mm / up, np.arange(eps.size).reshape(eps.shape)
    pairs = [(np.roll(eps, -1, k), eps, np.roll(number, -1, k), number, dz) for k in (0, 1)]
    pairs.append((eps[..., 1:], eps[..., :-1], number[..., 1:], number[..., :-1], dx * dx / dz))
    links = [(i.ravel(), j.ravel(), (2 * a * b / (a + b) * by).ravel()) for a, b, i, j, by in pairs]
    low, high = eps.size, eps.size + 1  # the electrodes
    for end, k in ((low, 0), (high, -1)):
        links.append((number[..., k].ravel(), np.full(n * n, end), (2 * eps[..., k] * dx * dx / dz).ravel()))
    held = np.append(np.full(eps.size, np.nan), [0.0, 1.0])
    _, current = potentials(*map(np.concatenate, zip(*links, strict=True)), held)
    return current[high] * layers * height_mm / period_mm**2


def test_the_range_of_a_gyroid_without_g_code_holds_its_layers():
    design = make({"shape": "reference", "infill": {"x60": {"percent": 40, "pattern": "gyroid"}},
                   "parameters": {"length_mm": 10, "width_mm": 10}})  # fmt: skip
    plate = EPS0_F_PER_M * 100 * M_PER_MM / 0.6
    printed = estimated(design, "arachne")
    span = rest_state(printed).capacitance.print
    for period_mm in (1.0, 4.0):
        assert span.lower / plate < gyroid(period_mm, 0.4) < span.upper / plate
    assert any("gyroid infill of x60 as stripes" in said for said in quantities._assumptions(printed, None))


needs_mesher = pytest.mark.skipif("not __import__('importlib').util.find_spec('netgen')", reason="needs NGSolve")
MODULI = {"x60": 6e6, "etpu": 22e6}


def test_a_plate_with_slits_stands_on_its_pillars():
    p = gaps.Params()
    found = porous.filling(gaps.scene(p, Fill()), MODULI)
    share = 1 - p.gap_width_mm / p.period_mm
    assert found.share == pytest.approx(share)
    assert found.modulus_pa.lower == pytest.approx(share * 6e6)
    width = p.period_mm - p.gap_width_mm
    stiffer = 4 / 3 * (1 + (width / (2 * p.dielectric_mm)) ** 2)
    assert found.modulus_pa.upper == pytest.approx(stiffer * share * 6e6)


def test_crossed_lines_stand_where_they_cross():
    p = shape.Params(length_mm=40.5, width_mm=40.5)  # 45 lines of 0.5 mm and 44 spaces of 0.4 mm, nearly
    found = porous.filling(shape.scene(p, Fill()), MODULI)
    along = found.share  # of a level
    assert found.modulus_pa.lower == pytest.approx(along**2 * 6e6, rel=1e-9)
    assert found.modulus_pa.upper == pytest.approx(4 / 3 * (1 + (0.5 / 1.2) ** 2) * along * 6e6, rel=1e-9)


def test_powers_of_the_rise_are_those_of_the_bounds():
    """By differences of Wiener's bounds under a strain that leaves the volume of the solid."""
    found, eps, strain = porous.Filling(0.6, 0.4, porous.Interval(1e6, 2e6)), 4.68, 1e-5

    def rises(which):
        own, pressed = (wiener(eps, share)[which] for share in (0.4, 0.4 / (1 - strain)))
        return np.log(pressed / own / (1 - strain)) / -np.log(1 - strain)

    assert found.rise_powers(eps).lower == 1
    assert found.rise_powers(eps).upper == pytest.approx(max(rises(0), rises(1)), rel=1e-4)


@pytest.mark.parametrize(("design", "displacement_um", "capacitance"), [
    ({"shape": "gaps"}, 11.78, (46.7613, 47.7562)),  # press2d
    ({"shape": "porous"}, 25.84, (36.0392, 38.6655)),  # press3d
    ({"shape": "pillar", "parameters": {"cog": "dielectric"}}, 17.25, (40.6396, 42.5393)),  # press3d
    pytest.param(  # press_round
        {"shape": "bump", "parameters": {"cog": "dielectric", "tip_mm": 0.0}}, 52.2, (32.0621, 37.9677),
        marks=pytest.mark.nightly,
    ),
])  # fmt: skip
def test_solved_cells_lie_within_the_law_of_infill(design, displacement_um, capacitance):
    """Of the prints, 0.6 mm thick, at 100 kPa: displacement of the top, and capacitances per area."""
    design = make(design)
    printed = piece(estimated(design))
    law, bounds = infill(design, printed), porous.filling(printed.scene, MODULI).modulus_pa
    assert bounds.lower < 1e5 * 600 / displacement_um < bounds.upper
    soft, stiff = (float(one.capacitive_strain(np.asarray(1e5))[0]) for one in law.others)
    middle = float(law.compression.capacitive_strain(np.asarray(1e5))[0])
    assert stiff < 1 - capacitance[0] / capacitance[1] < soft
    assert stiff < middle < soft


def test_electrodes_that_bend_between_posts_are_no_infill():
    """An import has no period. At 50 kPa 2.364 of 25.85 nF/m2 by press3d, where flat electrodes lead to 1.4 nF/m2."""
    sizes = {"cog": "dielectric", "period_mm": 3.0, "side_mm": 1.0, "length_mm": 30.0, "width_mm": 12.0}
    design = make({"shape": "pillar", "parameters": sizes | {"electrode_mm": 0.4}})
    imported = PressedPiece(design.in_use, None)
    assert law_name(design, imported) == ""
    soft, stiff = (float(one.capacitive_strain(np.asarray(5e4))[0]) for one in infill(design, imported).others)
    assert stiff < 1 - 25.85 / (25.85 + 2.364) < soft
    slits = make({"shape": "gaps", "parameters": {"period_mm": 24.0, "gap_width_mm": 20.0, "length_mm": 24.0}})
    assert infill(slits, PressedPiece(slits.in_use, None)) is None
    assert law_of(slits, rest_state(drawn(slits), ranges=False).answer).bounded is False


def test_a_plate_with_slits_is_no_solid_plate():
    """Though its capacitance is exact: the field is straight in both."""
    for name, plate in (("gaps", False), ("reference", True)):
        for body in (drawn(make({"shape": name})), estimated(make({"shape": name}))):
            assert is_plate(rest_state(body, ranges=False).answer, body.cells.first()) is plate


@needs_mesher
def test_a_plate_with_slits_is_softer_than_a_solid_one():
    """By press2d on the print: 2.13 % at 100 kPa, linear to 1 %; a free solid plate has 1.69 %."""
    printed = estimated(make({"shape": "gaps", "parameters": {"gap_width_mm": 0.8, "length_mm": 12.5}}))
    found = evaluate(printed, beside=False).sensitivity
    assert found.value == pytest.approx(2.13e-4, rel=0.02)
    assert found.upper < 10 * 2.13e-4


@pytest.mark.parametrize("shape_name", ["tri", "reference"])
def test_the_law_of_infill_is_refused_where_there_is_none(shape_name):
    design = make({"shape": shape_name})
    with pytest.raises(OutOfRange, match=r"infill|solid plate"):
        law_of(design, rest_state(drawn(design), ranges=False).answer, "infill")


def test_a_film_of_half_a_layer_is_refused():
    with pytest.raises(OutOfRange):
        shape.Params(dielectric_mm=0.55)
