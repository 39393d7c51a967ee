"""The line against 25 digits, and against 60 and more in every corner. Re Z carries the position: tested by itself."""

import mpmath
import numpy as np
import pytest
from line_cases import PLATE, TONES, cases, exact, off, product, slope, terminated

from sensorgen.core.errors import BadInput, MissingValue, OutOfRange, UnknownName
from sensorgen.models.line import PressedLine, cascade, corner_frequency_hz, impedance, sensitivities


def test_the_224_references_to_25_digits():
    assert len(cases()) == 224
    for inputs, (re, im) in cases():
        with mpmath.workdps(40):
            whole, real = off(impedance(PressedLine(**inputs)), mpmath.mpc(re, im))
        assert whole < 1e-13, inputs
        assert real < 1e-11, inputs


CORNERS = {  # more, two at once and at other lengths: test_line_stability.py
    "as it is": {},
    "piezoresistive": {"top_piezoresistance_per_n": 0.1, "bottom_piezoresistance_per_n": -0.2},
    "softened to nothing": {"top_piezoresistance_per_n": -1 / 3, "bottom_resistivity_ohm_m": 0.0},
    "unequal by 1e-6": {"top_resistivity_ohm_m": 2e-7, "top_thickness_m": 3e-2},
    "one perfect track": {"top_resistivity_ohm_m": 0.0},
    "all of it": {"left_m": 0.0, "tip_m": 0.1, "force_n": 100.0},
    "no force": {"force_n": 0.0},
    "no patch": {"force_n": 0.0, "tip_m": 0.0},
    "pulled": {"force_n": -500.0},
    "nearly touching": {"force_n": 600 * (1 - 1e-9)},
    "1 Tohm": {"far_end": 1e12},
    "a microohm": {"far_end": 1e-6},
    "short, no resistance": {"top_resistivity_ohm_m": 0.0, "bottom_resistivity_ohm_m": 0.0, "far_end": 50.0},
}


@pytest.mark.parametrize("corner", CORNERS)
def test_every_corner_over_18_decades_of_frequency(corner):
    """Against transfer matrices with 120 digits; pytest turns every warning into an error."""
    inputs = PLATE | CORNERS[corner]
    for f in (1e-9, 1e-3, 1.0, 1.1e3, 99.7e3, 1e6, 1e9):
        true = exact(120, **(inputs | {"frequency_hz": f}))
        whole, real = off(impedance(PressedLine(**inputs | {"frequency_hz": f})), true)
        # 1 - s of a strain 1e-9 below one keeps seven digits of F, W, L_p and E
        tolerance = 1e-6 if corner == "nearly touching" else 1e-11
        assert whole < tolerance, f
        assert real < tolerance, f


def test_far_ends_meet():
    assert impedance(PressedLine(**PLATE, far_end=0.0)) == impedance(PressedLine(**PLATE, far_end="short"))
    assert impedance(PressedLine(**PLATE, far_end=np.inf)) == impedance(PressedLine(**PLATE))
    assert impedance(PressedLine(**PLATE, far_end=[0.0, 50.0])).shape == (2,)


@pytest.mark.parametrize(
    "change", [{"frequency_hz": 0.0}, {"length_m": 0.0, "tip_m": 0.0, "left_m": 0.0, "force_n": 0.0}]
)
def test_without_current_it_is_infinite(change):
    assert impedance(PressedLine(**PLATE | change)) == complex(np.inf, 0)
    assert impedance(PressedLine(**PLATE | change, far_end=70.0)).imag == 0


def test_direct_current_through_a_leak_and_a_short():
    track = (0.07 + 0.2) / (3e-4 * 0.01)
    dc = PLATE | {"frequency_hz": 0.0}
    assert impedance(PressedLine(**dc, far_end="short")) == pytest.approx(track * 0.1, rel=1e-13)
    leaky = np.sqrt(track / 1e-3) / np.tanh(np.sqrt(track * 1e-3) * 0.1)
    assert impedance(PressedLine(**dc, leak_s_per_m=1e-3)) == pytest.approx(leaky, rel=1e-13)


