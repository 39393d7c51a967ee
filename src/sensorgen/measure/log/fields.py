"""Values of a row's fields in JSON, CSV and Parquet; exact in both directions.

Records hold a row as a JSON object without the fields that have their default. Infinity, which JSON lacks, is written
as 9e999, which Python and SQLite read as one. A cell of CSV is text as it is, nothing for None, and JSON for the rest.
Pydantic is not used here: ``sensorgen log list`` would spend most of its time on the import.
"""

import json
import math
from dataclasses import MISSING, fields
from functools import cache
from types import NoneType
from typing import Any, TypeVar, cast, get_args, get_type_hints

from sensorgen.core.errors import BadInput
from sensorgen.measure.log.entries import KINDS, NAMES, Entry

Value = str | int | float | bool | tuple[float, ...] | tuple[str, ...] | None
UNHASHED = ("number", "logged_at")  # given by the log, and by the record
INDEXED: dict[str, type] = {"uid": str, "specimen": str, "iteration": int, "design_id": str, "supersedes": str}
_Kind = TypeVar("_Kind", bound=Entry)
_COLUMNS: dict[type[Entry], dict[str, Any]] = {kind: get_type_hints(kind) for kind in KINDS.values()}
_HELD: dict[type[Entry], dict[str, tuple[Any, object]]] = {  # by a record: types and defaults
    kind: {f.name: (of[f.name], f.default) for f in fields(kind) if f.name not in UNHASHED}
    for kind, of in _COLUMNS.items()
}


def columns(kind: type[Entry]) -> dict[str, Any]:
    """Fields of a row with their types."""
    return _COLUMNS[kind]


def encode(entry: Entry) -> str:
    """Content of a row's record.

    Raises
    ------
    BadInput
        A value that the field cannot have.
    """
    kind, data = type(entry), dict[str, Any]()
    for name, (annotation, usual) in _HELD[kind].items():
        value = getattr(entry, name)
        if value != usual:
            data[name] = value
            _checked(name, annotation, list(value) if isinstance(value, tuple) else value, kind)
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":"))
    if "Infinity" not in text:
        return text
    return f"{{{','.join(f'{json.dumps(name)}:{_json(value)}' for name, value in data.items())}}}"


def decode(kind: type[_Kind], content: str, number: int, logged_at: str) -> _Kind:
    """Row of a record.

    Raises
    ------
    BadInput
        Content that no version of sensorgen writes for this kind.
    """
    try:
        data = json.loads(content)
    except (ValueError, TypeError, RecursionError):
        data = None
    if not isinstance(data, dict):
        raise BadInput(f"a {kind.__name__} of which the content is no JSON object: {content!r:.60}")
    held = _HELD[kind]
    strange = data.keys() - held.keys()
    missing = [name for name, (_, usual) in held.items() if usual is MISSING and name not in data]
    if strange or missing:
        wrong = f"has {min(strange)!r:.40}" if strange else f"lacks {missing[0]!r}"
        raise BadInput(f"a {kind.__name__} {wrong}; expected {', '.join(held)}")
    values = {name: _checked(name, held[name][0], value, kind) for name, value in data.items()}
    return kind(**values, number=number, logged_at=logged_at)  # type: ignore[arg-type]


def indexed(content: str) -> tuple[str | int | None, ...]:
    """What the log's index has of a record's content: the fields of ``INDEXED``, None for those that it has not."""
    try:
        data = json.loads(content)
    except (ValueError, RecursionError):
        data = None
    held = data if isinstance(data, dict) else {}
    return tuple(held[name] if type(held.get(name)) is kind else None for name, kind in INDEXED.items())


def _checked(name: str, annotation: Any, value: Any, kind: type[Any]) -> Value:
    try:
        return from_json(annotation, value)
    except (TypeError, ValueError):
        raise BadInput(f"column {name} of a {kind.__name__} holds {value!r:.60}") from None


def word(kind: type[Any]) -> str:
    """Kind of a row in a sentence.

    >>> from sensorgen.measure.log.entries import BenchRun, DesignRow
    >>> word(BenchRun), word(DesignRow)
    ('recording', 'design')
    """
    name = NAMES[kind].replace("_", " ")
    return "recording" if name == "bench run" else name


def to_cell(value: Value) -> str:
    """Value as a cell of CSV; :func:`from_cell` is the inverse."""
    if value is None:
        return ""
    return value if isinstance(value, str) else _json(value)


def _json(value: Value) -> str:
    text = json.dumps(value, ensure_ascii=False)
    texts = isinstance(value, str) or (isinstance(value, tuple) and value and isinstance(value[0], str))
    return text if texts else text.replace("Infinity", "9e999")


def from_cell(annotation: Any, cell: str) -> Value:
    """Value of a cell, by the field's type; ValueError, TypeError or RecursionError for any other cell."""
    optional, kind, _ = _kinds(annotation)
    if cell == "" and optional:
        return None
    return from_json(annotation, cell if kind is str else json.loads(cell))


def from_json(annotation: Any, value: Any) -> Value:
    """Value out of JSON, by the field's type; ValueError or TypeError for any other."""
    optional, kind, items = _kinds(annotation)
    if value is None and optional:
        return None
    if kind is list:
        if type(value) is not list or not all(type(item) in items and item == item for item in value):
            raise ValueError(f"{value!r:.60} is no list of {items[-1].__name__}")
        return tuple(items[-1](item) for item in value)
    if kind is float and type(value) in (float, int) and math.isfinite(value):
        return float(value)
    if type(value) is not kind or kind is float:
        raise TypeError(f"{value!r:.60} is no {kind.__name__}")
    return cast(Value, value)


@cache
def _kinds(annotation: Any) -> tuple[bool, Any, tuple[type, ...]]:
    """Whether a field may be None, its type in JSON, and the types of its items if that is a list."""
    if annotation == tuple[float, ...]:
        return False, list, (int, float)
    if annotation == tuple[str, ...]:
        return False, list, (str,)
    kinds = get_args(annotation) or (annotation,)
    return NoneType in kinds, next(kind for kind in kinds if kind is not NoneType), ()
