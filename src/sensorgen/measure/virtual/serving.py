"""Serve simulators to other programs, by a clock: on a pseudo-terminal or a TCP socket.

Simulators that share a plant take turns, in one process.
"""

import os
import select
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Protocol

TURN = threading.Lock()
_POLL_S = 0.001


class Line(Protocol):
    """Simulator at the end of a line."""

    def exchange(self, data: bytes, time_s: float) -> bytes:
        """Bytes sent by a time, after having received some."""


class Time(Protocol):
    """Clock of a simulator."""

    def now(self) -> float:
        """Time since any moment [s]."""


def serve(simulator: Line, fd: int, clock: Time, stop: threading.Event | None = None) -> None:
    """Answer at one end of a pseudo-terminal or socket until it is stopped, or until the other end is gone.

    Parameters
    ----------
    simulator : Line
        While it raises OSError, the cable being out, nothing is answered.
    fd : int
        File descriptor.
    clock : Time
        Of the simulator.
    stop : Event, optional
        Ends it.
    """
    while not (stop and stop.is_set()):
        try:
            ready, _, _ = select.select([fd], [], [], _POLL_S)
            data = os.read(fd, 4096) if ready else b""
        except (OSError, ValueError):
            return
        if ready and not data:
            return
        try:
            with TURN:
                answer = simulator.exchange(data, clock.now())
        except OSError:
            continue
        try:
            _write(fd, answer)
        except OSError:  # the other end has died
            return


def _write(fd: int, data: bytes) -> None:
    with suppress(BlockingIOError):
        while data:
            data = data[os.write(fd, data) :]


@contextmanager
def pseudo_terminal(simulator: Line, clock: Time) -> Iterator[str]:
    """Serve a simulator on a pseudo-terminal in a thread; gives its path for pyserial.

    This process keeps the terminal open too, so that programs may open and close it again and again.
    """
    import pty
    import tty

    master, slave = pty.openpty()
    tty.setraw(slave)
    stop = threading.Event()
    thread = threading.Thread(target=serve, args=(simulator, master, clock, stop), daemon=True)
    thread.start()
    try:
        yield os.ttyname(slave)
    finally:
        stop.set()
        os.set_blocking(master, False)
        thread.join(1.0)
        for each in (master, slave):
            os.close(each)


@contextmanager
def tcp_server(simulator: Line, clock: Time) -> Iterator[int]:
    """Serve a simulator on a local TCP socket, one program at a time; gives its port."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        stop = threading.Event()
        server.settimeout(0.1)

        def accept() -> None:
            while not stop.is_set():
                with suppress(TimeoutError):
                    line, _ = server.accept()
                    with line:
                        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                        serve(simulator, line.fileno(), clock, stop)

        thread = threading.Thread(target=accept, daemon=True)
        thread.start()
        try:
            yield server.getsockname()[1]
        finally:
            stop.set()
            thread.join(1.0)
