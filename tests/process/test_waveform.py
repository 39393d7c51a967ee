"""Demodulation against signals that are known in closed form."""

import numpy as np
import pytest

from sensorgen.core.errors import OutOfRange
from sensorgen.measure.signal.waveform import clipped, phasors, window_samples

TONES = np.array([1100.0, 2300, 5300, 10100, 19900, 49900, 99700])
WEIGHTS = np.array([10, 7, 4.5, 3, 2, 1.5, 1])
RATE = 1e6
Z = 1000 / (1 + 1j * TONES / 2e4) + 50 + 3j


def waveforms(windows=4, bits=0, seed=0):
    t = np.arange(round(windows * RATE * 0.01)) / RATE
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(TONES))
    current = WEIGHTS / WEIGHTS.sum() * 1e-3 * np.exp(1j * phase)
    wave = np.exp(2j * np.pi * ((TONES * t[:, None]) % 1))
    u, i = (wave * (current * Z)).real.sum(axis=1), (wave * current).real.sum(axis=1)
    if bits:
        steps = [1.05 * np.abs(x).max() / 2 ** (bits - 1) for x in (u, i)]
        rng = np.random.default_rng(9)
        u, i = (
            np.round(x / step + rng.uniform(-0.5, 0.5, len(x))) * step for x, step in zip((u, i), steps, strict=True)
        )
    return u, i, current


def test_seven_tones_without_noise():
    u, i, current = waveforms()
    found = phasors(u, RATE, TONES) / phasors(i, RATE, TONES)
    assert np.abs(found / Z - 1).max() < 4e-13
    np.testing.assert_allclose(phasors(i, RATE, TONES), np.tile(current, (4, 1)), rtol=4e-13)


@pytest.mark.parametrize("size", [7, 1024, 10_007])  # primes have no stretches
def test_every_window_has_its_own_phasors_whatever_its_length(size):
    rng, tones = np.random.default_rng(size), np.array([1, 2, (size - 1) // 2])
    truth = rng.standard_normal((23, 3)) + 1j * rng.standard_normal((23, 3))
    wave = np.exp(2j * np.pi * (np.outer(np.arange(size), tones) % size) / size)
    signal = (truth[:, None, :] * wave).real.sum(axis=-1).ravel()
    found = phasors(np.append(signal, np.ones(size - 1)), size, tones, size)
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-13)


def test_counts_of_a_converter_are_as_good_as_the_same_numbers():
    counts = np.round(8191 * np.sin(2 * np.pi * 1100 * np.arange(30_000) / RATE)).astype(np.int16)
    assert (phasors(counts, RATE, TONES) == phasors(counts.astype(float), RATE, TONES)).all()
    assert clipped(counts, 8191, 10_000, 3).all()
    assert not clipped(counts, 8192, 10_000, 3).any()


def test_fourteen_bits_cost_what_the_closed_form_says():
    """Rounding to q after a dither of q has the variance q^2/6, each part of a phasor over N samples 2/N of it."""
    u, i, current = waveforms(windows=30, bits=14)
    q_u, q_i = (np.diff(np.unique(x)).min() for x in (u, i))
    found = phasors(u, RATE, TONES) / phasors(i, RATE, TONES) / Z - 1
    part = np.sqrt(2 / 10_000 / 6) * np.hypot(q_u / np.abs(current * Z), q_i / np.abs(current))
    np.testing.assert_allclose(np.sqrt((found.real**2).mean(axis=0)), part, rtol=0.45)
    np.testing.assert_allclose(np.sqrt((found.imag**2).mean(axis=0)), part, rtol=0.45)
    at_once = phasors(u, RATE, TONES, 300_000) / phasors(i, RATE, TONES, 300_000)  # 0.3 s
    assert 2e-7 < np.abs(at_once / Z - 1).max() < 4e-5


def test_a_clipped_window_is_marked_and_its_neighbours_are_not():
    u, _, _ = waveforms()
    top = np.abs(u).max()
    loud = 0.9 * np.tile(u, 2)
    for k, (low, high) in {1: (-top, 2 * top), 7: (-2 * top, top)}.items():  # at one rail only
        which = slice(k * 10_000, (k + 1) * 10_000)
        loud[which] = np.clip(1.4 * loud[which], low, high)
        loud[which][np.abs(loud[which]) > top] = 0
    found = clipped(np.append(loud, [top, top]), top, 10_000, 8)
    assert np.flatnonzero(found).tolist() == [1, 7]
    assert not clipped(u, np.inf, 10_000, 4).any()


@pytest.mark.parametrize(
    ("rate", "tones", "samples"), [(1e6, [1100], 10_000), (6.25e6, TONES, 62_500), (781250, TONES, 15_625)]
)
def test_windows_hold_whole_periods_of_every_tone(rate, tones, samples):
    found = window_samples(rate, tones)
    assert found == samples
    assert ((np.asarray(tones) * found / rate) % 1 == 0).all()


def test_what_cannot_be_demodulated_is_refused():
    u, _, _ = waveforms()
    with pytest.raises(OutOfRange, match="whole hertz"):
        window_samples(1e6, [1100.5])
    with pytest.raises(OutOfRange, match="half the rate"):
        window_samples(1e5, TONES)
    with pytest.raises(OutOfRange, match="no whole number"):
        window_samples(66666.6, [1000, 1001])
    with pytest.raises(OutOfRange, match="no whole periods"):
        phasors(u, RATE, TONES, window=9_999)
    with pytest.raises(OutOfRange, match="expected at least a window"):
        phasors(u[:500], RATE, TONES)


def test_cubic_distortion_of_the_instrument_falls_on_three_tones_more_than_on_the_others():
    """A voltage u + k u^3 of unit tones: each has its own terms of third order; 49.9 = 2 x 19.9 + 10.1 adds others."""
    t = np.arange(10_000) / RATE
    wave = np.exp(2j * np.pi * ((TONES * t[:, None]) % 1))
    u, k = wave.real.sum(axis=1), 1e-3
    own = 1 + k * (3 / 4 + 3 / 2 * 6)
    added = k * np.array([0, 0, 0, 3 / 4, 3 / 2, 3 / 4, 0])
    np.testing.assert_allclose(phasors(u + k * u**3, RATE, TONES)[0], own + added, rtol=1e-11)
