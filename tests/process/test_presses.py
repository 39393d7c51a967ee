"""Presses, pairs, drift, hysteresis and surfaces of runs whose truth is known."""

from dataclasses import replace

import made
import numpy as np
import pytest
from made import joined

from sensorgen.core.errors import BadInput, UnknownName
from sensorgen.measure.recording import Recording, RecordingClock, RigLog, Source
from sensorgen.measure.recording.samples import blank
from sensorgen.measure.signal import drift, presses
from sensorgen.measure.signal.presses import normalised, surface
from sensorgen.measure.signal.run import hysteresis, of_presses, processed

MADE = made.presses(12)
RUN = made.run(MADE, rate_hz=70, creep=0.004)
ALL = np.ones(len(RUN.time_s), bool)


def test_presses_are_found_by_force_and_by_the_readings_alone():
    noisy = RUN.force_n + 0.03 * np.random.default_rng(0).standard_normal(len(RUN.force_n))
    by_force = presses.by_force(RUN.time_s, noisy)
    by_readings = presses.by_readings(RUN.time_s, RUN.impedance_ohm)
    truth = [(start, end) for start, end, f, _ in MADE if f > 0.3]
    assert len(by_force) == len(truth)
    np.testing.assert_allclose(by_force, truth, atol=0.21)
    felt = [(s, e) for s, e, f, _ in MADE if f > 1.0]  # a light press leaves a reading within its noise
    for start, end in felt:
        assert any(abs(p.start_s - start) < 0.4 and abs(p.end_s - end) < 0.4 for p in by_readings)
    assert len(by_readings) <= len(MADE)


def test_noise_and_creep_are_no_presses():
    rng = np.random.default_rng(0)
    noise = 1e-3 * (rng.standard_normal((20_000, 7)) + 1j * rng.standard_normal((20_000, 7)))
    t = np.arange(20_000) / 140
    for course in (0 * t, 0.02 * np.log1p(t / 20), 0.02 * np.sqrt(t / 60), -1e-4 * t):
        assert presses.by_readings(t, (100 - 50j) * np.exp(course)[:, None] * (1 + noise)) == []


# also from the midst of the first press on; or presses that are all alike, which only the first step tells from rests
@pytest.mark.parametrize(("begins_s", "least_n"), [(0.0, 1.0), (7.0, 1.0), (0.0, 6.0)])
def test_presses_are_found_in_readings_that_creep(begins_s, least_n):
    plan = made.presses(20, seed=2, least_n=least_n)
    run = made.run(plan, rate_hz=70, creep=0.02)
    late = run.time_s >= begins_s
    found = presses.by_readings(run.time_s[late], run.impedance_ohm[late])
    felt = [m for m in plan if m[0] > begins_s]
    assert len(found) <= len(felt)
    right = [any(abs(p.start_s - s) < 0.3 and abs(p.end_s - e) < 0.3 for p in found) for s, e, *_ in felt]
    assert sum(right) >= len(felt) - 2
    assert len(found) == sum(right)


@pytest.mark.parametrize(("noise", "ramp_s"), [(0.0, 0.2), (1e-6, 1e-3), (1e-5, 0.2), (1e-3, 1e-3)])
def test_equal_presses_are_found_however_quiet_the_readings_are(noise, ramp_s):
    t, rng = np.arange(0, 120, 0.02), np.random.default_rng(2)
    starts = np.array([10.0, 30, 50, 70, 90, 105])
    after = t[:, None] - starts
    pressed = np.clip(np.minimum(after, 8 - after) / ramp_s, 0, 1).sum(axis=1)
    scatter = noise * (rng.standard_normal((len(t), 2)) + 1j * rng.standard_normal((len(t), 2)))
    z = np.array([1000 - 5000j, 900 - 500j]) * (1 - 0.05 * pressed[:, None]) * (1 + scatter)
    np.testing.assert_allclose(presses.by_readings(t, z), np.transpose([starts, starts + 8]), atol=0.03 + ramp_s)


