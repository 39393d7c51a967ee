"""Statuses of estimates: one word per sample, the worst that applies, their counts, and rows of a CSV file."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from statistics import median
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray

from sensorgen.core.arrays import Mask, Real
from sensorgen.core.display import Displayed
from sensorgen.core.document import Column, Part, Table, csv_row
from sensorgen.core.units import M_PER_MM
from sensorgen.prediction.inference import LocalFit, Samples


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

    @classmethod
    def in_words(cls, numbers: NDArray[np.uint8]) -> list[str]:
        """Words of statuses."""
        members = list(cls)
        return [members[number].words for number in numbers.tolist()]


class Tally:
    """Counts of statuses, and medians of numbers; of the numbers, each block's median is kept.

    Parameters
    ----------
    kind : type
        Of the statuses.
    columns : sequence of str
        Of the rows.
    """

    def __init__(self, kind: type[Worded], columns: Sequence[str]) -> None:
        self._kind, self._columns, self._counts = kind, columns, Counter[int]()
        self._medians = defaultdict[str, list[float]](list)

    def header(self, given: Sequence[str]) -> str:
        """Names of the columns, those of the input before; one that has the name of a result is ``..._given``."""
        return csv_row([*(f"{name}_given" if name in self._columns else name for name in given), *self._columns])

    def count(self, statuses: NDArray[np.uint8], **numbers: Real) -> None:
        """Count a block."""
        self._counts.update(statuses.tolist())
        for name, values in numbers.items():
            if len(values):
                self._medians[name].append(float(np.median(values)))

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

    def median(self, name: str) -> float | None:
        """Median of a number, None where there is none or it is infinite."""
        middle = median(self._medians[name] or [np.inf])
        return middle if middle < np.inf else None


def rows(given: Sequence[Sequence[str]], numbers: Real, tones: NDArray[np.intp], words: NDArray[Any]) -> str:
    """Rows of a CSV file: the input's other cells, numbers (n, k) that are blank where there are none, and statuses."""
    cells = ((f"{value:.9g}" if abs(value) < np.inf else "" for value in row) for row in numbers.tolist())
    ends = zip(given, cells, map(str, tones.tolist()), words.tolist(), strict=True)
    return "".join(csv_row([*own, *row, *last]) for own, row, *last in ends)


@dataclass(frozen=True)
class PressRow:
    """Press behind a reading, with 90 % intervals; nan where nothing was found."""

    force_n: Annotated[float, Column("force", "N")]
    force_low_n: Annotated[float, Column("force from", "N")]
    force_high_n: Annotated[float, Column("force to", "N")]
    position_mm: Annotated[float, Column("position", "mm")]
    position_low_mm: Annotated[float, Column("position from", "mm")]
    position_high_mm: Annotated[float, Column("position to", "mm")]
    status: Annotated[str, Column("status")]


class PressAnswers(Samples, Displayed):
    """Presses behind readings: force and position with the ends of their intervals, and a status."""

    if TYPE_CHECKING:
        force_n: Real
        position_m: Real
        force_90_n: Real
        position_90_m: Real

    def statuses(self) -> list[str]:
        """Status of each reading, in words."""
        raise NotImplementedError

    def document(self) -> Iterator[Part]:
        """A row for each reading."""
        force, place = [self.force_n, *self.force_90_n.T], [self.position_m, *self.position_90_m.T]
        columns = [*force, *(metres / M_PER_MM for metres in place)]
        rows = [PressRow(*row) for row in zip(*(column.tolist() for column in columns), self.statuses(), strict=True)]
        yield from Table.some("presses", "", rows)


PAIR = 9.21  # 99 % of chi-squared with two degrees of freedom: force and position
_TAIL = 3.719  # normal deviate of 1e-4
_ROUNDING = np.finfo(float).eps
_EDGE = 1e-9  # of the square


class Status(Worded):
    """The verdict on a sample, the worst that applies."""

    OK = 0, "ok"
    AMBIGUOUS = 1, "two presses"
    """Another press fits the reading as well."""
    AT_THE_END = 2, "at the end"
    """The best press lies on the border: no force, the force limit, or an end of the sensor."""
    FORCE_ONLY = 3, "force only"
    """Less information on position than a uniform prior."""
    NOT_IDENTIFIABLE = 4, "not identifiable"
    """Less information on force than a uniform prior, too."""
    NO_FIT = 5, "no fit"
    """No press fits: the residual is far above the noise."""
    MISSING = 6, "missing"
    """Nothing was measured."""


def covariance(fisher: Real) -> Real:
    """Inverse of the information (n, 2, 2); infinite variances where it is singular."""
    (ff, fx), (_, xx) = fisher.transpose(1, 2, 0)
    determinant = ff * xx - fx * fx
    singular = determinant <= _ROUNDING * ff * xx
    inverse = np.empty_like(fisher)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse[:, 0, 0], inverse[:, 1, 1] = xx / determinant, ff / determinant
        inverse[:, 0, 1] = inverse[:, 1, 0] = -fx / determinant
        inverse[singular] = np.array([[0.0, 0.0], [0.0, np.inf]])
        inverse[singular, 0, 0] = np.where(ff > 0, 1 / ff, np.inf)[singular]
    return inverse


def statuses(fit: LocalFit, variance: Real, tones: NDArray[np.intp], ambiguous: Mask) -> NDArray[np.uint8]:
    """Verdicts on least-squares estimates.

    Parameters
    ----------
    fit : LocalFit
        The estimates, scaled.
    variance : (n, 2) array
        Of scaled force and position, from the data alone.
    tones : (n,) array
        How many were measured.
    ambiguous : (n,) array
        Where another press explains the reading as well.
    """
    lost = variance > 1 / 12  # a uniform guess on the unit length has this variance
    rules = (
        (Status.AMBIGUOUS, ambiguous),
        (Status.AT_THE_END, ((fit.at < _EDGE) | (fit.at > 1 - _EDGE)).any(1)),
        (Status.FORCE_ONLY, lost[:, 1]),
        (Status.NOT_IDENTIFIABLE, lost[:, 0]),
        (Status.NO_FIT, fit.chi2 > chi2_limit(2 * tones - 2)),
        (Status.MISSING, tones == 0),
    )
    return Status.worst(len(tones), rules)


def chi2_limit(degrees: NDArray[np.intp]) -> Real:
    """Sum of squares that noise exceeds once in ten thousand samples (Wilson and Hilferty 1931); none for 0 degrees.

    >>> chi2_limit(np.array([12])).round(1).tolist()
    [39.5]
    """
    ninth = 2 / (9 * np.maximum(degrees, 1))
    return np.where(degrees > 0, degrees * (1 - ninth + _TAIL * np.sqrt(ninth)) ** 3, np.inf)
