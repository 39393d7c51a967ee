"""The other ways to compute the line: right where they should be, and each seen to die where it does."""

from pathlib import Path

import line_abcd
import line_closed
import line_ladder
import numpy as np
import pytest
from line_cases import PLATE, TONES, cases, exact, off

from sensorgen.core.errors import OutOfRange, UnknownName
from sensorgen.models import line

MODELS = {"abcd": line_abcd.impedance, "exponentials": line_closed.impedance}
LONG = PLATE | {"length_m": 1e3, "frequency_hz": 1e6}
GRID = PLATE | {"frequency_hz": np.logspace(3, 6, 7)[:, None], "left_m": np.linspace(0, 0.09, 5)}


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
        MODELS[model](line.PressedLine(**PLATE | change))
    assert not np.isnan(line.impedance(line.PressedLine(**PLATE | change)))


@pytest.mark.parametrize(("model", "least"), [("abcd", 1e-10), ("exponentials", 1e-6)])
def test_at_a_millihertz_they_lose_the_resistance(model, least):
    low = PLATE | {"frequency_hz": 1e-3}
    true = exact(120, **low)
    assert off(MODELS[model](line.PressedLine(**low)), true)[1] > least
    assert off(line.impedance(line.PressedLine(**low)), true)[1] < 1e-13


@pytest.mark.parametrize("far_end", ["short", 100.0, [10.0, 1e6]])
def test_matrices_speak_of_other_far_ends(far_end):
    a, b = (model(line.PressedLine(**PLATE, far_end=far_end)) for model in (line_abcd.impedance, line.impedance))
    assert a == pytest.approx(b, rel=1e-12)
    for other in (line_closed.impedance, line_ladder.impedance):
        with pytest.raises(OutOfRange, match="open"):
            other(line.PressedLine(**PLATE, far_end=far_end))


def test_the_misprints_and_their_effect():
    free = GRID | {"force_n": 0.0}
    z = line.impedance(line.PressedLine(**free))
    assert line_closed.impedance(line.PressedLine(**free)) == pytest.approx(z, rel=1e-12)
    assert np.broadcast_to(line_closed.uniform(line.PressedLine(**free)), z.shape) == pytest.approx(z, rel=1e-12)
    one = PLATE | {"force_n": 0.0, "tip_m": 0.0, "left_m": 0.0}
    z = line.impedance(line.PressedLine(**one))
    assert line_closed.impedance(line.PressedLine(**one), "B.48") == pytest.approx(z / np.sqrt(0.135), rel=1e-12)
    assert line_closed.impedance(line.PressedLine(**one), "B.39") == pytest.approx(-z, rel=1e-12)
    assert line_closed.impedance(line.PressedLine(**one), "B.42") == pytest.approx(z, rel=1e-12)
    with pytest.raises(UnknownName, match=r"B\.48"):
        line_closed.impedance(line.PressedLine(**one), "B.47")


def test_the_table_of_misprints():
    text = (Path(__file__).parents[2] / "bench" / "results" / "line.md").read_text("utf-8")
    rows = [[cell.strip() for cell in row.split("|")[1:-1]] for row in text.splitlines() if row.startswith("| B.")]
    rows = [row for row in rows if ".." in row[-1]]
    assert [(row[0], float(row[1])) for row in rows] == [(p, f) for p in line_closed.PRINTED for f in TONES]
    places = {"force_n": np.linspace(0, 6, 5)[:, None], "left_m": np.linspace(0, 0.09, 5)}
    for printed, hertz, *spans in rows:
        inputs = PLATE | places | {"frequency_hz": float(hertz)}
        z, wrong = (
            line.impedance(line.PressedLine(**inputs)),
            line_closed.impedance(line.PressedLine(**inputs), printed),
        )
        ratios = (np.abs(wrong / z - 1), wrong.real / z.real, wrong.imag / z.imag)
        for ratio, span in zip(ratios, spans, strict=True):
            assert [float(v) for v in span.split("..")] == pytest.approx([ratio.min(), ratio.max()], rel=6e-3)


def test_a_resistor_before_a_capacitor_is_no_line():
    low = line_closed.series(line.PressedLine(**PLATE | {"frequency_hz": 1e3}))
    assert low.real == pytest.approx(
        3 * line.impedance(line.PressedLine(**PLATE | {"frequency_hz": 1e3, "force_n": 0.0})).real, rel=1e-4
    )
    assert low.imag == pytest.approx(
        line.impedance(line.PressedLine(**PLATE | {"frequency_hz": 1e3, "force_n": 0.0})).imag, rel=1e-4
    )


@pytest.mark.parametrize(("one_sided", "order"), [(False, 2), (True, 1)])
def test_ladders_converge_at_their_order(one_sided, order):
    true = line.impedance(line.PressedLine(**GRID))
    for part in (np.abs, np.real):
        errors = [
            np.abs(part(line_ladder.impedance(line.PressedLine(**GRID), n, one_sided=one_sided) - true)).max()
            for n in (40, 80, 160)
        ]
        rates = np.log2(np.array(errors[:-1]) / errors[1:])
        assert rates == pytest.approx(order, abs=0.05)


def test_a_ladder_dies_where_its_cells_are_longer_than_the_current_reaches():
    high = PLATE | {"frequency_hz": 1e9}
    assert abs(line_ladder.impedance(line.PressedLine(**high), 10) / line.impedance(line.PressedLine(**high)) - 1) > 0.1
    with pytest.raises(OutOfRange, match="no current"):
        line_ladder.impedance(line.PressedLine(**PLATE | {"frequency_hz": 0.0}))
    with pytest.raises(OutOfRange, match="one cell"):
        line_ladder.impedance(line.PressedLine(**PLATE), 0)
