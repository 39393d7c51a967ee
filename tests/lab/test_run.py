"""A run from begin to end: what it records, how it is paused, ended, resumed, and what it says of itself."""

import json
import os
import signal
from dataclasses import dataclass, field

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from fakes import fake_lab
from laboratory import PLAN, QUICK, done, laboratory, left_alone, outcome, pairs

from sensorgen.cli import cli
from sensorgen.core import document
from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.measure.lab import recorder, safety
from sensorgen.measure.lab.devices import DeviceFault, SimulatedClock
from sensorgen.measure.lab.experiment import Choice
from sensorgen.measure.log import Log
from sensorgen.measure.log.bench import read_again
from sensorgen.measure.virtual.mechanics import VirtualRig


@dataclass
class Viewer:
    """A view that gives commands at given times."""

    at: list[tuple[float, str]]
    shown: list = field(default_factory=list)

    def update(self, sample):
        self.shown.append(sample)

    def commands(self):
        now = self.shown[-1].time_s if self.shown else 0.0
        due = [name for time, name in self.at if time <= now]
        self.at = [each for each in self.at if each[0] > now]
        return due


def test_the_recording_in_the_log_has_the_presses_that_were_asked_for(tmp_path):
    found, lab = outcome(tmp_path)
    assert (found.end, found.done, found.steps) == ("done", 2, 2)
    assert lab.mechanism.violations == []
    assert 3.9 < lab.mechanism.peak_n < 4.2
    with Log(tmp_path / "log.db") as log:
        (row,) = log.recordings()
        pressed = pairs(log)
    assert row.specimen == "24 SX60"
    assert row.remark.startswith("simulated")
    assert row.source.startswith("simulated-")
    assert pressed.force_n == pytest.approx([4.0, 2.0], abs=0.05)
    assert pressed.position_mm == pytest.approx([30.0, 70.0])
    text = "\n".join(document.text(found.document()))
    assert "2 of 2 presses, simulated" in text
    assert json.loads(document.to_json(found))["end"] == "done"
    assert (found.tip_up, found.problems) == (True, ())
    left_alone(lab, 4.0)
    assert lab.mechanism.motor_n == pytest.approx(0, abs=1e-3)  # a watchdog that is left behind would switch it on


def test_a_pause_lifts_the_tip_and_the_press_is_done_again(tmp_path):
    lab = laboratory()
    view = Viewer([(8.0, "pause"), (14.0, "resume")])
    found = done(tmp_path, lab, view=view)
    paused = [each for each in view.shown if each.message == "paused"]
    assert paused[-1].time_s - paused[0].time_s > 4
    assert (found.end, found.done) == ("done", 2)
    assert lab.mechanism.violations == []


PAUSE_S = 8.0
OFTEN = (2.8, 6.5 + PAUSE_S, 12.7 + 2 * PAUSE_S)  # on the way, landing, rest; a press: the test before


@pytest.mark.parametrize(
    "times_s", [OFTEN, *(pytest.param((s,), marks=pytest.mark.nightly) for s in np.arange(0.5, 18.5, 1.0).tolist())]
)
def test_a_pause_at_any_time_does_no_harm(tmp_path, times_s):
    lab = laboratory()
    commands = [
        (at_s + later, name)
        for at_s in times_s
        for later, name in ((0.0, "pause"), (0.3, "pause"), (PAUSE_S, "resume"))
    ]
    found = done(tmp_path, lab, view=Viewer(commands))
    assert (found.end, found.done) == ("done", 2)
    assert lab.mechanism.violations == []
    assert lab.mechanism.peak_n < 4.2


