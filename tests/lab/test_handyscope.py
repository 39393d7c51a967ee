"""The Handyscope's driver against the simulated one and against the vendor's demo device."""

import os
import time

import numpy as np
import pytest
from simulated_scope import SimulatedScope

from sensorgen.core.errors import BadInput, NotInstalled, OutOfRange
from sensorgen.measure.lab.devices import DeviceFault, Readings, RealClock, SimulatedClock, WrongDevice
from sensorgen.measure.lab.handyscope import Bridge, Handyscope, gains, load
from sensorgen.measure.signal.waveform import TONES_HZ, WEIGHTS, multisine
from sensorgen.measure.virtual.handyscope import SERIAL, Analyser, PhasorMeter
from sensorgen.measure.virtual.mechanics import BY_DEVICE

TONES = np.array(TONES_HZ)
SILENT = Analyser(noise_a=0.0)


class Capacitor:
    """A capacitor with a resistor in series; the capacitance rises with time."""

    def __init__(self, farad=100e-12, ohm=5e3, rise_per_s=0.0):
        self.farad, self.ohm, self.rise_per_s, self.time_s = farad, ohm, rise_per_s, 0.0

    def advance(self, time_s):
        self.time_s = max(self.time_s, time_s)

    def impedance(self, hz):
        return self.ohm + 1 / (2j * np.pi * hz * self.farad * (1 + self.rise_per_s * self.time_s))


def rig(plant=None, analyser=None, bridge=None, *, started=True):
    clock = SimulatedClock()
    scope = SimulatedScope(plant or Capacitor(), clock, analyser or Analyser())
    meter = Handyscope(str(SERIAL), clock, bridge=bridge, library=scope)
    if started:
        meter.start(TONES, 1.0)
    return clock, scope, meter


def phasors(plant=None, analyser=None):
    """The faster meter, started."""
    clock = SimulatedClock()
    meter = PhasorMeter(plant or Capacitor(), clock, analyser or Analyser())
    meter.start(TONES, 1.0)
    return clock, meter


def follow(clock, meter, seconds, period_s=0.01):
    """Poll as a run does; all readings, and how many were lost."""
    parts = []
    for _ in range(round(seconds / period_s)):
        clock.wait_until(clock.now() + period_s)
        parts.append(meter.read())
    every = Readings.joined(parts, len(TONES))
    return every.time_s, every.impedance_ohm, every.clipped, every.lost


def test_the_multisine_has_the_weights_of_the_thesis_and_uses_the_range():
    wave = multisine(TONES, 24e6, 240_000)
    spectrum = 2 / 240_000 * np.abs(np.fft.rfft(wave.samples))
    at = np.round(TONES * 0.01).astype(int)
    assert np.abs(wave.samples).max() == 1
    assert spectrum[at] == pytest.approx(wave.amplitude, rel=1e-9)
    assert wave.amplitude / wave.amplitude[-1] == pytest.approx(WEIGHTS, rel=1e-9)
    assert np.delete(spectrum, at).max() < 1e-12
    assert wave.amplitude.sum() > 1.2  # with all phases 0 it is 1


@pytest.mark.parametrize("gain", [1.0, 1.1 * np.exp(0.2j)])
def test_an_impedance_comes_back(gain):
    """The plant's closed form, through waveform, bridge, converter and demodulation."""
    pairs = tuple((f, gain) for f in TONES_HZ)
    clock, _, meter = rig(analyser=Analyser(noise_a=1e-12, gain=pairs), bridge=Bridge(gain=pairs))
    times, impedance, clipped, lost = follow(clock, meter, 2)
    expected = Capacitor().impedance(TONES)
    assert len(times) == 190
    assert lost == 0
    assert not clipped.any()
    assert abs(impedance.mean(axis=0) / expected - 1).max() < 5e-4  # a sixth of a step of the converter is left
    uncalibrated = Bridge().transimpedance(TONES) / Bridge(gain=pairs).transimpedance(TONES)
    assert uncalibrated == pytest.approx(1 / gain)


def test_times_are_exact_and_each_window_sees_the_specimen_of_its_time():
    plant = Capacitor(ohm=0, rise_per_s=0.5)
    clock, _, meter = rig(plant, SILENT)
    times, impedance, *_ = follow(clock, meter, 1)
    assert times[0] == pytest.approx(0.055)  # the first block is left out
    assert np.diff(times) == pytest.approx(0.01)
    farad = -1 / (2 * np.pi * TONES[3] * impedance[:, 3].imag)
    assert farad == pytest.approx(100e-12 * (1 + 0.5 * (times + SILENT.latency_s)), rel=2e-3)


def test_the_clock_of_the_device_may_be_fast():
    clock, _, meter = rig(analyser=Analyser(skew_ppm=20_000))
    times, *_, lost = follow(clock, meter, 6, 0.05)
    assert times[-1] == pytest.approx(6 * 1.02, abs=0.08)
    assert lost == 0


