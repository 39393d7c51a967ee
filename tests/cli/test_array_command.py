"""``sensorgen array``, ``build`` and ``invert`` of an array: words in, numbers and files out."""

import csv
import json

import numpy as np
import pytest

ARRAY = """
shape: array
parameters: {length_mm: 40, width_mm: 30, between: air}
cell: {shape: tri, parameters: {dielectric_mm: 0.2}}
"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "a.yaml").write_text(ARRAY)
    return "a.yaml"


def test_it_says_what_is_resolved(run, file):
    said = run("array", file, "--frequencies", "10kHz", "--fault", "c3:0").ok
    for words in ("3 rows x 4 columns, 12 crossings", "+10.6 % at 100 kPa", "guarded, through 50 ohm, 10 kHz",
                  "3 of 12 crossings are not determined", "extrapolated: 100 kPa exceeds 64 kPa",
                  "edges of the tracks are 21.3 %", "contact resistance"):  # fmt: skip
        assert words in said.words
    assert "share a factor 0.15 to 1.6: stiffness by its sources" in said.words
    data = run("array", file, "--json", "--pressure", "50").json
    assert data["shared_factor"] == pytest.approx([0.15, 1.632], rel=1e-2)
    assert data["pressure_kpa"] == 50
    assert np.shape(data["sigma_kpa"]) == (3, 4)


@pytest.mark.usefixtures("unpainted")
def test_a_virtual_step_is_inverted(run, file, tmp_path):
    said = run("array", file, "--simulate", "step.npz", "--plot", ".", "--p-short", "1%").ok
    assert (tmp_path / "a-array.png").is_file()
    assert "88.6 % of prints have no short at P(short) 0.01 of a crossing" in said.words  # 0.99^12
    page = (tmp_path / "a-array.html").read_text()
    assert all(words in page for words in ("Resolution of a", "r2:2", "r2c2", "a foot", "seen as two"))
    said = run("invert", file, "step.npz", "-o", "maps.npz", "--plot", ".").ok
    assert "60, inverted by" in said.words
    assert "of noise and scatter alone" in said.words
    assert "of 60 frames exceeds 64 kPa" in said.words
    assert "share a factor 0.15 to 1.6" in said.words
    assert (tmp_path / "a-map.png").is_file()
    with np.load(tmp_path / "maps.npz") as found, np.load(tmp_path / "step.npz") as true:
        off = (found["pressure_kpa"] - true["pressure_kpa"][5:]) / found["sigma_kpa"]
        assert found["pressure_kpa"].shape == (60, 3, 4)
        assert np.mean(np.abs(off) < 1.96) > 0.85
    said = run("invert", file, "step.npz", "-o", "frames.csv")
    rows = list(csv.DictReader((tmp_path / "frames.csv").read_text().splitlines()))
    assert len(rows) == 60
    assert float(rows[30]["force_n"]) > 20


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (("array", "tri"), "tri has no crossings"),
        (("array", "a.yaml", "--fault", "r9:1"), "expected r3:5"),
        (("array", "a.yaml", "--pressure", "-3"), "--pressure"),
        (("array", "a.yaml", "--input", "0"), "--input"),
        (("array", "a.yaml", "--readout", "two-terminal", "--input", "20"), "--input is of the guarded readout"),
        (("invert", "a.yaml", "f.csv", "--readout", "two-terminal", "--input", "20"), "--input is of the guarded"),
        (("array", "array", "--rows", "1.5"), "rows is 1.5; expected a whole number"),
        (("check", "array", "--pitch-x", "4mm", "--column", "4mm"), "leaves no space between columns"),
        (("invert", "a.yaml", "none.npz"), "none.npz"),
        (("invert", "a.yaml", "f.csv", "--perfect"), "--perfect is for lines"),
        (("invert", "a.yaml", "f.csv", "--gcode", "none.gcode"), "none.gcode"),
        (("invert", "a.yaml", "f.csv"), "no frequency of the readings"),
        (("invert", "a.yaml", "g.csv"), "frequency_hz is 1 kHz to 10 kHz; expected one frequency in all frames"),
        (("invert", "a.yaml", "f.csv", "-o", "f.h5"), "--output f.h5: expected a name in .npz"),
        (("array", "a.yaml", "--simulate", "f.csv"), "--simulate f.csv: expected a name that ends in .npz"),
        (("invert", "a.yaml", "f.csv", "--frequency", "10kHz"), "taken for rest; not read: Rest"),
    ],
)
def test_wrong_words_are_one_line(run, file, tmp_path, words, answer):
    (tmp_path / "f.csv").write_text("time_s,Rest,r1c1\n0,1,1e-12\n")
    (tmp_path / "g.csv").write_text("time_s,frequency_hz,r1c1\n0,1000,1e-12\n1,10000,1e-12\n")
    assert answer in run(*words).refusal


def test_build_writes_each_tile(run, tmp_path, monkeypatch):
    monkeypatch.setenv("SENSORGEN_SLICER", "none")
    parameters = {"length_mm": 100, "width_mm": 300, "pitch_x_mm": 50, "pitch_y_mm": 50, "column_mm": 40, "row_mm": 40}
    (tmp_path / "strip.yaml").write_text(json.dumps({"shape": "array", "parameters": parameters}))
    said = run("build", "strip.yaml", "--no-cad", "--force").ok
    assert "2 tiles, as it does not fit the bed" in said.out
    rows = list(csv.DictReader((tmp_path / "out" / "strip-tiles.csv").read_text().splitlines()))
    assert [row["design"] for row in rows] == ["strip-1", "strip-2"]
    for row in rows:
        files = {path.name for path in (tmp_path / "out" / row["design"]).iterdir()}
        assert {"wires.csv", f"{row['design']}.prusa.3mf", f"{row['design']}.html"} <= files
    words = " ".join(run("array", "strip.yaml").out.split())
    assert "2 columns, 12 crossings" in words
    assert "2 tiles are printed, of 10 wires together" in words  # 8 wires are of the one print that is not made


def test_the_shape_has_options_like_others(run):
    said = run("check", "array", "--rows", "2", "--columns", "3", "--budget", "0", "--json").ok
    assert "PRINT" in said.out
