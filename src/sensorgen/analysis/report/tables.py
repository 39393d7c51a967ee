"""Tables of a report: numbers once, for people and for programs."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, isinf, isnan

Cell = str | float | int | None
DIGITS = 4  # that people are shown; files for programs hold all


@dataclass(frozen=True)
class Column:
    """A column: its name, its unit, and what it means where the name does not tell."""

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
    columns : tuple of Column
        From left to right.
    rows : tuple of tuple
        Cells; None where nothing is known, infinite where the meter showed overload.
    """

    key: str
    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]


def table(key: str, caption: str, columns: Sequence[Column], rows: Sequence[Sequence[Cell]]) -> Table:
    """A table whose cells that are not numbers are nothing."""
    cleaned = tuple(tuple(None if isinstance(v, float) and isnan(v) else v for v in row) for row in rows)
    return Table(key, caption, tuple(columns), cleaned)


def said(cell: Cell) -> str:
    """A cell for people.

    >>> [said(v) for v in (None, float("inf"), 1234.5678, 7, "a")]
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
