"""The virtual specimen against closed forms and the models that analyse it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sensorgen.core.errors import BadInput
from sensorgen.core.records import checked
from sensorgen.design.design import make
from sensorgen.measure.virtual import blank as tables
from sensorgen.measure.virtual.blank import blank, raster, tracks
from sensorgen.measure.virtual.cell import AIR, capacitance
from sensorgen.measure.virtual.specimen import PressedSpecimen, Truth, VirtualLine, drawn

TONES_HZ = np.array([1.1e3, 10.1e3, 99.7e3])
OMEGA = 2 * np.pi * TONES_HZ
TRI = {"shape": "tri", "parameters": {"dielectric_mm": 0.2}}


@pytest.fixture(scope="module")
def tri():
    return PressedSpecimen(make(TRI))


def test_finer_rasters_converge(tri):
    """To the extrapolated value, at least in the first order."""
    from sensorgen.asprinted import printed

    cell = printed.body(tri.design).cell
    per_length = 10e-3 * cell.count / 0.1
    off = []
    for fine in (0.1, 0.05, 0.025):
        grid = raster(cell.scene, {"etpu": 1, "x60": 2}, fine)
        c = capacitance(grid, [AIR.permittivity, 1.0, 4.68], grid.at_m) * per_length
        off.append(c / tri.capacitance_f_per_m - 1)
    assert 0 < off[2] < off[1] / 2 < off[0] / 3.2 < 0.02


def test_the_print_is_what_the_models_predict(tri):
    """Another mesh, another contact, another mechanism of the tracks: C to 0.5 %, R to 0.2 %, the rise to 2 %."""
    from sensorgen.prediction import bodies
    from sensorgen.prediction.query import Query, Tip
    from sensorgen.prediction.sensor_model import sensor_model

    sensor = sensor_model(bodies.estimated(tri.design), Query(tip=Tip(5e-3)))[0].sensor
    assert tri.capacitance_f_per_m == pytest.approx(sensor.capacitance_f_per_m, rel=5e-3)
    assert sum(tri.track_ohm_per_m) == pytest.approx(sensor.track_ohm_per_m()[0], rel=2e-3)
    share, _ = sensor.compression.capacitive_strain(np.array([2e4, 1e5]))
    rise = np.interp([2e4, 1e5], *tri.blank.rise(0.0, 0.0))
    assert rise == pytest.approx(share / (1 - share), rel=0.02)
    z, own = sensor.impedance(TONES_HZ, 0.0, 0.05), VirtualLine(tri, TONES_HZ).impedance(0.0, (0.0, 0.0))
    assert own == pytest.approx(z, rel=5e-3)


def test_cogs_along_the_strip_conduct_and_those_across_hardly():
    along, across = (
        tracks(make({"shape": "tri", "parameters": {"dielectric_mm": 0.2, "along": axis}})) for axis in ("y", "x")
    )
    assert along[0] < 0.9 * across[0]
    assert across[1] == pytest.approx(0.042 / (10e-3 * 0.3e-3), rel=1e-6)


def test_at_rest_it_is_an_open_line(tri):
    r, y = sum(tri.track_ohm_per_m), 1j * OMEGA * tri.capacitance_f_per_m
    expected = np.sqrt(r / y) / np.tanh(np.sqrt(r * y) * 0.1)
    assert VirtualLine(tri, TONES_HZ).impedance(0.0, (0.0, 0.0)) == pytest.approx(expected, rel=1e-9)


def test_a_press_of_no_resistance_adds_its_capacitance_wherever_it_is(tri):
    light = replace(tri, truth=Truth(tracks=-20.0))
    line, c = VirtualLine(light, TONES_HZ), light.capacitance_f_per_m
    for place in (2.5e-3, 0.031, 0.0975):
        z = line.impedance(0.3, light.patch(place))
        assert 1 / (1j * OMEGA * z) == pytest.approx(c * (0.1 + 0.3 * 5e-3), rel=1e-5)


def test_lead_stray_leak_dispersion_and_drift_are_where_they_are_on_a_bench(tri):
    truth = Truth(tracks=-20.0, stray_f=1e-12, lead_ohm=50.0, leak=0.1, dispersion=0.02)
    line, c = VirtualLine(replace(tri, truth=truth), TONES_HZ), tri.capacitance_f_per_m * 0.1
    film = 1j * OMEGA * c * (1j * TONES_HZ / 1e3) ** -0.02 + 0.1 * 2 * np.pi * 1e3 * c
    expected = 50 + 1 / (film + 1j * OMEGA * 1e-12)
    assert line.impedance(0.0, (0.0, 0.0)) == pytest.approx(expected, rel=1e-6)
    drifted = VirtualLine(replace(tri, truth=truth.model_copy(update={"cells": 3e-3})), TONES_HZ).impedance(
        0.0, (0.0, 0.0)
    )
    assert line.impedance(0.0, (0.0, 0.0), 3e-3) == pytest.approx(drifted, rel=1e-5)


def test_a_short_shunts_the_strip_until_it_opens(tri):
    light = replace(tri, truth=Truth(tracks=-20.0, short_ohm=2e3, short_share=0.3))
    free = VirtualLine(light, TONES_HZ).impedance(0.0, (0.0, 0.0), shorted=False)
    shorted = VirtualLine(light, TONES_HZ).impedance(0.0, (0.0, 0.0))
    assert 1 / shorted == pytest.approx(1 / free + 1 / 2e3, rel=1e-6)


def test_a_profile_is_seen_from_the_contacts(tri):
    """At low frequencies the current falls evenly to 0 at the far end: each place counts by its square."""
    bent, even = (VirtualLine(replace(tri, truth=Truth(profile=p)), np.array([100.0])) for p in ((0.3, -0.2), ()))
    ratio = bent.impedance(0.0, (0.0, 0.0)).real / even.impedance(0.0, (0.0, 0.0)).real
    x = (np.arange(1000) + 0.5) / 1000
    weight = (1 - x) ** 2
    bend = np.exp(0.3 * np.cos(np.pi * x) - 0.2 * np.cos(2 * np.pi * x))
    assert ratio == pytest.approx(weight @ bend / weight.sum(), rel=1e-3)


def test_modulus_and_permittivity_scale_as_they_should(tri):
    softer = replace(tri, truth=Truth(modulus=np.log(0.5)))
    rise = [s.rise(2.0, 5e-3) for s in (tri, softer)]
    assert 1.7 < rise[1] / rise[0] < 2.1  # twice the pressure, less what the electrodes bend
    denser = replace(tri, truth=Truth(permittivity=0.1))
    assert 0.07 < np.log(denser.capacitance_f_per_m / tri.capacitance_f_per_m) < 0.1
    thicker = replace(tri, truth=Truth(film_mm=0.02))
    assert thicker.capacitance_f_per_m < 0.98 * tri.capacitance_f_per_m


def test_a_blank_has_its_own_values_at_each_place_of_its_table():
    rng, count = np.random.default_rng(3), len(tables.PRESSURES_PA) - 1
    rest, rise = np.array([1.0, 1.2, 1.5]), rng.uniform(0.01, 0.1, (3, 3, count))
    whole = rest[None, :, None] * np.concatenate([np.ones((3, 3, 1)), 1 + rise], axis=2)
    made = tables.Blank(whole, (1.0, 1.0), 0.0)
    for j, permittivity in enumerate(tables._LN_PERMITTIVITY):
        assert made.capacitance_f_per_m(permittivity) == pytest.approx(rest[j])
        for i, modulus in enumerate(tables._LN_MODULUS):
            pressure, found = made.rise(permittivity, modulus)
            assert found[1:] == pytest.approx(rise[i, j])
            assert pressure == pytest.approx(np.array(tables.PRESSURES_PA) * np.exp(modulus))


@pytest.mark.nightly
def test_a_blank_interpolates_what_it_was_not_solved_for():
    other = {"x60": {"youngs_modulus_pa": 6e6 * 0.75, "relative_permittivity": 4.68 * 1.2}}
    solved = blank(make({**TRI, "material_values": other}))
    between = blank(make(TRI))
    assert between.capacitance_f_per_m(np.log(1.2)) == pytest.approx(solved.capacitance_f_per_m(0.0), rel=2e-3)
    at = [1e4, 1e5]
    rise = np.interp(at, *solved.rise(0.0, 0.0)), np.interp(at, *between.rise(np.log(1.2), np.log(0.75)))
    assert rise[1] == pytest.approx(rise[0], rel=0.01)


def test_it_remembers(tri):
    worn = replace(tri, truth=Truth(hysteresis=0.05, creep=0.02))
    plain = worn.rise(2.0, 5e-3)
    assert worn.rise(2.0, 5e-3, unloading=0.5) / plain == pytest.approx(1.025)
    assert worn.rise(2.0, 5e-3, decades=1.0) / plain == pytest.approx(1.02)
    assert worn.rise(0.0, 5e-3) == 0.0


def test_drawn_specimens_are_reproducible_and_as_wide_as_said(tri):
    made = [drawn(tri.design, seed) for seed in range(400)]
    assert made[7] == drawn(tri.design, 7) != made[8]
    scatter = np.log(0.088 / 0.02) / (2 * 1.96)  # the range of thesis-d.1 holds 95 %
    for name, sd in (("resistivity", scatter), ("permittivity", 0.1), ("modulus", 0.25), ("film_mm", 0.02 / 1.96)):
        values = np.array([getattr(truth, name) for truth in made])
        assert values.std() == pytest.approx(sd, rel=0.12)
        assert abs(values.mean()) < 0.2 * sd


def test_a_source_with_a_range_decides_how_they_are_drawn(tmp_path, monkeypatch):
    monkeypatch.setenv("SENSORGEN_MATERIALS", str(tmp_path))
    (tmp_path / "ours.yaml").write_text(
        "about: ours\nmaterials:\n  x60:\n    youngs_modulus_pa: {value: 2.0e+6, low: 1.0e+6, high: 4.0e+6}\n"
    )
    design = make({**TRI, "materials": {"dielectric": "x60@ours"}})
    moduli = np.array([drawn(design, seed).modulus for seed in range(400)])
    assert np.mean(np.abs(moduli) < np.log(2)) == pytest.approx(0.95, abs=0.03)
    assert PressedSpecimen(design, Truth(modulus=0.1)).values()["youngs_modulus_pa"] == pytest.approx(2e6 * np.exp(0.1))


@pytest.mark.parametrize("bad", [{"leak": -1.0}, {"creep": np.nan}, {"drift_s": 0.0}, {"short_share": 2.0}])
def test_what_no_specimen_is_is_refused(bad):
    with pytest.raises(BadInput, match=r"\w+ is .*; expected"):
        checked(Truth, bad)


@pytest.mark.parametrize("name", ["blank", "cell", "specimen", "mechanics"])
def test_it_is_written_apart_from_what_analyses_it(name):
    import ast

    import sensorgen.measure.virtual as package

    tree = ast.parse((Path(package.__file__).parent / f"{name}.py").read_text("utf-8"))
    imported = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    apart = ("models", "prediction", "solvers", "analysis", "measure.lab")
    assert not [module for module in imported if module.startswith(tuple(f"sensorgen.{one}" for one in apart))]


def test_a_cell_is_solved_once_whatever_its_tracks_resist(monkeypatch):
    """The modulus, which the pressed cell depends on, is solved anew."""
    solved = []
    monkeypatch.setattr(tables, "_SOLVED", {})
    monkeypatch.setattr(tables, "_solved", lambda design: solved.append(design) or [[[[1.0]]], 0.0])
    ends = dict.fromkeys(("top_electrode", "bottom_electrode"), "etpu@thesis-3.2")
    usual, other = blank(make(TRI)), blank(make({**TRI, "materials": ends}))
    assert len(solved) == 1
    assert other.track_ohm_per_m[1] == pytest.approx(usual.track_ohm_per_m[1] * 0.833333 / 0.042, rel=1e-5)
    blank(make({**TRI, "material_values": {"etpu": {"youngs_modulus_pa": 1e7}}}))
    assert len(solved) == 2
