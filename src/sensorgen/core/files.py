"""Files on disk: places of those of the user's own, and results written whole: renamed when they are complete."""

import json
import os
import re
import shutil
import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from secrets import token_hex
from types import FrameType
from typing import Any, BinaryIO

from sensorgen.core.errors import BadInput, Unwritable


def data(variable: str, name: str) -> Path:
    """Place of what is to last, as the log.

    Parameters
    ----------
    variable : str
        The environment variable with another place.
    name : str
        Of the file or folder, below the system's own place: XDG's, Apple's or Microsoft's.
    """
    return _own(variable) or _below("XDG_DATA_HOME", ".local/share", "Application Support") / "sensorgen" / name


def config(variable: str, name: str) -> Path:
    """Place of what the user writes by hand, as packs; parameters as :func:`data`."""
    return _own(variable) or _below("XDG_CONFIG_HOME", ".config", "Application Support") / "sensorgen" / name


def cache(variable: str) -> Path:
    """Place of what may be deleted; parameters as :func:`data`."""
    return _own(variable) or _below("XDG_CACHE_HOME", ".cache", "Caches") / "sensorgen"


def _own(variable: str) -> Path | None:
    given = os.environ.get(variable)
    return Path(given) if given else None


def _below(xdg: str, usual: str, apple: str) -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / apple
    given = os.environ.get(xdg, "")
    return Path(given) if Path(given).is_absolute() else Path.home() / usual  # XDG ignores relative paths


MANIFEST = "manifest.json"
SEAL = "sha256"  # key of a record's own hash
ELSEWHERE = "; name another place with --out"
_OURS: set[str] = set()  # parts of this process: an earlier process may have had the same number


@contextmanager
def staging(folder: Path) -> Iterator[Path]:
    """An empty folder beside ``folder`` to write into; gone afterwards, whatever happens.

    Raises
    ------
    Unwritable
        The place cannot be written to, or the disk is full.
    """
    stage = part_of(folder)
    try:
        with writing(folder, advice=ELSEWHERE):
            _refuse_file(folder)
            folder.parent.mkdir(parents=True, exist_ok=True)
            remove_stale_parts(folder.parent, folder.name)
            stage.mkdir()
            yield stage
    finally:
        with _undisturbed():
            shutil.rmtree(stage, ignore_errors=True)


@contextmanager
def reading(path: Path | str) -> Iterator[None]:
    """Read a file inside.

    Raises
    ------
    BadInput
        It is missing or cannot be read.
    """
    try:
        yield
    except (OSError, ValueError) as error:
        raise BadInput(f"cannot read {str(path)!r}: {getattr(error, 'strerror', None) or error}") from None


@contextmanager
def writing(path: Path, cannot: str = "cannot write to", advice: str = "") -> Iterator[None]:
    """Write to a place inside; errors of the file system say what ``cannot`` be done, and give advice.

    Raises
    ------
    Unwritable
        The place cannot be written to, or the disk is full.
    """
    try:
        yield
    except OSError as error:
        raise Unwritable(f"{cannot} {str(path)!r}: {error.strerror or error}{advice}") from None


def _refuse_file(folder: Path) -> None:
    for place in (folder, *folder.parents):
        if os.path.lexists(place) and not place.is_dir():
            what = "a link that leads nowhere" if place.is_symlink() else "a file"
            raise Unwritable(
                f"{str(place)!r} is {what}; expected a folder: move it away, or name another place with --out"
            )


def new_folder(folder: Path) -> None:
    """Make a folder, or take an empty one.

    Raises
    ------
    BadInput
        It has files.
    """
    if folder.exists() and any(folder.iterdir()):
        raise BadInput(f"{str(folder)!r} has files; expected a new or empty folder: --out another one")
    folder.mkdir(parents=True, exist_ok=True)


def part_of(target: Path) -> Path:
    """Temporary place to write before it is renamed to ``target``: a new one each time, with the process id."""
    part = target.parent / f".{target.name}.{token_hex(4)}.{os.getpid()}.part"
    _OURS.add(part.name)
    return part


def remove_stale_parts(folder: Path, name: str = "*") -> None:
    """Remove what killed runs have left of a name, or of all names in a folder."""
    for left in folder.glob(f".{name}.*.part"):
        pid = left.name.split(".")[-2]
        if re.fullmatch("[0-9]{1,9}", pid) and left.name not in _OURS and not alive(int(pid)):
            if left.is_dir():
                shutil.rmtree(left, ignore_errors=True)
            else:
                with suppress(OSError):
                    left.unlink()


