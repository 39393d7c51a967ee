"""Python files in the working folder do not run, and no process outlives the one that started it."""

import os
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

NAMES = (
    "multiprocessing", "random", "signal", "typing", "numpy", "json", "pickle", "threading", "ctypes", "sitecustomize",
    "sensorgen_plugin", "subprocess", "concurrent", "queue", "build123d",
)  # fmt: skip
SWEEP = ("compress", "reference", "--stress", "0:20:20", "--sweep", "dielectric_mm=0.1,0.2", "--jobs", "2")


@pytest.fixture
def planted(tmp_path):
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(
            f"open('pwned-{name}', 'w').close()\nraise SystemExit('pwned by {name}')\n"
        )
    return tmp_path


@pytest.mark.own_cache  # what another test has predicted needs no workers
@pytest.mark.parametrize("words", [SWEEP, ("list", "shapes")], ids=" ".join)
def test_python_files_in_the_working_folder_do_not_run(planted, words):
    done = subprocess.run(
        [sys.executable, "-m", "sensorgen", *words], cwd=planted, capture_output=True, encoding="utf-8"
    )
    assert (sorted(p.name for p in planted.glob("pwned*")), done.returncode) == ([], 0), done.stderr


def waiting(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


def state(pid):
    """State and parent of a process; none where it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
        return fields[0], int(fields[1])
    except OSError:
        return "", 0


def below(pid):
    """Processes that a process has started, and theirs."""
    every = [int(folder.name) for folder in Path("/proc").iterdir() if folder.name.isdigit()]
    return [each for found in every if state(found)[1] == pid for each in (found, *below(found))]


def running(pid):
    return state(pid)[0] not in ("", "Z")


WORK = """
import math, time
from sensorgen.core.parallel import in_parallel
if __name__ == "__main__":
    list(in_parallel({}, [({},)] * 4, 2))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize(
    ("work", "given"), [("time.sleep", "600"), ("math.factorial", "10**7")]
)  # never lets others run
def test_workers_end_with_a_parent_that_is_killed(tmp_path, work, given):
    (tmp_path / "work.py").write_text(WORK.format(work, given))
    process = subprocess.Popen([sys.executable, tmp_path / "work.py"], stderr=subprocess.DEVNULL)
    try:
        assert waiting(lambda: len(below(process.pid)) >= 3)  # and one that counts semaphores
        time.sleep(1)
        children = below(process.pid)
    finally:
        process.kill()
        process.wait()
    assert waiting(lambda: not any(map(running, children)), 3)


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_slicer_and_what_it_started_end_with_a_parent_that_is_killed(tmp_path):
    slicer = tmp_path / "bin" / "prusa-slicer"
    slicer.parent.mkdir()
    slicer.write_text(
        "#!/bin/sh\ncase $1 in --help) echo PrusaSlicer-2.9.2; exit;; esac\n"
        f"sleep 600 &\necho $! > {tmp_path}/pid\nsleep 600\n"
    )
    slicer.chmod(slicer.stat().st_mode | stat.S_IXUSR)
    process = subprocess.Popen(
        [sys.executable, "-m", "sensorgen", "slice", "tri", "--length", "6", "--force"], cwd=tmp_path,
        env={**os.environ, "PATH": f"{slicer.parent}{os.pathsep}{os.environ['PATH']}"},
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        assert waiting((tmp_path / "pid").exists)
        children = [*below(process.pid), int((tmp_path / "pid").read_text())]
        assert len(children) >= 3
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    assert waiting(lambda: not any(map(running, children)), 3)