def test_at_low_frequency_it_is_a_third_of_the_resistance_before_a_capacitor():
    """Errata 2.24: not the whole of it."""
    z = impedance(PressedLine(**PLATE | {"force_n": 0.0, "frequency_hz": 1.0}))
    assert z.real == pytest.approx(9000 / 3, rel=1e-6)
    assert corner_frequency_hz(9000.0, 69.06266493984e-12) == pytest.approx(256e3, rel=2e-3)
    high = impedance(PressedLine(**PLATE | {"force_n": 0.0, "frequency_hz": 1.1e6}))
    assert high.real == pytest.approx(0.9 * 9000 / 3, rel=0.05)


def test_arrays_broadcast_and_blocks_make_no_difference(monkeypatch):
    from sensorgen.solvers.line import inputs as _line_inputs

    tones, force, left = np.array(TONES)[:, None, None], np.linspace(-2, 6, 11)[:, None], np.linspace(0, 0.09, 13)
    grid = PressedLine(**PLATE | {"frequency_hz": tones, "force_n": force, "left_m": left, "far_end": "open"})
    whole, slopes = impedance(grid), sensitivities(grid)[1]["force_n"]
    assert whole.shape == (7, 11, 13)
    monkeypatch.setattr(_line_inputs, "BLOCK", 20)
    for part in (np.real, np.imag):
        np.testing.assert_allclose(part(impedance(grid)), part(whole), rtol=1e-14)
        np.testing.assert_allclose(part(sensitivities(grid)[1]["force_n"]), part(slopes), rtol=1e-12)
    one = PLATE | {"frequency_hz": TONES[3], "force_n": force[4, 0], "left_m": left[7]}
    assert impedance(PressedLine(**one)) == pytest.approx(whole[3, 4, 7], rel=1e-14)
    assert impedance(PressedLine(**PLATE | {"frequency_hz": []})).shape == (0,)


def test_a_million_samples_need_the_memory_of_their_answer():
    import tracemalloc

    force = np.linspace(0, 6, 1_000_000)
    tracemalloc.start()
    impedance(PressedLine(**PLATE | {"force_n": force}))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 16e6 * 4


