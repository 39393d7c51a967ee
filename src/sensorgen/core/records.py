"""Plain data from a file, validated against a record type; faults become our errors."""

import reprlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from sensorgen.core.errors import BadInput, UnknownName

_EXPECTED = {
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "finite_number": "a finite number",
    "float_type": "a number",
    "float_parsing": "a number",
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "{ge:g} or more",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "int_parsing_size": "a smaller whole number",
    "int_type": "a whole number",
    "less_than": "a number below {lt:g}",
    "less_than_equal": "{le:g} or less",
    "list_type": "a list",
    "literal_error": "{expected}",
    "multiple_of": "a multiple of {multiple_of:g}",
    "none_required": "nothing",
    "string_pattern_mismatch": "text such as {example}",
    "string_too_long": "at most {max_length} characters",
    "string_too_short": "at least {min_length} characters",
    "string_type": "text",
    "dict_type": "a mapping of names to values",
    "model_type": "a mapping {record}",
    "too_long": "at most {max_length} entries",
    "too_short": "at least {min_length} entries",
    "tuple_type": "a list",
}


class Strict(BaseModel):
    """A record: unknown keys are refused, true is not 1, and "5" is no number."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


_Record = TypeVar("_Record", bound=Strict)


def checked(kind: type[_Record], data: object) -> _Record:
    """Make a record of plain data.

    Raises
    ------
    BadInput
        The first thing that is wrong: which key, what it is, and what was expected.
    """
    try:
        return kind.model_validate(dict(data) if isinstance(data, Mapping) else data)
    except ValidationError as error:
        raise BadInput(_plain(kind, data, error.errors())) from None


def shown(value: object) -> str:
    """A value as given, cut short."""
    short = reprlib.Repr()
    short.maxstring = 60
    try:
        return short.repr(value)
    except ValueError:  # a whole number of thousands of digits
        return "a huge number"


def _plain(kind: type[Strict], data: object, errors: Sequence[Mapping[str, Any]]) -> str:
    """Pydantic's first fault as our error; of values that may be of several kinds, the fault that lies deepest."""
    first = errors[0]
    alike = [first]
    fork = next((k for k, is_kind in enumerate(_kinds(first, data)) if is_kind), None)
    if fork is not None:
        rivals = [e for e in errors if e["loc"][:fork] == first["loc"][:fork]]
        depth = max(len(_place(e, data)) for e in rivals)
        deepest = [e for e in rivals if len(_place(e, data)) == depth]
        first = next((e for e in deepest if e["type"] == "extra_forbidden"), deepest[0])
        alike = [e for e in deepest if _place(e, data) == _place(first, data)]
    place, error = _place(first, data), first["type"]
    key = ".".join(place) or f"a {kind.__name__.lower()}"
    if error == "value_error":
        return f"{key}: {first['ctx']['error']}"
    if error == "missing":
        return f"{key} is missing"
    if error == "extra_forbidden":
        inside = f" of {'.'.join(place[:-1])}" if len(place) > 1 else ""
        return str(UnknownName(f"key{inside}", place[-1], _keys(_record_at(kind, first["loc"][:-1]))))
    expected = ", or ".join(dict.fromkeys(_expected(kind, each) for each in alike))
    return f"{key} is {shown(first['input'])}; expected {expected}"


def _kinds(error: Mapping[str, Any], data: object) -> list[bool]:
    """Of each part of a fault's place, whether it is not in the data: one of several kinds that a value may be of."""
    found, at = [], data
    for part in error["loc"]:
        inside = part in at if isinstance(at, Mapping) else isinstance(at, list) and part in range(len(at))
        at = at[part] if inside else at  # type: ignore[index]
        found.append(not inside)
    if error["type"] == "missing":
        found[-1] = False
    return found


def _place(error: Mapping[str, Any], data: object) -> list[str]:
    """Where a fault is in the data."""
    return [str(part) for part, is_kind in zip(error["loc"], _kinds(error, data), strict=True) if not is_kind]


def _expected(kind: type[Strict], error: Mapping[str, Any]) -> str:
    """What is expected in place of a value."""
    limits = dict(error.get("ctx", {}))
    record = next((r for r in _records(kind) if r.__name__ == limits.get("class_name")), kind)
    limits["record"] = "of names to values" if record is kind else f"with {', '.join(_keys(record))}"
    limits["example"] = _example(kind, error["loc"])
    if error["type"] not in _EXPECTED:
        return str(error["msg"]).removeprefix("Input should be ").lower()
    return _EXPECTED[error["type"]].format(**limits).replace("at least 1 entries", "at least one entry")


def _keys(record: type[Strict]) -> list[str]:
    """Keys of a record, as a file has them."""
    return [field.alias or name for name, field in record.model_fields.items()]


def _record_at(kind: type[Strict], place: tuple[Any, ...]) -> type[Strict]:
    """The record at a place within a record."""
    for part in place:
        field = kind.model_fields.get(part) if isinstance(part, str) else None
        kind = next(_records(field.annotation), kind) if field else kind
    return kind


def _records(annotation: Any) -> Iterator[type[Strict]]:
    """Records that a type contains, as ``Waiver`` in ``tuple[Waiver, ...]``; those of a record's fields after it."""
    if isinstance(annotation, type) and issubclass(annotation, Strict):
        yield annotation
        for field in annotation.model_fields.values():
            yield from _records(field.annotation)
    for part in get_args(annotation):
        yield from _records(part)


def _example(kind: type[Strict], place: tuple[Any, ...]) -> str:
    """An example of the field at a place, as the field itself has it."""
    field = _record_at(kind, place[:-1]).model_fields.get(str(place[-1])) if place else None
    return " or ".join(map(str, field.examples)) if field and field.examples else "others of its kind"
