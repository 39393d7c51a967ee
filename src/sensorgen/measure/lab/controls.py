"""Commands to a run: keys of the terminal, signals, and whatever else gives them."""

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

KEYS = {"p": "pause", " ": "pause", "r": "resume", "q": "abort", "a": "abort", "\x03": "abort"}
ABOUT = "p pause, r resume, q abort"
_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")


class Controls:
    """Commands of all sources.

    Parameters
    ----------
    sources : sequence of callable
        Each returns the commands since its last call: "pause", "resume", "abort".
    """

    def __init__(self, sources: Sequence[Callable[[], list[str]]] = ()) -> None:
        self._sources = list(sources)
        self.signal = ""

    def add(self, source: Callable[[], list[str]]) -> None:
        """One more source."""
        self._sources.append(source)

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
