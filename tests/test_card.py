"""The identifiability card: its bounds against published numbers, a Fisher matrix by differences, and noisy fits."""

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from line_cases import PLATE as LINE_PLATE
from line_cases import exact
from pydantic import TypeAdapter
from scipy.optimize import least_squares

from card_sensors import BONDED, CAPACITOR, PLATE, TRI, of_resistivity, setup
from sensorgen.core.errors import SensorgenError
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import compression
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.identifiability import fisher
from sensorgen.prediction.identifiability.fisher import (
    Required,
    Slopes,
    bearable,
    bounds,
    bracket,
    metres,
    newtons,
    required,
    shares,
    slopes,
    spread,
    verdict,
)
from sensorgen.prediction.identifiability.identify import identify, surface
from sensorgen.prediction.identifiability.results import Identifiability, of_schema_1
from sensorgen.prediction.query import TONES_HZ

TEN_TIMES = tuple(10 * f for f in TONES_HZ)
ALONG = np.linspace(0.0051, 0.0949, 181)  # the tip rests on the sensor as a whole
TABLE_C1 = Sensor(  # 178 x 8.4 mm, h 0.6 mm, eps 6.33, E 1 MPa
    0.178, 0.0084, (3e-4, 3e-4), (0.07, 0.2), EPS0_F_PER_M * 6.33 * 0.0084 / 6e-4, compression.unconfined(1e6)
)


@cache
def identified(sensor: Sensor, **more) -> Identifiability:
    return identify(sensor, TONES_HZ, **more)


def sigmas(*args, **changes) -> tuple[float, float]:
    """Standard errors of force [N] and position [mm]."""
    found = setup(*args, **changes).bounds()
    return float(found.force_n), 1e3 * float(found.position_m)


# ---- published numbers ----


# Rows that an independent program computed for the thesis's first research question. The plates are the same numbers by
# the same law, so to rounding; for the cells it used a prototype's coarser curve of C over stress, and ours was solved
# anew: the bounds are proportional to 1/slope, and differ by 5 to 12 %.
@pytest.mark.parametrize(
    ("sensor", "tones", "force_n", "position_mm", "rel"),
    [
        (PLATE, TONES_HZ, 2.2, 225, 0.025),
        (BONDED, TEN_TIMES, 235, 3500, 0.025),
        (TRI, TONES_HZ, 0.17, 8.8, 0.15),
        (of_resistivity(TRI, 5.0), TEN_TIMES, 0.44, 1.2, 0.15),
    ],
)
def test_bounds_of_the_microstructure_table(sensor, tones, force_n, position_mm, rel):
    assert sigmas(sensor, tones) == pytest.approx((force_n, position_mm), rel=rel)


@pytest.mark.parametrize(
    ("sensor", "along", "force_n", "position_m"),
    [
        (PLATE, ALONG, 2.25, (0.12, 2.2)),
        (TABLE_C1, ALONG * 1.78 + np.linspace(-0.004, 0.004, 181), 0.5, (0.012, 0.42)),
    ],
)
def test_bounds_along_the_sensors_of_tables_3_1_and_c1(sensor, along, force_n, position_m):
    found = surface(setup(sensor), np.array([6.0]), along)
    assert found.force_n == pytest.approx(force_n, rel=0.04)
    assert (found.position_m.min(), found.position_m.max()) == pytest.approx(position_m, rel=0.04)


# ---- the bound against independent computations ----


def exactly(force_n: float, position_m: float) -> np.ndarray:
    """Z at each tone of the pressed plate, both electrodes of 0.83 ohm m, by transfer matrices in mpmath."""
    given = LINE_PLATE | dict.fromkeys(("top_resistivity_ohm_m", "bottom_resistivity_ohm_m"), 0.83)
    given |= {"force_n": force_n, "left_m": position_m - 5e-3}
    return np.array([complex(exact(30, **given | {"frequency_hz": tone})) for tone in TONES_HZ])