def test_abort_ends_with_the_tip_up_and_resume_does_the_rest(tmp_path):
    lab = laboratory()
    found = done(tmp_path, lab, view=Viewer([(12.0, "abort")]))
    assert (found.end, found.done, found.tip_up) == ("abort", 1, True)
    again = done(tmp_path, laboratory(), resume=recorder.home(tmp_path / "log.db") / found.folder.rpartition("/")[2])
    assert (again.end, again.done) == ("done", 2)
    with Log(tmp_path / "log.db") as log:
        assert [row.source[-5] for row in log.recordings()] == ["1", "2"]
    steps = [
        each["step"] for each in recorder.RunFolder.read(recorder.home(tmp_path / "log.db") / again.folder).of("done")
    ]
    assert steps == [1, 2]


@pytest.mark.parametrize(
    ("stop", "reason"),
    [({"minutes": 0.1}, "stop.minutes"), ({"drift": 1e-9}, "stop.drift")],  # presses: by the command
)
def test_rules_end_a_run(tmp_path, stop, reason):
    found = done(tmp_path, laboratory(), {"stop": stop})
    assert found.end == "rule"
    assert found.reason.startswith(reason)
    assert found.tip_up


def test_an_absent_operator_ends_a_run(tmp_path):
    found = done(tmp_path, laboratory(), {"limits": {"operator_min": 0.1}})
    assert (found.end, found.tip_up) == ("abort", True)
    assert "operator" in found.reason


def test_presses_are_chosen_during_the_run_until_the_interval_is_reached(tmp_path):
    asked_for = []

    def choose(part, pressed, rest_ohm):
        asked_for.append((part.position_mm, len(pressed), np.isfinite(rest_ohm).all()))
        return Choice(1.0 + len(pressed), 20.0, 4.0, 0.5, interval=1.0 / (1 + len(pressed)))

    plan = [{"next": {"presses": 10}}]
    changes = {"plan": plan, "stop": {"interval": 0.3}}
    found = done(tmp_path, laboratory(), changes, next_press=choose)
    assert asked_for == [((2.5, 97.5), k, True) for k in range(4)]
    assert (found.end, found.done) == ("done", 3)
    assert "stop.interval" in found.reason


def test_a_chosen_press_beyond_the_limits_is_refused(tmp_path):
    lab = laboratory()
    changes = {"plan": [{"next": {"presses": 3}}]}
    found = done(tmp_path, lab, changes, next_press=lambda *_: Choice(9.0, 20.0))
    assert found.end == "fault"
    assert "next press: 9 N" in found.reason
    assert lab.mechanism.peak_n < 1.0


def test_not_confirmed_nothing_moves(tmp_path):
    lab = laboratory()
    found = done(tmp_path, lab, confirm=lambda *_: False)
    assert found.end == "abort"
    assert not lab.rig.started


def test_an_error_of_a_view_or_of_the_code_lifts_the_tip_before_it_is_seen(tmp_path):
    class Broken(Viewer):
        def update(self, sample):
            super().update(sample)
            if sample.force_n > 3:
                raise ZeroDivisionError("a mistake")

    lab = laboratory()
    with pytest.raises(ZeroDivisionError):
        done(tmp_path, lab, view=Broken([]))
    lab.mechanism.advance(lab.clock.now() + 10)
    assert lab.mechanism.tip_mm > 1
    with Log(tmp_path / "log.db") as log:
        assert len(log.recordings()) == 1


