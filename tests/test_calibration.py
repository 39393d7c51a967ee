"""Calibration of a specimen and inversion of its readings, held against specimens that share no line with them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from sensorgen.core.errors import BadInput
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.calibration import calibration as records
from sensorgen.prediction.calibration import inversion
from sensorgen.prediction.calibration.calibration import coverage_of, held_out, inside
from sensorgen.prediction.calibration.fitting import by_rest, calibrated, gain, prior, shared, widened
from sensorgen.prediction.calibration.inversion import Inverter, Verdict
from sensorgen.prediction.calibration.rest import Rest, checked
from sensorgen.prediction.calibration.specimen import Spread, unknown
from sensorgen.prediction.inverse.estimator import Estimator, Prior
from virtual_specimen import TONES_HZ, drawn, session
from virtual_specimen.adapter import ERRORS, LIMIT_N, data, specimen_model, split


@pytest.fixture(scope="module")
def model():
    return specimen_model()


@pytest.fixture(scope="module")
def one(model):
    """A specimen with all errors at once, its presses, and its calibration."""
    truth = drawn(2)
    known, others = split(truth, 30, 200, 2)
    return truth, data(known, truth), data(others, truth), calibrated(model, data(known, truth))


def test_without_errors_the_model_is_the_line_sensor(model):
    at = np.zeros(len(model.names))
    clean = replace(model, spread=Spread(leak=1e-12, dispersion=1e-12, lead_ohm=1e-9, stray_f=1e-24))
    force, place = np.array([0.5, 3.0]), np.array([0.02, 0.07])
    sensor: Sensor = model.sensor
    z = [sensor.impedance(TONES_HZ, f, x) for f, x in zip(force, place, strict=True)]
    rest = sensor.impedance(TONES_HZ, 0.0, 0.05)
    assert clean.rest(at) == pytest.approx(np.log(rest), rel=1e-9)
    assert clean.ratio(at, unknown(force, place)) == pytest.approx(np.log(np.array(z) / rest), abs=1e-9)


def test_tones_do_not_average_out_the_gain_that_they_share(model):
    """Half of its variance is common to all: an error of ln Z, and so of ln C, however many tones are read."""
    spread = Spread(leak=1e-12, dispersion=1e-12, lead_ohm=1e-9, stray_f=1e-24)
    many = replace(model, spread=spread, frequency_hz=np.geomspace(1e3, 1e4, 300))
    found = by_rest(many, many.rest(np.zeros(len(many.names))) + 1e-3, 1e-6, 1e-6)
    at = many.names.index("capacitance")
    error, common = spread.capacitance * np.sqrt(found.covariance[at, at]), spread.gain / np.sqrt(2)
    assert error == pytest.approx(1 / np.hypot(1 / common, 1 / spread.capacitance), rel=0.02)


@pytest.mark.parametrize("step", [0.7, 1.5])
def test_a_grid_as_coarse_as_a_reading_tells_has_the_quantiles_of_the_density(step):
    """Normal densities of standard deviation 1, cut off by an end of the grid or not, at points ``step`` apart."""
    grid, middle = np.arange(0.0, 20.0, step), np.linspace(0.5, 12.0, 200)
    weight = np.diff(np.concatenate([grid[:1], (grid[1:] + grid[:-1]) / 2, grid[-1:]]))
    edges, share = inversion._finer(grid, weight[:, None] * norm.pdf(grid[:, None], middle))
    found = inversion._quantiles(edges, share, (0.05, 0.95))
    below = norm.cdf(-middle)  # outside of the grid
    exact = norm.ppf(below[:, None] + (1 - below[:, None]) * [0.05, 0.95]) + middle[:, None]
    assert found == pytest.approx(exact, abs=0.06)
    assert np.ptp(found, axis=1).mean() == pytest.approx(np.ptp(exact, axis=1).mean(), rel=0.0125)  # 9 % by even cells
    ends, inside = inversion._densest(edges, share, 0.9), middle > 4
    assert np.ptp(ends, axis=1)[inside].mean() == pytest.approx(2 * norm.ppf(0.95), rel=0.015)


def test_intervals_of_a_known_sensor_hold_nine_tenths_of_the_presses_that_were_expected(model):
    """Presses drawn from the prior of force and position, readings with their noise alone: 90 %, not 92 %."""
    noise, rng = np.full(len(TONES_HZ), 1e-3), np.random.default_rng(5)
    known, none = prior(model, noise), (0.0, 1e-6)
    known = replace(known, scatter=1e-7, wander_c=1e-8, wander_r=1e-8, unloading=none, decades=none)
    known = replace(known, covariance=1e-10 * known.covariance)
    presses = unknown(rng.uniform(0, LIMIT_N, 3000), rng.uniform(0, model.sensor.length_m, 3000))
    white = rng.standard_normal((2, 3000, len(TONES_HZ)))
    ratio = model.ratio(known.at, presses) + noise * (white[0] + 1j * white[1])
    found = Inverter(model, known, force_limit_n=LIMIT_N).batch(ratio)
    covered = [mask.mean() for mask in inside(found, presses)]
    assert covered == pytest.approx([0.9, 0.9], abs=0.016)  # three standard deviations


@pytest.mark.parametrize(
    "error",
    [pytest.param("C +1 %", marks=pytest.mark.nightly), "gain 0.3 %, 20 ohm, 0.3 pF, E -5 %"],
)
def test_an_error_of_the_model_no_longer_misleads(model, error):
    truth = ERRORS[error](1)
    known, others = split(truth, 30, 200, 1)
    known, unseen = data(known, truth), data(others, truth)
    exact = Estimator(model.sensor, TONES_HZ, truth.noise, force_limit_n=LIMIT_N).batch(others.pressed_ohm)
    assert inside(exact, unseen.presses)[0].mean() < 0.8  # the planted error, seen without calibration
    inverter = Inverter(model, calibrated(model, known), force_limit_n=LIMIT_N)
    found = coverage_of(inverter.batch(unseen.ratio), unseen.presses)
    assert found.force >= 0.85 * found.presses
    assert found.position >= 0.85 * found.presses


@pytest.mark.parametrize("scale", [1.0, pytest.param(2.0, marks=pytest.mark.nightly)])
def test_intervals_hold_on_specimens_with_all_errors_at_once(model, scale):
    """Some of the specimens of bench/coverage.py, which has 200 of each kind."""
    shares = []
    for seed in range(3):
        truth = drawn(seed, scale)
        known, others = split(truth, 30, 200, seed)
        found = Inverter(model, calibrated(model, data(known, truth)), force_limit_n=LIMIT_N)
        shares.append([np.mean(x) for x in inside(found.batch(data(others, truth).ratio), data(others, truth).presses)])
    assert 0.82 <= np.mean(shares, axis=0).min() <= np.mean(shares, axis=0).max() <= 0.97
    assert np.min(shares) >= 0.75


def test_never_calibrated_is_said_and_holds(model, one):
    _, _, unseen, _ = one
    found = Inverter(model, prior(model, unseen.noise[0]), force_limit_n=LIMIT_N).batch(unseen.ratio)
    said = coverage_of(found, unseen.presses)
    assert min(said.force, said.position) >= 0.85 * said.presses
    assert (found.verdict != Verdict.OK).all()
    assert (found.verdict == Verdict.NOT_CALIBRATED).sum() > 100
    calibrated_ = coverage_of(Inverter(model, one[3], force_limit_n=LIMIT_N).batch(unseen.ratio), unseen.presses)
    assert calibrated_.force_width_n < said.force_width_n / 2


def test_what_is_told_is_found(model, one, stored):
    truth, known, _, found = one
    values = {v.name: v for v in stored.values()}
    assert values["resistance"].lower < truth.track_ohm_per_m * 0.1 < values["resistance"].upper
    c_pf = 64.256829 * np.exp(truth.capacitance)
    assert values["capacitance"].lower < c_pf < values["capacitance"].upper
    assert "lead" in stored.unidentified
    told = gain(model, known, found.at)
    assert np.abs(told.real - np.real(truth.gain)).max() < 8e-3


@pytest.fixture(scope="module")
def held_back(model, one):
    """Each known press found again from the others."""
    return held_out(model, one[1], LIMIT_N)


@pytest.fixture(scope="module")
def stored(model, one, held_back):
    """A calibration as the log keeps it."""
    found, held = one[3], held_back[0]
    return records.Calibration("S1", "mine", "0" * 16, model, found, 6.0, held, ("a",), (1e-3 + 0j,) * 7, ("n",))


def test_its_own_check_on_presses_held_back(model, one, held_back):
    _, known, unseen, found = one
    held, again = held_back
    true = coverage_of(Inverter(model, found, force_limit_n=LIMIT_N).batch(unseen.ratio), unseen.presses)
    assert held.presses == len(again.force_n) == 30
    assert held.force_width_n == pytest.approx(true.force_width_n, rel=0.4)
    assert held_out(model, known.rows(np.arange(9)), LIMIT_N) is None


def test_a_calibration_comes_back_from_the_log_as_it_was(stored, one):
    again = records.from_json(stored.to_json())
    assert again.to_json() == stored.to_json()
    inverters = [Inverter(r.model, r.posterior, force_limit_n=LIMIT_N) for r in (stored, again)]
    found = [inverter.batch(one[2].ratio[:20]).force_n for inverter in inverters]
    assert (found[0] == found[1]).all()


@pytest.mark.parametrize(
    "change",
    [
        lambda t: t.replace('"schema": 2', '"schema": 9'), lambda t: t.replace('"leak"', '"rust"', 1),
        lambda _: "[]", lambda t: t.replace('"at"', '"it"'),
    ],
)  # fmt: skip
def test_what_is_no_calibration_is_refused(stored, change):
    with pytest.raises(BadInput):
        records.from_json(change(stored.to_json()))


def test_specimens_of_one_bench_share_what_is_its_own(model):
    truths = [replace(drawn(seed), stray_f=2e-12, force_offset_n=0.15) for seed in range(3)]
    alone = [calibrated(model, data(session(truth, 30, seed), truth)) for seed, truth in enumerate(truths)]
    names = ("lead", "stray", "force offset", "position offset")
    together = shared([model] * 3, alone, names)
    k = [model.names.index(name) for name in names]
    assert all((p.at[k] == together[0].at[k]).all() or p.at[k] == pytest.approx(together[0].at[k]) for p in together)
    for before, after in zip(alone, together, strict=True):
        assert (np.diag(after.covariance) <= np.diag(before.covariance) + 1e-12).all()
        assert np.linalg.eigvalsh(after.covariance).min() > 0
    assert np.sqrt(together[0].covariance[k[2], k[2]]) < 0.8 * np.sqrt(alone[0].covariance[k[2], k[2]])


def test_another_tip_alarms_and_few_presses_mend_it(model):
    """Over specimens: 5 presses with an 8 mm tip, after a calibration with one of 5 mm."""
    shares = []
    for seed in range(3):
        truth, other = drawn(seed), replace(drawn(seed), tip_m=8e-3)
        old = calibrated(model, data(session(truth, 30, seed), truth))
        known, unseen = (data(part, other) for part in split(other, 5, 200, seed))
        for posterior in (old, calibrated(model, known, widened(model, old))):
            found = Inverter(model, posterior, force_limit_n=LIMIT_N).batch(unseen.ratio)
            shares.append(inside(found, unseen.presses)[0].mean())
    assert np.mean(shares[::2]) < 0.6
    assert np.mean(shares[1::2]) > 0.8


def test_a_spoilt_tone_is_left_out(model, one):
    _, _, unseen, found = one
    inverter = Inverter(model, found, force_limit_n=LIMIT_N)
    good, spoilt = unseen.ratio[:60], unseen.ratio[:60].copy()
    spoilt[:, 3] += 0.05
    sound, mended = inverter.batch(good), inverter.batch(spoilt)
    assert (mended.tones == 6).all()
    assert not (mended.verdict == Verdict.NO_FIT).any()
    assert np.median(np.abs(mended.force_n - sound.force_n)) < 0.3
    spoilt[:, :5] += np.array([0.4, -0.3, 0.2, 0.1j, -0.2j])
    assert (inverter.batch(spoilt).verdict == Verdict.NO_FIT).all()


def test_missing_tones_stale_rests_and_priors(model, one):
    _, _, unseen, found = one
    inverter = Inverter(model, found, force_limit_n=LIMIT_N)
    ratio = unseen.ratio[:6].copy()
    ratio[0, 2] = np.nan
    ratio[1] = np.nan
    at = inverter.batch(ratio, np.array([1.0, 1.0, 14.0, 16.0, 1e6, 1.0]))
    assert at.tones.tolist() == [6, 0, 7, 7, 7, 7]
    assert np.isnan(at.force_n[1])
    words = [Verdict(v).words for v in at.verdict]
    assert words[1] == "missing"
    assert words[3:5] == ["stale rest"] * 2
    sharp = Inverter(model, found, Prior(force_n=(2.0, 0.05)), LIMIT_N).batch(unseen.ratio[:6])
    assert sharp.force_n == pytest.approx(2.0, abs=0.2)
    with pytest.raises(BadInput, match="a column for each calibrated tone"):
        inverter.batch(ratio[:, :3])


def test_the_latest_reading_at_rest_counts():
    z = np.array([[100.0], [102.0], [50.0], [0.0], [200.0], [50.0]], complex)
    at_rest = np.array([True, True, False, False, True, False])
    rest = Rest()
    ratio, age, _ = rest.ratios(z[:3], at_rest[:3], np.arange(3.0))
    more, later, _ = rest.ratios(z[3:], at_rest[3:], np.array([3.0, 4.0, 9.0]))
    found = np.exp(np.concatenate([ratio, more])[:, 0])
    assert found[[2, 5]] == pytest.approx([50 / 101, 0.25])
    assert np.isnan(found[[0, 1, 3, 4]]).all()
    assert [*age, *later] == [0, 0, 1, 2, 0, 5]


def test_old_readings_at_rest_and_those_of_before_do_not_count():
    """Of a drifting specimen, only rest readings of the last 15 s are averaged; the stream's replace a given file."""
    z = np.array([[100.0], [200.0], [202.0], [50.0]], complex)
    at_rest = np.array([True, True, True, False])
    ratio, *_ = Rest().ratios(z, at_rest, np.array([0.0, 100.0, 101.0, 102.0]))
    assert np.exp(ratio[3, 0]) == pytest.approx(50 / 201)
    given = Rest(np.full((9, 1), 400 + 0j))
    first, *_ = given.ratios(z[3:], at_rest[3:], np.full(1, np.nan))
    later, age, _ = given.ratios(z[1:], at_rest[1:], np.array([100.0, 101.0, 130.0]))
    assert np.exp([first[0, 0], later[2, 0]]) == pytest.approx([50 / 400, 50 / 201])
    assert age[2] == 29