def test_relative_noise_follows_from_the_weights():
    """White current noise and a capacitor: 1 / (weight x frequency)."""
    clock, _, meter = rig(Capacitor(ohm=0))
    _, impedance, *_ = follow(clock, meter, 8)
    noise = impedance.std(axis=0) / abs(impedance.mean(axis=0))
    assert noise / noise[-1] == pytest.approx([9.1, 6.2, 4.2, 3.3, 2.5, 1.3, 1], rel=0.1)


def test_phasors_have_the_statistics_of_samples():
    results = []
    gain = tuple((f, 1.05 * np.exp(-0.1j)) for f in TONES_HZ)
    for meter_of in (
        lambda c, a: Handyscope(str(SERIAL), c, bridge=a, library=SimulatedScope(Capacitor(), c, a)),
        lambda c, a: PhasorMeter(Capacitor(), c, a),
    ):
        clock = SimulatedClock()
        meter = meter_of(clock, Analyser(gain=gain))
        assert meter.identify().serial == str(SERIAL)
        meter.start(TONES, 1.0)
        _, impedance, clipped, _ = follow(clock, meter, 8)
        assert not clipped.any()
        results.append((impedance.mean(axis=0), impedance.real.std(axis=0), impedance.imag.std(axis=0), len(impedance)))
    samples, phasors = results
    error = samples[1] * np.sqrt(2 / samples[3])
    assert np.all(abs(samples[0] - phasors[0]) < 5 * error + 2e-5 * abs(samples[0]))
    for k in (1, 2):  # the deviation of 800 values is known to 2.5 %
        assert phasors[k] == pytest.approx(samples[k], rel=0.12)


def test_a_signal_beyond_its_range_is_marked_by_both():
    for output in (0.79, 0.81):
        plant = Capacitor(ohm=2610 / output, farad=1)
        clock, _, meter = rig(plant, SILENT)
        clipped = follow(clock, meter, 0.3)[2]
        assert clipped.all() if output > 0.8 else not clipped.any()
        assert follow(*phasors(plant, SILENT), 0.1)[2].all() == (output > 0.8)


def test_gains_come_from_a_file(tmp_path):
    path = tmp_path / "bridge.yaml"
    path.write_text("tones:\n  - {hz: 1100, gain: 1.02, phase_deg: 90}\n  - {hz: 2300, gain: 0.9}\n")
    bridge = Bridge(gain=gains(path))
    ratio = bridge.transimpedance(TONES) / Bridge().transimpedance(TONES)
    assert ratio[:3] == pytest.approx([1.02j, 0.9, 1])
    path.write_text("tones:\n  - {hz: 1100, gain: -1}\n")
    with pytest.raises(BadInput, match=r"tones\.0\.gain is -1"):
        gains(path)


def test_the_bridge_is_its_feedback():
    """At 1 / (2 pi R C) the amplifier's gain is down by 3 dB and its phase by 45 degrees."""
    bridge = Bridge(feedback_ohm=200e3)
    corner = 1 / (2 * np.pi * 200e3 * 3.9e-12)
    assert bridge.transimpedance(np.array([corner]))[0] == pytest.approx(-200e3 / (1 + 1j))


FAULT_TEXT = {
    "unplugged": "was unplugged",
    "hung": "no samples .* for 1",
    "data loss": "loses samples again and again",
    "generator off": "has stopped",
}


@pytest.mark.parametrize("fault", BY_DEVICE["analyser"])
@pytest.mark.parametrize("kind", ["samples", "phasors"])
def test_each_fault_is_reported(fault, kind):
    clock, scope, meter = rig(started=False)
    if kind == "phasors":
        scope = meter = PhasorMeter(Capacitor(), clock)
    if fault in ("wrong device", "in use"):
        scope.fault = fault
        with pytest.raises(DeviceFault, match=r"expected a Handyscope HS5|in use") as raised:
            meter.start(TONES, 1.0)
        assert isinstance(raised.value, WrongDevice) == (fault == "wrong device")
        assert kind == "phasors" or not scope.opened
        return
    meter.start(TONES, 1.0)
    assert np.isfinite(follow(clock, meter, 0.5)[1]).all()
    scope.fault = fault
    if fault in ("nan", "silent", "clipped"):
        _, impedance, clipped, _ = follow(clock, meter, 0.5)
        assert clipped[10:].all() if fault == "clipped" else np.isnan(impedance[10:]).all()
    else:
        with pytest.raises(DeviceFault, match=FAULT_TEXT[fault]):
            follow(clock, meter, 2)
    meter.close()
    meter.close()


def test_a_device_that_is_gone_may_only_say_so(monkeypatch):
    """The library sets a flag, and calls fail; either is enough."""
    clock, scope, meter = rig()
    monkeypatch.setattr(type(scope.oscilloscope), "_present", lambda part: None)
    scope.fault = "unplugged"
    with pytest.raises(DeviceFault, match="was unplugged"):
        follow(clock, meter, 0.1)


