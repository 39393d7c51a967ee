"""A tip that presses unevenly: against mpmath, against one patch, and how its pieces converge."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from line_cases import TONES, matrix, terminated

from sensorgen.core.errors import OutOfRange
from sensorgen.core.units import EPS0_F_PER_M
from sensorgen.models import compression, line_tip
from sensorgen.models.pressure import bed, hertz
from sensorgen.models.sensor import Sensor

PLATE = Sensor(0.1, 0.01, (3e-4, 3e-4), (0.07, 0.2), EPS0_F_PER_M * 4.68 * 0.01 / 6e-4, compression.unconfined(6e6))
SOFT = replace(
    PLATE, compression=compression.curve("soft", "made up", [0, 2e4, 5e4, 1e5], [1, 1.1, 1.2, 1.3]),
    piezoresistance_per_pa=(1e-6, -2e-6), tan_delta=0.01, leak_s_per_m=1e-9,
)  # fmt: skip
TONE = np.array(TONES)
PLACES = [0.0, 0.0048, 0.03, 0.0976]  # of the tip's centre; its half is 5 mm


def by_hand(sensor, force, position, f):
    """Z in 40 digits from the printed formulas, piece by piece, numbers of mpmath."""
    mp, w = mpmath.mpf, sensor.width_m
    with mpmath.workdps(40):
        low, high = position - sensor.tip_m / 2, position + sensor.tip_m / 2
        left, right = max(low, 0.0), min(high, sensor.length_m)
        share = {
            "hertz": lambda u: (
                (2 * mpmath.asin(mpmath.sqrt(u)) - mpmath.sin(4 * mpmath.asin(mpmath.sqrt(u))) / 2) / mpmath.pi
            ),
            "parabola": lambda u: u * u * (3 - 2 * u),
        }[sensor.profile]
        a, b = (mp(left) - mp(low)) / mp(sensor.tip_m), (mp(right) - mp(low)) / mp(sensor.tip_m)
        r = [mp(rho) / (mp(h) * mp(w)) for rho, h in zip(sensor.resistivity_ohm_m, sensor.electrode_m, strict=True)]

        def section(length, stress, thinning):
            rise = [1 + mp(k) * stress for k in sensor.piezoresistance_per_pa]
            c = mp(sensor.capacitance_f_per_m) / (1 - thinning)
            y = sensor.leak_s_per_m + (mp(sensor.tan_delta) + 1j) * 2 * mpmath.pi * mp(f) * c
            return matrix(sum(x * k for x, k in zip(r, rise, strict=True)), y, length)

        whole = section(mp(left), 0, mp(0))
        n = sensor.pieces
        for k in range(n):
            t0, t1 = ((1 - mpmath.cos(mpmath.pi * j / n)) / 2 for j in (k, k + 1))
            borne = (share(a + (b - a) * t1) - share(a + (b - a) * t0)) / (share(b) - share(a))
            length = (mp(right) - mp(left)) * (t1 - t0)
            stress = float(force * borne / (w * length))
            thinning = mp(float(sensor.compression.capacitive_strain(np.asarray(stress))[0]))
            whole = whole * section(length, force * borne / (w * length), thinning)
        whole = whole * section(mp(sensor.length_m) - mp(right), 0, mp(0))
        return complex(terminated(whole, sensor.far_end))


@pytest.mark.parametrize("profile", ["hertz", "parabola"])
@pytest.mark.parametrize(("position", "far_end"), [(0.0, "open"), (0.0048, "short"), (0.03, 5e4), (0.1, "open")])
def test_against_mpmath(profile, position, far_end):
    sensor = replace(SOFT, profile=profile, pieces=3, far_end=far_end)
    for f in (1.1e3, 99.7e3):
        expected, found = by_hand(sensor, 2.0, position, f), complex(sensor.impedance(f, 2.0, position))
        assert found.real == pytest.approx(expected.real, rel=1e-11, abs=0)
        assert found.imag == pytest.approx(expected.imag, rel=1e-12, abs=0)


@pytest.mark.parametrize("sensor", [PLATE, SOFT, replace(SOFT, far_end="short")])
def test_pieces_of_even_pressure_are_one_patch(sensor):
    one, places, force = sensor.response(TONE[:, None], 3.0, np.array(PLACES)), np.array(PLACES), np.asarray(3.0)
    track, _, law, tone = sensor._pressed(TONE[:, None], force, places)
    cut = line_tip.resting(0.1, 0.01, ("uniform", 5), force, places, sensor.contact_m(force))
    many = line_tip.response(track, cut, law, tone)
    assert line_tip.impedance(track, cut, law, tone) == pytest.approx(one[0], rel=1e-14)
    for found, expected in zip(many, one, strict=True):
        assert found.real == pytest.approx(expected.real, rel=1e-7, abs=1e-12)  # up to 50 times below the whole
        assert found.imag == pytest.approx(expected.imag, rel=1e-9, abs=1e-12)


def check_slopes(sensor, force, position, by_force, step_m, by_position):
    """Slopes against differences, within shares of them; places at the very ends are taken from inside."""
    inside = min(max(position, 1e-3), 0.099)

    def by(step, move):
        ahead = [
            (sensor.impedance(TONE, *move(h)) - sensor.impedance(TONE, *move(-h))) / (2 * h) for h in (step, step / 2)
        ]
        return (4 * ahead[1] - ahead[0]) / 3

    found = sensor.response(TONE, force, inside)
    along, across = by(2e-3, lambda h: (force + h, inside)), by(step_m, lambda h: (force, inside + h))
    for part in (np.real, np.imag):
        assert part(found.by_force_ohm_per_n) == pytest.approx(part(along), rel=by_force)
        assert part(found.by_position_ohm_per_m) == pytest.approx(part(across), rel=by_position, abs=1e-3)


@pytest.mark.parametrize("profile", ["hertz", "parabola"])
@pytest.mark.parametrize("position", PLACES)
@pytest.mark.parametrize(("force", "far_end"), [(2.0, "open"), (2.0, 5e4)])
def test_slopes_against_differences(profile, position, force, far_end):
    """By Richardson's rule from two short steps, as a law's slope bends at its points; at the very ends from inside."""
    check_slopes(replace(SOFT, profile=profile, far_end=far_end), force, position, 2e-6, 2.5e-6, 1e-4)


@pytest.mark.parametrize("profile", ["hertz", "parabola"])
@pytest.mark.parametrize("position", [0.002, 0.05])
def test_pieces_converge_with_the_square_of_their_number(profile, position):
    sensor = replace(PLATE, profile=profile)
    exact = replace(sensor, pieces=512).response(TONE, 6.0, position)
    errors = []
    for count in (8, 16, 32, 64):
        found = replace(sensor, pieces=count).response(TONE, 6.0, position)
        errors.append([abs(a - b).max() for a, b in zip(found[:2], exact[:2], strict=True)])
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx(2.0, abs=0.15)


def test_without_force_there_is_no_trace_of_position():
    found = replace(SOFT, profile="hertz").response(TONE[:, None], 0.0, np.linspace(0, 0.1, 7))
    assert not found.by_position_ohm_per_m[:, 1:-1].any()
    assert abs(found.by_position_ohm_per_m).max() < 1e-6  # at the ends, where the patch grows, rounding is left
    assert found.by_force_ohm_per_n.all()


def test_the_highest_pressure_is_what_counts():
    assert replace(PLATE, profile="parabola", pieces=64).stress_pa(6.0, 0.05) == pytest.approx(9e4, rel=1e-3)
    assert replace(PLATE, profile="hertz", pieces=64).stress_pa(6.0, [0.05, 0.0])[1] == pytest.approx(
        2 * 4 / np.pi * 6e4, rel=1e-2
    )  # half the tip rests, its highest end among it
    assert PLATE.stress_pa(6.0, 0.05) == pytest.approx(6e4)


def test_what_an_uneven_tip_cannot():
    sensor = replace(PLATE, profile="hertz")
    with pytest.raises(OutOfRange, match="electrodes touch"):
        sensor.impedance(1e3, 500.0, 0.05)  # 5 MPa on average, 6.4 in the middle
    soft = replace(sensor, piezoresistance_per_pa=(0.0, -5e-5))
    assert soft.impedance(1e3, 1.5, 0.05).real > 0  # 15 kPa on average, 19 in the middle
    for ask in (soft.impedance, soft.response):
        with pytest.raises(OutOfRange, match=r"resistivity .* negative \(-5e-05 1/Pa at 24 kPa\): press less"):
            ask(1e3, 1.9, 0.05)  # only in the middle
    with pytest.raises(OutOfRange, match="no derivative"):
        sensor.response(0.0, 1.0, 0.05)


def test_whole_tips_of_a_grid_are_the_same_press():
    """One patch for all of them keeps the axes apart; beside clipped ones it is the same to the last digit."""
    inside, ends = np.linspace(0.006, 0.094, 9), np.array([0.0, 0.1])
    apart = PLATE.impedance(TONE[:, None], 3.0, inside)
    together = PLATE.impedance(TONE[:, None], 3.0, np.concatenate([ends, inside]))[:, 2:]
    assert (apart == together).all()
    assert PLATE.patch(inside).length_m.shape == ()
    assert PLATE.whole([0.0, 0.0051, 0.05, 0.0949, 0.0951]).tolist() == [False, True, True, True, False]


ROUND = {
    "hertz": replace(SOFT, profile="hertz", contact=hertz(0.2, 8e6)),
    "parabola": replace(SOFT, profile="parabola", contact=bed(0.1, 1e10)),
}


@pytest.mark.parametrize("profile", ROUND)
@pytest.mark.parametrize("position", PLACES)
@pytest.mark.parametrize(("force", "far_end"), [(0.5, "open"), (2.0, "short")])
def test_slopes_of_a_contact_that_grows(profile, position, force, far_end):
    """Against differences by Richardson's rule; where the contact hangs over an end, too."""
    sensor = replace(ROUND[profile], far_end=far_end)
    assert 1e-3 < sensor.contact_m(force)[0] < sensor.tip_m
    check_slopes(sensor, force, position, 5e-6, 5e-5, 2e-3)


@pytest.mark.parametrize("profile", ROUND)
@pytest.mark.parametrize("position", [0.001, 0.03, 0.0995])
def test_at_one_force_it_is_a_tip_of_that_length(profile, position):
    """And from where all of the tip touches it stays as long as that."""
    sensor = ROUND[profile]
    as_long = replace(sensor, contact=None, tip_m=float(sensor.contact_m(1.0)[0]))
    assert sensor.impedance(TONE, 1.0, position) == pytest.approx(as_long.impedance(TONE, 1.0, position), rel=1e-14)
    flatter = replace(sensor, contact=replace(sensor.contact, length_at_one_m=1.0))
    for one, other in zip(
        flatter.response(TONE, 2.0, position), replace(sensor, contact=None).response(TONE, 2.0, position), strict=True
    ):
        assert one == pytest.approx(other, rel=1e-14)
