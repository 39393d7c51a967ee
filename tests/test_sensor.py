"""The sensor as its terminals see it: the tip and its clipping, and slopes against mpmath and differences."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from line_cases import PLATE as LINE_PLATE
from line_cases import TONES, exact

from card_sensors import PLATE, TRI
from sensorgen.core.errors import OutOfRange
from sensorgen.models import line

TONE = np.array(TONES)


def plate_inputs(force, position, hertz=99.7e3):
    """The plate of PLATE for the line, its tip clipped by hand; numbers may be mpmath's."""
    left, right = max(position - 0.005, 0), min(position + 0.005, 0.1)
    return LINE_PLATE | {"force_n": force, "left_m": left, "tip_m": right - left, "frequency_hz": hertz}


@pytest.mark.parametrize("position", [0.0, 0.05, 0.0976])
def test_the_plate_is_the_lines_own(position):
    expected = line.impedance(line.PressedLine(**plate_inputs(3.0, position, TONE)))
    found = PLATE.impedance(TONE, 3.0, position)
    assert found.real == pytest.approx(expected.real, rel=1e-11)
    assert found.imag == pytest.approx(expected.imag, rel=1e-13)


@pytest.mark.parametrize(("force", "position"), [(-2.0, 0.05), (0.0, 0.002), (6.0, 0.0976)])
def test_slopes_against_mpmath(force, position):
    """Also where the tip overhangs, and the patch's length moves with it."""
    found = PLATE.response(99.7e3, force, position)
    with mpmath.workdps(50):
        by_force = mpmath.diff(lambda f: exact(digits=200, **plate_inputs(f, mpmath.mpf(position))), force)
        by_position = mpmath.diff(lambda x: exact(digits=200, **plate_inputs(force, x)), mpmath.mpf(position))
    assert complex(found.by_force_ohm_per_n) == pytest.approx(complex(by_force), rel=1e-8, abs=1e-9)
    assert complex(found.by_position_ohm_per_m) == pytest.approx(complex(by_position), rel=1e-8, abs=1e-6)


@pytest.mark.parametrize("piezo", [(0.0, 0.0), (2e-6, -1e-6)])
@pytest.mark.parametrize(("force", "position"), [(0.3, 0.05), (11.0, 0.004)])
def test_slopes_on_a_curve_against_differences(piezo, force, position):
    """By Richardson's rule from two steps, its own error some 1e-9."""
    sensor = replace(TRI, piezoresistance_per_pa=piezo)

    def slope(step, move):
        return (sensor.impedance(TONE, *move(step)) - sensor.impedance(TONE, *move(-step))) / (2 * step)

    def by(step, move):
        return (4 * slope(step / 2, move) - slope(step, move)) / 3

    found = sensor.response(TONE, force, position)
    expected_f = by(2e-3, lambda h: (force + h, position))
    expected_x = by(2e-4, lambda h: (force, position + h))
    for part in (np.real, np.imag):
        assert part(found.by_force_ohm_per_n) == pytest.approx(part(expected_f), rel=2e-6)
        assert part(found.by_position_ohm_per_m) == pytest.approx(part(expected_x), rel=2e-4)


def test_without_force_nothing_tells_of_position_on_a_curve_either():
    found = TRI.response(TONE[:, None], 0.0, np.linspace(0, 0.1, 7))
    assert np.abs(found.by_position_ohm_per_m) == pytest.approx(0.0, abs=1e-7)  # against some 100 ohm/m when pressed
    assert np.isfinite(found.by_force_ohm_per_n).all()
    assert found.by_force_ohm_per_n.all()


def test_stress_is_force_over_what_rests_on_the_sensor():
    """6 N on 10 x 10 mm are 60 kPa; at the end half of the tip overhangs."""
    assert PLATE.stress_pa(6.0, np.array([0.05, 0.0, 0.1])) == pytest.approx([6e4, 1.2e5, 1.2e5])


@pytest.mark.parametrize(
    ("change", "position", "said"),
    [
        ({}, -1e-6, "position -0.001 mm is outside the sensor; expected 0 to 100 mm"),
        ({}, np.array([0.05, np.nan]), "position nan mm"),
        ({"tip_m": 0.11}, 0.05, "tip of 110 mm"),
    ],
)
def test_presses_beside_the_sensor_are_refused(change, position, said):
    with pytest.raises(OutOfRange, match=said):
        replace(PLATE, **change).impedance(1e3, 1.0, position)
