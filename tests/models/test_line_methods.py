"""The other ways to compute the line, which the benchmarks compare it with: right where they should be."""

from pathlib import Path

import line_abcd
import line_closed
import line_ladder
import numpy as np
import pytest
from line_cases import PLATE, TONES, cases

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


@pytest.mark.parametrize(("one_sided", "order"), [(False, 2), (True, 1)])
def test_ladders_converge_at_their_order(one_sided, order):
    true, given = line.impedance(plate(**GRID)), plate(**GRID)
    for part in (np.abs, np.real):
        errors = [
            np.abs(part(line_ladder.impedance(given, n, one_sided=one_sided) - true)).max() for n in (40, 80, 160)
        ]
        rates = np.log2(np.array(errors[:-1]) / errors[1:])
        assert rates == pytest.approx(order, abs=0.05)
