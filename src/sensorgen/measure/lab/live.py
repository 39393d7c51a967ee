"""Live view of a run: a page in the browser that shows what it measures, and takes commands; a line in the terminal.

The page is served to this computer only, at a random port and an address with a secret token. A request without the
token, or for another host, gets 403 and nothing else. The page asks for what is new, so that a slow or closed browser
holds nothing up: a minute of rows is kept, older ones are dropped.
"""

import hmac
import json
import os
import secrets
import shutil
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from types import FrameType
from typing import Any, Self, TextIO
from urllib.parse import parse_qs, urlsplit

import numpy as np
from numpy.typing import ArrayLike

from sensorgen.core.arrays import Complex, Real
from sensorgen.core.units import si

KEYS = {"p": "pause", " ": "pause", "r": "resume", "q": "abort", "a": "abort", "\x03": "abort"}
ABOUT = "p pause, r resume, q abort"
_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


class Controls:
    """Commands of all sources.

    Parameters
    ----------
    *sources : callable
        Each returns the commands since its last call: "pause", "resume", "abort".
    """

    def __init__(self, *sources: Callable[[], list[str]]) -> None:
        self._sources = list(sources)
        self.signal = ""

    def commands(self) -> list[str]:
        """Commands since the last call; a signal aborts."""
        given = [command for source in self._sources for command in source()]
        return [*given, "abort"] if self.signal else given

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Take keys, and signals that ask to end, as commands, so that none interrupts a message to a device."""
        before: dict[int, Any] = {}

        def take(number: int, _: FrameType | None) -> None:
            self.signal = signal.Signals(number).name

        with suppress(ValueError):  # not in the main thread: signals go elsewhere
            for name in _SIGNALS:
                if number := getattr(signal, name, None):
                    before[number] = signal.signal(number, take)
        try:
            with _keys() as keys:
                self._sources.append(keys)
                yield
                self._sources.remove(keys)
        finally:
            for which, handler in before.items():
                signal.signal(which, handler)


@contextmanager
def _keys() -> Iterator[Callable[[], list[str]]]:
    """Keys of the terminal as a source of commands; none where the input is no terminal."""
    if sys.stdin is None or not sys.stdin.isatty():
        yield list
        return
    try:
        import termios
        import tty
    except ImportError:  # Windows
        yield _windows_keys
        return
    file = sys.stdin.fileno()
    before = termios.tcgetattr(file)
    try:
        tty.setcbreak(file)
        yield lambda: _commands(file)
    finally:
        termios.tcsetattr(file, termios.TCSADRAIN, before)


def _commands(file: int) -> list[str]:
    """Commands of the keys that were pressed."""
    import select

    given = b""
    while select.select([file], [], [], 0)[0] and (more := os.read(file, 64)):
        given += more
    return [KEYS[key] for key in given.decode(errors="replace").lower() if key in KEYS]


def _windows_keys() -> list[str]:
    import msvcrt

    given = []
    while msvcrt.kbhit():  # type: ignore[attr-defined,unused-ignore]
        given.append(msvcrt.getwch().lower())  # type: ignore[attr-defined,unused-ignore]
    return [KEYS[key] for key in given if key in KEYS]


COMMANDS = ("pause", "resume", "abort")
_WAITING = 16  # commands that may wait; further ones are dropped, except an abort
_ROW_S, _ROWS = 0.05 * (1 - 1e-6), 1200  # distance of two rows, and how many are kept
_LINE_S, _PLAIN_S = 0.1, 10.0  # between two lines in a terminal, and in a file


@dataclass(frozen=True, eq=False)
class Sample:
    """State of a run at one moment.

    Attributes
    ----------
    time_s : float
        Since the begin of the run [s].
    step, steps : int
        Number of the current step, from 1 on, and of all.
    message : str
        What the run does, in a few words.
    force_n, set_force_n : float
        Force on the specimen, and the force that is asked for [N].
    position_mm : float
        Place of the tip along the specimen [mm].
    impedance_ohm : (m,) array
        At each tone; nan where there is none [ohm].
    predicted_ohm : (m,) array, optional
        What the prediction expects at this force and place [ohm].
    """

    time_s: float
    step: int
    steps: int
    message: str
    force_n: float
    set_force_n: float
    position_mm: float
    impedance_ohm: Complex
    predicted_ohm: Complex | None = None

    def remaining_s(self) -> float:
        """Time left if the steps to come take as long as those that are done; nan in the first [s]."""
        done = self.step - 1
        return self.time_s / done * (self.steps - done) if done > 0 else float("nan")


class LiveView:
    """The live page of a run; use it in a ``with`` statement.

    Parameters
    ----------
    title : str
        What runs: the specimen and the plan.
    tones_hz : (m,) array
        Tones of the impedance meter [Hz].

    Attributes
    ----------
    url : str
        Address of the page, with the secret token that every request needs.

    Raises
    ------
    OSError
        No port of this computer is free.
    """

    names: tuple[str, ...] = COMMANDS
    page = "live"

    def __init__(self, title: str, tones_hz: ArrayLike) -> None:
        self.title = title
        self.tones_hz: Real = np.atleast_1d(np.asarray(tones_hz, float))
        self._lock = threading.Lock()
        self._rows: deque[str] = deque(maxlen=_ROWS)
        self._count, self._kept_s = 0, -np.inf  # rows ever made; time of the last
        self._state = "null"
        self._commands: list[str] = []
        self._last = ""
        token = secrets.token_urlsafe(24)
        self._server = Server(token, self)
        self.url = f"http://127.0.0.1:{self._server.port}/{token}/"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def update(self, sample: Sample) -> None:
        """Show a sample, whether anybody watches or not; of several within 0.05 s only the first."""
        self.keep(sample.time_s, lambda: (_row(sample), _state(sample)))

    def keep(self, time_s: float, drawn: Callable[[], tuple[str, str]]) -> None:
        """Keep a row, or "" for none, and the state, in JSON; of several within 0.05 s only the first."""
        if 0 <= time_s - self._kept_s < _ROW_S:
            return
        row, state = drawn()
        with self._lock:
            self._rows.extend([row] if row else [])
            self._count += bool(row)
            self._kept_s, self._state = time_s, state

    def commands(self) -> list[str]:
        """Commands since the last call, in their order: "pause", "resume", "abort"."""
        with self._lock:
            given, self._commands = self._commands, []
        return given

    def close(self) -> None:
        """End the page; never raises."""
        self._server.close()

    def about(self) -> bytes:
        """Title and tones, in JSON."""
        return json.dumps({"title": self.title, "tones": [si(float(f), "Hz") for f in self.tones_hz]}).encode()

    def data(self, after: int) -> bytes:
        """Rows after a number, as far as they are kept, and the state of the run, in JSON."""
        with self._lock:
            count, state, last = self._count, self._state, self._last
            first = max(count - len(self._rows), after if 0 <= after <= count else 0)
            rows = list(self._rows)[first - count + len(self._rows) :]
        return f'{{"next": {count}, "state": {state}, "last": {json.dumps(last)}, "rows": [{",".join(rows)}]}}'.encode()

    def command(self, name: str) -> bool:
        """Take a command from the page."""
        if name not in self.names:
            return False
        with self._lock:
            if len(self._commands) < _WAITING or (name == "abort" and name not in self._commands):
                self._commands.append(name)
            self._last = name
        return True


def _row(sample: Sample) -> str:
    """Time, force, set force, place; R and X of each tone; the same as predicted, if it is."""
    numbers = [np.array([sample.time_s, sample.force_n, sample.set_force_n, sample.position_mm], float)]
    for z in (sample.impedance_ohm, sample.predicted_ohm):
        if z is not None:
            numbers += [np.real(z), np.imag(z)]
    return f"[{','.join(map(_number, np.concatenate(numbers).tolist()))}]"


def _state(sample: Sample) -> str:
    left, words = _number(sample.remaining_s()), json.dumps(sample.message)
    return (
        f'{{"step": {sample.step}, "steps": {sample.steps}, "elapsed_s": {_number(sample.time_s)},'
        f' "left_s": {left}, "message": {words}}}'
    )


def _number(value: float) -> str:
    """A number in JSON, six digits."""
    return format(value, ".6g") if np.isfinite(value) else "null"


class LiveText:
    """The run in one line of a terminal, updated in place; a plain line every 10 s and at each step elsewhere.

    Parameters
    ----------
    tones_hz : (m,) array
        Tones of the impedance meter [Hz].
    stream : file, optional
        Standard error if not given.
    now : callable
        Time by which a terminal is updated at most ten times a second [s].
    """

    def __init__(
        self, tones_hz: ArrayLike, stream: TextIO | None = None, now: Callable[[], float] = time.monotonic
    ) -> None:
        self._tones = np.atleast_1d(np.asarray(tones_hz, float))
        self._stream, self._now = stream or sys.stderr, now
        self._terminal = self._stream is not None and self._stream.isatty()
        self._shown_s, self._shown = -np.inf, ""  # when, and the state that was shown

    def update(self, sample: Sample) -> None:
        """Show a sample if it is time for it."""
        if self._stream is None:
            return
        now = self._now() if self._terminal else sample.time_s
        state = f"{sample.step} {sample.message}"
        if now - self._shown_s < (_LINE_S if self._terminal else _PLAIN_S) and (self._terminal or state == self._shown):
            return
        self._shown_s, self._shown = now, state
        text = line(sample, self._tones)
        width = shutil.get_terminal_size().columns - 1
        self._write(f"\r{text[:width]:{width}}" if self._terminal else f"{text}\n")

    def close(self) -> None:
        """Leave the line; never raises."""
        if self._terminal and self._shown and self._stream is not None:
            self._write("\n")

    def _write(self, text: str) -> None:
        try:
            self._stream.write(text)
            self._stream.flush()
        except (OSError, ValueError):  # nobody reads any more: the run goes on
            self._stream = None


def line(sample: Sample, tones_hz: Real) -> str:
    """A sample in one line.

    >>> z = np.array([1e6 - 1e6j, 3e3 - 4e3j])
    >>> line(Sample(65, 3, 12, "press", 1.98, 2, 40, z, z / 1.01), np.array([1100.0, 99700.0]))
    '01:05 3/12 press | 1.98 of 2.00 N at 40.0 mm | 1.1 kHz 1.41 Mohm, 99.7 kHz 5 kohm | residual 1.0 % | 05:25 left'
    """
    z = np.abs(sample.impedance_ohm)
    ends = dict.fromkeys([0, len(z) - 1])
    tones = ", ".join(f"{si(tones_hz[k], 'Hz')} {si(z[k], 'ohm', 3) if np.isfinite(z[k]) else '-'}" for k in ends)
    words = "".join(c if c.isprintable() else " " for c in sample.message)
    parts = [
        f"{duration(sample.time_s)} {sample.step}/{sample.steps} {words}",
        f"{sample.force_n:.2f} of {sample.set_force_n:.2f} N at {sample.position_mm:.1f} mm",
        tones,
    ]
    if sample.predicted_ohm is not None:
        residual = np.abs(sample.impedance_ohm / sample.predicted_ohm - 1)
        known = residual[np.isfinite(residual)]
        parts += [f"residual {100 * known.max():.1f} %"] if len(known) else []
    left = sample.remaining_s()
    return " | ".join(parts + ([f"{duration(left)} left"] if np.isfinite(left) else []))


def duration(seconds: float) -> str:
    """Minutes and seconds, with hours from one on.

    >>> duration(65), duration(3700)
    ('01:05', '1:01:40')
    """
    minutes, rest = divmod(round(max(0.0, seconds)), 60)
    return f"{minutes:02}:{rest:02}" if minutes < 60 else f"{minutes // 60}:{minutes % 60:02}:{rest:02}"


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


class Server(ThreadingHTTPServer):
    """A server in threads of its own.

    Parameters
    ----------
    token : str
        First part of every path.
    served : LiveView
        What it serves, and the name of its page's files.

    Attributes
    ----------
    port : int
        Port on 127.0.0.1.
    """

    daemon_threads, block_on_close = True, False

    def __init__(self, token: str, served: LiveView) -> None:
        super().__init__(("127.0.0.1", 0), _Request)
        self.token, self.served = token, served
        self.hosts = {f"{name}:{self.server_address[1]}" for name in ("127.0.0.1", "localhost")}
        self._free = threading.BoundedSemaphore(_REQUESTS)
        folder = resources.files("sensorgen.measure.lab") / "templates"
        self.port = int(self.server_address[1])
        self._thread = threading.Thread(target=self.serve_forever, args=(0.05,), daemon=True, name="live page")
        files = {"": f"{served.page}.html"} | {name: name for name in ("live.css", "chart.js", f"{served.page}.js")}
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
