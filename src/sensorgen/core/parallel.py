"""Work on many inputs, in processes of this computer or on a Dask cluster; a process that dies costs one chunk."""

import json
import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from itertools import starmap
from pathlib import Path
from threading import Lock
from time import perf_counter, process_time
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

from sensorgen.core.errors import BadInput, NotInstalled, SensorgenError, library

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future, ProcessPoolExecutor
    from contextlib import AbstractContextManager

_EXPECTED_CLUSTER = "expected a scheduler's address, as tls://10.0.0.5:8786, or its file"
TRUST_CLUSTER = "SENSORGEN_TRUST_CLUSTER"  # environment variable: 1 for clusters without TLS
CHUNK_S = 1.0  # sending work to a process takes a millisecond, to another computer ten
# A process that is spawned looks for no modules in the working folder, and leaves the other cores to the others: one
# evaluation of a sensor takes 18.7 s of CPU with one thread of BLAS, and 22.1 s with two, in the same time.
_ENVIRONMENT = {
    "PYTHONSAFEPATH": "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1", "PYTHONWARNINGS": "ignore",
}  # fmt: skip
_POLL_S, _CONNECT_S, _ALONE_S = 1.0, 10.0, 60.0
_STARTING = Lock()
_LIMIT_S = 1800.0  # of processor time for one work; the longest that we know takes a tenth
_DIED = (
    "a process ended before its answer, as when the memory is full, or after half an hour with one: "
    "ask for less accuracy, or --jobs 1"
)
Result = TypeVar("Result")
Work = Callable[..., Result]
Lost = Callable[[int, str], Result]


def in_parallel(
    work: Work[Result], inputs: Sequence[tuple[Any, ...]], jobs: int, *, cluster: str = "",
    lost: Lost[Result] | None = None, lanes: "Sequence[Lane]" = (),
) -> Iterator[tuple[int, Result]]:  # fmt: skip
    """Number and result of each, as they come; in this process where one is enough.

    Works are sent in chunks that take about ``CHUNK_S``. A chunk whose process dies is sent again; one that kills twice
    is divided into its works, and one that kills alone is lost. A process of this computer also ends when a work takes
    half an hour of its time: a mesher that goes round in circles would keep it for ever.

    Parameters
    ----------
    work : callable
        A function of a module, so that another process can find it.
    inputs : sequence of tuple
        What it is called with.
    jobs : int
        How many processes at once, 1 or more; a cluster decides by itself.
    cluster : str
        Address of a Dask scheduler, or its scheduler file; "" for processes of this computer.
    lost : callable, optional
        Makes a result of the number of a work that kills its process, and the reason; an error if not given.
    lanes : sequence of Lane
        Of :func:`open_lanes`, which stay open; opened and closed here if not given.

    Raises
    ------
    SensorgenError
        A process ended before its result; a cluster that cannot be reached; whatever ``work`` raises.
    """
    if min(jobs, len(inputs)) < 2 and not (cluster and inputs):
        yield from enumerate(starmap(work, inputs))
        return
    with nullcontext(lanes) if lanes else open_lanes(min(jobs, len(inputs)), cluster) as opened:
        yield from _in_lanes(work, inputs, opened, lost)


def _in_lanes(
    work: Work[Result], inputs: Sequence[tuple[Any, ...]], lanes: "Sequence[Lane]", lost: Lost[Result] | None
) -> Iterator[tuple[int, Result]]:
    from concurrent.futures import FIRST_COMPLETED, wait

    queue, free, ready = _Queue(len(inputs), len(lanes), lanes[0].shared), list(lanes), list[tuple[int, Result]]()
    running: dict[Future[tuple[float, list[Result]]], tuple[Lane, _Chunk]] = {}
    while queue.todo or queue.again or running:
        while free and (chunk := queue.next(waits=bool(running))):
            lane = free.pop()
            running[lane.submit(work, [inputs[k] for k in chunk.numbers])] = lane, chunk
        yield from ready  # after the lanes have got work: what is done with a result takes time
        ready.clear()
        finished = wait(running, _POLL_S, FIRST_COMPLETED).done
        lanes[0].check(idle=not finished)
        for future in finished:
            lane, chunk = running.pop(future)
            free.append(lane)
            try:
                seconds, results = future.result()
            except lane.deadly:
                lane.renew()
                ready.extend(queue.died(chunk, lost))
                continue
            queue.spent_s, queue.done = queue.spent_s + seconds, queue.done + len(results)
            ready.extend(zip(chunk.numbers, results, strict=True))
    yield from ready


