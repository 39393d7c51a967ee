"""Exchange records and raw files between logs: a shared folder or a file that each machine syncs with; backups.

A folder holds ``records/SHA256.jsonl``, files of records that are never changed, and ``files``, the raw files as a log
has them. Each machine only adds files under names that their content decides, so that no two can be in conflict, and
a drive without locks, a stick or a cloud folder will do. A ``.zip`` holds the same.
"""

import itertools
import json
import os
import shutil
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from sensorgen.core import files as store
from sensorgen.core.document import Part
from sensorgen.core.errors import BadInput
from sensorgen.core.records import shown
from sensorgen.measure.log import files
from sensorgen.measure.log.chain import Record
from sensorgen.measure.log.entries import NAMES, RawFile, decode
from sensorgen.measure.log.logbook import Log, Merging

MOST_BYTES = 2_000_000_000  # of an archive when unpacked
MOST_LINE = 100_000_000  # bytes of one record


@dataclass(frozen=True)
class Synced:
    """Result of a sync, a backup or a restore.

    Attributes
    ----------
    place : str
        The folder or file.
    received, sent : int
        Records that were new to the log, and to the place.
    head : str
        Identity of the log's last record now.
    notes : tuple of str
        What is incomplete.
    """

    place: str
    received: int
    sent: int
    head: str
    notes: tuple[str, ...] = ()

    def document(self) -> Iterator[Part]:
        """Counts, the head, and what is incomplete."""
        yield f"{self.received} records received, {self.sent} sent; {self.place}"
        yield f"head {self.head or 'none: the log is empty'}"
        yield from self.notes


def sync(log: Log, place: Path) -> Synced:
    """Exchange all records and raw files with a folder or a ``.zip``, which is made if it is missing.

    Raises
    ------
    BadInput
        A place that is neither, a record that is not what its identity says, or one of a newer sensorgen.
    Unwritable
        The place cannot be written to.
    """
    notes: list[str] = []
    with _opened(place, create=True) as folder:
        received, there = _pull(log, folder, notes)
        sent = _push(log, folder, there)
    return Synced(str(place), received, sent, log.head()[1], (*notes, *log.conflicts()))


def backup(log: Log, place: Path) -> Synced:
    """Write the whole log to a new folder or ``.zip``.

    Raises
    ------
    BadInput
        The place exists.
    Unwritable
        It cannot be written.
    """
    if place.exists():
        raise BadInput(f"{str(place)!r} is there; expected a new folder or .zip, or sensorgen log sync {str(place)!r}")
    with _opened(place, create=True) as folder:
        sent = _push(log, folder, b"")
    return Synced(str(place), 0, sent, log.head()[1])


def restore(log: Log, place: Path) -> Synced:
    """Fill an empty log from a backup, or from a place that logs are synced with.

    Raises
    ------
    BadInput
        The log has rows; or the place is none.
    """
    if log.head()[0]:
        raise BadInput(f"the log {str(log.path)!r} has rows; expected an empty or new one: name it with --log")
    notes: list[str] = []
    with _opened(place, create=False) as folder:
        received, _ = _pull(log, folder, notes)
    return Synced(str(place), received, 0, log.head()[1], tuple(notes))


@contextmanager
def _opened(place: Path, *, create: bool) -> Iterator[Path]:
    """The folder of a place; an archive is unpacked beside it, and packed again at the end."""
    if not create and not place.exists():
        raise BadInput(f"no folder or .zip at {str(place)!r}; expected what sensorgen log backup or sync wrote")
    with store.writing(place, "cannot use"):
        if place.suffix.lower() == ".zip":
            with tempfile.TemporaryDirectory(prefix="sensorgen-") as folder:
                yield from _unpacked(place, Path(folder), create=create)
            return
        if place.exists() and not place.is_dir():
            raise BadInput(f"{str(place)!r} is a file; expected a folder or a .zip")
        if not create and not (place / "records").is_dir():
            raise BadInput(f"{str(place)!r} has no folder 'records'; expected what log backup or sync wrote")
        place.mkdir(parents=True, exist_ok=True)
        yield place


def _unpacked(place: Path, folder: Path, *, create: bool) -> Iterator[Path]:
    """The folder of an archive, which is packed again at the end where it may be written."""
    if place.exists():
        _unpack(place, folder)
    yield folder
    if create:
        with store.replacing(place) as target, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in sorted(path for path in folder.rglob("*") if path.is_file()):
                archive.write(file, file.relative_to(folder).as_posix())


def _unpack(place: Path, folder: Path) -> None:
    try:
        with zipfile.ZipFile(place) as archive:
            if sum(item.file_size for item in archive.infolist()) > MOST_BYTES:
                raise BadInput(f"{str(place)!r} is more than {MOST_BYTES / 1e9:g} GB unpacked; sync with a folder")
            archive.extractall(folder)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError) as error:
        raise BadInput(f"{str(place)!r} is no archive of a log: {str(error)[:80]}") from None


