"""Sensors that changed after their calibration, as a ladder that shares no line with the package reads them."""

from dataclasses import replace

import numpy as np
import pytest

from independent_data import data_of, model_of, none_of
from independent_sensor import CHANGES, LENGTH_M, TONES_HZ, WIDTH_M, Strip, drawn_at_random, next_day, run
from sensorgen.prediction.calibration import calibration as records
from sensorgen.prediction.calibration.calibration import inside
from sensorgen.prediction.calibration.fitting import by_rest, calibrated, gain, loosened, widened
from sensorgen.prediction.calibration.inversion import OTHERWISE, Inverter, Verdict, doubt_rest
from sensorgen.prediction.calibration.materials import MaterialEstimate
from sensorgen.prediction.calibration.rest import LOADS_N, Baseline, Rest, load_probabilities
from sensorgen.prediction.calibration.specimen import unknown

NOISE, LIMIT_N, ANSWERED = 1e-3, 7.5, (Verdict.OK, Verdict.FORCE_ONLY)
OMEGA = 2 * np.pi * TONES_HZ


@pytest.fixture(scope="module")
def model():
    return model_of(printed=False)


@pytest.fixture(scope="module")
def specimens(model):
    """Strips of the family, each with its known presses, its calibration and what inverts its readings."""
    made = []
    for seed in range(3):
        strip = drawn_at_random(seed)
        known = data_of(run(strip, 30, seed), NOISE)
        made.append((strip, known, calibrated(model, known)))
    return made


@pytest.fixture(scope="module")
def resistive(model):
    """A strip whose resistance tells position, read to 0.01 %, and its calibration."""
    strip = drawn_at_random(4, noise=1e-4, resistance_ohm=5e4)
    return strip, calibrated(model, data_of(run(strip, 30, 4), 1e-4))


def judged(model, specimen, seed, name, otherwise=OTHERWISE, count=60):
    """Results and truths of presses after a change."""
    strip, known, posterior = specimen
    change, where = CHANGES[name]
    made = run(next_day(change(strip, seed), seed), count, seed + 77, where)
    base = Baseline(model, posterior, gain(model, known, posterior.at))
    changed = np.array([bool(base.change(z, NOISE / 10**0.5)) for z in made.rest_ohm])
    inverter = Inverter(model, posterior, force_limit_n=LIMIT_N, otherwise=otherwise, session=True)
    unseen = data_of(made, NOISE)
    found = inverter.batch(unseen.ratio, changed=changed)
    doubt_rest(found, np.zeros(count, bool), 0)
    return found, unseen.presses


def test_the_ladder_at_rest_is_an_open_line():
    strip = Strip()
    r, c = strip.resistance_ohm / LENGTH_M, strip.capacitance_f / LENGTH_M
    expected = np.sqrt(r / (1j * OMEGA * c)) / np.tanh(np.sqrt(1j * OMEGA * r * c) * LENGTH_M)
    assert strip.impedance([], 0.0)[0] == pytest.approx(expected, rel=1e-5)


def test_the_ladder_under_a_press_a_hand_and_a_hole():
    strip = Strip(resistance_ohm=1e-3, hand_f=5e-13, hole_ohm=1e6)
    press = (np.array([3.0]), np.array([0.031]), np.ones(1))
    rise = strip.rise(np.array([3.0 / (WIDTH_M * 5e-3)]), press[0])[0]
    assert rise == pytest.approx(0.17878, abs=1e-4)  # contact.json at 60 kPa
    expected = 1j * OMEGA * (strip.capacitance_f * (1 + rise * 0.05) + 5e-13) + 1e-6
    assert 1 / strip.impedance([press], 0.0, hand=True)[0] == pytest.approx(expected, rel=1e-6)


EACH_TIME = ("sound", "second press of 2 N at 20 mm", "rest read under 1 N", "trace broken at 50 mm")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in EACH_TIME else [pytest.mark.nightly]) for name in CHANGES]
)
def test_a_changed_sensor_is_covered_or_not_called_ok(model, specimens, name):
    """A cut of bench/coverage.py: intervals of answered readings, force alone or not, or hardly any are answered."""
    answered, held, plain = [], [], 0.0
    for seed, specimen in enumerate(specimens):
        found, presses = judged(model, specimen, seed, name)
        answered.append(np.isin(found.verdict, ANSWERED))
        held.append(inside(found, presses)[0])
        plain += np.mean(found.verdict == Verdict.OK) / len(specimens)
    answered, held = np.concatenate(answered), np.concatenate(held)
    if name == "sound":
        assert answered.mean() >= 0.85
        assert plain >= 0.85
        assert 0.85 <= held.mean() <= 0.98  # 180 presses of three specimens
    else:
        assert answered.mean() <= 0.1 or held[answered].mean() >= 0.8