class _Queue:
    """Works that are still to be sent, new ones and those of chunks that died."""

    def __init__(self, count: int, lanes: int, shared: bool) -> None:
        self.todo, self.again = deque(range(count)), deque[_Chunk]()
        self.lanes, self.shared, self.spent_s, self.done = lanes, shared, 0.0, 0

    def next(self, *, waits: bool) -> "_Chunk | None":
        """The next chunk, so small that each lane gets two more; None where one that killed ``waits`` for others."""
        if self.again and not (self.shared and (self.todo or waits)):
            return self.again.popleft()
        in_time = int(CHUNK_S * self.done / self.spent_s) if self.spent_s else 1
        size = min(len(self.todo), max(1, min(in_time, len(self.todo) // (2 * self.lanes))))
        return _Chunk(tuple(self.todo.popleft() for _ in range(size))) if size else None

    def died(self, chunk: "_Chunk", lost: Lost[Result] | None) -> list[tuple[int, Result]]:
        """Send a chunk again after a death, after a second one its works one by one.

        Returns
        -------
        list of (int, result)
            Of a work that died alone; an error where none is made of it.
        """
        if not chunk.died:
            self.again.append(_Chunk(chunk.numbers, died=True))
            return []
        if len(chunk.numbers) > 1:
            self.again.extend(_Chunk((k,), died=True) for k in chunk.numbers)
            return []
        if lost is None:
            raise SensorgenError(_DIED) from None
        return [(chunk.numbers[0], lost(chunk.numbers[0], _DIED))]


def remembered(
    work: Work[Result], inputs: Sequence[tuple[Any, ...]], jobs: int, *, cluster: str = "", keep: bool = True,
    lost: Lost[Result] | None = None, lanes: "Sequence[Lane]" = (),
) -> Iterator[tuple[int, Result]]:  # fmt: skip
    """Results of works that ask :mod:`sensorgen.core.cache`: those it has all answers to first, and in this process.

    What the others have worked out is stored as it comes: work that is stopped goes on where it was.

    Parameters
    ----------
    work, inputs, jobs, cluster, lost, lanes
        As of :func:`in_parallel`.
    keep : bool
        Read the cache and store new answers.
    """
    from sensorgen.core import cache

    missing = []
    for k, each in enumerate(inputs):
        if not keep:
            missing.append(k)
            continue
        try:
            with cache.only_known():
                known = work(*each)
        except cache.Unknown:
            missing.append(k)
            continue
        yield k, known
    apart = [(work, *inputs[k]) for k in missing]

    def lost_apart(n: int, reason: str) -> tuple[Result, list[tuple[Any, Any]]]:
        if lost is None:
            raise SensorgenError(reason)
        return lost(missing[n], reason), []

    for n, (result, entries) in in_parallel(_apart, apart, jobs, cluster=cluster, lost=lost_apart, lanes=lanes):
        for entry in entries if keep else ():  # this process alone writes: the others may be ended at any moment
            cache.keep(*entry)
        yield missing[n], result


def _apart(work: Work[Result], *given: Any) -> tuple[Result, list[tuple[Any, Any]]]:
    """The result of a work, and what is to be kept of it."""
    from sensorgen.core import cache

    with cache.held_back() as entries:
        return work(*given), entries


@dataclass(frozen=True)
class _Chunk:
    """Numbers of works that are sent together; ``died`` where their process did before."""

    numbers: tuple[int, ...]
    died: bool = False


def _chunk(work: Work[Result], inputs: Sequence[tuple[Any, ...]]) -> tuple[float, list[Result]]:
    """Time that works take [s], and their results."""
    begun = perf_counter()
    results = [work(*each) for each in inputs]
    return perf_counter() - begun, results


def _within(limit_s: float, work: Work[Result], *given: Any) -> Result:
    """The result of a work; the end of the process where it takes longer, since compiled code heeds nothing less."""
    if not hasattr(signal, "setitimer"):  # Windows
        return work(*given)
    signal.setitimer(signal.ITIMER_PROF, limit_s)
    try:
        return work(*given)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def said(work: Work[Result], *given: Any, refused: tuple[type[SensorgenError], ...]) -> Result | str:
    """Result of a work, or the reason why there is none.

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


class Lane:
    """Executor of one chunk at a time, whose process may die.

    Attributes
    ----------
    executor : Executor
        Of the chunks.
    deadly : tuple of type
        Errors of a future whose process has died.
    shared : bool
        True where its process also has other chunks, which die with it: what is sent again is sent alone.
    """

    shared = False

    def __init__(self, executor: "Executor", *deadly: type[BaseException]) -> None:
        self.executor, self.deadly = executor, deadly

    def submit(self, work: Work[Result], inputs: Sequence[tuple[Any, ...]]) -> "Future[tuple[float, list[Result]]]":
        """Begin a chunk."""
        return self.executor.submit(_chunk, work, inputs)

    def renew(self) -> None:
        """Go on after a death: of its own, or with a process that somebody else replaces."""

    def check(self, *, idle: bool) -> None:
        """Raise SensorgenError where no results will come any more; a process that has died says so itself."""

    def end(self) -> None:
        """End its process at once, if it is its own."""


class _Process(Lane):
    """A fresh process, so that solver and CAD kernel never meet in one; alone in its pool, so that it dies alone."""

    executor: "ProcessPoolExecutor"

    def __init__(self) -> None:
        import multiprocessing
        from concurrent.futures import ProcessPoolExecutor
        from concurrent.futures.process import BrokenProcessPool

        super().__init__(ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), _begin), BrokenProcessPool)

    def submit(self, work: Work[Result], inputs: Sequence[tuple[Any, ...]]) -> "Future[tuple[float, list[Result]]]":
        """Begin a chunk, in another process if this one has died at rest."""
        limited = partial(_within, _LIMIT_S, work)
        with _without_main():
            try:
                return super().submit(limited, inputs)
            except self.deadly:
                self.renew()
                return super().submit(limited, inputs)

    def renew(self) -> None:
        """Another process in place of the dead one."""
        self.executor.shutdown()
        self.executor = _Process().executor

    def end(self) -> None:
        """End its process at once."""
        for process in list((self.executor._processes or {}).values()):
            process.terminate()


@contextmanager
def _without_main() -> Iterator[None]:
    """A spawned process would run the caller's script again, which need not guard itself: works are of modules."""
    with _STARTING:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = main


def cores() -> int:
    """Number of processor cores that this process may use; 1 where it may start no other one."""
    import multiprocessing

    if multiprocessing.current_process().daemon:
        return 1
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def used_s() -> float:
    """Processor time of this process and of those that it has started and that have ended [s]."""
    try:
        from resource import RUSAGE_CHILDREN, getrusage
    except ImportError:  # Windows has no record of others
        return process_time()
    of_others = getrusage(RUSAGE_CHILDREN)
    return process_time() + of_others.ru_utime + of_others.ru_stime


def open_lanes(jobs: int, cluster: str = "") -> "AbstractContextManager[Sequence[Lane]]":
    """Lanes for several rounds of works: a process starts with its first chunk, and is ended with the context."""
    return _on_cluster(cluster) if cluster else _processes(jobs)


@contextmanager
def _processes(jobs: int) -> Iterator[Sequence[Lane]]:
    """Processes of this computer, ended at once if anything goes wrong."""
    before = {name: os.environ.get(name) for name in _ENVIRONMENT}
    os.environ.update(_ENVIRONMENT)
    lanes = [_Process() for _ in range(jobs)]
    try:
        yield lanes
    except BaseException:
        for lane in lanes:
            lane.end()
        raise
    finally:
        # wait: else the interpreter, as it ends, may write to a pipe that the pool's thread closes
        for lane in lanes:
            lane.executor.shutdown(cancel_futures=True)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _begin() -> None:
    """End without a word on Ctrl-C, and with the process that works are for."""
    from multiprocessing import parent_process

    from sensorgen.core.leash import end_with_parent

    signal.signal(signal.SIGINT, signal.SIG_DFL)
    parent = parent_process()
    end_with_parent(parent.join if parent else None)


class _Cluster(Lane):
    """One of the places of a Dask cluster, which replaces its workers itself."""

    shared = True

    def __init__(self, client: Any, address: str) -> None:
        from distributed.scheduler import KilledWorker

        super().__init__(client.get_executor(pure=False), KilledWorker)
        self.client, self.address, self.seen_s = client, address, perf_counter()

    def check(self, *, idle: bool) -> None:
        """Raise SensorgenError where the scheduler, or for a while every worker, has gone."""
        if not idle:
            return
        if self.client.status not in ("running", "connecting"):
            raise gone(self.address)
        if self.client.nthreads():
            self.seen_s = perf_counter()
        elif perf_counter() - self.seen_s > _ALONE_S:
            raise SensorgenError(
                f"the Dask cluster {self.address!r} has lost all its workers; results so far are kept: start some, "
                "and run it again"
            )


def gone(address: str) -> SensorgenError:
    """The error where a cluster no longer answers."""
    return SensorgenError(f"the Dask cluster {address!r} no longer answers; results so far are kept: run it again")


def _check_private(address: str) -> None:
    """Refuse a scheduler on a network without TLS: whoever reaches the line runs code here and on the workers."""
    from ipaddress import ip_address
    from urllib.parse import urlsplit

    try:
        named = json.loads(Path(address).read_text("utf-8"))["address"] if Path(address).is_file() else address
        url = urlsplit(named if "://" in named else f"tcp://{named}")
    except (OSError, ValueError, KeyError, TypeError):
        raise BadInput(f"--cluster {address}: {_EXPECTED_CLUSTER}") from None
    here = url.scheme == "inproc" or url.hostname == "localhost"
    with suppress(ValueError):
        here = here or ip_address(url.hostname or "").is_loopback
    if url.scheme not in ("tls", "wss") and not here and os.environ.get(TRUST_CLUSTER) != "1":
        raise BadInput(
            f"--cluster {address}: on a network without TLS whoever reaches it runs code here and on the workers; "
            "expected tls:// or this computer, or sensorgen --trust-cluster"
        )


@contextmanager
def _on_cluster(address: str) -> Iterator[Sequence[Lane]]:
    """Places of a Dask cluster: two chunks for each of its threads."""
    from concurrent.futures import CancelledError

    library("distributed", "--cluster needs Dask distributed: pip install 'sensorgen[cluster]'")
    client = _client(address)
    try:
        threads = sum(client.nthreads().values())
        if not threads:
            raise SensorgenError(f"the Dask cluster {address!r} has no workers; start some: dask worker {address}")
        yield [_Cluster(client, address)] * (2 * threads)
    except (CancelledError, OSError):
        raise gone(address) from None
    except ValueError:  # Dask's own, of a future that it has cancelled
        if client.status == "running":
            raise
        raise gone(address) from None
    finally:
        client.close(timeout=_CONNECT_S)


def _client(address: str) -> Any:
    """Client of a cluster, whose own messages are muted: what goes wrong is said once, by us."""
    import logging

    from distributed import Client

    for name in logging.root.manager.loggerDict:  # each has a level of its own
        if name.partition(".")[0] in ("distributed", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    _check_private(address)
    try:
        return Client(**{"scheduler_file" if Path(address).is_file() else "address": address}, timeout=_CONNECT_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise SensorgenError(
            f"no Dask scheduler at {address!r} ({str(error).splitlines()[0]:.80}); {_EXPECTED_CLUSTER}"
        ) from None
