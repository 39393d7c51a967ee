"""Values of a row's fields in JSON, CSV and Parquet; exact in both directions.

Records hold a row as a JSON object without the fields that have their default. Infinity, which JSON lacks, is written
as 9e999, which Python and SQLite read as one. A cell of CSV is text as it is, nothing for None, and JSON for the rest.
Pydantic is not used here: ``sensorgen log list`` would spend most of its time on the import.
"""

import json
import math
from dataclasses import MISSING, fields
from functools import cache, lru_cache
from operator import eq
from types import NoneType
from typing import Any, TypeVar, cast, get_args, get_type_hints

from sensorgen.core.errors import BadInput
from sensorgen.measure.log.entries import KINDS, NAMES, Entry

Value = str | int | float | bool | tuple[float, ...] | tuple[str, ...] | None
UNHASHED = ("number", "logged_at")  # given by the log, and by the record
INDEXED: dict[str, type] = {"uid": str, "specimen": str, "iteration": int, "design_id": str, "supersedes": str}
_Kind = TypeVar("_Kind", bound=Entry)
_COLUMNS: dict[type[Entry], dict[str, Any]] = {kind: get_type_hints(kind) for kind in KINDS.values()}
_Kinds = tuple[bool, Any, frozenset[type]]


@cache
def _kinds(annotation: Any) -> _Kinds:
    """Kinds of a field: True if it may be None, its type in JSON, and the types of its items if that is a list."""
    if annotation == tuple[float, ...]:
        return False, list, frozenset((int, float))
    if annotation == tuple[str, ...]:
        return False, list, frozenset((str,))
    kinds = get_args(annotation) or (annotation,)
    return NoneType in kinds, next(kind for kind in kinds if kind is not NoneType), frozenset()


_TEXT = _kinds(str)
_ENCODER = json.JSONEncoder(ensure_ascii=False, separators=(",", ":"))
_HELD: dict[type[Entry], dict[str, tuple[_Kinds, object]]] = {  # by a record: types and defaults
    kind: {f.name: (_kinds(of[f.name]), f.default) for f in fields(kind) if f.name not in UNHASHED}
    for kind, of in _COLUMNS.items()
}
_REQUIRED = {kind: {name for name, (_, usual) in held.items() if usual is MISSING} for kind, held in _HELD.items()}


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
    for name, (kinds, usual) in _HELD[kind].items():
        value = getattr(entry, name)
        if value != usual:
            data[name] = value
            if kinds is not _TEXT or type(value) is not str:
                _checked(name, kinds, list(value) if isinstance(value, tuple) else value, kind)
    text = _ENCODER.encode(data)
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
    data, held = _object(content), _HELD[kind]
    if data is None:
        raise BadInput(f"a {kind.__name__} of which the content is no JSON object: {content!r:.60}")
    if not (data.keys() <= held.keys() and _REQUIRED[kind] <= data.keys()):
        strange, missing = data.keys() - held.keys(), [name for name in held if name in _REQUIRED[kind] - data.keys()]
        wrong = f"has {min(strange)!r:.40}" if strange else f"lacks {missing[0]!r}"
        raise BadInput(f"a {kind.__name__} {wrong}; expected {', '.join(held)}")
    values = {
        name: value if held[name][0] is _TEXT and type(value) is str else _checked(name, held[name][0], value, kind)
        for name, value in data.items()
    }
    return kind(**values, number=number, logged_at=logged_at)  # type: ignore[arg-type]


def indexed(content: str) -> tuple[str | int | None, ...]:
    """Entries of the log's index for a record's content: the fields of ``INDEXED``, None for those that it has not."""
    held = _object(content) or {}
    return tuple([held[name] if type(held.get(name)) is kind else None for name, kind in INDEXED.items()])


@lru_cache(maxsize=1)  # a record is decoded, and then indexed
def _object(content: str) -> dict[str, Any] | None:
    try:
        data = json.loads(content)
    except (ValueError, TypeError, RecursionError):
        return None
    return data if isinstance(data, dict) else None


def _checked(name: str, kinds: _Kinds, value: Any, kind: type[Any]) -> Value:
    try:
        return _value(kinds, value)
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
    return _value(_kinds(annotation), value)


def _value(kinds: _Kinds, value: Any) -> Value:
    optional, kind, items = kinds
    if value is None and optional:
        return None
    if kind is list:
        if type(value) is not list or not items.issuperset(map(type, value)) or not all(map(eq, value, value)):
            raise ValueError(f"{value!r:.60} is no list of {'texts' if str in items else 'numbers'}")
        return tuple(value) if str in items else tuple(map(float, value))
    if kind is float and type(value) in (float, int) and math.isfinite(value):
        return float(value)
    if type(value) is not kind or kind is float:
        raise TypeError(f"{value!r:.60} is no {kind.__name__}")
    return cast(Value, value)
