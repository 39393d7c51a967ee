"""The thesis's inverse: what its polynomials leave, and how far its positions are off, without any noise."""

import line_fit
import numpy as np
from line_cases import PLATE, TONES

from sensorgen.models import line


def presses(plate):
    force, x = np.meshgrid(np.linspace(0, 6, 61), np.linspace(0, plate["length_m"] - 0.01, 101), indexing="ij")
    return force.ravel(), x.ravel()


def measured(plate, tone):
    force, x = presses(plate)
    z = line.impedance(line.PressedLine(**{**plate, "frequency_hz": tone, "force_n": force, "left_m": x}))
    return force, x, *line_fit.series(tone, z)


def test_the_right_basis_finds_the_plate_far_below_its_corner():
    force, x, c, r = measured(PLATE, TONES[0])
    found = line_fit.fit(force, x, c, r).presses(c, r)
    pressed = force > 0.5
    assert np.sqrt(np.mean((found.choice(0.1) - x)[pressed] ** 2)) < 4e-4
    assert not np.isnan(found.position_m[pressed]).all(1).any()
    assert abs(found.force_n - force).max() < 0.03
