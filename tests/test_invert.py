"""Force and position back from impedance: against presses that are known, the bound, SciPy, and brute force."""

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
from drawn_sensor import sensor_of
from scipy.optimize import least_squares
from scipy.stats import chi2

from sensorgen.core.errors import BadInput, OutOfRange
from sensorgen.design.design import make
from sensorgen.models.compression import unconfined
from sensorgen.models.sensor import Sensor
from sensorgen.prediction.inverse import answers
from sensorgen.prediction.inverse.estimator import Estimates, Estimator, Prior
from sensorgen.prediction.inverse.verdict import Status, chi2_limit
from sensorgen.prediction.query import TONES_HZ

TONES = np.array(TONES_HZ)
NOISE = 1e-3


@cache
def predicted():
    return sensor_of(make({"shape": "tri", "parameters": {"dielectric_mm": 0.1}})).sensor


def tri(resistivity_ohm_m, **changes):
    return dataclasses.replace(predicted(), resistivity_ohm_m=(resistivity_ohm_m,) * 2, **changes)


SENSORS = {
    "eTPU at 0.83 ohm m": (1 / 1.2, TONES),
    "5 ohm m": (5.0, TONES),
    "5 ohm m, tones to 1 MHz": (5.0, TONES * 10),
}


def sensor_and_tones(name):
    """A sensor and its tones."""
    resistivity, tones = SENSORS[name]
    return tri(resistivity), tones


def everything(**changes):
    return tri(
        2.0, tan_delta=0.02, leak_s_per_m=1e-6, piezoresistance_per_pa=(2.4e-6, -1.2e-6), electrode_m=(3e-4, 5e-4),
        tip_m=0.012, **{"far_end": 5e4} | changes,
    )  # fmt: skip


# the thesis's plate, Table 3.1, with the mean resistivity of Table C.1
PLATE = Sensor(0.1, 0.01, (3e-4, 3e-4), (0.135, 0.135), 8.8541878128e-12 * 4.68 * 0.01 / 6e-4, unconfined(6e6))


def presses(count, sensor=None, force=(0.2, 6.0), seed=1, ends=0.0):
    rng = np.random.default_rng(seed)
    length = 0.1 if sensor is None else sensor.length_m
    return rng.uniform(*force, count), rng.uniform(ends, length - ends, count)


def readings(sensor, tones, force, position):
    return sensor.impedance(tones, np.asarray(force)[:, None], np.asarray(position)[:, None])


def estimate(sensor, tones, z, *how):
    return Estimator(sensor, tones, *how).batch(z)


def noisy(z, noise=NOISE, seed=2):
    rng = np.random.default_rng(seed)
    return z * (1 + noise * (rng.normal(size=z.shape) + 1j * rng.normal(size=z.shape)))


def bound(sensor, tones, force, position, noise=NOISE):
    """Cramer-Rao bound from the sensor's own derivatives, the noise being relative to the impedance."""
    z, by_force, by_position = sensor.response(tones, force, position)
    j = np.stack([by_force / abs(z), by_position / abs(z)], -1) / noise
    return np.linalg.inv((j.conj().T @ j).real)


@pytest.mark.parametrize("name", ["eTPU at 0.83 ohm m", "5 ohm m, tones to 1 MHz"])
def test_without_noise_every_press_comes_back(name):
    sensor, tones = sensor_and_tones(name)
    force, position = presses(500)
    found = estimate(sensor, tones, readings(sensor, tones, force, position))
    told = found.status <= Status.AMBIGUOUS
    assert told.mean() > 0.9
    assert abs(found.force_n - force)[told].max() < 1e-9
    assert abs(found.position_m - position)[told].max() < 1e-8
    assert found.chi2[told].max() < 1e-6


def test_a_sensor_with_everything_comes_back():
    force, position = presses(500)
    found = estimate(everything(), TONES * 10, readings(everything(), TONES * 10, force, position))
    told = found.status <= Status.AMBIGUOUS
    assert told.mean() > 0.8
    near = (abs(found.force_n - force) < 1e-9) & (abs(found.position_m - position) < 1e-8)
    assert near[told].mean() > 0.995
    assert (found.chi2 < 0.01)[told].all()  # the others stop where the response folds back, far within the noise
    assert (np.sqrt(found.covariance[told & ~near, 0, 0]) > 0.2).all()


