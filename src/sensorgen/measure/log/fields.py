"""Values of a record's fields in SQLite, CSV and Parquet; exact in both directions.

SQLite holds numbers and text as they are and a tuple as JSON, with 9e999 for infinity, which JSON lacks and SQLite and
Python read as one. A cell of CSV is text as it is, nothing for None, and JSON for the rest. Pydantic is not used here:
``sensorgen log list`` would spend most of its time on the import.
"""

import json
import math
from types import NoneType
from typing import Any, get_args

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
    if cell == "" and NoneType in get_args(annotation):
        return None
    return from_sql(annotation, cell if annotation in (str, *_ITEMS) else json.loads(cell))


def from_sql(annotation: Any, value: Any) -> Value:
    """Value of SQLite, by the field's type; errors as :func:`from_cell`."""
    if value is None and NoneType in get_args(annotation):
        return None
    kind = next((a for a in get_args(annotation) if a is not NoneType), annotation) if annotation not in _ITEMS else str
    if kind is float and type(value) in (float, int) and math.isfinite(value):
        return float(value)
    if kind is bool and value in (0, 1):
        return bool(value)
    if type(value) is not kind or kind is bool:
        raise TypeError(f"{value!r:.60} is no {kind.__name__}")
    if annotation not in _ITEMS:
        return value  # type: ignore[no-any-return]
    items, kinds = json.loads(value), _ITEMS[annotation]
    if type(items) is not list or not all(type(item) in kinds and item == item for item in items):  # nan is not itself
        raise ValueError(f"{value!r:.60} is no list of {kinds[-1].__name__}")
    return tuple(kinds[-1](item) for item in items)


_ITEMS: dict[Any, tuple[type, ...]] = {tuple[float, ...]: (int, float), tuple[str, ...]: (str,)}
"""Fields that are held as JSON, and the types of their items."""
