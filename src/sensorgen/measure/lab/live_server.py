"""HTTP server of the live page: this computer only, one secret token, no request to anywhere else."""

import hmac
import threading
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from typing import Any, Protocol
from urllib.parse import parse_qs, urlsplit

_KINDS = {"html": "text/html", "js": "text/javascript", "css": "text/css"}
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
_REQUESTS = 16  # at once; further connections are closed
_TIMEOUT_S = 5.0
_COMMAND_BYTES = 32


class Served(Protocol):
    """View that the server asks."""

    def data(self, after: int, /) -> bytes:
        """Rows after a number, in JSON."""

    def command(self, name: str, /) -> bool:
        """Take a command; True where it is known."""

    def about(self) -> bytes:
        """Title and tones, in JSON."""


class Server(ThreadingHTTPServer):
    """A server in threads of its own.

    Parameters
    ----------
    token : str
        First part of every path.
    served : Served
        What it serves.
    page : str
        Name of the page's files.

    Attributes
    ----------
    port : int
        Port on 127.0.0.1.
    """

    daemon_threads, block_on_close = True, False

    def __init__(self, token: str, served: Served, page: str = "live") -> None:
        super().__init__(("127.0.0.1", 0), _Request)
        self.token, self.served = token, served
        self.hosts = {f"{name}:{self.server_address[1]}" for name in ("127.0.0.1", "localhost")}
        self._free = threading.BoundedSemaphore(_REQUESTS)
        folder = resources.files("sensorgen.measure.lab") / "templates"
        self.port = int(self.server_address[1])
        self._thread = threading.Thread(target=self.serve_forever, args=(0.05,), daemon=True, name="live page")
        files = {"": f"{page}.html"} | {name: name for name in ("live.css", "chart.js", f"{page}.js")}
        self.files = {
            name: ((folder / file).read_bytes(), _KINDS[file.partition(".")[2]]) for name, file in files.items()
        }
        self._thread.start()

    def close(self) -> None:
        """End it; never raises."""
        with suppress(Exception):
            self.shutdown()
            self.server_close()
            self._thread.join(_TIMEOUT_S)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer in a thread, if not too many are busy."""
        if self._free.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer, then let another in."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that has gone is no error."""


class _Request(BaseHTTPRequestHandler):
    server: Server
    timeout = _TIMEOUT_S
    server_version, sys_version = "sensorgen", ""

    def do_GET(self) -> None:
        """Page, style, script, title or data."""
        path = self._path()
        if path is None:
            return self._send(403)
        if path in self.server.files:
            return self._send(200, *self.server.files[path])
        if path == "about":
            return self._send(200, self.server.served.about(), "application/json")
        if path == "data":
            after = parse_qs(urlsplit(self.path).query).get("after", ["0"])[0]
            number = int(after) if after.isdecimal() and len(after) < 16 else 0
            return self._send(200, self.server.served.data(number), "application/json")
        return self._send(404)

    def do_POST(self) -> None:
        """A command: its name is the whole body."""
        path, origin = self._path(), self.headers.get("Origin")
        if path is None or (origin is not None and origin.removeprefix("http://") not in self.server.hosts):
            return self._send(403)
        length = self.headers.get("Content-Length", "")
        if path != "command" or not length.isdecimal() or len(length) > 2 or int(length) > _COMMAND_BYTES:
            return self._send(400 if path == "command" else 404)
        known = self.server.served.command(self.rfile.read(int(length)).decode("ascii", "replace"))
        return self._send(204 if known else 400)

    def _path(self) -> str | None:
        """Path behind the token; nothing if the token or the host is another."""
        token, slash, rest = urlsplit(self.path).path.removeprefix("/").partition("/")
        right = hmac.compare_digest(token.encode(), self.server.token.encode())
        hosts = self.headers.get_all("Host") or []
        return rest if right and slash and len(hosts) == 1 and hosts[0] in self.server.hosts else None

    def _send(self, status: int, body: bytes = b"", kind: str = "text/plain") -> None:
        self.send_response(status)
        for name, value in _HEADERS.items():
            self.send_header(name, value)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - the library's name
        """Requests are not logged."""