def test_it_is_the_least_squares_solution():
    sensor, tones = sensor_and_tones("5 ohm m, tones to 1 MHz")
    force, position = presses(15, force=(1.0, 6.0), ends=0.015)
    z = noisy(readings(sensor, tones, force, position))
    found = estimate(sensor, tones, z)
    for k in range(len(z)):

        def residual(p, k=k):
            off = np.log(z[k] / sensor.impedance(tones, p[0], p[1] / 100)) / NOISE
            return np.concatenate([off.real, off.imag])

        start, border = (force[k], position[k] * 100), ([0.0, 0.0], [13.0, 10.0])
        peer = least_squares(residual, start, bounds=border, x_scale=(0.2, 0.2), xtol=1e-12, ftol=1e-14)
        covariance = np.linalg.inv(peer.jac.T @ peer.jac)
        deviation = np.sqrt(np.diag(covariance))
        assert abs(found.force_n[k] - peer.x[0]) < 0.02 * deviation[0]
        assert abs(found.position_m[k] * 100 - peer.x[1]) < 0.02 * deviation[1]
        assert found.chi2[k] == pytest.approx(2 * peer.cost, rel=1e-3)
        # 0.9 % at 1 N, the first solved stress of the cell, where the law's slope bends; elsewhere 0.3 %
        assert np.sqrt(found.covariance[k, 0, 0]) == pytest.approx(deviation[0], rel=1e-2)
        assert found.covariance[k, 0, 1] * 100 == pytest.approx(covariance[0, 1], abs=0.02 * deviation.prod())


@pytest.mark.parametrize(
    ("name", "force", "position"),
    [
        ("5 ohm m, tones to 1 MHz", 3.0, 0.045), ("eTPU at 0.83 ohm m", 6.0, 0.045),
    ],
)  # fmt: skip
def test_with_noise_it_is_at_the_bound_and_intervals_cover(name, force, position):
    sensor, tones = sensor_and_tones(name)
    z = noisy(np.tile(sensor.impedance(tones, force, position), (4000, 1)))
    found = estimate(sensor, tones, z)
    limit = bound(sensor, tones, force, position)
    assert np.mean(found.status == Status.NO_FIT) < 1e-3
    assert np.mean(found.status <= Status.AT_THE_END) > 0.999
    off = np.stack([found.force_n - force, found.position_m - position])
    rms = np.sqrt(np.mean(off**2, 1))
    assert rms == pytest.approx(np.sqrt(np.diag(limit)), rel=0.1, abs=0)
    assert np.corrcoef(off)[0, 1] == pytest.approx(limit[0, 1] / np.sqrt(limit[0, 0] * limit[1, 1]), abs=0.05)
    for interval, truth in ((found.force_90_n, force), (found.position_90_m, position)):
        assert 0.88 <= np.mean((interval[:, 0] < truth) & (truth < interval[:, 1])) <= 0.92
    assert np.mean(found.chi2) == pytest.approx(2 * len(tones) - 2, rel=0.02)
    assert np.median(np.sqrt(found.covariance[:, 1, 1])) == pytest.approx(np.sqrt(limit[1, 1]), rel=0.05)


def test_a_press_at_no_force_has_no_position():
    sensor, tones = sensor_and_tones("5 ohm m")
    found = estimate(sensor, tones, readings(sensor, tones, [0.0, 0.0, 0.001], [0.02, 0.05, 0.07]))
    assert set(found.status.tolist()) == {Status.FORCE_ONLY}
    assert abs(found.force_n - [0, 0, 0.001]).max() < 2e-3
    assert np.isfinite(found.force_n).all()
    assert not np.isnan(found.covariance).any()


def test_the_thesis_plate_senses_neither():
    z = noisy(np.tile(PLATE.impedance(TONES, 6.0, 0.05), (200, 1)))
    found = estimate(PLATE, TONES, z)
    assert np.median(found.status) >= Status.FORCE_ONLY
    six = Estimator(PLATE, TONES, force_limit_n=6.0).batch(z)
    assert np.mean(six.status == Status.NOT_IDENTIFIABLE) > 0.9
    deviation = np.sqrt(np.diag(bound(PLATE, TONES, 6.0, 0.05)))
    assert deviation == pytest.approx([2.23, 0.225], rel=0.02)


def test_noise_above_the_signal_says_nothing():
    sensor, tones = sensor_and_tones("5 ohm m, tones to 1 MHz")
    z = noisy(readings(sensor, tones, *presses(300)), 0.5)
    found = estimate(sensor, tones, z, 0.5)
    assert np.mean(found.status == Status.NOT_IDENTIFIABLE) > 0.9  # the logarithm of such noise has a long tail: no fit
    assert (found.status >= Status.NOT_IDENTIFIABLE).mean() > 0.96
    assert not np.isnan(found.force_n).any()
    known = estimate(sensor, tones, z[:60], 0.5, Prior())  # nothing is left but the prior
    assert np.median(known.force_n) == pytest.approx(6.5, abs=1.0)
    assert np.median(known.position_m) == pytest.approx(0.05, abs=0.01)
    assert np.median(np.sqrt(known.covariance[:, 1, 1])) == pytest.approx(0.1 / math.sqrt(12), rel=0.15)


