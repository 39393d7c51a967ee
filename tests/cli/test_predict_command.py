"""``sensorgen predict`` with presses: tables, JSON, CSV, pictures, and what it refuses."""

import csv
import io
import json
import math

import pytest
from line_cases import PLATE as LINE_PLATE

from sensorgen.analysis.plots import results as plots
from sensorgen.models import line

pytestmark = pytest.mark.usefixtures("shared_cache")
PRESSES = ["--force", "0:6:3N", "--position", "20,50", "--frequencies", "1.1kHz,99.7kHz"]
FREE = ("predict", "reference", "--sides", "free", "--drawn")
PLATE = LINE_PLATE | {"top_resistivity_ohm_m": 0.042, "bottom_resistivity_ohm_m": 0.042}
BONDED = 72604250.62887481 / 6e6  # times E, tests/models/test_sandwich.py: 11.77 by finite elements, to 4 %


def at_point(f, force, x_mm, tip_mm=10.0, stiffer=1.0):
    """The pressed plate straight from the line."""
    press = {"force_n": force, "tip_m": tip_mm / 1e3, "left_m": (x_mm - tip_mm / 2) / 1e3, "frequency_hz": f}
    return complex(line.impedance(line.PressedLine(**PLATE | press | {"modulus_pa": 6e6 * stiffer})))


def close(z):
    return (pytest.approx(z.real, rel=1e-12, abs=0), pytest.approx(z.imag, rel=1e-12, abs=0))


def rows_of(text):
    return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(io.StringIO(text))]


def test_piezoresistance_in_words_reaches_the_line(run):
    """S_n is k over the pressed area, 1 cm2."""
    said = run(*FREE, "--set", "piezoresistance_etpu=2e-6", "--force", "6", "--position", "50", "--json")
    data, press = json.loads(said.out), {"force_n": 6.0, "tip_m": 0.01, "left_m": 0.045}
    rises = {"top_piezoresistance_per_n": 0.02, "bottom_piezoresistance_per_n": 0.02}
    for f, re, im in zip(data["frequency_hz"], data["re_ohm"], data["im_ohm"], strict=True):
        z = complex(line.impedance(line.PressedLine(**PLATE | press | rises | {"frequency_hz": f})))
        assert (re[0][0], im[0][0]) == close(z)
    own = {"material": "etpu", "quantity": "piezoresistance_per_pa", "value": 2e-6, "source": "set by the user"}
    assert own in data["prediction"]["values"]


def test_csv_against_the_line(run):
    said = run(*FREE, *PRESSES, "--csv").clean
    rows = rows_of(said.out)
    assert [(row["force_n"], row["position_mm"]) for row in rows] == [(f, x) for f in (0, 3, 6) for x in (20, 50)]
    for row in rows:
        for f, name in ((1.1e3, "1.1kHz"), (99.7e3, "99.7kHz")):
            z = at_point(f, row["force_n"], row["position_mm"])
            assert (row[f"re_ohm_{name}"], row[f"im_ohm_{name}"]) == close(z)
    assert len(rows[0]) == 6


def test_json_and_csv_say_the_same(run):
    found = json.loads(run(*FREE, *PRESSES, "--json").out, parse_constant=pytest.fail)
    assert set(found) == {
        "prediction", "compression", "tip_mm", "doubts", "axes", "frequency_hz", "force_n", "position_mm", "re_ohm",
        "im_ohm", "profile", "contact_mm",
    }  # fmt: skip
    rows = iter(rows_of(run(*FREE, *PRESSES, "--csv").out))
    assert (found["frequency_hz"], found["force_n"], found["position_mm"]) == ([1100, 99700], [0, 3, 6], [20, 50])
    for j, force in enumerate(found["force_n"]):
        for i, x in enumerate(found["position_mm"]):
            row = next(rows)
            assert (row["force_n"], row["position_mm"]) == (force, x)
            for k, name in enumerate(("1.1kHz", "99.7kHz")):
                z = complex(row[f"re_ohm_{name}"], row[f"im_ohm_{name}"])
                assert (found["re_ohm"][k][j][i], found["im_ohm"][k][j][i]) == close(z)
    assert found["axes"] == ["frequency_hz", "force_n", "position_mm"]


@pytest.mark.parametrize(
    ("words", "stiffer", "tip"),
    [
        ([], BONDED, 10.0), (["--compression", "bonded"], BONDED, 10.0),
        (["--sides", "free", "--tip", "2cm"], 1.0, 20.0),
        (["--compression", "unconfined", "--tip", "5"], 1.0, 5.0),
    ],
)  # fmt: skip
def test_law_and_tip_reach_the_sensor(run, words, stiffer, tip):
    press = ("--force", "5", "--position", "50", "--frequencies", "50kHz")
    found = run("predict", "reference", "--drawn", *press, "--json", *words).json
    assert (found["re_ohm"][0][0][0], found["im_ohm"][0][0][0]) == close(at_point(5e4, 5.0, 50.0, tip, stiffer))
    assert found["tip_mm"] == pytest.approx(tip)
    assert found["compression"] == ("bonded" if stiffer > 1 else "unconfined")
    assert "bonded to" in found["doubts"][0]


