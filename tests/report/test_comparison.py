"""What is compared: a leaking film against resistors, bounds of electrodes, and where predictions come from."""

import dataclasses
import json
from math import inf, log, nan, sqrt

import mpmath
import numpy as np
import pytest
from bench_files import ladder
from line_cases import PLATE as LINE_PLATE

from no_numbers import roughly_at_rest
from sensorgen.analysis.comparison import of_iteration
from sensorgen.analysis.comparison.expected import Movable, at_rest, moved, predicted, pressed, stored_or_made
from sensorgen.analysis.report import origins
from sensorgen.core.bounds import Interval
from sensorgen.core.errors import OutOfRange
from sensorgen.design.design import make
from sensorgen.design.specimen_name import design_of, parse
from sensorgen.measure.log import Log, notes, verify
from sensorgen.measure.log.prints import prediction
from sensorgen.measure.signal.verdicts import across_ohm, along_ohm, electrode_and_leak, leak_s
from sensorgen.models import line
from sensorgen.models.compression import unconfined
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.bodies import default_body, drawn
from sensorgen.prediction.evaluate import evaluate
from sensorgen.prediction.plan import without_times
from sensorgen.prediction.results import to_json


@pytest.mark.parametrize("leak", [1e-5, 2e-2])
@pytest.mark.parametrize("other", [1.0, 2.5])
def test_what_a_meter_reads_of_a_leaking_film(leak, other):
    """Of two electrodes, the other one with ``other`` times the resistance, against a ladder of 400 rungs."""
    along, across = ladder(700.0, leak, 400, other)
    assert along_ohm(700.0, leak, other) == pytest.approx(along, rel=1e-4)
    assert across_ohm(700.0 * (1 + other) / 2, leak) == pytest.approx(across, rel=1e-4)
    assert electrode_and_leak(along, across, other) == pytest.approx((700.0, leak), rel=1e-3)


def test_a_reading_is_of_one_electrode_of_both_in_parallel_or_in_between():
    """1 and 3 kohm, by hand: 0.75 kohm in parallel. The range of a film without a reading holds all of it."""
    found = predicted(drawn(make({"shape": "tri"})))
    ends = {name: dataclasses.replace(r, value=ohm, lower=ohm, upper=ohm, model=Interval(ohm, ohm),
                                      print=Interval(ohm, ohm), material=Interval(ohm, ohm), leads=None)
            for (name, r), ohm in zip(found.prediction.resistance.items(), (1000.0, 3000.0), strict=True)}  # fmt: skip
    found = dataclasses.replace(found, prediction=dataclasses.replace(found.prediction, resistance=ends))
    short, tight, unknown = (found.along_ohm(rz) for rz in (0.0, inf, nan))
    assert (short.lower, short.value, short.upper) == pytest.approx((750.0,) * 3)
    assert (tight.lower, tight.value, tight.upper) == pytest.approx((1000.0, sqrt(3e6), 3000.0))
    assert (unknown.lower, unknown.value, unknown.upper) == pytest.approx((750.0, sqrt(3e6), 3000.0))
    leaking = found.along_ohm(ladder(1000.0, 2e-3, 400, 3.0)[1])
    ends = ladder(1000.0, 2e-3, 400, 3.0)[0], ladder(3000.0, 2e-3, 400, 1 / 3)[0]
    assert (leaking.lower, leaking.upper) == pytest.approx(ends, rel=1e-4)
    assert leaking.value == pytest.approx(sqrt(ends[0] * ends[1]), rel=1e-4)


@pytest.mark.parametrize("leak", [0.0, 1e-12, 1e-3, 1e3, inf])
def test_electrode_and_leak_come_back(leak):
    found = electrode_and_leak(along_ohm(700.0, leak), across_ohm(700.0, leak))
    assert found == (pytest.approx(700.0, rel=1e-9), pytest.approx(leak, rel=1e-6, abs=0))


def test_limits_of_a_leak():
    assert (along_ohm(600.0, 0.0), across_ohm(600.0, 0.0)) == (600.0, inf)
    assert along_ohm(600.0, 1e12) == pytest.approx(300.0, rel=1e-5)
    assert across_ohm(600.0, 1e-9) == pytest.approx(1e9 + 400, rel=1e-12)
    for bad in ((0.0, 1.0), (inf, 1.0), (1.0, -1.0), (float("nan"), 1.0)):
        with pytest.raises(OutOfRange, match="above 0"):
            electrode_and_leak(*bad)