def test_noise_is_told_by_readings_at_rest():
    rng = np.random.default_rng(1)
    z = 1e5 * (1 + np.linspace(0, 0.05, 400)[:, None] + rng.normal(0, [1e-3, 4e-3], (400, 2)) * (1 + 0j))
    z = z + 1j * 1e5 * rng.normal(0, [1e-3, 4e-3], (400, 2))
    rest = Rest()
    rest.ratios(z, np.ones(400, bool), np.arange(400.0))
    assert rest.noise() == pytest.approx(np.array([1e-3, 4e-3]), rel=0.12)
    assert Rest(z[:5]).noise() == 1e-3
    one_by_one = Rest()
    for row in z:
        one_by_one.ratios(row[None], np.ones(1, bool), np.zeros(1))
    assert one_by_one.noise() == pytest.approx(rest.noise())


def test_other_tones_are_refused():
    assert checked(TONES_HZ[::-1], TONES_HZ).tolist() == [6, 5, 4, 3, 2, 1, 0]
    with pytest.raises(BadInput, match=r"readings at 1\.1, 2\.3 kHz; expected 1\.1, 2\.3, 5\.3"):
        checked(TONES_HZ[:2], TONES_HZ)


@pytest.mark.parametrize("bad", [{"force_n": 0.0}, {"capacitance": np.nan}])
def test_a_prior_that_is_none_is_refused(bad):
    with pytest.raises(BadInput, match="above 0"):
        Spread(**bad)
