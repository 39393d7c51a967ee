"""Plain data from a file, validated against a record type; faults become our errors."""

import json
import reprlib
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from sensorgen.core.errors import BadInput, UnknownName

# By pydantic's name of a fault, what was expected
_EXPECTED: dict[str, str] = json.loads(Path(__file__).with_name("expected.json").read_text("utf-8"))
_OTHERS = "another kind of value"  # that no file of ours can have


Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Line = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]*$", examples=["one line without control characters"])]


class Strict(BaseModel):
    """A record: unknown keys are refused, true is not 1, and "5" is no number."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def stated(default: Any, about: str, **more: Any) -> Any:
    """Field of a record with a default and a description."""
    return Field(default=default, description=about, **more)


_Record = TypeVar("_Record", bound=Strict)


def checked(kind: type[_Record], data: object) -> _Record:
    """Make a record of plain data.

    Raises
    ------
    BadInput
        The first thing that is wrong: which key, what it is, and what was expected.
    """
    plain = dict(data) if isinstance(data, Mapping) else data
    try:
        return kind.model_validate(plain)
    except ValidationError as error:
        raise BadInput(problem(error, plain, kind)) from None


def shown(value: object) -> str:
    """A value as given, cut short."""
    short = reprlib.Repr()
    short.maxstring = 60
    try:
        return short.repr(value)
    except ValueError:  # a whole number of thousands of digits
        return "a huge number"


def problem(error: ValidationError, data: object, kind: type[Strict] | None = None) -> str:
    """The first fault that pydantic sees: which key, what it is, and what was expected.

    Parameters
    ----------
    error : ValidationError
        Of validating ``data``.
    data : object
        Plain data.
    kind : type, optional
        The record, for near names of keys and for examples.
    """
    first, expected = _first(error.errors(), data)
    place = _place(first, data)
    key = ".".join(map(str, place)) or (f"a {kind.__name__.lower()}" if kind else "all of it")
    if first["type"] in ("value_error", "assertion_error"):
        return f"{key}: {first['ctx']['error']}" if place else str(first["ctx"]["error"])
    if first["type"] in ("missing", "missing_argument", "missing_keyword_only_argument"):
        return f"{key} is missing"
    if first["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        inside = f" of {'.'.join(map(str, place[:-1]))}" if len(place) > 1 else ""
        if kind is None:
            return f"unknown key{inside} {str(place[-1])[:100]!r}"
        return str(UnknownName(f"key{inside}", str(place[-1]), _keys(_record_at(kind, first["loc"][:-1]))))
    words = ", or ".join(dict.fromkeys(_expected(each, kind) for each in expected))
    return f"{key} is {shown(first['input'])}; expected {words}"


def _place(fault: Mapping[str, Any], data: object) -> list[str | int]:
    """Keys and positions that lead to a fault, without pydantic's names of types."""
    place: list[str | int] = []
    for part in fault["loc"]:
        known = range(len(data)) if isinstance(data, list | tuple) else data if isinstance(data, Mapping) else ()
        if part in known:
            data = data[part]  # type: ignore[index]
        elif part != fault["loc"][-1] or fault["type"] not in ("missing", "missing_argument"):
            continue
        place.append(part)
    return place


def _first(faults: Sequence[Mapping[str, Any]], data: object) -> tuple[Mapping[str, Any], list[Mapping[str, Any]]]:
    """The first fault, and all of its value: of the alternatives for one value, those of the one that fits farthest."""
    first = _unknown_key([f for f in faults if f["loc"][:-1] == faults[0]["loc"][:-1]])  # before a key that is missing
    alike = [fault for fault in faults if _branches(fault, first, data)]
    places = [_place(fault, data) for fault in alike]
    deepest = max(map(len, places))
    best = _unknown_key([fault for fault, place in zip(alike, places, strict=True) if len(place) == deepest])
    return best, [fault for fault, place in zip(alike, places, strict=True) if place == _place(best, data)]


def _unknown_key(faults: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The first fault of a key that is unknown, else the first of all."""
    return next((fault for fault in faults if fault["type"] == "extra_forbidden"), faults[0])


def _branches(fault: Mapping[str, Any], first: Mapping[str, Any], data: object) -> bool:
    """Test whether two faults are of alternatives for one value: their ways part at the name of a type."""
    if fault is first:
        return True
    pairs = enumerate(zip_longest(fault["loc"], first["loc"]))
    same = next((k for k, (one, other) in pairs if one != other), len(fault["loc"]))
    parted = [_place({"loc": each["loc"][: same + 1], "type": ""}, data) for each in (fault, first)]
    return all(place == _place({"loc": fault["loc"][:same], "type": ""}, data) for place in parted)


def _expected(fault: Mapping[str, Any], kind: type[Strict] | None) -> str:
    """Expectation behind one fault."""
    example = _example(kind, fault["loc"]) if kind else "others of its kind"
    if fault["type"] == "model_type" and kind:
        return f"a mapping with {', '.join(_keys(_record_at(kind, fault['loc'])))}"
    if fault["type"] == "too_short" and fault["ctx"]["min_length"] == 1:
        return "at least one entry"
    return _EXPECTED.get(fault["type"], _OTHERS).format(**dict(fault.get("ctx", {})) | {"example": example})


def _keys(kind: type[Strict]) -> list[str]:
    """Names of a record's keys, as a file has them."""
    return [field.alias or name for name, field in kind.model_fields.items()]


def _record_at(kind: type[Strict], place: tuple[Any, ...]) -> type[Strict]:
    """The record at a place within a record; pydantic names the alternative where there are several."""
    alternatives: dict[str, type[Strict]] = {}
    for part in place:
        field = kind.model_fields.get(part) if isinstance(part, str) else None
        if field:
            alternatives = {each.__name__: each for each in _records(field.annotation)}
            kind = next(iter(alternatives.values()), kind)
        else:
            kind = alternatives.get(part, kind)
    return kind


def _records(annotation: Any) -> Iterator[type[Strict]]:
    """Records that a type contains, as ``Waiver`` in ``tuple[Waiver, ...]``."""
    if isinstance(annotation, type) and issubclass(annotation, Strict):
        yield annotation
    for part in get_args(annotation):
        yield from _records(part)


def _example(kind: type[Strict], place: tuple[Any, ...]) -> str:
    """An example of the field at a place, as the field itself has it."""
    place = tuple(part for part in place if isinstance(part, str))  # without positions in lists
    field = _record_at(kind, place[:-1]).model_fields.get(place[-1]) if place else None
    return " or ".join(map(str, field.examples)) if field and field.examples else "others of its kind"


@cache
def adapter(kind: type) -> TypeAdapter[Any]:
    """Reader and writer of a dataclass as JSON."""
    return TypeAdapter(kind)
