"""Open, check and migrate the log's SQLite file; transactions that survive a crash.

A commit is on the disk before it returns (WAL, ``synchronous=FULL``). A new file is completed beside its path and then
linked there, so that two programs that start together share one log, and a killed program leaves no incomplete log.
A new file takes the same steps as an old one: tables of versions 1 and 2 become records, row by row.
"""

import heapq
import json
import os
import re
import shutil
import sqlite3
import struct
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from typing import Any

from sensorgen.core.errors import BadInput, SensorgenError, Unwritable
from sensorgen.core.files import part_of, remove_stale_parts, sync_folder
from sensorgen.measure.log import chain, entries
from sensorgen.measure.log.chain import Record
from sensorgen.measure.log.entries import Entry, Migration

APPLICATION_ID = 0x53474C47  # in the header of the file: "SGLG"


def _step(file: str, *tables: str) -> tuple[str, ...]:
    """Statements of a file, and triggers that refuse to change or delete a row of tables, for every program.

    SQLite keeps the text of a statement, spaces included, and a log is checked by it: never change a file.
    """
    statements = (files(__package__) / file).read_text("utf-8").split(";")[:-1]
    triggers = (
        f"CREATE TRIGGER {table}_no_{event.lower()} BEFORE {event} ON {table} BEGIN "
        "SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END"
        for table in tables
        for event in ("UPDATE", "DELETE")
    )
    return (*statements, *triggers)


STEPS = (  # migrations from each version to the next
    _step("version1.sql", "specimen", "reading"),
    _step("version2.sql", "raw_file", "batch", "print", "bench_run", "prediction"),
    _step("version3.sql", "record"),
)
VERSION = len(STEPS)
_COLUMNS = ("sequence", "id", "parents", "kind", "version", "logged_at", "content", "number", *entries.INDEXED)
_INSERT = f"INSERT INTO record ({', '.join(_COLUMNS)}) VALUES ({', '.join('?' * len(_COLUMNS))})"  # noqa: S608


class Appender:
    """Appends records within a transaction, each with its number among those of its kind.

    Attributes
    ----------
    now : str
        Time of logging of all rows.
    sequence : int
        Number of the last record.
    head : str
        Its identity; "" in an empty log.
    """

    def __init__(self, connection: sqlite3.Connection, sequence: int = 0, head: str = "") -> None:
        self._connection = connection
        self.now = datetime.now(UTC).isoformat(timespec="milliseconds")
        self.sequence, self.head = sequence, head
        self._numbers: dict[str, int] = {}

    @property
    def heads(self) -> list[str]:
        """The last record, if there is one."""
        return [self.head] if self.head else []

    def add(self, entry: Entry, heads: Sequence[str] = ()) -> Entry:
        """Append the record of a row, behind the last one or behind several; the row as logged."""
        kind, content = entries.NAMES[type(entry)], entries.content_of(entry)
        version, text = entries.VERSIONS.get(kind, 1), entries.encoded(content)
        record = chain.made(heads or self.heads, kind, version, self.now, text)
        return entry.numbered(self.append(record, entries.index(content)), self.now)

    def append(self, record: Record, index: Sequence[str | int | None], *, copy: bool = False) -> int:
        """Append a record with its entries of the index; a copy of a row that the log has gets no number of its own."""
        if record.kind not in self._numbers:
            sql = "SELECT max(number) FROM record WHERE kind = ?"
            self._numbers[record.kind] = self._connection.execute(sql, [record.kind]).fetchone()[0] or 0
        self._numbers[record.kind] += not copy
        number = None if copy else self._numbers[record.kind]
        self.sequence, self.head = self.sequence + 1, record.id
        of = (record.id, ",".join(record.parents), record.kind, record.version, record.logged_at, record.content)
        self._connection.execute(_INSERT, [self.sequence, *of, number, *index])
        return number or 0

    def finish(self) -> None:
        """Note the last record apart, so that rows missing at the end are noticed."""
        if self._numbers:
            sql = "INSERT INTO head VALUES (1, ?, ?) ON CONFLICT DO UPDATE SET sequence = excluded.sequence, " \
                  "id = excluded.id"  # fmt: skip
            self._connection.execute(sql, [self.sequence, self.head])


_TABLES = ("raw_file", "batch", "print", "reading", "bench_run", "prediction")  # a row before those that refer to it
_DROPPED = ("prediction", "bench_run", "print", "batch", "reading", "raw_file", "specimen")
_TIME = re.compile(r"\S+")


