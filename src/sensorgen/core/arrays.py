"""Types of arrays, records of columns, and numbers as JSON has them."""

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Whole = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ColumnRecord:
    """A record of arrays that are as long as each other, perhaps with other fields."""

    def of(self, rows: Mask | Whole | slice) -> Self:
        """Some of the rows."""
        values = ((field.name, getattr(self, field.name)) for field in fields(self))
        return replace(self, **{name: value[rows] for name, value in values if isinstance(value, np.ndarray)})


def parts_of(count: Whole) -> tuple[Whole, Whole]:
    """Of each part of some things, cut to so many: the thing, and the part's number in it.

    >>> [numbers.tolist() for numbers in parts_of(np.array([2, 0, 3]))]
    [[0, 0, 2, 2, 2], [0, 1, 0, 1, 2]]
    """
    which = np.repeat(np.arange(len(count)), count)
    return which, np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)


def finite(values: ArrayLike) -> Any:
    """A number or lists of numbers, None where one is not finite.

    >>> finite([[1.0, np.nan], [np.inf, 2.0]]), finite(np.float64(3.0))
    ([[1.0, None], [None, 2.0]], 3.0)
    """
    return np.where(np.isfinite(values), values, np.array(None)).tolist()
