"""``sensorgen sheet``: words in, bounds out."""

import json
import re
from types import SimpleNamespace

import numpy as np
import pytest

from sensorgen.core.document import text
from sensorgen.prediction.sheet_study import SheetStudy
from sensorgen.solvers.sheet.parts import Sheet, SheetPatch

WORDS = ("sheet", "reference", "--size", "60x60", "--frequencies", "100kHz,1MHz")


def test_it_says_which_contacts_locate(run):
    said = run(*WORDS, "--contacts", "corners").ok
    assert "corners" in said.out
    assert "locates a press" in said.out
    assert "at 100 kHz" in said.out
    assert "two-edges" not in said.out


def test_json_is_plain_and_holds_the_maps(run):
    said = run(*WORDS, "--contacts", "one-edge", "--json", "--noise", "1%", "--force", "2 N")
    data = json.loads(said.out, parse_constant=lambda word: pytest.fail(f"{word} is not JSON"))
    assert data["force_n"] == 2.0
    assert data["noise"] == 0.01
    bounds = data["contacts"]["one-edge"]
    assert bounds["frequency_hz"] == [1e5, 1e6]
    assert len(bounds["sigma_y_m"]) == len(bounds["x_m"])
    assert bounds["sigma_y_m"][3][3] is None  # on the axis of symmetry nothing tells of y


def test_a_turned_sensor_is_the_same_sheet(run):
    """Ridges along x and along y; against the plate of 0.3 mm, docs/conduction.md has 0.846 and 0.706."""
    tri = ("sheet", "tri", "--size", "40x40", "--drawn", "--contacts", "corners", "--frequencies", "100kHz", "--json")
    x, y = (run(*tri, "--along", along).json for along in "xy")
    plate = 0.042 / 0.3e-3
    assert x["sheet_resistance_ohm"]["top"] == pytest.approx(plate * np.sqrt(0.846 * 0.706), rel=1e-3)
    assert x["sheet_resistance_ohm"] == pytest.approx(y["sheet_resistance_ohm"])
    assert x["contacts"]["corners"]["sigma_x_m"][1][2] == pytest.approx(y["contacts"]["corners"]["sigma_x_m"][1][2])
    doubt = "top electrode: 118.4 ohm per square along x, 98.82 ohm along y: taken as isotropic, 108.2 ohm"
    assert [said.partition(":")[0] for said in (x["doubts"][-1], y["doubts"][-1])] == ["top electrode"] * 2
    assert x["doubts"][-1] == doubt


def test_contacts_of_ones_own_are_the_same_as_those_with_a_name(run):
    """Pads of a tenth of the side in all corners, and an edge: what `corners` and `one-edge` are."""
    corners = [w for x in ("0-6", "54-60") for y in ("0-6", "54mm-60mm") for w in ("--pad", f"{x},{y}")]
    edge = ["--pad", "0,0-60"]
    for own, name in ((corners, "corners"), (edge, "one-edge")):
        found = run(*WORDS, *own, "--contacts", name, "--json").json["contacts"]
        assert set(found) == {"pads", name}
        assert found["pads"]["sigma_force_n"][1] == pytest.approx(found[name]["sigma_force_n"][1], rel=1e-6)
        assert found["pads"]["impedance_ohm"]["re"][0][0] == pytest.approx(found[name]["impedance_ohm"]["re"][0][0])
    assert set(run(*WORDS, *edge, "--json").json["contacts"]) == {"pads"}


def test_the_impedance_from_one_edge_is_that_of_the_line(run):
    """Unpressed: coth of both sheets and the film that the answer itself names."""
    data = run(*WORDS, "--contacts", "one-edge", "--json").json
    r = sum(data["sheet_resistance_ohm"].values()) / data["width_m"]
    for k, hertz in enumerate((1e5, 1e6)):
        y = 2j * np.pi * hertz * data["capacitance_f_per_m2"] * data["width_m"]
        z = np.sqrt(r / y) / np.tanh(np.sqrt(r * y) * data["length_m"])
        got = data["contacts"]["one-edge"]["impedance_ohm"]
        assert got["re"][k][0][0] == pytest.approx(z.real, rel=2e-3)
        assert got["im"][k][0][0] == pytest.approx(z.imag, rel=2e-3)


def test_a_bonded_film_tells_less_of_force(run):
    said = [run(*WORDS, "--contacts", "corners", "--json", *more) for more in (("--compression", "unconfined"), ())]
    free, bonded = (json.loads(one.out)["capacitance_factor"] - 1 for one in said)
    assert 0 < bonded < free / 3


def test_maps_are_drawn(run, tmp_path):
    said = run(*WORDS, "--contacts", "two-edges", "--plot", "maps").ok
    (picture,) = (tmp_path / "maps").iterdir()
    assert picture.name in said.out
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("length_m", "words"),
    [
        (0.99951, "1 m"), (8949.0, "8.95 km"), (999_999.0, "1 Mm"), (3e9, "∞"), (float("inf"), "∞"),
    ],
)  # fmt: skip
def test_columns_stay_apart_whatever_the_errors(length_m, words):
    found = SimpleNamespace(
        sigma=lambda: np.array([[[2e12, length_m, length_m]]]), frequency_hz=np.array([1e5]),
        best_tones=lambda: np.array([0]), located=lambda: 1.0, verdict=lambda: "",
    )  # fmt: skip
    sheet = Sheet(0.1, 0.1, (450.0, 450.0), 7e-8)
    patch = SheetPatch(0.0, 0.0, 0.01, 0.01, 1.1)
    found = SheetStudy(sheet, patch, {}, {"two-edges": found, "b": found}, 6.0, 1e-3, ())
    row = next(line for line in text(found.document()) if line.startswith("two-edges  "))
    assert re.split("  +", row) == ["two-edges", "∞", words, words, "100", "100 kHz"]
