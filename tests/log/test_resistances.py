"""Resistances as people write them: every form, its value, and what to doubt of it."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sensorgen.core.errors import BadInput
from sensorgen.measure.log.notes import MOST_OHM, OVERLOAD, parse

PLAIN = {
    "650": 650.0, "0.65k": 650.0, ".65k": 650.0, "0,65k": 650.0, "0.65 kΩ": 650.0, "0.65kohm": 650.0, "650 Ohms": 650.0,
    "650R": 650.0, "6.5e2": 650.0, "+6.50000000E+02": 650.0, "650\u2126": 650.0, " 650 ": 650.0, "1.13k": 1130.0,
    "39.3k": 39300.0, "0.435k": 435.0, "13.6": 13.6, "1.2M": 1.2e6, "1.2 MΩ": 1.2e6, "1.2 Meg": 1.2e6, "3G": 3e9,
    "4k7": 4700.0, "4R7": 4.7, "1M2": 1.2e6, "1": 1.0, "OL": OVERLOAD, "+9.9E37": OVERLOAD,
}  # fmt: skip
DOUBTFUL = {
    "0.9K": (900.0, "K read as kilo"),
    "1.1m": (1.1e6, "m read as mega"),
    "12 mΩ": (12e6, "m read as mega"),
    "0": (0.0, "short circuit, or a reading below"),
    "0.27": (0.27, "a k lost?"),
    "\u22123": (-3.0, "below 0"),
    "1,300": (1.3, "thousands would be 1300 ohm"),
    "O.L": (OVERLOAD, "taken for overload"),
    ">50M": (OVERLOAD, "taken for overload"),
    "∞": (OVERLOAD, "taken for overload"),
}
NONE = [
    "abc", "1.2.3", "650, 700", "k", "m", "1,300.5", "5 /", "/", "µ5", "5µ", "1e17", "1e999", "1e99", "--5", "9" * 201,
    "5 V", "=1+1", "0x10", "1_000", "__import__('os')", "650 650", "1k2k", "e5", "5²", "１２",
]  # fmt: skip


@pytest.mark.parametrize(("words", "ohm"), PLAIN.items())
def test_plain_values_leave_no_doubt(words, ohm):
    assert (parse(words).ohm, parse(words).doubts) == ((ohm,), ())


@pytest.mark.parametrize(("words", "ohm", "doubt"), [(w, *found) for w, found in DOUBTFUL.items()])
def test_doubtful_values_are_taken_and_flagged(words, ohm, doubt):
    found = parse(words)
    assert found.ohm == (ohm,)
    assert len(found.doubts) == 1
    assert doubt in found.doubts[0]


@pytest.mark.parametrize("words", NONE)
def test_what_is_no_resistance_is_refused(words):
    with pytest.raises(BadInput, match="expected a resistance such as 650"):
        parse(words)


def test_several_readings_are_several():
    found = parse("0.5k / 1k;1.3k")
    assert found.ohm == (500.0, 1000.0, 1300.0)
    assert found.doubts == ("3 readings: repeats, or several points of contact",)
    assert parse("5k / 0").ohm == (5000.0, 0.0)
    assert parse("5k / 6k").doubts == ("2 readings: repeats, or several points of contact",)


@pytest.mark.parametrize("words", ["", " \t", "-", "–", "n/a", "NaN", "?"])
def test_blanks_and_words_for_nothing_are_no_reading_and_not_zero(words):
    assert parse(words).ohm == ()
    assert ["taken for no reading" in doubt for doubt in parse(words).doubts] == [True] * bool(words.strip())


def test_each_m_is_named_so_that_somebody_can_be_asked():
    assert parse("1.1m / 2k / 0.3 m").mega == ("1.1m", "0.3 m")
    assert parse("1.1M").mega == ()


@given(st.floats(1, MOST_OHM))
def test_what_a_program_prints_is_read_as_the_very_same(ohm):
    assert parse(repr(ohm)).ohm == (ohm,)


@given(st.integers(1, 9999), st.sampled_from([("k", 1000), ("M", 10**6), ("", 1)]))
def test_prefixes_multiply_exactly(number, prefix):
    letter, factor = prefix
    assert parse(f"{number / 1000!r}{letter}").ohm[0] == pytest.approx(number * factor / 1000, rel=1e-15)
    assert parse(f"{number}{letter}").ohm == (float(number * factor),)


@settings(max_examples=60)
@given(st.text(max_size=60) | st.text("0123456789kKmM.,/; ΩeE+-OL", max_size=12))
def test_any_text_is_read_or_refused(words):
    try:
        found = parse(words)
    except BadInput:
        return
    assert all(not math.isnan(ohm) for ohm in found.ohm)


@pytest.mark.parametrize("words", [">2k", "> 9.9M", "> banana", ">", ">nothing"])
def test_a_lower_bound_within_the_range_of_a_meter_is_no_overload(words):
    with pytest.raises(
        BadInput, match=r"lower bound; expected what the meter showed, or OL|expected a resistance such"
    ):
        parse(words)
    assert parse(">10M").ohm == (OVERLOAD,)


def test_repeats_that_are_far_apart_are_doubted():
    assert parse("2.3/3.8k").ohm == (2.3, 3800.0)
    assert "'2.3/3.8k': more than 100 times apart; a k lost?" in parse("2.3/3.8k").doubts
    assert len(parse("750 / 1.2k / OL").doubts) == 1
