"""Content of a result: paragraphs, facts and tables; as text, Markdown, HTML, CSV or JSON.

A result that a command prints or a notebook displays has a method ``document()`` that yields these parts.
"""

import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from html import escape
from math import isfinite, isinf, isnan
from types import MappingProxyType
from typing import Any, Protocol, Self, get_type_hints

from sensorgen.core.lazy import Lazy
from sensorgen.core.units import si

Cell = str | float | int | None
DIGITS = 4  # for people; files for programs hold all
WIDTH = 80  # columns of a terminal
_LEAST = 20  # columns into which words are wrapped
MOST_ROWS = 500  # of a table in HTML: a browser has to load and lay out all of them, and no one reads more
_MARKDOWN = str.maketrans({c: f"\\{c}" for c in "\\`*_{}[]<>#|!~$&"})
_NAMES = ("specimen", "name")  # of the column that names a row, else the first
_wrapped = partial(textwrap.wrap, width=WIDTH, break_on_hyphens=False, break_long_words=False)  # names stay whole
_APART = frozenset(',"\r\n')  # letters for which CSV quotes a cell
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "'", "＝", "＋", "－", "＠")


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    name, unit, about : str
        Head, unit, and its meaning if the name does not say it.
    digits : int
        For people [-].
    key : str
        Its name in CSV.
    si : bool
        People see each number with its unit and an SI prefix, in place of the unit in the head.
    hidden : bool
        For programs alone: CSV has it, text, Markdown and HTML do not.
    right : bool
        Its words stand to the right, as numbers do.
    """

    name: str
    unit: str = ""
    about: str = ""
    digits: int = DIGITS
    key: str = ""
    si: bool = False
    hidden: bool = False
    right: bool = False

    @property
    def head(self) -> str:
        """Name with unit."""
        return f"{self.name} [{self.unit}]" if self.unit and not self.si else self.name

    def words(self, cell: Cell) -> str:
        """A cell for people."""
        if self.si and isinstance(cell, (float, int)) and isfinite(cell):
            return si(cell, self.unit, self.digits)
        return shown(cell, self.digits)


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes
    ----------
    key : str
        Its name for programs, and its anchor on a page.
    caption : str
        What it shows; may be empty.
    columns : tuple of Column
        From left to right.
    cells : tuple of tuple
        Values row by row; None where nothing is known, infinite where a meter showed overload.
    rows : tuple
        The dataclasses that they were taken from, if any.
    """

    key: str
    caption: str
    columns: tuple[Column, ...]
    cells: Sequence[tuple[Cell, ...]]
    rows: Sequence[Any] = ()

    @classmethod
    def of(cls, key: str, caption: str, rows: Sequence[Any]) -> Self:
        """A table of dataclasses of one type, at least one; fields annotated with a ``Column`` are its columns."""
        hints = get_type_hints(type(rows[0]), include_extras=True)
        columns = {f.name: c for f in fields(rows[0]) for c in getattr(hints[f.name], "__metadata__", ())[:1]}

        def cells(row: Any) -> tuple[Cell, ...]:
            values = (getattr(row, name) for name in columns)
            return tuple(None if isinstance(v, float) and isnan(v) else v for v in values)

        members = rows if isinstance(rows, Lazy) else tuple(rows)
        return cls(
            key, caption, tuple(replace(c, key=name) for name, c in columns.items()), _each(members, cells), members
        )

    @classmethod
    def some(cls, key: str, caption: str, rows: Sequence[Any]) -> tuple[Self, ...]:
        """A table as :meth:`of`; none without rows."""
        return (cls.of(key, caption, rows),) if rows else ()

    def beside(self, column: Column, values: Sequence[Cell]) -> "Table":
        """The table with one more column before the first."""
        cells = tuple((value, *row) for value, row in zip(values, self.cells, strict=True))
        return replace(self, columns=(column, *self.columns), cells=cells)

    def words(self) -> Iterator[list[str]]:
        """Cells as words, row by row."""
        return ([c.words(v) for c, v in zip(self.columns, row, strict=True)] for row in self.cells)

    def filled(self) -> "Table":
        """The table for people: without hidden columns, and those that are empty in every row."""
        used = {k for row in self.cells for k, cell in enumerate(row) if cell not in (None, "")}
        shown_columns = [k for k, column in enumerate(self.columns) if k in used and not column.hidden]
        cells = _each(self.cells, lambda row: tuple(row[k] for k in shown_columns))
        return replace(self, columns=tuple(self.columns[k] for k in shown_columns), cells=cells)


def _each(rows: Sequence[Any], change: Callable[[Any], tuple[Cell, ...]]) -> Sequence[tuple[Cell, ...]]:
    """Every row changed: at once, or when it is read."""
    return rows.map(change) if isinstance(rows, Lazy) else tuple(map(change, rows))


