"""The other ways to compute the line: right where they should be, and each seen to die where it does."""

from pathlib import Path

import line_abcd
import line_closed
import line_ladder
import numpy as np
import pytest
from line_cases import PLATE, TONES, cases, exact, off

from sensorgen.core.errors import OutOfRange
from sensorgen.models import line

MODELS = {"abcd": line_abcd.impedance, "exponentials": line_closed.impedance}
GRID = {"frequency_hz": np.logspace(3, 6, 7)[:, None], "left_m": np.linspace(0, 0.09, 5)}


def plate(**change):
    return line.PressedLine(**PLATE | change)


@pytest.mark.parametrize("model", MODELS)
def test_they_agree_with_the_references(model):
    for inputs, (re, im) in cases():
        z, true = MODELS[model](line.PressedLine(**inputs)), complex(float(re), float(im))
        assert abs(z - true) < 1e-12 * abs(true)
        assert abs(z.real - true.real) < 1e-9 * true.real


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    "change",
    [
        {"top_resistivity_ohm_m": 0.0, "bottom_resistivity_ohm_m": 0.0},
        {"frequency_hz": 0.0},
        {"length_m": 1e3, "frequency_hz": 1e6},
    ],
)
def test_where_they_have_no_number_they_say_so(model, change):
    with pytest.raises(OutOfRange, match="take model 'line'"):
        MODELS[model](plate(**change))
    assert not np.isnan(line.impedance(plate(**change)))


@pytest.mark.parametrize(("model", "least"), [("abcd", 1e-10), ("exponentials", 1e-6)])
def test_at_a_millihertz_they_lose_the_resistance(model, least):
    low, true = plate(frequency_hz=1e-3), exact(120, **PLATE | {"frequency_hz": 1e-3})
    assert off(MODELS[model](low), true)[1] > least
    assert off(line.impedance(low), true)[1] < 1e-13


@pytest.mark.parametrize("far_end", ["short", 100.0, [10.0, 1e6]])
def test_matrices_speak_of_other_far_ends(far_end):
    a, b = (model(plate(far_end=far_end)) for model in (line_abcd.impedance, line.impedance))
    assert a == pytest.approx(b, rel=1e-12)


def test_the_misprints_and_their_effect():
    free = plate(**GRID, force_n=0.0)
    z = line.impedance(free)
    assert line_closed.impedance(free) == pytest.approx(z, rel=1e-12)
    assert np.broadcast_to(line_closed.uniform(free), z.shape) == pytest.approx(z, rel=1e-12)
    one = plate(force_n=0.0, tip_m=0.0, left_m=0.0)
    z = line.impedance(one)
    for printed, wrong in (("B.48", z / np.sqrt(0.135)), ("B.39", -z), ("B.42", z)):
        assert line_closed.impedance(one, printed) == pytest.approx(wrong, rel=1e-12)


def test_the_table_of_misprints():
    text = (Path(__file__).parents[2] / "bench" / "results" / "line.md").read_text("utf-8")
    rows = [[cell.strip() for cell in row.split("|")[1:-1]] for row in text.splitlines() if row.startswith("| B.")]
    rows = [row for row in rows if ".." in row[-1]]
    assert [(row[0], float(row[1])) for row in rows] == [(p, f) for p in line_closed.PRINTED for f in TONES]
    places = {"force_n": np.linspace(0, 6, 5)[:, None], "left_m": np.linspace(0, 0.09, 5)}
    for printed, hertz, *spans in rows:
        inputs = plate(**places, frequency_hz=float(hertz))
        z, wrong = line.impedance(inputs), line_closed.impedance(inputs, printed)
        ratios = (np.abs(wrong / z - 1), wrong.real / z.real, wrong.imag / z.imag)
        for ratio, span in zip(ratios, spans, strict=True):
            assert [float(v) for v in span.split("..")] == pytest.approx([ratio.min(), ratio.max()], rel=6e-3)


def test_a_resistor_before_a_capacitor_is_no_line():
    low, true = line_closed.series(plate(frequency_hz=1e3)), line.impedance(plate(frequency_hz=1e3, force_n=0.0))
    assert (low.real, low.imag) == pytest.approx((3 * true.real, true.imag), rel=1e-4)


@pytest.mark.parametrize(("one_sided", "order"), [(False, 2), (True, 1)])
def test_ladders_converge_at_their_order(one_sided, order):
    true, given = line.impedance(plate(**GRID)), plate(**GRID)
    for part in (np.abs, np.real):
        errors = [
            np.abs(part(line_ladder.impedance(given, n, one_sided=one_sided) - true)).max() for n in (40, 80, 160)
        ]
        rates = np.log2(np.array(errors[:-1]) / errors[1:])
        assert rates == pytest.approx(order, abs=0.05)


def test_a_ladder_dies_where_its_cells_are_longer_than_the_current_reaches():
    high = plate(frequency_hz=1e9)
    assert abs(line_ladder.impedance(high, 10) / line.impedance(high) - 1) > 0.1
