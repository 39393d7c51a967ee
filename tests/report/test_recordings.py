"""Findings of recordings at rest: what lies outside its predicted range, and what is simulated."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from sensorgen.analysis.report.recordings import ImpedanceRow, findings, headline

ROW = ImpedanceRow(
    "S1, recording 1", "tri", 1100.0, 3000.0, 10.0, 2900.0, 1500.0, 4000.0, -2e6, 100.0, -2e6, -2.2e6, -1.8e6,
    0.0, 0.0, 0.1, "capacitor", 72.0, 72.0, 60.0, 80.0,
)  # fmt: skip


def said(*rows):
    return " ".join(findings([SimpleNamespace(name="S1, recording 1", pairs=object())], rows))


@pytest.mark.parametrize(("changes", "flagged"), [
    ({}, ""), ({"r_ohm": 22830.0}, "by its R at 1.1"), ({"r_ohm": 1400.0}, "by its R at 1.1"),
    ({"r_ohm": 4025.0}, ""), ({"x_ohm": -1.7e6}, "by its X at 1.1"),
    ({"r_ohm": 9e3, "x_ohm": -3e6}, "by its R at 1.1kHz and X at 1.1"),
    ({"r_ohm": 9e3, "r_from_ohm": None, "r_to_ohm": None}, ""),
])  # fmt: skip
def test_what_is_outside_its_predicted_range_is_flagged(changes, flagged):
    found = said(replace(ROW, **changes))
    assert (f"Flagged: S1, recording 1 is outside the predicted range {flagged}" in found) is bool(flagged)


def test_the_headline_says_what_is_simulated():
    own, made = ROW, replace(ROW, recording="S1, recording 2, simulated")
    assert "measured 0 % of" in next(headline([own]))
    assert "simulated 0 % of" in next(headline([made]))
    said = "measured 0 % of |Z| off the prediction (median of 2 frequencies in 2 recordings, 1 of them simulated)"
    assert said in next(headline([own, made]))