@dataclass(frozen=True)
class Facts:
    """Names with what is to be said of each; one of an empty name goes on with the one before.

    Attributes
    ----------
    rows : tuple of (str, str)
        Name and text.
    hang : int
        By how many columns the lines of a long text after the first stand further right [-].
    """

    rows: tuple[tuple[str, str], ...]
    hang: int = 0


Part = str | Facts | Table


class Documented(Protocol):
    """A result that says what it shows."""

    def document(self) -> Iterable[Part]:
        """Parts in the order of reading; "" is an empty line."""
        ...


def shown(cell: Cell, digits: int = DIGITS) -> str:
    """A cell for people; no exponent from 0.0001 to a million.

    >>> [shown(v) for v in (None, float("nan"), float("inf"), 1234.5678, 12345.678, 7, True, "a")]
    ['–', '–', '∞', '1235', '12350', '7', 'yes', 'a']
    """
    if cell is None or cell != cell:
        return "–"
    if isinstance(cell, str):
        return cell
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinf(cell):
        return "∞"
    if isinstance(cell, int) or (cell == int(cell) and abs(cell) < 1e6):
        return f"{cell:.0f}"
    return f"{float(f'{cell:.{digits}g}'):.{max(digits, 6)}g}"


def visible(words: str) -> str:
    r"""Words of strangers, their control characters shown instead of obeyed by the terminal.

    >>> visible("a\x1b[2J")
    'a\\x1b[2J'
    """
    if words.isprintable():
        return words
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in words)


def some(words: Sequence[str], most: int) -> str:
    """The first of many words, and the number of the others.

    >>> some(["a", "b", "c"], 2), some(["a"], 2)
    ('a, b and 1 more', 'a')
    """
    return ", ".join(words[:most]) + (f" and {len(words) - most} more" if len(words) > most else "")


def exact(cell: Cell) -> str:
    """A cell for programs, all digits; "" for nothing.

    >>> [exact(v) for v in (None, float("inf"), 0.1, True, "a")]
    ['', 'inf', '0.1', 'true', 'a']
    """
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return str(cell).lower()
    return cell if isinstance(cell, str) else repr(cell if isinstance(cell, int) else float(cell))


def plain(cell: Cell) -> Cell:
    """A cell for JSON, which has no infinity."""
    return cell if isinstance(cell, str) or cell is None or isfinite(cell) else "inf"


def text(parts: Iterable[Part]) -> Iterator[str]:
    """Lines for a terminal: paragraphs and facts wrapped, tables with columns below each other."""
    for part in parts:
        if isinstance(part, str):
            yield from _wrapped(visible(part), subsequent_indent="  ") or [""]
        elif isinstance(part, Facts):
            yield from _facts(part)
        else:
            yield from _wrapped(visible(part.caption))
            yield from _aligned(part.filled())


def _facts(part: Facts) -> Iterator[str]:
    wide = max(len(name) for name, _ in part.rows) + 2
    hanging = " " * (wide + part.hang)
    for name, words in part.rows:
        yield from _wrapped(visible(words), initial_indent=f"{name:{wide}}", subsequent_indent=hanging)


def _aligned(table: Table) -> Iterator[str]:
    """Numbers to the right, words to the left; words of the last column are wrapped."""
    rows = (list(map(visible, words)) for words in table.words())
    worded, lines = _worded(table), [[c.head for c in table.columns], *rows]
    wide = [max(map(len, column)) for column in zip(*lines, strict=True)]
    before = sum(wide[:-1]) + 2 * (len(wide) - 1)
    for line in lines:
        cells = [f"{v:<{w}}" if words else f"{v:>{w}}" for v, w, words in zip(line, wide, worded, strict=True)]
        if not worded[-1]:
            yield "  ".join(cells).rstrip()
            continue
        last = _wrapped(line[-1], width=max(WIDTH - before, _LEAST)) or [""]
        yield "  ".join([*cells[:-1], last[0]]).rstrip()
        yield from (" " * before + more for more in last[1:])


def _worded(table: Table) -> list[bool]:
    """Mask of the columns of words, which stand to the left."""
    words = {k for row in table.cells for k, cell in enumerate(row) if isinstance(cell, str)}
    return [k in words and not column.right for k, column in enumerate(table.columns)]


def markdown(parts: Iterable[Part]) -> Iterator[str]:
    """Lines of Markdown, in which no sign of a value has a meaning."""
    for part in parts:
        if isinstance(part, str):
            yield from ("", safe(part)) if part else ()
        elif isinstance(part, Facts):
            yield from ("", *(f"- {safe(f'{name}: {words}' if name else words)}" for name, words in part.rows))
        else:
            yield from _markdown_table(part.filled())


def _markdown_table(table: Table) -> Iterator[str]:
    """A table; one of a single row as a list."""
    yield from ("", f"**{safe(table.caption)}**", "") if table.caption else ("",)
    if len(table.cells) == 1:
        for column, cell in zip(table.columns, table.cells[0], strict=True):
            yield f"- {safe(column.head)}: {safe(column.words(cell))}"
        return
    worded = _worded(table)
    yield f"| {' | '.join(safe(c.head) for c in table.columns)} |"
    yield f"|{'|'.join('---' if words else '---:' for words in worded)}|"
    for words in table.words():
        yield f"| {' | '.join(map(safe, words))} |"


