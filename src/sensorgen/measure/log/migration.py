"""Turn the tables of versions 1 and 2 of the log into records, row by row, and drop them."""

import heapq
import json
import re
import sqlite3
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

from sensorgen.measure.log import chain
from sensorgen.measure.log.entries import KINDS, Migration
from sensorgen.measure.log.fields import columns, encode
from sensorgen.measure.log.schema import insert

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
    now = datetime.now(UTC).isoformat(timespec="milliseconds")
    head, sequence = "", 0
    rows = heapq.merge(*(_rows(connection, table) for table in _TABLES), key=lambda row: row[0])
    for logged_at, table, number, content in rows:
        at = logged_at if _TIME.fullmatch(logged_at) else now
        head, sequence = _append(connection, head, sequence, table, at, content, number)
    if sequence:
        content = encode(Migration(uid="", version=version, rows=sequence))
        head, sequence = _append(connection, head, sequence, "migration", now, content, 1)
        connection.execute("INSERT INTO head VALUES (1, ?, ?)", [sequence, head])
    for table in _DROPPED:
        connection.execute(f"DROP TABLE {table}")


def _append(
    connection: sqlite3.Connection, head: str, sequence: int, kind: str, logged_at: str, content: str, number: int
) -> tuple[str, int]:
    record = chain.made([head] if head else [], kind, 1, logged_at, content)
    insert(connection, record, sequence + 1, number)
    return record.id, sequence + 1


def _rows(connection: sqlite3.Connection, table: str) -> Iterator[tuple[str, str, int, str]]:
    """Time, table, number and content of the rows of a table."""
    joined = "NATURAL JOIN specimen" if "specimen" in columns(KINDS[table]) else ""
    cursor = connection.cursor()
    cursor.row_factory = sqlite3.Row
    rows = cursor.execute(f"SELECT * FROM {table} {joined} ORDER BY number")  # noqa: S608
    for number, row in enumerate(rows, 1):
        yield str(row["logged_at"]), table, number, _content(table, row)


def _content(table: str, row: Any) -> str:
    kind = KINDS[table]
    parts = []
    for name, annotation in columns(kind).items():
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
