"""Sequences whose members are made when they are used, pairs grouped by key; and what the files of a folder define."""

import importlib
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Generic, TypeVar, overload

from sensorgen.core.errors import UnknownName

Member = TypeVar("Member")
Other = TypeVar("Other")
Key = TypeVar("Key")


def by_key(pairs: Iterable[tuple[Key, Member]]) -> dict[Key, list[Member]]:
    """Second members of pairs by their first, both in the order in which they come.

    >>> by_key([("a", 1), ("b", 2), ("a", 3)])
    {'a': [1, 3], 'b': [2]}
    """
    groups: dict[Key, list[Member]] = {}
    for key, member in pairs:
        groups.setdefault(key, []).append(member)
    return groups


class Lazy(Sequence[Member], Generic[Member]):
    """A sequence of members that are made anew each time they are read.

    Parameters
    ----------
    make : callable
        From a place to its member.
    places : sequence of int
        Places, in the order of the sequence.

    Examples
    --------
    >>> squares = Lazy(lambda k: k * k, range(1000000))
    >>> squares[-1], list(squares[:4]), list(squares.where(lambda n: n < 5))
    (999998000001, [0, 1, 4, 9], [0, 1, 4])
    """

    def __init__(self, make: Callable[[int], Member], places: Sequence[int]) -> None:
        self._make, self._places = make, places

    def __len__(self) -> int:
        return len(self._places)

    @overload
    def __getitem__(self, at: int) -> Member: ...
    @overload
    def __getitem__(self, at: slice) -> "Lazy[Member]": ...
    def __getitem__(self, at: int | slice) -> "Member | Lazy[Member]":
        if isinstance(at, slice):
            return Lazy(self._make, self._places[at])
        return self._make(self._places[at])

    def __iter__(self) -> Iterator[Member]:
        return map(self._make, self._places)

    def map(self, change: "Callable[[Member], Other]") -> "Lazy[Other]":
        """Members after a change."""
        return Lazy(lambda place: change(self._make(place)), self._places)

    def where(self, wanted: Callable[[Member], bool]) -> "Lazy[Member]":
        """The members of which something holds."""
        return Lazy(self._make, array("q", [place for place in self._places if wanted(self._make(place))]))

    def at(self, which: Iterable[int]) -> "Lazy[Member]":
        """Some members, in that order."""
        return Lazy(self._make, array("q", (self._places[k] for k in which)))


@cache
def names(package: ModuleType) -> list[str]:
    """Names of the modules in a package, without loading any."""
    return sorted(p.stem for p in Path(next(iter(package.__path__))).glob("[!_]*.py"))


@cache
def stating(package: ModuleType, start: str) -> tuple[str, ...]:
    """Names of the modules that have a line which starts with a text, as ``def f(``, without loading any."""
    folder = Path(next(iter(package.__path__)))
    texts = ((name, (folder / f"{name}.py").read_text("utf-8")) for name in names(package))
    return tuple(name for name, text in texts if f"\n{start}" in text)


def load(package: ModuleType, name: str) -> ModuleType:
    """Load one module of a package by its name.

    Raises
    ------
    UnknownName
        Nothing goes by that name; the nearest one is offered.
    """
    if name not in names(package):
        raise UnknownName(package.__name__.rpartition(".")[2].removesuffix("s"), name, names(package))
    return importlib.import_module(f"{package.__name__}.{name}")