def test_a_plain_electrode_has_its_own_resistance_and_the_spread_of_the_sources():
    """rho L / (H W), by hand; prints of Table D.1: 0.042 ohm m, 95 % of them from 0.02 to 0.088."""
    design = make({"shape": "reference"})
    p = design.params
    squares = p.length_mm / (p.electrode_mm * p.width_mm) * 1e3
    found = predicted(default_body(design)).ry_ohm
    # prints differ by 0.02 to 0.088 ohm m; contacts of two wires add up to 4.3 kohm
    assert (found.lower, found.upper) == (pytest.approx(0.02 * squares), pytest.approx(0.088 * squares + 4300))
    assert found.alone().upper == pytest.approx(0.088 * squares)
    assert found.value == pytest.approx(0.042 * squares)


def test_the_earliest_stored_prediction_is_taken_as_it_was(tmp_path):
    """In the JSON of version 0.1.0, which held the drawing alone."""
    design = design_of(parse("40 triX .1mm"))
    tuned = {"electrode_resistance_ohm": {"top": 1.0, "bottom": 2.0}}
    first = {"electrode_resistance_ohm": {"top": 1000.0, "bottom": 3000.0}}
    with Log(tmp_path / "log.db", create=True) as book:
        book.add([prediction(design.id(), design.name, data) for data in (first, tuned)])
        book.add([notes.reading("40 triX .1mm", "0.65k", "40")])
        row = of_iteration(book, 40).rows[0]
    assert row.predicted.ry_ohm.upper == 3000.0
    assert row.predicted.stored_at
    assert row.predicted.provenance.startswith("stored ")
    assert row.predicted.ry_ohm.value == pytest.approx(sqrt(1000.0 * 3000.0))
    assert row.residual == pytest.approx(log(650 / sqrt(755.0 * 795.0)), abs=1e-3)  # q = 100, by hand
    afterwards = predicted(default_body(make({"shape": "reference"})))
    assert not afterwards.stored_at
    assert "made afterwards" in afterwards.provenance


def test_an_anchor_after_a_prediction_is_shown_with_it(tmp_path):
    design, other = design_of(parse("40 triX .1mm")), design_of(parse("40 triY .1mm"))
    data = {"electrode_resistance_ohm": {"top": 1000.0, "bottom": 3000.0}}
    with Log(tmp_path / "log.db", create=True) as book:
        book.add([prediction(design.id(), design.name, data), prediction("x" * 16, "another", data)])
        verify.anchor(book, tmp_path / "heads.txt")
        verify.anchor(book, tmp_path / "later.txt")
        book.add([prediction(other.id(), other.name, data)])
        book.add([notes.reading("40 triX .1mm", "0.65k", "40"), notes.reading("40 triY .1mm", "0.65k", "40")])
        found = of_iteration(book, 40)
        table = origins(book, found)
    dated = (tmp_path / "heads.txt").read_text()[:10]
    said = {p.design: p.provenance for p in found.predictions.values()}
    assert f"anchored {dated}T" in said[design.name]
    assert said[design.name].endswith(" in heads.txt, 1 record later")
    assert "anchored" not in said[other.name]  # no anchor was made after it
    assert [row.name for row in table.rows if row.kind == "anchor"] == ["heads.txt", "later.txt"]


def test_leakage_by_newton_is_that_of_halving_in_50_digits():
    """Over 30 decades of R_Z over R."""
    mpmath.mp.dps = 50
    for ratio in np.geomspace(1e-12, 1e18, 61):
        wanted, low, high = 2 / mpmath.mpf(float(ratio)), mpmath.mpf("1e-12"), mpmath.mpf("1e14")
        while high / low > 1 + mpmath.mpf("1e-30"):
            middle = mpmath.sqrt(low * high)
            low, high = (low, middle) if middle * mpmath.tanh(middle) > wanted else (middle, high)
        exact = float(low**2 / 2 / 700)
        assert leak_s(700.0 * ratio, 700.0) == pytest.approx(exact, rel=5e-15, abs=0), ratio


def test_corrected_readings_count_for_nothing_and_are_told(tmp_path):
    with Log(tmp_path / "log.db", create=True) as book:
        old = book.add([notes.reading("40 triX .1mm", "65", "40")])[0]
        book.add([notes.reading("40 triX .1mm", "0.65k", "40", supersedes=old.uid)])
        found = of_iteration(book, 40)
    assert [row.verdict.ry_ohm for row in found.rows] == [650.0]
    assert ("reading 1, 40 triX .1mm", "a later reading corrects it") in found.left_out


def test_readings_below_nought_and_blanks_are_left_out_and_told(tmp_path):
    with Log(tmp_path / "log.db", create=True) as book:
        book.add([notes.reading("40 triX .1mm", "-650", "40"), notes.reading("40 triX .2mm", "650", "")])
        book.add([notes.reading("40 tri .1mm", "650", "40")])
        found = of_iteration(book, 40)
    told = dict(found.left_out)
    assert "below 0" in " ".join(told.values())
    assert any("no R_Z" in why for why in told.values())
    assert "stands for no design" in told["design of 40 tri .1mm"]
    assert found.rows[2].predicted is None
    assert np.isnan(found.rows[0].residual)