def test_a_killed_attempt_is_logged_by_the_next_run_without_its_last_incomplete_row(tmp_path):
    (tmp_path / "a").mkdir()
    first = done(tmp_path / "a", laboratory(), {"plan": PLAN[:1]})
    home = recorder.home(tmp_path / "b.db")
    folder = home / "20260101-000000"
    folder.mkdir(parents=True)
    source = recorder.home(tmp_path / "a" / "log.db") / first.folder
    for file in source.iterdir():  # as the first attempt has left it, killed in the middle of a row
        content = file.read_bytes()
        kept = content[: len(content) * 2 // 3] if file.suffix == ".csv" else content
        if file.name == recorder.JOURNAL:
            lines = content.split(b"\n")
            kept = b"\n".join(lines[:-3]) + b'\n{"event": "do'
        (folder / file.name).write_bytes(kept)
    with Log(tmp_path / "b.db", create=True) as log:
        rows = recorder.recover(log, SimulatedClock())
        assert len(rows) == 1
        assert recorder.recover(log, SimulatedClock()) == []
        parts, rig = read_again(log, rows[0])
        assert sum(len(one.time_s) for part in parts for one in part) > 100
        assert len(rig.time_s) > 100


def test_a_run_that_goes_on_elsewhere_is_left_alone(tmp_path):
    folder = recorder.new_folder(tmp_path / "log.db")
    with recorder.alone(folder) as ours:
        assert ours
        with pytest.raises(SensorgenError, match="goes on in another process"):
            done(tmp_path, laboratory(), resume=folder)


def test_devices_of_any_kind_can_be_run(tmp_path):
    """Others' drivers, on a mechanism that shares no code with the simulators."""
    lab = fake_lab()
    found, plant = done(tmp_path, lab), lab.mechanism
    assert (found.end, found.done, plant.sideways, plant.above_s) == ("done", 2, 0, 0.0)
    assert 3.9 < plant.worst_n < 4.1


@pytest.mark.parametrize(("position_mm", "up"), [(0.99, True), (1.01, False), (5.0, False)])
def test_a_piston_that_sticks_below_its_upper_end_is_not_up(position_mm, up):
    """It answers and obeys nothing; the stage, which could raise it, was never started."""
    lab = fake_lab()
    rig, plant = lab.rig, lab.mechanism
    rig.started.add("actuator")
    rig.actuator.deaf, plant.extension_mm = True, position_mm
    assert safety.made_safe(rig, lab.clock) == (up, ())
    assert "actuator lift" in plant.sent
    assert (plant.on, plant.extension_mm) == (False, position_mm)


def test_a_loop_that_stood_still_ends_the_run(tmp_path):
    class Slow(Viewer):
        def update(self, sample):
            super().update(sample)
            if sample.force_n > 3:
                lab.clock.wait_until(lab.clock.now() + 3.0)

    lab = laboratory()
    found = done(tmp_path, lab, view=Slow([]))
    assert found.end == "fault"
    assert "stood still" in found.reason


def test_a_guardian_that_dies_ends_the_run_with_the_tip_up(tmp_path):
    armed = []

    class Dying:
        def arm(self):
            armed.append(True)

        def disarm(self):
            armed.append(False)

        def beat(self):
            if lab.mechanism.peak_n > 3:
                raise DeviceFault("guardian: it has died")

    lab = laboratory()
    found = done(tmp_path, lab, guardian=Dying())
    assert (found.end, found.tip_up, armed) == ("fault", True, [True, False])
    assert "guardian: it has died" in found.reason
    assert lab.mechanism.tip_mm >= 1.0


def _cli(*words):
    return CliRunner().invoke(cli, ["bench", "run", *map(str, words)], standalone_mode=False)


def _file(tmp_path, **changes):
    file = tmp_path / "e.yaml"
    data = {"specimen": "24 SX60", "plan": PLAN, "approach": QUICK, "virtual": {"design": "reference"}} | changes
    file.write_text(yaml.safe_dump(data))
    return file


def test_the_command_runs_simulates_and_resumes(tmp_path, shared_cache):
    log = tmp_path / "log.db"
    found = _cli(_file(tmp_path, stop={"presses": 1}), "--simulate", "--log", log, "--json")
    assert found.exception is None
    assert found.return_value == 1
    result = json.loads(found.stdout)
    assert (result["end"], result["done"], result["simulated"]) == ("rule", 1, True)
    again = _cli("--resume", result["folder"].rpartition("/")[2], "--log", log)
    assert again.exception is None
    assert (again.return_value, "2 of 2 presses, simulated" in again.stdout) == (0, True)
    assert "all of it is done" in str(_cli("--resume", result["folder"], "--log", log).exception)


def test_a_signal_ends_a_run_with_the_tip_up_and_the_log_closed(tmp_path, monkeypatch, shared_cache):
    """Under a press, on the simulated clock; other signals, to a process of their own, by night (test_kills)."""
    rigs, advance = [], VirtualRig.advance

    def signalled(rig, time_s):
        advance(rig, time_s)
        if rig.force_n >= 3 and not rigs:
            rigs.append(rig)
            os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(VirtualRig, "advance", signalled)
    found = _cli(_file(tmp_path), "--simulate", "--log", tmp_path / "log.db", "--json")
    result = json.loads(found.stdout)
    assert (found.return_value, result["end"], result["done"], result["tip_up"]) == (1, "abort", 0, True)
    assert "SIGTERM" in result["reason"]
    assert rigs[0].tip_mm >= 1.0
    with Log(tmp_path / "log.db") as log:
        assert len(log.recordings()) == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "neither of an experiment and --resume"),
        (("e.yaml", "--resume", "x"), "both of an experiment and --resume"),
        (("e.yaml",), "devices is missing"),
        (("e.yaml", "--real-time"), "--real-time without --simulate"),
        (("--resume", "20200101-000000"), "no such run; expected one of none yet"),
        (("missing.yaml", "--simulate"), "cannot read"),
    ],
)
def test_wrong_words_are_told_before_anything_happens(tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    _file(tmp_path)
    with Log(tmp_path / "log.db", create=True):
        pass
    found = _cli(*words, "--log", "log.db")
    assert isinstance(found.exception, SensorgenError)
    assert message in str(found.exception)


def test_a_fault_planted_in_the_file_is_reported(tmp_path, shared_cache):
    virtual = {"design": "reference", "faults": [{"what": "actuator hung", "at_force_n": 2.0}]}
    found = _cli(_file(tmp_path, virtual=virtual), "--simulate", "--log", tmp_path / "log.db")
    assert found.return_value == 1
    assert "asked for object 0x6071" in found.stdout
    assert "recording 1" in found.stdout


def test_a_fault_of_a_device_that_is_not_in_use_is_refused(tmp_path):
    virtual = {"design": "reference", "faults": [{"what": "lcr-meter hung", "at_s": 2.0}]}
    found = _cli(_file(tmp_path, virtual=virtual), "--simulate", "--log", tmp_path / "log.db")
    assert isinstance(found.exception, BadInput)
    assert "'lcr-meter hung' strikes a device that is not in use; expected one of actuator" in str(found.exception)
    assert not list(tmp_path.glob("*/*"))


def test_a_specimen_that_cannot_be_simulated_is_refused_before_the_run(tmp_path):
    design = {"shape": "rect", "parameters": {"angle_deg": 60, "length_mm": 40}}
    (tmp_path / "slanted.yaml").write_text(yaml.safe_dump(design))
    file = _file(tmp_path, plan=PLAN[:1], virtual={"design": str(tmp_path / "slanted.yaml")})
    found = _cli(file, "--simulate", "--log", tmp_path / "log.db")
    assert isinstance(found.exception, SensorgenError)
    assert "virtual" in str(found.exception)
    assert not list(tmp_path.glob("*/*"))


def test_faults_are_seen_by_the_fakes_too(tmp_path):
    """One of each device on the mechanism of the tests: both judges agree."""
    for role in ("actuator", "stage", "impedance"):
        lab = fake_lab()
        plant, device, view = lab.mechanism, getattr(lab.rig, role), Viewer([])
        view.update = lambda sample, device=device: setattr(device, "dead", device.dead or sample.force_n > 3)
        (tmp_path / role).mkdir()
        found = done(tmp_path / role, lab, view=view)
        plant.advance(lab.clock.now() + 5)
        assert (found.end, found.tip_up, plant.above_mm > 5.0, plant.sideways) == ("fault", True, True, 0)
        assert role in found.reason