def test_the_change_is_named(model, specimens):
    strip, known, posterior = specimens[0]
    base = Baseline(model, posterior, gain(model, known, posterior.at))

    def change(other, **more):
        return base.change(run(replace(next_day(other, 1), **more), 3, 5).rest_ohm.mean(0), NOISE / 10)

    assert not change(strip)
    assert not change(strip, kelvin=3.0)
    broken, lifted = change(strip, broken_at_m=0.05), change(strip, lifted_from_m=0.07)
    assert np.log(0.5) < broken.ln_c < -0.3  # 10 Mohm are 14 pF at 1.1 kHz: half of it is not quite cut off
    assert lifted.ln_c == pytest.approx(np.log(0.7 + 0.3 * 0.3), abs=0.05)
    assert "a broken trace, a lifted edge or another specimen" in broken.words
    assert "C -21%" in lifted.words or "C -20%" in lifted.words
    assert "another specimen" in change(strip, resistance_ohm=2 * strip.resistance_ohm).words
    assert change(strip, hole_ohm=1e6)
    missing = run(strip, 1, 5).rest_ohm[0]
    missing[2] = np.nan
    assert not base.change(missing, NOISE)


def test_readings_after_a_changed_rest_say_so(model, specimens):
    strip, known, posterior = specimens[1]
    base = Baseline(model, posterior, gain(model, known, posterior.at))
    good, bad = (run(one, 1, 3) for one in (strip, replace(strip, broken_at_m=0.05)))
    z = np.concatenate(
        [good.rest_ohm, good.pressed_ohm, bad.rest_ohm, bad.pressed_ohm, good.rest_ohm, good.pressed_ohm]
    )
    rest = Rest(baseline=base)
    ratio, _, changed = rest.ratios(z, np.tile([True, False], 3), np.arange(6.0))
    assert changed.tolist() == [False, False, False, True, False, False]
    assert "broken trace" in rest.change.words
    found = Inverter(model, posterior, force_limit_n=LIMIT_N).batch(ratio, changed=changed)
    assert [Verdict(v).words for v in found.verdict[[3]]] == ["changed since calibration"]
    assert Rest(bad.rest_ohm, baseline=base).change


def test_another_capacitance_is_seen_where_the_frequencies_tell(model, resistive):
    """A hand, on a strip whose resistance tells position; a press alone is not called so."""
    strip, posterior = resistive
    inverter = Inverter(model, posterior, force_limit_n=13.0)
    sound, hand = (
        inverter.batch(data_of(run(one, 60, 9), 1e-4).ratio).verdict for one in (strip, replace(strip, hand_f=3e-13))
    )
    assert (sound == Verdict.OK).all()
    assert (hand == Verdict.MORE).mean() > 0.6
    assert Verdict.MORE.words == "more than one press"


def test_a_reading_without_position_is_ok_unless_the_sensor_locates_such_presses(model, specimens, resistive):
    """8.6 kohm hardly locate; 50 kohm do, and not without the frequencies above 3 kHz."""
    found, _ = judged(model, specimens[0], 0, "sound")
    wide = np.ptp(found.position_90_m, axis=1) > 0.8 * LENGTH_M
    assert wide.mean() > 0.1
    assert (found.verdict[wide] == Verdict.OK).mean() > 0.9
    strip, posterior = resistive
    inverter = Inverter(model, posterior, force_limit_n=13.0)
    ratio = data_of(run(strip, 60, 9), 1e-4).ratio
    ratio[:, 2:] = np.nan
    few = inverter.batch(ratio)
    wide = (np.ptp(few.position_90_m, axis=1) > 0.8 * LENGTH_M) & (few.force_n > 1)
    assert wide.sum() > 3
    assert (few.verdict[wide] == Verdict.FORCE_ONLY).all()


def test_readings_below_their_rest_put_their_neighbours_in_doubt(model, specimens):
    found, _ = judged(model, specimens[0], 0, "sound")
    found.below[:], found.verdict[:] = 0.0, Verdict.OK
    found.below[30] = 6.0
    rest = np.zeros(60, bool)
    rest[10] = True
    assert doubt_rest(found, rest, 0) == 200 - 29
    assert Verdict(found.verdict[10]) == Verdict.OK
    assert (found.verdict[~rest] == Verdict.LOADED_REST).all()
    found.below[:], found.verdict[:] = 0.0, Verdict.OK
    assert doubt_rest(found, rest, 20) == 0
    assert (found.verdict == Verdict.LOADED_REST).sum() == 19


