"""``sensorgen stack``, in a group of its own so that it does not matter what else there is."""

import pytest


def test_it_prints_tables(run):
    said = run("stack", "double", "--isolation", "0.3").clean
    for word in ("lower film alone", "difference alone", "0.3 mm", "bare", "top driven", "bridge", "doubt:"):
        assert word in said.out
    assert max(map(len, said.out.splitlines())) <= 80
    row = next(line for line in said.out.splitlines() if line.strip().startswith("1.1 kHz"))
    assert row.split()[-2:] == ["0", "0"]  # of films that are alike, not 3.4e-13


@pytest.mark.parametrize("command", ["stack", "sheet"])
def test_an_array_is_no_sensor_of_one_pair_of_electrodes(run, command):
    """One crossing was taken for it, without a word."""
    found = run(command, "array")
    assert (found.code, found.out) == (2, "")
    assert "is an array; expected" in found.line


@pytest.mark.parametrize(
    "words",
    [
        pytest.param(("tri", "--dielectric", "0.1"), marks=pytest.mark.nightly),
        ("double", "--force", "9mN", "--noise", "90%"),
    ],
)
def test_cells_of_its_tables_stay_apart(run, words):
    """Each row of a table has as many columns as its neighbours, whatever the size of its numbers."""
    said = run("stack", *words, "--isolation", "0.37", "--frequencies", "1mHz,1GHz").out.splitlines()
    for start, count, columns in (("1 mHz", 2, 8), ("bare", 1, 13), ("0.37 mm", 1, 14)):
        first = next(k for k, line in enumerate(said) if line.strip().startswith(start))
        for line in said[first : first + count]:
            assert len(line) <= 80
            assert len(line.split()) == columns, line


def test_its_json_is_plain(run):
    found = run("stack", "tri", "--dielectric", "0.1", "--force", "3N", "--position", "45", "--json").json
    assert (found["force_n"], found["position_m"]) == (3.0, pytest.approx(0.045))
    assert [row["frequency_hz"] for row in found["readings_ohm"]][-1] == 99.7e3
    assert {row["wiring"] for row in found["touch"]} == {"top driven", "top at ground", "bridge, either way round"}
