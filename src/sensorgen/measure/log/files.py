"""Raw files of instruments, kept whole beside the log under their SHA-256.

They are files and not part of the database: a recording may be larger than SQLite takes in one piece (1 GB), copying a
log stays quick, other programs open them as they are, and they are written once instead of twice. What is lost is that
a log is one file: copy ``log.db`` together with ``log.db.files``; ``sensorgen log verify`` tells what is missing.
"""

import os
import re
from collections.abc import Iterator
from contextlib import suppress
from hashlib import file_digest
from pathlib import Path

from sensorgen.core.errors import BadInput, Unwritable
from sensorgen.measure.log.entries import RawFile
from sensorgen.measure.log.leftovers import part_of, sweep

CHANGES = "changes while it is read: log it when it is complete"
_BLOCK = 1 << 20
_SHA256 = re.compile(r"[0-9a-f]{64}")
_SUFFIX = re.compile(r"\.[A-Za-z0-9]{1,8}")


def place(folder: Path, file: RawFile) -> Path:
    """Where a raw file is: its SHA-256 with the ending that it came with."""
    if not _SHA256.fullmatch(file.uid):
        raise BadInput(f"{file.uid!r:.80} is no SHA-256 of a raw file; expected 64 digits, 0 to f")
    suffix = Path(file.name).suffix
    return folder / file.uid[:2] / (file.uid + (suffix.lower() if _SUFFIX.fullmatch(suffix) else ""))


def keep(folder: Path, path: Path, known: RawFile | None = None) -> RawFile:
    """Copy a file there, whole and on the disk, or not at all; gives the row that the log needs of it.

    Parameters
    ----------
    folder : Path
        Of raw files.
    path : Path
        The file.
    known : RawFile or None
        What it has to be, and was called, where that is known.

    Raises
    ------
    BadInput
        The file cannot be read, or changes meanwhile.
    Unwritable
        The copy cannot be written.
    """
    found = known or raw_file(path)
    target = place(folder, found)
    part = part_of(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        sweep(target.parent)
        with path.open("rb") as source, part.open("wb") as copy:
            while block := source.read(_BLOCK):
                copy.write(block)
            copy.flush()
            os.fsync(copy.fileno())
        if digest(part) != found.uid:
            raise BadInput(f"{str(path)!r} {'is not the file of that SHA-256' if known else CHANGES}")
        part.chmod(0o444)
        part.replace(target)
        _folders_to_disk(target.parent)
    except OSError as error:
        raise Unwritable(f"cannot keep {str(path)!r} in {str(folder)!r}: {error.strerror or error}") from None
    finally:
        with suppress(OSError):
            part.unlink()
    return found


def raw_file(path: Path) -> RawFile:
    """The row of a file, which is only looked at.

    Raises
    ------
    BadInput
        The file cannot be read.
    """
    try:
        if path.exists() and not path.is_file():
            raise BadInput(f"{str(path)!r} is no file; expected a recording")
        return RawFile(uid=digest(path), name=path.name, size=path.stat().st_size)
    except (OSError, ValueError) as error:
        raise BadInput(f"cannot read {str(path)!r}: {getattr(error, 'strerror', None) or error}") from None


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def faults(folder: Path, files: Iterator[RawFile]) -> Iterator[str]:
    """What is wrong with the raw files that a log knows of."""
    for file in files:
        path = place(folder, file)
        try:
            sound = digest(path) == file.uid
        except OSError as error:
            yield f"raw file {file.name} ({path}): {error.strerror or error}"
            continue
        if not sound:
            yield f"raw file {file.name} ({path}) is not what was logged"


def _folders_to_disk(folder: Path) -> None:
    if os.name == "nt":
        return
    for place in (folder, folder.parent, folder.parent.parent):  # each may have been made for this file
        handle = os.open(place, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
