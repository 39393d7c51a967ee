"""Tables of a report: rows are frozen dataclasses whose fields are annotated with the ``Column`` that they fill."""

from dataclasses import dataclass, fields
from math import isfinite, isinf, isnan
from typing import Any, get_type_hints

Cell = str | float | int | None
DIGITS = 4  # for people; files for programs hold all


@dataclass(frozen=True)
class Column:
    """A column: name, unit, and its meaning if the name does not say it."""

    name: str
    unit: str = ""
    about: str = ""

    @property
    def head(self) -> str:
        """Name with unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes
    ----------
    key : str
        Its name for programs, and its anchor on the page.
    caption : str
        What it shows.
    rows : tuple
        At least one, all of one type.
    """

    key: str
    caption: str
    rows: tuple[Any, ...]

    @property
    def columns(self) -> tuple[Column, ...]:
        """From left to right."""
        hints = get_type_hints(type(self.rows[0]), include_extras=True)
        return tuple(hint.__metadata__[0] for hint in hints.values())

    @property
    def cells(self) -> tuple[tuple[Cell, ...], ...]:
        """Values row by row; None where nothing is known, infinite where the meter showed overload."""
        names = [f.name for f in fields(self.rows[0])]
        values = ((getattr(row, name) for name in names) for row in self.rows)
        return tuple(tuple(None if isinstance(v, float) and isnan(v) else v for v in row) for row in values)


def shown(cell: Cell) -> str:
    """A cell for people.

    >>> [shown(v) for v in (None, float("inf"), 1234.5678, 7, "a")]
    ['–', '∞', '1235', '7', 'a']
    """
    if cell is None:
        return "–"
    if isinstance(cell, str):
        return cell
    if isinf(cell):
        return "∞"
    if isinstance(cell, int) or (cell == int(cell) and abs(cell) < 1e6):
        return f"{cell:.0f}"
    return f"{cell:.{DIGITS}g}"


def exact(cell: Cell) -> str:
    """A cell for programs, all digits; "" for nothing.

    >>> [exact(v) for v in (None, float("inf"), 0.1, "a")]
    ['', 'inf', '0.1', 'a']
    """
    if cell is None:
        return ""
    return cell if isinstance(cell, str) else repr(cell if isinstance(cell, int) else float(cell))


def plain(cell: Cell) -> Cell:
    """A cell for JSON, which has no infinity."""
    return cell if isinstance(cell, str) or cell is None or isfinite(cell) else "inf"
