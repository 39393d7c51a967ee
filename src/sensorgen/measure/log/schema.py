"""Tables and migrations of the log: a new file takes the same steps as an old one."""

import sqlite3
from importlib.resources import files

from sensorgen.measure.log.chain import Record
from sensorgen.measure.log.fields import INDEXED, indexed

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
_COLUMNS = ("sequence", "id", "parents", "kind", "version", "logged_at", "content", "number", *INDEXED)
_INSERT = f"INSERT INTO record ({', '.join(_COLUMNS)}) VALUES ({', '.join('?' * len(_COLUMNS))})"  # noqa: S608


def insert(connection: sqlite3.Connection, record: Record, sequence: int, number: int | None) -> None:
    """Store a record with its number among all, and among its kind."""
    of = (record.id, ",".join(record.parents), record.kind, record.version, record.logged_at, record.content)
    connection.execute(_INSERT, [sequence, *of, number, *indexed(record.content)])