@pytest.mark.parametrize(("force", "place"), [(6.0, 0.05), (1.0, 0.02)])
def test_bounds_are_the_inverted_fisher_matrix_by_differences(force, place):
    sensor, noise = of_resistivity(PLATE, 0.83), 2e-3

    def parts(f, x):
        z = exactly(f, x)
        return np.concatenate([z.real, z.imag])

    size = np.abs(exactly(force, place))
    weight = 1 / (noise * np.concatenate([size, size]))
    by_force = (parts(force + 0.05, place) - parts(force - 0.05, place)) / 0.1 * weight
    by_place = (parts(force, place + 1e-4) - parts(force, place - 1e-4)) / 2e-4 * weight
    jacobian = np.column_stack([by_force, by_place])
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    found = setup(sensor, noise=noise, force=force, place=place).bounds()
    assert float(found.force_n) == pytest.approx(math.sqrt(covariance[0, 0]), rel=1e-4)
    assert float(found.position_m) == pytest.approx(math.sqrt(covariance[1, 1]), rel=1e-4)
    expected = covariance[0, 1] / math.sqrt(covariance[0, 0] * covariance[1, 1])
    assert float(found.correlation) == pytest.approx(expected, abs=1e-4)


def test_bounds_are_met_by_fits_to_noisy_readings():
    """200 least-squares fits: their scatter is that of the bound, known to 1/sqrt(400), and so is the correlation."""
    sensor, noise, random = of_resistivity(TRI, 0.83), 1e-3, np.random.default_rng(7)
    tones, truth, scale = np.array(TONES_HZ), np.array([4.0, 0.04]), np.array([1.0, 0.01])
    clean = sensor.impedance(tones, *truth)
    size, fits = noise * np.abs(clean), []
    for _ in range(200):
        read = clean + size * (random.standard_normal(7) + 1j * random.standard_normal(7))

        def misfit(p, read=read):
            d = (sensor.impedance(tones, *(p * scale)) - read) / size
            return np.concatenate([d.real, d.imag])

        fits.append(least_squares(misfit, truth / scale, method="lm", xtol=1e-10).x * scale)
    found = setup(sensor, noise=noise, force=4.0, place=0.04).bounds()
    scatter = np.std(fits, axis=0)
    assert scatter[0] == pytest.approx(float(found.force_n), rel=0.1)
    assert scatter[1] == pytest.approx(float(found.position_m), rel=0.1)
    assert np.corrcoef(np.transpose(fits))[0, 1] == pytest.approx(float(found.correlation), abs=0.13)


def test_shares_are_what_a_tone_adds():
    """Information 1/sigma^2 of the whole times a share is what is lost, to first order, when a tone gets noisier."""
    found = slopes(TRI, TONES_HZ, 6.0, 0.05)
    of_force, of_position = shares(found)
    assert of_force.sum() == pytest.approx(1)
    assert of_position.sum() == pytest.approx(1)
    whole, less = bounds(found, 1e-3), 1e-6
    for k in range(len(TONES_HZ)):
        fainter = np.ones(len(TONES_HZ))
        fainter[k] = math.sqrt(1 - less)  # that tone with the information 1 - less
        dimmed = bounds(Slopes(*(slope * fainter for slope in found)), 1e-3)
        for share, name in ((of_force, "force_n"), (of_position, "position_m")):
            kept = (getattr(whole, name) / getattr(dimmed, name)) ** 2
            assert (1 - kept) / less == pytest.approx(share[k], rel=1e-3, abs=1e-4)


# ---- where there is no bound ----


def test_without_a_force_position_is_undefined_and_force_is_not():
    found = identified(PLATE, force_n=0.0)
    assert found.sigma_position_m is None
    assert found.correlation is None
    assert found.sigma_force_n == pytest.approx(2.25, rel=0.02)
    assert "without a force" in found.reason
    assert "without a force there is no press to locate" in found.verdict
    plain(found)


def test_electrodes_without_resistance_tell_force_alone():
    """The sensor is a capacitor: C of the patch over C of all, so sigma = n C (1-s)^2 / (C_p ds/dF) / sqrt(7)."""
    found = identified(CAPACITOR)
    assert (found.corner_frequency_hz, found.sigma_position_m) == (None, None)
    assert "does not depend on position" in found.reason
    strain, per_newton = 0.01, 0.01 / 6
    relative = 0.1 * per_newton / (1 - strain) ** 2 / (0.9 + 0.1 / (1 - strain))
    assert found.sigma_force_n == pytest.approx(1e-3 / relative / math.sqrt(7), rel=1e-9)
    assert found.map.of_position.median is None
    assert [row.share_of_position_information for row in found.frequencies] == [None] * 7
    assert found.best_frequencies[0].frequency_hz == ()
    assert found.advised_frequencies.pair.frequency_hz == ()
    assert found.changes[0].kind == "electrodes"
    plain(found)


