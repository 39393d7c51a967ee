"""What the line has to survive: each extreme by itself and with others, in arrays, and without a word from numpy."""

import itertools

import mpmath
import numpy as np
import pytest
from line_cases import PLATE, exact, off, product, terminated

from sensorgen.core.errors import OutOfRange
from sensorgen.models.line import PressedLine, cascade, impedance, sensitivities

EXTREMES = {
    "no resistance": {"top_resistivity_ohm_m": 0.0, "bottom_resistivity_ohm_m": 0.0},
    "unequal by 1e6": {"top_resistivity_ohm_m": 2e5},
    "a leak": {"leak_s_per_m": 1e-6},
    "nearly a short": {"leak_s_per_m": 1e6},
    "loss": {"tan_delta": 0.5},
    "at the contacts": {"left_m": 0.0},
    "at the far end": {"left_m": 0.09},
    "pulled": {"force_n": -100.0},
    "strained by 99.9 %": {"force_n": 599.4},
    "thin film": {"film_m": 1e-12},
    "short": {"far_end": "short"},
    "a microohm": {"far_end": 1e-6},
    "1 Tohm": {"far_end": 1e12},
    "piezoresistive": {"top_piezoresistance_per_n": 3e-5, "bottom_piezoresistance_per_n": -3e-5},
    "a micrometre": {"length_m": 1e-6, "tip_m": 1e-7, "left_m": 4.5e-7, "force_n": 3e-5},
    "a kilometre": {"length_m": 1e3, "tip_m": 100.0, "left_m": 450.0, "force_n": 3e4},
}


PAIRS = [pair for pair in itertools.combinations(EXTREMES, 2) if pair != ("no resistance", "short")]


def test_a_short_without_resistance_is_nothing():
    assert impedance(PressedLine(**PLATE | EXTREMES["no resistance"] | EXTREMES["short"])) == 0


@pytest.mark.parametrize("pair", PAIRS, ids="+".join)
def test_two_extremes_at_once(pair):
    inputs = PLATE | EXTREMES[pair[0]] | EXTREMES[pair[1]]
    for f in (1e-9, 1.1e3, 1e9):
        whole, real = off(
            impedance(PressedLine(**inputs | {"frequency_hz": f})), exact(150, **(inputs | {"frequency_hz": f}))
        )
        assert whole < 1e-11
        assert real < 1e-11


def test_near_touching_it_keeps_what_the_strain_keeps():
    """1 - F/(W L_p E) of numbers with 16 digits: docs/line.md says 5e-10 at 599.9999 N; of exact strain it is right."""
    binary = PLATE | {"width_m": 2.0**-7, "tip_m": 2.0**-7, "modulus_pa": 2.0**22, "force_n": 256 * (1 - 2.0**-23)}

    def errors(inputs):
        tones = [inputs | {"frequency_hz": f} for f in (1e-3, 1.1e3, 99.7e3, 1e6)]
        return np.transpose([off(impedance(PressedLine(**at)), exact(120, **at)) for at in tones])

    assert errors(PLATE | {"force_n": 599.9999})[0].max() == pytest.approx(5e-10, rel=0.2)
    assert errors(binary).max() < 1e-14


def test_zeros_and_infinities_inside_an_array_stay_where_they_are():
    z = impedance(PressedLine(**PLATE | {"frequency_hz": np.array([0.0, 1.0, 0.0, 1e9])}))
    assert z[0] == z[2] == complex(np.inf, 0)
    assert z[1] == pytest.approx(impedance(PressedLine(**PLATE | {"frequency_hz": 1.0})), rel=1e-14)
    mixed = impedance(PressedLine(**PLATE | {"tip_m": np.array([0.0, 0.01]), "force_n": np.array([0.0, 3.0])}))
    assert mixed[0] == pytest.approx(impedance(PressedLine(**PLATE | {"force_n": 0.0})), rel=1e-14)
    assert mixed[1] == pytest.approx(impedance(PressedLine(**PLATE)), rel=1e-14)


