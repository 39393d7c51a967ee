"""A whole run with a known truth, through files, clocks, drift and presses, back to force and position."""

import made
import numpy as np
import pytest
import scipy.io as sio

from sensorgen.measure.recording import rig
from sensorgen.measure.signal import drift, presses
from sensorgen.measure.signal.presses import GUARD_S, WINDOW_S
from sensorgen.prediction.identifiability.fisher import bounds, slopes
from sensorgen.prediction.inverse.estimator import Estimator

NOISE, RATE = 1e-3, 140.0
OF_A_MEAN = NOISE / np.sqrt(WINDOW_S * RATE)
MADE = made.presses(40, dwell_s=3.0, rest_s=3.0, seed=11)
FORCE_N, AT_M = np.array([m[2] for m in MADE]), np.array([m[3] for m in MADE]) * 1e-3
REST_OHM = made.sensor().impedance(made.TONES_HZ, 0.0, 0.05)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """What the two files say, joined."""
    folder = tmp_path_factory.mktemp("run")
    truth = made.run(MADE, RATE, NOISE, creep=0.02, slope_per_s=2e-5, seed=5)
    z = truth.impedance_ohm.copy()
    z[4000:4014] = 0  # a skipped block
    sio.savemat(folder / "run.mat", made.tree([z], [truth.time_s], made.stamps(truth.time_s, skew=6e-5)))
    rows = made.rig_rows(MADE, offset_s=7.25, skew=-1.5e-4)
    log = rig(made.write_rig(folder / "rig.csv", rows, errors={1000: "timeout"}))
    return made.joined(made.read(folder / "run.mat"), log)


def pressed(run, readings_ohm):
    """Pairs of the run, of other readings in place of its own."""
    one = run.recording
    spans = presses.by_force(one.time_s, run.force_n)
    return presses.pairs(one.time_s, readings_ohm, one.valid(), spans, run.force_n, run.set_position_mm)


def over_bounds(pressed_ohm, noise=OF_A_MEAN):
    """Errors of force and position over their Cramer-Rao bounds."""
    limits = bounds(slopes(made.sensor(), made.TONES_HZ, FORCE_N, AT_M), noise)
    assert np.median(limits.position_m) < 3e-3  # or it would say nothing
    found = Estimator(made.sensor(), made.TONES_HZ, noise).batch(pressed_ohm)
    return (found.force_n - FORCE_N) / limits.force_n, (found.position_m - AT_M) / limits.position_m


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def test_clocks_and_marks(run):
    counts = run.recording.counts()
    assert (counts["zero"], counts["transient"]) == (14, 23)
    middle = run.recording.time_s[-1] / 2
    assert run.clocks.offset_s == pytest.approx(7.25 + 0.03 + 6e-5 * middle, abs=3 * run.clocks.offset_error_s)
    assert run.clocks.skew == pytest.approx(6e-5 - 1.5e-4, abs=3 * run.clocks.skew_error)
    assert 3 <= counts["rig error"] <= 400


def test_force_and_position_come_back_as_well_as_they_can(run):
    one = run.recording
    found = drift.fitted(one.time_s, one.impedance_ohm, one.valid(), run.force_n)
    clean = found.removed(one.time_s, one.impedance_ohm)
    # relative to the rest: what the model of the sensor has there
    pairs = pressed(run, clean * REST_OHM / found.rest_ohm())
    assert len(pairs.time_s) == len(MADE)
    np.testing.assert_allclose(pairs.position_mm, AT_M * 1e3, atol=1e-3)  # as the rig was told
    pull_force, pull_at = over_bounds(pairs.pressed_ohm)
    assert 0.7 < rms(pull_force) < 1.5
    assert 0.7 < rms(pull_at) < 1.5
    assert np.abs(pull_force).max() < 4.5
    assert GUARD_S < 1


def test_without_taking_the_drift_out_they_do_not_but_quotients_of_pairs_are_free_of_most_of_it(run):
    """Between before and under a press drift has moved little, though more than the noise."""
    raw = pressed(run, run.recording.impedance_ohm)
    assert rms(over_bounds(raw.pressed_ohm)[0]) > 5
    noise = NOISE * np.sqrt(2 / (WINDOW_S * RATE))
    quotients = over_bounds(REST_OHM * raw.pressed_ohm / raw.before_ohm, noise)[0]
    assert rms(quotients) < rms(over_bounds(raw.pressed_ohm, noise)[0]) / 5


@pytest.mark.parametrize("law", [lambda t, _: 0.02 * (t / 60) ** 0.3, lambda t, _: 0.02 * np.sin(t / 100)])
def test_force_and_position_come_back_whatever_the_drift_follows(law):
    found = off_over_bound(law)
    assert max(found) < 1.5


@pytest.mark.parametrize("tau_s", [2.0, 60.0])
def test_what_a_film_remembers_of_the_presses_goes_out_with_its_law_and_no_other(tau_s):
    law = made.answering(0.01, tau_s)
    assert max(off_over_bound(law)) < 1.5
    assert off_over_bound(law, ["smooth"])[0] > 10


def test_what_wanders_goes_straight_from_rest_to_rest():
    law = made.walking(0.02)
    assert off_over_bound(law)[0] < 0.7 * off_over_bound(law, ["smooth"])[0]


def off_over_bound(law, among=tuple(drift.LAWS)):
    """Root mean square errors of force and position over the Cramer-Rao bound, drift fitted and taken out."""
    truth = made.run(MADE, RATE, NOISE, seed=5, law=law)
    every = np.ones(len(truth.time_s), bool)
    fit = drift.fitted(truth.time_s, truth.impedance_ohm, every, truth.force_n, among=among)
    clean = fit.removed(truth.time_s, truth.impedance_ohm) * truth.clean_ohm[0] / fit.rest_ohm()
    spans = presses.by_force(truth.time_s, truth.force_n)
    found = presses.pairs(truth.time_s, clean, every, spans, truth.force_n, truth.position_mm)
    return [rms(off) for off in over_bounds(found.pressed_ohm)]
