"""Display of results in a notebook: by their document, or as the packages above register."""

from functools import singledispatch
from html import escape
from typing import Any


@singledispatch
def html(thing: object) -> str:
    """A result as HTML."""
    if not hasattr(thing, "document"):
        return f"<pre>{escape(repr(thing))}</pre>"
    from sensorgen.core import document

    return document.html(thing.document())


@singledispatch
def figure(thing: object) -> Any:
    """A result as a matplotlib figure; raises TypeError where it has none."""
    raise TypeError(f"{type(thing).__name__} has no figure; import sensorgen first")


class Displayed:
    """A result that a notebook shows as a table, with a figure by :meth:`plot`."""

    def _repr_html_(self) -> str:
        return html(self)

    def plot(self) -> Any:
        """The result as a matplotlib figure."""
        return figure(self)
