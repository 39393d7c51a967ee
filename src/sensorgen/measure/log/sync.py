"""Exchange records and raw files between logs: a shared folder or a file that each machine syncs with; backups.

A folder holds ``records/SHA256.jsonl``, files of records that are never changed, and ``files``, the raw files as a log
has them. Each machine only adds files under names that their content decides, so that no two can be in conflict, and
a drive without locks, a stick or a cloud folder will do. A ``.zip`` holds the same.
"""

import json
import shutil
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from sensorgen.core import files as store
from sensorgen.core.document import Part
from sensorgen.core.errors import BadInput, Unwritable
from sensorgen.core.records import shown
from sensorgen.measure.log import files
from sensorgen.measure.log.chain import Record
from sensorgen.measure.log.entries import RawFile
from sensorgen.measure.log.fields import decode
from sensorgen.measure.log.logbook import Log

MOST_BYTES = 2_000_000_000  # of an archive when unpacked
_FIELDS = ("id", "parents", "kind", "version", "logged_at", "content")


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
    with _opened(place, create=True) as folder:
        there, notes = _records(folder)
        received = _pull(log, folder, there, notes)
        sent = _push(log, folder, there)
    return Synced(str(place), received, sent, log.head()[1], tuple(notes))


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
        sent = _push(log, folder, {})
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
    with _opened(place, create=False) as folder:
        there, notes = _records(folder)
        received = _pull(log, folder, there, notes)
    return Synced(str(place), received, 0, log.head()[1], tuple(notes))


@contextmanager
def _opened(place: Path, *, create: bool) -> Iterator[Path]:
    """The folder of a place; an archive is unpacked beside it, and packed again at the end."""
    if not create and not place.exists():
        raise BadInput(f"no folder or .zip at {str(place)!r}; expected what sensorgen log backup or sync wrote")
    try:
        if place.suffix.lower() != ".zip":
            if place.exists() and not place.is_dir():
                raise BadInput(f"{str(place)!r} is a file; expected a folder or a .zip")
            if not create and not (place / "records").is_dir():
                raise BadInput(f"{str(place)!r} has no folder 'records'; expected what log backup or sync wrote")
            place.mkdir(parents=True, exist_ok=True)
            yield place
            return
        with tempfile.TemporaryDirectory(prefix="sensorgen-") as temporary:
            folder = Path(temporary)
            if place.exists():
                _unpack(place, folder)
            yield folder
            if create:
                with store.replacing(place) as target, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
                    for file in sorted(path for path in folder.rglob("*") if path.is_file()):
                        archive.write(file, file.relative_to(folder).as_posix())
    except OSError as error:
        raise Unwritable(f"cannot use {str(place)!r}: {error.strerror or error}") from None


def _unpack(place: Path, folder: Path) -> None:
    try:
        with zipfile.ZipFile(place) as archive:
            if sum(item.file_size for item in archive.infolist()) > MOST_BYTES:
                raise BadInput(f"{str(place)!r} is more than {MOST_BYTES / 1e9:g} GB unpacked; sync with a folder")
            archive.extractall(folder)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError) as error:
        raise BadInput(f"{str(place)!r} is no archive of a log: {str(error)[:80]}") from None


def _pull(log: Log, folder: Path, records: dict[str, Record], notes: list[str]) -> int:
    """Add what the folder has; number of records. Notes grow by what is incomplete."""
    raw = [decode(RawFile, r.content, 0, r.logged_at) for r in records.values() if r.kind == "raw_file"]
    for file in raw:
        source = files.place(folder / "files", file)
        if files.place(log.files, file).is_file():
            continue
        if source.is_file():
            files.keep(log.files, source, file)
        else:
            notes.append(f"raw file {shown(file.name)} is not in {str(folder)!r}; sync again when it is")
    received, left = log.merge(records)
    if left:
        notes.append(f"{left} records follow others that are not there yet; sync again when they are")
    return received


def _records(folder: Path) -> tuple[dict[str, Record], list[str]]:
    """Records in a folder by identity, and notes on files that are incomplete."""
    found, notes = dict[str, Record](), list[str]()
    for path in sorted((folder / "records").glob("*.jsonl")):
        content = path.read_bytes()
        if path.is_symlink() or sha256(content).hexdigest() != path.stem:
            notes.append(f"{path.name:.20} is incomplete or was changed, and was left out")
            continue
        for line in content.decode("utf-8", "replace").splitlines():
            record = _parsed(line, path)
            found[record.id] = record
    return found, notes


def _parsed(line: str, path: Path) -> Record:
    try:
        data = json.loads(line)
        record = Record(**{**data, "parents": tuple(data["parents"])})
    except (ValueError, TypeError, KeyError, RecursionError):
        record = None
    texts = (record.id, record.kind, record.logged_at, record.content, *record.parents) if record else (None,)
    if record is None or type(record.version) is not int or not all(type(text) is str for text in texts):
        raise BadInput(f"{path}: {line!r:.60} is no record; expected a file as sensorgen log sync writes it")
    return record


def _push(log: Log, folder: Path, there: dict[str, Record]) -> int:
    """Add to the folder what it lacks; number of records."""
    missing = [record for record in log.records() if record.id not in there]
    for file in log.entries(RawFile, superseded=True):
        target = files.place(folder / "files", file)
        kept = files.place(log.files, file)
        if not target.is_file() and kept.is_file():
            with store.replacing(target) as copy, kept.open("rb") as source:
                shutil.copyfileobj(source, copy)
    if missing:
        text = "".join(_line(record) for record in missing).encode()
        store.replace(folder / "records" / f"{sha256(text).hexdigest()}.jsonl", text)
    return len(missing)


def _line(record: Record) -> str:
    return json.dumps({name: getattr(record, name) for name in _FIELDS}, ensure_ascii=False) + "\n"