def _left(merging: Merging, stuck: Sequence[tuple[Path, int]]) -> set[str]:
    """Records that still follow a missing one, after all others of the files have been taken."""
    left, before = set[str](), -1
    while stuck and before < merging.added:
        before = merging.added
        left = {record.id for start in stuck for record, *_ in _records(*start) if merging.take(record)}
    return left


def _pull(log: Log, folder: Path, notes: list[str]) -> tuple[int, bytearray]:
    """Add what the folder has: number of new records, and which records it had. Notes grow by what is incomplete.

    A file is read until a record follows one that is not there yet, and on from that place when it is. Records are
    therefore held one at a time.
    """
    ready = [(path, 0) for path in _whole(log, folder, notes)]
    waiting: dict[str, list[tuple[Path, int]]] = {}
    with log.merging() as merging:
        while ready:
            for record, at, path in _records(*ready.pop()):
                missing = merging.take(record)
                if missing:
                    waiting.setdefault(missing, []).append((path, at))
                    break
                ready += waiting.pop(record.id, [])
        left = _left(merging, list(itertools.chain(*waiting.values())))
    if left:
        notes.append(f"{len(left)} records follow others that are not there yet; sync again when they are")
    return merging.added, merging.offered


def _whole(log: Log, folder: Path, notes: list[str]) -> Iterator[Path]:
    """Files of records that are what their names say, and no links; the raw files that they tell of are kept."""
    for path in sorted((folder / "records").glob("*.jsonl")):
        if path.is_symlink() or not path.is_file() or files.digest(path) != path.stem:
            wrong = "is a link" if path.is_symlink() else "is incomplete or was changed"
            notes.append(f"{path.name:.20} {wrong}, and was left out")
            continue
        for record, *_ in _records(path, 0, b"raw_file"):
            if record.kind == NAMES[RawFile]:
                _fetch(log, folder, decode(RawFile, record.content, 0, record.logged_at), notes)
        yield path


def _fetch(log: Log, folder: Path, file: RawFile, notes: list[str]) -> None:
    """Keep a raw file that the folder has and the log has not."""
    source = files.place(folder / "files", file)
    if files.place(log.files, file).is_file():
        return
    if source.is_symlink():
        notes.append(f"raw file {shown(file.name)} is a link in {str(folder)!r}, and was left out; put the file there")
    elif source.is_file():
        files.keep(log.files, source, file)
    else:
        notes.append(f"raw file {shown(file.name)} is not in {str(folder)!r}; sync again when it is")


def _records(path: Path, start: int, word: bytes = b"") -> Iterator[tuple[Record, int, Path]]:
    """Records of a file from a byte on, each with the byte where it begins; only lines with a word if one is given."""
    with path.open("rb") as file:
        file.seek(start)
        while line := file.readline(MOST_LINE):
            if word in line:
                yield _parsed(line.decode("utf-8", "replace"), path), start, path
            start += len(line)


def _parsed(line: str, path: Path) -> Record:
    with suppress(ValueError, TypeError, KeyError, RecursionError):
        data = json.loads(line)
        record = Record(**{**data, "parents": tuple(data["parents"])})
        texts = (record.id, record.kind, record.logged_at, record.content, *record.parents)
        if type(record.version) is int and all(type(text) is str for text in texts):
            return record
    raise BadInput(f"{path}: {line!r:.60} is no record; expected a file as sensorgen log sync writes it")


def _push(log: Log, folder: Path, there: Sequence[int]) -> int:
    """Add to the folder what it lacks; number of records.

    Parameters
    ----------
    log : Log
        The log.
    folder : Path
        The folder.
    there : sequence of int
        At the number of each record that the folder has: 1.
    """
    for name in ("records", "files"):
        _refuse_link(folder / name)
    for file in log.entries(RawFile, superseded=True):
        target = files.place(folder / "files", file)
        ours = files.place(log.files, file)
        if not target.is_file() and ours.is_file():
            _refuse_link(target.parent)
            with store.replacing(target) as copy, ours.open("rb") as source:
                shutil.copyfileobj(source, copy)
    sent, digest, part = 0, sha256(), store.part_of(folder / "records" / "new.jsonl")
    part.parent.mkdir(exist_ok=True)
    try:
        with part.open("wb") as lines:
            for number, record in enumerate(log.records(), 1):
                if number >= len(there) or not there[number]:
                    line = f"{json.dumps(vars(record), ensure_ascii=False)}\n".encode()
                    digest.update(line)
                    lines.write(line)
                    sent += 1
            lines.flush()
            os.fsync(lines.fileno())
        if sent:
            part.replace(part.with_name(f"{digest.hexdigest()}.jsonl"))
    finally:
        part.unlink(missing_ok=True)
    return sent


def _refuse_link(folder: Path) -> None:
    """Refuse to write through a link, which may lead to any place."""
    if folder.is_symlink():
        raise BadInput(f"{str(folder)!r} is a link; expected a folder: move it away, and sync again")