def test_axes_that_are_not_named(run):
    forces = run(*FREE, "--position", "50", "--json").json
    assert (forces["force_n"], forces["position_mm"]) == ([k / 10 for k in range(61)], [50])
    assert forces["frequency_hz"] == [1100, 2300, 5300, 10100, 19900, 49900, 99700]
    places = run(*FREE, "--length", "50", "--force", "1", "--json").json
    assert (places["force_n"], places["position_mm"]) == ([1], [k / 2 for k in range(101)])


def test_a_comma_stands_between_two_positions(run):
    """One mm and five mm, not one and a half."""
    assert "2 positions 1 to 5 mm" in run(*FREE, "--position", "1,5").out


def test_without_a_load(run):
    said = run(*FREE)
    least, most = 1 + 3.68 / math.exp(0.196), 6.33  # permittivity, of 4.68 in 69.06 pF; leads and the edge beyond
    assert f"capacitance          69.1 pF ({math.floor(69.06 * least / 4.68)} to 110)" in said.out
    assert 69.06 * most / 4.68 + 5 < 110
    assert "top electrode        1.4 kohm (0.66 to 7.3)" in said.out  # 0.042 (0.02 to 0.088) ohm m, 4.3 kohm
    found = run(*FREE, "--json", "--frequencies", "1kHz,1MHz").json
    assert [row["frequency_hz"] for row in found["impedance"]] == [1e3, 1e6]
    assert "1 MHz" in run(*FREE, "--frequencies", "1MHz").out


def span(values):
    ordered = sorted(values)
    return ordered[-1] - ordered[0]


def last_of_table(lines):
    """Numbers of the last row of R and X, which the budget follows."""
    return lines[lines.index("", lines.index("R and X [ohm] at 99.7 kHz")) - 1].split()[2:]


def test_the_table(run):
    said = run(*FREE, *PRESSES, "--details").clean
    lines = said.out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0] == "reference, drawn: 3 forces 0 to 6 N, 2 positions 20 to 50 mm;"
    assert lines[1] == "tip 10 mm, compression unconfined"
    assert lines[2].startswith("doubtful: plate free to expand sideways")
    rows = [row.split() for row in lines]
    ends, changes = ([float(cell) for cell in row[2:]] for row in rows if row[:2] == ["99.7", "kHz"] and len(row) == 6)
    values = {(f, x): at_point(99.7e3, f, x) for f in (0, 3, 6) for x in (20, 50)}
    (low, high, least, most), (re_f, re_x, im_f, im_x) = ends, changes
    assert low == pytest.approx(min(z.real for z in values.values()), rel=1e-5)
    assert high == pytest.approx(max(z.real for z in values.values()), rel=1e-5)
    assert least == pytest.approx(min(z.imag for z in values.values()), rel=1e-5)
    assert most == pytest.approx(max(z.imag for z in values.values()), rel=1e-5)
    deviation = 1e-3 * max(map(abs, values.values()))
    at_50, at_6 = [values[f, 50] for f in (0, 3, 6)], [values[6, x] for x in (20, 50)]
    for points, of_r, of_x in ((at_50, re_f, im_f), (at_6, re_x, im_x)):
        assert of_r == pytest.approx(span(z.real for z in points) / deviation, rel=5e-3)
        assert of_x == pytest.approx(span(z.imag for z in points) / deviation, rel=5e-3)
    corner = [float(word) for word in last_of_table(lines)]
    expected = [v for x in (20, 50) for v in (values[6, x].real, values[6, x].imag)]
    assert corner == pytest.approx(expected, rel=1e-6)
    assert "R and X [ohm] at 99.7 kHz" in lines
    assert "error budget at 6 N and 50 mm, at the worst frequency" in lines
    assert any(line.startswith("largest: ") for line in lines)


def test_a_single_press(run):
    lines = run(*FREE, "--force", "2", "--position", "30").out.splitlines()
    assert lines[0] == "reference, drawn: force 2 N, position 30 mm;"
    z = at_point(99.7e3, 2.0, 30.0)
    assert list(map(float, last_of_table(lines))) == pytest.approx([z.real, z.imag], rel=1e-6)
    assert not any("change of R and X" in line for line in lines)  # one press moves nothing