@pytest.mark.parametrize(("square", "status"), [(36.0, Status.OK), (46.0, Status.NO_FIT)])
def test_the_limit_counts_two_numbers_per_tone_less_force_and_position(square, status):
    """Chi-squared with 12 degrees of freedom exceeds 39.1 once in 10 000 times, with 14 it exceeds 42.6."""
    sensor, tones = sensor_and_tones("5 ohm m")
    z, wrong = readings(sensor, tones, [3.0], [0.05]), 1e-3 * np.array([1, -1, 1j, -1j, 1, 1j, -1])
    first = estimate(sensor, tones, z * np.exp(wrong)).chi2[0]
    reading = z * np.exp(wrong * math.sqrt(square / first))
    found = estimate(sensor, tones, reading)
    assert found.chi2[0] == pytest.approx(square, rel=0.05)
    assert found.status.tolist() == [status]


@pytest.mark.parametrize("degrees", [4, 40])
def test_no_fit_is_one_sample_in_ten_thousand(degrees):
    assert chi2_limit(np.array([degrees]))[0] == pytest.approx(chi2.isf(1e-4, degrees), rel=0.04)


def test_a_press_beyond_the_border_lies_on_it():
    sensor, tones = sensor_and_tones("5 ohm m")
    z = readings(sensor, tones, [6.0], [0.05])
    found = Estimator(sensor, tones, force_limit_n=5.9).batch(z)
    assert found.status.tolist() == [Status.AT_THE_END]
    assert found.force_n[0] == pytest.approx(5.9)
    near = Estimator(sensor, tones).batch(noisy(readings(sensor, tones, [0.05] * 400, [0.05] * 400)))
    assert (near.force_n >= 0).all()
    assert ((near.position_m >= 0) & (near.position_m <= 0.1)).all()


@pytest.mark.parametrize("missing", [complex(np.nan, 1.0), 0.0])
def test_missing_tones_do_not_count(missing):
    sensor, tones = sensor_and_tones("5 ohm m, tones to 1 MHz")
    force, position = presses(500, force=(1.0, 6.0), ends=0.01)
    z = readings(sensor, tones, force, position)
    z[:, 2] = missing
    z[::2, 5] = missing
    found = estimate(sensor, tones, z)
    told = found.status <= Status.AMBIGUOUS
    assert told.all()
    assert abs(found.position_m - position)[told].max() < 1e-8
    assert found.tones.tolist() == [5, 6] * 250
    fewer = estimate(sensor, np.delete(tones, 2), np.delete(z, 2, 1)[1::2])
    assert found.covariance[1::2] == pytest.approx(fewer.covariance, rel=1e-4, abs=0)


def test_nothing_measured_is_missing():
    sensor, tones = sensor_and_tones("5 ohm m")
    z = np.concatenate([readings(sensor, tones, [3.0], [0.05]), np.full((1, 7), np.nan), np.zeros((1, 7))])
    found = estimate(sensor, tones, z)
    assert found.status.tolist() == [Status.OK, Status.MISSING, Status.MISSING]
    assert np.isnan(found.force_n).tolist() == [False, True, True]
    assert found.tones.tolist() == [7, 0, 0]


def test_one_tone_works_and_says_so():
    sensor = tri(5.0)
    estimator = Estimator(sensor, [99.7e3])
    assert "bad readings cannot be detected" in estimator.doubts[0]
    assert Estimator(sensor, [1e4, 1e5]).doubts == ()
    force, position = presses(300, force=(1.0, 6.0), ends=0.01)
    z = readings(sensor, [99.7e3], force, position)
    found = estimator.batch(z)
    assert np.mean(found.chi2 < 1e-6) > 0.99
    exact = found.chi2 < 1e-6
    found, z, position = estimator.batch(z[exact]), z[exact], position[exact]
    back = readings(sensor, [99.7e3], found.force_n, found.position_m)
    assert abs(back / z - 1).max() < 1e-9
    hit = abs(found.position_m - position) < 1e-8
    other = abs(found.other_position_m - position) < 1e-4
    assert (hit | other | (found.status >= Status.AT_THE_END)).all()