def test_a_press_ends_where_the_force_is_not_known_and_short_ones_are_none():
    t = np.arange(0, 10, 0.1)
    force = np.where((t > 2) & (t < 6), 3.0, 0.0)
    force[45:50] = np.nan
    force[80] = 5.0
    assert [(round(p.start_s, 6), round(p.end_s, 6)) for p in presses.by_force(t, force)] == [(2.1, 4.4), (5.0, 5.9)]
    assert presses.by_force(t, force * 0) == []
    dithering = np.where((t > 2) & (t < 6), 0.15 + 0.1 * (np.arange(100) % 2), 0.0)  # about the threshold
    assert len(presses.by_force(t, dithering)) == 1


def test_pairs_are_the_means_and_their_errors_are_what_they_say():
    pulls, errors = [], []
    for seed in range(6):
        run = made.run(MADE, rate_hz=70, seed=seed)
        found = presses.pairs(run.time_s, run.impedance_ohm, ALL, presses.by_force(run.time_s, run.force_n),
                              run.force_n, run.position_mm)  # fmt: skip
        at = [np.searchsorted(run.time_s, s + 2) for s in found.time_s]
        truth = run.clean_ohm[at] - run.clean_ohm[0]
        off = found.difference_ohm - truth
        pulls.append(np.stack([off.real / found.error_ohm.real, off.imag / found.error_ohm.imag]))
        errors.append(found.error_ohm)
        np.testing.assert_allclose(found.force_n, [m[2] for m in MADE], rtol=1e-9)
        np.testing.assert_allclose(found.position_mm, [m[3] for m in MADE], rtol=1e-9)
        np.testing.assert_array_equal(found.difference_ohm, found.pressed_ohm - found.before_ohm)
    # an even mean over a second at 70 samples/s, before and under: sqrt(2 / 70) of the noise
    expected = 1e-3 * np.abs(RUN.clean_ohm[0]) * np.sqrt(2 / 70)
    np.testing.assert_allclose(np.mean(errors, axis=(0, 1)).real, expected, rtol=0.15)
    np.testing.assert_allclose(np.mean(errors, axis=(0, 1)).imag, expected, rtol=0.15)
    assert np.sqrt(np.mean(np.square(pulls))) == pytest.approx(1, abs=0.12)


def test_readings_that_do_not_count_are_not_counted():
    spans = presses.by_force(RUN.time_s, RUN.force_n)
    z, valid = RUN.impedance_ohm.copy(), ALL.copy()
    inside = (RUN.time_s > spans[0].end_s - 1.3) & (RUN.time_s < spans[0].end_s - 0.8)
    z[inside], valid[inside] = np.nan, False
    lost = (RUN.time_s > spans[1].start_s) & (RUN.time_s < spans[1].end_s)
    valid[lost] = False
    found = presses.pairs(RUN.time_s, z, valid, spans, RUN.force_n, RUN.position_mm)
    assert np.isfinite(found.difference_ohm).all()
    assert found.samples[0].tolist() == pytest.approx([70, 35], abs=2)
    assert found.left_out[0].startswith("press 2 at")
    assert len(found.time_s) == len(MADE) - 1
    with pytest.raises(BadInput, match=r"none with 8 readings.*record 8 readings a second or more"):
        presses.pairs(RUN.time_s, z, ALL & False, spans, RUN.force_n, RUN.position_mm)


def test_means_of_readings_that_hang_together_have_larger_errors():
    rng = np.random.default_rng(3)
    t = np.arange(200) / 100
    white = rng.standard_normal((200, 400))
    smooth = np.zeros_like(white)
    for k in range(1, 200):
        smooth[k] = 0.6 * smooth[k - 1] + white[k]
    for values in (white, smooth):
        said = np.sqrt((presses._mean_error(t, values) ** 2).mean())
        assert said == pytest.approx(values.mean(axis=0).std(), rel=0.15)


