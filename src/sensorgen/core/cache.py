"""Answers that were worked out before, on disk: a question of plain data, and what it was answered with.

An entry is a file of its own, named by the SHA-256 of the question and of the source code of the models, so that
a new version of either asks anew. Deleting the folder costs time only.
"""

import json
from collections.abc import Callable, Iterator, Mapping, MutableSequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

from sensorgen.core import files as store
from sensorgen.core.errors import Unwritable
from sensorgen.core.version import __version__

PLACE = "SENSORGEN_CACHE"  # environment variable with another folder
_SOURCES = (  # what decides an answer
    "asprinted", "checks", "design", "export", "models", "prediction", "scene", "solvers", "core/bounds.py",
    "core/findings.py", "core/units.py",
)  # fmt: skip

JSON = Any  # None, bool, int, float, str, and lists and string-keyed dicts of these
Record = TypeVar("Record")

_HELD_BACK: ContextVar[MutableSequence[tuple[Mapping[str, JSON], JSON]] | None] = ContextVar("_HELD_BACK", default=None)
_ONLY_KNOWN: ContextVar[bool] = ContextVar("_ONLY_KNOWN", default=False)


class Unknown(BaseException):
    """Nothing is known of a question, and nothing may be worked out: no error, so that it passes who catches those."""


def answer(question: Mapping[str, JSON], work: Callable[[], JSON]) -> JSON:
    """The answer that a question got before, or else what ``work`` gives, kept for the next time.

    Parameters
    ----------
    question : mapping
        Everything that decides the answer besides sensorgen itself, as plain data of finite numbers.
    work : callable
        Gives the answer as plain data; what it raises is passed on, and nothing is kept.

    Raises
    ------
    ValueError
        The question holds a number that is not finite.

    Notes
    -----
    Where the folder cannot be written to, nothing is kept and nothing said: the answer is as good.
    """
    result = known(question)
    if result is None:
        if _ONLY_KNOWN.get():
            raise Unknown
        result = work()
        keep(question, result)
    return result


def record(question: Mapping[str, JSON], kind: type[Record], work: Callable[[], Record]) -> Record:
    """The answer to a question as a record: a dataclass, kept as JSON; as of :func:`answer`."""
    from sensorgen.core.records import adapter

    form = adapter(kind)  # type: ignore[arg-type]
    known: Record = form.validate_json(answer(question, lambda: form.dump_json(work()).decode()))
    return known


@contextmanager
def _changed(variable: ContextVar[Any], value: Any) -> Iterator[Any]:
    """Another value of a variable within, which is given."""
    before = variable.set(value)
    try:
        yield value
    finally:
        variable.reset(before)


def only_known() -> AbstractContextManager[Any]:
    """Within it :func:`answer` works nothing out: it raises Unknown instead."""
    return _changed(_ONLY_KNOWN, True)


def held_back() -> AbstractContextManager[list[tuple[Mapping[str, JSON], JSON]]]:
    """Questions and answers that would be kept, for another process to keep: one that may be ended writes nothing."""
    return _changed(_HELD_BACK, [])


def known(question: Mapping[str, JSON]) -> JSON | None:
    """The answer that a question got before, or None; an entry that is damaged counts as none."""
    for one, answer in _HELD_BACK.get() or ():
        if one == question:
            return answer
    try:
        entry = json.loads(_file(question).read_text("utf-8"))
        sound = entry["question"] == json.loads(_text(question)) and entry["sha256"] == _digest(entry["answer"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return entry["answer"] if sound else None


def keep(question: Mapping[str, JSON], answer: JSON) -> None:
    """Store the answer to a question, in place of what was there."""
    entries = _HELD_BACK.get()
    if entries is not None:
        entries.append((question, answer))
        return
    file = _file(question)
    entry = {"question": question, "answer": answer, "sha256": _digest(answer)}
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        store.replace(file, json.dumps(entry).encode())
    except (OSError, Unwritable):
        return


def folder() -> Path:
    """Where entries are: the system's place for caches, or what SENSORGEN_CACHE says."""
    return store.cache(PLACE)


def _file(question: Mapping[str, JSON]) -> Path:
    key = _digest([_version(), question])
    return folder() / key[:2] / f"{key}.json"


def _digest(data: JSON) -> str:
    return sha256(_text(data).encode()).hexdigest()


def _text(data: JSON) -> str:
    """Plain data as one canonical text."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)


@cache
def _version() -> str:
    """Hash of the source code that decides an answer, and the version of sensorgen."""
    places = [Path(__file__).parents[1] / name for name in _SOURCES]
    files = (f for place in places for f in ([place] if place.is_file() else place.rglob("*")))
    code = sorted(f for f in files if f.suffix in (".py", ".yaml"))
    return sha256(b"".join([__version__.encode(), *(f.read_bytes() for f in code)])).hexdigest()
