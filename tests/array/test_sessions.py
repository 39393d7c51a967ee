"""Calibration over sessions: a simulated insole without shared code, closed forms, planted leaks, standing loads."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats
from insole_sessions import Insole

from in_process import run
from sensorgen.core import document
from sensorgen.core.errors import BadInput
from sensorgen.measure.array_frames import session
from sensorgen.prediction.array import sessions as calibration
from sensorgen.prediction.array.elements import ArraySession, LawForm, Past, behind, doubtful_time, flickering, lagged
from sensorgen.prediction.array.sessions import calibrated, law_of, median_error, stored, study

PRINT = Insole(elements=20, bad=6, minutes=4.0, rate_hz=1.0)


def recorded(insole, days=(0.0, 1.0, 3.0, 5.0)):
    found = []
    for day, time_s, counts, kpa in insole.sessions(days):
        none = np.full(len(time_s), np.nan)
        found.append(
            ArraySession(f"day {day:g}", day, time_s, counts, none < 0, np.tile(kpa[:, None], counts.shape[1]), none)
        )
    return found


@pytest.fixture(scope="module", autouse=True)
def _one_play():
    """Half of the forms of a law are tried."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(calibration, "PLAYS", (0.03,))
        yield


@pytest.fixture(scope="module")
def days():
    return recorded(PRINT)


@pytest.fixture(scope="module")
def all_days(days):
    return study(days)


def test_a_tare_and_a_memory_lower_the_error_and_intervals_hold(all_days):
    """As on the published insole: zeros of days cost most, one slow state lowers what a static cubic leaves."""
    static, tared, error, coverage = (
        np.mean([getattr(e, key) for e in all_days.errors])
        for key in ("static_kpa", "tared_kpa", "error_kpa", "coverage")
    )
    assert static > 1.5 * tared
    assert error < 0.9 * tared
    assert 0.85 <= coverage <= 0.95
    assert all_days.calibration.law.form.tau_s in (30.0, 100.0)
    assert (~all_days.calibration.law.alive).sum() == PRINT.bad
    text = "\n".join(document.text(all_days.document()))
    assert "6 elements, from 1:" in text


def test_no_state_where_nothing_creeps():
    nothing = Insole(elements=8, bad=0, minutes=3.0, rate_hz=1.0, creep=0.0, play_kpa=0.0)
    assert calibration.chosen(recorded(nothing, (0.0, 1.0, 2.0))).tau_s in (0.0, 10.0)  # of the simulated 3 s


def changes_with_held_out(days, k=1):
    """Test whether the calibration for a session, or its pressures, know the loaded references of that session."""
    loaded = ~days[k].unloaded[:, None]
    turned = replace(days[k], pressure_kpa=np.where(loaded, 1.3 * days[k].pressure_kpa, days[k].pressure_kpa))
    results = []
    for own in (days[k], turned):
        known = calibrated(calibration.training([*days[:k], own, *days[k + 1 :]], k))
        results.append(np.concatenate([known.law.at.ravel(), *known.pressures(own)], None))
    return not np.array_equal(results[0], results[1], equal_nan=True)


def test_a_leak_would_be_seen(days, monkeypatch):
    few = days[:3]
    monkeypatch.setattr(calibration, "TAUS_S", ())
    assert not changes_with_held_out(few)
    monkeypatch.setattr(calibration, "training", lambda sessions, held_out: list(sessions))
    assert changes_with_held_out(few)


def test_the_error_stated_is_that_of_the_calibration_by_all_others(days, all_days):
    known = calibrated(days[:2] + days[3:])
    off = known.pressures(days[2])[0] - days[2].pressure_kpa
    live = known.law.alive
    assert np.median(np.sqrt((off[:, live] ** 2).mean(0))) == pytest.approx(all_days.errors[2].error_kpa)


def straight(gains, kpa, *, tare=0.0, noise=0.0, seed=0):
    """Readings of elements that follow a straight law without memory."""
    x = kpa / gains + tare
    return x + noise * np.random.default_rng(seed).normal(size=x.shape)