ODD = np.arange(200) % 2 == 1
SECTIONS = {
    "a film that thins towards the middle": (
        9e4 + 1e3 * np.arange(40), 2j * np.pi * 99.7e3 * 6.9e-10 / (1 - 0.4 * np.sin(np.linspace(0, np.pi, 40)) ** 2),
        np.full(40, 2.5e-3), 60, 1e-11,
    ),
    "characteristic impedances a million times apart": (
        np.where(ODD, 1e8, 1e2), np.where(ODD, 1e-6j, 1e-2j), np.full(200, 0.05), 400, 1e-12,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SECTIONS)
def test_sections_of_any_number(name):
    r, y, lengths, digits, tolerance = SECTIONS[name]
    with mpmath.workdps(digits):
        whole = product(zip(r.tolist(), y.tolist(), lengths.tolist(), strict=True))
        for far_end in ("open", "short", 1e3):
            modulus, real = off(cascade(r, y, lengths, far_end), terminated(whole, far_end))
            assert modulus < 1e-13
            assert real < tolerance


def test_sections_of_no_length_and_cut_sections_change_nothing():
    y = 2j * np.pi * 1e4 * 6.9e-10
    whole = cascade([9e4], [y], [0.1])
    assert cascade([9e4, 5.0, 9e4], [y, 1j, y], [0.03, 0.0, 0.07]) == pytest.approx(whole, rel=1e-14)


REFUSED = [
    ({"force_n": 600.0}, OutOfRange, "strains the film by 1"),
    ({"force_n": 1e9}, OutOfRange, "electrodes touch"),
    ({"force_n": np.nan}, OutOfRange, "force_n"),
    ({"force_n": [1.0, np.inf]}, OutOfRange, "force_n has to be a number and finite, not inf"),
    ({"frequency_hz": -1.0}, OutOfRange, "frequency_hz has to be 0 or more and finite, not -1"),
    ({"frequency_hz": [1.0, np.nan]}, OutOfRange, "not nan"),
    ({"length_m": -0.1}, OutOfRange, "length_m"),
    ({"tip_m": -0.01}, OutOfRange, "tip_m"),
    ({"tip_m": 0.0}, OutOfRange, "without area"),
    ({"left_m": 0.0901}, OutOfRange, "ends at 0.1001 m, beyond the sensor's 0.1 m"),
    ({"left_m": -1e-9}, OutOfRange, "left_m"),
    ({"film_m": 0.0}, OutOfRange, "film_m has to be above 0"),
    ({"film_m": [0.1, 0.0]}, OutOfRange, "not 0"),
    ({"leak_s_per_m": np.inf}, OutOfRange, "leak_s_per_m"),
    ({"tan_delta": -0.1}, OutOfRange, "tan_delta"),
    ({"top_piezoresistance_per_n": -1.0}, OutOfRange, "resistivity is negative"),
    ({"modulus_pa": 0.0}, OutOfRange, "modulus_pa"),
    ({"far_end": -1.0}, OutOfRange, "far_end"),
    ({"far_end": "opne"}, UnknownName, "did you mean 'open'"),
    ({"far_end": [1.0, np.inf]}, OutOfRange, "far_end"),
    ({"tan_delt": 1.0}, TypeError, "tan_delt"),
    ({"force_n": "6 N"}, BadInput, "force_n takes numbers in SI units"),
    ({"frequency_hz": 1j}, BadInput, "frequency_hz"),
    ({"frequency_hz": [1.0, 2.0], "force_n": [1.0, 2.0, 3.0]}, BadInput, "do not broadcast"),
    ({"length_m": 1e300, "frequency_hz": 1e300}, OutOfRange, "too extreme"),
]


@pytest.mark.parametrize(("change", "error", "words"), REFUSED)
def test_senseless_values_are_refused_in_words(change, error, words):
    with pytest.raises(error, match=words):
        impedance(PressedLine(**PLATE | change))


def test_a_force_without_a_modulus_is_refused():
    with pytest.raises(MissingValue, match="modulus_pa"):
        impedance(PressedLine(**{k: v for k, v in PLATE.items() if k != "modulus_pa"}))


def test_sections_that_do_not_match_or_are_active_are_refused():
    with pytest.raises(BadInput, match="make no sections"):
        cascade([1.0], [1j, 1j], [1.0])
    for r, y, length in ((-1.0, 1j, 1.0), (1.0, -1j, 1.0), (1.0, 1j, np.nan)):
        with pytest.raises(OutOfRange, match="negative or not finite; expected 0 or more"):
            cascade([r], [y], [length])


@pytest.mark.parametrize(
    ("r", "y", "far_end", "words"),
    [
        (1.0, "x", "open", "admittance takes numbers in SI units, not 'x'"),
        ("x", 1j, "open", "resistance takes numbers"),
        ([[1.0], [1.0, 2.0]], 1j, "open", "resistance takes numbers"),
        ([1.0, 2.0], [1j, 1j, 1j], "open", "do not broadcast together"),
        ([1.0, 2.0], 1j, [1.0, 2.0, 3.0], "do not broadcast together"),
    ],
)
def test_sections_that_are_no_numbers_or_do_not_fit_are_refused(r, y, far_end, words):
    with pytest.raises(BadInput, match=words):
        cascade([r], [y], [1.0], far_end)


def test_a_line_without_resistance_is_short_at_any_frequency():
    assert corner_frequency_hz(0.0, 69e-12) == corner_frequency_hz(9e3, 0.0) == np.inf


SLOPES = {
    "as it is": {},
    "piezoresistive": {
        "top_piezoresistance_per_n": 0.01, "bottom_piezoresistance_per_n": 0.02, "tan_delta": 0.01, "leak_s_per_m": 1e-6
    },
    "low": {"frequency_hz": 1.1e3},
    "very low": {"frequency_hz": 1e-3},
    "high": {"frequency_hz": 1e8, "tan_delta": 0.05},
    "pulled, at the end": {"force_n": -6.0, "left_m": 0.09},
    "unpressed": {"force_n": 0.0, "top_piezoresistance_per_n": 0.1},
    "short": {"far_end": "short", "top_piezoresistance_per_n": 0.01},
    "terminated": {"far_end": 2e3, "leak_s_per_m": 1e-5},
    "lower than any": {"frequency_hz": 1e-9},
    "30 MHz": {"frequency_hz": 3e7},
    "unequal by 1e6": {"top_resistivity_ohm_m": 2e5},
    "pulled, at the contacts": {"left_m": 0.0, "force_n": -6.0},
}  # fmt: skip


@pytest.mark.parametrize("corner", SLOPES)
def test_derivatives_against_mpmath(corner):
    """Central differences of the exact line: right to 50 digits."""
    piezo = ("top_piezoresistance_per_n", "bottom_piezoresistance_per_n")
    inputs = dict.fromkeys(("tan_delta", "leak_s_per_m", *piezo), 0.0) | PLATE | SLOPES[corner]
    z, by = sensitivities(PressedLine(**inputs))
    assert z == pytest.approx(impedance(PressedLine(**inputs)), rel=1e-14)
    assert set(by) == set(inputs) - {"far_end"}
    for name, found in by.items():
        true = slope(name, 120, 30, **inputs)
        if abs(true) < mpmath.mpf(10) ** -40:  # no force: nothing depends on E, L_p or x
            assert abs(found) < 1e-15 * abs(z), name
            continue
        gap = mpmath.mpmathify(complex(found)) - true
        assert abs(gap) / abs(true) < 1e-11, name
        assert abs(gap.real) <= 1e-9 * abs(true.real) + 1e-15 * abs(true), name


LOSSY = {
    "20 m": {"length_m": 20.0, "left_m": 9.0, "tip_m": 2.0, "force_n": 600.0},
    "50 m": {"length_m": 50.0, "left_m": 22.5, "tip_m": 5.0, "force_n": 1500.0},
    "5 m, a small patch": {"length_m": 5.0, "force_n": 0.01},
    "hardly pressed": {"force_n": 1e-4},
}


@pytest.mark.parametrize("far_end", ["open", "short", 2e3])
@pytest.mark.parametrize("loss", [{}, {"tan_delta": 0.1, "top_piezoresistance_per_n": 0.01}], ids=["pure", "loss"])
@pytest.mark.parametrize("case", LOSSY)
def test_derivatives_by_lengths_keep_their_digits_on_lossy_lines(case, loss, far_end):
    """Nearly nothing comes back from the far end: what is left of dZ/dL is a tiny number, and as right as any."""
    inputs = PLATE | LOSSY[case] | loss | {"far_end": far_end}
    _, by = sensitivities(PressedLine(**inputs), of=["length_m", "tip_m"])
    for name, found in by.items():
        true = slope(name, 400, 60, **inputs)
        assert abs(mpmath.mpmathify(complex(found)) - true) < 1e-11 * abs(true), name


def test_an_unpressed_patch_may_be_of_any_length():
    for far_end in ("open", "short", 2e3):
        assert sensitivities(PressedLine(**PLATE | {"force_n": 0.0, "far_end": far_end}), of=["tip_m"])[1]["tip_m"] == 0


def test_no_press_leaves_no_trace_of_position():
    assert sensitivities(PressedLine(**PLATE | {"force_n": 0.0}), of=["left_m"])[1]["left_m"] == 0
    # Film and tracks that change alike keep the characteristic impedance's ratio r/y: y is 1/(1 - s) times itself.
    strain = 3.0 / (0.01 * 0.01 * 6e6)
    alike = (1 / (1 - strain) - 1) / 3.0
    matched = PLATE | {"top_piezoresistance_per_n": alike, "bottom_piezoresistance_per_n": alike}
    by = [abs(sensitivities(PressedLine(**p), of=["left_m"])[1]["left_m"]) for p in (matched, PLATE)]
    assert by[0] < 1e-10 * by[1]


@pytest.mark.parametrize(
    ("change", "of", "error"),
    [
        ({"frequency_hz": 0.0}, None, OutOfRange),
        ({"force_n": 0.0, "tip_m": 0.0}, ["force_n"], OutOfRange),
        ({}, ["eps0_f_per_m"], UnknownName),
    ],
)
def test_derivatives_that_do_not_exist_are_refused(change, of, error):
    with pytest.raises(error):
        sensitivities(PressedLine(**PLATE | change), of=of)


def test_a_derivative_by_force_needs_a_modulus():
    soft = {k: v for k, v in PLATE.items() if k not in ("modulus_pa", "force_n")}
    with pytest.raises(MissingValue):
        sensitivities(PressedLine(**soft))
    assert set(sensitivities(PressedLine(**soft), of=["frequency_hz"])[1]) == {"frequency_hz"}
