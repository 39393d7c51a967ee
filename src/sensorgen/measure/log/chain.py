"""Records of the log: each named by the hash of its content and of its predecessors, so that none changes unseen.

The identity of a record is the SHA-256 of its head line and its content in UTF-8::

    PARENTS KIND VERSION LOGGED_AT
    CONTENT

``PARENTS`` are identities with commas between them: none for the first record of a log, one as a rule, several where
logs of several machines were merged. ``CONTENT`` is a JSON object. A record can therefore only have been written after
all records that its chain of parents leads to, whatever any clock says.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from hashlib import sha256

_WORD = re.compile(r"[^\s]+")
_HASH = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class Record:
    """A record as it is stored and passed on.

    Attributes
    ----------
    id : str
        SHA-256 of the rest, see :func:`identity`.
    parents : tuple of str
        Identities of the records before it.
    kind : str
        Kind of the content.
    version : int
        Of the kind's schema.
    logged_at : str
        Time of logging by the clock of that machine, UTC, ISO 8601.
    content : str
        JSON object.
    """

    id: str
    parents: tuple[str, ...]
    kind: str
    version: int
    logged_at: str
    content: str


def identity(parents: Sequence[str], kind: str, version: int, logged_at: str, content: str) -> str:
    """Identity of a record.

    >>> identity((), "reading", 1, "2026-01-01T00:00:00.000+00:00", "{}")[:16]
    '8910045b51efe426'
    """
    return sha256(f"{','.join(parents)} {kind} {version} {logged_at}\n{content}".encode()).hexdigest()


def made(parents: Sequence[str], kind: str, version: int, logged_at: str, content: str) -> Record:
    """A new record."""
    return Record(
        identity(parents, kind, version, logged_at, content), tuple(parents), kind, version, logged_at, content
    )


def sound(record: Record) -> bool:
    """Test whether a record is what its identity says."""
    return (
        _WORD.fullmatch(record.kind) is not None
        and _WORD.fullmatch(record.logged_at) is not None
        and all(map(_HASH.fullmatch, record.parents))
        and record.id == identity(record.parents, record.kind, record.version, record.logged_at, record.content)
    )


@dataclass
class _Line:
    """Records that follow each other, and how far it knows other lines to have come, by their number."""

    last: int = -1
    known: list[tuple[int, dict[int, int]]] = field(default_factory=list)  # from this record on

    def seen(self, number: int) -> dict[int, int]:
        """Last record of each other line before a record of this one."""
        return next((seen for start, seen in reversed(self.known) if start <= number), {})

    def append(self, seen: dict[int, int]) -> None:
        """Add a record that comes after these of other lines."""
        self.last += 1
        if not self.known or seen != self.known[-1][1]:
            self.known.append((self.last, seen))


class Ancestry:
    """Order of the records of a log in which several machines wrote.

    Each record is a place on a line, which goes on until another record follows the same one; where lines are merged,
    the new record knows how far each line had come.

    Parameters
    ----------
    records : iterable of (str, tuple of str)
        Identity and parents, in an order in which each stands after its parents.
    """

    def __init__(self, records: Iterable[tuple[str, tuple[str, ...]]]) -> None:
        self._place: dict[str, tuple[int, int]] = {}  # line, and number on it
        self._lines: list[_Line] = []
        for key, parents in records:
            self._append(key, parents)

    def _append(self, key: str, parents: tuple[str, ...]) -> None:
        places = [self._place[parent] for parent in parents]
        line = next((line for line, number in places if self._lines[line].last == number), len(self._lines))
        if line == len(self._lines):
            self._lines.append(_Line())
        own = self._lines[line]
        seen = dict(own.seen(own.last))
        for other, number in places:
            for each, reached in ((other, number), *self._lines[other].seen(number).items()):
                if each != line:
                    seen[each] = max(reached, seen.get(each, -1))
        own.append(seen)
        self._place[key] = line, own.last

    def before(self, first: str, second: str) -> bool:
        """Test whether the chain of the second record leads to the first."""
        (line, number), (other, at) = self._place[first], self._place[second]
        return number < at if line == other else self._lines[other].seen(at).get(line, -1) >= number
