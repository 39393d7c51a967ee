"""The uniform line against 25 digits, its limits and coth. Re Z carries the position: it is tested by itself."""

import json
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sensorgen.errors import OutOfRange
from sensorgen.models.uniform_line import corner_frequency_hz, impedance

CASES = json.loads((Path(__file__).parents[1] / "reference" / "line.json").read_text("utf-8"))["cases"]
R, C = 9000.0, 69.06266493984e-12  # Table 3.1's plate with Table C.1's resistivities


def resistance(case) -> float:
    tracks = case["rho_top_ohm_m"] / case["H_top_m"] + case["rho_bottom_ohm_m"] / case["H_bottom_m"]
    return tracks / case["W_m"] * case["L_m"]


def capacitance(case) -> float:
    return case["eps0_F_per_m"] * case["eps_r"] * case["W_m"] / case["d_m"] * case["L_m"]


@pytest.mark.parametrize("case", CASES, ids=lambda c: c["id"])
def test_the_reference_to_25_digits(case):
    z = complex(impedance(case["f_Hz"], resistance(case), capacitance(case)))
    re, im = (Decimal(case[k]) for k in ("Z_re_ohm", "Z_im_ohm"))
    off_re, off_im = Decimal(z.real) - re, Decimal(z.imag) - im
    assert (off_re**2 + off_im**2).sqrt() < Decimal("1e-13") * (re**2 + im**2).sqrt()
    assert abs(off_re) < Decimal("1e-11") * re


def exact(f: float, r: float, c: float) -> Any:
    """Zc coth(gamma L) with enough digits for 1 nHz; mpmath comes along with build123d."""
    mpmath = pytest.importorskip("mpmath")
    with mpmath.workdps(60):
        y = 2j * mpmath.pi * mpmath.mpf(f) * mpmath.mpf(c)
        z = mpmath.sqrt(y * mpmath.mpf(r))
        return mpmath.sqrt(mpmath.mpf(r) / y) * mpmath.coth(z)


@pytest.mark.parametrize("f", [1e-9, 1e-3, 1.0, 1.1e3, 99.7e3, 255e3, 256.06e3, 3e5, 2.56e6, 1e9, 1e12])
@pytest.mark.parametrize(("r", "c"), [(R, C), (55.6e3, C), (1e-3, 1e-6), (1e9, 1e-9)])
def test_coth_over_all_frequencies(f, r, c):
    z, true = complex(impedance(f, r, c)), exact(f, r, c)
    assert abs(z.real - true.real) < 1e-11 * true.real
    assert abs(z.imag - true.imag) < 1e-11 * abs(true.imag)
    assert abs(z - true) < 1e-12 * abs(true)


def test_the_seam_between_series_and_quotient_is_smooth():
    """|z^2| = 0.01 is where one gives way to the other: both sides against 60 digits."""
    for squared in (0.01 * (1 - 1e-9), 0.01, 0.01 * (1 + 1e-9)):
        f = squared / (2 * np.pi * R * C)
        z, true = complex(impedance(f, R, C)), exact(f, R, C)
        assert abs(z.real - true.real) < 1e-12 * true.real


@pytest.mark.parametrize("f", [1e-9, 1e-6, 1.0, 100.0])
def test_at_low_frequency_it_is_a_third_of_the_resistance_before_a_capacitor(f):
    z = complex(impedance(f, R, C))
    assert z.real == pytest.approx(R / 3, rel=1e-6)
    assert z.imag == pytest.approx(-1 / (2 * np.pi * f * C), rel=1e-6)
    assert abs(z) == pytest.approx(1 / (2 * np.pi * f * C), rel=1e-4)


@pytest.mark.parametrize("f", [1e-9, 1.0, 99.7e3, 1e9])
def test_without_resistance_it_is_a_capacitor(f):
    z = complex(impedance(f, 0.0, C))
    assert z.real == 0.0
    assert z.imag == pytest.approx(-1 / (2 * np.pi * f * C), rel=1e-14)


@pytest.mark.parametrize("f", [1e9, 1e12, 1e15])
def test_a_long_line_is_its_characteristic_impedance(f):
    """Re(gamma L) from 1e3 to 1e9: cosh overflows at 710. pytest turns every warning into an error."""
    r = 1e6
    gamma = np.sqrt(np.pi * f * r * C)
    assert gamma > 400
    z = complex(impedance(f, r, C))
    characteristic = complex(np.sqrt(r / (2j * np.pi * f * C)))
    assert z.real == pytest.approx(characteristic.real, rel=1e-12)
    assert z.imag == pytest.approx(characteristic.imag, rel=1e-12)


@pytest.mark.filterwarnings("error")
def test_no_nan_and_no_warning_over_24_decades():
    z = impedance(np.logspace(-9, 15, 200)[:, None], [0.0, 1e-9, R, 1e12], C)
    assert np.isfinite(z).all()
    assert (z.real >= 0).all()
    assert (z.imag < 0).all()


def test_impedance_and_frequency_scale():
    """Z(f, kR, C/k) = k Z(f, R, C), and Z(kf, R, C/k) = Z(f, R, C)."""
    z = complex(impedance(99.7e3, R, C))
    for other in (complex(impedance(99.7e3, 8 * R, C / 8)) / 8, complex(impedance(8 * 99.7e3, R, C / 8))):
        assert other.real == pytest.approx(z.real, rel=1e-14)
        assert other.imag == pytest.approx(z.imag, rel=1e-14)


def test_arrays_broadcast():
    z = impedance([[1e3], [1e4]], R, [C, 2 * C, 3 * C])
    assert z.shape == (2, 3)
    assert z[1, 2] == impedance(1e4, R, 3 * C)


@pytest.mark.parametrize(
    ("f", "r", "c"), [(0, R, C), (-1, R, C), (1, -1, C), (1, R, 0), (np.nan, R, C), (1, np.nan, C)]
)
def test_senseless_values_are_refused(f, r, c):
    with pytest.raises(OutOfRange):
        impedance(f, r, c)


def test_the_corner_of_the_thesis():
    """Errata, 2.24: lumped corner 256 kHz; Re Z has fallen by 10 % only at 1.1 MHz."""
    assert corner_frequency_hz(R, C) == pytest.approx(256e3, rel=2e-3)
    assert complex(impedance(1.1e6, R, C)).real == pytest.approx(0.9 * R / 3, rel=0.05)