@pytest.mark.parametrize(("load_n", "zeros", "is_shown"), [(0.0, 60, False), (1.0, 0, True)])
def test_readings_below_their_rest_show_a_load_at_rest(load_n, zeros, is_shown):
    """Forces up to 6 N, each read to 0.6 N, and readings of no force, which alone show no load."""
    rng, per_n = np.random.default_rng(3), 1.7
    force = np.concatenate([rng.uniform(0.1, 6.0, 400), np.zeros(zeros)])
    below = per_n * (load_n - force) + rng.standard_normal(len(force))
    chance = load_probabilities(np.append(below, np.nan), per_n * LOADS_N, 0.2)
    assert chance.sum() == pytest.approx(1.0)
    assert (chance[0] < 0.05) == is_shown
    assert is_shown or chance[0] > 0.8
    assert not is_shown or 0.7 < chance @ LOADS_N < 1.4


def test_a_load_at_rest_widens_the_intervals_of_its_session_alone():
    """Prints of blunt cells, of which 1 N at rest shifts C by 0.1 % or less; no reading alone shows it."""
    model, held = model_of(printed=True), []
    for seed in (100, 104, 109):
        strip = drawn_at_random(seed, printed=True)
        posterior = calibrated(model, data_of(run(strip, 30, seed), NOISE))
        blind, aware = (Inverter(model, posterior, force_limit_n=LIMIT_N, session=one) for one in (False, True))
        for name in ("sound", "rest read under 1 N"):
            unseen = data_of(run(next_day(CHANGES[name][0](strip, seed), seed), 80, seed + 77), NOISE)
            before, after = blind.batch(unseen.ratio), aware.batch(unseen.ratio)
            if name == "sound":
                assert (after.force_90_n == before.force_90_n).all()
            else:
                held.append([inside(found, unseen.presses)[0].mean() for found in (before, after)])
    assert np.mean(held, 0)[0] < 0.65
    assert np.mean(held, 0)[1] > 0.75


def test_the_law_of_a_tip_over_an_end_is_that_of_its_pressure(model):
    """Half of the tip under half of the force: half of the capacitance change, with the calibrated factors."""
    at = np.where(np.char.startswith(model.names, "rise at"), 1.5, 0.0)
    at[list(model.names).index("resistance")] = -20.0
    force, place = np.array([1.0, 2.0, 6.0]), np.full(3, model.sensor.length_m / 2)
    whole = np.expm1(-model.ratio(at, unknown(force, place)).real)
    half = np.expm1(-model.ratio(at, unknown(force / 2, 2 * place)).real)
    assert half == pytest.approx(whole / 2, rel=1e-4)


def test_presses_near_an_end_may_lie_in_the_interval(model, specimens):
    found = [judged(model, s, k, "press at 96 to 99.5 mm") for k, s in enumerate(specimens)]
    force, place = np.mean([inside(*one) for one in found], axis=(0, 2))
    assert place > 0.8
    assert force > 0.87  # by each reading alone 0.8: the tip hangs over the end, where half of it presses twice as hard


@pytest.mark.parametrize(("places_m", "is_wider"), [((0.029, 0.031), False), ((0.09, 0.1), True)])
def test_a_session_near_an_end_alone_widens_the_interval_of_the_force(model, specimens, places_m, is_wider):
    """Readings that each tell the place to 70 mm do so together; presses all over or in the middle are as before."""
    strip, _, posterior = specimens[1]
    unseen = data_of(run(next_day(strip, 1), 80, 78, places_m), NOISE)
    alone, together = (
        Inverter(model, posterior, force_limit_n=LIMIT_N, session=one).batch(unseen.ratio) for one in (False, True)
    )
    upper = together.force_90_n[:, 1] - alone.force_90_n[:, 1]
    assert (np.median(upper) > 0.02) == is_wider
    assert (together.position_90_m == alone.position_90_m).all()


def test_a_few_readings_change_no_others_of_their_session(model, specimens):
    """Two readings far below their rest move none; two presses far from all others are where they are."""
    _, _, posterior = specimens[1]
    together = Inverter(model, posterior, force_limit_n=LIMIT_N, session=True)
    force = np.append(np.linspace(0.5, 5, 1000), [2.0, 4.0])
    noise = NOISE * np.random.default_rng(0).normal(size=(len(force), 2, len(TONES_HZ)))
    all_over = (
        model.ratio(posterior.at, unknown(force, np.linspace(0.01, 0.09, len(force)))) + noise[:, 0] + 1j * noise[:, 1]
    )
    below = np.vstack([all_over, -all_over[-2:]])
    sound = together.batch(all_over).force_90_n[:1000]
    assert together.batch(below).force_90_n[:1000] == pytest.approx(sound, abs=0.02)
    far = np.append(np.linspace(0.0, 0.008, 1000), [0.08, 0.08])
    near = model.ratio(posterior.at, unknown(force, far)) + noise[:, 0] + 1j * noise[:, 1]
    found = together.batch(near)
    assert np.isfinite(found.force_90_n).all()
    assert (found.force_90_n[-2:, 0] <= force[-2:]).all()
    assert (force[-2:] <= found.force_90_n[-2:, 1]).all()