def safe(words: str) -> str:
    """Words whose signs mean nothing to Markdown, on one line."""
    return visible(" ".join(words.split())).translate(_MARKDOWN)


def html(parts: Iterable[Part]) -> str:
    """A fragment of a page, whose script lets the heads of a table sort it."""
    return "".join(_html(part) for part in parts if part)


def _html(part: Part) -> str:
    if isinstance(part, str):
        return _tag("p", part)
    if isinstance(part, Facts):
        return _scrolled(_row(_tag("td", name), _tag("td", words)) for name, words in part.rows)
    table, caption, count = replace(part, cells=tuple(part.cells[:MOST_ROWS])).filled(), part.caption, len(part.cells)
    if count > MOST_ROWS:
        caption += f" (the first {MOST_ROWS} of {count} rows; CSV has all)"
    if count == 1:  # a line for each column
        pairs = zip(table.columns, table.cells[0], strict=True)
        return _scrolled((_row(_html_head(c, "row"), _html_cell(c, cell)) for c, cell in pairs), caption, part.key)
    return _scrolled(_html_rows(table), caption, part.key)


def _html_rows(table: Table) -> Iterator[str]:
    names = [c.name for c in table.columns]
    named = next((names.index(name) for name in _NAMES if name in names), 0)
    heads = (_html_head(c, "col", words) for c, words in zip(table.columns, _worded(table), strict=True))
    yield f"<thead>{_row(*heads)}</thead><tbody>"
    for row in table.cells:
        cells = enumerate(zip(table.columns, row, strict=True))
        yield _row(*(_html_cell(c, v, k == named) for k, (c, v) in cells))
    yield "</tbody>"


def _html_head(column: Column, scope: str, worded: bool = True) -> str:
    kind = None if worded else "n"
    return _tag("th", column.head, {"scope": scope, "class": kind, "title": column.about or None})


def _html_cell(column: Column, cell: Cell, head: bool = False) -> str:
    """A cell, with all digits of a number to sort by."""
    worded = isinstance(cell, str)
    attributes = {
        "scope": "row" if head else None, "class": "n" if column.right or not worded else None,
        "data-value": None if worded else exact(cell),
    }  # fmt: skip
    return _tag("th" if head else "td", column.words(cell), attributes)


def _scrolled(rows: Iterable[str], caption: str = "", key: str = "") -> str:
    """A table that moves within the page where it is wider."""
    label = f' role="region" aria-label="{escape(caption)}"' if caption else ""
    inside = _tag("caption", caption) + "".join(rows) if caption else "".join(rows)
    return f'<div class="scroll" tabindex="0"{label}><table data-table="{escape(key)}">{inside}</table></div>'


def _row(*cells: str) -> str:
    return f"<tr>{''.join(cells)}</tr>"


def _tag(name: str, words: str, attributes: Mapping[str, str | None] = MappingProxyType({})) -> str:
    """An element with text and those attributes that have a value."""
    named = "".join(f' {key}="{escape(value)}"' for key, value in attributes.items() if value is not None)
    return f"<{name}{named}>{escape(words)}</{name}>"


def to_json(result: Any) -> str:
    """A result, or a sequence of results of one type, as indented JSON; null for what is not finite.

    A result with a schema of its own writes itself: ``to_json()``.
    """
    if hasattr(result, "to_json"):
        return str(result.to_json())
    from pydantic import TypeAdapter

    many = isinstance(result, Sequence)
    kind: Any = tuple[type(result[0]), ...] if many and result else type(result)  # type: ignore[misc]
    return TypeAdapter(kind).dump_json(tuple(result) if many else result, indent=2).decode() + "\n"


def apart(*blocks: Iterable[Part]) -> Iterator[Part]:
    """Blocks below others, each behind an empty line; those that hold nothing are left out."""
    for block in blocks:
        parts = list(block)
        yield from ["", *parts] if parts else ()


def csv_row(cells: Iterable[str]) -> str:
    """Words as a row of CSV, quoted where they would come apart."""
    quoted = ('"' + c.replace('"', '""') + '"' if not _APART.isdisjoint(c) else c for c in cells)
    return ",".join(quoted) + "\n"


def comma_separated(table: Table) -> str:
    """A table as CSV with all digits and all columns."""
    rows = (map(spreadsheet, row) for row in table.cells)
    return "".join(map(csv_row, ((c.key or c.head for c in table.columns), *rows)))


def spreadsheet(cell: Cell) -> str:
    """A cell for programs; text that a spreadsheet would take for a formula gets an apostrophe."""
    words = exact(cell)
    return f"'{words}" if isinstance(cell, str) and words.startswith(_FORMULA) else words
