"""The same work for many, several at once in processes of their own; what goes wrong with one leaves the others."""

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

from sensorgen.core.errors import NotInstalled, SensorgenError
from sensorgen.core.leash import end_with_parent

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor

_SAFE = "PYTHONSAFEPATH"
Found = TypeVar("Found")


def in_parallel(
    work: Callable[..., Found], inputs: Sequence[tuple[Any, ...]], jobs: int
) -> Iterator[tuple[int, Found]]:
    """Number and result of each, as they come; in this process where one is enough.

    Parameters
    ----------
    work : callable
        A function of a module, so that another process can find it.
    inputs : sequence of tuple
        What it is called with.
    jobs : int
        How many processes at once, 1 or more.

    Raises
    ------
    SensorgenError
        A process ended before its result, as when the memory is full; whatever ``work`` raises.
    """
    jobs = min(jobs, len(inputs))
    if jobs < 2:
        yield from ((k, work(*each)) for k, each in enumerate(inputs))
        return
    from concurrent.futures import Future, as_completed
    from concurrent.futures.process import BrokenProcessPool

    with _pool(jobs) as pool:
        numbers: dict[Future[Found], int] = {pool.submit(work, *each): k for k, each in enumerate(inputs)}
        try:
            for future in as_completed(numbers):
                yield numbers[future], future.result()
        except BrokenProcessPool:
            raise SensorgenError(
                "a process ended before its answer, as when the memory is full: ask for less accuracy, or --jobs 1"
            ) from None


def said(work: Callable[..., Found], *given: Any, refused: tuple[type[SensorgenError], ...]) -> Found | str:
    """What a work finds, or why it finds nothing.

    Parameters
    ----------
    work : callable
        The work.
    *given
        What it is called with.
    refused : tuple of type
        Errors that are about this one alone; any other SensorgenError, and a library that
        is not installed, stops all of them.

    Examples
    --------
    >>> said(divmod, 7, 2, refused=()), said(divmod, 7, 0, refused=())[:17]
    ((3, 1), 'ZeroDivisionError')
    """
    try:
        return work(*given)
    except NotInstalled:  # the same for all of them
        raise
    except refused as error:
        return str(error)
    except SensorgenError:
        raise
    except MemoryError:
        return "not enough memory"
    except Exception as error:  # whatever a model did not foresee
        return f"{type(error).__name__}: {error}; a fault of sensorgen, please report it"


@contextmanager
def _pool(jobs: int) -> Iterator["ProcessPoolExecutor"]:
    """Fresh processes, so that solver and CAD kernel never meet in one; ended at once if anything goes wrong."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    before = os.environ.get(_SAFE)
    os.environ[_SAFE] = "1"  # a process that is spawned would look for Python's own modules in the working folder
    pool = ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), _begin)
    try:
        yield pool
    except BaseException:
        for process in multiprocessing.active_children():
            process.terminate()
        # wait: else the interpreter, as it ends, may write to a pipe that the pool's thread closes
        pool.shutdown(cancel_futures=True)
        raise
    else:
        pool.shutdown()
    finally:
        if before is None:
            del os.environ[_SAFE]
        else:
            os.environ[_SAFE] = before


def _begin() -> None:
    """End without a word on Ctrl-C, and with the process that works are for."""
    from multiprocessing import parent_process

    signal.signal(signal.SIGINT, signal.SIG_DFL)
    parent = parent_process()
    end_with_parent(parent.join if parent else None)
