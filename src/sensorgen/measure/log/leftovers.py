"""Half-written files that a killed process left behind: gone when the next one comes by."""

import os
import re
from contextlib import suppress
from pathlib import Path
from secrets import token_hex

from sensorgen.core import files as store

_OURS: set[str] = set()  # of this process: one of the same number may have been here before it
_PART = re.compile(r"\..+\.(?P<pid>[0-9]{1,9})\.part")


def part_of(target: Path) -> Path:
    """Where to write a file before it takes its place, another one each time; whose it is, is in its name."""
    part = target.with_name(f".{target.name}.{token_hex(4)}.{os.getpid()}.part")
    _OURS.add(part.name)
    return part


def sweep(folder: Path) -> None:
    """Remove the parts in a folder whose processes have ended."""
    for path in folder.glob(".*.part"):
        match = _PART.fullmatch(path.name)
        if match and path.name not in _OURS and not store.alive(int(match["pid"])):
            with suppress(OSError):
                path.unlink()