def test_phasors_lose_windows_too():
    clock, meter = phasors()
    before = follow(clock, meter, 1)[0]
    meter.fault = "data loss"
    clock.wait_until(clock.now() + 0.5)
    assert meter.read().lost == 50
    meter.fault = ""
    assert follow(clock, meter, 1)[0][0] - before[-1] == pytest.approx(0.51)


def test_lost_samples_are_counted_and_time_goes_on():
    clock, scope, meter = rig()
    before = follow(clock, meter, 1)[0]
    scope.fault = "data loss"
    clock.wait_until(clock.now() + 0.5)
    meter.read()
    scope.fault = ""
    after, *_, lost = follow(clock, meter, 1)
    assert 45 <= lost <= 60
    assert after[0] - before[-1] == pytest.approx((lost + 1) * 0.01)
    assert after[-1] == pytest.approx(2.5, abs=0.1)
    assert follow(clock, meter, 1)[3] == 0


def test_a_reader_that_was_away_for_long_is_told_what_is_missing():
    clock, _, meter = rig()
    follow(clock, meter, 0.5)
    clock.wait_until(clock.now() + 0.8)  # all of it waits in the device
    times, *_, lost = follow(clock, meter, 0.01)
    assert (len(times), lost) == (80, 0)
    clock.wait_until(clock.now() + 5)  # more than the device keeps
    assert 450 <= follow(clock, meter, 0.2)[3] <= 520


def test_a_loss_that_is_not_reported_is_found_by_the_clock():
    clock, scope, meter = rig()
    follow(clock, meter, 1)
    total = 0
    for _ in range(20):
        times, *_, lost = follow(clock, meter, 0.12)
        total += lost
        for _ in range(5):
            scope.oscilloscope._sampled(scope.oscilloscope._windows)  # made, but not kept
    assert 70 <= total <= 100
    assert clock.now() - times[-1] < 0.4
    assert follow(clock, meter, 4)[3] <= 30


def test_a_call_that_is_late_itself_loses_nothing(monkeypatch):
    """The process is held up between the last block and the look at the clock."""
    clock, _, meter = rig()
    follow(clock, meter, 1)
    count = meter._missing
    for _ in range(6):
        with monkeypatch.context() as held:
            held.setattr(meter, "_missing", lambda heard: (clock.wait_until(clock.now() + 0.4), count(heard=heard))[1])
            assert follow(clock, meter, 0.01)[3] == 0
        assert follow(clock, meter, 0.2)[3] == 0


def test_a_poll_does_not_wait():
    clock, _, meter = rig()
    assert len(meter.read().time_s) == 0
    assert clock.now() == 0


def test_wrong_input_is_refused():
    clock, scope, meter = rig(started=False)
    for address in ("", "COM3"):
        with pytest.raises(BadInput, match="serial number"):
            Handyscope(address, clock)
    with pytest.raises(DeviceFault, match=f"no Handyscope 12 here; devices: Handyscope HS5-540XM {SERIAL}"):
        Handyscope("12", clock, library=scope).identify()
    assert not scope.opened
    for volts in (0, -1, 13, np.nan):
        with pytest.raises(OutOfRange, match="up to 12 V"):
            meter.start(TONES, volts)
    with pytest.raises(OutOfRange, match="whole hertz"):
        meter.start(np.array([600e3]), 1)
    with pytest.raises(DeviceFault, match="start it first"):
        meter.read()


def test_after_the_end_the_output_is_off():
    for end in ("stop", "close"):
        _, scope, meter = rig()
        assert scope.generator.is_running
        assert scope.generator.output_enable
        getattr(meter, end)()
        assert not scope.generator.is_running
        assert not scope.generator.output_enable


@pytest.fixture
def vendor():
    try:
        return load()
    except NotInstalled as reason:
        if os.environ.get("CI"):
            raise
        pytest.skip(str(reason))


def test_the_vendors_demo_device_streams(vendor):
    """Inputs play signals of their own: 2 V of 200 kHz on channel 1, 6.47 V on channel 2."""
    meter = Handyscope("demo", RealClock(), bridge=Bridge(range_v=8, feedback_f=0))
    identity = meter.identify()
    assert identity.model == "Demo Handyscope HS5-540XMS"
    assert identity.firmware.startswith("library 1.")
    tones = np.array([1100.0, 200e3])
    meter.start(tones, 4.0)
    parts, until = [], time.monotonic() + 60
    while sum(len(part.time_s) for part in parts) < 40 and time.monotonic() < until:
        parts.append(meter.read())
        time.sleep(0.005)
    meter.stop()
    meter.close()
    every = Readings.joined(parts, 2)
    steps = np.diff(every.time_s) / 0.01
    assert steps == pytest.approx(np.round(steps))
    assert np.round(steps - 1).sum() <= every.lost  # windows that a busy computer was too late for
    assert np.isnan(every.impedance_ohm[:, 0]).all()  # its inputs do not follow its generator
    seen = abs(every.impedance_ohm[:, 1])  # its channel 2 jumps in a few windows after the start
    assert np.median(seen) == pytest.approx(2610 * 2.000 / 6.472, rel=1e-3)
    assert not every.clipped.any()