LAWS = {
    "power": lambda t, _: 0.02 * (t / 60) ** 0.3,
    "stretched exponential": lambda t, _: 0.04 * (1 - np.exp(-((t / 40) ** 0.5))),
    "a room that warms and cools": lambda t, _: 0.02 * np.sin(t / 40),
}


def drift_of(run, force_n=None, **how):
    """Drift of a run whose readings all count."""
    valid = np.ones(len(run.time_s), bool)
    return drift.fitted(run.time_s, run.impedance_ohm, valid, run.force_n if force_n is None else force_n, **how)


def check_drift(found, run):
    """The course of the drift is known to a third of one reading's noise, where it begins to less."""
    off = (found.at(run.time_s) - run.drift)[run.time_s > 1]
    assert np.abs(off - off.mean(axis=0)).max() < 3e-4
    np.testing.assert_allclose(found.rest_ohm(), run.clean_ohm[0] * np.exp(run.drift[0]), rtol=2e-3)
    left = found.removed(run.time_s, run.impedance_ohm) / found.rest_ohm() * run.clean_ohm[0] / run.clean_ohm - 1
    assert np.abs(left.mean(axis=0)).max() < 1e-4
    assert np.ptp(np.abs(run.drift), axis=0).max() > 0.005


@pytest.mark.parametrize("law", LAWS)
def test_the_fit_of_the_drift_follows_laws_that_are_not_its_own(law):
    run = made.run(made.presses(15, most_n=3.0), rate_hz=70, law=LAWS[law])
    check_drift(drift_of(run), run)


def test_drift_is_fitted_to_the_rest_and_taken_out():
    run = made.run(made.presses(15, most_n=3.0), rate_hz=70, creep=0.02, slope_per_s=2e-5)
    found = drift_of(run)
    check_drift(found, run)
    left = found.fit.left * (70 * drift.BIN_S) ** 0.5  # means of so many readings
    np.testing.assert_allclose(left.real.std(axis=0), 1e-3, rtol=0.15)
    np.testing.assert_allclose(left.imag.std(axis=0), 1e-3, rtol=0.15)
    with pytest.raises(BadInput, match="0 readings at rest"):
        drift_of(run, run.force_n + 1)


@pytest.mark.parametrize(
    ("law", "name"),
    [
        (lambda t, _: 0.02 * t / t[-1], "line"),
        (LAWS["power"], "smooth"),
        (made.answering(0.01, 2.0), "memory"),
        (made.walking(0.02), "wandering"),
        (lambda t, f: made.answering(0.03, 2.0)(t, f) + made.walking(0.02)(t, f), "memory+wandering"),
    ],
)
def test_the_law_that_drift_follows_is_told_with_its_reason(law, name):
    run = made.run(made.presses(30), rate_hz=70, law=law)
    found = drift_of(run)
    assert found.law == name
    assert drift.LAWS[name] in found.reason
    assert "BIC higher of" in found.reason


def test_time_constants_of_a_film_come_back():
    law = lambda t, f: made.answering(0.01, 2.0)(t, f) + made.answering(0.01, 30.0)(t, f)  # noqa: E731
    run = made.run(made.presses(30), rate_hz=70, law=law)
    force = run.force_n.copy()
    force[500:600] = np.nan  # the rig was silent
    found = drift_of(run, force)
    assert found.law == "memory"
    taus = sorted(term.tau_s for term in found.fit.terms if isinstance(term, drift.Relaxation))
    assert taus[:2] == pytest.approx([2, 30], rel=0.05)
    off = (found.at(run.time_s) - run.drift)[force > 0.4]
    assert np.quantile(np.abs(off - off.mean(axis=0)), 0.95) < 5e-4 < 0.03 < np.abs(run.drift).max()


def test_a_law_that_is_asked_for_is_taken():
    run = made.run(made.presses(8), rate_hz=70, law=made.answering(0.01, 2.0))
    for name in drift.LAWS:
        assert drift_of(run, among=[name]).law == name
    with pytest.raises(UnknownName, match="unknown law of drift 'cubic'"):
        drift_of(run, among=["cubic"])
    with pytest.raises(BadInput, match="no law of drift to choose from"):
        drift_of(run, among=[])


