"""Predictions and measurements of an iteration, compared."""

from collections.abc import Iterator

from sensorgen.analysis.plots.pages import PageSection
from sensorgen.analysis.report.contents import Report, report

FORMATS = ("html", "md", "csv", "json")

__all__ = ["FORMATS", "PageSection", "Report", "pieces", "report", "written"]


def written(content: Report, how: str) -> str:
    """A report as text; parameters as :func:`pieces`."""
    return "".join(pieces(content, how))


def pieces(content: Report, how: str) -> Iterator[str]:
    """A report as pieces of text, one after the other.

    Parameters
    ----------
    made : Report
        As :func:`report` makes it.
    how : str
        One of ``FORMATS``.
    """
    from sensorgen.analysis.report.contents import WRITERS

    yield from WRITERS[how](content)
