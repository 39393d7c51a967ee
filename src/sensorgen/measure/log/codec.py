"""Fields of the log's rows as SQLite, CSV and Parquet hold them, each way exact."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Codec:
    """How one type of field is held.

    Attributes
    ----------
    sql : callable
        The value for SQLite; ``from_sql`` is its inverse and raises TypeError or ValueError for anything else.
    text : callable
        The value as a cell of a table; ``from_text`` is its inverse, likewise.
    """

    sql: Callable[[Any], Any]
    from_sql: Callable[[Any], Any]
    text: Callable[[Any], str]
    from_text: Callable[[str], Any]


def _exactly(kind: type) -> Callable[[Any], Any]:
    def check(value: Any) -> Any:
        if type(value) is not kind:
            raise TypeError(f"{value!r:.60} is no {kind.__name__}")
        return value

    return check


def _finite(value: Any) -> float:
    if not math.isfinite(_exactly(float)(value)):
        raise ValueError(f"{value!r} is not finite")
    return float(value)


def _optional(work: Callable[[Any], Any], nothing: Any) -> Callable[[Any], Any]:
    """The same, with None for what stands for it."""
    return lambda value: None if value == nothing else work(value)


def _text_or(nothing: str, work: Callable[[Any], str]) -> Callable[[Any], str]:
    return lambda value: nothing if value is None else work(value)


def _truth(value: Any) -> bool:
    return {0: False, 1: True}[_exactly(int)(value)]


def _truth_text(text: str) -> bool:
    if text not in ("true", "false"):
        raise ValueError(f"{text!r:.60} is neither true nor false")
    return text == "true"


def _numbers_text(numbers: tuple[float, ...]) -> str:
    """Numbers as JSON, which has no infinity: SQLite and Python read 9e999 as one."""
    return "[" + ", ".join(repr(number).replace("inf", "9e999") for number in numbers) + "]"


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(_exactly(float)(float(number)) for number in _list(text, (int, float)))


def _words_text(words: tuple[str, ...]) -> str:
    return json.dumps(list(words), ensure_ascii=False)


def _words(text: str) -> tuple[str, ...]:
    return tuple(_list(text, (str,)))


def _list(text: str, kinds: tuple[type, ...]) -> list[Any]:
    found = json.loads(_exactly(str)(text))
    if type(found) is not list or not all(type(item) in kinds and item == item for item in found):
        raise ValueError(f"{text!r:.60} is no list of {kinds[-1].__name__}")
    return found


def _same(value: Any) -> Any:
    return value


CODECS = {  # by annotation
    str: Codec(_exactly(str), _exactly(str), _same, _exactly(str)),
    int: Codec(_exactly(int), _exactly(int), str, int),
    int | None: Codec(_same, _optional(_exactly(int), None), _text_or("", str), _optional(int, "")),
    float | None: Codec(
        _same, _optional(_finite, None), _text_or("", repr), _optional(lambda text: _finite(float(text)), "")
    ),
    bool | None: Codec(
        _same, _optional(_truth, None), _text_or("", lambda value: str(value).lower()), _optional(_truth_text, "")
    ),
    tuple[float, ...]: Codec(_numbers_text, _numbers, _numbers_text, _numbers),
    tuple[str, ...]: Codec(_words_text, _words, _words_text, _words),
}
