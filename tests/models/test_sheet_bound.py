"""Bounds of force and place: against the line's, against a plain inverse, and by symmetry."""

import numpy as np
import pytest
from line_cases import PLATE, TONES

from sensorgen.errors import OutOfRange, UnknownName
from sensorgen.models import line
from sensorgen.models.sheet import Patch, Sheet, contact_sets, localise, solve
from sensorgen.units import EPS0_F_PER_M

C = EPS0_F_PER_M * PLATE["eps_r"] / PLATE["d_m"]
FILM = Sheet(0.1, 0.1, (450.0, 450.0), C)
SETS = contact_sets(FILM)
TIP = Patch(0.0, 0.0, 0.02, 0.02, 1 / 0.95)
PER_NEWTON = {"capacitance_factor": 0.05 / 6 / 0.95**2}


def found(name, tones=TONES, places=5, noise=1e-3, film=FILM):
    return localise(film, contact_sets(film)[name], tones, TIP, PER_NEWTON, noise, places)


def test_on_a_strip_pressed_across_it_is_the_bound_of_the_line():
    strip = Sheet(0.1, 0.01, (0.07 / 3e-4, 0.2 / 3e-4), C)
    strain, tones = 0.05, np.array(TONES) * 10
    force = strain * 1e-4 * PLATE["E_Pa"]
    tip = Patch(0.0, 0.0, 0.01, 0.01, 1 / (1 - strain))
    got = localise(
        strip,
        contact_sets(strip)["one-edge"],
        tones,
        tip,
        {"capacitance_factor": strain / force / (1 - strain) ** 2},
        1e-3,
        5,
    )
    at = got.x_m - 0.005
    inputs = PLATE | {"F_N": force, "f_Hz": tones, "x_p_left_edge_m": at[:, None]}
    z, by = line.sensitivities(of=["F_N", "x_p_left_edge_m"], **inputs)
    g = np.stack([by["F_N"], by["x_p_left_edge_m"]], axis=-1) / z[..., None]
    rows = np.concatenate([g.real, g.imag], axis=1) / 1e-3
    covariance = np.linalg.inv(np.einsum("pka,pkb->pab", rows, rows))
    sigma = got.sigma()[:, 2]
    assert sigma[:, 0] == pytest.approx(np.sqrt(covariance[:, 0, 0]), rel=0.03)
    assert sigma[:, 1] == pytest.approx(np.sqrt(covariance[:, 1, 1]), rel=0.03)
    assert np.isinf(sigma[:, 2]).all()


def test_one_reading_does_not_locate_and_several_do_better():
    """Thesis's tones, 5 % strain, 0.1 % noise: metres from one pair, a tenth of a metre from four corners."""
    medians = {name: np.median(found(name).sigma()[..., 1:], axis=(0, 1)) for name in SETS}
    assert (medians["one-edge"] > 1.0).all()
    assert np.isfinite(found("one-edge").sigma()[0, 0]).all()  # open only on the axis of symmetry, elsewhere just wide
    assert (medians["corner"] > 1.0).all()
    assert medians["opposite"][1] > 1.0
    assert 0.04 < medians["corners"].max() < 0.18
    assert 0.07 < medians["two-edges"].max() < 0.4


@pytest.mark.parametrize("name", ["two-edges", "corners"])
def test_resistive_sheets_and_higher_tones_do_better(name):
    base = np.median(found(name).sigma()[..., 1])
    resistive = Sheet(0.1, 0.1, (2800.0, 2800.0), C)
    assert np.median(found(name, film=resistive).sigma()[..., 1]) < base / 2
    assert np.median(found(name, tones=np.array(TONES) * 10).sigma()[..., 1]) < base / 2


@pytest.mark.parametrize("name", ["two-edges", "corners", "corner"])
def test_a_square_with_equal_sheets_does_not_tell_x_from_y(name):
    sigma = found(name, places=3).sigma()
    np.testing.assert_allclose(sigma[..., 1], sigma[..., 2].T, rtol=1e-4)


def test_noise_scales_the_error():
    one, two = (found("corners", places=2, noise=noise).sigma() for noise in (1e-3, 5e-3))
    np.testing.assert_allclose(two, 5 * one, rtol=1e-6)


def test_information_is_that_of_each_tone_and_its_inverse_the_covariance():
    got = found("corners", places=3)
    place = Patch(0.04, 0.0, 0.02, 0.02, 1 / 0.95)
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


def test_with_the_outline_known_no_place_is_worse_than_a_guess():
    for name in SETS:
        got = found(name, places=3)
        sigma = got.sigma(outline=True)
        assert (sigma[..., 1:] <= 0.1 / 12**0.5 * (1 + 1e-9)).all()
        assert (sigma <= got.sigma() * (1 + 1e-9)).all()


def test_the_best_tone_is_the_highest_where_all_are_low():
    assert found("corners", places=3).best_tones()[0] == len(TONES) - 1


def test_the_verdict_follows_the_share():
    assert found("one-edge", places=3).verdict().startswith("locates a press nowhere")
    clear = found("corners", tones=np.array(TONES) * 10, noise=1e-6)
    assert 0.3 < clear.located() <= 1
    assert f"{clear.located():.0%}" in clear.verdict() or "everywhere" in clear.verdict()


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
        localise(FILM, SETS["corner"], 1e5, Patch(0, 0, 0.2, 0.02, 1.1), PER_NEWTON)
