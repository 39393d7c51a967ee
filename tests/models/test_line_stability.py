"""What the line has to survive: each extreme by itself and with others, in arrays, and without a word from numpy."""

import itertools

import mpmath
import numpy as np
import pytest
from line_cases import PLATE, TONES, exact, matrix, off, terminated

from sensorgen.core.errors import OutOfRange
from sensorgen.models.line import cascade, impedance, sensitivities
from sensorgen.solvers.line.inputs import BLOCK, blocks

FREQUENCIES = np.geomspace(1e-9, 1e9, 37)


@pytest.mark.parametrize("far_end", ["open", "short", 1e3])
@pytest.mark.parametrize("length", [1e-6, 1e-3, 0.1, 1.0, 10.0, 100.0, 1e3])
def test_lengths_and_frequencies_in_one_array(length, far_end):
    inputs = PLATE | {"L_m": length, "L_p_m": length / 10, "x_p_left_edge_m": 0.45 * length, "F_N": 30 * length}
    found = impedance(**(inputs | {"f_Hz": FREQUENCIES}), far_end=far_end)
    for f, z in zip(FREQUENCIES.tolist(), found, strict=True):
        whole, real = off(z, exact(120, **(inputs | {"f_Hz": f, "far_end": far_end})))
        assert whole < 1e-12, f
        assert real < 1e-11, f


EXTREMES = {
    "no resistance": {"rho_top_ohm_m": 0.0, "rho_bottom_ohm_m": 0.0},
    "unequal by 1e6": {"rho_top_ohm_m": 2e5},
    "a leak": {"G_S_per_m": 1e-6},
    "nearly a short": {"G_S_per_m": 1e6},
    "loss": {"tan_delta": 0.5},
    "at the contacts": {"x_p_left_edge_m": 0.0},
    "at the far end": {"x_p_left_edge_m": 0.09},
    "pulled": {"F_N": -100.0},
    "strained by 99.9 %": {"F_N": 599.4},
    "thin film": {"d_m": 1e-12},
    "short": {"far_end": "short"},
    "an ohm": {"far_end": 1.0},
}


PAIRS = [pair for pair in itertools.combinations(EXTREMES, 2) if pair != ("no resistance", "short")]


def test_a_short_without_resistance_is_nothing():
    assert impedance(**(PLATE | EXTREMES["no resistance"] | EXTREMES["short"])) == 0


@pytest.mark.parametrize("pair", PAIRS, ids="+".join)
def test_two_extremes_at_once(pair):
    inputs = PLATE | EXTREMES[pair[0]] | EXTREMES[pair[1]]
    for f in (1e-9, 1.1e3, 1e9):
        whole, real = off(impedance(**(inputs | {"f_Hz": f})), exact(150, **(inputs | {"f_Hz": f})))
        assert whole < 1e-11
        assert real < 1e-11


def test_near_touching_it_keeps_what_the_strain_keeps():
    """1 - F/(W L_p E) of numbers with 16 digits: docs/line.md says 5e-10 at 599.9999 N; of exact strain it is right."""
    inputs, tones = PLATE | {"F_N": 599.9999}, (1e-3, 1.1e3, 99.7e3, 1e6)
    errors = [off(impedance(**(inputs | {"f_Hz": f})), exact(120, **(inputs | {"f_Hz": f})))[0] for f in tones]
    assert max(errors) == pytest.approx(5e-10, rel=0.2)
    binary = PLATE | {"W_m": 2.0**-7, "L_p_m": 2.0**-7, "E_Pa": 2.0**22, "F_N": 256 * (1 - 2.0**-23)}
    for f in tones:
        assert max(off(impedance(**(binary | {"f_Hz": f})), exact(120, **(binary | {"f_Hz": f})))) < 1e-14


