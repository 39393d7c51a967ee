"""``--as-printed`` and ``--compensate``: what is told, exit codes, errors; without a slicer."""

import json

import pytest

SMALL = ["tri", "--size", "12x8"]


def test_predict_tells_drawn_and_printed(run):
    said = run("predict", *SMALL, "--dielectric", "0.1", "--as-printed", "--walls", "classic")
    assert (said.code, said.err) == (1, "")  # layers are lost
    assert "ESTIMATE" in said.out
    assert "electrode gap           0.1 mm   0.3 mm" in said.out
    assert "0.00 -6" in said.out


def test_a_sound_print_ends_with_0(run):
    said = run("predict", "reference", "--as-printed")
    assert said.code == 0
    assert "electrode gap           0.6 mm   0.6 mm" in said.out


def test_the_gap_is_that_of_any_two_electrodes(run):
    said = run("predict", "double", "--size", "12x8", "--as-printed")
    assert "electrode gap           0.6 mm   0.6 mm" in said.out
    assert said.out.count("more than two electrodes") == 1  # the same reason of all models, told once


def test_a_waiver_accepts_lost_layers(run, tmp_path):
    waivers = "waivers: [{rule: '7', reason: tips are known to go}]"
    (tmp_path / "mine.yaml").write_text(f"shape: tri\nparameters: {{length_mm: 12, width_mm: 8}}\n{waivers}\n")
    assert run("predict", str(tmp_path / "mine.yaml"), "--as-printed").code == 0


def test_json_is_plain(run):
    found = json.loads(run("predict", *SMALL, "--as-printed", "--json").out)
    assert found["estimate"] is True
    assert found["electrode_gap_mm"]["printed"] == [0.3, 0.3]
    assert {row["body"] for row in found["layers"]} > {"film_and_lower", "top_electrode_with_cogs"}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--slicer", "prusa"], "--as-printed"),
        (["--walls", "cura"], "--as-printed"),
        (["--as-printed", "--slicer", "prusa", "--walls", "cura"], "expected one"),
        (["--as-printed", "--tip", "5"], "at rest"),
        (["--as-printed", "--compression", "solved"], "at rest"),
        (["--as-printed", "--walls", "arachn"], "arachne"),
        (["--as-printed", "--slicer", "pruser"], "prusa"),
    ],
)
def test_words_that_do_not_go_together(run, words, told):
    said = run("predict", *SMALL, *words)
    assert said.code == 2
    assert told in said.line


def pressed(run, *words):
    said = run("predict", *words, "--force", "0:6:3", "--position", "6", "--frequencies", "1.1kHz", "--json")
    assert said.code == 0
    return json.loads(said.out)


def test_presses_of_a_plate_are_as_drawn(run):
    """Its print is the plate itself."""
    words = ("reference", "--size", "12x8")
    drawn, printed = pressed(run, *words), pressed(run, *words, "--as-printed")
    assert printed["im_ohm"][0] == [[pytest.approx(x, rel=1e-9) for x in row] for row in drawn["im_ohm"][0]]
    assert printed["doubts"][0].startswith("printed, estimated (Arachne)")


def test_presses_are_of_the_printed_capacitance(run):
    """X at rest and low frequency is 1 / (2 pi f C), and C of the print is what it is told to be at rest."""
    words = (*SMALL, "--dielectric", "0.1", "--compression", "unconfined")
    printed, classic = pressed(run, *words, "--as-printed"), pressed(run, *words, "--as-printed", "--walls", "classic")
    at_rest = [
        json.loads(run("predict", *SMALL, "--dielectric", "0.1", "--as-printed", "--walls", w, "--json").out)
        for w in ("arachne", "classic")
    ]
    expected = [-1 / (2 * 3.14159265 * 1.1e3 * found["capacitance_f"]["printed"]["middle"]) for found in at_rest]
    assert [f["im_ohm"][0][0][0] for f in (printed, classic)] == pytest.approx(expected, rel=1e-6)


def test_a_missing_slicer_is_told(run, monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    said = run("predict", *SMALL, "--as-printed", "--slicer", "prusa")
    assert said.code == 2
    assert "prusa-slicer" in said.line


def test_the_drawing_has_printed_outlines_and_rule_7(run):
    plain = run("draw", *SMALL, "-o", "-").out
    printed = run("draw", *SMALL, "--as-printed", "-o", "-").out
    assert 'class="printed"' not in plain
    assert printed.count('class="printed"') == 4  # bodies
    assert "7-printed" in printed
    assert "green outlines: printed, estimated (Arachne)" in printed


def test_a_build_is_compensated(run, contents, tmp_path):
    said = run("build", *SMALL, "--dielectric", "0.2", "--no-cad", "--compensate", "print")
    assert said.code == 1  # the tips are lost all the same
    assert "dielectric_mm                  0.2 -> 0.1" in said.out
    assert "0.3 -> 0.2: 0.2 mm asked" in said.out
    assert any("d0.1" in name for name in contents(tmp_path / "out"))
    found = json.loads(run("build", *SMALL, "--no-cad", "--compensate", "bake", "--json").out)
    assert found["compensated"][0] == {
        "what": "shrinkage", "before": 0.0, "after": 0.2, "why": "the bake takes it off in the plane",
    }  # fmt: skip


def test_nothing_to_compensate(run):
    assert "nothing to change" in run("build", "reference", "--size", "12x8", "--no-cad", "--compensate", "print").out
