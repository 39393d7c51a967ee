"""Bounds of force and place: against the line's, and against a plain inverse."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from line_cases import PLATE, TONES

from sensorgen.core.errors import OutOfRange, UnknownName
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import line
from sensorgen.models.sheet import impedance, localise, solve
from sensorgen.solvers.sheet.parts import Sheet, SheetPatch
from sensorgen.solvers.sheet.solve import PressErrors, contact_sets, depth_m

C = EPS0_F_PER_M * PLATE["eps_r"] / PLATE["film_m"]
FILM = Sheet(0.1, 0.1, (450.0, 450.0), C)
SETS = contact_sets(FILM)
TIP = SheetPatch(0.0, 0.0, 0.02, 0.02, 1 / 0.95)
PER_NEWTON = {"capacitance_factor": 0.05 / 6 / 0.95**2}


def found(name, tones=TONES, places=5, noise=1e-3, film=FILM):
    return localise(film, contact_sets(film)[name], tones, TIP, PER_NEWTON, noise, places)


def test_on_a_strip_pressed_across_it_is_the_bound_of_the_line():
    strip, strain, tones = Sheet(0.1, 0.01, (0.07 / 3e-4, 0.2 / 3e-4), C), 0.05, np.array(TONES) * 10
    force = strain * 1e-4 * PLATE["modulus_pa"]
    tip = SheetPatch(0.0, 0.0, 0.01, 0.01, 1 / (1 - strain))
    per_newton = {"capacitance_factor": strain / force / (1 - strain) ** 2}
    got = localise(strip, contact_sets(strip)["one-edge"], tones, tip, per_newton, 1e-3, 5)
    inputs = PLATE | {"force_n": force, "frequency_hz": tones, "left_m": got.x_m[:, None] - 0.005}
    z, by = line.sensitivities(line.PressedLine(**inputs), of=["force_n", "left_m"])
    g = np.stack([by["force_n"], by["left_m"]], axis=-1) / z[..., None]
    rows = np.concatenate([g.real, g.imag], axis=1) / 1e-3
    covariance = np.linalg.inv(np.einsum("pka,pkb->pab", rows, rows))
    sigma = got.sigma()[:, 2]
    assert sigma[:, :2] == pytest.approx(np.sqrt(np.einsum("paa->pa", covariance)), rel=0.03)
    assert np.isinf(sigma[:, 2]).all()


def test_one_reading_does_not_locate_and_several_do_better():
    """Thesis's tones, 5 % strain, 0.1 % noise: metres from one pair, a tenth of a metre from four corners."""
    sigma = {name: found(name, places=4).sigma() for name in ("one-edge", "corner", "opposite")}
    medians = {name: np.median(each[..., 1:], axis=(0, 1)) for name, each in sigma.items()}
    assert (medians["one-edge"] > 1.0).all()
    assert np.isfinite(sigma["one-edge"][0, 0]).all()  # open only on the axis of symmetry, elsewhere just wide
    assert (medians["corner"] > 1.0).all()
    assert medians["opposite"][1] > 1.0


def test_information_is_that_of_each_tone_and_its_inverse_the_covariance():
    got = found("corners", places=3)
    place = SheetPatch(0.04, 0.0, 0.02, 0.02, 1 / 0.95)
    exact = solve(FILM, SETS["corners"], TONES, place, of=["x_m", "y_m", "capacitance_factor"], cells=got.cells)
    z = np.einsum("fpp->fp", exact.impedance_ohm)
    g = [np.einsum("fpp->fp", exact.by[n]) / z for n in ("capacitance_factor", "x_m", "y_m")]
    g[0] = g[0] * PER_NEWTON["capacitance_factor"]
    rows = np.concatenate([np.stack([v.real.ravel() for v in g], 1), np.stack([v.imag.ravel() for v in g], 1)]) / 1e-3
    keep = np.linalg.svd(rows, compute_uv=False)
    assert keep[-1] > 0
    covariance = np.linalg.pinv(rows.T @ rows, rcond=1e-14)
    assert got.sigma()[1, 0] == pytest.approx(np.sqrt(np.diag(covariance)), rel=1e-5)
    known = np.linalg.inv(rows.T @ rows + np.diag([0.0, 1200.0, 1200.0]))
    assert got.sigma(outline=True)[1, 0] == pytest.approx(np.sqrt(np.diag(known)), rel=1e-5)


def test_the_best_tone_is_the_highest_where_all_are_low():
    assert found("corners", places=3).best_tones()[0] == len(TONES) - 1


def told(sigma_m):
    """Bounds of a sheet of 100 x 50 mm by standard errors of x and y at each place, independent of each other."""
    sigma = np.asarray(sigma_m, float)
    information = np.zeros((*sigma.shape[:2], 1, 3, 3))
    information[..., 0, 0, 0] = 1.0
    information[..., 0, 1, 1], information[..., 0, 2, 2] = sigma[..., 0] ** -2, sigma[..., 1] ** -2
    places = [np.linspace(0.0, 1.0, n) for n in sigma.shape[:2]]
    return PressErrors(*places, np.array([1e5]), information, (0.1 / 12**0.5, 0.05 / 12**0.5), 10)


NEAR, FAR = 0.001, 10.0


def test_a_place_is_located_where_both_coordinates_are():
    one = told([[(NEAR, NEAR), (NEAR, FAR)], [(FAR, NEAR), (FAR, FAR)]])
    assert one.located() == 0.25
    assert one.verdict().startswith("locates a press on 25% of the sheet: ")
    assert told([[(NEAR, NEAR)]]).verdict() == (
        "locates a press everywhere: typical error 3% of a uniform prior's in x, 7% in y"  # 1 mm of 28.9 and of 14.4 mm
    )
    assert told([[(NEAR, FAR)]]).verdict() == (
        "locates a press nowhere: typical error 3% of a uniform prior's in x, 100% in y"
    )


