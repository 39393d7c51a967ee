"""The log's SQLite file: opened, checked and brought up to date; all or nothing is written, and then it stays.

A commit has reached the disk before it returns (WAL, ``synchronous=FULL``). A new file is made whole beside its
place and then linked there, so that two who start at once share one log, and a killed one leaves none behind.
"""

import os
import sqlite3
import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sensorgen.core.errors import BadInput, SensorgenError, Unwritable
from sensorgen.measure.log.leftovers import part_of, sweep
from sensorgen.measure.log.schema import APPLICATION_ID, STEPS, VERSION

WAIT_S = 20.0  # for another writer to finish
_MAGIC = b"SQLite format 3\0"
_ID = slice(68, 72)  # of the header: PRAGMA application_id
_FORMAT = slice(18, 20)  # of the header: versions to write and to read
_WAL = bytes((2, 2))
_BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
_UNWRITABLE = (
    sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM,
)  # fmt: skip


def connect(path: Path, *, create: bool) -> sqlite3.Connection:
    """Open a log, and make it if it is not there and may be made.

    Parameters
    ----------
    path : Path
        The file.
    create : bool
        Whether to make a new log where there is none.

    Raises
    ------
    BadInput
        There is none, or the file is no log, damaged, or of a newer sensorgen.
    Unwritable
        It cannot be made or brought up to date.
    """
    with told(path):
        if not os.path.lexists(path):
            if not create:
                raise BadInput(f"no log at {str(path)!r}: log something first, or name another with --log")
            _make(path)
        _check_header(path)
        connection = _open(path)
        try:
            _bring_up_to_date(connection, path)
            _check_tables(connection, path)
        except BaseException:
            connection.close()
            raise
        return connection


@contextmanager
def transaction(connection: sqlite3.Connection, path: Path) -> Iterator[None]:
    """All that is written inside is there afterwards, and on the disk, or nothing of it.

    Raises
    ------
    Unwritable
        The disk is full or read-only, or another program keeps the log to itself.
    """
    with told(path):
        connection.execute("BEGIN IMMEDIATE")
        try:
            yield
            connection.execute("COMMIT")
        except BaseException:
            with suppress(sqlite3.Error):
                connection.execute("ROLLBACK")
            raise


@contextmanager
def told(path: Path) -> Iterator[None]:
    """What SQLite has to complain of, in our words."""
    try:
        yield
    except sqlite3.Error as error:
        raise _in_our_words(error, str(path)) from None
    except UnicodeDecodeError as error:
        raise _damaged(str(path), f"text that is no UTF-8: {error.object[:20]!r}") from None
    except UnicodeEncodeError as error:
        raise BadInput(f"{error.object[:60]!r} is not text: it has bytes that are no UTF-8") from None
    except OverflowError:
        raise BadInput("a whole number of more than 64 bits; expected a smaller one") from None
    except OSError as error:
        raise Unwritable(f"cannot use the log {str(path)!r}: {error.strerror or error}") from None


def _in_our_words(error: sqlite3.Error, path: str) -> SensorgenError:
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF
    if code in _BUSY:
        return Unwritable(f"another program keeps the log {path!r} to itself; nothing was logged, try again")
    if code in _UNWRITABLE:
        return Unwritable(f"cannot write to the log {path!r}: {error}; nothing was logged")
    if code == sqlite3.SQLITE_CONSTRAINT:
        return BadInput(f"the log {path!r} does not take this: {error}")
    return _damaged(path, str(error))


def _damaged(path: str, how: str) -> BadInput:
    advice = "take its latest copy, or save what is left with the .recover of sqlite3"
    return BadInput(f"the log {path!r} is damaged: {how}; {advice}")


def _check_header(path: Path) -> None:
    if not path.is_file():
        raise BadInput(f"{str(path)!r} is no file; expected a log, as sensorgen log writes it")
    with path.open("rb") as file:
        header = file.read(100)
    if not header:
        raise BadInput(f"{str(path)!r} is empty; expected a log: remove it, and a new one is made in its place")
    if len(header) < 100 or not header.startswith(_MAGIC):
        raise BadInput(f"{str(path)!r} is no SQLite file; expected a log, as sensorgen log writes it")
    if struct.unpack(">I", header[_ID]) != (APPLICATION_ID,):
        raise BadInput(f"{str(path)!r} is another program's database; expected a log, as sensorgen log writes it")


