"""Values of a record's fields in SQLite, CSV and Parquet; exact in both directions.

SQLite holds numbers and text as they are and a tuple as JSON, with 9e999 for infinity, which JSON lacks and SQLite and
Python read as one. A cell of CSV is text as it is, nothing for None, and JSON for the rest. Pydantic is not used here:
``sensorgen log list`` would spend most of its time on the import.
"""

import json
import math
from functools import cache
from types import NoneType
from typing import Any, cast, get_args

Value = str | int | float | bool | tuple[float, ...] | tuple[str, ...] | None


def to_sql(value: Value) -> str | int | float | None:
    """Value for SQLite; :func:`from_sql` is the inverse, by the field's type."""
    return _json(value) if isinstance(value, tuple) else value


def to_cell(value: Value) -> str:
    """Value as a cell of CSV; :func:`from_cell` is the inverse."""
    if value is None:
        return ""
    return value if isinstance(value, str) else _json(value)


def _json(value: Value) -> str:
    text = json.dumps(value, ensure_ascii=False)
    texts = isinstance(value, tuple) and value and isinstance(value[0], str)
    return text if texts else text.replace("Infinity", "9e999")


def from_cell(annotation: Any, cell: str) -> Value:
    """Value of a cell, by the field's type; ValueError, TypeError or RecursionError for any other cell."""
    optional, kind, _ = _kinds(annotation)
    if cell == "" and optional:
        return None
    return from_sql(annotation, cell if kind is str else json.loads(cell))


def from_sql(annotation: Any, value: Any) -> Value:
    """Value of SQLite, by the field's type; errors as :func:`from_cell`."""
    optional, kind, items = _kinds(annotation)
    if value is None and optional:
        return None
    if kind is float and type(value) in (float, int) and math.isfinite(value):
        return float(value)
    if kind is bool and value in (0, 1):
        return bool(value)
    if type(value) is not kind or kind in (bool, float):
        raise TypeError(f"{value!r:.60} is no {kind.__name__}")
    if not items:
        return cast(Value, value)
    found = json.loads(value)
    if type(found) is not list or not all(type(item) in items and item == item for item in found):  # nan is not itself
        raise ValueError(f"{value!r:.60} is no list of {items[-1].__name__}")
    return tuple(items[-1](item) for item in found)


@cache
def _kinds(annotation: Any) -> tuple[bool, Any, tuple[type, ...]]:
    """Whether a field may be None, its type in SQLite, and the types of its items if it is a tuple, held as JSON."""
    if annotation == tuple[float, ...]:
        return False, str, (int, float)
    if annotation == tuple[str, ...]:
        return False, str, (str,)
    kinds = get_args(annotation) or (annotation,)
    return NoneType in kinds, next(kind for kind in kinds if kind is not NoneType), ()
