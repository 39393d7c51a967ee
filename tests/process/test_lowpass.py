"""The low-pass against the closed form of Butterworth's response, and why it is in sections."""

import made
import numpy as np
import pytest
from scipy import signal

from sensorgen.core.errors import OutOfRange
from sensorgen.measure.recording import Recording, RecordingClock, Source
from sensorgen.measure.recording.samples import blank
from sensorgen.measure.signal import lowpass
from sensorgen.measure.signal.lowpass import CUTOFF_HZ, Live

RATE = 140.0
THESIS_RATE_HZ = 66.6666


def response_db(frequency_hz, cutoff_hz, rate_hz, order=4):
    """Gain of one pass: abs(H)^2 = 1 / (1 + (tan(pi f / fs) / tan(pi fc / fs))^(2 n))."""
    ratio = np.tan(np.pi * frequency_hz / rate_hz) / np.tan(np.pi * cutoff_hz / rate_hz)
    return -10 * np.log10(1 + ratio ** (2 * order))


def gain_db(run, frequency, rate=RATE):
    t = np.arange(round(60 / frequency * rate)) / rate
    wave = np.exp(2j * np.pi * frequency * t)[:, None]
    middle = slice(len(t) // 3, 2 * len(t) // 3)
    return 20 * np.log10(np.abs(run(wave)[middle, 0]).mean())


@pytest.mark.parametrize("rate", [RATE, THESIS_RATE_HZ])
@pytest.mark.parametrize("over", [0.5, 1.0, 4.0])
def test_gain_is_that_of_the_closed_form_once_and_twice(rate, over):
    expected = response_db(over * CUTOFF_HZ, CUTOFF_HZ, rate)
    assert gain_db(Live(rate), over * CUTOFF_HZ, rate) == pytest.approx(expected, abs=2e-3, rel=4e-4)
    assert gain_db(lambda w: lowpass.offline(w, rate), over * CUTOFF_HZ, rate) == pytest.approx(
        2 * expected, abs=2e-3, rel=4e-4
    )


@pytest.mark.parametrize(("cutoff", "digits"), [(0.2727, 1e-12), (0.027, 1e-10), (0.00027, 1e-6)])
def test_sections_are_stable_where_polynomials_are_not(cutoff, digits):
    sos = lowpass.sections(THESIS_RATE_HZ, cutoff)
    _, h = signal.sosfreqz(sos, [cutoff], fs=THESIS_RATE_HZ)
    assert 20 * np.log10(abs(h[0])) == pytest.approx(-3.0103, abs=1e-3)
    poles = np.concatenate([np.roots(row[3:]) for row in sos])
    assert (np.abs(poles) < 1).all()
    direct = Live(THESIS_RATE_HZ, cutoff)(np.ones((20_000, 1)))
    assert np.abs(direct - 1).max() < max(digits, 1e-6)


def test_live_begins_settled_and_a_filter_begun_at_zero_does_not():
    z = np.full((3000, 2), 41.0 - 12.0j)
    assert np.abs(Live(RATE)(z) - z).max() < 1e-9
    from_zero = signal.sosfilt(lowpass.sections(RATE), z[:, 0].real)
    assert np.flatnonzero(np.abs(from_zero / 41 - 1) > 0.001)[-1] / RATE > 5  # seconds until it has settled


def test_one_pass_delays_by_a_second_and_a_half_and_two_do_not():
    t = np.arange(0, 60, 1 / RATE)
    ramp = t[:, None] * 1.0
    live = Live(RATE)(ramp)
    assert (ramp - live)[-1, 0] == pytest.approx(1.5, abs=0.06)
    both = lowpass.offline(ramp, RATE)
    assert np.abs(both - ramp).max() < 1e-3
    assert np.abs(both - ramp)[2000:-2000].max() < 1e-6


def test_a_stream_in_pieces_is_the_stream_at_once():
    rng = np.random.default_rng(0)
    z = rng.standard_normal((1000, 3)) + 1j * rng.standard_normal((1000, 3))
    z[300:320, 1] = np.nan
    z[0, 2] = np.nan
    whole, live = Live(RATE)(z), Live(RATE)
    pieces = np.vstack([live(z[a:b]) for a, b in [(0, 1), (1, 310), (310, 311), (311, 1000)]])
    np.testing.assert_allclose(pieces[320:, :2], whole[320:, :2], atol=1e-12)
    assert np.isnan(whole[300:320, 1]).all()
    assert np.isfinite(whole[320:]).all()


def test_a_recording_with_gaps_is_bridged_when_short_and_blank_when_long():
    time = np.arange(0, 60, 1 / RATE)
    keep = ~((time > 20) & (time < 20.5)) & ~((time > 40) & (time < 45))
    time = time[keep]
    z = (50 + 10 * np.sin(2 * np.pi * 0.02 * time) + 5j)[:, None]
    made_of = Recording(time, np.array([1e3]), z, blank(len(time)), RecordingClock(), Source("", "", rate_hz=RATE))
    grid, found = lowpass.filtered(made_of)
    np.testing.assert_allclose(np.diff(grid), 1 / RATE, rtol=1e-9)
    gap = (grid > 40.01) & (grid < 44.99)
    assert (np.isnan(found[gap].real) & np.isnan(found[gap].imag)).all()
    assert np.isfinite(found[~gap & (np.abs(grid - 42.5) > 2.6)]).all()
    inner = (grid > 10) & (grid < 35)
    truth = 50 + 10 * np.sin(2 * np.pi * 0.02 * grid)
    assert np.abs(found[inner, 0].real - truth[inner]).max() < 0.05


def test_noise_falls_as_the_bandwidth_says():
    rng = np.random.default_rng(1)
    noise = rng.standard_normal((200_000, 1))
    left = lowpass.offline(noise, RATE).std()
    _, h = signal.sosfreqz(lowpass.sections(RATE), 200_000, fs=RATE)
    assert left == pytest.approx(np.sqrt(np.mean(np.abs(h) ** 4)), rel=0.05)


def test_a_cut_off_beyond_half_the_rate_is_refused():
    for cutoff in (0.0, 70.0, -1.0, np.nan):
        with pytest.raises(OutOfRange, match="between 0 and half"):
            Live(RATE, cutoff)
    run = made.run(made.presses(1))
    few = Recording(
        run.time_s[:1], made.TONES_HZ, run.impedance_ohm[:1], blank(1), RecordingClock(), Source("", "", rate_hz=RATE)
    )
    with pytest.raises(OutOfRange, match="1 valid samples"):
        lowpass.filtered(few)


def test_the_noise_of_the_last_reading_does_not_become_a_step():
    rng = np.random.default_rng(4)
    ends = []
    for _ in range(60):
        left = lowpass.offline(rng.standard_normal((4000, 1)), RATE)
        ends += [left[0, 0], left[-1, 0]]
    inner = lowpass.offline(rng.standard_normal((60_000, 1)), RATE)[5000:-5000].std()
    assert np.std(ends) < 3 * inner


@pytest.mark.parametrize("count", [1, 3, 20])
def test_few_samples_pass(count):
    assert lowpass.offline(np.full((count, 2), 3.0 + 1j), RATE) == pytest.approx(np.full((count, 2), 3.0 + 1j))