def test_a_press_that_closes_the_film_is_left_out_of_the_map():
    """Where the tip overhangs an end, half of it bears the force: 0.55 MPa in the middle, 1.1 MPa at the ends."""
    sensor = replace(TABLE_C1, width_m=0.01)
    force, place = np.array([55.0]), np.array([0.0, 0.089, 0.178])
    assert bearable(sensor, force[:, None], place).tolist() == [[False, True, False]]
    found = identified(sensor, force_n=55.0)
    assert found.map.sigma_force_n[-1][0] is None
    assert found.map.sigma_force_n[-1][10] > 0
    assert found.map.sigma_force_n[1][0] > 0
    plain(found)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"frequency_hz": []}, "at least one frequency"),
        ({"frequency_hz": [0.0]}, "Z is infinite"),
        ({"noise": 0.0}, "noise is 0; expected a number above 0"),
        ({"position_m": 0.2}, "position 200 mm is outside"),
        ({"force_n": 700.0}, "its electrodes touch"),
        ({"sensor": replace(CAPACITOR, far_end="short")}, "Z is 0"),
    ],
)
def test_what_it_refuses(changes, words):
    with pytest.raises(SensorgenError, match=words):
        identify(**({"sensor": PLATE, "frequency_hz": TONES_HZ} | changes))


# ---- what the card holds ----


def test_slopes_per_tone_are_those_of_the_sensor():
    found, sensor = identified(TRI, force_n=3.0, position_m=0.03), TRI
    for row in found.frequencies:
        z, by_force, by_place = sensor.response(row.frequency_hz, 3.0, 0.03)
        assert row.magnitude_ohm == pytest.approx(abs(z))
        for name, value in (("by_force_ohm_per_n", by_force), ("by_position_ohm_per_m", by_place)):
            assert complex(getattr(row, name).re, getattr(row, name).im) == pytest.approx(complex(value))
        log_slope = (np.log(sensor.impedance(row.frequency_hz, 3.001, 0.03)) - np.log(z)) / 1e-3
        assert row.relative_by_force_per_n.re == pytest.approx(log_slope.real, rel=1e-3)
        moved = np.log(sensor.impedance(row.frequency_hz, 3.0, 0.03 + 1e-5)) - np.log(z)
        assert row.relative_by_position_per_m.im == pytest.approx(moved.imag / 1e-5, rel=1e-3)


def test_the_map_holds_the_bounds():
    sensor = TRI
    found = identified(sensor).map
    assert found.force_n == pytest.approx([0, 1, 2, 3, 4, 5, 6])
    assert found.position_m == pytest.approx(np.arange(21) * 0.005)
    assert found.sigma_position_m[0] == (None,) * 21
    for row, column in ((1, 4), (3, 15), (6, 10)):
        force_n, place = found.force_n[row], found.position_m[column]
        expected = sigmas(sensor, force=force_n, place=place)
        assert found.sigma_force_n[row][column] == pytest.approx(expected[0], rel=1e-9)
        assert 1e3 * found.sigma_position_m[row][column] == pytest.approx(expected[1], rel=1e-9)
    for name, of, serves in (("sigma_force_n", "of_force", 0.6), ("sigma_position_m", "of_position", 0.01)):
        rows, of = getattr(found, name), getattr(found, of)
        pressed = np.array(rows[1:], float)
        assert of.median == pytest.approx(np.median(pressed))
        assert of.worst == pytest.approx(pressed.max())
        row, column = found.force_n.index(of.worst_force_n), found.position_m.index(of.worst_position_m)
        assert rows[row][column] == of.worst
        assert of.share_known == pytest.approx((pressed <= serves).mean())
        assert of.from_force_n == 1.0


