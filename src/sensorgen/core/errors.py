"""Errors, in words that tell the user what to do."""

import difflib
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any, Self


class SensorgenError(Exception):
    """Anything a user can put right; the command line shows it as one line and exits with 2."""

    def within(self, where: str) -> Self:
        """Lead the message by the file or key that it is about, unless it names that already."""
        message = str(self)
        if where and not (message.startswith((f"{where}:", f"{where},")) or f" {where!r}: " in message):
            self.args = (f"{where}: {message}",)
        return self


@contextmanager
def within(where: str) -> Iterator[None]:
    """Lead the message of an error that is raised inside by the file or key that it is about.

    >>> with within("design.yaml"):
    ...     raise SensorgenError("no such shape")
    Traceback (most recent call last):
    sensorgen.core.errors.SensorgenError: design.yaml: no such shape
    """
    try:
        yield
    except SensorgenError as error:
        raise error.within(where) from None


class OutOfRange(SensorgenError):
    """A number outside the range in which it means something."""


def nearest(given: str, names: Iterable[str]) -> str:
    """The name that somebody may have meant, or "".

    Of names of several words each word must be near: ``layer_height`` is another quantity than ``lower_height``.

    >>> nearest("layer-height", ["lower-height"]), nearest("lower-heigth", ["lower-height"]), nearest("trj", ["tri"])
    ('', 'lower-height', 'tri')
    """

    def words(name: str) -> list[str]:
        return re.findall("[a-z]+", name.lower())

    for near in difflib.get_close_matches(given.lower(), list(names), n=3):
        pairs = list(zip(words(given), words(near), strict=False))
        several = len(words(given)) == len(words(near)) > 1
        if not several or all(difflib.SequenceMatcher(None, *pair).ratio() > _NEAR for pair in pairs):
            return near
    return ""


_NEAR = 0.62  # of two words, from which one may be a slip of the other


class UnknownName(SensorgenError):
    """A name that nothing goes by."""

    def __init__(self, kind: str, given: str, known: Iterable[str]) -> None:
        """Name the nearest of ``known`` to ``given``, and list them all."""
        names = sorted(known)
        hint = f"; did you mean '{near}'?" if (near := nearest(given[:100], names)) else "."
        super().__init__(f"unknown {kind} {given[:100]!r}{hint} Known: {', '.join(names)}")


class BadInput(SensorgenError):
    """A file or a word on the command line that cannot be read as what it should be."""


class NotTrusted(BadInput):
    """A shape's file whose content the user has not trusted."""


class MissingValue(SensorgenError):
    """A value that no source gives."""


class NotInstalled(MissingValue):
    """A library that an extra of sensorgen brings; the message says how."""


def library(name: str, advice: str) -> Any:
    """Import a library that not everybody has installed; NotInstalled with the advice where it is missing."""
    try:
        return import_module(name)
    except ImportError:
        raise NotInstalled(advice) from None


class Unprintable(SensorgenError):
    """A design whose checks found errors: ``findings`` holds all that they found, the ``stopping`` ones first."""

    def __init__(self, findings: Sequence[Any], stopping: Sequence[Any], source: str = "") -> None:
        """Take findings (:class:`sensorgen.core.findings.Finding`), those that stop, and the print that all are of."""
        self.source = source
        self.stopping = list(stopping)
        self.findings = [*self.stopping, *(f for f in findings if f not in self.stopping)]
        first = self.stopping[0]
        super().__init__(f"{first.rule}, {first.message}; nothing was written (--force writes the files anyway)")


class Unwritable(SensorgenError):
    """A result that could not be put on disk."""


class CadFailed(SensorgenError):
    """The CAD kernel could not make a solid."""


class SlicerFailed(SensorgenError):
    """A slicer is missing, or could not slice; the message carries its own words."""


class InstrumentFailed(SensorgenError):
    """An instrument that is not there, is another one, or does not answer as it should."""
