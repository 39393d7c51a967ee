"""Log or run folder removed while a run goes on: it ends with an error, and what was recorded is in the other place."""

import shutil

import pytest
from laboratory import done, laboratory, pairs

from sensorgen.measure.lab import recorder
from sensorgen.measure.lab.devices import SimulatedClock
from sensorgen.measure.log import Log


def run_and(remove, folder, at_s=12.5):
    """The short experiment, with something removed on the way."""
    lab, log_path = laboratory(), folder / "log.db"
    wait = lab.clock.wait_until

    def waited(time_s):
        wait(time_s)
        if remove and time_s > at_s:
            remove.pop()(log_path)

    lab.clock.wait_until = waited
    found = done(folder, lab)
    lab.mechanism.advance(lab.clock.now() + 5)
    assert found.tip_up
    assert lab.mechanism.force_n == 0
    return found, log_path


def test_a_removed_log_is_an_error_and_the_next_run_logs_what_is_in_the_folder(tmp_path):
    def remove(path):
        for each in path.parent.glob("log.db*"):
            if each.is_file():
                each.unlink()

    found, path = run_and([remove], tmp_path)
    assert found.end == "fault"
    assert "was removed or replaced" in found.reason
    assert found.rows == ()
    assert not path.exists()
    with Log(path, create=True) as log:
        recorder.recover(log, SimulatedClock())
        assert pairs(log).force_n == pytest.approx([4.0, 2.0], abs=0.05)


def test_removed_folders_are_an_error_and_the_readings_are_in_the_log(tmp_path):
    found, path = run_and([lambda path: shutil.rmtree(recorder.home(path))], tmp_path)
    assert found.end == "fault"
    assert "was removed during the run" in found.reason
    assert len(found.rows) == 1
    with Log(path) as log:
        assert pairs(log).force_n[0] == pytest.approx(4.0, abs=0.05)
    assert recorder.RunFolder.read(recorder.home(path) / found.folder.rpartition("/")[2]).attempts == 1