def to_records(connection: sqlite3.Connection, version: int) -> None:
    """Within a transaction: keep each row of each table as a record, in the order of their times, and drop the tables.

    Nothing is judged here: a row that cannot be read stays what it is.

    Parameters
    ----------
    connection : sqlite3.Connection
        Of a log with tables of version 2 and those of version 3, which are empty.
    version : int
        Of the file before.
    """
    present = {name for (name,) in connection.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")}
    if not present.issuperset(_DROPPED):
        return
    writer = Appender(connection)
    rows = heapq.merge(*(_rows(connection, table) for table in _TABLES), key=lambda row: row[0])
    for logged_at, table, content in rows:
        at = logged_at if _TIME.fullmatch(logged_at) else writer.now
        writer.append(chain.made(writer.heads, table, 1, at, content), entries.indexed(content))
    if writer.sequence:
        writer.add(Migration(uid="", version=version, rows=writer.sequence))
    writer.finish()
    for table in _DROPPED:
        connection.execute(f"DROP TABLE {table}")


def _rows(connection: sqlite3.Connection, table: str) -> Iterator[tuple[str, str, str]]:
    """Time, table and content of the rows of a table."""
    joined = "NATURAL JOIN specimen" if "specimen" in entries.COLUMNS[entries.KINDS[table]] else ""
    cursor = connection.cursor()
    cursor.row_factory = sqlite3.Row
    for row in cursor.execute(f"SELECT * FROM {table} {joined} ORDER BY number"):  # noqa: S608
        yield str(row["logged_at"]), table, _content(table, row)


def _content(table: str, row: Any) -> str:
    kind = entries.KINDS[table]
    parts = []
    for name, annotation in entries.COLUMNS[kind].items():
        if name not in row.keys() or name in ("number", "logged_at") or row[name] is None:  # noqa: SIM118 - sqlite3.Row
            continue
        value: object = row[name]
        if annotation == bool | None and value in (0, 1):
            value = bool(value)
        listed = annotation in (tuple[float, ...], tuple[str, ...]) and _is_list(value)
        if value in ("", "[]"):
            continue
        parts.append(f'"{name}":{value if listed else json.dumps(value, ensure_ascii=False)}')
    return f"{{{','.join(parts)}}}"


def _is_list(text: object) -> bool:
    try:
        return isinstance(json.loads(str(text)), list)
    except (ValueError, RecursionError):
        return False


# Types in /proc/self/mountinfo: shares, and folders of another machine or program by FUSE; fuseblk is a local disk.
_SHARED = (
    "nfs", "nfs4", "cifs", "smb3", "smbfs", "ncpfs", "afs", "9p", "vboxsf", "vmhgfs", "prl_fs", "ceph", "glusterfs",
    "lustre", "gpfs", "ocfs2", "gfs2", "davfs", "fuse",
)  # fmt: skip
_REMOTE_DRIVE = 4  # GetDriveTypeW of Windows


def without_locks(path: Path) -> str:
    """Name of the file system of a path where it is shared, so that SQLite's locks may not work; else "".

    Parameters
    ----------
    path : Path
        Need not exist. On systems other than Linux and Windows always "".
    """
    if sys.platform == "win32":
        return _windows(path)
    try:
        mounts = Path("/proc/self/mountinfo").read_text("utf-8", "surrogateescape").splitlines()
    except OSError:  # not Linux
        return ""
    real = os.path.realpath(path.parent)
    found = ("", "")
    for line in mounts:
        before, _, after = line.partition(" - ")
        point = before.split()[4].encode("utf-8", "surrogateescape").decode("unicode_escape")
        if real == point or real.startswith(point.rstrip("/") + "/"):
            found = max(found, (point, after.split()[0]), key=lambda mount: len(mount[0]))
    kind = found[1]
    return f"{kind} at {found[0]}" if kind.partition(".")[0] in _SHARED else ""


def _windows(path: Path) -> str:
    import ctypes

    anchor = path.absolute().anchor
    if anchor.startswith("\\\\"):
        return f"the share {anchor}"
    remote = ctypes.windll.kernel32.GetDriveTypeW(anchor) == _REMOTE_DRIVE  # type: ignore[attr-defined,unused-ignore]
    return f"the network drive {anchor}" if remote else ""


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
        shared = without_locks(path)
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
    to_records(connection, version)
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
