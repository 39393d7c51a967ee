"""Serve simulators to other programs: on a pseudo-terminal, a TCP socket, or HTTP, by the real clock.

Simulators that share a plant take turns, in one process.
"""

import os
import select
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Protocol

from sensorgen.measure.lab.devices import Clock

_TURN = threading.Lock()
_POLL_S = 0.001


class _Line(Protocol):
    def exchange(self, data: bytes, time_s: float) -> bytes: ...


class _Web(Protocol):
    def get(self, path: str, time_s: float) -> tuple[int, bytes]: ...


def serve(simulator: _Line, master_fd: int, clock: Clock, stop: threading.Event | None = None) -> None:
    """Answer at one end of a pseudo-terminal or socket until it is stopped, or until the other end is gone.

    Parameters
    ----------
    simulator : object
        With ``exchange``; while it raises OSError, the cable being out, nothing is answered.
    master_fd : int
        File descriptor.
    clock : Clock
        Of the plant.
    stop : Event, optional
        Ends it.
    """
    while not (stop and stop.is_set()):
        try:
            ready, _, _ = select.select([master_fd], [], [], _POLL_S)
            data = os.read(master_fd, 4096) if ready else b""
        except (OSError, ValueError):
            return
        if ready and not data:
            return
        try:
            with _TURN:
                answer = simulator.exchange(data, clock.now())
        except OSError:
            continue
        try:
            os.write(master_fd, answer)
        except BlockingIOError:
            continue
        except OSError:  # the other end has died
            return


@contextmanager
def pseudo_terminal(simulator: _Line, clock: Clock) -> Iterator[str]:
    """Serve a simulator on a pseudo-terminal in a thread; gives its path for pyserial.

    This process keeps the terminal open too, so that programs may open and close it again and again.
    """
    import pty
    import tty

    master, slave = pty.openpty()
    tty.setraw(slave)
    with _served(simulator, master, clock):
        yield os.ttyname(slave)
    for each in (master, slave):
        os.close(each)


@contextmanager
def tcp_server(simulator: _Line, clock: Clock) -> Iterator[str]:
    """Serve a simulator on a local TCP socket, one program at a time; gives its VISA address."""
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
            yield f"TCPIP::127.0.0.1::{server.getsockname()[1]}::SOCKET"
        finally:
            stop.set()
            thread.join()


@contextmanager
def http_server(simulator: _Web, clock: Clock) -> Iterator[str]:
    """Serve a simulator by HTTP; gives its address."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            try:
                with _TURN:
                    status, content = simulator.get(self.path, clock.now())
            except OSError:
                self.close_connection = True
                return
            self.send_response(status)
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@contextmanager
def _served(simulator: _Line, fd: int, clock: Clock) -> Iterator[None]:
    stop = threading.Event()
    thread = threading.Thread(target=serve, args=(simulator, fd, clock, stop), daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()
