"""Profiles of pressure against their own integrals, and the pieces that they are cut into."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import integrate, special

from sensorgen.errors import OutOfRange, UnknownName
from sensorgen.models.pressure import PROFILES, pieces, profile

POWER = {"uniform": 0.0, "hertz": 0.5, "parabola": 1.0}  # of u (1 - u)
PLACES = np.linspace(0, 1, 41)


@pytest.mark.parametrize("name", PROFILES)
def test_shares_are_the_incomplete_beta_function(name):
    """Pressure as u (1 - u) to a power has its integral there."""
    power = POWER[name] + 1
    assert profile(name).share(PLACES) == pytest.approx(special.betainc(power, power, PLACES), abs=1e-14)
    assert profile(name).density(PLACES) == pytest.approx(
        (PLACES * (1 - PLACES)) ** POWER[name] / special.beta(power, power), abs=1e-14
    )


def test_known_peaks():
    """Hertz: 4 / pi times the mean; a parabola: 3 / 2."""
    assert float(profile("hertz").density(np.asarray(0.5))) == pytest.approx(4 / np.pi)
    assert float(profile("parabola").density(np.asarray(0.5))) == pytest.approx(1.5)


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize("ends", [(0.0, 1.0), (0.3, 1.0), (0.0, 0.5), (0.2, 0.9)])
@pytest.mark.parametrize("count", [1, 2, 7, 64])
def test_pieces_carry_the_whole_force(name, ends, count):
    found = pieces(name, count, tuple(map(np.asarray, ends)))
    assert found.length.sum() == pytest.approx(1.0, rel=1e-14)
    assert (found.length * found.pressure).sum() == pytest.approx(1.0, rel=1e-13)


@pytest.mark.parametrize("name", PROFILES)
def test_a_piece_has_the_mean_pressure_of_its_place(name):
    begin, end = 0.3, 1.0
    found = pieces(name, 5, (np.asarray(begin), np.asarray(end)))
    density = lambda u: float(profile(name).density(np.asarray(u)))  # noqa: E731
    whole = integrate.quad(density, begin, end)[0]
    edges = begin + (end - begin) * np.concatenate([[0], np.cumsum(found.length)])
    edges[-1] = end
    means = [integrate.quad(density, a, b)[0] / (b - a) * (end - begin) / whole for a, b in pairwise(edges)]
    assert found.pressure == pytest.approx(means, rel=1e-8)


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize(
    ("ends", "slopes"), [((0.3, 1.0), (-2.0, 0.0)), ((0.0, 0.6), (0.0, 3.0)), ((0.2, 0.8), (1.0, -1.5))]
)
def test_slopes_along_with_the_ends(name, ends, slopes):
    """Against differences, their own error some 1e-9."""
    ends, slopes = (tuple(map(np.asarray, pair)) for pair in (ends, slopes))
    step = 1e-5
    ahead, behind = (
        pieces(name, 6, tuple(e + s * h for e, s in zip(ends, slopes, strict=True))).pressure for h in (step, -step)
    )
    found = pieces(name, 6, ends, slopes).pressure_slope
    assert found == pytest.approx((ahead - behind) / (2 * step), rel=1e-6, abs=1e-8)


def test_uniform_pressure_is_uniform_however_it_is_cut():
    assert pieces("uniform", 9, (np.asarray(0.2), np.asarray(0.7))).pressure == pytest.approx(np.ones(9), rel=1e-13)


def test_what_is_no_profile():
    with pytest.raises(UnknownName, match="profile of pressure 'herz'; did you mean 'hertz'"):
        pieces("herz", 3)
    with pytest.raises(OutOfRange, match="0 pieces of a tip"):
        pieces("hertz", 0)
