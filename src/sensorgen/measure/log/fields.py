"""Values of a record's fields in SQLite, CSV and Parquet; exact in both directions.

SQLite holds numbers and text as they are and a tuple as JSON, with 9e999 for infinity, which JSON lacks and SQLite and
Python read as one. A cell of CSV is text as it is, nothing for None, and JSON for the rest. Pydantic is not used here:
``sensorgen log list`` would spend most of its time on the import.
"""

import json
import math
from collections.abc import Callable
from types import NoneType
from typing import Any, get_args

Value = str | int | float | bool | tuple[float, ...] | tuple[str, ...] | None


def to_sql(value: Value) -> str | int | float | None:
    """Value for SQLite; :data:`FROM_SQL` is the inverse, by the field's type."""
    return _json(value) if isinstance(value, tuple) else value


def to_cell(value: Value) -> str:
    """Value as a cell of CSV; :func:`from_cell` is the inverse."""
    if value is None:
        return ""
    return value if isinstance(value, str) else _json(value)


def from_cell(annotation: Any, cell: str) -> Value:
    """Value of a cell, by the field's type; ValueError, TypeError, KeyError or RecursionError for any other cell."""
    if cell == "" and annotation in _OPTIONAL:
        return None
    return from_sql(annotation, cell if annotation in _TEXT else json.loads(cell))


def from_sql(annotation: Any, value: object) -> Value:
    """Value of SQLite, by the field's type; errors as :func:`from_cell`."""
    converted: Value = FROM_SQL[annotation](value)
    return converted


def _json(value: Value) -> str:
    text = json.dumps(value, ensure_ascii=False)
    texts = isinstance(value, tuple) and value and isinstance(value[0], str)
    return text if texts else text.replace("Infinity", "9e999")


def _exactly(kind: type) -> Callable[[Any], Any]:
    def check(value: Any) -> Any:
        if type(value) is not kind:
            raise TypeError(f"{value!r:.60} is no {kind.__name__}")
        return value

    return check


def _finite(value: Any) -> float:
    if type(value) not in (float, int) or not math.isfinite(value):
        raise TypeError(f"{value!r:.60} is no finite number")
    return float(value)


def _optional(convert: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return lambda value: None if value is None else convert(value)


def _numbers(text: Any) -> tuple[float, ...]:
    return tuple(float(item) for item in _items(text, (int, float)))


def _texts(text: Any) -> tuple[str, ...]:
    return tuple(_items(text, (str,)))


def _items(text: Any, kinds: tuple[type, ...]) -> list[Any]:
    items = json.loads(_exactly(str)(text))
    if type(items) is not list or not all(type(item) in kinds and item == item for item in items):  # nan is not itself
        raise ValueError(f"{text!r:.60} is no list of {kinds[-1].__name__}")
    return items


FROM_SQL: dict[Any, Callable[[Any], Any]] = {
    str: _exactly(str),
    int: _exactly(int),
    int | None: _optional(_exactly(int)),
    float | None: _optional(_finite),
    bool | None: _optional({0: False, 1: True}.__getitem__),
    tuple[float, ...]: _numbers,
    tuple[str, ...]: _texts,
}
"""From SQLite's value to the field's, by the field's type; errors as :func:`from_cell`."""
_OPTIONAL = frozenset(annotation for annotation in FROM_SQL if NoneType in get_args(annotation))
_TEXT = frozenset(FROM_SQL) - _OPTIONAL - {int}  # held as text in SQLite, too