def test_little_rest_takes_a_simple_law():
    run = made.run(made.presses(1, rest_s=2.0), rate_hz=70, law=made.walking(0.02))
    valid = np.ones(len(run.time_s), bool)
    valid[200:] = False
    assert drift.fitted(run.time_s, run.impedance_ohm, valid, run.force_n).law == "line"


def test_hysteresis_of_two_known_ways():
    force = np.concatenate([np.linspace(0, 4, 200), np.linspace(4, 0, 200)])
    up, down = force**2, force**2 + force * (4 - force) * 0.5
    values = np.column_stack([np.where(np.arange(400) < 200, up, down), 3 * force])
    found = hysteresis(force, values)
    assert found.share == pytest.approx([2.0 / 16, 0], abs=2e-3)  # 0.5 F (4 - F) has its top of 2 at 2 N
    assert found.at_n[0] == pytest.approx(2, abs=0.1)
    assert found.lost == pytest.approx([0.5 * 64 / 6 / (64 / 3), 0], abs=5e-3)
    several = [hysteresis(force, values + 0.1 * np.random.default_rng(k).standard_normal((400, 2))) for k in range(40)]
    apart = np.array([way.down[20] - way.up[20] for way in several])
    spans = np.array([np.ptp(np.vstack([way.up, way.down]), axis=0) for way in several]).mean(axis=0)
    np.testing.assert_allclose(np.mean([way.error for way in several], axis=0), apart.std(axis=0) / spans, rtol=0.35)
    assert several[0].share == pytest.approx([2 / 16, 0], abs=0.06)
    with pytest.raises(BadInput, match="expected a press with loading and unloading"):
        hysteresis(force[:200], values[:200])


@pytest.mark.parametrize(
    ("sign", "zero_n", "said", "rests"),
    [(-1, 0.0, "the force goes down to -5", True), (1, 0.4, "the force is never below 0.3", False)],
)
def test_a_force_of_the_other_sign_or_off_its_zero_is_named_and_no_load_is_a_rest(sign, zero_n, said, rests):
    source = Source("", "", rate_hz=70)
    one = Recording(RUN.time_s, made.TONES_HZ, RUN.impedance_ohm, blank(len(ALL)), RecordingClock(), source)
    time, told, position, force = made.rig_rows(MADE)
    log = RigLog(time - made.EPOCH_S, told, position, sign * force + zero_n, np.zeros(len(time), bool))
    worked = processed(one, joined(one, log))
    assert worked.pairs is None
    assert said in worked.notes[-1]
    z = worked.rest_ohm()
    assert bool(len(z)) is rests
    if rests:
        truth = (RUN.clean_ohm * np.exp(RUN.drift))[RUN.force_n == 0]
        np.testing.assert_allclose(np.log(z).mean(axis=0), np.log(truth).mean(axis=0), atol=2e-4)


def slow_loads(period_s, count, power, lens, noise_n=0.001):
    """Up and down again in 12 s each, to 6 N, by a rig 2 s early; of a film with a lens of hysteresis."""

    def force(time_s):
        return 6 * np.clip(1 - np.abs(time_s % period_s - 17) / 12, 0, 1)

    end = period_s * count
    t, rows, rng = np.arange(0, end, 0.02), np.arange(0, end, 0.04), np.random.default_rng(0)
    share = (force(t) / 6) ** power
    share += lens * np.where(t % period_s > 17, 4 * share * (1 - share), 0)
    noise = 2e-4 * (rng.standard_normal(len(t)) + 1j * rng.standard_normal(len(t)))
    z = ((1000 - 5000j) * (1 - 0.06 * share) * (1 + noise))[:, None]
    one = Recording(t, np.array([1.1e3]), z, blank(len(t)), RecordingClock(), Source("", "", rate_hz=50))
    measured = force(rows) + noise_n * rng.standard_normal(len(rows))
    return one, RigLog(rows - 2.0, force(rows), 50 + 0 * rows, measured, np.zeros(len(rows), bool))


