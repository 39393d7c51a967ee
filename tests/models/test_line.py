"""The line against 25 digits, its slopes against 50. Re Z carries the position: tested by itself."""

import mpmath
import numpy as np
import pytest
from line_cases import PLATE, TONES, cases, off, product, slope, terminated

from sensorgen.core.errors import BadInput, MissingValue, OutOfRange, UnknownName
from sensorgen.models.line import PressedLine, cascade, impedance, sensitivities


def test_the_224_references_to_25_digits():
    assert len(cases()) == 224
    for inputs, (re, im) in cases():
        with mpmath.workdps(40):
            whole, real = off(impedance(PressedLine(**inputs)), mpmath.mpc(re, im))
        assert whole < 1e-13, inputs
        assert real < 1e-11, inputs


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


def test_arrays_broadcast_and_blocks_make_no_difference(monkeypatch):
    from sensorgen.solvers.line import inputs as _line_inputs

    tones, force, left = np.array(TONES)[:, None, None], np.linspace(-2, 6, 11)[:, None], np.linspace(0, 0.09, 13)
    grid = PressedLine(**PLATE | {"frequency_hz": tones, "force_n": force, "left_m": left, "far_end": "open"})
    whole, slopes = impedance(grid), sensitivities(grid, of=["force_n"])[1]["force_n"]
    assert whole.shape == (7, 11, 13)
    monkeypatch.setattr(_line_inputs, "BLOCK", 20)
    for part in (np.real, np.imag):
        np.testing.assert_allclose(part(impedance(grid)), part(whole), rtol=1e-14)
        np.testing.assert_allclose(part(sensitivities(grid, of=["force_n"])[1]["force_n"]), part(slopes), rtol=1e-12)
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
    ({"force_n": [1.0, np.inf]}, OutOfRange, "force_n has to be a number and finite, not inf"),
    ({"frequency_hz": -1.0}, OutOfRange, "frequency_hz has to be 0 or more and finite, not -1"),
    ({"frequency_hz": [1.0, np.nan]}, OutOfRange, "not nan"),
    ({"tip_m": 0.0}, OutOfRange, "without area"),
    ({"left_m": 0.0901}, OutOfRange, "ends at 0.1001 m, beyond the sensor's 0.1 m"),
    ({"film_m": [0.1, 0.0]}, OutOfRange, "film_m has to be above 0 and finite, not 0"),
    ({"top_piezoresistance_per_n": -1.0}, OutOfRange, "resistivity is negative"),
    ({"modulus_pa": None}, MissingValue, "modulus_pa"),
    ({"far_end": "opne"}, UnknownName, "did you mean 'open'"),
    ({"far_end": [1.0, np.inf]}, OutOfRange, "far_end"),
    ({"tan_delt": 1.0}, TypeError, "tan_delt"),
    ({"force_n": "6 N"}, BadInput, "force_n takes numbers in SI units"),
    ({"frequency_hz": [1.0, 2.0], "force_n": [1.0, 2.0, 3.0]}, BadInput, "do not broadcast"),
    ({"length_m": 1e300, "frequency_hz": 1e300}, OutOfRange, "too extreme"),
]


@pytest.mark.parametrize(("change", "error", "words"), REFUSED)
def test_senseless_values_are_refused_in_words(change, error, words):
    with pytest.raises(error, match=words):
        impedance(PressedLine(**PLATE | change))


ACTIVE = "negative or not finite; expected 0 or more"


@pytest.mark.parametrize(
    ("sections", "error", "words"),
    [
        (([1.0], [1j, 1j], [1.0]), BadInput, "make no sections"),
        (([-1.0], [1j], [1.0]), OutOfRange, ACTIVE),
        (([1.0], [-1j], [1.0]), OutOfRange, ACTIVE),
        (([1.0], [1j], [np.nan]), OutOfRange, ACTIVE),
        (([1.0], ["x"], [1.0]), BadInput, "admittance takes numbers in SI units, not 'x'"),
        (([[[1.0], [1.0, 2.0]]], [1j], [1.0]), BadInput, "resistance takes numbers"),
        (([[1.0, 2.0]], [1j], [1.0], [1.0, 2.0, 3.0]), BadInput, "do not broadcast together"),
    ],
)
def test_sections_that_make_no_line_are_refused(sections, error, words):
    with pytest.raises(error, match=words):
        cascade(*sections)


SLOPES = {
    "as it is": {},
    "piezoresistive": {
        "top_piezoresistance_per_n": 0.01, "bottom_piezoresistance_per_n": 0.02, "tan_delta": 0.01, "leak_s_per_m": 1e-6
    },
    "high": {"frequency_hz": 1e8, "tan_delta": 0.05},
    "pulled, at the end": {"force_n": -6.0, "left_m": 0.09},
    "unpressed": {"force_n": 0.0, "top_piezoresistance_per_n": 0.1},
    "short": {"far_end": "short", "top_piezoresistance_per_n": 0.01},
    "terminated": {"far_end": 2e3, "leak_s_per_m": 1e-5},
    "lower than any": {"frequency_hz": 1e-9},
    "unequal by 1e6": {"top_resistivity_ohm_m": 2e5},
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
    "5 m, a small patch": {"length_m": 5.0, "force_n": 0.01},
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
        ({"force_n": 0.0, "modulus_pa": None}, ["force_n"], MissingValue),
        ({}, ["eps0_f_per_m"], UnknownName),
    ],
)
def test_derivatives_that_do_not_exist_are_refused(change, of, error):
    with pytest.raises(error):
        sensitivities(PressedLine(**PLATE | change), of=of)
