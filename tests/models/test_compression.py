"""How films give way: against SciPy's interpolation, published stiffness factors, and the solved cells' own points."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from sensorgen.core.errors import OutOfRange
from sensorgen.models import compression

TRI = {"dielectric_mm": 0.1, "period_mm": 2.0, "hang_height_mm": 0.5, "lower_height_mm": 0.24}
MODULI = {"x60": 6e6, "etpu": 22e6}


def tri(**changes):
    return compression.solved("tri", TRI | changes, MODULI)


@pytest.mark.parametrize(("thickness_mm", "factor"), [(0.6, 94), (0.1, 3335)])
def test_stiffness_of_bonded_films_10_mm_wide(thickness_mm, factor):
    assert compression.bonded(1.0, 0.01, thickness_mm * 1e-3).modulus_pa == pytest.approx(factor, rel=1.5e-3)


@pytest.mark.parametrize("film", [0.1, 0.2])
def test_curves_run_through_their_points_and_as_pchip_between(film):
    law = tri(dielectric_mm=film)
    oracle = PchipInterpolator(law.stress_pa, law.ratio)
    at = np.linspace(1.001e4, 1e5, 1234)  # a contact begins otherwise, below the first point
    thinning, slope = law.capacitive_strain(at)
    assert 1 / (1 - thinning) == pytest.approx(oracle(at), rel=1e-13)
    assert slope == pytest.approx(oracle(at, 1) / oracle(at) ** 2, rel=1e-9)


@pytest.mark.parametrize("power", [0.5, 0.75, 1.0])
def test_a_curve_begins_with_the_power_of_the_stress_that_its_points_follow(power):
    at = np.geomspace(700, 9e3, 50)
    points = np.arange(11) * 1e4
    law = compression.curve("contact", "made up", points, 1 + 0.07 * (points / 1e4) ** power)
    thinning, slope = law.capacitive_strain(at)
    rise = 0.07 * (at / 1e4) ** power
    assert thinning / (1 - thinning) == pytest.approx(rise, rel=0.22)  # a cubic alone: 66 and 41 % less
    assert slope * (1 + rise) ** 2 == pytest.approx(power * rise / at, rel=0.35)
    steeper, _ = replace(law, onset=1.25).capacitive_strain(at)
    assert (steeper > thinning).all() == (power < 1)


@pytest.mark.parametrize(
    ("stress", "ratio"), [([0.0, 1.0], [1.0, 3.0]), ([0, 1, 3, 4], [1, 1.001, 3, 3.001]), ([0, 9, 10], [1, 1.1, 5])]
)
def test_curves_rise_wherever_their_points_do(stress, ratio):
    law = compression.curve("bent", "made up", stress, ratio)
    at = np.linspace(0, stress[-1] * 2, 4001)
    thinning, slope = law.capacitive_strain(at)
    assert (slope >= 0).all()
    summed = np.concatenate([[0.0], np.cumsum((slope[1:] + slope[:-1]) / 2 * np.diff(at))])
    assert summed == pytest.approx(thinning, abs=1e-3)


def test_the_solved_cell_at_100_kpa():
    """212.12 of 159.65 pF/m at 100 kPa (finite elements with contact)."""
    thinning, _ = tri().capacitive_strain(np.asarray(1e5))
    assert float(thinning) == pytest.approx(1 - 159.652 / (159.652 + 52.508), rel=1e-5)


def test_stress_scales_with_the_moduli():
    """A neo-Hookean solid of twice the modulus does the same at twice the stress."""
    stiff = compression.solved("tri", TRI, {name: 2 * e for name, e in MODULI.items()})
    assert stiff.capacitive_strain(np.asarray(8e4))[0] == pytest.approx(
        tri().capacitive_strain(np.asarray(4e4))[0], rel=1e-14
    )


@pytest.mark.parametrize(
    ("shape", "changes", "moduli"),
    [
        ("tri", {"period_mm": 2.1}, MODULI),
        ("tri", {"dielectric_mm": 0.15}, MODULI),
        ("tri", {}, {"x60": 1e6, "etpu": 22e6}),
        ("tri", {}, {"x60": 6e6}),
        ("rect", {}, MODULI),
    ],
)
def test_only_the_very_cell_counts_as_solved(shape, changes, moduli):
    assert compression.solved(shape, TRI | changes, moduli) is None


def test_beyond_the_last_point_it_goes_on_straight_and_says_so():
    law = tri()
    (s0, s1), (_, slope) = law.capacitive_strain(np.array([1e5, 1.2e5]))
    assert 1 / (1 - s1) - 1 / (1 - s0) == pytest.approx(law.slope_per_pa[-1] * 2e4, rel=1e-12)
    assert slope * 1 / (1 - s1) ** 2 == pytest.approx(law.slope_per_pa[-1], rel=1e-12)
    assert "above 100 kPa" in law.doubt(1.2e5)
    assert law.doubt(1e5) == ""


@pytest.mark.parametrize("slope_per_pa", [0.0, 4e-5])
def test_a_straight_continuation_leaves_the_curve_before_it_as_it_was(slope_per_pa):
    """Ten times as steep as the last piece, or flat: the interpolation up to the last point is SciPy's of the data."""
    law = tri()
    longer = compression.extended(law, 1e6, slope_per_pa)
    inside, outside = np.linspace(2e4, 1e5, 50), np.array([2e5, 1e6])
    known = PchipInterpolator(law.stress_pa, law.ratio)(inside)
    assert 1 / (1 - longer.capacitive_strain(inside)[0]) == pytest.approx(known, rel=1e-9)
    line = law.ratio[-1] + slope_per_pa * (outside - 1e5)
    assert 1 / (1 - longer.capacitive_strain(outside)[0]) == pytest.approx(line, rel=1e-9)


@pytest.mark.parametrize(
    ("law", "stress", "said"),
    [
        (compression.unconfined(6e6), 6e6, "its electrodes touch"),
        (tri(), -1.0, "pulls"),
        (tri(), 3.1e5, "ends at 1e\\+05 Pa"),
    ],
)
def test_stress_that_has_no_answer_is_refused(law, stress, said):
    with pytest.raises(OutOfRange, match=said):
        law.capacitive_strain(np.array([0.0, stress]))


@pytest.mark.parametrize(
    ("stress", "ratio"),
    [([0.0], [1.0]), ([1.0, 2.0], [1.0, 2.0]), ([0.0, 1.0], [1.1, 2.0]), ([0.0, 1.0], [1.0, 1.0])],
)  # fmt: skip
def test_points_that_make_no_curve_are_refused(stress, ratio):
    with pytest.raises(OutOfRange, match="both rising"):
        compression.curve("bad", "made up", stress, ratio)


def test_a_breath_keeps_its_digits():
    (thinning,), (slope,) = tri().capacitive_strain(np.array([1e-9]))
    assert thinning == pytest.approx(1e-9 * slope, rel=1e-12)
