"""A slicer's real window on a screen of its own: Xvfb shows it, xdotool has mouse and keys, the screen is a file."""

import os
import struct
import subprocess
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from PIL import Image

PATIENCE_S = 60.0
_SIZE = (1400, 900)


class Screen:
    """A screen, its windows, and who may use it."""

    def __init__(self, xvfb, xdotool, folder):
        read, write = os.pipe()
        command = [xvfb, "-displayfd", str(write), "-screen", "0", "{}x{}x24".format(*_SIZE), "-fbdir", str(folder)]
        self.server = subprocess.Popen(
            [*command, "-nolisten", "tcp", "-noreset"], pass_fds=[write], stderr=subprocess.DEVNULL
        )
        os.close(write)
        with os.fdopen(read) as said:
            self.display = ":" + said.readline().strip()
        self.xdotool, self.memory = xdotool, folder / "Xvfb_screen0"

    def do(self, *words):
        """Let xdotool work; what it says."""
        done = subprocess.run(
            [self.xdotool, *map(str, words)], env={**os.environ, "DISPLAY": self.display}, capture_output=True,
            encoding="utf-8", errors="replace", check=False,
        )  # fmt: skip
        return done.stdout.strip()

    def windows(self):
        """Titles of the windows that are shown, by their numbers; neither parts of others nor bars of progress."""
        found = {number: self.do("getwindowname", number) for number in self.do("search", "--onlyvisible", "").split()}
        return {number: title for number, title in found.items() if title and not title.startswith("Loading")}

    def picture(self):
        """What the screen shows: Xvfb keeps it as an X window dump (XWDFile.h)."""
        dump = self.memory.read_bytes()
        header = struct.unpack(">25I", dump[:100])
        start, width, height, per_line, colours = (header[k] for k in (0, 4, 5, 12, 19))
        pixels = np.frombuffer(dump, np.uint8, per_line * height, start + 12 * colours)
        return Image.fromarray(np.ascontiguousarray(pixels.reshape(height, -1, 4)[:, :width, 2::-1]))

    def close(self):
        """Take the screen down."""
        self.server.terminate()
        self.server.wait()


def until(condition, what):
    """Wait for something, and hand it back."""
    end = time.monotonic() + PATIENCE_S
    while not (found := condition()):
        if time.monotonic() > end:
            raise TimeoutError(what())
        time.sleep(0.3)
    return found


@contextmanager
def opened(screen, command, environment, log):
    """A program with its window, filling the screen: the window's number. Dialogs are an error."""
    with log.open("wb") as file:
        environment = {**os.environ, "DISPLAY": screen.display, "LIBGL_ALWAYS_SOFTWARE": "1", **environment}
        program = subprocess.Popen(command, env=environment, stdout=file, stderr=file, stdin=subprocess.DEVNULL)
    try:

        def ready():
            assert program.poll() is None, log.read_text(errors="replace")[-500:]
            titles = list(screen.windows().values())
            return len(titles) > 1 or any(" - PrusaSlicer-" in title for title in titles)

        until(ready, lambda: f"no project: {screen.windows()}; {log.read_text(errors='replace')[-500:]}")
        only(screen)
        (window,) = screen.windows()
        screen.do("windowmove", window, 0, 0)
        screen.do("windowsize", window, *_SIZE)
        screen.do("windowfocus", "--sync", window)
        time.sleep(2.0)  # until it is drawn anew
        only(screen)
        yield window
    finally:
        program.kill()
        program.wait()


def only(screen):
    """The program's window, and nothing in front of it; for a moment there may be none, while a dialog takes over."""
    titles = until(lambda: list(screen.windows().values()), lambda: "no window is left")
    assert len(titles) == 1, titles
    assert " - PrusaSlicer-" in titles[0], titles


def saved(screen, path):
    """Move the model a little with the keys, as only what has changed is saved, and save the project."""
    before = path.stat().st_mtime_ns

    def done():
        screen.do("mousemove", 300, 700, "click", 1)
        for key in ("ctrl+a", "Right", "ctrl+s"):
            screen.do("key", key)
            time.sleep(0.3)
        only(screen)
        with suppress(OSError):
            return path.stat().st_mtime_ns != before

    until(done, lambda: f"not saved: {screen.windows()}")
    time.sleep(0.5)  # until all of it is written
    return Path(path)
