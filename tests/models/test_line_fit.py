"""The thesis's inverse: what its polynomials leave, and how far its positions are off, without any noise."""

import line_fit
import numpy as np
import pytest
from line_cases import PLATE, TONES

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
