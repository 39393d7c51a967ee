"""Profiles of pressure against their own integrals, and the pieces that they are cut into."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import integrate, optimize, special

from sensorgen.core.errors import OutOfRange, UnknownName
from sensorgen.models.pressure import BLUNT_M, PROFILES, bed, hertz, pieces, pressure_slope, profile

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


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize(("begin", "end", "count"), [(0.0, 1.0, 1), (0.2, 0.9, 24)])
def test_a_piece_has_the_mean_pressure_of_its_place(name, begin, end, count):
    found = pieces(name, count, (np.asarray(begin), np.asarray(end)))
    assert found.length.sum() == pytest.approx(1.0, rel=1e-14)
    assert (found.length * found.pressure).sum() == pytest.approx(1.0, rel=1e-13)
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
    found = pressure_slope(name, 6, ends, slopes)
    assert found == pytest.approx((ahead - behind) / (2 * step), rel=1e-6, abs=1e-8)


def test_what_is_no_profile():
    with pytest.raises(UnknownName, match="profile of pressure 'herz'; did you mean 'hertz'"):
        pieces("herz", 3)
    with pytest.raises(OutOfRange, match="0 pieces of a tip"):
        pieces("hertz", 0)


RADIUS, LOAD, LONG = 0.02, 300.0, 1.0  # [m], [N/m], [m]


def test_hertz_bends_the_surface_like_the_tip():
    """The half space's slope under the pressure, an integral by Cauchy, is that of the cylinder, x / R."""
    modulus = 8e6
    length, _ = hertz(RADIUS, modulus).length_m(np.asarray(LOAD), LONG)
    half = float(length) / 2

    def pressure(x):
        return LOAD / (2 * half) * float(profile("hertz").density(np.asarray((x / half + 1) / 2)))

    assert integrate.quad(pressure, -half, half)[0] == pytest.approx(LOAD, rel=1e-8)
    for x in (0.1 * half, 0.5 * half, 0.8 * half):
        slope = -2 / (np.pi * modulus) * integrate.quad(pressure, -half, half, weight="cauchy", wvar=x)[0]
        assert slope == pytest.approx(x / RADIUS, rel=1e-6)


def test_a_bed_gives_way_as_deep_as_the_tip_reaches():
    """Each spring by its own depth under the cylinder: the depth that bears the load, sought, gives the length."""
    stiffness = 1e10
    length, _ = bed(RADIUS, stiffness).length_m(np.asarray(LOAD), LONG)

    def carried(depth):
        half = np.sqrt(2 * RADIUS * depth)
        return integrate.quad(lambda x: stiffness * (depth - x * x / (2 * RADIUS)), -half, half)[0]

    depth = optimize.brentq(lambda d: carried(d) - LOAD, 1e-9, 1e-3, xtol=1e-15)
    assert float(length) == pytest.approx(2 * np.sqrt(2 * RADIUS * depth), rel=1e-9)
    peak = LOAD / float(length) * float(profile("parabola").density(np.asarray(0.5)))
    assert peak == pytest.approx(stiffness * depth, rel=1e-9)


@pytest.mark.parametrize(("contact", "factor"), [(hertz(RADIUS, 8e6), 4.0), (bed(RADIUS, 1e10), 8.0)])
def test_a_contact_grows_by_its_power_up_to_the_tip(contact, factor):
    (once, twice), slope = contact.length_m(np.array([LOAD, factor * LOAD]), LONG)
    assert twice == pytest.approx(2 * once, rel=1e-12)
    step = 1e-3
    ahead, behind = (contact.length_m(np.asarray(LOAD + h), LONG)[0] for h in (step, -step))
    assert slope[0] == pytest.approx((ahead - behind) / (2 * step), rel=1e-6)
    whole, still = contact.length_m(np.array([LOAD, 0.0]), once / 2)
    assert whole.tolist() == [once / 2, BLUNT_M]
    assert not still.any()


@pytest.mark.parametrize("made", [hertz, bed])
def test_what_is_no_round_tip(made):
    for given in ((0.0, 1e6), (0.01, float("nan"))):
        with pytest.raises(OutOfRange, match="above 0"):
            made(*given)