def test_the_card_is_of_the_greatest_press_and_the_noise_asked_for(run):
    """Standard errors go with the noise: those of the plate at 0.1 % are 2.23 N and 225 mm."""
    slots = ["--material", "top_electrode=etpu@thesis-c.1-top", "--material", "bottom_electrode=etpu@thesis-c.1-bottom"]
    words = (*FREE, *PRESSES[:-2], *slots, "--noise", "1%", "--json")
    found = run(*words).json["prediction"]["identifiability"]
    assert (found["noise"], found["press"]["force_n"], found["press"]["position_m"]) == (0.01, 6, 0.05)
    assert found["sigma_force_n"] == pytest.approx(22.3, rel=1e-3)
    assert found["sigma_position_m"] == pytest.approx(2.25, rel=1e-3)
    said = run(*FREE, *PRESSES, "--noise", "1%").out
    assert "at 1 % noise this design cannot sense force" in said


def test_the_verdict_on_a_cell_that_nobody_solved_says_so(run):
    found = run("predict", "tri", "--drawn", "--compression", "unconfined", "--json").json["identifiability"]
    said = "not known, as the cell was not solved, and is taken to deform as a solid plate;"
    assert found["verdict"].startswith(said)
    assert (found["senses_force"], found["locates"]) == (None, None)
    assert not any("triangles 2 mm apart" in change["change"] for change in found["changes"])
    solved = run("predict", "tri", "--drawn", "--json").json["identifiability"]
    assert (solved["senses_force"], solved["assumed"]) == ("yes", None)


@pytest.mark.parametrize("more", [["--csv", *PRESSES], ["--json"], PRESSES])
def test_a_file_holds_what_the_terminal_would_show(run, tmp_path, more):
    words = [*FREE, *more]
    said = run(*words, "-o", "out.txt")
    assert (said.code, said.out, said.err) == (0, "out.txt\n", "")
    assert (tmp_path / "out.txt").read_bytes().decode() == run(*words).out == run(*words, "-o", "-").out
    assert [p.name for p in tmp_path.iterdir()] == ["out.txt"]


def test_pictures_are_put_in_their_folder(run, tmp_path, monkeypatch, shared_cache):
    """Drawn by tests/test_plots.py; here each is its name."""
    monkeypatch.setattr(plots, "files", lambda *_: [(name, name.encode()) for name in plots.STEPS])
    said = run(*FREE, *PRESSES, "--plot", "a/b").clean
    assert {p.name: p.read_text() for p in (tmp_path / "a/b").iterdir()} == {name: name for name in plots.STEPS}
    assert said.out.splitlines() == [f"a/b/{name}" for name in plots.STEPS]
    assert [p.name for p in tmp_path.iterdir() if p.name not in ("a", "log.db")] == []


def test_a_picture_where_a_file_is(run, tmp_path, monkeypatch, shared_cache):
    monkeypatch.setattr(plots, "files", lambda *_: [("identifiability.png", b"")])
    (tmp_path / "p").write_text("mine")
    assert "cannot write 'p/identifiability.png': File exists" in run(*FREE, *PRESSES, "--plot", "p").refusal
    assert (tmp_path / "p").read_text() == "mine"


def test_a_short_has_no_answer_to_a_press(run):
    for how in (["--json"], ["--csv"], ["--plot", "p"], []):
        said = run("predict", "tri", "--drawn", "--dielectric", "0", "--force", "1", *how)
        assert (said.code, said.out) == (2, "")
        assert "the electrodes touch" in said.line


def test_options_are_what_the_planner_knows():
    from sensorgen.cli.predictions import predict_command as command
    from sensorgen.models.pressure import PROFILES
    from sensorgen.prediction.query import LAWS

    options = {option.name: option for option in command.own}
    assert tuple(options["law"].type.choices) == LAWS
    assert tuple(options["profile"].type.choices) == PROFILES


def test_a_round_tip_presses_harder_in_its_middle_and_moves_less(run):
    """The film stiffens, so that the same force moves the impedance less where it is not spread evenly."""
    words = ["predict", "tri", "--drawn", "--force", "0:6:6", "--position", "50", "--json"]
    even, round_ = (run(*words, "--profile", name).json for name in ("uniform", "parabola"))
    assert (even["profile"], round_["profile"]) == ("uniform", "parabola")
    moved = [found["im_ohm"][0][1][0] - found["im_ohm"][0][0][0] for found in (even, round_)]
    assert 0.9 < moved[1] / moved[0] < 1.0
    assert "tip 10 mm (parabola), compression" in run(*words[:-1], "--profile", "parabola").out


def test_a_round_tip_touches_over_a_length_that_grows(run):
    """On a bed eight times the force is twice the length; a flat tip has no radius."""
    words = (*FREE, "--position", "50", "--profile", "parabola", "--tip-radius", "20")
    one, eight = (run(*words, "--force", force, "--json").json["contact_mm"] for force in ("0.5", "4"))
    assert eight == pytest.approx(2 * one, rel=1e-9)
    assert f"contact {eight:.3g} mm at 4 N" in run(*words, "--force", "4").out
    assert "has no radius" in run(*FREE, "--force", "1", "--tip-radius", "20").refusal
    assert "has no radius" in run(*FREE, "--tip-radius", "20").line
