"""The simulated rig against statics, and what it notes of what must not happen."""

import numpy as np
import pytest

from sensorgen.core.errors import BadInput
from sensorgen.core.records import checked
from sensorgen.design.design import make
from sensorgen.measure.virtual.mechanics import OPEN_OHM, Mechanics, VirtualRig, VirtualSpecimen, rig_of
from sensorgen.measure.virtual.specimen import PressedSpecimen, Truth, VirtualLine, drawn

DESIGN = make({"shape": "reference"})
TONES_HZ = np.array([1.1e3, 99.7e3])


def rig(truth=None, **mechanics):
    """Above the middle of a specimen, at working height, motor on, limit 8 N."""
    found = VirtualRig(PressedSpecimen(DESIGN, truth or Truth()), Mechanics(**mechanics))
    lowered(found).seek(0.0, 50.0, 1.0)
    found.travel("x", 50.0, 100.0)
    return after(found, 2.0)


def after(found, seconds, motor_n=None):
    """The rig some time later, with another force of the motor from now on."""
    if motor_n is not None:
        found.drive(motor_n)
    found.advance(found.time_s + seconds)
    return found


def lowered(found):
    """The rig with its motor on, limit 8 N, on its way to working height."""
    found.switch(on=True)
    found.limit(8.0)
    found.travel("z", 0.0, 100.0)
    return found


def test_without_friction_the_force_is_that_of_the_motor_and_the_weight():
    found = rig(friction_n=0.0)
    for motor in (2.0, 5.0, 1.0):
        assert after(found, 1.0, motor).force_n == pytest.approx(motor + 0.9, abs=1e-6)
        assert found.motor_n == pytest.approx(motor)
        assert -found.tip_mm == pytest.approx(found.force_n / 40.0)


def test_friction_is_less_force_going_down_and_more_going_up():
    found = rig(friction_n=0.5)
    down = after(found, 1.0, 3.0).force_n
    after(found, 1.0, 7.0)
    up = after(found, 1.0, 3.0).force_n
    assert (down, up) == pytest.approx((3.4, 4.4), abs=0.05)


def test_weight_holds_the_tip_down_when_the_motor_is_off_and_friction_may_hold_it_up():
    found = rig(friction_n=0.2)
    found.switch(on=False)
    assert after(found, 5.0).force_n == pytest.approx(0.7, abs=0.02)
    found = rig(friction_n=1.0)
    before = found.extension_mm
    found.switch(on=False)
    assert after(found, 5.0).extension_mm < before + 0.1


@pytest.mark.parametrize("friction", [0.0, 0.8])
def test_position_mode_goes_there_at_its_speed(friction):
    found = rig(friction_n=friction)
    assert found.extension_mm == pytest.approx(0.0, abs=0.01)
    found.seek(20.0, 10.0, 2.0)
    assert after(found, 1.0).extension_mm == pytest.approx(10.0, abs=0.5)
    assert after(found, 2.0).extension_mm == pytest.approx(20.0, abs=0.02)


def test_a_soft_landing_never_presses_harder_than_its_force():
    found = rig(friction_n=0.0)
    found.seek(45.0, 20.0, -0.6)
    assert after(found, 4.0).force_n == pytest.approx(0.3, abs=1e-3)
    assert found.peak_n <= 0.3 + 1e-6
    found.seek(0.0, 50.0, 1.0)
    assert after(found, 2.0).force_n == 0.0


def test_the_limit_bounds_the_motor():
    found = rig(friction_n=0.0)
    found.limit(3.0)
    assert after(found, 1.0, 7.0).force_n == pytest.approx(3.9)


def test_the_motor_lags_and_a_soft_tip_gives_way():
    found = rig(friction_n=0.0, lag_s=0.1, stiffness_n_mm=3.0)
    after(found, 2.0, 0.0)
    assert after(found, 0.1, 4.0).motor_n == pytest.approx(4.0 * (1 - np.exp(-1)), rel=1e-3)
    assert -after(found, 2.0).tip_mm == pytest.approx(4.9 / 3.0, rel=1e-3)


