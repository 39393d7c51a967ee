"""Processes that end with the process that started them, also when that is killed.

As a program, ``python -I -S process.py PROGRAM ...`` runs a program of others in its own process group, and ends the
group when its standard input ends; its exit code is the program's.

A worker is a process of this Python that answers one question after the other, as a library that may crash or hang
needs it. Questions and answers are pickled: both ends are ours.
"""

import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

NOT_RUN = 125  # exit code where the program cannot be run
_DEATH = 1  # PR_SET_PDEATHSIG of Linux
GRACE_S = 5.0  # from the end of its output to the end of the process


def on_leash(command: list[str]) -> list[str]:
    """Command that runs another one on a leash; start it in a session of its own, with a pipe as its input."""
    return [sys.executable, "-I", "-S", __file__, *command] if hasattr(os, "killpg") else command


def end_with_parent(ended: Callable[[], object] | None = None) -> None:
    """End this process with the one that started it: by the system where it offers that, else when ``ended`` returns.

    Parameters
    ----------
    ended : callable
        Returns when the parent has ended; runs in a thread.
    """
    if sys.platform == "linux":
        parent = os.getppid()
        with suppress(OSError, AttributeError, ImportError):
            from ctypes import CDLL

            CDLL(None).prctl(_DEATH, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)
    if ended:
        threading.Thread(target=_leave, args=(ended,), daemon=True).start()


def _leave(ended: Callable[[], object]) -> None:
    ended()
    os._exit(1)


class WorkerEnded(Exception):
    """No answer, and why."""


class Worker:
    """Process that runs a program, whose far end is :func:`answer_input`.

    Parameters
    ----------
    name : str
        In words, as "the mesher".
    program : sequence of str
        Arguments of Python.
    timeout_s : float
        How long one answer may take [s].
    """

    def __init__(self, name: str, program: Sequence[str], timeout_s: float) -> None:
        self._name, self._timeout_s, self._late = name, timeout_s, False
        self._said = tempfile.TemporaryFile()  # noqa: SIM115  (closed in stop; a pipe nobody reads would fill up)
        self.process = subprocess.Popen(  # noqa: S603  (this Python, and a module of our own)
            [sys.executable, *program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said
        )

    def ask(self, question: Any) -> Any:
        """Answer to a question; raises WorkerEnded where there is none."""
        stdin, stdout = self.process.stdin, self.process.stdout
        assert stdin is not None and stdout is not None  # noqa: PT018, S101  (both are pipes, see above)
        clock = threading.Timer(self._timeout_s, self._expire)
        clock.start()
        try:
            stdin.write(pickle.dumps(question))
            stdin.flush()
            return pickle.load(stdout)  # noqa: S301  (from the process that we started)
        except (OSError, EOFError, pickle.UnpicklingError):
            raise WorkerEnded(self._reason()) from None
        finally:
            clock.cancel()

    def stop(self) -> None:
        """End the process: it has nothing that needs closing, and Python's own way out takes a second."""
        self.process.kill()
        self.process.communicate()
        self._said.close()

    def _expire(self) -> None:
        self._late = True
        self.process.kill()

    def _reason(self) -> str:
        if self._late:
            return f"{self._name} took more than {self._timeout_s:g} s and was stopped: try a smaller one, or again"
        try:
            code = self.process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return f"{self._name} gave an answer that cannot be read, and was stopped"
        if code < 0:
            hint = ": there may be too little memory" if -code == signal.SIGKILL else ""
            return f"{self._name} was ended by {signal.Signals(-code).name}{hint}"
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").splitlines()
        last = next((line.strip() for line in reversed(lines) if line.strip()), "it said nothing")
        return f"{self._name} ended with exit code {code}: {last}"


def answer_input(answer: Callable[[Any], object], load: Callable[[], object] = lambda: None) -> None:
    """Answer each question on standard input until it ends; ``load`` comes first, what libraries print is no answer."""
    end_with_parent()
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)
        load()
        while True:
            try:
                question = pickle.load(sys.stdin.buffer)  # noqa: S301  (from the process that started this one)
            except EOFError:
                return
            pickle.dump(answer(question), answers)
            answers.flush()


def _run(command: list[str]) -> int:
    """Exit code of a program, negative for a signal; the whole group ends when the input ends."""

    def watch() -> None:
        while os.read(0, 1 << 12):
            pass
        os.killpg(os.getpgrp(), signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()
    try:
        return subprocess.call(command, stdin=subprocess.DEVNULL)  # noqa: S603 - what the parent has chosen
    except OSError as error:
        os.write(2, (error.strerror or str(error)).encode())
        return NOT_RUN


if __name__ == "__main__":
    code = _run(sys.argv[1:])
    if code < 0:
        if -code != signal.SIGKILL:
            signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    os._exit(code)