def test_hysteresis_is_no_late_clock_and_its_error_has_that_of_the_clock():
    one, log = slow_loads(40, 3, power=1, lens=0.2)
    beside = joined(one, log)
    clocks = beside.clocks
    assert clocks.offset_s == pytest.approx(2, abs=4 * clocks.offset_error_s)
    assert clocks.offset_error_s < 0.01
    worked = processed(one, beside, law="line")
    ways = of_presses(worked).ways.values()
    assert len(ways) == 3
    for way in ways:  # over the span from 0.2 N on
        assert way.share[1] == pytest.approx(0.2 / (1 - 0.2 / 6), abs=4 * way.error[1])
    for way in of_presses(replace(worked, clock_error_s=0.1)).ways.values():  # both ways move by 0.05 N
        assert way.error[1] == pytest.approx(2 * 0.05 / 5.8, rel=0.25)


@pytest.mark.parametrize(("lens", "noise_n"), [(0.1, 0.001), (0.0, 0.03)])
def test_equal_loads_of_a_film_that_is_steep_at_first_tell_its_hysteresis(lens, noise_n):
    one, log = slow_loads(29, 4, 0.75, lens, noise_n)  # as like itself half a period late as in time
    beside = joined(one, log)
    assert beside.clocks.offset_s == pytest.approx(2, abs=0.04)  # a row of the rig
    for way in of_presses(processed(one, beside, law="line")).ways.values():
        assert way.share[1] == pytest.approx(lens / (1 - (0.2 / 6) ** 0.75), abs=0.015)


def test_a_surface_is_straight_between_its_presses_and_blank_beyond():
    rng = np.random.default_rng(0)
    force, at = rng.uniform(0, 6, 60), rng.uniform(10, 90, 60)
    values = np.column_stack([2 + 3 * force - 0.1 * at, -force])
    found = surface(force, at, values, points=20)
    expected = 2 + 3 * found.force_n[:, None] - 0.1 * found.position_mm
    inside = np.isfinite(found.values[..., 0])
    assert 0.6 < inside.mean() < 1
    np.testing.assert_allclose(found.values[inside, 0], expected[inside], atol=1e-9)
    assert found.values.shape == (20, 20, 2)
    bent = np.column_stack([force**2, force * at])
    other_unit = surface(force * 1e3, at, bent, points=20)  # triangles must not hang on it
    np.testing.assert_allclose(other_unit.values, surface(force, at, bent, points=20).values, rtol=1e-6)
    with pytest.raises(BadInput, match="on one line"):
        surface(force, 2 * force, values)
    with pytest.raises(BadInput, match="three or more"):
        surface(force[:2], at[:2], values[:2])


def test_all_sets_on_one_scale():
    sets = [np.array([[1.0, 5], [3, 5]]), np.array([[-2.0, 0], [2, 4], [0, 2]])]
    own = normalised(sets)
    assert own[0][:, 0].tolist() == [0, 1]
    assert np.isnan(own[0][:, 1]).all()
    assert own[1].tolist() == [[0, 0], [1, 1], [0.5, 0.5]]
    one = normalised(sets, together=True)
    assert one[0][:, 0].tolist() == pytest.approx([0.6, 1.0])
    assert one[1][:, 0].tolist() == pytest.approx([0, 0.8, 0.4])


def test_the_rest_begins_when_the_film_has_come_back():
    t = np.arange(0, 12, 0.1)
    force = np.where((t > 3.05) & (t < 5.05), 2.0, 0.0)
    force[100] = np.nan  # nobody knows: as if it pressed
    away = drift._disturbed(t, force, 1.5)
    assert t[away][:-16].tolist() == pytest.approx(np.arange(3.0, 6.45, 0.1).tolist())
    assert t[away][-16:].tolist() == pytest.approx(np.arange(9.9, 11.45, 0.1).tolist())
