"""Open, check and migrate the log's SQLite file; transactions that survive a crash.

A commit is on the disk before it returns (WAL, ``synchronous=FULL``). A new file is completed beside its path and then
linked there, so that two programs that start together share one log, and a killed program leaves no incomplete log.
"""

import os
import shutil
import sqlite3
import struct
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from sensorgen.core.errors import BadInput, SensorgenError, Unwritable
from sensorgen.core.files import part_of, remove_stale_parts, sync_folder
from sensorgen.measure.log import file_system, migration
from sensorgen.measure.log.schema import APPLICATION_ID, STEPS, VERSION

WAIT_S = 20.0  # for another writer to finish
_MAGIC = b"SQLite format 3\0"
_ID = slice(68, 72)  # of the header: PRAGMA application_id
_FORMAT = slice(18, 20)  # of the header: versions to write and to read
_WAL = bytes((2, 2))
_PRAGMAS = (  # 64 MB of pages: identities come in no order
    "trusted_schema = OFF", "cell_size_check = ON", "foreign_keys = ON", "recursive_triggers = ON",
    "journal_mode = WAL", "synchronous = FULL", "cache_size = -64000",
)  # fmt: skip
_BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
_UNWRITABLE = (
    sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_PERM,
)  # fmt: skip


class _Connection(sqlite3.Connection):
    """Connection with its file, whose path may become another's."""

    file: os.stat_result


def _is(path: Path, file: os.stat_result) -> bool:
    with suppress(OSError):
        return os.path.samestat(path.stat(), file)
    return False


def connect(path: Path, *, create: bool) -> sqlite3.Connection:
    """Open a log and bring it up to date.

    Parameters
    ----------
    path : Path
        The file.
    create : bool
        Whether to create a missing file.

    Raises
    ------
    BadInput
        The file is missing, no log, damaged, or of a newer sensorgen.
    Unwritable
        The file cannot be created or migrated.
    """
    with translate_errors(path):
        shared = file_system.without_locks(path)
        if shared:
            raise BadInput(
                f"{str(path)!r} is on {shared}, where programs cannot lock a file, and rows would be lost; keep the "
                f"log on a disk of this machine, and share it: sensorgen log sync {str(path.with_suffix(''))!r}"
            )
        if not os.path.lexists(path):
            if not create:
                raise BadInput(f"no log at {str(path)!r}: log something first, or name another with --log")
            _create(path)
        _check_header(path)
        return _opened_as_possible(path)


def _opened_as_possible(path: Path) -> sqlite3.Connection:
    """Connection to read and write, or only to read where the folder is not writable or the disk is full."""
    own = {"effective_ids": True} if os.access in os.supports_effective_ids else {}
    wal = Path(f"{path}-wal")
    # without write permission and without a write-ahead log beside it, the file cannot change while it is read
    writable = os.access(path.parent, os.W_OK, **own) or wal.exists()
    try:
        return _opened(path, "mode=rw" if writable else "immutable=1")
    except sqlite3.Error as error:
        if not writable or _code(error) not in _UNWRITABLE:
            raise
    return _merged(path, wal) if wal.exists() and wal.stat().st_size else _opened(path, "immutable=1")


def _merged(path: Path, wal: Path) -> sqlite3.Connection:
    """Connection that reads the rows of a write-ahead log too, whose index, having no room, is kept in memory."""
    try:
        return _opened(path, "mode=rw", "locking_mode = EXCLUSIVE")
    except sqlite3.Error as error:
        if _code(error) not in _UNWRITABLE:
            raise
    return _copied(path, wal)