def test_zeros_and_infinities_inside_an_array_stay_where_they_are():
    z = impedance(**(PLATE | {"f_Hz": np.array([0.0, 1.0, 0.0, 1e9])}))
    assert z[0] == z[2] == complex(np.inf, 0)
    assert z[1] == pytest.approx(impedance(**(PLATE | {"f_Hz": 1.0})), rel=1e-14)
    mixed = impedance(**(PLATE | {"L_p_m": np.array([0.0, 0.01]), "F_N": np.array([0.0, 3.0])}))
    assert mixed[0] == pytest.approx(impedance(**(PLATE | {"F_N": 0.0})), rel=1e-14)
    assert mixed[1] == pytest.approx(impedance(**PLATE), rel=1e-14)


def test_a_short_through_the_film_is_what_its_leak_leaves():
    for leak in (1e6, 1e12, 1e100):
        z = impedance(**(PLATE | {"G_S_per_m": leak}))
        assert z.real == pytest.approx(np.sqrt(9e4 / leak), rel=1e-12, abs=0)


@pytest.mark.parametrize("f", [1e-142, 1e-150, 1e-200, 1e-300])
def test_where_double_precision_would_lose_the_resistance_it_says_so(f):
    with pytest.raises(OutOfRange, match="too extreme"):
        impedance(**(PLATE | {"f_Hz": f}))
    with pytest.raises(OutOfRange, match="beyond double precision"):
        sensitivities(of=["L_m"], **(PLATE | {"f_Hz": f}))
    low = PLATE | {"f_Hz": 1e-140}
    assert off(impedance(**low), exact(400, **low))[1] < 1e-12


def test_one_bad_sample_among_many_is_found():
    for name, bad in (("F_N", 600.0), ("F_N", np.nan), ("f_Hz", -1.0), ("x_p_left_edge_m", 0.091), ("d_m", 0.0)):
        values = np.full(30_000, PLATE[name])
        values[17_123] = bad
        with pytest.raises(OutOfRange, match=name if name != "x_p_left_edge_m" and bad != 600 else "."):
            impedance(**(PLATE | {name: values}))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"x_p_left_edge_m": 0.06, "L_p_m": [0.01, 0.05]}, "ends at 0.11 m"),
        ({"L_m": [0.1, 0.05]}, "beyond the sensor's 0.05 m"),
        ({"F_N": 100.0, "L_p_m": [0.01, 0.001]}, "strains the film by 1.67"),
        ({"F_N": 100.0, "W_m": [0.01, 0.001]}, "strains the film by 1.67"),
        ({"F_N": 100.0, "E_Pa": [6e6, 6e5]}, "strains the film by 1.67"),
        ({"S_n_top_per_N": [0.0, -1.0]}, "resistivity is negative"),
    ],
)
def test_the_sample_that_does_not_fit_is_found_whatever_varies(change, words):
    with pytest.raises(OutOfRange, match=words):
        impedance(**(PLATE | {key: np.asarray(value) for key, value in change.items()}))


