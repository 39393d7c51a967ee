"""``sensorgen sheet``: words in, bounds out."""

import json

import pytest

WORDS = ("sheet", "reference", "--size", "60x60", "--frequencies", "100kHz,1MHz")


def test_it_says_which_contacts_locate(run):
    said = run(*WORDS, "--contacts", "corners")
    assert said.code == 0, said.err
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


def test_twice_the_noise_is_twice_the_error(run):
    one, two = (
        json.loads(run(*WORDS, "--contacts", "corners", "--json", "--noise", noise).out)["contacts"]["corners"]
        for noise in ("0.1%", "0.2%")
    )
    assert two["sigma_x_m"][1][2] == pytest.approx(2 * one["sigma_x_m"][1][2], rel=1e-6)


def test_maps_are_drawn(run, tmp_path):
    said = run(*WORDS, "--contacts", "two-edges", "--plot", "maps")
    assert said.code == 0, said.err
    (picture,) = (tmp_path / "maps").iterdir()
    assert picture.name in said.out
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "say"),
    [
        (["--contacts", "corner-pads"], "did you mean 'corners'"),
        (["--force", "1,2"], "--force takes one number"),
        (["--force", "0"], "above 0"),
        (["--tip", "60"], "leaves no place"),
        (["--tip", "0"], "leaves no place"),
        (["--frequencies", "1kHz,1kHz"], "twice"),
        (["--frequencies", "-1"], "--frequencies"),
        (["--noise", "much"], "--noise"),
        (["--noise", "0"], "noise"),
        (["--frequencies", "1GHz,900GHz"], "too coarse"),
    ],
)
def test_wrong_words_are_one_line(run, words, say):
    said = run(*WORDS, *words)
    assert said.code == 2
    assert say in said.line
