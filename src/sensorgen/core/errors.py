"""What went wrong, in words that tell the user what to do."""

import difflib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Self


class SensorgenError(Exception):
    """Anything a user can put right; the command line shows it as one line and exits with 2."""

    def within(self, where: str) -> Self:
        """The same error, its message led by the file or key that it is about."""
        if where:
            self.args = (f"{where}: {self}",)
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


class UnknownName(SensorgenError):
    """A name that nothing goes by."""

    def __init__(self, kind: str, given: str, known: Iterable[str]) -> None:
        """Name the nearest of ``known`` to ``given``, and list them all."""
        names = sorted(known)
        near = difflib.get_close_matches(given[:100].lower(), names, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else "."
        super().__init__(f"unknown {kind} {given[:100]!r}{hint} Known: {', '.join(names)}")


class BadInput(SensorgenError):
    """A file or a word on the command line that cannot be read as what it should be."""


class MissingValue(SensorgenError):
    """A value that no source gives."""


class NotInstalled(MissingValue):
    """A library that an extra of sensorgen brings; the message says how."""


class Unprintable(SensorgenError):
    """A design whose checks found errors: ``findings`` holds all that they found, the ``stopping`` ones first."""

    def __init__(self, findings: Sequence[Any], stopping: Sequence[Any]) -> None:
        """Take the findings (see :class:`sensorgen.core.findings.Finding`), and those for which nothing is written."""
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