def _open(path: Path) -> sqlite3.Connection:
    how = "mode=rw" if _writable(path) else "immutable=1"
    connection = sqlite3.connect(f"{path.absolute().as_uri()}?{how}", uri=True, timeout=WAIT_S, isolation_level=None)
    try:
        for pragma in (
            "trusted_schema = OFF", "cell_size_check = ON", "foreign_keys = ON", "recursive_triggers = ON",
            "journal_mode = WAL", "synchronous = FULL",
        ):  # fmt: skip
            connection.execute(f"PRAGMA {pragma}")
    except BaseException:
        connection.close()
        raise
    return connection


def _writable(path: Path) -> bool:
    """Whether this user may write there; where not, a log without a write-ahead log beside it cannot change either."""
    own = {"effective_ids": True} if os.access in os.supports_effective_ids else {}
    return os.access(path.parent, os.W_OK, **own) or Path(f"{path}-wal").exists()


def _make(path: Path) -> None:
    """Make an empty log beside its place, and link it there unless somebody else was first."""
    fresh = [folder for folder in path.parents if not folder.exists()]
    path.parent.mkdir(parents=True, exist_ok=True)
    sweep(path.parent)
    part = part_of(path)
    try:
        with part.open("wb") as file:
            file.write(_empty())
            file.flush()
            os.fsync(file.fileno())
        _put(part, path)
        for folder in (path.parent, *(made.parent for made in fresh)):
            _to_disk(folder)
    finally:
        with suppress(OSError):
            part.unlink()


def _put(part: Path, path: Path) -> None:
    try:
        os.link(part, path)
    except FileExistsError:
        pass
    except OSError:  # a file system without links
        part.rename(path)


def _empty() -> bytes:
    """An empty log as it is on disk."""
    connection = sqlite3.connect(":memory:", isolation_level=None)
    try:
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        _take_steps(connection, 0)
        content = bytearray(connection.serialize())
    finally:
        connection.close()
    content[_FORMAT] = _WAL  # SQLite's file format, 1.3: memory has no write-ahead log that it could be told to keep
    return bytes(content)


def _to_disk(path: Path) -> None:
    if os.name == "nt" and path.is_dir():
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _take_steps(connection: sqlite3.Connection, version: int) -> None:
    for step in STEPS[version:]:
        for statement in step:
            connection.execute(statement)
    connection.execute(f"PRAGMA user_version = {VERSION}")


def _bring_up_to_date(connection: sqlite3.Connection, path: Path) -> None:
    version = _version(connection)
    if version > VERSION or version < 1:
        raise BadInput(
            f"the log {str(path)!r} is of version {version}; expected up to {VERSION}: take a newer sensorgen"
        )
    if version < VERSION:
        with transaction(connection, path):
            _take_steps(connection, _version(connection))  # another may have been faster


def _version(connection: sqlite3.Connection) -> int:
    return int(connection.execute("PRAGMA user_version").fetchone()[0])


def _check_tables(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a file whose tables or triggers are not those of the version that it claims."""
    fresh = sqlite3.connect(":memory:", isolation_level=None)
    try:
        _take_steps(fresh, 0)
        wanted = _objects(fresh)
    finally:
        fresh.close()
    found = _objects(connection)
    wrong = (wanted - found) | {thing for thing in found - wanted if thing[0] == "trigger"}
    if wrong:
        names = ", ".join(sorted({f"{name!r:.40}" for _, name, _ in wrong}))
        raise _damaged(str(path), f"{names:.200} not as sensorgen made it")


def _objects(connection: sqlite3.Connection) -> set[tuple[str, str, str]]:
    return set(connection.execute("SELECT type, name, sql FROM sqlite_schema WHERE sql IS NOT NULL"))
