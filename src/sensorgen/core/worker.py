"""A process of this Python that answers one question after the other, as a library that may crash or hang needs it.

Questions and answers are pickled: both ends are ours. The process ends with the one that started it.
"""

import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from typing import Any

from sensorgen.core.leash import end_with_parent

GRACE_S = 5.0  # from the end of its output to the end of the process


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