GAINS = np.array([2.0, 2.1, 1.9, 2.2, 2.05])


def made(kpa, *, force_n=None, known=True, **more):
    k, none = len(kpa), np.full(len(kpa), np.nan)
    pressure = kpa if known else np.full(kpa.shape, np.nan)
    rest = (kpa == 0).all(1)
    return ArraySession("s", 0.0, np.arange(k) * 60.0, straight(GAINS, kpa, **more), rest, pressure,
                   none if force_n is None else force_n)  # fmt: skip


def loads(count, seed):
    draw = np.random.default_rng(seed).uniform(0, 300, (count, 5))
    draw[0] = 0.0
    return draw


@pytest.mark.parametrize("reference", ["bladder", "plate", "presses"])
def test_gains_come_back_from_every_reference(reference):
    """Gain of each element within 1 %: pressures alike, the total force of a person alone, presses one by one."""
    kpa = loads(60, 1)
    if reference == "bladder":
        kpa = np.tile(kpa[:, :1], 5)
    if reference == "presses":
        kpa = kpa * (np.arange(5) == (np.arange(60) % 5)[:, None])
    force = kpa.sum(1) * 0.1 if reference == "plate" else None
    law = law_of([made(kpa, force_n=force, known=force is None, tare=7.0, noise=0.02)], LawForm(powers=1))
    assert law.at[:, 0] / law.scale == pytest.approx(GAINS, rel=1e-2)
    other = made(loads(20, 3), tare=3.0)
    assert np.abs(law.pressures(other)[0] - other.pressure_kpa).max() < 5


@pytest.mark.parametrize("count", [1, 4])
def test_noise_is_not_widened_as_scatter_of_sessions_is(count):
    """90 % of normal noise of 0.5 lie within 1.645 times 0.5 and the gain, of however many sessions it is known."""
    kpa = np.concatenate([np.zeros((1000, 5)), loads(400, 4)[1:]])
    each = [replace(made(kpa, noise=0.5, seed=k), time_s=np.arange(len(kpa)) / 50) for k in range(count + 1)]
    mean, half = calibrated(each[1:], LawForm(powers=1)).pressures(each[0])
    assert half[1000:].mean() == pytest.approx(1.645 * 0.5 * GAINS.mean(), rel=0.05)
    assert (np.abs(mean - kpa) < half)[1000:].mean() == pytest.approx(0.9, abs=0.02)


@pytest.mark.parametrize(("alike", "share"), [(True, 0.02), (False, 0.0)])
def test_what_is_alike_in_all_elements_is_an_error_of_the_total_force(alike, share):
    """Frames that are 2 % off in all elements, or in each by itself; presses of one element say nothing of it."""
    draw, (frames, sessions) = np.random.default_rng(6), (2000, 3)

    def recorded(k):
        kpa = np.tile(draw.uniform(50, 300, (frames, 1)), 5)
        kpa[0] = 0.0
        single = made(kpa * (np.arange(5) == (np.arange(frames) % 5)[:, None]))
        off = 1 + 0.02 * draw.normal(size=(frames, 1) if alike else kpa.shape)
        bladder = made(kpa)
        return single if k == 1 else replace(bladder, reading=bladder.reading * off)

    known = calibrated([recorded(k) for k in range(sessions)], LawForm(powers=1))
    few = scipy.stats.t(sessions).ppf(0.95) / scipy.stats.norm.ppf(0.95)
    assert known.common == pytest.approx(few * share * np.sqrt(1 + 1 / sessions), rel=0.05, abs=4e-3)


