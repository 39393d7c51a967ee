"""Plain data from a file, validated against a record type; faults become our errors."""

import reprlib
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from sensorgen.core.errors import BadInput, UnknownName

_EXPECTED = {
    "bool_type": "true or false",
    "finite_number": "a finite number",
    "float_type": "a number",
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "{ge:g} or more",
    "int_type": "a whole number",
    "less_than": "a number below {lt:g}",
    "less_than_equal": "{le:g} or less",
    "list_type": "a list",
    "literal_error": "{expected}",
    "string_pattern_mismatch": "text such as {example}",
    "string_too_short": "at least {min_length} characters",
    "string_type": "text",
    "dict_type": "a mapping of names to values",
    "model_type": "a mapping of names to values",
    "too_long": "{max_length} entries",
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
        raise BadInput(_plain(kind, error.errors()[0])) from None


def shown(value: object) -> str:
    """A value as given, cut short."""
    short = reprlib.Repr()
    short.maxstring = 60
    try:
        return short.repr(value)
    except ValueError:  # a whole number of thousands of digits
        return "a huge number"


def _plain(kind: type[Strict], first: Mapping[str, Any]) -> str:
    """Pydantic's faults as our error."""
    place = [str(part) for part in first["loc"] if part not in ("float", "str")]
    key, error = ".".join(place) or f"a {kind.__name__.lower()}", first["type"]
    if error == "value_error":
        return f"{key}: {first['ctx']['error']}"
    if error == "missing":
        return f"{key} is missing"
    if error == "extra_forbidden":
        inside = f" of {'.'.join(place[:-1])}" if len(place) > 1 else ""
        return str(UnknownName(f"key{inside}", place[-1], _record_at(kind, first["loc"][:-1]).model_fields))
    limits = dict(first.get("ctx", {})) | {"example": _example(kind, first["loc"])}
    expected = _EXPECTED[error].format(**limits) if error in _EXPECTED else str(first["msg"]).lower()
    return f"{key} is {shown(first['input'])}; expected {expected}"


def _record_at(kind: type[Strict], place: tuple[Any, ...]) -> type[Strict]:
    """The record at a place within a record."""
    for part in place:
        field = kind.model_fields.get(part) if isinstance(part, str) else None
        kind = next(_records(field.annotation), kind) if field else kind
    return kind


def _records(annotation: Any) -> Iterator[type[Strict]]:
    """Records that a type contains, as ``Waiver`` in ``tuple[Waiver, ...]``."""
    if isinstance(annotation, type) and issubclass(annotation, Strict):
        yield annotation
    for part in get_args(annotation):
        yield from _records(part)


def _example(kind: type[Strict], place: tuple[Any, ...]) -> str:
    """An example of the field at a place, as the field itself has it."""
    field = _record_at(kind, place[:-1]).model_fields.get(str(place[-1])) if place else None
    return " or ".join(map(str, field.examples)) if field and field.examples else "others of its kind"
