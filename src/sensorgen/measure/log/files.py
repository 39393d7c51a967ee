"""Raw files of instruments, kept unchanged beside the log under their SHA-256.

They are files and not rows of the database: a recording may exceed the 1 GB that SQLite stores in one value, a log
stays quick to copy, other programs can open the files, and each is written once instead of twice. The price: a log is a
file and a folder. Copy ``log.db`` together with ``log.db.files``; ``sensorgen log verify`` reports what is missing.
"""

import re
import shutil
from collections.abc import Iterator
from hashlib import file_digest
from pathlib import Path

from sensorgen.core.errors import BadInput
from sensorgen.core.files import reading, remove_stale_parts, replacing, sync_folder
from sensorgen.measure.log.entries import RawFile

CHANGED = "changed while it was read: log it when it is complete"
_PHOTOS = (b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", b"II*\0", b"MM\0*", b"GIF8", b"BM")
_SHA256 = re.compile(r"[0-9a-f]{64}")
_SUFFIX = re.compile(r"\.[A-Za-z0-9]{1,8}")


def place(folder: Path, file: RawFile) -> Path:
    """Path of a raw file: its SHA-256 with the suffix of its original name."""
    if not _SHA256.fullmatch(file.uid):
        raise BadInput(f"{file.uid!r:.80} is no SHA-256 of a raw file; expected 64 digits, 0 to f")
    suffix = Path(file.name).suffix
    return folder / file.uid[:2] / (file.uid + (suffix.lower() if _SUFFIX.fullmatch(suffix) else ""))


def keep_photo(folder: Path, path: Path) -> RawFile:
    """Copy a photo, by its first bytes JPEG, PNG, HEIC, WebP, TIFF, GIF or BMP; as :func:`keep`."""
    with reading(path), path.open("rb") as file:
        head = file.read(12)
    if not head.startswith(_PHOTOS) and head[4:8] != b"ftyp" and head[8:] != b"WEBP":
        raise BadInput(f"{str(path)!r} is no photo; expected JPEG, PNG, HEIC, WebP, TIFF, GIF or BMP")
    return keep(folder, path)


def keep(folder: Path, path: Path, known: RawFile | None = None) -> RawFile:
    """Copy a file to the raw files, complete and on the disk, or not at all.

    Parameters
    ----------
    folder : Path
        Of raw files.
    path : Path
        The file.
    known : RawFile or None
        Expected SHA-256 and original name, for a file out of an exported log.

    Returns
    -------
    RawFile
        The row to log.

    Raises
    ------
    BadInput
        The file cannot be read, changes meanwhile, or is another than ``known``.
    Unwritable
        The copy cannot be written.
    """
    row = known or raw_file(path)
    target = place(folder, row)
    with reading(path):
        source = path.open("rb")
    with source, replacing(target) as copy:
        remove_stale_parts(target.parent)
        shutil.copyfileobj(source, copy)
        copy.flush()
        if digest(Path(copy.name)) != row.uid:
            raise BadInput(f"{str(path)!r} {'is not the file of that SHA-256' if known else CHANGED}")
        Path(copy.name).chmod(0o444)
    for changed in (target.parent, folder, folder.parent):  # each may be new
        sync_folder(changed)
    return row


def raw_file(path: Path) -> RawFile:
    """Row of a file, without keeping the file.

    Raises
    ------
    BadInput
        The file cannot be read.
    """
    with reading(path):
        if path.exists() and not path.is_file():
            raise BadInput(f"{str(path)!r} is no file; expected a recording")
        return RawFile(uid=digest(path), name=path.name, size=path.stat().st_size)


def faults(folder: Path, files: Iterator[RawFile]) -> Iterator[str]:
    """Raw files that are missing or damaged, as messages."""
    for file in files:
        path = place(folder, file)
        try:
            if path.is_symlink() or (path.exists() and not path.is_file()):
                yield f"raw file {file.name} ({path}) is a link or no file; expected the file itself"
            elif digest(path) != file.uid:
                yield f"raw file {file.name} ({path}) is not what was logged"
        except OSError as error:
            yield f"raw file {file.name} ({path}): {error.strerror or error}"


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()
