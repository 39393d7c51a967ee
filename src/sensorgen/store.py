"""Results on disk: written beside their place, then renamed, so that no file is ever half there."""

import json
import os
import shutil
import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from types import FrameType

from sensorgen.errors import Unwritable

MANIFEST = "manifest.json"


@contextmanager
def staging(folder: Path) -> Iterator[Path]:
    """An empty folder beside ``folder`` to write into; gone afterwards, whatever happens.

    Raises
    ------
    Unwritable
        The place cannot be written to, or the disk is full.
    """
    _refuse_file(folder)
    stage = folder.parent / f".{folder.name}.{os.getpid()}.part"
    try:
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            _sweep(folder)
            stage.mkdir()
            yield stage
        except OSError as error:
            raise Unwritable(f"cannot write to {str(folder)!r}: {error.strerror or error}; name another place with --out") from None
    finally:
        shutil.rmtree(stage, ignore_errors=True)


def _refuse_file(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise Unwritable(f"{str(folder)!r} is a file; expected a folder: move it away, or name another place with --out")


def _sweep(folder: Path) -> None:
    """Remove what a killed run of this name has left."""
    for left in folder.parent.glob(f".{folder.name}.*.part"):
        pid = left.name.split(".")[-2]
        if pid.isdigit() and not _alive(int(pid)):
            shutil.rmtree(left, ignore_errors=True)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def publish(stage: Path, folder: Path) -> None:
    """Move all staged files into place, the manifest last; files that only an earlier manifest lists go.

    Everything that can fail for lack of space or rights has happened by now: what is left is renaming.
    A user's own files in the folder stay. Ctrl-C waits until all are in place.
    """
    folder.mkdir(exist_ok=True)
    stale = set(_listed(folder)) - {_key(f, stage) for f in _files(stage)}
    with _undisturbed():
        for file in sorted(_files(stage), key=lambda f: f.name == MANIFEST):
            target = folder / file.relative_to(stage)
            target.parent.mkdir(parents=True, exist_ok=True)
            os.replace(file, target)
        for name in stale:
            (folder / name).unlink(missing_ok=True)


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
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        write(part.parent, {part.name: content})
        os.replace(part, path)
    except OSError as error:
        raise Unwritable(f"cannot write {str(path)!r}: {error.strerror or error}") from None
    finally:
        part.unlink(missing_ok=True)


def hashes(folder: Path) -> dict[str, str]:
    """SHA-256 of every file below a folder, by its name relative to it."""
    return {_key(f, folder): sha256(f.read_bytes()).hexdigest() for f in sorted(_files(folder))}


def _files(folder: Path) -> list[Path]:
    return [f for f in folder.rglob("*") if f.is_file()]


def _key(file: Path, folder: Path) -> str:
    return file.relative_to(folder).as_posix()


def _listed(folder: Path) -> list[str]:
    """Names in the manifest of an earlier build; none where it is missing or damaged."""
    try:
        names = list(json.loads((folder / MANIFEST).read_text("utf-8"))["files"])
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return [n for n in names if isinstance(n, str) and (folder / n).resolve().is_relative_to(folder.resolve())]


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Hold back Ctrl-C for a moment."""
    held: list[int] = []

    def hold(number: int, _: FrameType | None) -> None:
        held.append(number)

    try:
        before = signal.signal(signal.SIGINT, hold)
    except ValueError:  # not in the main thread: nobody interrupts here
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if held:
        raise KeyboardInterrupt