def test_located_is_half_of_a_guess_with_the_outline_known():
    """1/sigma^2 + 1/guess^2 above 4/guess^2: from sigma = guess / sqrt(3) down."""
    limit = np.array([0.1, 0.05]) / 12**0.5 / 3**0.5
    assert told([[limit * 0.999]]).located() == 1
    assert told([[limit * (1.001, 0.999)]]).located() == told([[limit * (0.999, 1.001)]]).located() == 0


ROWS = [
    [cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip("|"))]
    for line in (Path(__file__).parents[2] / "docs" / "sheet.md").read_text("utf-8").splitlines()
    if line.startswith("|")
]
SETTINGS = ((0.135, 1), (0.135, 10), (0.83, 1), (5.0, 1))  # resistivity, and times the thesis's tones


def metres(cell):
    number, unit = cell.split()
    return float(number) * {"mm": 1e-3, "m": 1.0, "km": 1e3}[unit]


@pytest.mark.nightly
@pytest.mark.parametrize("name", SETS)
def test_the_table_of_contacts(name):
    """docs/sheet.md, each row: medians over 7 x 7 places, of x and of y."""
    (row,) = (row for row in ROWS if row[0].partition(":")[0] == name)
    for cell, (rho, times) in zip(row[1:], SETTINGS, strict=True):
        film = Sheet(0.1, 0.1, (rho / 3e-4,) * 2, C)
        sigma = found(name, np.array(TONES) * times, places=7, film=film).sigma()
        assert [metres(one) for one in cell.split(",")] == pytest.approx(np.median(sigma, (0, 1))[1:], rel=4e-2)
        assert 0.5 < np.median(sigma[..., 0]) < 1.65


@pytest.mark.nightly
def test_a_small_tip():
    text = " ".join((Path(__file__).parents[2] / "docs" / "sheet.md").read_text("utf-8").split())
    said = re.search(r"four corners have ([\d.]+ m?m) at the thesis's tones and ([\d.]+ m?m) at ten times", text)
    tip = replace(TIP, length_m=0.01, width_m=0.01)
    for cell, times in zip(said.groups(), (1, 10), strict=True):
        got = localise(FILM, SETS["corners"], np.array(TONES) * times, tip, PER_NEWTON, 1e-3, 7)
        assert metres(cell) == pytest.approx(np.median(got.sigma()[..., 1]), rel=1e-2)


# One corner, 5 % more capacitance under 20 x 20 mm at (30, 30), (70, 30), (70, 70) mm; changes in thousandths: |dZ/Z|
# near, middle, far; change of |Z| near, middle, far; near - far
SEGMENTS = """
0.135 | 1 MHz | 51 mm | 1.10 | 0.482 | 0.420 | -1.09 | 0.044 | 0.302 | 1.40
5 | 1 MHz | 8.3 mm | 0.140 | 2.6e-4 | 3.8e-6 | 0.130 | 2.6e-4 | -3.0e-6 | 0.140
"""


def test_the_table_of_virtual_segments():
    for rho, tone, reach, *cells in (row.split(" | ") for row in SEGMENTS.strip().splitlines()):
        film = Sheet(0.1, 0.1, (float(rho) / 3e-4,) * 2, C)
        hertz = float(tone.split()[0]) * {"kHz": 1e3, "MHz": 1e6}[tone.split()[1]]
        assert metres(reach) == pytest.approx(depth_m(film, hertz), rel=2e-2)
        places = [SheetPatch(x, y, 0.02, 0.02, 1.05) for x, y in ((0.02, 0.02), (0.06, 0.02), (0.06, 0.06))]
        loose, *pressed = (
            complex(impedance(film, SETS["corner"], hertz, patch, cells=80)[0, 0, 0])
            for patch in (replace(places[0], capacitance_factor=1.0), *places)
        )
        moved = [z / loose - 1 for z in pressed]
        true = [*map(abs, moved), *(abs(z) / abs(loose) - 1 for z in pressed), abs(moved[0] - moved[2])]
        assert [float(cell) for cell in cells] == pytest.approx(1e3 * np.array(true), rel=2e-2)


def test_each_place_is_told_before_it_is_computed():
    done = []
    localise(FILM, SETS["corner"], 1e5, TIP, PER_NEWTON, places=2, done=done.append)
    assert done == list(range(4))


def test_what_would_take_hours_is_refused_at_once_with_the_frequency_that_does_not():
    with pytest.raises(OutOfRange, match="use frequencies up to") as said:
        localise(FILM, SETS["corner"], [1e5, 1e12], TIP, PER_NEWTON, places=1)
    most = float(str(said.value).split("up to ")[1].split()[0])
    assert depth_m(FILM, most, TIP) == pytest.approx(0.1 / 20, rel=0.05)
    assert localise(FILM, SETS["corner"], [1e5, 0.9 * most], TIP, PER_NEWTON, places=1).cells <= 160


def test_what_it_refuses():
    with pytest.raises(OutOfRange, match="noise"):
        found("corners", noise=0.0)
    with pytest.raises(OutOfRange, match="one place"):
        found("corners", places=0)
    with pytest.raises(UnknownName, match="force"):
        localise(FILM, SETS["corner"], 1e5, TIP, {"factor": 1.0})
    with pytest.raises(OutOfRange, match="infinite"):
        found("corners", tones=[0.0], places=2)
    with pytest.raises(OutOfRange, match="beyond the sheet"):
        localise(FILM, SETS["corner"], 1e5, SheetPatch(0, 0, 0.2, 0.02, 1.1), PER_NEWTON)
