"""Identifiability as text: what a person looks for is there, and it fits the screen."""

from dataclasses import replace

import pytest

from card_sensors import BONDED, CAPACITOR, PLATE
from sensorgen.core.document import text
from sensorgen.models import compression
from sensorgen.prediction.identifiability.identify import identify
from sensorgen.prediction.identifiability.results import StandardErrors
from sensorgen.prediction.query import TONES_HZ

MANY = [1e3 * 1.1**k for k in range(60)]


def printed(sensor=PLATE, tones=TONES_HZ, **more) -> str:
    return "\n".join(text(identify(sensor, tones, **more).document()))


@pytest.mark.parametrize("more", [{"stiffest": BONDED}, {"sensor": CAPACITOR}, {"tones": MANY}])
def test_it_fits_the_screen(more):
    lines = printed(**more).splitlines()
    assert len(lines) <= 30
    assert max(len(line) for line in lines) <= 80


def test_it_says_what_the_plate_cannot_do():
    said = " ".join(printed(stiffest=BONDED).split())
    assert "verdict at 0.1 % noise this design cannot sense force and cannot locate a press" in said
    assert "position to 225 mm" in said
    assert "(213 N, 21 m)" in said
    assert (
        "1. triangles 2 mm apart over a film of 0.1 mm (tri), as drawn, in place of this cell: 0.15 N, 8.2 mm" in said
    )
    assert "all together:" in said
    assert "99.7 kHz (6 N, 258 mm); 49.9 + 99.7 kHz" in said
    assert "of all up to 1 MHz:" in said
    assert "above 1 N, force is resolved to 0.6 N in 0 % of presses, position to 10 mm in 0 %" in said


def test_a_tone_is_held_against_the_noise():
    """6 N strain the film by 1 %, on a tenth of the sensor: 0.1 % per 6 N, at every tone."""
    row = next(line.split() for line in printed().splitlines() if line.strip().startswith("1.1 kHz"))
    assert row == ["1.1", "kHz", "2.093", "Mohm", "0.017", "4.3e-06", "14", "0"]


def test_of_many_tones_those_are_shown_that_tell_of_position():
    rows = [line.split() for line in printed(tones=MANY).splitlines() if "ohm " in line]
    assert len(rows) == 7
    assert all(row[1] == "kHz" and 100 < float(row[0]) < 300 for row in rows)
    assert [float(row[0]) for row in rows] == sorted(float(row[0]) for row in rows)


def test_what_is_undefined_is_said_in_words():
    said = printed(CAPACITOR)
    assert "nan" not in said
    assert "None" not in said
    assert "Z does not depend on position" in " ".join(said.split())
    assert "no frequencies determine both force and position" in said


def test_where_nothing_helps_it_says_so():
    assert "none of the changes that were tried" in printed(force_n=0.0)


def test_a_doubt_about_the_map_is_told():
    law = compression.curve("example", "made up", [0.0, 1e5], [1.0, 1.3])
    assert "above 100 kPa the curve is extended" in " ".join(printed(replace(PLATE, compression=law)).split())


def test_errors_on_a_bench_beyond_the_sensor_are_said_as_what_it_cannot_do():
    errors = StandardErrors(sigma_force_n=0.5, sigma_position_m=0.188)
    assert errors.words(6.0, 0.1) == "0.5 N, cannot locate"  # no 188 mm on a sensor of 100 mm
    assert errors.words() == "0.5 N, 188 mm"