def test_raising_the_stage_lifts_the_tip():
    found = rig()
    assert after(found, 1.0, 3.0).force_n > 3.0
    found.travel("z", 25.0, 50.0)
    assert after(found, 1.0).force_n == 0.0
    assert found.axis("z") == (25.0, False)


def test_moves_with_the_tip_down_and_too_high_forces_are_noted():
    found = rig(friction_n=0.0)
    found.travel("x", 20.0, 30.0)
    assert not after(found, 2.0).violations
    after(found, 1.0, 3.0)
    found.travel("x", 25.0, 10.0)
    after(found, 2.0, 7.6)
    seen = {one.what: one for one in found.violations}
    assert set(seen) == {"sideways", "force"}
    assert seen["sideways"].duration_s == pytest.approx(0.5, abs=0.01)
    assert seen["force"].value == found.peak_n == pytest.approx(8.5, abs=1e-3)


def test_the_reading_is_that_of_the_specimen():
    found = rig(friction_n=0.0)
    specimen = found.specimen
    line = VirtualLine(specimen, TONES_HZ)
    assert found.impedance(TONES_HZ) == pytest.approx(line.impedance(0.0, (0.0, 0.0)), rel=1e-9)
    after(found, 2.0, 2.1)
    lift = specimen.rise(3.0, 5e-3)
    assert found.impedance(TONES_HZ) == pytest.approx(line.impedance(lift, specimen.patch(0.05)), rel=1e-6)


def test_readings_have_the_noise_that_was_asked_for():
    noisy = planted(noise=0.01)
    still = VirtualLine(noisy.specimen, TONES_HZ).impedance(0.0, (0.0, 0.0))
    off = np.array([noisy.impedance(TONES_HZ) for _ in range(4000)]) / still - 1
    assert np.hypot(off.real.std(axis=0), off.imag.std(axis=0)) == pytest.approx(0.01 * np.sqrt(2), rel=0.05)
    assert abs(np.corrcoef(off[:, 0].real, off[:, 1].real)[0, 1]) < 0.06
    assert abs(off.mean(axis=0)) == pytest.approx(abs(planted().impedance(TONES_HZ) / still - 1), abs=1e-3)


@pytest.mark.parametrize(("creep", "hysteresis"), [(0.02, 0.0), (0.0, 0.05)])
def test_creep_goes_with_the_logarithm_of_time_and_hysteresis_with_the_peak(creep, hysteresis):
    found = rig(Truth(creep=creep, hysteresis=hysteresis), friction_n=0.0, lag_s=1e-3)
    line = VirtualLine(found.specimen, TONES_HZ)
    rest = 1 / line.impedance(0.0, (0.0, 0.0))

    def share():
        return abs(1 / found.impedance(TONES_HZ) - rest)[0]

    found.seek(30.0, 50.0, -0.9)
    after(found, 5.0)
    after(found, 1.0, 3.1)
    first = share()
    after(found, 9.0)
    later = share()
    assert later / first == pytest.approx(1 + creep, abs=4e-3)
    after(found, 1.0, 5.1)
    after(found, 10.0, 3.1)
    assert share() / later == pytest.approx(1 + hysteresis * (1 - 4.0 / 6.0), abs=creep / 2 + 1e-3)


def test_drift_is_as_wide_as_said_and_the_same_by_its_seed():
    truth = Truth(drift_c=2e-3, drift_s=0.5)
    one, again, other = (after(VirtualRig(PressedSpecimen(DESIGN, truth), seed=seed), 5.0) for seed in (1, 1, 2))
    first, same, another = (each.impedance(TONES_HZ)[0] for each in (one, again, other))
    assert first == same != another
    c = [np.log(abs(after(one, 1.01).impedance(TONES_HZ)[0])) for _ in range(100)]
    assert np.std(c) == pytest.approx(2e-3, rel=0.15)


def test_steps_of_any_size_lead_to_the_same_place():
    coarse, fine = rig(), rig()
    for one in (coarse, fine):
        one.drive(3.0)
    after(coarse, 1.0)
    for _ in range(1000):
        after(fine, 1e-3)
    assert fine.force_n == pytest.approx(coarse.force_n, abs=1e-3)


