"""Verdicts follow from numbers: by hand, one rule at a time."""

import numpy as np
import pytest

from sensorgen.verification.thesis.documents import number, our_values, thesis_values
from sensorgen.verification.thesis.items import (
    DIFFERS,
    MISPRINT,
    TRANSCRIBED,
    UNEXPLAINED,
    ItemPart,
    ThesisItem,
    digits,
    judged,
    share,
)


def expected_of(**announced):
    return ThesisItem(number="1.1", says="It says something.", **announced)


def part(printed, ours=1.0, corrected=None, name="x", **more):
    return ItemPart(name, "m", ours, printed, corrected, **more)


def word(*parts, **expected):
    return judged(expected_of(**expected), parts).word


def test_what_agrees_agrees_by_its_worst_part():
    assert judged(expected_of(tolerance=1e-3), [part(1.0), part(1.0005)]).text() == "agrees to 3 digits"
    assert word(part(1.0), part(1.01), tolerance=1e-3) == UNEXPLAINED


def test_a_misprint_needs_a_correction_that_agrees_and_words():
    assert word(part(2.0, corrected=1.0), erratum="said") == MISPRINT
    assert word(part(2.0, corrected=1.0)) == UNEXPLAINED
    assert word(part(2.0, corrected=1.5), erratum="said") == UNEXPLAINED
    assert word(part(2.0, corrected=1.0), part(2.0), erratum="said") == UNEXPLAINED
    assert word(part(2.0, corrected=1.0), part(1.0), erratum="said") == MISPRINT


def test_an_announced_misprint_that_is_none_is_unexplained():
    assert word(part(1.0, corrected=1.0), erratum="said") == UNEXPLAINED
    assert word(part(1.0), because="so", off={"x": 0.5}, within=0.1) == UNEXPLAINED


def test_a_difference_is_as_large_as_announced():
    known = {"because": "so", "within": 0.01}
    assert word(part(1.5), **known, off={"x": 0.5}) == DIFFERS
    assert word(part(1.5), **known, off={"x": 0.52}) == UNEXPLAINED
    assert word(part(0.5), **known, off={"x": 0.5}) == UNEXPLAINED  # the other way round
    assert word(part(1.5), part(1.5, name="y"), **known, off={"x": 0.5}) == UNEXPLAINED
    assert word(part(1.5), off={"x": 0.5}, within=0.01) == UNEXPLAINED  # no reason


def test_what_was_typed_on_both_sides_confirms_nothing():
    typed = part(1.0, copied=True)
    assert judged(expected_of(), [typed, typed]).text() == "transcribed (2 values, which nothing else gives)"
    assert judged(expected_of(), [part(1.0), typed]).text() == "agrees to 9 digits or more; transcribed: 1"
    assert word(typed, part(None)) == TRANSCRIBED


def test_a_wrong_copy_is_never_announced_away():
    typed = part(1.5, copied=True, corrected=1.0)
    assert word(typed) == word(typed, erratum="said") == UNEXPLAINED
    assert word(part(1.5, copied=True), because="so", off={"x": 0.5}, within=0.1) == UNEXPLAINED


def test_a_limit_agrees_with_anything_below():
    assert judged(expected_of(), [part(2.0, limit=True)]).text() == "agrees with the limit"
    assert word(part(0.9, limit=True)) == UNEXPLAINED
    assert word(part(2.0, ours=np.nan, limit=True)) == UNEXPLAINED
    assert thesis_values([part(2.0, limit=True)], 1e-6) == ["x: at most 2 m"]


def test_what_is_announced_of_many_times_as_much_is_relative():
    known = {"because": "so", "within": 0.01, "off": {"x": 999.0}}
    assert judged(expected_of(**known), [part(1005.0)]).word == DIFFERS
    assert judged(expected_of(**known), [part(1011.0)]).word == UNEXPLAINED


def test_no_number_is_never_agreement():
    assert word(part(np.nan)) == UNEXPLAINED
    assert word(part(1.0, ours=np.nan)) == UNEXPLAINED
    assert word(part(np.nan, corrected=1.0), erratum="said") == MISPRINT
    assert word(part(np.nan, corrected=np.nan), erratum="said") == UNEXPLAINED
    assert "no number" in judged(expected_of(), [part(np.nan)]).text()


def test_distances():
    assert part(1.5).off() == pytest.approx(0.5)
    assert part(0.5).off() == pytest.approx(-0.5)
    assert part(1j, ours=1.0).off() == pytest.approx(2**0.5)
    assert part([1.0, 0.1], ours=[1.0, 0.0]).off() == pytest.approx(0.1)  # by the largest of all
    assert part(1e-9, ours=0.0, scale=1.0).off() == pytest.approx(1e-9)
    assert part(1e-9, ours=0.0).off() == np.inf
    assert part(0.0, ours=0.0).off() == 0
    assert part(None).off() == 0
    assert ItemPart("x", "", 5, 2 + 3).off() == 0


@pytest.mark.parametrize(("off", "said"), [(0.5, "0 digits"), (0.09, "1 digit"), (9e-10, "9 digits or more")])
def test_digits(off, said):
    assert digits(off) == said


@pytest.mark.parametrize(("off", "said"), [(2.0, "3 times as much"), (1.99, "199 % more"), (-0.5, "50 % less")])
def test_shares(off, said):
    assert share(off) == said


@pytest.mark.parametrize(
    ("values", "unit", "said"),
    [
        (0.0, "V", "0 V"),
        (-35e-6, "m", "−35 µm"),
        (999.9999999999999, "ohm", "1 kohm"),
        (2.5e-4, "kg/m3", "0.00025 kg/m3"),
        (200.0, "°C", "200 °C"),
        (1e-20 + 3j, "", "3j"),
        ([1.0, 1e-15], "A", "1, 0 A"),
        ([1j, 2j, 3j, 4j], "S", "1j … 4j S (4 values)"),
        ([np.nan, np.nan], "m", "no number"),
        ([np.nan, 2.0], "m", "no number, 2 m"),
    ],
)
def test_numbers_in_words(values, unit, said):
    assert number(values, unit) == said


def test_of_many_parts_those_that_differ_are_shown():
    many = [part(1.0, name=f"p{k}") for k in range(9)] + [part(2.0, corrected=1.0, name="bad")]
    assert thesis_values(many, 1e-6) == ["bad: 2 m; corrected 1 m"]
    assert our_values(many, 1e-6) == ["bad: 1 m", "9 more values that agree"]
    assert len(our_values(many[:9], 1e-6)) == 4


def test_what_rounding_leaves_is_nothing_beside_ours():
    assert thesis_values([part(3e-13, ours=1.9)], 1e-6) == ["x: 0 m"]
    assert our_values([part(0.0, ours=2e-16j, scale=1.0)], 1e-6) == ["x: 0 m"]
    assert thesis_values([part(3e-8, ours=1.9)], 1e-6) == ["x: 30 nm"]