def test_both_presses_are_told():
    """Behind the tip's last full place the pressed length shrinks, so that two presses may read alike."""
    sensor, tones = sensor_and_tones("eTPU at 0.83 ohm m")
    force, position = presses(4000, force=(3.0, 6.0))
    z = readings(sensor, tones, force, position)
    found = estimate(sensor, tones, z)
    two = np.flatnonzero(found.status == Status.AMBIGUOUS)
    assert len(two) > 5
    other = readings(sensor, tones, found.other_force_n[two], found.other_position_m[two])
    off = np.log(other / z[two])
    distance = (np.sum(abs(off) ** 2, 1)) / NOISE**2
    assert (distance < 9.3).all()
    assert np.median(abs(found.other_position_m - found.position_m)[two]) > 3e-3
    assert np.isnan(found.other_force_n[found.status == Status.OK]).all()


def test_both_presses_are_written_in_newtons_and_millimetres():
    sensor, tones = sensor_and_tones("eTPU at 0.83 ohm m")
    found = estimate(sensor, tones, readings(sensor, tones, [4.2], [0.0905]))
    row = dict(zip(answers.COLUMNS, answers.rows([[]], found).strip().split(","), strict=True))
    assert row["status"] == "two presses"
    other = readings(sensor, tones, [float(row["other_force_n"])], [float(row["other_position_mm"]) * 1e-3])
    assert np.sum(abs(np.log(other / readings(sensor, tones, [4.2], [0.0905]))) ** 2) / NOISE**2 < 9.3
    assert float(row["other_position_mm"]) > 95


def test_brute_force_finds_no_third_and_no_better_press():
    sensor, tones = sensor_and_tones("5 ohm m, tones to 1 MHz")
    force, position = presses(10, force=(0.5, 6.0), seed=7)
    z = noisy(readings(sensor, tones, force, position), seed=8)
    found = estimate(sensor, tones, z)
    f, x = np.meshgrid(np.linspace(0, 13, 261), np.linspace(0, 0.1, 401), indexing="ij")
    grid = np.log(sensor.impedance(tones[:, None, None], f, x))
    for k in range(len(z)):
        square = (abs(np.log(z[k])[:, None, None] - grid) ** 2).sum(0) / NOISE**2
        assert found.chi2[k] <= square.min() + 1e-3


def test_streams_and_batches_agree():
    sensor, tones = sensor_and_tones("5 ohm m")
    force, position = presses(120, force=(0.0, 6.0))
    z = noisy(readings(sensor, tones, force, position))
    z[5, 2] = np.nan
    estimator = Estimator(sensor, tones)
    batch, stream = estimator.batch(z), Estimates.joined([estimator.batch(row[None]) for row in z])
    assert stream.status.tolist() == batch.status.tolist()
    told = batch.status <= Status.AMBIGUOUS
    for name, error in (("force_n", 0), ("position_m", 1)):
        off = (getattr(stream, name) - getattr(batch, name))[told]
        assert (abs(off) < 0.05 * np.sqrt(batch.covariance[told, error, error])).all()
    # blocks of other sizes are rounded otherwise, by processor, so that a descent may end a step earlier
    assert stream.covariance[told] == pytest.approx(batch.covariance[told], rel=5e-3)
    inner = told & (force > 1.0) & (abs(position - 0.05) < 0.04)
    ohm, *by = sensor.response(tones, force[inner, None], position[inner, None])
    j = np.stack(by, -1) / abs(ohm)[..., None] / NOISE
    least = np.linalg.inv((j.conj().transpose(0, 2, 1) @ j).real)[:, 0, 1]
    assert np.median(batch.covariance[inner, 0, 1] / least) == pytest.approx(1, abs=0.1)


def test_blocks_do_not_show():
    sensor, tones = sensor_and_tones("5 ohm m")
    force, position = presses(9_000)
    z = noisy(readings(sensor, tones, force, position))
    estimator = Estimator(sensor, tones)
    whole, part = estimator.batch(z), estimator.batch(z[8_500:8_600])
    # blocks of other sizes are rounded otherwise, by processor, so that a descent may end a step earlier
    assert whole.force_n[8_500:8_600] == pytest.approx(part.force_n, rel=1e-5)
    assert whole.force_n.shape == (9_000,)
    assert whole.covariance.shape == (9_000, 2, 2)
    assert estimator.batch(z[:0]).force_n.shape == (0,)


