"""Runs of the command line that are killed, hung or robbed of their guardian, on a rig in another process."""

import json
import os
import signal
import sys
import time

import killing
import pytest

from sensorgen.measure.log import Log

pytestmark = [pytest.mark.skipif(sys.platform != "linux", reason="pseudo-terminals and /proc of Linux")]


@pytest.fixture(scope="module")
def rig():
    pytest.importorskip("serial", reason="pyserial is missing: pip install 'sensorgen[lab]'")
    pytest.importorskip("pyvisa", reason="PyVISA is missing: pip install 'sensorgen[lab]'")
    with killing.Served() as served:
        yield served


@pytest.mark.nightly
def test_ten_killed_runs_leave_the_tip_up_and_go_on(tmp_path, rig):
    found = list(killing.many(tmp_path, rig, seed=5, kills=10, ways=("kill", "kill", "kill", "kill", "stop")))
    assert len(found) == 10
    assert all(each.up_s < 10 for each in found)  # how fast, bench/lab_safety.py says
    assert not [each for each in found if each.down and not each.raised]
    assert [v for v in rig.state()["violations"] if v[0] == "sideways" or v[2] > 0.01] == []


def _pressing(tmp_path, rig):
    """A run whose tip is down; begun anew where a busy computer lets the served rig answer too late."""
    for attempt in range(6):
        log = tmp_path / f"{attempt}.db"
        with Log(log, create=True):
            pass
        run = killing.start(killing.experiment(tmp_path, rig.places, presses=4), log)
        until = time.monotonic() + 90
        while run.process.poll() is None and time.monotonic() < until:
            if rig.state()["force_n"] >= 3.0:
                return run
            time.sleep(0.02)
        run.process.kill()
        out, _ = run.process.communicate()
    raise AssertionError(f"no run came to press: {out}")


@pytest.mark.nightly  # faster, the guardian by itself: test_guardian, and nobody's sign of life: test_watchdog
def test_a_killed_run_leaves_the_tip_up(tmp_path, rig):
    found = killing.killed(rig, _pressing(tmp_path, rig))
    assert found.raised, found
    assert found.up_s < 10
    assert found.readings > 0
    assert found.told["devices"] == {"actuator": "lifted, motor off", "stage": "raised"}


@pytest.mark.nightly
def test_a_run_ends_with_the_tip_up_when_its_guardian_dies(tmp_path, rig):
    run = _pressing(tmp_path, rig)
    os.kill(run.guardian(), signal.SIGKILL)
    out, _ = run.process.communicate(timeout=90)
    result = json.loads(out)
    assert run.process.returncode == 1
    assert result["end"] == "fault"
    assert "guardian" in result["reason"]
    assert result["tip_up"]
    assert rig.state()["tip_mm"] >= 1.0


@pytest.mark.nightly  # faster, in one process: test_run
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_signals_end_a_run_with_the_tip_up_and_the_log_closed(tmp_path, rig, number):
    run = _pressing(tmp_path, rig)
    os.kill(run.process.pid, number)
    out, _ = run.process.communicate(timeout=90)
    result = json.loads(out)
    assert run.process.returncode == 1
    assert (result["end"], result["tip_up"]) == ("abort", True)
    assert signal.Signals(number).name in result["reason"]
    assert rig.state()["tip_mm"] >= 1.0
    with Log(run.log) as log:
        assert len(log.recordings()) == 1
