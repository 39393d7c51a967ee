"""The CAD process: light to start, the same bytes each time, and a clear word whenever it dies."""

import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

from sensorgen.core import lazy as registry
from sensorgen.core import worker as core_worker
from sensorgen.core.errors import CadFailed, Unwritable
from sensorgen.design import shapes
from sensorgen.scene.geometry import cad
from sensorgen.scene.geometry.cad import CadProcess
from sensorgen.scene.scene import Body, Fill, Scene, box

SCENE = Scene((Body("film", "x60", (box(0, 2, 0, 1, 0, 0.1),)),), (2, 1, 0.1))
COLOURS = {"film": "#f0e6d2"}
posix = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


@pytest.fixture(scope="module")
def worker() -> Iterator[CadProcess]:
    """One process with the real kernel for all tests that leave it alive."""
    with CadProcess() as process:
        yield process


@pytest.fixture
def pretend(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Put a module of the given text in the place of build123d, for processes started from now on."""

    def put(text: str) -> None:
        folder = tmp_path / "pretend"
        folder.mkdir()
        (folder / "build123d.py").write_text(text, "utf-8")
        before = os.environ.get("PYTHONPATH")
        monkeypatch.setenv("PYTHONPATH", f"{folder}{os.pathsep}{before}" if before else str(folder))

    return put


def fresh(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, encoding="utf-8", check=False
    )


def gone(pid: int, within_s: float = 20.0) -> bool:
    """Whether a process ends; one that has ended but is not yet fetched by the system counts as ended."""
    end = time.monotonic() + within_s
    while time.monotonic() < end:
        try:
            os.kill(pid, 0)
            if Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] == "Z":
                return True
        except (ProcessLookupError, FileNotFoundError):
            return True
        time.sleep(0.02)
    return False


@pytest.mark.parametrize("module", ["cad", "solids"])
def test_import_is_light(module: str) -> None:
    heavy = "{'numpy', 'scipy', 'build123d', 'OCP', 'pydantic', 'yaml', 'manifold3d', 'asyncio', 'multiprocessing'}"
    done = fresh(f"import sys, sensorgen.scene.geometry.{module}\nprint(sorted({heavy} & set(sys.modules)))")
    assert (done.stdout.strip(), done.stderr) == ("[]", "")


def test_writes_one_file_after_the_other(
    worker: CadProcess, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    jobs = [worker.submit(SCENE, COLOURS, "t", Path(name)) for name in ("ä 1.step", "2.step")]
    assert [job.result() for job in jobs] == [None, None]
    assert (tmp_path / "ä 1.step").read_bytes() == (tmp_path / "2.step").read_bytes() != b""
    assert capfd.readouterr() == ("", "")


def test_two_processes_write_equal_bytes_and_one_crashes_amid_its_work(worker: CadProcess, tmp_path: Path) -> None:
    tri = registry.load(shapes, "tri")
    scene = tri.scene(tri.Params(length_mm=9.3, isolation_mm=0.1), Fill(support="bvoh"))
    colours = {body.name: ("#202428", "#f0e6d2", "#3080ff")[k % 3] for k, body in enumerate(scene.bodies)}
    with CadProcess() as other:
        job = other.submit(scene, colours, "t", tmp_path / "1.step")
        worker.write_step(scene, colours, "t", tmp_path / "2.step")
        assert job.result() is None
        if os.name == "posix":
            crashed_amid_its_work(other, tmp_path)
    first, second = ((tmp_path / name).read_bytes() for name in ("1.step", "2.step"))
    assert first == second
    assert len(first) > 10_000


def test_errors_come_back_as_they_are_and_the_process_lives_on(worker: CadProcess, tmp_path: Path) -> None:
    flat = Scene((Body("cog", "etpu", (box(0, 1, 0, 1, 1, 1),)),), (1, 1, 1))
    with pytest.raises(CadFailed, match=r"cannot make cog \(etpu\), prism 1 of 1, 4 corners along z"):
        worker.write_step(flat, {"cog": "#202428"}, "t", tmp_path / "a.step")
    with pytest.raises(Unwritable, match="No such file"):
        worker.write_step(SCENE, COLOURS, "t", tmp_path / "nowhere" / "a.step")
    with pytest.raises(CadFailed, match="failed on 't': ValueError"):
        worker.write_step(SCENE, {"film": "no colour"}, "t", tmp_path / "a.step")
    worker.write_step(SCENE, COLOURS, "t", tmp_path / "a.step")


def test_submit_does_not_wait(pretend: Callable[[str], None], tmp_path: Path) -> None:
    """Not even with a job that is larger than a pipe holds, while the process does not read yet."""
    pretend("import time; time.sleep(60)")
    strips = tuple(box(k, k + 0.7, 0, 50, 0, 0.3) for k in range(2000))
    scene = Scene((Body("film", "x60", strips),), (2000, 50, 0.3))
    assert len(pickle.dumps(scene)) > 100_000
    with CadProcess() as process:
        job = process.submit(scene, COLOURS, "t", tmp_path / "a.step")
        assert not job.done()
    assert job.done()  # leaving ended it, with a minute of it still to come


@pytest.mark.parametrize("ends", [nullcontext(), pytest.raises(KeyboardInterrupt)], ids=["at its end", "by an error"])
def test_no_trace_is_left(pretend: Callable[[str], None], ends: Any) -> None:
    pretend("import time; time.sleep(60)")
    threads = set(threading.enumerate())
    process = CadProcess()
    with ends, process:
        if not isinstance(ends, nullcontext):
            raise KeyboardInterrupt
    with pytest.raises(ChildProcessError):  # fetched, so no zombie
        os.waitpid(process.pid, 0)
    assert set(threading.enumerate()) <= threads


@posix
@pytest.mark.parametrize("name", ["SIGSEGV", "SIGKILL", "SIGABRT"])
def test_a_crash_is_named(pretend: Callable[[str], None], tmp_path: Path, name: str) -> None:
    pretend("import time; time.sleep(60)")
    with CadProcess() as process:
        job = process.submit(SCENE, COLOURS, "t", tmp_path / "a.step")
        os.kill(process.pid, getattr(signal, name))
        with pytest.raises(CadFailed, match=f"ended by {name}"):
            job.result(timeout=10)
        with pytest.raises(CadFailed, match=f"ended by {name}"):  # and again, for who asks again
            process.write_step(SCENE, COLOURS, "t", tmp_path / "a.step")


def crashed_amid_its_work(process: CadProcess, tmp_path: Path) -> None:
    """The real kernel, which has written a file before."""
    strips = tuple(box(k, k + 0.7, 0, 50, 0, 0.3) for k in range(3000))
    scene = Scene((Body("film", "x60", strips),), (3000, 50, 0.3))
    job = process.submit(scene, COLOURS, "t", tmp_path / "a.step")
    time.sleep(0.5)  # strips take seconds
    os.kill(process.pid, signal.SIGSEGV)
    with pytest.raises(CadFailed, match="ended by SIGSEGV"):
        job.result(timeout=10)


@posix
def test_a_hang_is_ended(pretend: Callable[[str], None], tmp_path: Path) -> None:
    pretend("")
    with CadProcess(timeout_s=0.5) as process:
        os.kill(process.pid, signal.SIGSTOP)
        with pytest.raises(CadFailed, match=r"took more than 0\.5 s and was stopped: try"):
            process.write_step(SCENE, COLOURS, "t", tmp_path / "a.step")
    assert gone(process.pid)


def test_a_job_that_cannot_be_read(pretend: Callable[[str], None], tmp_path: Path) -> None:
    pretend("")
    with CadProcess() as process:
        assert process._worker.process.stdin is not None
        process._worker.process.stdin.write(b"nonsense\n")
        with pytest.raises(CadFailed, match=r"ended with exit code 1: .*UnpicklingError"):
            process.write_step(SCENE, COLOURS, "t", tmp_path / "a.step")


def test_an_answer_that_cannot_be_read(
    pretend: Callable[[str], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(core_worker, "GRACE_S", 0.2)
    monkeypatch.setattr(cad, "WORKER", ("-c", "import time; print('nonsense', flush=True); time.sleep(60)"))
    with CadProcess() as process, pytest.raises(CadFailed, match="answer that cannot be read"):
        process.write_step(SCENE, COLOURS, "t", tmp_path / "a.step")


def test_a_kernel_that_does_not_load(pretend: Callable[[str], None], tmp_path: Path) -> None:
    pretend("raise ImportError('libGL.so.1: cannot open shared object file')")
    with CadProcess() as process, pytest.raises(CadFailed, match="exit code 1: ImportError: libGL"):
        process.write_step(SCENE, COLOURS, "t", tmp_path / "a.step")


def test_a_kernel_that_talks(pretend: Callable[[str], None], tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """What it prints, in Python or in C++, is no answer, nor for the user's terminal, nor does it fill a pipe."""
    pretend("import os, warnings; warnings.warn('old'); print('*' * 200_000); os.write(1, b'*' * 200_000)")
    with CadProcess() as process, pytest.raises(CadFailed, match="failed on 't': ImportError: cannot import name"):
        process.write_step(SCENE, COLOURS, "t", tmp_path / "a.step")
    assert capfd.readouterr() == ("", "")


def test_a_module_in_the_users_folder_takes_no_part(
    worker: CadProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pretend: Callable[[str], None]
) -> None:
    pretend("")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "random.py").write_text("raise SystemExit('read a file of the user')", "utf-8")
    (tmp_path / "pickle.py").write_text("raise SystemExit('read a file of the user')", "utf-8")
    with CadProcess() as process, pytest.raises(CadFailed, match="ImportError: cannot import name"):
        process.write_step(SCENE, COLOURS, "t", tmp_path / "a.step")


