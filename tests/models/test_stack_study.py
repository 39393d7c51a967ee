"""What the second film and the isolation are worth: known limits, and the sentences of docs/stack.md."""

from pathlib import Path

import numpy as np
import pytest
from drawn_sensor import sensor_of

from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import make
from sensorgen.models.compression import unconfined
from sensorgen.models.stack import Film, GroundTie, Press, Stack, Track
from sensorgen.prediction.double_layer import WIRINGS, Touching, bounds, halves, press_at, stack_of, stacked, study
from sensorgen.prediction.query import TONES_HZ

TONES = np.array(TONES_HZ)
PRESS = Press(6.0, 0.04, 0.01)
EVEN = (Track(45e3),) * 3
TWINS = Stack(0.1, 0.01, EVEN, (Film(6.9e-10, unconfined(6e6).capacitive_strain),) * 2)
STIFF_BELOW = Stack(
    0.1,
    0.01,
    EVEN,
    (Film(6.9e-10, unconfined(6e9).capacitive_strain), Film(6.9e-10, unconfined(6e6).capacitive_strain)),
)


def by_name(stack):
    return {row.reading: row for row in bounds(stack, TONES, PRESS, 1e-3, 0.1)}


def test_a_stiff_second_film_takes_the_drift_away():
    found = by_name(STIFF_BELOW)
    alone, both = found["upper film alone"].force_n, found["both readings"].force_n
    rise = 1 / 6e6 / (0.01 * 0.1) / 0.99**2 / 1.001  # of ln C per newton; the drift is a rise of 0.1
    assert alone.drifting == pytest.approx(0.1 / rise, rel=0.2)
    assert both.drifting < 1.5 * both.known
    difference = found["difference alone"].force_n
    assert difference.drifting == pytest.approx(np.hypot(difference.known, 0.1 * 6.0), rel=0.05)
    assert found["difference alone"].force_n.known == pytest.approx(np.sqrt(2) * alone.known, rel=0.02)


def touching(stack=TWINS):
    return Touching(stack, 4.68, TONES, PRESS, 1e-3, GroundTie())


def test_bare_and_isolated_touches_are_capacitors_in_a_row():
    """Where the line is short: 100 pF, or it behind the isolation, beside the film of 69 pF pressed to 69.07."""
    single = Stack(0.1, 0.01, EVEN[:2], TWINS.films[:1])
    film, isolation = 69e-12 * (0.9 + 0.1 / 0.99), 8.8541878128e-12 * 4.68 * 1e-4 / 1e-4
    for thickness, aside in ((0.0, 100e-12), (0.1, 1 / (1 / 100e-12 + 1 / isolation))):
        shift = touching(single).shift_ohm(thickness, WIRINGS[0])[0] * 2j * np.pi * TONES[0] * film
        assert abs(shift) == pytest.approx(aside / (film + aside), rel=2e-3)


@pytest.mark.parametrize("wiring", WIRINGS, ids=lambda w: w.words)
def test_the_needed_thickness_is_where_the_error_meets_the_limit(wiring):
    found, limit = touching(), 0.05
    needed = found.thickness_mm(limit, wiring)
    if needed is None:
        assert abs(found.force_n(10.0, wiring)) > limit
        return
    assert abs(found.force_n(needed, wiring)) == pytest.approx(limit, rel=0.01)
    assert all(abs(found.force_n(t, wiring)) <= limit for t in np.geomspace(needed, 10.0, 20))
    assert found.thickness_mm(1e6, wiring) == 0.0


def test_the_force_of_a_known_shift_is_read_back():
    """A shift that is the derivative by force, times 0.25 N, is mistaken for 0.25 N."""
    found = touching()
    slope = TWINS.response(TONES, PRESS).by_force_ohm_per_n[..., -1, -1]
    object.__setattr__(found, "shift_ohm", lambda *_: 0.25 * slope)
    assert found.force_n(0.1, WIRINGS[0]) == pytest.approx(0.25, rel=1e-12)


