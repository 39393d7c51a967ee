"""Work for many: what is about one alone, and what stops all."""

import multiprocessing
import subprocess
import sys
import time

import pytest

from sensorgen.core.errors import BadInput, NotInstalled, OutOfRange
from sensorgen.core.parallel import in_parallel, said


def fails(error):
    raise error


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (BadInput("no such thing"), "no such thing"),
        (MemoryError(), "not enough memory"),
        (ZeroDivisionError("by 0"), "ZeroDivisionError: by 0; a fault of sensorgen, please report it"),
    ],
)
def test_an_error_about_one_is_its_reason(error, reason):
    assert said(fails, error, refused=(BadInput,)) == reason


@pytest.mark.parametrize("error", [OutOfRange("a"), NotInstalled("b"), KeyboardInterrupt()])
def test_other_errors_stop_all(error):
    with pytest.raises(type(error)):
        said(fails, error, refused=(BadInput,))


def test_one_job_needs_no_other_process():
    """A function of no module would not be found by another one."""
    assert dict(in_parallel(lambda a, b: a * b, [(2, 3), (4, 5)], jobs=1)) == {0: 6, 1: 20}
    assert dict(in_parallel(lambda a: a, [(7,)], jobs=8)) == {0: 7}
    assert list(in_parallel(fails, [], jobs=8)) == []


def test_results_of_other_processes_keep_their_numbers():
    assert dict(in_parallel(divmod, [(7, 2), (9, 4), (5, 5)], jobs=2)) == {0: (3, 1), 1: (2, 1), 2: (1, 0)}
    with pytest.raises(ZeroDivisionError):
        list(in_parallel(divmod, [(7, 2), (1, 0)], jobs=2))


def test_a_script_without_a_guard_runs_once(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "from sensorgen.core.parallel import in_parallel\n"
        "print('begun')\n"
        "print(sorted(in_parallel(divmod, [(7, 2), (9, 4)], jobs=2)))\n"
    )
    ran = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120, check=False)
    assert (ran.stdout, ran.stderr) == ("begun\n[(0, (3, 1)), (1, (2, 1))]\n", "")


def test_an_error_ends_no_process_of_the_caller():
    other = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(60,))
    other.start()
    try:
        with pytest.raises(ZeroDivisionError):
            list(in_parallel(divmod, [(7, 2), (1, 0)], jobs=2))
        other.join(1.0)
        assert other.is_alive()
    finally:
        other.terminate()
        other.join()