def test_light_presses_do_not_count_as_unlocated():
    """Of a map up to 12 N in steps of 2 N all count; up to 3 N those of 0.5 N do not."""
    assert identified(TRI, force_n=12.0).map.of_force.from_force_n == 2.0
    found = identified(TRI, force_n=3.0).map
    assert found.of_force.from_force_n == 1.0
    counted = np.array(found.sigma_position_m[2:], float)
    assert found.of_position.share_known == pytest.approx((counted <= 0.01).mean())
    assert identified(TRI, force_n=0.5).map.of_force.from_force_n == 0.5


def test_best_tones_are_the_best_of_all_combinations():
    sensor, need = TRI, required(setup(TRI))
    found = identified(sensor).best_frequencies
    assert [len(best.frequency_hz) for best in found] == [1, 2, 3]
    pairs = {(a, b): setup(sensor, (a, b)).bounds() for a in TONES_HZ for b in TONES_HZ if a < b}
    best = min(pairs, key=lambda pair: float(need.shortfall(pairs[pair])))
    assert tuple(found[1].frequency_hz) == best
    assert found[1].sigma_force_n == pytest.approx(float(pairs[best].force_n), rel=1e-9)
    assert found[1].sigma_position_m == pytest.approx(float(pairs[best].position_m), rel=1e-9)
    assert found[0].frequency_hz == (99.7e3,)


def test_advised_tones_are_at_least_as_good_as_any_given_ones():
    sensor, need = PLATE, required(setup())
    found = identified(sensor).advised_frequencies
    assert found.highest_hz == pytest.approx(1e6)
    assert found.lowest_hz == pytest.approx(2560.56, rel=1e-4)

    def short(tones):
        return float(need.shortfall(setup(sensor, tones).bounds()))

    assert short(found.single.frequency_hz) < min(short([f]) for f in TONES_HZ)
    assert short(found.pair.frequency_hz) < min(short([a, b]) for a in TONES_HZ for b in TONES_HZ)
    around = [short([f]) for f in np.geomspace(1e4, 1e6, 200)]
    assert short(found.single.frequency_hz) == pytest.approx(min(around), rel=0.03)


def test_many_tones_are_searched_evenly(monkeypatch):
    monkeypatch.setattr(fisher, "SEARCHED", 24)
    tones = np.geomspace(1e3, 1e6, 60)
    best = identify(TRI, tones).best_frequencies
    assert [len(row.frequency_hz) for row in best] == [1, 2, 3]
    need = required(setup(TRI))
    exact = min(float(need.shortfall(setup(TRI, [f]).bounds())) for f in tones)
    assert max(best[0].sigma_force_n / 0.6, best[0].sigma_position_m / 0.01) == pytest.approx(exact, rel=0.05)


def test_tones_spread_about_the_corner():
    found = spread(setup(of_resistivity(TRI, 0.83)))
    assert (found[0], found[-1]) == pytest.approx((3590.0, 359.0e3), rel=5e-3)
    assert len(found) == 7
    assert np.diff(np.log(found)) == pytest.approx(math.log(100) / 6)
    assert spread(setup(of_resistivity(TRI, 0.83), [1e3])) == pytest.approx((35.9e3,), rel=5e-3)
    assert spread(setup())[-1] == pytest.approx(1e6)


def plain(found: Identifiability):
    """As JSON and back."""
    kind = TypeAdapter(Identifiability)
    text = json.dumps(kind.dump_python(found, mode="json"), allow_nan=False)
    assert kind.validate_json(text) == found


# ---- verdicts ----

NEED = Required(0.6, 0.01, 6 / math.sqrt(12), 0.1 / math.sqrt(12))


def limit(force: float, place: float):
    return setup().bounds()._replace(force_n=np.array(force), position_m=np.array(place))


@pytest.mark.parametrize(
    ("force", "place", "grades"),
    [
        (0.6, 0.01, ("yes", "yes")), (0.601, 0.0101, ("roughly", "roughly")), (1.73, 0.0288, ("roughly", "roughly")),
        (1.733, 0.0289, ("no", "no")), (math.nan, math.nan, ("no", "no")),
    ],
)  # fmt: skip
def test_thresholds(force, place, grades):
    """A tenth of 6 N, a tip of 10 mm; the spread of a guess is 1.732 N between 0 and 6 N, 28.87 mm on 100 mm."""
    assert required(setup()).grades(limit(force, place)) == grades