PLATE = Sensor(0.1, 0.01, (3e-4, 3e-4), (5.0, 5.0), 7.6e-10, unconfined(6e5))
TONES = np.array([1.1e3, 10.1e3, 99.7e3])


def test_moved_parameters_are_those_of_the_line():
    """Straight from the line's formula, with the parameter itself changed."""
    other = moved(PLATE, 2.0, 1.5, 1e-6)
    changes = {"top_resistivity_ohm_m": 10.0, "bottom_resistivity_ohm_m": 10.0, "leak_s_per_m": 1e-5}
    film = {"film_m": 8.8541878128e-12 * 0.01 / (7.6e-10 * 1.5), "eps_r": 1.0, "modulus_pa": 6e5}
    z = line.impedance(line.PressedLine(**LINE_PLATE | changes | film | {"force_n": 0.0, "frequency_hz": TONES}))
    assert np.exp(at_rest(other, TONES)) == pytest.approx(z, rel=1e-9)


def test_a_stiffer_film_is_one_with_another_modulus():
    stiff = Sensor(**{**vars(PLATE), "compression": unconfined(12e5)})
    force, at = np.array([2.0, 6.0]), np.array([0.03, 0.06])
    expected = np.log(stiff.impedance(TONES, force[:, None], at[:, None]) / stiff.impedance(TONES, 0.0, 0.05))
    assert pressed(PLATE, TONES, force, at, 2.0) == pytest.approx(expected, rel=1e-9)


def test_permittivity_and_film_move_a_plate_in_proportion():
    """C of a solid plate is eps A / d."""
    of = Movable(default_body(make({"shape": "reference"})))
    factors, curve = of.by_permittivity
    assert curve == pytest.approx(factors, abs=1e-9)
    assert of.by_film[1] == pytest.approx(-factors, abs=1e-9)


def test_the_film_of_a_cell_moves_less_than_in_proportion_and_thicker_is_less():
    factors, curve = Movable(default_body(make({"shape": "tri", "parameters": {"dielectric_mm": 0.1}}))).by_film
    assert (np.diff(curve) < 0).all()
    assert (np.abs(curve) <= np.abs(factors) + 1e-9).all()


def test_stored_predictions_are_plain_data(tmp_path):
    design = make({"shape": "reference"})
    found = evaluate(drawn(design))
    row = prediction(design.id(), design.name, json.loads(to_json(found)))
    with Log(tmp_path / "log.db", create=True) as book:
        (logged,) = book.add([row])
        kept = stored_or_made(default_body(design), book, [logged], [], [])
    assert json.loads(row.data)["capacitance"]["lower"] == kept.prediction.capacitance.lower
    assert kept.prediction == dataclasses.replace(found, plan=without_times(found.plan))  # stored without run times


def compared(folder, *rows):
    with Log(folder / "log.db", create=True) as book, roughly_at_rest():
        book.add(rows)
        return of_iteration(book, 60)


@pytest.mark.parametrize("first", ["y", "z"])
def test_two_readings_of_one_resistance_each_make_one_verdict(first, tmp_path):
    """A meter with two leads logs R_Y and R_Z one after the other; the verdict is that of both in one reading."""
    kinds = {"y": ("1.2k", ""), "z": ("", "OL")}
    other = "z" if first == "y" else "y"
    apart = compared(tmp_path, *(notes.reading("60 SX60 2", *kinds[axis]) for axis in (first, other)))
    (tmp_path / "whole").mkdir()
    whole = compared(tmp_path / "whole", notes.reading("60 SX60 2", "1.2k", "OL"))
    assert [row.verdict.word for row in apart.rows] == ["intact", "intact"] == [whole.rows[0].verdict.word] * 2
    assert [row.verdict.word for row in apart.last] == ["intact"]
    assert sum(np.isfinite(row.residual) for row in apart.rows) == 1  # R_Y was read once
    assert not [why for _, why in apart.left_out if "counts for nothing" in why]


def test_a_bake_parts_readings(tmp_path):
    before, after = notes.reading("60 SX60 2", "1.2k", baked=False), notes.reading("60 SX60 2", "", "OL", baked=True)
    assert {row.verdict.word for row in compared(tmp_path, before, after).rows} == {"unknown"}


def test_four_wires_read_an_electrode_without_leads(tmp_path):
    four = dataclasses.replace(notes.reading("60 SX60 2", "3k", "OL"), wires=4)
    row, other = compared(tmp_path, four, notes.reading("60 SX60 3", "3k", "OL")).rows
    assert row.expected_ohm.upper == row.predicted.along_ohm(inf).alone().upper < other.expected_ohm.upper
