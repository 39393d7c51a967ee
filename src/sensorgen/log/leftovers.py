"""Half-written files that a killed process left behind: gone when the next one comes by."""

import os
import re
from contextlib import suppress
from pathlib import Path

from sensorgen import store

_PART = re.compile(r"\..+\.(?P<pid>[0-9]{1,9})\.part")


def part_of(target: Path) -> Path:
    """Where to write a file before it takes its place; whose it is, is in its name."""
    return target.with_name(f".{target.name}.{os.getpid()}.part")


def sweep(folder: Path) -> None:
    """Remove the parts in a folder whose processes have ended."""
    for path in folder.glob(".*.part"):
        match = _PART.fullmatch(path.name)
        if match and not store.alive(int(match["pid"])):
            with suppress(OSError):
                path.unlink()