def test_noise_of_readings_does_not_flatten_the_law():
    """Least squares take a gain for g / (1 + n s^2 / sum x^2), s the noise: here 0.79 g, and the mean over elements."""
    count, zeros, s, gain = 100, 400, 4.0, 2.0
    kpa = np.r_[np.zeros(zeros), np.tile(np.linspace(10, 60, 6), 10)]
    x = (kpa / gain)[:, None] + s * np.random.default_rng(5).normal(size=(len(kpa), count))
    none, loaded = np.full(len(kpa), np.nan), kpa / gain
    one = ArraySession("s", 0.0, np.arange(len(kpa)) / 50, x, kpa == 0, np.tile(kpa[:, None], count), none)
    factor = 1 / (1 + len(kpa) * s**2 / (loaded @ loaded))
    plain = [(kpa @ of) / (of @ of) for of in (x - one.tare).T]
    assert np.mean(plain) == pytest.approx(gain * factor, rel=0.02)
    law = law_of([one], LawForm(powers=1))
    assert (law.at[:, 0] / law.scale).mean() == pytest.approx(gain, rel=0.01)


def test_terms_of_noisy_readings_are_right_on_average():
    """Less half their bend by s^2, by 20-point Gauss-Hermite quadrature over the noise."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(20)
    x, s, form = np.full((20, 1), 0.7) + 0.3 * nodes[:, None], 0.3, LawForm()
    terms = form.basis(x, np.arange(20.0)) - s**2 / 2 * form.derivatives(x)[1]
    assert (weights / weights.sum()) @ terms[:, 0] == pytest.approx(0.7 ** np.arange(1, 4))


def test_an_element_without_data_takes_the_print_s_gain():
    """Mean and spread over the print, as of any hierarchical prior: 2.06 +- 0.11 of the other four."""
    known = made(loads(40, 2), noise=0.05)
    pressure = known.pressure_kpa.copy()
    pressure[:, 2] = np.nan
    law = law_of([replace(known, pressure_kpa=pressure)], LawForm(powers=1))
    others = GAINS[[0, 1, 3, 4]]
    assert law.at[2, 0] / law.scale == pytest.approx(others.mean(), rel=0.01)
    assert np.sqrt(law.spread[2, 0, 0]) / law.scale == pytest.approx(others.std(), rel=0.2)
    assert np.sqrt(law.spread[0, 0, 0]) < 0.1 * np.sqrt(law.spread[2, 0, 0])


def test_memory_keeps_the_last_reading_where_one_is_missing_and_goes_on_in_the_next_lot():
    time_s, x = np.arange(8.0), np.full((8, 1), 3.0)
    whole, play, lag = lagged(x, time_s, 4.0), behind(x, 0.2), Past()
    parts = [behind(x[part], 0.2, lag) for part in (slice(0, 4), slice(4, 8))]
    assert np.concatenate(parts) == pytest.approx(play)
    x[3:5] = np.nan
    assert lagged(x, time_s, 4.0) == pytest.approx(whole)
    past = Past()
    lots = [lagged(x[part], time_s[part], 4.0, past) for part in (slice(0, 4), slice(4, 5), slice(5, 8))]
    assert np.concatenate(lots) == pytest.approx(whole)


def stop(kpa, width):
    """Load that cells feel: friction takes half a width each way, as a spring with a slider beside the cell."""
    force, found = 0.0, []
    for before, now in zip([0.0, *kpa], kpa, strict=False):
        force = min(max(force + (now - before), -width), width)
        found.append(now - force / 2)
    return np.array(found)


def test_unloading_that_lags_is_learnt_of_slow_and_fast_cycles():
    """And no creep is taken for it: by slow ones alone a memory of 10 s errs by 50 kPa in fast ones."""
    levels, draw = np.r_[np.zeros(21), np.linspace(0, 300, 31), np.linspace(290, 0, 30)], np.random.default_rng(3)
    gains, cycles = np.random.default_rng(2).normal(1.0, 0.05, 8), []
    for day, step in enumerate((5.0, 0.02, 5.0, 0.02, 0.1)):
        felt = stop(levels, 12.0)[:, None] / gains + 0.3 * draw.normal(size=(len(levels), 8))
        none, known = np.full(len(levels), np.nan), np.tile(levels[:, None], 8)
        cycles.append(ArraySession(f"{day}", day, np.arange(len(levels)) * step, felt, none < 0, known, none))
    chosen, cubic = (calibrated(cycles[:4], form) for form in (None, LawForm()))
    after = [np.abs(of.pressures(cycles[4])[0] - levels[:, None])[-20:].mean() for of in (chosen, cubic)]
    assert after[0] < 1.5 < 4 < after[1]
    assert chosen.law.form.tau_s == 0
    assert "play of" in chosen.law.form.words()


def test_elements_are_matched_by_their_names(days, all_days, monkeypatch):
    names = tuple("abcdefghijklmnopqrst")
    named = [replace(one, names=names) for one in days[:3]]
    turned = replace(
        named[1], names=names[::-1], reading=days[1].reading[:, ::-1], pressure_kpa=days[1].pressure_kpa[:, ::-1]
    )
    monkeypatch.setattr(calibration, "TAUS_S", ())
    one, other = (study(each).calibration for each in (named, [named[0], turned, named[2]]))
    assert one.law.at == pytest.approx(other.law.at, rel=1e-6)
    assert one.names == names
    with pytest.raises(BadInput, match="u is an element here or in the calibration alone"):
        turned.matched(("u", *names[1:]))
    with pytest.raises(BadInput, match=r"20 elements, a, b \.\.\.; expected 20, r1c1 to r4c5"):
        one.of_ratio(np.ones((1, 4, 5)), np.zeros(1), 0.0)
    memory = replace(all_days.calibration, names=())
    with pytest.raises(BadInput, match="no time_s of the frames"):
        memory.of_ratio(np.ones((1, 4, 5)), np.full(1, np.nan), 0.0)


def test_time_that_looks_like_milliseconds_is_doubtful(days):
    slow = replace(days[0], time_s=days[0].time_s * 1000)
    assert any("a frame every 1000 s; expected time_s in seconds" in line for line in doubtful_time(slow.time_s))
    assert not list(doubtful_time(days[0].time_s))
    assert "doubtful: a frame every 1000 s" in "\n".join(document.text(study([slow]).document()))


def after_a_load(one, left, tau_s):
    """Session whose readings have still what an earlier load left, the same in all elements."""
    return replace(one, reading=one.reading + left * np.exp(-one.time_s / tau_s)[:, None])


@pytest.mark.parametrize("tau_s", [5.0, 100.0])
def test_a_rest_that_falls_is_corrected_and_its_doubt_is_in_the_interval(days, tau_s):
    """A tenth of the span that an earlier load left triples the error if the tare is taken as it is."""
    known, held = calibrated(days[:3], LawForm(powers=2, tau_s=100.0)), days[3]
    late = after_a_load(held, 0.1 * np.nanmax(held.reading - held.tare), tau_s)
    mean, half = known.pressures(late)
    usual, tared, corrected = (
        median_error(of, late) for of in (known.pressures(held)[0], known.pressures(late, late.tare)[0], mean)
    )
    assert corrected < 1.75 * usual
    assert tared > (2.5 if tau_s > 5 else 1.4) * usual
    inside = np.abs(mean - late.pressure_kpa) < half
    assert inside[np.isfinite(mean)].mean() > 0.85
    assert any("readings at rest fall by" in line for line in calibration.doubts(late))


def test_sessions_that_fell_do_not_narrow_the_intervals_of_others(days):
    fallen = [after_a_load(one, 60.0, 100.0) for one in days[:3]]
    for trained in (days[:3], fallen):
        known = calibrated(trained, LawForm(powers=2, tau_s=100.0))
        mean, half = known.pressures(days[3])
        assert 0.85 < (np.abs(mean - days[3].pressure_kpa) < half)[np.isfinite(mean)].mean() < 0.995


def test_a_rest_that_rises_or_stays_or_ends_the_recording_is_no_fall(days):
    one = days[0]
    assert one.falls == 0
    assert after_a_load(one, 90.0, 100.0).falls < 0
    assert after_a_load(one, -90.0, 100.0).falls == 0
    assert replace(after_a_load(one, 90.0, 100.0), rest=one.time_s > one.time_s[-1] - 15).falls == 0


def walked(rng, rate_hz=100):
    """A minute of steps of 0.6 s on 12 elements, some of which carry nothing, with noise of 0.5 counts."""
    time_s = np.arange(0, 60, 1 / rate_hz)
    within = (time_s % 1.0) / 0.6
    step = np.where(within < 1, np.minimum(np.minimum(within / 0.08, (1 - within) / 0.1), 1.0), 0.0)
    return time_s, step[:, None] * np.linspace(0, 40, 12) + 0.5 * rng.normal(size=(len(time_s), 12))


def test_elements_that_jump_flicker_and_steps_do_not():
    rng = np.random.default_rng(1)
    time_s, reading = walked(rng)
    assert not flickering(time_s, reading).any()
    for element, lasts in ((3, 1), (7, 3)):  # of another element, for one frame and for three
        for start in rng.choice(len(time_s) - 5, 100, replace=False):
            reading[start : start + lasts, element] = reading[start : start + lasts, 11] + 15
    assert np.flatnonzero(flickering(time_s, reading)).tolist() == [3, 7]
    assert not flickering(time_s[::10], reading[::10]).any()  # frames too far apart to tell
    assert not flickering(time_s[:6], reading[:6]).any()


def test_what_is_missing_whole_or_short_does_not_flicker():
    rng = np.random.default_rng(2)
    time_s, reading = walked(rng)
    lost = np.where(rng.random(len(time_s)) < 0.02, np.nan, 1.0)[:, None] * (240 + reading)
    assert not flickering(time_s, lost).any()
    counts = np.round(240 + np.hstack([reading[:, 9:], 0.3 * rng.normal(size=(len(time_s), 37))]))  # three are loaded
    assert not flickering(time_s, counts).any()
    assert not flickering(time_s, np.round(0.3 * rng.normal(size=reading.shape))).any()
    contact = np.maximum(np.sin(2 * np.pi * time_s / 0.2), 0.0) * ((time_s % 1.0) < 0.1)  # hops, of 0.1 s
    hops = contact[:, None] * np.linspace(20, 40, 12) + 0.5 * rng.normal(size=reading.shape)
    assert not flickering(time_s, hops).any()
    hops[:, 4] += 30 * (rng.random(len(time_s)) < 0.05)
    assert np.flatnonzero(flickering(time_s, hops)).tolist() == [4]


def test_elements_that_flicker_are_left_out_of_their_session():
    """The calibration is that of the session without them."""
    time_s = np.arange(0, 8, 0.02)
    kpa, none = 200 * np.maximum(np.sin(time_s) ** 2 - 0.2, 0.0), np.full(len(time_s), np.nan)
    known = np.tile(kpa[:, None], 5)
    days = [
        ArraySession(f"{day}", day, time_s, straight(GAINS, known, noise=0.5, seed=day), kpa == 0, known, none)
        for day in (0, 1)
    ]
    loose = days[0].reading.copy()
    loose[::20, 2] += 60.0
    found = study([replace(days[0], reading=loose), days[1]])
    without = study([replace(days[0], reading=np.where(np.arange(5) == 2, np.nan, loose)), days[1]])
    assert found.calibration.law.at == pytest.approx(without.calibration.law.at)
    assert "0: doubtful: left out, as their readings jump: 1 element, from 1: 3" in document.text(found.document())
    never = study([replace(each, reading=loose + each.day) for each in days])
    assert np.flatnonzero(~never.calibration.law.alive).tolist() == [2]
    with pytest.raises(BadInput, match="all elements jump"):
        study([replace(days[0], reading=loose[:, [2]], pressure_kpa=known[:, :1])])


def test_tare_is_of_marked_or_nothing_and_a_standing_load_is_none(days):
    one = days[0]
    assert one.time_s[one.unloaded].max() == 20  # seconds, by the bladder
    standing = replace(one, pressure_kpa=one.pressure_kpa + 100.0)
    with pytest.raises(BadInput, match="standing load is never taken for rest"):
        _ = standing.unloaded


def test_unloaded_seconds_are_recognised_by_the_readings(days, all_days):
    known, later = all_days.calibration, recorded(PRINT, (0.0, 1.0, 3.0, 5.0, 8.0, 9.0))[-1]
    assert later.time_s[known.recognised(later)].max() < 20
    loaded = later.time_s > 30
    cut = replace(
        later, time_s=later.time_s[loaded], reading=later.reading[loaded] + 300.0 * (np.arange(20) % 3 == 0),
        pressure_kpa=later.pressure_kpa[loaded], rest=later.rest[loaded], force_n=later.force_n[loaded],
    )  # fmt: skip
    with pytest.raises(BadInput, match="no unloaded second is recognised"):
        known.recognised(cut)
    with pytest.raises(BadInput, match="tares of 2 sessions are known"):
        calibrated(days[:2], LawForm(powers=1)).recognised(later)


def test_a_calibration_is_stored_whole(tmp_path, all_days, days):
    (tmp_path / "c.npz").write_bytes(replace(all_days.calibration, readout="two-terminal").npz())
    back = stored(tmp_path / "c.npz")
    assert back.readout == "two-terminal"
    for one, other in zip(back.pressures(days[0]), all_days.calibration.pressures(days[0]), strict=True):
        assert np.array_equal(one, other, equal_nan=True)
    np.savez(tmp_path / "d.npz", a=1)
    with pytest.raises(BadInput, match="no calibration of an array"):
        stored(tmp_path / "d.npz")


def table(path, head, rows):
    path.write_text("\n".join([",".join(head), *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def test_files_of_every_reference(tmp_path):
    head = ["time_s", "day", "heel", "toe"]
    one = session(table(tmp_path / "b.csv", [*head, "pressure_kpa", "rest"],
                        [(0, 3, 1, 2, 0, 1), (1, 3, 5, "", 90, 0)]), 7)  # fmt: skip
    assert (one.day, one.pressure_kpa.tolist(), one.rest.tolist()) == (3.0, [[0, 0], [90, 90]], [True, False])
    assert np.isnan(one.reading[1, 1])
    zero = session(table(tmp_path / "z.csv", [*head, "pressure_kpa", "rest"],
                         [(0, 3, 1, 2, 4, 1), (1, 3, 1, 2, 6, 1), (2, 3, 5, 6, 95, 0)]), 7)  # fmt: skip
    assert zero.pressure_kpa[:, 0].tolist() == [-1, 1, 90]  # what a gauge shows without load is its zero
    press = session(table(tmp_path / "p.csv", ["time_s", "heel", "toe", "element", "force_n"],
                          [(0, 1, 2, "", 0), (1, 1, 3, "toe", 5), (2, 1, 2, "", "")]), 1, area_mm2=50.0)  # fmt: skip
    assert press.day == 1
    assert np.nan_to_num(press.pressure_kpa, nan=-1).tolist() == [[0, 0], [-1, 100], [-1, -1]]
    assert np.isnan(press.force_n).all()
    plate = session(table(tmp_path / "f.csv", ["time_s", "heel", "toe", "force_n"], [(0, 1, 2, 0), (1, 1, 3, 5)]), 1)
    assert np.isnan(plate.pressure_kpa).all()
    assert plate.force_n.tolist() == [0, 5]
    given = {"reading": np.ones((2, 3, 4)), "time_s": [0, 1], "pressure_kpa": [0.0, 5.0], "element": [0, 12]}
    np.savez(tmp_path / "n.npz", **given, area_mm2=20.0)
    packed = session(tmp_path / "n.npz", 2)
    assert packed.reading.shape == (2, 12)
    assert np.nan_to_num(packed.pressure_kpa[1]).tolist() == [0] * 11 + [5]


@pytest.mark.parametrize(
    ("head", "rows", "words"),
    [
        (["time_s", "a", "force_n"], [(1, 2, 3), (0, 2, 3)], "time_s does not rise"),
        (["time_s", "pressure_kpa"], [(0, 1)], "no readings; expected a column for each element"),
        (["a", "force_n"], [(2, 3)], "no time_s; expected the seconds of each frame"),
        (["time_ms", "a", "force_n"], [(0, 2, 3), (10, 2, 3)], "no time_s"),
        (
            ["time_s", "a", "element", "force_n"],
            [(0, 1, "b", 3)],
            "element 'b'; expected a name of a column, or 1 to 1",
        ),
    ],
)
def test_no_session_is_an_error(tmp_path, head, rows, words):
    with pytest.raises(BadInput, match=words):
        session(table(tmp_path / "x.csv", head, rows), 0)


def test_no_study_is_an_error(days):
    with pytest.raises(BadInput, match="19 elements; expected 20"):
        study([days[0], replace(days[1], reading=days[1].reading[:, 1:])])
    unknown = replace(days[1], pressure_kpa=np.full_like(days[1].pressure_kpa, np.nan))
    with pytest.raises(BadInput, match="no reference; expected pressure_kpa"):
        study([days[0], unknown])
    deaf = replace(days[0], reading=np.random.default_rng(0).normal(size=days[0].reading.shape))
    with pytest.raises(BadInput, match="no element's reading follows"):
        calibrated([deaf])


def test_commands_calibrate_and_invert_any_array(tmp_path):
    """Three days of a bladder, then a later session by the calibration alone, unloaded seconds recognised."""
    *known, later = Insole(elements=8, bad=2, minutes=2.0, rate_hz=1.0).sessions((0.0, 1.0, 2.0, 3.0))
    for number, (day, time_s, counts, kpa) in enumerate(known):
        rows = [[t, day, p, *c] for t, p, c in zip(time_s, kpa, counts, strict=True)]
        table(tmp_path / f"{number}.csv", ["time_s", "day", "pressure_kpa", *"abcdefgh"], rows)
    files = [f"{number}.csv" for number in range(3)]
    code, text = run(tmp_path, "calibrate", *files, "--calibration", "c.npz")
    assert code == 0
    assert "2 elements: " in text
    np.savez(tmp_path / "dayless.npz", reading=later[2], time_s=later[1], rest=later[3] == 0)
    assert run(tmp_path, "invert", "c.npz", "dayless.npz", "-o", "p.csv")[0] == 2
    np.savez(tmp_path / "later.npz", reading=later[2], time_s=later[1], rest=later[3] == 0, day=3.0)
    assert run(tmp_path, "invert", "c.npz", "later.npz", "-o", "p.csv")[0] == 0
    lines = (tmp_path / "p.csv").read_text().splitlines()
    found = np.genfromtxt(lines[1:], delimiter=",")[:, 1::2]
    assert np.nanmedian(np.abs(found - later[3][:, None])) < 15
    assert np.isnan(found).all(0).sum() == 2
    rows = [[t, 3.0, int(p == 0), *(["", *c[6::-1]])] for t, p, c in zip(later[1], later[3], later[2], strict=True)]
    table(tmp_path / "l.csv", ["time_s", "day", "rest", *"hgfedcba"], rows)
    assert run(tmp_path, "invert", "c.npz", "l.csv", "-o", "q.csv")[0] == 0
    head, *lines = (tmp_path / "q.csv").read_text().splitlines()
    assert head.startswith("time_s,p_a_kpa,half_a_kpa,p_b_kpa")
    again = np.genfromtxt(lines, delimiter=",")[:, 1::2]
    assert np.isnan(again[:, 7]).all()
    assert again[:, :7] == pytest.approx(found[:, :7], nan_ok=True)
    assert run(tmp_path, "calibrate", "0.csv", "S1")[0] == 2
    assert run(tmp_path, "calibrate", *files, "--frequency", "10kHz")[0] == 2
    assert run(tmp_path, "invert", "later.npz", "later.npz")[0] == 2
    for ignored in (("--tip", "8"), ("--force-offset", "1"), ("--log", "l.db")):
        assert run(tmp_path, "calibrate", *files, *ignored)[0] == 2
