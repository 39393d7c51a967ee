"""``sensorgen bench plan``: a design in, presses for a rig out."""

import csv
import io
import json

import pytest


def test_a_plan_as_csv_stays_on_the_sensor(run):
    said = run("bench", "plan", "tri", "--presses", "200", "--tip", "20mm", "--seed", "3")
    assert (said.code, said.err) == (0, "")
    rows = list(csv.DictReader(io.StringIO(said.out)))
    assert len(rows) == 200
    at, force = ([float(row[name]) for row in rows] for name in ("position_mm", "force_n"))
    assert 10 <= min(at) < 15 < 85 < max(at) <= 90  # the tip's middle on a sensor of 100 mm
    assert 0 <= min(force) < 0.2 < 5.8 < max(force) <= 6
    assert run("bench", "plan", "tri", "--presses", "200", "--tip", "20mm", "--seed", "3").out == said.out
    assert run("bench", "plan", "tri", "--presses", "200", "--tip", "20mm", "--seed", "4").out != said.out


def test_a_plan_as_json_file_and_picture(run, tmp_path):
    table, picture = tmp_path / "plan.csv", tmp_path / "plan.png"
    words = ("bench", "plan", "reference", "--presses", "5", "--repeats", "1", "--force", "1:2:1N", "--dwell", "2")
    said = run(*words, "-o", str(table), "--picture", str(picture), "--json")
    data = json.loads(said.out)
    assert (data["design"], data["repeats"], data["force_n"], len(data["steps"])) == ("reference", 1, [1.0, 2.0], 10)
    assert len(table.read_text().splitlines()) == 11
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert run(*words, "-o", str(table)).out == f"{table}: 10 presses, 1 min 26 s\n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--force", "6"), "expected the least and the largest"),
        (("--tip", "101"), "longer than the sensor, 100 mm"),
        (("--dwell", "0"), "expected a dwell above 0"),
        (("--seed", "-1"), "--seed -1; expected"),
        (("--picture", "plan.jpg"), "ends in .png"),
        (("--presses", "60000", "--repeats", "1"), "expected up to 100000"),
    ],
)
def test_what_cannot_be_planned_is_refused(run, words, said):
    found = run("bench", "plan", "reference", *words)
    assert found.code == 2
    assert said in found.err