PARENT = """
import sys, time
from pathlib import Path
from sensorgen.scene.geometry.cad import CadProcess
from sensorgen.scene.scene import Body, Scene, box

scene = Scene((Body("film", "x60", (box(0, 2, 0, 1, 0, 0.1),)),), (2, 1, 0.1))
with CadProcess() as process:
    job = process.submit(scene, {"film": "#f0e6d2"}, "t", Path(sys.argv[1]))
    if sys.argv[2] == "idle":
        job.result()
    print(process.pid, flush=True)
    job.result() if sys.argv[2] == "busy" else time.sleep(60)
"""


def parent(path: Path, state: str) -> tuple[subprocess.Popen[str], int]:
    """Someone who uses a CAD process, in a group of its own as at a terminal; and that process."""
    command = [sys.executable, "-c", PARENT, str(path), state]
    made = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8", start_new_session=True
    )
    assert made.stdout is not None
    return made, int(made.stdout.readline())


@posix
@pytest.mark.parametrize("state", ["busy", "idle"])
def test_it_dies_with_its_parent(tmp_path: Path, state: str) -> None:
    """Killed while the kernel loads, and while the process waits for more to do."""
    made, pid = parent(tmp_path / "a.step", state)
    made.kill()
    made.communicate()
    assert gone(pid)


@posix
def test_ctrl_c_ends_both_and_only_the_parent_speaks(pretend: Callable[[str], None], tmp_path: Path) -> None:
    pretend("import time; time.sleep(60)")
    made, pid = parent(tmp_path / "a.step", "busy")
    time.sleep(0.3)
    os.killpg(made.pid, signal.SIGINT)
    _, said = made.communicate(timeout=10)
    assert gone(pid, within_s=1.0)
    assert said.count("Traceback") == 1
    assert said.strip().endswith("KeyboardInterrupt")


def test_a_library_that_step_files_do_without_is_read_when_it_is_called() -> None:
    program = (
        "from sensorgen.scene.geometry import solids; solids._load(); import sys; print('scipy._lib' in sys.modules);"
        "from scipy.optimize import minimize_scalar; print(round(minimize_scalar(lambda x: (x - 2) ** 2).x, 6))"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert run.stdout.split() == ["False", "2.0"], run.stderr