def test_a_double_design_has_the_halves_of_two_plates():
    slots = {"bottom_electrode": "etpu@thesis-c.1-bottom"}
    given = {"lower_dielectric_mm": 0.3, "upper_dielectric_mm": 0.9}
    design = make({"shape": "double", "parameters": given, "materials": slots})
    lower, upper = stacked(design).double.films
    for film, thickness in ((lower, 0.3), (upper, 0.9)):
        assert film.capacitance_f_per_m == pytest.approx(8.8541878128e-12 * 4.68 * 10.0 / thickness, rel=1e-9)
    tracks = stacked(design).double.tracks
    assert tracks[1] == tracks[2] != tracks[0]  # the middle electrode is as the top one


def test_materials_of_the_halves_go_to_their_films():
    design = make({"shape": "double", "materials": {"film": "pla"}, "tools": {"pla": 5}})
    lower, upper = halves(design)
    assert (lower.materials.dielectric, upper.materials.dielectric) == ("pla", "x60")
    assert lower.materials.bottom_electrode == design.materials.bottom_electrode
    assert upper.materials.bottom_electrode == lower.materials.top_electrode == design.materials.top_electrode
    assert halves(lower) == [lower]


def test_another_shape_is_stacked_twice():
    plate = make({"shape": "reference"})
    found = stacked(plate, "unconfined")
    assert (len(found.own.films), len(found.double.films)) == (1, 2)
    sensor = sensor_of(plate, "unconfined").sensor
    z = stack_of([sensor]).impedance(99.7e3, PRESS)
    assert z[0, 0] == pytest.approx(complex(sensor.impedance(99.7e3, 6.0, 0.045)), rel=1e-12)


def test_a_press_that_overhangs_is_refused():
    with pytest.raises(OutOfRange, match="overhangs"):
        study(make({"shape": "reference"}), TONES_HZ, 6.0, 0.001, 1e-3, 0.1, 0.1)


PAGE = (Path(__file__).parents[2] / "docs" / "stack.md").read_text("utf-8")
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines() if line.startswith("|")]


def test_the_table_of_what_a_second_film_tells():
    """docs/stack.md, row by row; the films are given by how much stiffer the lower one is."""
    stiffer = {"equal plates, unconfined": 1, "lower ten times stiffer": 10, "lower bonded (94 E)": 94}
    rows = [row for row in ROWS if row[0] in stiffer]
    assert len(rows) == len(stiffer)
    for name, *cells in rows:
        films = tuple(Film(6.9e-10, unconfined(6e6 * times).capacitive_strain) for times in (stiffer[name], 1))
        found = by_name(Stack(0.1, 0.01, EVEN, films))
        ways = [found[way].force_n for way in ("upper film alone", "both readings", "difference alone")]
        for cell, force in zip(
            cells, [getattr(way, case) for case in ("known", "drifting") for way in ways], strict=True
        ):
            assert (
                force is None if cell == "nothing" else float(cell.removesuffix(" N")) == pytest.approx(force, rel=3e-3)
            )


def test_the_table_of_what_a_touch_does():
    """docs/stack.md, row by row; the plate is free at its sides, as in the table of the second film."""
    designs = iter(
        [({"shape": "reference"}, "unconfined"), ({"shape": "tri", "parameters": {"dielectric_mm": 0.1}}, "")]
    )
    rows = [row for row in ROWS if len(row) == 7 and row[1] in {w.words for w in WIRINGS}]
    assert len(rows) == 2 * len(WIRINGS)
    for row, wiring in zip(rows, 2 * WIRINGS, strict=True):
        if row[0]:
            design, law = next(designs)
            found = stacked(make(design), law)
            of = Touching(found.own, found.isolation_eps_r, TONES, press_at(found, 6.0, 0.045), 1e-3, GroundTie())
        assert row[1] == wiring.words
        for cell, thickness in zip(row[2:6], (0.0, 0.1, 0.5, 1.0), strict=True):
            shift, force = (float(part.split()[0]) for part in cell.split(","))
            modulus = np.abs(of.unloaded_ohm())
            assert shift == pytest.approx(100 * np.max(np.abs(of.shift_ohm(thickness, wiring)) / modulus), rel=4e-2)
            assert force == pytest.approx(abs(of.force_n(thickness, wiring)), rel=4e-2)
        needed = of.thickness_mm(0.1, wiring)
        said = {None: "not even 10 mm", 0.0: "none"}.get(needed)
        assert row[6] == said if said else float(row[6].removesuffix(" mm")) == pytest.approx(needed, rel=2e-2)
