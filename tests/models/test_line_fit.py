"""The thesis's inverse: what its polynomials leave, and how far its positions are off, without any noise."""

import line_fit
import numpy as np
import pytest
from line_cases import PLATE, TONES

from sensorgen.core.errors import OutOfRange, UnknownName
from sensorgen.models import line

OLDER = {
    **PLATE, "length_m": 0.178, "width_m": 0.0084, "eps_r": 6.33, "modulus_pa": 1e6,
}  # fmt: skip
"""Table C.1."""


def presses(plate):
    force, x = np.meshgrid(np.linspace(0, 6, 61), np.linspace(0, plate["length_m"] - 0.01, 101), indexing="ij")
    return force.ravel(), x.ravel()


def measured(plate, tone):
    force, x = presses(plate)
    z = line.impedance(line.PressedLine(**{**plate, "frequency_hz": tone, "force_n": force, "left_m": x}))
    return force, x, *line_fit.series(tone, z)


def test_the_right_basis_of_r_leaves_a_seventieth():
    force, x, c, r = measured(PLATE, TONES[0])
    assert line_fit.fit(force, x, c, r).residual_ohm == pytest.approx(0.0024, abs=2e-4)
    assert line_fit.fit(force, x, c, r, "printed").residual_ohm == pytest.approx(0.16, abs=5e-3)


@pytest.mark.parametrize("tone", TONES)
@pytest.mark.parametrize("plate", [PLATE, OLDER], ids=["Table 3.1", "Table C.1"])
def test_the_printed_basis_is_off_by_centimetres_even_with_c5_corrected(plate, tone):
    force, x, c, r = measured(plate, tone)
    found = line_fit.fit(force, x, c, r, "printed").presses(c, r)
    pressed = force > 0.5
    off = (found.choice(plate["length_m"]) - x)[pressed]
    assert 0.009 < np.sqrt(np.mean(off**2)) < 0.028
    assert 0.05 < np.isnan(found.position_m).all(1)[pressed].mean() < 0.125


def test_the_right_basis_finds_the_plate_far_below_its_corner():
    force, x, c, r = measured(PLATE, TONES[0])
    found = line_fit.fit(force, x, c, r).presses(c, r)
    pressed = force > 0.5
    assert np.sqrt(np.mean((found.choice(0.1) - x)[pressed] ** 2)) < 4e-4
    assert not np.isnan(found.position_m[pressed]).all(1).any()
    assert abs(found.force_n - force).max() < 0.03


def test_c5_as_printed_gives_metres():
    force, x, c, r = measured(PLATE, TONES[0])
    found = line_fit.fit(force, x, c, r, "printed").printed_position_m(c)
    assert np.nanmedian(abs(found)) > 1.0
    with pytest.raises(OutOfRange, match="form='printed'"):
        line_fit.fit(force, x, c, r).printed_position_m(c)


def test_the_fit_is_least_squares():
    rng = np.random.default_rng(3)
    force, x = rng.uniform(0, 6, 200), rng.uniform(0, 0.09, 200)
    r = rng.normal(size=200)
    found = line_fit.fit(force, x, 7e-11 + 1e-12 * force, r)
    columns = np.stack([np.ones(200), force, force * x, force * x * x], -1)
    left = r - columns @ found.resistance
    assert abs(columns.T @ left).max() < 1e-9  # the normal equations
    assert found.residual_ohm == pytest.approx(np.sqrt(np.mean(left**2)))
    assert found.capacitance == pytest.approx([7e-11, 1e-12], rel=1e-12, abs=0)


def made(resistance, form="corrected"):
    return line_fit.LineFit(form, np.array([7e-11, 1e-12]), np.array(resistance), 0.0)


def test_both_roots_are_given():
    exact = made([100.0, 1.0, 20.0, -100.0])  # 20 x - 100 x^2: two places for each rise
    r = 100 + 2 * (1 + 20 * 0.05 - 100 * 0.05**2)
    roots = exact.presses([7.2e-11], [r]).position_m
    assert roots[0] == pytest.approx([0.05, 0.15])


@pytest.mark.parametrize("square", [0.0, 1e-300, 1e-14, -1e-14])
def test_without_a_square_the_linear_root_stays(square):
    fit = made([100.0, 1.0, 20.0, square])
    roots = fit.presses([7.2e-11], [100 + 2 * (1 + 20 * 0.05)])
    assert roots.choice(0.1) == pytest.approx([0.05], rel=1e-12)
    assert np.nanmin(abs(roots.position_m - 0.05)) < 1e-13


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_small_roots_keep_their_digits(sign):
    fit = made([100.0, 0.0, sign * 20.0, 1e-3])
    x = 1e-9
    r = 100 + 2 * (sign * 20 * x)
    near = fit.presses([7.2e-11], [r]).position_m[0]
    assert np.nanmin(abs(near - (r - 100) / (sign * 40))) < 1e-18


def test_no_real_root_is_nan_and_chooses_the_middle():
    fit = made([100.0, 1.0, 20.0, -100.0])
    roots = fit.presses([7.2e-11], [110.0])
    assert np.isnan(roots.position_m).all()
    assert roots.choice(0.1) == pytest.approx([0.05])


def test_no_force_has_no_position():
    roots = made([100.0, 1.0, 20.0, -100.0]).presses([7e-11], [100.0])
    assert roots.force_n == pytest.approx([0.0], abs=1e-9)
    assert np.isfinite(roots.choice(0.1)).all()


def test_what_is_refused():
    force, x = np.full(10, 3.0), np.linspace(0, 0.09, 10)
    with pytest.raises(OutOfRange, match="do not determine"):
        line_fit.fit(force, x, force, force)
    with pytest.raises(UnknownName, match="form of the fit"):
        line_fit.fit(force, x, force, force, "wrong")
