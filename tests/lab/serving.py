"""Serve simulators to other programs: on a pseudo-terminal, a TCP socket, or HTTP, by the real clock.

Simulators that share a plant take turns, in one process.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Protocol

from sensorgen.measure.lab.clock import Clock
from sensorgen.measure.virtual import serving
from sensorgen.measure.virtual.serving import TURN, pseudo_terminal

__all__ = ["TURN", "http_server", "pseudo_terminal", "tcp_server"]


class _Web(Protocol):
    def get(self, path: str, time_s: float) -> tuple[int, bytes]: ...


@contextmanager
def tcp_server(simulator: serving.Line, clock: Clock) -> Iterator[str]:
    """Serve a simulator on a local TCP socket; gives its VISA address."""
    with serving.tcp_server(simulator, clock) as port:
        yield f"TCPIP::127.0.0.1::{port}::SOCKET"


@contextmanager
def http_server(simulator: _Web, clock: Clock) -> Iterator[str]:
    """Serve a simulator by HTTP; gives its address."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            try:
                with TURN:
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
