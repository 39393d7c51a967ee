"""Planted faults of every device at several moments: the mechanism's own record says whether the end was safe."""

import pytest
from laboratory import HARMLESS, KINDS, MOMENTS, Planted, laboratory, outcome, verdict

from sensorgen.measure.lab import press
from sensorgen.measure.log import Log
from sensorgen.measure.log.bench import read_again

SPOILT = ("garbage", "truncated", "echo")
_QUESTIONS = (b"M115", b"32 R 0x1000", b"32 R 0x11018", b"32 R 0x21018", b"32 R 0x31018", b"32 R 0x41018")


@pytest.fixture(autouse=True)
def _short_moves(monkeypatch):
    """No move takes ten seconds here: of a stage that sticks, more need not be waited for."""
    monkeypatch.setattr(press, "_TRAVEL_S", 10.0)


def _cases():
    """Kinds under a press, every sixth at another moment, which differs from kind to kind; nightly all at all.

    Answers that are spoilt are faults like silence to a run, as the drivers' tests show.
    """
    for k, kind in enumerate(each for each in KINDS if each not in HARMLESS):
        often = () if kind.endswith(SPOILT) else (MOMENTS[-1], MOMENTS[k % (len(MOMENTS) - 1) if k % 6 == 0 else -1])
        for moment in MOMENTS:
            name = "-".join([kind, *(f"{key}-{value}" for key, value in moment.items())])
            yield pytest.param(kind, moment, id=name, marks=() if moment in often else pytest.mark.nightly)


@pytest.mark.parametrize(("kind", "moment"), list(_cases()))
def test_every_fault_ends_with_the_tip_up_and_the_reason_told(tmp_path, kind, moment):
    found, lab = outcome(tmp_path, (Planted(what=kind, **moment),))
    assert verdict(found, lab, kind) == []
    with Log(tmp_path / "log.db") as log:
        for row in log.recordings():
            parts, _ = read_again(log, row)
            assert sum(len(one.time_s) for part in parts for one in part) > 0
    if not found.rows:
        assert found.counts["read"] < 50  # nothing to log


@pytest.mark.parametrize("kind", ["actuator identity", "stage identity", "analyser wrong device", "actuator silent"])
def test_nothing_is_sent_to_anybody_before_all_have_said_who_they_are(tmp_path, kind):
    found, lab = outcome(tmp_path, (Planted(what=kind, at_s=0.0),))
    assert found.end == "fault"
    for role in ("actuator", "stage"):
        assert all(line.strip() in _QUESTIONS for line in lab.simulators[role].heard)
    assert not lab.rig.started
    assert found.reason.startswith(("actuator", "stage", "impedance"))


def test_the_limit_holds_where_the_actuator_presses_with_all_it_has(tmp_path):
    plan = [{"hold": {"position_mm": 50, "force_n": 6.6, "hold_s": 1.0}}]
    found, lab = outcome(tmp_path, (Planted(what="actuator runaway", at_force_n=1.0),), plan=plan)
    assert found.end == "fault"
    assert all(each.duration_s <= 0.01 + 1e-9 for each in lab.mechanism.violations)


def test_the_verdict_sees_a_tip_that_is_left_down(tmp_path):
    """The judge itself, on a planted fault."""
    found, lab = outcome(tmp_path, (Planted(what="actuator cut", at_force_n=3.0),))
    other = laboratory()
    other.rig.started.add("stage")
    other.mechanism.extension_mm = 50.5
    other.mechanism.travel("z", 0.0, 100.0)
    assert any("tip at" in each for each in verdict(found, other, "actuator cut"))
    assert verdict(found, lab, "actuator cut") == []