def test_a_wide_posterior_is_better_than_least_squares():
    """Noise above signal: presses from the prior, so that the posterior mean has the least error that there is."""
    rng = np.random.default_rng(5)
    force, position = rng.uniform(0, 6, 300), rng.uniform(0, 0.1, 300)
    z = noisy(readings(PLATE, TONES, force, position), 3e-3)
    plain = Estimator(PLATE, TONES, 3e-3, force_limit_n=6.0).batch(z)
    known = Estimator(PLATE, TONES, 3e-3, Prior(), force_limit_n=6.0).batch(z)

    def rms(found):
        return np.sqrt(np.mean((found.force_n - force) ** 2)), np.sqrt(np.mean((found.position_m - position) ** 2))

    (force_ls, position_ls), (force_map, position_map) = rms(plain), rms(known)
    assert force_map < 0.8 * force_ls
    assert position_map < 0.8 * position_ls
    assert force_map < 1.02 * 6 / math.sqrt(12)  # a guess, the middle of the range
    assert position_map < 1.02 * 0.1 / math.sqrt(12)
    for interval, truth in ((known.force_90_n, force), (known.position_90_m, position)):
        assert 0.86 < np.mean((interval[:, 0] < truth) & (truth < interval[:, 1])) < 0.94
    assert np.mean(known.covariance[:, 0, 0]) == pytest.approx(force_map**2, rel=0.1)


def test_the_posterior_is_bayes_by_brute_force():
    prior = Prior(force_n=(2.0, 1.5), position_m=(0.06, 0.02))
    sensor, tones = sensor_and_tones("eTPU at 0.83 ohm m")
    noise = 4e-3
    z = noisy(readings(sensor, tones, [1.5, 3.0, 0.3], [0.05, 0.08, 0.06]), noise)
    found = Estimator(sensor, tones, noise, prior, force_limit_n=8.0).batch(z)
    f, x = np.meshgrid((np.arange(400) + 0.5) / 50, (np.arange(200) + 0.5) / 2000, indexing="ij")
    grid = np.log(sensor.impedance(tones[:, None, None], f, x))
    for k in range(len(z)):
        square = (abs(np.log(z[k])[:, None, None] - grid) ** 2).sum(0) / noise**2
        square += ((f - 2.0) / 1.5) ** 2 + ((x - 0.06) / 0.02) ** 2
        weight = np.exp((square.min() - square) / 2)
        weight /= weight.sum()
        means = (weight * f).sum(), (weight * x).sum()
        square = [(weight * (of - mean) ** 2).sum() for of, mean in zip((f, x), means, strict=True)]
        assert found.force_n[k] == pytest.approx(means[0], abs=0.02)
        assert found.position_m[k] == pytest.approx(means[1], abs=5e-4)
        assert np.sqrt(np.diag(found.covariance[k])) == pytest.approx(np.sqrt(square), rel=0.03)


@pytest.mark.parametrize(
    ("tones", "noise", "error", "words"),
    [
        ([1e3, 1e3], 1e-3, OutOfRange, "the same frequency twice"), ([0.0], 1e-3, OutOfRange, "a frequency of 0 Hz"),
        ([], 1e-3, BadInput, "expected a list"), (["a"], 1e-3, BadInput, "Hz"),
        ([1e3], 0.0, OutOfRange, "a noise of 0"), ([1e3], 2.0, OutOfRange, "noise"),
    ],
)  # fmt: skip
def test_what_is_refused(tones, noise, error, words):
    with pytest.raises(error, match=words):
        Estimator(PLATE, tones, noise)


@pytest.mark.parametrize("z", [np.ones((2, 6)), [["a"] * 7]])
def test_readings_of_another_shape_are_refused(z):
    with pytest.raises(BadInput, match="readings"):
        Estimator(PLATE, TONES).batch(z)


@pytest.mark.parametrize("normal", [(1.0, 0.0), (np.nan, 1.0)])
def test_a_prior_that_is_none(normal):
    with pytest.raises(OutOfRange, match="standard deviation above 0"):
        Prior(force_n=normal)


def test_the_force_limit_is_what_the_sensor_bears():
    soft = dataclasses.replace(PLATE, compression=unconfined(1e5))
    estimator = Estimator(soft, TONES)
    assert estimator.scale[0] == pytest.approx(0.01 * 0.005 * 1e5, rel=1e-5)  # half the tip on the sensor
    with pytest.raises(OutOfRange, match="force limit"):
        Estimator(soft, TONES, force_limit_n=0.0)


def test_a_pressure_that_is_not_uniform_is_refused():
    sensor, tones = sensor_and_tones("5 ohm m")
    with pytest.raises(OutOfRange, match="a tip of profile 'hertz': only uniform pressure can be inverted"):
        Estimator(dataclasses.replace(sensor, profile="hertz"), tones)
