"""Display of results in a notebook and of strangers' text on a terminal, without characters that the terminal obeys."""

import re
from functools import singledispatch
from io import StringIO
from typing import TYPE_CHECKING, Any, ClassVar, cast

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sensorgen.core.document import Part

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def harmless(text: str) -> str:
    r"""Text without these characters.

    >>> harmless("a\x1b]0;title\x07b\tc\n")
    'a]0;titleb\tc\n'
    """
    return _CONTROL.sub("", text)


def escaped(text: str) -> str:
    r"""Escape a text for JSON, where nothing of it may be lost.

    >>> escaped('"a\u202eb"' + "\n")
    '"a\\u202eb"\n'
    """
    return _CONTROL.sub(lambda match: f"\\u{ord(match[0]):04x}", text)


LINES = 20  # of a result where it is not printed on purpose
_STYLE = (  # as that of pages, which a notebook's own colours may overlay
    ".sensorgen table{border-collapse:collapse;font-size:.86rem}"
    ".sensorgen td,.sensorgen th{padding:.2rem .55rem;border-bottom:1px solid #8886;text-align:left}"
    ".sensorgen p{margin:.2rem 0}.sensorgen .scroll{overflow-x:auto}"
)


@singledispatch
def parts(thing: Any) -> "Iterable[Part]":
    """Paragraphs, facts and tables of a result; how it calls itself where it has none."""
    return cast("Iterable[Part]", thing.document()) if hasattr(thing, "document") else (repr(thing),)


@singledispatch
def html(thing: object) -> str:
    """A result as HTML."""
    from sensorgen.core import document

    return document.html(parts(thing))


@singledispatch
def figure(thing: object) -> Any:
    """A result as a matplotlib figure; raises TypeError where it has none."""
    raise TypeError(f"{type(thing).__name__} has no figure")


class Boundless:
    """A record whose JSON has "Infinity" where it is infinite; others have null."""

    __pydantic_config__: ClassVar[dict[str, str]] = {"ser_json_inf_nan": "strings"}


class Displayed:
    """A result that shows itself: a table in a notebook, its first lines elsewhere, a figure by :meth:`plot`."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.__repr__ = Displayed.__repr__  # type: ignore[method-assign]  # a dataclass would write all that it holds

    def __repr__(self) -> str:
        from sensorgen.core.errors import SensorgenError

        try:
            lines = self.text().splitlines()
        except SensorgenError as error:  # as of too many points for a table
            return f"<{type(self).__name__}: {error}>"
        more = [f"... {len(lines) - LINES + 1} more lines in text()"]
        return "\n".join(lines if len(lines) <= LINES else lines[: LINES - 1] + more)

    def _repr_html_(self) -> str:
        return f'<div class="sensorgen"><style>{_STYLE}</style>{html(self)}</div>'

    def text(self) -> str:
        """The result as the command line prints it."""
        from sensorgen.core import document

        return "\n".join(document.text(parts(self)))

    def plot(self) -> Any:
        """The result as a matplotlib figure."""
        return figure(self)

    def to_pandas(self) -> Any:
        """The table as a pandas DataFrame, of several that of CSV or the first; raises MissingValue without pandas."""
        from sensorgen.core.document import Table
        from sensorgen.core.errors import library

        pd = library("pandas", "to_pandas() needs pandas: pip install pandas")
        if hasattr(self, "csv"):
            return pd.read_csv(StringIO("".join(self.csv())))
        table = self.table() if hasattr(self, "table") else next((p for p in parts(self) if isinstance(p, Table)), None)
        columns = [column.key or column.head for column in table.columns] if table else []
        return pd.DataFrame(list(table.cells) if table else [], columns=columns)