def test_the_multimeter_reads_the_bottom_electrode():
    """Resistivity, length, width and thickness by hand, without the leads where four wires are used."""
    found = VirtualRig(PressedSpecimen(DESIGN, Truth(lead_ohm=30.0)))
    assert found.resistance(wires=4) == pytest.approx(0.042 * 0.1 / (10e-3 * 0.3e-3), rel=1e-6)
    assert found.resistance(wires=2) - found.resistance(wires=4) == pytest.approx(30.0)


@pytest.mark.parametrize("bad", [{"stiffness_n_mm": 0.0}, {"friction_n": -1.0}])
def test_what_no_rig_is_is_refused(bad):
    with pytest.raises(BadInput, match=r"rig\.\w+ is .*; expected"):
        checked(VirtualSpecimen, {"rig": bad})


def planted(*faults, **more):
    settings = checked(VirtualSpecimen, {"seed": 3, "faults": list(faults), **more})
    return rig_of(settings, DESIGN, 5e-3)


def test_faults_of_the_rig_strike_and_end():
    found = planted({"what": "rig cable out", "at_s": 1.0, "for_s": 2.0})
    seen = []
    for time in (0.5, 1.5, 3.5):
        found.advance(time)
        seen.append(abs(found.impedance(TONES_HZ)[0]) == OPEN_OHM)
    assert seen == [False, True, False]


def test_a_fault_waits_for_its_force_and_strikes_the_simulator_that_is_attached():
    class Simulator:
        fault = ""

    found, controller = planted({"what": "actuator runaway", "at_force_n": 2.0}), Simulator()
    found.planted.attach("actuator", controller)
    lowered(found)
    found.drive(0.5)
    found.advance(3.0)
    assert 1.0 < found.force_n < 2.0
    assert controller.fault == ""
    found.drive(3.0)
    found.advance(4.0)
    assert controller.fault == "runaway"


@pytest.mark.parametrize(("fault", "seen"), [
    ("rig power loss", lambda r: r.force_n == pytest.approx(0.7, abs=0.02)),
    ("rig jammed", lambda r: 0.0 < r.extension_mm < 25.0), ("rig stage moves", lambda r: r.axis("x")[0] > 5.0),
    ("rig short", lambda r: r.specimen and abs(VirtualRig.impedance(r, TONES_HZ)[0]) < 1e7),
])  # fmt: skip
def test_each_fault_of_the_rig_does_what_it_says(fault, seen):
    found = planted({"what": fault, "at_s": 0.5})
    lowered(found)
    found.advance(0.4)
    found.drive(0.0)
    found.advance(6.0)
    assert seen(found)


def test_a_short_opens_under_load():
    found = planted({"what": "rig short", "at_s": 0.0})
    lowered(found)
    found.seek(0.0, 50.0, 1.0)
    found.advance(1.0)
    assert abs(found.impedance(TONES_HZ)[0]) < 1e3
    found.drive(4.0)
    found.advance(3.0)
    assert abs(found.impedance(TONES_HZ)[0]) > 1e5


def test_overrides_are_taken_and_the_rest_is_drawn():
    found = planted(truth={"creep": 0.5, "law": [0.1, 0.2]}, rig={"friction_n": 0.7})
    assert found.specimen.truth.creep == 0.5
    assert found.specimen.truth.law == (0.1, 0.2)
    assert found.specimen.truth.modulus == drawn(DESIGN, 3).modulus
    assert found.mechanics.friction_n == 0.7


@pytest.mark.parametrize(("bad", "words"), [
    ({"faults": [{"what": "rig cable ot", "at_s": 1}]}, "did you mean 'rig cable out'"),
    ({"faults": [{"what": "rig short"}]}, "one of at_s and at_force_n"),
    ({"truth": {"crep": 0.1}}, "did you mean 'creep'"), ({"rig": {"friction": 0.1}}, "did you mean 'friction_n'"),
    ({"noise": -0.1}, "noise"), ({"sed": 1}, "did you mean 'seed'"),
])  # fmt: skip
def test_wrong_settings_are_refused(bad, words):
    with pytest.raises(BadInput, match=words):
        checked(VirtualSpecimen, bad)