@pytest.mark.parametrize("name", [pytest.param("sound", marks=pytest.mark.nightly), "1.4 x softer (aged)"])
def test_a_recheck_narrows_the_interval_again(model, specimens, name):
    widths, held = [], []
    for seed, (strip, known, posterior) in enumerate(specimens):
        other = next_day(CHANGES[name][0](strip, seed), seed)
        few = replace(data_of(run(other, 5, seed + 900), NOISE), rest_noise=np.ones(len(TONES_HZ)))
        mended = calibrated(model, few, (loosened if name == "sound" else widened)(model, posterior))
        before, _ = judged(model, (strip, known, posterior), seed, name)
        after, presses = judged(model, (strip, known, mended), seed, name, otherwise=0.0)
        widths.append([np.median(np.ptp(found.force_90_n, axis=1)) for found in (before, after)])
        held.append(inside(after, presses)[0].mean())
    assert np.mean(held) >= 0.85
    assert np.mean(widths, 0)[1] < 0.5 * np.mean(widths, 0)[0]


def test_without_presses_the_interval_has_the_range_of_the_print():
    """Gaps of 0.18 and 0.42 mm about the estimate's 0.3, and the cell as drawn."""
    model, held = model_of(printed=True), []
    for seed, gap in enumerate((0.18, 0.42, 0.0)):
        strip = drawn_at_random(seed, gap_mm=gap)
        rest = none_of(data_of(run(strip, 30, seed), NOISE))
        known = by_rest(model, rest.rest, 3e-4, rest.single)
        unseen = data_of(run(next_day(strip, seed), 60, seed + 77), NOISE)
        held.append(inside(Inverter(model, known, force_limit_n=13.0).batch(unseen.ratio), unseen.presses)[0].mean())
    assert min(held) > 0.65
    assert np.mean(held) >= 0.85


def test_a_hole_is_calibrated_and_named(model):
    known = data_of(run(replace(drawn_at_random(2), hole_ohm=1e5), 24, 2), NOISE)
    posterior = calibrated(model, known)
    made = records.Calibration("S1", "mine", "0" * 16, model, posterior, 6.0, None, ("a",))
    assert any(note.startswith("leak: ") and "has left what was expected" in note for note in made.departures())
    assert np.isfinite(posterior.covariance).all()


@pytest.mark.parametrize(("value", "is_told"), [(3.34e6, True), (9.9e6, True), (3.7e6, False)])
def test_a_material_whose_median_was_not_expected_is_named(model, specimens, monkeypatch, value, is_told):
    """Also where its interval still reaches into what was expected."""
    modulus = MaterialEstimate("x60", "youngs_modulus_pa", value, 0.8 * value, 1.2 * value, 3.68e6, 9.79e6, "presses")
    monkeypatch.setattr(records.Calibration, "materials", lambda _: [modulus])
    made = records.Calibration("S1", "mine", "0" * 16, model, specimens[0][2], 6.0, None, ("a",))
    assert [note.partition(":")[0] for note in made.departures()] == ["x60 youngs_modulus_pa"] * is_told


@pytest.mark.parametrize(
    ("answer", "jump", "tones", "noise"),
    [(1, 0.05, 1, 0.05), (0, 0.0, 1, 1.0)],
)
def test_readings_that_no_specimen_gives_are_no_singular_matrix(model, answer, jump, tones, noise):
    """Rests that jump by 5 %, of little noise; no answer to the force at all."""
    known = data_of(run(replace(drawn_at_random(2), hole_ohm=1e4), 24, 2), NOISE)
    ratio = answer * known.ratio + jump * np.random.default_rng(1).standard_normal((24, tones))
    posterior = calibrated(model, replace(known, ratio=ratio, noise=noise * known.noise))
    assert np.isfinite(posterior.at).all()
    assert np.linalg.eigvalsh(posterior.covariance).min() > 0


def test_what_a_calibration_allows_for_ends_with_a_recheck(model, specimens):
    made = records.Calibration("S1", "mine", "0" * 16, model, specimens[0][2], 6.0, None, ("a",))
    assert not made.departures()
    assert "a second press" in made.allowance[0]
    again = records.from_json(replace(made, rechecked=True).to_json())
    assert again.rechecked
    assert not again.allowance
    older = records.from_json(made.to_json().replace(', "rechecked": false', ""))
    assert not older.rechecked


def test_a_reading_that_equals_the_prediction_is_no_division_by_zero(model):
    with np.errstate(all="raise"):
        by_rest(model, model.rest(np.zeros(len(model.names))), 1e-3, 1e-3)
