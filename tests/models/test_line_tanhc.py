"""tanh(z)/z and its slopes against mpmath, on both sides of every border between their formulas, in both parts."""

import mpmath
import numpy as np
import pytest

from sensorgen.solvers.line import tanhc as _tanhc
from sensorgen.solvers.line.tanhc import sech_squared, tanhc, tanhc_slope

BORDERS = [fraction.reach for fraction in _tanhc._FRACTIONS]
SIZES = [
    0.0, 1e-300, 1e-30, 1e-8, *(b * side for b in BORDERS for side in (0.5, 1 - 1e-9, 1 + 1e-9)), 1e2, 1e4, 1e8, 1e60,
]  # fmt: skip
SHARES = [0.0, 1e-9, 0.3, 0.5, 1 - 1e-6, 1.0]  # of the imaginary part: a leak alone, both, a capacitor alone


def exact(w: complex) -> tuple[mpmath.mpc, mpmath.mpc, mpmath.mpc]:
    if w == 0:
        return mpmath.mpc(1), -mpmath.mpf(1) / 3, mpmath.mpc(1)
    z = mpmath.sqrt(mpmath.mpmathify(w))
    ratio, falling = mpmath.tanh(z) / z, 1 / mpmath.cosh(z) ** 2
    return ratio, (falling - ratio) / (2 * z * z), falling


@pytest.mark.parametrize("size", SIZES)
def test_right_everywhere(size):
    """Of the ratio each part by itself, too: from the smaller one comes Re Z."""
    for share in SHARES:
        w = np.array([complex(size * (1 - share), size * share)])
        ratio = tanhc(w)
        found = (ratio, tanhc_slope(w, ratio), sech_squared(w, ratio))
        with mpmath.workdps(700 if size < 1e-8 else 60):
            known = exact(complex(w[0]))
            for got, true in zip(found, known, strict=True):
                # an exponential far out is known as well as its argument; below 1e-290 it is nothing
                room = 4e-14 + 4e-16 * size**0.5 if got is found[2] else 4e-14
                assert abs(complex(got[0]) - true) <= room * abs(true) + 1e-290, share
            got, true = complex(ratio[0]), known[0]
            assert abs(got.real - true.real) <= 2e-15 * abs(true.real), share
            assert abs(got.imag - true.imag) <= 4e-15 * abs(true.imag) + 1e-300, share


def test_no_number_stays_no_number():
    with np.errstate(all="ignore"):
        assert np.isnan(tanhc(np.array([complex(np.nan, 0), 1.0]))[0])
        assert np.isnan(tanhc(np.array([complex(np.nan, 0), 100.0]))[0])
