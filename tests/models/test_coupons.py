"""Closed forms of coupons against grids, finite volumes and finite elements."""

import numpy as np
import pytest
import virtual_lab

from sensorgen.analysis.characterise import UPPER_MM
from sensorgen.models import coupons

LINE = virtual_lab.LINE_MM


@pytest.mark.parametrize(("share", "flow"), [(0.2, 0.9), (4.0, 1.0)])
def test_bar_across_lines_against_a_grid_on_every_line(share, flow):
    grid = virtual_lab.aligned_ratio(share, flow, 90.0, 10.0)
    closed = coupons.to_and_fro_resistivity(1 / flow, 1 + share, LINE * 1e-3, 10e-3)
    assert closed == pytest.approx(grid, rel=0.02)
    assert grid < 0.995 * (1 + share)  # joints short the contacts: without them the form would be off


def test_bars_along_and_between_against_the_grid():
    assert virtual_lab.aligned_ratio(0.9, 0.95, 0.0, 10.0) == pytest.approx(1 / 0.95, rel=1e-6)
    between = coupons.bar_resistance(1 / 0.95, 1.9, 45.0, 1.0, 1.0, 1.0)
    assert virtual_lab.aligned_ratio(0.9, 0.95, 45.0, 10.0, per_line=6) == pytest.approx(float(between), rel=0.025)


def test_wide_bar_is_across_the_lines():
    assert coupons.to_and_fro_resistivity(1.0, 1.7, LINE * 1e-3, 10.0) == pytest.approx(1.7, rel=1e-3)


@pytest.mark.parametrize("contact", [3e-5, 5e-4])
def test_ladder_against_finite_differences(contact):
    grid = virtual_lab.ladder_ohm(0.2, 0.4, (contact, contact), 6.0, 6.0, 0.8)
    bar = coupons.bar_resistance(0.2, 0.2, 0.0, 6e-3, 6e-3, 0.8e-3)
    both = 2 * coupons.ladder_contact(0.2, 0.4, contact, 3e-3, 6e-3, 0.8e-3)
    assert float(both) == pytest.approx(grid - float(bar), rel=0.05)


@pytest.mark.parametrize(("film", "eps"), [(0.4, 5.0), (2.8, 7.0)])
def test_plates_against_finite_volumes(film, eps):
    volumes = virtual_lab.plate_f(film, eps, step=0.04)
    closed = coupons.plate_capacitance(eps, 0.0, film * 1e-3, 10e-3, UPPER_MM * 1e-3)
    assert float(closed) == pytest.approx(volumes, rel=0.012)
    assert float(closed) > 1.05 * 8.8541878128e-12 * np.pi * 1e-4 * eps / (film * 1e-3)  # the rim counts


def test_gap_of_published_plates():
    """50 x 50 x 0.25 mm of PLA, eps 3.00: 104 pF between metal, 328 pF between printed electrodes (Phillips, 2021)."""
    radius = 0.05 / np.sqrt(np.pi)

    def gap(c):
        inner = 8.8541878128e-12 * 0.05**2
        return inner / c - 0.25e-3 / 3.0

    for c, sign in ((104e-12, 1), (328e-12, -1)):
        assert np.sign(gap(c)) == sign
        found = coupons.plate_capacitance(3.0, gap(c), 0.25e-3, radius, fringe=0.0)
        assert float(found) == pytest.approx(c, rel=1e-9)


@pytest.mark.parametrize(("radius", "height", "q", "within"), [
    (4.0, 6.0, 1e-3, 0.06), (5.0, 3.0, 1e-2, 0.03), (8.0, 0.6, 1e-2, 0.03),
])  # fmt: skip
def test_bonded_discs_against_finite_elements(radius, height, q, within):
    closed = float(coupons.bonded_modulus(1.0, q, radius, height))
    assert closed == pytest.approx(virtual_lab.bonded_factor(radius, height, q), rel=within)


def test_bonded_disc_of_no_volume_change_and_of_a_thin_sheet():
    shape = 1.5
    assert float(coupons.bonded_modulus(1.0, 1e-9, 3.0, 1.0)) == pytest.approx(1 + 2 * shape**2, rel=1e-4)
    assert float(coupons.bonded_modulus(1.0, 0.01, 1e4, 1.0)) == pytest.approx(1 + 1 / 0.03, rel=0.01)  # E + K