def test_blocks_are_as_small_as_their_largest_input_asks():
    whole = (slice(0, 4), slice(0, BLOCK))
    assert next(blocks(whole, [(4, 1), (BLOCK,)])) == (slice(0, 1), slice(0, BLOCK // 4))
    covered = np.zeros((4, 3 * BLOCK // 2), int)
    for part in blocks((slice(0, 4), slice(0, 3 * BLOCK // 2)), [(4, 1)]):
        covered[part] += 1
    assert (covered == 1).all()


def test_a_patch_may_end_at_the_end_by_rounding_only():
    """0.1 * 3 + 0.1 * 7 is not 1: the patch may pass the end by as much as decimals do."""
    inputs = PLATE | {"L_m": 1.0, "x_p_left_edge_m": 0.1 * 3, "L_p_m": 0.7 * (1 + 3e-16)}
    assert np.isfinite(impedance(**inputs))
    with pytest.raises(OutOfRange, match="beyond"):
        impedance(**(inputs | {"L_p_m": 0.7 * (1 + 1e-9)}))


def test_many_sections_of_all_kinds_neither_overflow_nor_lose():
    """200 sections whose characteristic impedances differ by a million times in turn."""
    r = np.where(np.arange(200) % 2, 1e8, 1e2)
    y = np.where(np.arange(200) % 2, 1e-6j, 1e-2j)
    lengths = np.full(200, 0.05)
    with mpmath.workdps(400):
        product = mpmath.eye(2)
        for part in zip(r.tolist(), y.tolist(), lengths.tolist(), strict=True):
            product *= matrix(*(mpmath.mpmathify(v) for v in part))
        for far_end in ("open", "short", 1e3):
            whole, real = off(cascade(r, y, lengths, far_end), terminated(product, far_end))
            assert whole < 1e-13
            assert real < 1e-12
    assert cascade([], [], []) == complex(np.inf, 0)
    assert cascade([], [], [], 70.0) == 70


@pytest.mark.parametrize("size", [1e6, 1e9])
def test_thousands_of_sections_do_not_overflow(size):
    line = cascade(np.full(3000, size), np.full(3000, 1j), np.full(3000, 10.0))
    assert line == pytest.approx(np.sqrt(size / 1j), rel=1e-12)


def test_derivatives_at_the_ends_of_the_range_against_mpmath():
    for change in ({"f_Hz": 1e-9}, {"f_Hz": 3e7}, {"rho_top_ohm_m": 2e5}, {"x_p_left_edge_m": 0.0, "F_N": -6.0}):
        inputs = PLATE | change
        _, by = sensitivities(of=["F_N", "x_p_left_edge_m"], **inputs)
        with mpmath.workdps(300):
            step = mpmath.mpf(10) ** -60
            for name, found in by.items():
                low, high = (exact(300, **(inputs | {name: mpmath.mpf(inputs[name]) + s * step})) for s in (-1, 1))
                true = (high - low) / (2 * step)
                gap = mpmath.mpmathify(complex(found)) - true
                assert abs(gap) < 1e-11 * abs(true)
                assert abs(gap.real) < 1e-9 * abs(true.real)


def test_some_derivatives_are_what_all_of_them_are():
    grid = PLATE | {"f_Hz": np.array(TONES)[:, None], "F_N": np.linspace(0.1, 6, 5), "S_n_top_per_N": 0.01}
    everything = sensitivities(**grid)[1]
    for name, value in everything.items():
        np.testing.assert_array_equal(sensitivities(of=[name], **grid)[1][name], value)


def test_a_film_that_conducts_all_over_is_a_loss_tangent():
    """G' is a hole's and stays under the patch; conduction through the film goes with 1/d, as sigma/(omega eps)."""
    sigma, eps = 1e-8, 8.8541878128e-12 * 4.68
    inputs = PLATE | {"F_N": 300.0}
    for f in (1.0, 1.1e3, 99.7e3):
        loss = sigma / (2 * np.pi * f * eps)
        with mpmath.workdps(60):
            width, film, strain = mpmath.mpf(0.01), mpmath.mpf(6e-4), mpmath.mpf(0.5)
            product = mpmath.eye(2)
            for length, gap in ((0.045, film), (0.01, film * (1 - strain)), (0.045, film)):
                y = (sigma + 2j * mpmath.pi * f * mpmath.mpf(eps)) * width / gap
                product *= matrix(mpmath.mpf(9e4), y, mpmath.mpf(length))
            true = terminated(product, "open")
        assert complex(true) == pytest.approx(impedance(**(inputs | {"f_Hz": f}), tan_delta=loss), rel=1e-12)
    constant = impedance(**(inputs | {"f_Hz": 1.0}), G_S_per_m=sigma * 0.01 / 6e-4)
    assert (
        abs(constant / complex(impedance(**(inputs | {"f_Hz": 1.0}), tan_delta=sigma / (2 * np.pi * eps))) - 1) > 0.05
    )
