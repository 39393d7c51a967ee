"""Readings of a sensor that sensorgen has not made: fitted, and then inverted with what was fitted.

The readings are those of a ladder of 2000 lumped sections (``lumped_line``): capacitance and its rise with pressure
from the reference files, resistivities 1.12 times the default ones. A recording of presses is fitted; 29 other presses,
read with a noise of 0.1 %, are inverted with the fitted materials, as ratios to a reading at rest.
"""

import csv
import json

import lumped_line
import numpy as np
import pytest

from in_process import captured

COUNT, LEVEL = 29, 0.9
FACTOR = 1.12  # of the default resistivities
TOP_OHM_M, BOTTOM_OHM_M = 0.07, 0.2
COGS = 0.845677  # of the plate's resistance: a comb of period 2, teeth of base 1 and height 0.5 under 0.3, across them


@pytest.fixture
def command(capfd, monkeypatch, tmp_path):
    """Run a command in this process, in an empty folder; gives what it printed, and checks that it went well."""
    monkeypatch.chdir(tmp_path)

    def call(*words):
        said = captured(capfd, monkeypatch, *words)
        assert said.code == 0, said.err
        return said.out

    return call


def plate():
    """The plain plate, 0.6 mm of X60: film and print are the same, and B.49 is its law, at a modulus of 1 MPa."""
    return lumped_line.plate(0.6e-3, FACTOR * TOP_OHM_M, FACTOR * BOTTOM_OHM_M, modulus_pa=1e6)


def prisms():
    """Triangles on a film of 0.2 mm, as drawn: a cell and its rise under pressure from the reference files."""
    return lumped_line.tri(0.2, FACTOR * TOP_OHM_M, FACTOR * BOTTOM_OHM_M, cogs=COGS)


TRUTHS = [  # sensor, design, specimen, which body, and how many forces and positions at least are told
    pytest.param(plate, ["reference"], "30 SX60 1", [], (20, 1), id="plate"),
    pytest.param(prisms, ["tri", "--dielectric", "0.2"], "30 triX .2mm 1", ["--drawn"], (20, 15), id="prisms",
                 marks=pytest.mark.nightly),
]  # fmt: skip


@pytest.mark.parametrize("force_n", [0.0, 1.5, 6.0])
def test_the_ladder_tends_to_the_line(force_n):
    """Three uniform sections by tanh; the ladder's error falls as the square of its section."""
    line, at = prisms(), 0.0423
    rise = line.farad_ratio(force_n)
    lengths = (at - line.tip_m / 2, line.tip_m, line.length_m - at - line.tip_m / 2)
    parts = [(x, line.ohm_per_m, line.farad_per_m * k) for x, k in zip(lengths, (1, rise, 1), strict=True)]
    exact = lumped_line.closed_form(parts, lumped_line.TONES_HZ)
    errors = []
    for sections in (1000, 2000):
        z = line.impedance(lumped_line.TONES_HZ, force_n, at, sections)
        errors.append(max(np.abs(z.real / exact.real - 1).max(), np.abs(z.imag / exact.imag - 1).max()))
    assert errors[1] < 1e-7
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)


@pytest.mark.parametrize(("truth", "design", "specimen", "body", "told"), TRUTHS)
def test_force_and_position_come_back(truth, design, specimen, body, told, command, tmp_path):
    line, made = truth(), lumped_line.presses(COUNT, seed=11)
    files = lumped_line.bench_csv(tmp_path / "lcr.csv", tmp_path / "rig.csv", line, lumped_line.presses(12, seed=5))
    command("log", "bench", specimen, *files)
    command("fit", "--iteration", 30, *body)
    fitted = [*design, "--material", "electrode=etpu@fit-30", "--material", "dielectric=x60@fit-30", *body]

    predicted = json.loads(command("predict", *fitted, "--json"))
    ohm = sum(end["value"] for end in predicted["resistance"].values())
    assert ohm == pytest.approx(line.resistance_ohm, rel=0.02)  # a bench may have gains, a lead and a stray
    assert predicted["capacitance"]["value"] == pytest.approx(line.capacitance_f, rel=0.01)

    lumped_line.readings_csv(tmp_path / "m.csv", line, made, noise=1e-3)
    command("invert", fitted[0], "m.csv", *fitted[1:], "-o", "found.csv")
    with (tmp_path / "found.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["status"] != "rest"]
    statuses = [row["status"] for row in rows]
    assert len(rows) == COUNT
    assert "no fit" not in statuses
    for (name, unit), count in zip((("force", "n"), ("position", "mm")), told, strict=True):
        known = [row for row in rows if row[f"{name}_{unit}"]]
        assert len(known) >= count, statuses
        assert covered(known, name, unit) >= least(len(known))


def covered(rows, name, unit):
    """How many stated intervals hold the truth."""
    ends = (f"{name}_low_{unit}", f"{name}_high_{unit}", f"true_{name}_{unit}")
    return sum(low <= true <= high for low, high, true in ([float(row[end]) for end in ends] for row in rows))


def least(count):
    """So many of ``count`` are inside an interval of 90 % but once in a thousand times."""
    from scipy.stats import binom

    return int(binom.ppf(1e-3, count, LEVEL))