def test_a_tip_nearly_as_long_as_the_sensor_needs_more_than_a_guess():
    need = required(setup(replace(PLATE, tip_m=0.09)))
    assert [need.grades(limit(0.6, place))[1] for place in (0.05, 0.02)] == ["no", "yes"]


def test_shortfall_is_the_worse_of_both():
    assert float(NEED.shortfall(limit(1.2, 0.01))) == pytest.approx(2.0)
    assert float(NEED.shortfall(limit(0.6, 0.05))) == pytest.approx(5.0)
    assert float(NEED.shortfall(limit(0.6, math.nan))) == math.inf


def test_the_verdict_on_the_plate_and_on_the_cell():
    found = identified(PLATE, stiffest=BONDED)
    assert (found.senses_force, found.locates) == ("no", "no")
    assert found.verdict == (
        "at 0.1 % noise this design cannot sense force and cannot locate a press: at 6 N and 50 mm force is known to "
        "2.2 N, position to 225 mm; the sensor is 100 mm long"
    )
    assert "what it cannot do is certain" in found.stiffest.verdict
    assert "213 N, 21 m" in found.stiffest.verdict
    assert found.stiffest.sigma_force_n == pytest.approx(214, rel=0.01)
    cell = identified(TRI)
    assert "this design senses force and locates a press" in cell.verdict
    assert cell.stiffest is None


def test_verdicts_in_between_and_of_the_softest_case():
    said = verdict(setup(), limit(0.9, 0.02), NEED, "")
    assert "senses force only roughly and locates a press only roughly" in said
    said = bracket(limit(0.2, 0.005), limit(20.0, 0.5), NEED)
    assert "certain" not in said
    assert "the stiffest, it cannot sense force and cannot locate a press (20 N, 500 mm)" in said


def test_numbers_are_said_to_two_digits():
    assert [metres(v) for v in (0.0999, 0.9996, 0.00001, 12.3)] == ["100 mm", "1 m", "0.01 mm", "12 m"]
    assert [newtons(v) for v in (0.001234, 9.96, 1234.0)] == ["0.0012 N", "10 N", "more than 1 kN"]


def test_the_table_of_the_documents():
    """docs/identifiability.md, row by row."""
    page = (Path(__file__).parents[1] / "docs" / "identifiability.md").read_text("utf-8")
    cells = {"plate, free (B.49)": PLATE, "plate, bonded": BONDED, "triangles": TRI}
    rows = [[c.strip() for c in line.strip("|").split("|")] for line in page.splitlines()]
    rows = [row for row in rows if row[0] in cells]
    assert len(rows) == 5
    for name, rho, *numbers in rows:
        sensor = of_resistivity(cells[name], float(rho))
        found = (*sigmas(sensor), *sigmas(sensor, TEN_TIMES))
        assert [float(n) for n in numbers] == pytest.approx(found, rel=5e-3)


OLD = json.loads((Path(__file__).parent / "reference" / "identifiability_schema_1.json").read_text("utf-8"))


@pytest.mark.parametrize(("name", "rho"), [("plate", (0.07, 0.2)), ("capacitor", (0.0, 0.0))])
def test_predictions_of_version_0_1_0_still_read(name, rho):
    """Numbers that another version stored, and what this one finds."""
    sensor = replace(PLATE, resistivity_ohm_m=rho)
    old, new = of_schema_1(OLD[name]), identified(sensor, stiffest=None if name == "capacitor" else BONDED)
    numbers = ("sigma_force_n", "sigma_position_m", "correlation", "corner_frequency_hz")
    for key in numbers:
        one, other = getattr(old, key), getattr(new, key)
        assert one == other or one == pytest.approx(other, rel=1e-9)
    assert (old.senses_force, old.locates) == (new.senses_force, new.locates)
    assert vars(old.press) == pytest.approx(vars(new.press))
    assert old.map.of_force.worst == pytest.approx(new.map.of_force.worst, rel=1e-9)
    assert old.map.of_force.worst_force_n == new.map.of_force.worst_force_n
    assert [c.frequency_hz for c in old.best_frequencies] == [c.frequency_hz for c in new.best_frequencies]
    assert old.frequencies[6].share_of_force_information == pytest.approx(new.frequencies[6].share_of_force_information)
    assert of_schema_1({"verdict": None, "reason": "a short"}) is None
    plain(old)
