"""Lengths, frequencies and forces as typed, one by one and many at once."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sensorgen.core.errors import BadInput
from sensorgen.core.units import (
    FORCE_N,
    MOST_VALUES,
    force_n,
    frequency_hz,
    frequency_text,
    length_mm,
    values,
)  # fmt: skip

NO_NUMBERS = [
    "", " ", "mm", "nan", "inf", "-inf", "1.2.3", ".", "1 inch", "1km", "0x1", "1e", "٣", "1_0", "--1", "1\n2",
    "1e5e5", "1e400", "1e99999999999999999999", "1;5", "5 N 6", "infN", "1 2", "−3",
]  # fmt: skip


READ = {
    length_mm: {
        "0.2": 0.2, "0.2mm": 0.2, " 0.2 MM ": 0.2, "200um": 0.2, "200µm": 0.2, "200μm": 0.2, "2cm": 20.0, "0.1m": 100.0,
        "1e-1": 0.1, "-3": -3.0, "+3": 3.0, ".5": 0.5, "5.": 5.0, "0.2\u00a0mm": 0.2, "0.2\u202fmm": 0.2,
    },
    frequency_hz: {"1100": 1100.0, "10.1 khz": 10100.0, "2MHz": 2e6, "2mHz": 2e-3, "1.5GHz": 1.5e9, "0": 0.0},
    force_n: {"6 N": 6.0, "6n": 6.0, "250mN": 0.25, "1KN": 1000.0, "1MN": 1e6, "1 kgf": 9.80665, "100 GF": 0.980665},
}  # fmt: skip


@pytest.mark.parametrize(("read", "text", "value"), [(r, *pair) for r, texts in READ.items() for pair in texts.items()])
def test_numbers_as_typed(read, text, value):
    assert read(text) == value


@pytest.mark.parametrize("text", NO_NUMBERS)
def test_no_number(text):
    with pytest.raises(BadInput, match="is not a length: write a number, with mm, um, cm or m if you like"):
        length_mm(text)


@pytest.mark.parametrize(
    ("read", "text", "advice"),
    [
        (length_mm, "1,5", "decimals take a point, as in 1.5"),
        (frequency_hz, "1 MHZ", "'MHZ' may be mHz or MHz: mind upper and lower case"),
        (force_n, "5mn", "'mn' may be mN or MN"),
        (force_n, "1e308kN", "it is too large"),
        (frequency_hz, "x", "is not a frequency: write a number, with Hz, mHz, kHz, MHz or GHz if you like"),
        (force_n, "x", "is not a force: write a number, with N, mN, kN, MN, gf or kgf if you like"),
    ],
)
def test_what_to_do_instead(read, text, advice):
    with pytest.raises(BadInput, match=advice):
        read(text)


def test_a_long_word_is_cut_in_the_message():
    with pytest.raises(BadInput) as caught:
        force_n("x" * 5000)
    assert len(str(caught.value)) < 250


@pytest.mark.parametrize(
    ("text", "hz"),
    [
        ("1.1kHz", 1100.0), ("99.7kHz", 99700.0), ("1MHz", 1e6), ("999.9Hz", 999.9), ("1kHz", 1e3), ("0.001Hz", 1e-3),
        ("1500MHz", 1.5e9), ("0Hz", 0.0), ("10Hz", 10.0),
    ],
)  # fmt: skip
def test_text_of_a_frequency(text, hz):
    assert frequency_text(hz) == text


@given(st.floats(0, 1e12))
def test_text_of_a_frequency_is_read_back(hz):
    """But for the last bits of a number that a computation has left, as 3.000000000000001 MHz."""
    assert frequency_hz(frequency_text(hz)) == pytest.approx(hz, rel=1.1e-15, abs=0)


@given(st.integers(0, 10**6), st.integers(1, 10**4), st.integers(0, 300), st.integers(0, 5))
def test_a_span_against_fractions(start, step, steps, places):
    """Each value is the float next to the exact decimal: Fraction rounds once."""

    def text(k):
        return f"{k}e-{places}"

    found = values(f"{text(start)}:{text(start + steps * step)}:{text(step)}", FORCE_N)
    assert found == tuple(float(Fraction(start + k * step, 10**places)) for k in range(steps + 1))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("3", (3.0,)), (" 3 N ", (3.0,)), ("1,2,5", (1, 2, 5)), ("1, 2 , 5N", (1, 2, 5)),
        ("1,2,5mN", (1e-3, 2e-3, 5e-3)),
        ("1N,2kN", (1, 2000)), ("0:1:0.4", (0, 0.4, 0.8)), ("0:300:100mN", (0, 0.1, 0.2, 0.3)), ("2:2:1", (2,)),
        ("0N:1N:500mN", (0, 0.5, 1)), ("0:1:0.5,3", (0, 0.5, 1, 3)), ("0:1:5", (0,)), ("-1:1:1", (-1, 0, 1)),
        ("0:1:0.3333333333333333", (0, 0.3333333333333333, 0.6666666666666666, 1)),
        ("0:1:0.3333333333333334", (0, 0.3333333333333334, 0.6666666666666668, 1)),
        ("0:1:0.33", (0, 0.33, 0.66, 0.99)),
    ],
)  # fmt: skip
def test_values(text, expected):
    assert values(text, FORCE_N) == pytest.approx(expected, rel=1e-15, abs=0)
    assert values(text, FORCE_N)[-1] == expected[-1]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "'' has an empty part; expected start:stop:step as in 0:6:0.1"), ("1,", "empty part"),
        ("0::1", "empty part"), ("0:6", "'0:6': expected start:stop:step"), ("0:6:1:1", "expected start:stop:step"),
        ("0:6:0", "step above 0"), ("6:0:1", "stop not below the start"), ("2,1", "1 stands after 2; expected rising"),
        ("0:3:1,3", "3 stands twice; expected rising values, each once"),
        ("1,1.00000000000000000001", "1 stands twice"), ("1N,1000mN", "1 stands twice"), ("1,2N,3", "'1' has no unit"),
        ("1N,2", "'2' has no unit; give it to each number, or to the last one"), ("0:6N:1", "'0' has no unit"),
        ("0:nan:1", "'nan' is not a force"), ("0:1:1e-999", f"more than {MOST_VALUES} values"),
        ("1e308kN,2e308kN", "too large"), ("0:1e99:1", f"more than {MOST_VALUES} values"),
    ],
)  # fmt: skip
def test_no_values(text, said):
    with pytest.raises(BadInput, match=said):
        values(text, FORCE_N)


def test_how_many_values_there_may_be():
    assert len(values(f"1:{MOST_VALUES}:1", FORCE_N)) == MOST_VALUES
    assert len(values(f"1:{MOST_VALUES - 1}:1,{MOST_VALUES}", FORCE_N)) == MOST_VALUES
    for text in (f"0:{MOST_VALUES}:1", f"1:{MOST_VALUES}:1,{MOST_VALUES + 1}"):
        with pytest.raises(BadInput, match=f"more than {MOST_VALUES} values in all; expected fewer: use a larger step"):
            values(text, FORCE_N)
