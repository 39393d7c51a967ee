"""Work for many: what is about one alone, and what stops all."""

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