def sync_folder(folder: Path) -> None:
    """Flush a folder's entries to the disk; Windows has no such call."""
    if os.name != "nt":
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def alive(pid: int) -> bool:
    """Test whether another process of that number runs; on Windows, where asking would end it, always."""
    if pid == os.getpid():  # left by an earlier process of our number, as containers have them
        return False
    try:
        if os.name != "nt":
            os.kill(pid, 0)
        return True
    except ProcessLookupError:
        return False
    except OSError:
        return True


def publish(stage: Path, folder: Path, manifest: str = MANIFEST) -> None:
    """Move all staged files into place, the manifest last; files that only an earlier manifest lists go.

    Everything that can fail for lack of space or rights has happened by then: what is left is renaming.
    A user's own files in the folder stay. Another run that publishes here, and Ctrl-C, wait until all are in place.
    """
    folder.mkdir(exist_ok=True)
    staged = _files(stage)
    targets = {name: folder / name for name in staged}
    for target in targets.values():
        if not target.parent.resolve().is_relative_to(folder.resolve()):
            raise Unwritable(f"{str(target.parent)!r} is a link to another folder: move it away, and start again")
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_dir() or not os.access(target.parent, os.W_OK):
            raise Unwritable(
                f"cannot write {str(target)!r}: a folder is in its place, or the folder around it is read-only"
            )
    with alone(folder, wait=True), _undisturbed():
        stale = set(listed(folder, manifest)) - set(staged)
        for name in sorted(set(staged) - {manifest}):
            staged[name].replace(targets[name])
        for name in stale:
            (folder / name).unlink(missing_ok=True)
        staged[manifest].replace(targets[manifest])


def write(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files, by their names relative to ``folder``, and make sure that they are on the disk."""
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())


def replace(path: Path, content: bytes) -> None:
    """Write one file beside its place, then put it there.

    Raises
    ------
    Unwritable
        The place cannot be written to, or the disk is full.
    """
    with replacing(path) as file:
        file.write(content)


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file to write to piece by piece, which takes its place when it is whole; a missing folder is made.

    Raises
    ------
    Unwritable
        The place cannot be written to, or the disk is full.
    """
    part = part_of(path)
    try:
        with writing(path, "cannot write"):
            if path.exists() and not path.is_file():
                raise Unwritable(f"cannot write {str(path)!r}: it is a folder or a device; expected a file")
            part.parent.mkdir(parents=True, exist_ok=True)
            with part.open("wb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            part.replace(path)
    finally:
        with suppress(OSError):
            part.unlink()


def hashes(folder: Path) -> dict[str, str]:
    """SHA-256 of every file below a folder, by its name relative to it."""
    return {name: sha256(file.read_bytes()).hexdigest() for name, file in _files(folder).items()}


def seal(content: Mapping[str, Any]) -> str:
    """SHA-256 of a record without its own."""
    rest = {key: value for key, value in content.items() if key != SEAL}
    return sha256(json.dumps(rest, sort_keys=True, ensure_ascii=False).encode("utf-8", "surrogatepass")).hexdigest()


def _files(folder: Path) -> dict[str, Path]:
    """Files below a folder by their names relative to it."""
    return {file.relative_to(folder).as_posix(): file for file in sorted(folder.rglob("*")) if file.is_file()}


def listed(folder: Path, manifest: str = MANIFEST) -> list[str]:
    """Files in the manifest of an earlier build; none where it is missing or damaged, and none outside the folder."""
    try:
        names = list(json.loads((folder / manifest).read_text("utf-8"))["files"])
        files = ((n, folder / n) for n in names if (folder / n).parent.resolve().is_relative_to(folder.resolve()))
        return [n for n, file in files if file.is_file() or file.is_symlink()]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return []


@contextmanager
def alone(path: Path, *, wait: bool) -> Iterator[bool]:
    """Lock a folder or file, which is made if need be, until the process ends; False where another process has it.

    Parameters
    ----------
    path : Path
        The folder or file.
    wait : bool
        Until the other process releases it; without a lock where the system has none, as in a network folder.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        yield True
        return
    handle, free = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR | os.O_CREAT, 0o644), True
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except OSError as error:
            free = wait
            if not wait and not isinstance(error, BlockingIOError):
                raise
        yield free
    finally:
        os.close(handle)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Hold back Ctrl-C and a request to end for a moment."""
    signals: list[int] = []
    before: dict[int, Any] = {}

    def hold(number: int, _: FrameType | None) -> None:
        signals.append(number)

    with suppress(ValueError):  # not in the main thread: nobody interrupts here
        for number in (signal.SIGINT, signal.SIGTERM):
            before[number] = signal.signal(number, hold)
    try:
        yield
    finally:
        for which, handler in before.items():
            signal.signal(which, handler)
    for which in signals[:1]:
        signal.raise_signal(which)
