"""One piece of work in a new process with an empty cache: its answer, time and peak memory, first and once more.

As a program, ``python -m sensorgen.verification.apart`` reads a piece of work from its input and writes what it found.
"""

import io
import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from sensorgen.core import cache
from sensorgen.core.errors import SensorgenError
from sensorgen.core.parallel import used_s

_MB = 1024  # kB
_QUICK_S = 0.3  # runs in this process that are shorter than this are repeated, and the median counts
_REPEATS = 5
_AGAIN_S = 1.0  # a first run shorter than this is repeated, in case it had to import


@dataclass(frozen=True)
class ModelAnswer:
    """Answer of a model.

    Attributes
    ----------
    value : tuple of complex
        A capacitance [F], a rise [-], or impedances [ohm]; empty where it has none.
    stated : float or None
        Relative error that the model states [-]; None where it states none.
    certified : bool
        Whether the truth must lie within it.
    """

    value: tuple[complex, ...]
    stated: float | None = None
    certified: bool = False


@dataclass(frozen=True)
class Cost:
    """Time of the processor, and by the clock [s]."""

    cpu_s: float
    wall_s: float


@dataclass(frozen=True)
class TimedAnswer:
    """An answer and what it cost.

    Attributes
    ----------
    answer : ModelAnswer
        Of the first time.
    cold, warm : Cost
        From the start of a new process, None without one; once more in the same process, solved anew.
    memory_mb : float or None
        Peak of the process, libraries included [MB]; None on a system without such a record.
    """

    answer: ModelAnswer
    cold: Cost | None
    warm: Cost
    memory_mb: float | None = None

    def started_s(self) -> float:
        """Start of the process and loading of libraries, at most [s]."""
        return self.cold.cpu_s - self.warm.cpu_s if self.cold else 0.0


Work = Callable[[], ModelAnswer]
Runner = Callable[[Work], TimedAnswer]


def apart(work: Work) -> TimedAnswer:
    """Run a piece of work in a process of its own.

    Parameters
    ----------
    work : callable
        A function of a module, or a partial of one.

    Raises
    ------
    SensorgenError
        As the work does; the process ended before its answer, as when the memory is full.
    """
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, cache.PLACE: folder, "PYTHONSAFEPATH": "1"}
        environment.setdefault("OPENBLAS_NUM_THREADS", "1")
        started = time.time()
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-m", "sensorgen.verification.apart"],
            input=pickle.dumps((started, pickle.dumps(work))), capture_output=True, env=environment, check=False,
        )  # fmt: skip
    if done.returncode:
        last = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        raise SensorgenError(f"the process ended before its answer: {last or 'as when the memory is full'}")
    reply: TimedAnswer | str = pickle.loads(done.stdout)  # noqa: S301 - of our own process
    if isinstance(reply, str):
        raise SensorgenError(reply)
    return reply


def measured(work: Work, before_s: float, started: float) -> TimedAnswer:
    """An answer with its costs; the first one from when ``before_s`` were used and the clock stood at ``started``."""
    answer, cold = _timed(work, before_s, started)
    _, warm = _timed(work, used_s(), time.time())
    return TimedAnswer(answer, cold, warm, _peak_mb())


def here(work: Work) -> TimedAnswer:
    """Run a piece of work in this process, quick work several times, of which the median counts."""
    taken: list[Cost] = []
    while len(taken) < _REPEATS and sum(c.cpu_s for c in taken) < (_AGAIN_S if len(taken) == 1 else _QUICK_S):
        answer, cost = _timed(work, used_s(), time.time())
        taken.append(cost)
    return TimedAnswer(answer, None, sorted(taken, key=lambda cost: cost.cpu_s)[(len(taken) - 1) // 2])


def _timed(work: Work, before_s: float, started: float) -> tuple[ModelAnswer, Cost]:
    with cache.held_back():
        answer = work()
    return answer, Cost(used_s() - before_s, time.time() - started)


def _peak_mb() -> float | None:
    """Peak memory of this process, or of the largest that it has started [MB]."""
    peak = 0.0
    with suppress(OSError):
        lines = Path("/proc/self/status").read_text("utf-8").splitlines()
        peak = next((float(line.split()[1]) for line in lines if line.startswith("VmHWM")), 0.0)
    with suppress(ImportError):
        import resource

        unit = 1 / _MB if sys.platform == "darwin" else 1.0  # bytes there
        of = (resource.RUSAGE_CHILDREN,) if peak else (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
        peak = max(peak, *(resource.getrusage(whose).ru_maxrss * unit for whose in of))
    return peak / _MB if peak else None


def answer_input() -> None:
    """Answer on the standard output, which nothing else may write to: programs of others print what they please."""
    target = os.dup(1)
    os.dup2(2, 1)
    started, packed = pickle.loads(sys.stdin.buffer.read())  # noqa: S301 - of our own process
    reply: TimedAnswer | str
    try:
        reply = measured(pickle.loads(packed), 0.0, started)  # noqa: S301
    except SensorgenError as error:
        reply = str(error)
    with io.FileIO(target, "wb") as file:
        file.write(pickle.dumps(reply))


if __name__ == "__main__":  # its classes are those of the module, not of the program
    from sensorgen.verification import apart as module

    module.answer_input()
