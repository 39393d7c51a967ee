"""Processes that end with the process that started them, also when that is killed.

As a program, ``python -I -S leash.py PROGRAM ...`` runs a program of others in its own process group, and ends the
group when its standard input ends; its exit code is the program's.
"""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress

NOT_RUN = 125  # exit code where the program cannot be run
_DEATH = 1  # PR_SET_PDEATHSIG of Linux


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
