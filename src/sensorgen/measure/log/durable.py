"""Files that a crash cannot leave incomplete: a temporary file beside the target, fsync, rename."""

import os
import re
from contextlib import suppress
from pathlib import Path
from secrets import token_hex

from sensorgen.core.files import alive

_OURS: set[str] = set()  # of this process: an earlier process may have had the same number
_PART = re.compile(r"\..+\.(?P<pid>[0-9]{1,9})\.part")


def part_of(target: Path) -> Path:
    """Temporary file to write before it is renamed to ``target``: a new one each time, with the process id."""
    part = target.with_name(f".{target.name}.{token_hex(4)}.{os.getpid()}.part")
    _OURS.add(part.name)
    return part


def remove_stale_parts(folder: Path) -> None:
    """Remove the temporary files of killed processes."""
    for path in folder.glob(".*.part"):
        match = _PART.fullmatch(path.name)
        if match and path.name not in _OURS and not alive(int(match["pid"])):
            with suppress(OSError):
                path.unlink()


def sync_folder(folder: Path) -> None:
    """Flush a folder's entries to the disk; Windows has no such call."""
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
