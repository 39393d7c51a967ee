"""Predictions and measurements of an iteration, compared."""

from sensorgen.analysis.report.contents import Report, Section, report

FORMATS = ("html", "md", "csv", "json")

__all__ = ["FORMATS", "Report", "Section", "report", "written"]


def written(made: Report, how: str) -> str:
    """A report as text.

    Parameters
    ----------
    made : Report
        As :func:`report` makes it.
    how : str
        One of ``FORMATS``.
    """
    from sensorgen.analysis.report.formats import WRITERS

    return WRITERS[how](made)
