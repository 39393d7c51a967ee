"""The virtual specimens against closed forms, so that what is held against them is held against something true."""

import numpy as np
import pytest

from virtual_specimen import LENGTH_M, TONES_HZ, WIDTH_M, Truth, drawn, session

C_F = 1.2851365895937111e-10 * WIDTH_M / 2e-3 * LENGTH_M  # tests/reference/cells.json
OMEGA = 2 * np.pi * TONES_HZ


def test_at_rest_it_is_an_open_line():
    truth = Truth()
    r, y = truth.track_ohm_per_m, 1j * OMEGA * C_F / LENGTH_M
    expected = np.sqrt(r / y) / np.tanh(np.sqrt(r * y) * LENGTH_M)
    assert truth.impedance(0.0, 0.05)[0] == pytest.approx(expected, rel=1e-10)


def test_a_press_on_a_sensor_without_resistance_adds_its_capacitance():
    truth = Truth(track_ohm_per_m=1e-9)
    force, tip = 3.0, truth.tip_m
    rise = truth.rise(np.array([force / (WIDTH_M * tip)]), np.array([force]), None, None)[0]
    z = truth.impedance(force, 0.031)[0]
    assert rise == pytest.approx(0.17878, abs=1e-4)  # contact.json at 60 kPa
    assert 1 / (1j * OMEGA * z) == pytest.approx(C_F * (1 + rise * tip / LENGTH_M), rel=1e-6)


def test_lead_stray_gain_and_leak_are_where_they_are_on_a_bench():
    c = 1j * OMEGA * C_F
    truth = Truth(track_ohm_per_m=1e-9, stray_f=1e-12, lead_ohm=50.0, leak=0.1, gain=(0.01 + 0.02j,) * 7)
    inside = 1 / (c + 0.1 * OMEGA[0] * C_F + 1j * OMEGA * 1e-12)
    assert truth.impedance(0.0, 0.05)[0] == pytest.approx((50 + inside) * np.exp(0.01 + 0.02j), rel=1e-6)


def test_a_session_is_reproducible_and_noise_is_what_it_says():
    truth = Truth(noise=2e-3)
    one, again = (session(truth, 120, 3) for _ in range(2))
    assert (one.pressed_ohm == again.pressed_ohm).all()
    expected = truth.impedance(one.force_n, one.position_m, one.peak_n, one.hold_s)
    left = (one.pressed_ohm - expected) / abs(expected)
    assert [left.real.std(), left.imag.std()] == pytest.approx([2e-3] * 2, rel=0.08)
    assert drawn(5) == drawn(5) != drawn(6)