def _copied(path: Path, wal: Path) -> sqlite3.Connection:
    """Connection to a copy in memory, with the rows of a write-ahead log on a medium that cannot be written."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "log.db"
        shutil.copyfile(path, copy)
        shutil.copyfile(wal, f"{copy}-wal")
        with closing(_opened(copy, "mode=rw")) as merged:
            connection = sqlite3.connect(":memory:", isolation_level=None, factory=_Connection)
            merged.backup(connection)
    connection.file = path.stat()
    connection.execute("PRAGMA query_only = ON")
    return connection


def _opened(path: Path, mode: str, *pragmas: str) -> sqlite3.Connection:
    """Connection to a log of this version, migrated if need be."""
    uri = f"{path.absolute().as_uri()}?{mode}"
    connection = sqlite3.connect(uri, uri=True, timeout=WAIT_S, isolation_level=None, factory=_Connection)
    try:
        connection.file = path.stat()
        for pragma in (*pragmas, *_PRAGMAS):
            connection.execute(f"PRAGMA {pragma}")
        _migrate(connection, path)
        _check_tables(connection, path)
    except BaseException:
        connection.close()
        raise
    return connection


@contextmanager
def transaction(connection: sqlite3.Connection, path: Path) -> Iterator[None]:
    """Commit everything that is written inside to the disk, or nothing.

    Raises
    ------
    Unwritable
        The disk is full or read-only, or another program holds the lock.
    """
    with translate_errors(path):
        connection.execute("BEGIN IMMEDIATE")
        try:
            yield
            if isinstance(connection, _Connection) and not _is(path, connection.file):
                raise Unwritable(f"the log {str(path)!r} was removed or replaced meanwhile; nothing was logged")
            connection.execute("COMMIT")
            with suppress(sqlite3.Error):  # so that a copy of the file alone has everything; the rows are safe without
                connection.execute("PRAGMA wal_checkpoint(PASSIVE)")
        except BaseException:
            with suppress(sqlite3.Error):
                connection.execute("ROLLBACK")
            raise


@contextmanager
def translate_errors(path: Path) -> Iterator[None]:
    """Translate errors of sqlite3 and of the file system to BadInput and Unwritable."""
    try:
        yield
    except sqlite3.Error as error:
        raise _translated(error, str(path)) from None
    except UnicodeDecodeError as error:
        raise _damaged(str(path), f"text that is no UTF-8: {error.object[:20]!r}") from None
    except UnicodeEncodeError as error:
        raise BadInput(f"{error.object[:60]!r} is not text: it has bytes that are no UTF-8") from None
    except OverflowError:
        raise BadInput("a whole number of more than 64 bits; expected a smaller one") from None
    except OSError as error:
        raise Unwritable(f"cannot use the log {str(path)!r}: {error.strerror or error}") from None


def _code(error: sqlite3.Error) -> int:
    return int(getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR)) & 0xFF


def _translated(error: sqlite3.Error, path: str) -> SensorgenError:
    code = _code(error)
    if code in _BUSY:
        return Unwritable(f"another program has locked the log {path!r}; nothing was logged, try again")
    if code in _UNWRITABLE:
        why = "its disk is full or read-only" if code == sqlite3.SQLITE_READONLY else error
        return Unwritable(f"cannot write to the log {path!r}: {why}; nothing was logged")
    if code == sqlite3.SQLITE_CONSTRAINT:
        return BadInput(f"the log {path!r} does not accept this row: {error}")
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


def _create(path: Path) -> None:
    """Write an empty log beside its path, and link it there unless another program was first."""
    new_folders = [folder for folder in path.parents if not folder.exists()]
    path.parent.mkdir(parents=True, exist_ok=True)
    remove_stale_parts(path.parent)
    part = part_of(path)
    left = Path(f"{path}-wal")  # SQLite would write its rows into the new log
    if left.exists() and not os.path.lexists(path):
        why = "is left of a log that was removed or renamed; move it beside that log, by its name, or remove it"
        raise BadInput(f"{str(left)!r} {why}")
    try:
        with part.open("wb") as file:
            file.write(_empty())
            file.flush()
            os.fsync(file.fileno())
        try:
            os.link(part, path)
        except FileExistsError:
            pass
        except OSError:  # a file system without links
            part.rename(path)
        for folder in (path.parent, *(new.parent for new in new_folders)):
            sync_folder(folder)
    finally:
        with suppress(OSError):
            part.unlink()


def _empty() -> bytes:
    """Content of an empty log file."""
    with closing(_in_memory()) as connection:
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        content = bytearray(connection.serialize())
    content[_FORMAT] = _WAL  # file format 1.3 of SQLite: a database in memory cannot be switched to WAL
    return bytes(content)


def _in_memory() -> sqlite3.Connection:
    connection = sqlite3.connect(":memory:", isolation_level=None)
    _take_steps(connection, 0)
    return connection


def _take_steps(connection: sqlite3.Connection, version: int) -> None:
    for step in STEPS[version:]:
        for statement in step:
            connection.execute(statement)
    migration.to_records(connection, version)
    connection.execute(f"PRAGMA user_version = {VERSION}")


def _migrate(connection: sqlite3.Connection, path: Path) -> None:
    def version() -> int:
        return int(connection.execute("PRAGMA user_version").fetchone()[0])

    if not 1 <= version() <= VERSION:
        raise BadInput(
            f"the log {str(path)!r} is of version {version()}; expected up to {VERSION}: take a newer sensorgen"
        )
    if version() < VERSION:
        with transaction(connection, path):
            _take_steps(connection, version())  # another program may have migrated it meanwhile


def _check_tables(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a file whose tables or triggers are not those of this version."""
    with closing(_in_memory()) as sound:
        expected, present = (
            set(database.execute("SELECT type, name, sql FROM sqlite_schema WHERE sql IS NOT NULL"))
            for database in (sound, connection)
        )
    wrong = (expected - present) | {item for item in present - expected if item[0] == "trigger"}
    if wrong:
        names = ", ".join(sorted({f"{name!r:.40}" for _, name, _ in wrong}))
        raise _damaged(str(path), f"{names:.200} not as sensorgen made it")
