"""Statuses of estimates: one word per sample, the worst that applies, their counts, and rows of a CSV file."""

from collections import Counter
from collections.abc import Iterable, Sequence
from enum import IntEnum
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Real


class Worded(IntEnum):
    """Statuses that rise from best to worst, each with its words."""

    words: str
    """As files and people read it."""

    def __new__(cls, number: int, words: str) -> Self:
        """Number of a status, with its words."""
        status = int.__new__(cls, number)
        status._value_, status.words = number, words
        return status

    @classmethod
    def worst(cls, count: int, rules: Iterable[tuple[Self, Any]]) -> NDArray[np.uint8]:
        """Statuses of samples by rules, later ones first."""
        statuses = np.zeros(count, np.uint8)
        for status, applies in rules:
            statuses[applies] = status
        return statuses


class Counts:
    """Counts of statuses, block by block."""

    def __init__(self, kind: type[Worded]) -> None:
        self._kind, self._counts = kind, Counter[int]()

    def add(self, statuses: NDArray[np.uint8]) -> None:
        """Count a block."""
        self._counts.update(statuses.tolist())

    @property
    def samples(self) -> int:
        """Number of samples so far."""
        return self._counts.total()

    def by_words(self) -> dict[str, int]:
        """Samples of each status that occurs."""
        return {one.words: self._counts[one] for one in self._kind if self._counts[one]}

    def most(self, *statuses: Worded) -> bool:
        """True if more than half of the samples have one of these."""
        return sum(self._counts[one] for one in statuses) > self.samples / 2


def header(given: Sequence[str], columns: Sequence[str]) -> str:
    r"""Names of the columns, those of the input before; one that has the name of a result is ``..._given``.

    >>> header(["time_s", "force_n"], ["force_n", "position_mm"])
    'time_s,force_n_given,force_n,position_mm\n'
    """
    return _row([*(_cell(f"{name}_given" if name in columns else name) for name in given), *columns])


def rows(given: Sequence[Sequence[str]], numbers: Real, tones: NDArray[np.intp], words: NDArray[Any]) -> str:
    """Rows of a CSV file: the input's other cells, numbers (n, k) that are blank where there are none, and statuses."""
    ends = zip(given, numbers.tolist(), tones.tolist(), words.tolist(), strict=True)
    return "".join(_row([*map(_cell, own), *map(_number, row), str(n), word]) for own, row, n, word in ends)


def _number(value: float) -> str:
    return f"{value:.9g}" if abs(value) < np.inf else ""


def _cell(text: str) -> str:
    """A cell as CSV; quoted where it would come apart."""
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\r\n') else text


def _row(cells: Sequence[str]) -> str:
    return ",".join(cells) + "\n"
