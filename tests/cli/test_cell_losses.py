"""``sensorgen cell`` where a dielectric loses or leaks: plates in closed form, in words, in tables, and refused."""

import csv
import io
import math

import pytest

from sensorgen.core.units import EPS0_F_PER_M

PLATE_F_PER_M2 = EPS0_F_PER_M * 4.68 / 0.6e-3


def middle(found):
    return (found["loss_lower_f_per_m2"] + found["loss_upper_f_per_m2"]) / 2


def test_a_plate_loses_what_its_dielectric_does(run):
    found = run("cell", "reference", "--set", "loss_x60=0.02", "--json", "--accuracy", "1e-6").ok.json
    assert found["lower_f_per_m2"] <= PLATE_F_PER_M2 <= found["upper_f_per_m2"]
    assert middle(found) == pytest.approx(0.02 * PLATE_F_PER_M2, rel=1e-6, abs=0)
    assert found["tan_delta"] == pytest.approx([0.02, 0.02], rel=1e-4)
    of_x60 = {v["quantity"]: v["value"] for v in found["values"] if v["material"] == "x60"}
    assert of_x60 == {"relative_permittivity": 4.68, "loss_tangent": 0.02}


def test_a_plate_leaks_by_its_frequency(run):
    """G = sigma A / d beside C: minus Im C = G / omega."""
    words = ("cell", "reference", "--set", "resistivity_x60=1e6", "--json", "--accuracy", "1e-6", "--frequency")
    for typed, hertz in (("1.1kHz", 1100.0), ("50", 50.0)):
        found = run(*words, typed).ok.json
        assert middle(found) == pytest.approx(1 / (1e6 * 0.6e-3) / (2 * math.pi * hertz), rel=1e-6, abs=0)
        assert found["frequency_hz"] == hertz


def test_lossless_designs_say_nothing_of_losses(run):
    found = run("cell", "reference", "--json", "--frequency", "1kHz").ok.json
    assert found["loss_lower_f_per_m2"] is found["tan_delta"] is found["frequency_hz"] is None


def test_in_words_and_planned(run):
    said = run("cell", "tri", "--set", "loss_x60=0.05", "--explain").out
    assert "minus the imaginary part" in said
    assert "loss tangent of x60 0.05 (set by the user)" in said
    assert "columns" in said
    assert "dielectric losses are solved by fem2d and fem3d alone" in " ".join(said.split())


def test_a_loss_may_be_swept_from_0(run):
    said = run("cell", "reference", "--sweep", "loss_x60=0,0.02", "--jobs", 1, "--csv", "--accuracy", "1e-5")
    none, some = ({k: float(row[f"{k}_f_per_m2"]) for k in ("loss_lower", "loss_upper", "lower")}
                  for row in csv.DictReader(io.StringIO(said.out)))  # fmt: skip
    assert none["loss_lower"] <= 0 <= none["loss_upper"] < 1e-5 * none["lower"]
    assert some["loss_lower"] / some["lower"] == pytest.approx(0.02, rel=1e-4)