def test_a_short_through_the_film_is_what_its_leak_leaves():
    for leak in (1e6, 1e12, 1e100):
        z = impedance(PressedLine(**PLATE | {"leak_s_per_m": leak}))
        assert z.real == pytest.approx(np.sqrt(9e4 / leak), rel=1e-12, abs=0)


@pytest.mark.parametrize("f", [1e-142, 1e-300])
def test_where_double_precision_would_lose_the_resistance_it_says_so(f):
    with pytest.raises(OutOfRange, match="too extreme"):
        impedance(PressedLine(**PLATE | {"frequency_hz": f}))
    with pytest.raises(OutOfRange, match="beyond double precision"):
        sensitivities(PressedLine(**PLATE | {"frequency_hz": f}), of=["length_m"])
    low = PLATE | {"frequency_hz": 1e-140}
    assert off(impedance(PressedLine(**low)), exact(400, **low))[1] < 1e-12


def test_one_bad_sample_among_many_is_found():
    for name, bad in (("force_n", 600.0), ("force_n", np.nan), ("left_m", 0.091)):
        values = np.full(30_000, PLATE[name])
        values[17_123] = bad
        with pytest.raises(OutOfRange, match=name if name != "left_m" and bad != 600 else "."):
            impedance(PressedLine(**PLATE | {name: values}))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"left_m": 0.06, "tip_m": [0.01, 0.05]}, "ends at 0.11 m"),
        ({"length_m": [0.1, 0.05]}, "beyond the sensor's 0.05 m"),
        ({"force_n": 100.0, "modulus_pa": [6e6, 6e5]}, "strains the film by 1.67"),
        ({"top_piezoresistance_per_n": [0.0, -1.0]}, "resistivity is negative"),
    ],
)
def test_the_sample_that_does_not_fit_is_found_whatever_varies(change, words):
    with pytest.raises(OutOfRange, match=words):
        impedance(PressedLine(**PLATE | {key: np.asarray(value) for key, value in change.items()}))


def test_a_patch_may_end_at_the_end_by_rounding_only():
    """0.1 * 3 + 0.1 * 7 is not 1: the patch may pass the end by as much as decimals do."""
    inputs = PLATE | {"length_m": 1.0, "left_m": 0.1 * 3, "tip_m": 0.7 * (1 + 3e-16)}
    assert np.isfinite(impedance(PressedLine(**inputs)))
    with pytest.raises(OutOfRange, match="beyond"):
        impedance(PressedLine(**inputs | {"tip_m": 0.7 * (1 + 1e-9)}))


def test_no_sections_are_the_far_end():
    assert cascade([], [], []) == complex(np.inf, 0)
    assert cascade([], [], [], 70.0) == 70


def test_thousands_of_sections_do_not_overflow():
    line = cascade(np.full(3000, 1e9), np.full(3000, 1j), np.full(3000, 10.0))
    assert line == pytest.approx(np.sqrt(1e9 / 1j), rel=1e-12)


def test_a_film_that_conducts_all_over_is_a_loss_tangent():
    """G' is a hole's and stays under the patch; conduction through the film goes with 1/d, as sigma/(omega eps)."""
    sigma, eps, inputs = 1e-8, 8.8541878128e-12 * 4.68, PLATE | {"force_n": 300.0}
    for f in (1.0, 1.1e3, 99.7e3):
        with mpmath.workdps(60):
            y = (sigma + 2j * mpmath.pi * f * mpmath.mpf(eps)) * mpmath.mpf(0.01) / mpmath.mpf(6e-4)
            whole = product([(9e4, y, 0.045), (9e4, 2 * y, 0.01), (9e4, y, 0.045)])
        loss = sigma / (2 * np.pi * f * eps)
        found = impedance(PressedLine(**inputs | {"frequency_hz": f}, tan_delta=loss))
        assert complex(terminated(whole, "open")) == pytest.approx(found, rel=1e-12)
    low = inputs | {"frequency_hz": 1.0}
    everywhere = impedance(PressedLine(**low, tan_delta=sigma / (2 * np.pi * eps)))
    assert abs(impedance(PressedLine(**low, leak_s_per_m=sigma * 0.01 / 6e-4)) / everywhere - 1) > 0.05
